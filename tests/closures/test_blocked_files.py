"""Files of closed areas, and the option that takes them beside doors and rooms."""

import json
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

import hybridnav as hn
from hybridnav.maps import Frame
from tests.strategies import drawn, examples, occupancy_grid

# Two rooms over a hall; kitchen and lab have a door each to the hall and one between them.
HOUSE = drawn(
    "#########",
    "#...#...#",
    "#.......#",
    "#...#...#",
    "##.###.##",
    "#.......#",
    "#.......#",
    "#########",
)
BOX = [[[1, 1], [3, 1], [3, 3], [1, 3], [1, 1]]]
LINE = [[4.5, 1], [4.5, 3]]


@pytest.fixture
def grid() -> hn.OccupancyGrid:
    return occupancy_grid(HOUSE)


def geometry(kind: str, coordinates: Any) -> dict[str, Any]:
    return {"type": kind, "coordinates": coordinates}


def collection(*geometries: Any) -> dict[str, Any]:
    features = [{"type": "Feature", "properties": {}, "geometry": one} for one in geometries]
    return {"type": "FeatureCollection", "features": features}


def closed_by(blocked: hn.Blocked, grid: hn.OccupancyGrid) -> list[int]:
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    return list(blocked.cells_of(topology))


@pytest.mark.parametrize(
    ("kind", "coordinates"),
    [
        ("Polygon", BOX),
        ("Polygon", [[[*point, 7.5] for point in BOX[0]]]),
        ("Polygon", [[[1, 1], [6, 1], [6, 6], [1, 6]], [[2, 2], [4, 2], [4, 4], [2, 4]]]),
        ("MultiPolygon", [BOX, [[[5, 5], [7, 5], [7, 7]]]]),
        ("LineString", LINE),
        ("MultiLineString", [LINE, [[1, 5], [3.5, 6.5], [7, 5]]]),
    ],
)
def test_geojson_closes_what_its_geometries_close(grid, tmp_path, kind, coordinates):
    area = shapely.force_2d(shapely.geometry.shape(geometry(kind, coordinates)))
    expected = closed_by(hn.Blocked(polygons=[area]), grid)
    assert expected
    one = geometry(kind, coordinates)
    for number, data in enumerate((one, {"type": "Feature", "geometry": one}, collection(one))):
        path = tmp_path / f"{number}.{'geojson' if number else 'JSON'}"
        path.write_text(json.dumps(data), encoding="utf-8-sig" if number else "utf-8")
        assert closed_by(hn.load_blocked(path, grid), grid) == expected
    path.write_text(json.dumps(collection(one, geometry("LineString", [[1.5, 6], [1.5, 7]]))))
    both = closed_by(hn.load_blocked(path, grid), grid)
    assert set(both) > set(expected)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", ", line 1: Expecting value"),
        (b"{", ", line 1: "),
        (b'{"type": "Feature"\n', ", line 2: "),
        (b"\xff\xfe", "not UTF-8"),
        (b"[" * 200_000, "nested too deep"),
        (b'{"a":' * 100_000, "nested too deep"),
        (b"[" + b"1," * 200_000 + b"1]", "more than 100000 values"),
        (b" " * (2**22 + 1), "more than 4194304 bytes"),
        (b'{"type": "Polygon", "type": "LineString"}', "a key is given twice"),
        (b"[1, 2]", "expected a GeoJSON object, got [1, 2]"),
        (b"null", "expected a GeoJSON object"),
        (b'{"coordinates": ' + b"9" * 5000 + b"}", "digits"),
        ({"type": "FeatureCollection"}, "features must be a list, got None"),
        (collection(), "closes nothing, expected at least one feature"),
        (collection(geometry("Polygon", BOX), None), "feature 2: expected a geometry of Polygon"),
        ({"type": "FeatureCollection", "features": [3]}, "feature 1: expected a Feature, got 3"),
        (geometry("Point", [1, 1]), "expected a geometry of Polygon, MultiPolygon, LineString"),
        (geometry("GeometryCollection", []), "got 'GeometryCollection'"),
        ({"type": ["Polygon"]}, "expected a geometry"),
        (geometry("Polygon", []), "lists of positions, got []"),
        (geometry("Polygon", None), "lists of positions, got None"),
        (geometry("Polygon", [[[1, 1], [2, 2]]]), "a Polygon needs 3 points, got 2"),
        (geometry("LineString", [[1, 1]]), "a LineString needs 2 points, got 1"),
        (geometry("LineString", [[1, 1], [1]]), "a position must be [x, y]"),
        (geometry("LineString", [[1, 1], ["1", 2]]), "a position must be [x, y]"),
        (geometry("LineString", [[1, 1], [True, 2]]), "a position must be [x, y]"),
        (geometry("LineString", [[1, 1], [float("nan"), 2]]), "a position must be [x, y]"),
        (b'{"type": "LineString", "coordinates": [[1, 1], [1e999, 2]]}', "finite numbers"),
        (geometry("LineString", [[1, 1], [10**400, 2]]), "finite numbers"),
        (geometry("LineString", [[1, 1], [1e308, 2]]), "within 1e+12 cells of the map"),
        (geometry("LineString", [[1, 1], [1, 1]]), "must be simple"),
        (geometry("Polygon", [[[1, 1], [4, 4], [4, 1], [1, 4]]]), "must be simple"),
        (geometry("Polygon", [[[1, 1], [2, 2], [3, 3]]]), "must be simple"),
        (collection(geometry("Polygon", BOX), geometry("LineString", [[90, 90], [91, 91]])),
         "feature 2: an area must meet the map, which spans x 0.00 to 9.00 m"),
    ],
)  # fmt: skip
def test_hostile_geojson_ends_in_one_line(grid, tmp_path, data, words):
    path = tmp_path / "works.geojson"
    path.write_bytes(data if isinstance(data, bytes) else json.dumps(data).encode())
    with pytest.raises(hn.errors.MapError) as caught:
        hn.load_blocked(path, grid)
    assert str(caught.value).startswith(f"blocked {path}")
    assert words in str(caught.value)
    assert str(caught.value).isprintable()


WHOLE = json.dumps(collection(geometry("Polygon", BOX), geometry("LineString", LINE))).encode()


@given(st.data())
@settings(
    max_examples=examples(150),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_damaged_geojson_is_read_or_refused(grid, tmp_path, data):
    content = bytearray(WHOLE[: data.draw(st.integers(0, len(WHOLE)))])
    for at in data.draw(st.lists(st.integers(0, max(len(content) - 1, 0)), max_size=3)):
        if content:
            content[at] = data.draw(st.integers(0, 255))
    path = tmp_path / "works.geojson"
    path.write_bytes(bytes(content))
    try:
        blocked = hn.load_blocked(path, grid)
    except hn.errors.MapError as error:
        told = str(error)
    else:
        told = f"{len(closed_by(blocked, grid))} closed"
    assert told.isprintable()
    assert told != "0 closed"


def test_an_endless_outline_is_refused_before_it_is_followed(tmp_path: Any) -> None:
    grid = hn.OccupancyGrid(np.zeros((500, 500), dtype=np.float32), robot_radius_m=5.0)
    up_and_down = [[10 + i / 100, 10 + 480 * (i % 4 in {1, 2})] for i in range(1000)]
    path = tmp_path / "works.geojson"
    path.write_text(json.dumps(geometry("LineString", up_and_down)))
    with pytest.raises(
        hn.errors.MapError, match=r"outlines of 24\d{4} cells on the map, at most 50000"
    ):
        hn.load_blocked(path, grid)
    path.write_text(json.dumps(geometry("LineString", up_and_down[:150])))
    assert hn.load_blocked(path, grid).polygons
    beyond = [[[-1e9, -1e9], [1e9, -1e9], [1e9, 1e9], [-1e9, 1e9]]]
    path.write_text(json.dumps(geometry("Polygon", beyond)))
    assert hn.load_blocked(path, grid).polygons


def test_files_that_are_not_there_or_not_meant(grid: hn.OccupancyGrid, tmp_path: Any) -> None:
    for name in ("none.geojson", "none.png"):
        with pytest.raises(hn.errors.MapNotFoundError, match="no such file"):
            hn.load_blocked(tmp_path / name, grid)
    (tmp_path / "works.txt").write_text("{}")
    with pytest.raises(hn.errors.MapError, match="not an image"):
        hn.load_blocked(tmp_path / "works.txt", grid)


def grey(shape: tuple[int, int], **pixels: Any) -> Any:
    image = np.full(shape, 254, dtype=np.uint8)
    for (row, col), value in pixels["at"].items():
        image[row, col] = value
    return image


@pytest.mark.parametrize("name", ["mask.pgm", "mask.png"])
def test_dark_pixels_of_a_mask_close_their_cells(tmp_path: Any, name: str) -> None:
    frame = Frame(0.5, (-3.0, 2.0), 0.4)
    probability = occupancy_grid(HOUSE).probability
    grid = hn.OccupancyGrid(probability, frame, occupied_threshold=0.6, robot_radius_m=0.4)
    # 255 * (1 - 0.6) = 102: what is as dark as that closes. The top row of pixels is the last.
    image = grey(grid.shape, at={(0, 0): 0, (2, 3): 102, (3, 3): 103, (4, 5): 205})
    Image.fromarray(image).save(tmp_path / name)
    blocked = hn.load_blocked(tmp_path / name, grid)
    assert np.asarray(blocked.cells).tolist() == [[5, 3], [7, 0]]
    assert closed_by(blocked, grid) == [5 * 9 + 3, 7 * 9]


def test_transparent_pixels_of_a_mask_close_nothing(grid: hn.OccupancyGrid, tmp_path: Any) -> None:
    image = np.zeros((*grid.shape, 4), dtype=np.uint8)
    Image.fromarray(image).save(tmp_path / "mask.png")
    assert closed_by(hn.load_blocked(tmp_path / "mask.png", grid), grid) == []
    image[2, 4, 3] = 255
    Image.fromarray(image).save(tmp_path / "mask.png")
    assert np.asarray(hn.load_blocked(tmp_path / "mask.png", grid).cells).tolist() == [[5, 4]]


def test_a_mask_that_does_not_fit_is_refused(grid: hn.OccupancyGrid, tmp_path: Any) -> None:
    Image.fromarray(np.zeros((9, 8), dtype=np.uint8)).save(tmp_path / "mask.png")
    with pytest.raises(
        hn.errors.MapError, match="a mask of 8 x 9 pixels, expected 9 x 8, those of"
    ):
        hn.load_blocked(tmp_path / "mask.png", grid)
    Image.fromarray(grey(grid.shape, at={(1, 1): 205})).save(tmp_path / "mask.png")
    assert closed_by(hn.load_blocked(tmp_path / "mask.png", grid), grid) == []
    (tmp_path / "mask.png").write_bytes((tmp_path / "mask.png").read_bytes()[:50])
    with pytest.raises(hn.errors.MapError, match=r"mask\.png"):
        hn.load_blocked(tmp_path / "mask.png", grid)


# --- the command --------------------------------------------------------------------------------


@pytest.fixture
def query(tmp_path: Any) -> tuple[Any, ...]:
    """A plan on the map, as a ROS map with its rooms beside it."""
    Image.fromarray(np.where(HOUSE[::-1] == 0, 0, 254).astype(np.uint8)).save(tmp_path / "m.pgm")
    path = tmp_path / "house.yaml"
    path.write_text(
        "image: m.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    label_of = np.full(HOUSE.shape, -1, dtype=np.int32)
    label_of[3:, :5], label_of[3:, 5:], label_of[:3] = 0, 1, 2
    rooms = hn.RoomLabels(("kitchen", "lab", "hall"), label_of)
    hn.save_rooms(tmp_path / "rooms.yaml", rooms, hn.load_map(path))
    Image.fromarray(grey(HOUSE.shape, at={(2, 4): 0})).save(tmp_path / "mask.png")
    (tmp_path / "line.geojson").write_text(json.dumps(geometry("LineString", [[4.5, 4], [4.5, 7]])))
    (tmp_path / "bad.geojson").write_text("{")
    return ("plan", path, "--robot-radius", "0")


NAMED = ("--from", "kitchen", "--to", "lab", "--at", "point")
POINTS = ("--start", "1.5,5.5", "--goal", "7.5,5.5")


def test_the_command_closes_doors_rooms_and_files(cli: Any, query: Any, tmp_path: Any) -> None:
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(
            grid := hn.load_map(query[1]), rooms=hn.load_rooms(tmp_path / "rooms.yaml", grid)
        )
    )
    (direct,) = (d for d in topology.rooms.doors if set(d.rooms) == {"kitchen", "lab"})
    shut = f"door:{direct.number}"
    opened = cli(*query, *NAMED, "--json").answer
    assert [leg["room"] for leg in opened["legs"]] == ["kitchen", "lab"]
    assert opened["blocked"] is None
    lengths = {}
    for closed in (shut, tmp_path / "mask.png", tmp_path / "line.geojson"):
        answer = cli(*query, *NAMED, "--blocked", closed, "--json").answer
        assert answer["status"] == "solved"
        assert answer["blocked"] == [str(closed)]
        assert [leg["room"] for leg in answer["legs"]] == ["kitchen", "hall", "lab"]
        assert opened["length_m"] < answer["length_m"] == answer["lower_bound"]
        lengths[closed] = cli(*query, *POINTS, "--blocked", closed, "--json").answer["length_m"]
    assert len(set(lengths.values())) == 1
    both = (*query, *NAMED, "--blocked", shut, "--blocked", "room:hall")
    done = cli(*both)
    assert done.code == 1
    assert f"blocked    {shut}, room:hall\npreset     shortest\nstatus     no path\n" in done.out
    done = cli(*query, *NAMED, "--blocked", "room:kitchen")
    assert done.code == 1
    assert "status     start blocked" in done.out
    routes = cli(*query, *NAMED, "--blocked", shut, "--alternatives", "3", "--json").answer
    assert len(routes["alternatives"]) == 1
    plain = cli(*query, *NAMED, "--blocked", shut, "--json").answer
    assert routes["alternatives"][0]["length_m"] == plain["length_m"]


@pytest.mark.parametrize("endpoints", [POINTS, ("--from", "1.5,5.5", "--to", "7.5,5.5")])
def test_json_has_the_same_keys_however_ends_are_given(cli, query, tmp_path, endpoints):
    closed = ("--blocked", tmp_path / "line.geojson")
    far = [text.replace("7.5,5.5", "99,99") for text in endpoints]
    for rooms in ((), ("--rooms", tmp_path / "rooms.yaml")):
        assert cli(*query, *endpoints, *rooms, "--json").answer["blocked"] is None
        done = cli(*query, *far, *rooms, *closed, "--json")
        assert done.answer["status"] == "goal outside the map"
        assert done.answer["blocked"] == [str(closed[1])]
        assert f"blocked    {closed[1]}\n" in cli(*query, *far, *rooms, *closed).out
        seconds = cli(*query, *endpoints, *rooms, *closed, "--json").answer["seconds"]
        assert {"load", "pyramid", "prepare", "mesh", "shortest"} <= seconds.keys()


def test_a_comparison_closes_the_same_for_the_whole_grid(cli, query, tmp_path):
    closed = ("--preset", "octile", "--blocked", tmp_path / "mask.png")
    done = cli(*query, *POINTS, "--compare", *closed, "--json").answer
    assert done["status"] == "solved"
    assert done["optimum_m"] == pytest.approx(done["length_m"])
    assert done["loss"] == pytest.approx(0, abs=1e-9)
    told = cli(*query, *POINTS, "--blocked", tmp_path / "mask.png")
    assert f"blocked    {tmp_path / 'mask.png'}\n" in told.out


@pytest.mark.parametrize("endpoints", [NAMED, POINTS])
@pytest.mark.parametrize(
    ("closed", "code", "words"),
    [
        ("door:9", 2, ["no door has the number 9", "the doors are 1-3"]),
        ("door:", 2, ["door:N, room:NAME, keepout:FILE, one-way:RULE or a file", "'door:'"]),
        ("door:x", 2, ["number of a door", "'x'"]),
        ("room:kichen", 2, ["'kichen'", "did you mean kitchen"]),
        ("room:", 2, ["'room:'"]),
        ("", 2, ["''"]),
        ("nothing.geojson", 3, ["nothing.geojson", "no such file"]),
        ("BAD", 3, ["bad.geojson, line 1"]),
        ("keepout:", 2, ["'keepout:'"]),
        ("keepout:zones.yaml,size=3", 2, ["keepout takes KEY=VALUE with", "'size=3'"]),
        ("keepout:zones.yaml,multiplier=3", 2, ["keepout takes x, y and yaw"]),
        ("keepout:zones.yaml,x=here", 2, ["x must be a number, got 'here'"]),
        ("keepout:zones.yaml", 3, ["zones.yaml", "no such file"]),
    ],
)
def test_what_names_nothing_is_refused_by_the_command(  # noqa: PLR0913, PLR0917
    cli: Any, query: Any, tmp_path: Any, endpoints: Any, closed: str, code: int, words: list[str]
) -> None:
    closed = {"BAD": str(tmp_path / "bad.geojson")}.get(closed, closed)
    assert cli(*query, *endpoints, "--blocked", closed).refuses(code, *words)


def test_a_comparison_knows_no_doors(cli: Any, query: Any) -> None:
    refused = cli(*query, *POINTS, "--compare", "--blocked", "door:1")
    assert refused.refuses(2, "--compare", "files as --blocked")
