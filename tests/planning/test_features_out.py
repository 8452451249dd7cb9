"""Paths, rooms and places in CSV and GeoJSON, read again by programs that know nothing of ours."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy import ndimage
from shapely.geometry import Point, shape

import hybridnav as hn
from tests.layers import grid_of
from tests.strategies import class_grids, labelled, occupancy_grid, tried

NAMES = ("kitchen, big", 'the "lab"', "Büro;1", "=1+1", "-7")


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def features_of(path: Path) -> Any:
    """The features of a file that is strict JSON, by their property `feature`."""
    data = json.loads(path.read_text("utf-8"), parse_constant=pytest.fail)
    assert data["type"] == "FeatureCollection"
    found: dict[str, list[Any]] = {}
    for feature in data["features"]:
        assert feature["type"] == "Feature"
        assert None not in feature["properties"].values()
        geometry = shape(feature["geometry"])
        assert geometry.is_valid
        found.setdefault(feature["properties"]["feature"], []).append(
            (feature["properties"], geometry)
        )
    return data["frame"], found


def planned(points: Any, headings: Any = None, *, curved: bool = False) -> hn.PlanResult:
    points = np.array(points, dtype=np.float64)
    length = math.pi if curved else float(np.hypot(*np.diff(points, axis=0).T).sum())
    headings = None if headings is None else np.array(headings, dtype=np.float64)
    path = hn.Path(np.zeros((1, 2), np.int64), points, length, headings, is_curved=curved)
    ends = tuple(points[0].tolist()), tuple(points[-1].tolist())
    record = {"preset": "shortest"}
    return hn.PlanResult(
        hn.PlanStatus.SOLVED, "any-angle", path, settings_source=record, start=ends[0], goal=ends[1]
    )


coordinates = st.floats(-1000, 1000)
lines = st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=8)


@tried(80, lines, st.floats(5, 500), st.booleans())
def test_paths_survive_every_format(tmp_path_factory, points, spacing, faces):
    folder = tmp_path_factory.mktemp("path")
    headings: Any = np.linspace(0, 1, len(points)) if faces else None
    result = planned(points, headings)
    for ending in ("csv", "json", "geojson"):
        hn.export_path(result, folder / f"p.{ending}", spacing_m=spacing, frame="floor")
    table = [[float(row[name]) for name in row] for row in rows_of(folder / "p.csv")]
    plain = json.loads((folder / "p.json").read_text())
    assert plain["names"] == list(rows_of(folder / "p.csv")[0])
    assert plain["poses"] == table
    steps = np.diff([row[:2] for row in table], axis=0)
    assert (np.hypot(*steps.T) <= spacing + 1e-5).all()
    assert np.hypot(*steps.T).sum() == pytest.approx(result.path.length_m, abs=1e-4)
    assert table[0][:2] == pytest.approx(points[0], abs=1e-6)
    assert table[-1][:2] == pytest.approx(points[-1], abs=1e-6)
    if faces:
        assert table[0][2] == pytest.approx(0, abs=1e-6)
        assert table[-1][2] == pytest.approx(headings[-1], abs=1e-6) or len(points) == 1
    frame, found = features_of_any(folder / "p.geojson")
    assert frame == "floor"
    ((known, at),) = found
    kept = points if len(points) > 1 else points * 2
    assert np.allclose(at, kept, atol=1e-6)
    assert len(known["headings_rad"]) == len(at)
    assert known["length_m"] == pytest.approx(result.path.length_m)
    assert (known["metric"], known["preset"]) == ("any-angle", "shortest")
    assert known["start"] == list(points[0])


def features_of_any(path: Path) -> Any:
    """Properties and coordinates, of lines that may have length 0, which shapely calls invalid."""
    data = json.loads(path.read_text(), parse_constant=pytest.fail)
    assert all(feature["geometry"]["type"] == "LineString" for feature in data["features"])
    return data["frame"], [
        (feature["properties"], feature["geometry"]["coordinates"]) for feature in data["features"]
    ]


def test_a_curved_path_is_a_line_through_its_poses(tmp_path: Path) -> None:
    """A quarter of a circle of 2 m round (0, 2)."""
    result = planned([(0.0, 0.0), (2.0, 2.0)], [0.0, math.pi / 2], curved=True)
    hn.export_path(result, tmp_path / "p.geojson", spacing_m=0.1)
    ((known, at),) = features_of_any(tmp_path / "p.geojson")[1]
    assert len(at) > 30
    away = np.hypot(*(np.array(at) - (0.0, 2.0)).T)
    assert np.allclose(away, 2, atol=1e-5)
    assert np.allclose(known["headings_rad"], np.linspace(0, math.pi / 2, len(at)), atol=1e-5)


def test_a_tour_is_a_line_a_plan_and_all_poses_in_order(tmp_path: Path) -> None:
    parts = planned([(0, 0), (1, 0)]), planned([(1, 0), (1, 2)])
    tour = hn.Tour(parts, ())
    hn.export_path(tour, tmp_path / "t.geojson")
    assert [at for _, at in features_of_any(tmp_path / "t.geojson")[1]] == [
        [[0, 0], [1, 0]],
        [[1, 0], [1, 2]],
    ]
    hn.export_path(tour, tmp_path / "t.csv", spacing_m=1.0)
    assert [(row["x"], row["y"]) for row in rows_of(tmp_path / "t.csv")] == [
        ("0.0", "0.0"),
        ("1.0", "0.0"),
        ("1.0", "0.0"),
        ("1.0", "1.0"),
        ("1.0", "2.0"),
    ]


def test_without_a_path_a_file_is_empty_and_sound(tmp_path: Path) -> None:
    nothing = hn.PlanResult(hn.PlanStatus.NO_PATH)
    for ending in ("csv", "geojson", "json"):
        hn.export_path(nothing, tmp_path / f"n.{ending}")
    assert (tmp_path / "n.csv").read_text() == "x,y,yaw,direction\n"
    assert features_of_any(tmp_path / "n.geojson") == ("map", [])
    assert json.loads((tmp_path / "n.json").read_text())["poses"] == []


@tried(60, labelled(), st.sampled_from([0.05, 0.5]), st.floats(-3, 3))
def test_rooms_survive_both_formats(tmp_path_factory, drawn, side, yaw):
    classes, labels = drawn
    few = [name for name in labels.names if (labels.label_of == labels.index(name)).any()]
    renamed = tuple(NAMES[i] if i < len(NAMES) else name for i, name in enumerate(few))
    label_of = np.full(labels.label_of.shape, -1)
    for new, name in enumerate(few):
        label_of[labels.label_of == labels.index(name)] = new
    rooms = hn.RoomLabels(renamed, label_of)
    plain = occupancy_grid(classes)
    frame = hn.Frame(side, (2.0, -1.0), yaw)
    grid = hn.OccupancyGrid(plain.probability, frame, robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    folder = tmp_path_factory.mktemp("rooms")
    counts = [((label_of == i) & (classes == hn.CellClass.FREE)).sum() for i in range(len(few))]
    if 0 in counts:
        with pytest.raises(hn.errors.RoomsError, match="no free cell"):
            hn.export_rooms(topology.rooms, folder / "r.csv")
        return
    hn.export_rooms(topology.rooms, folder / "r.csv")
    hn.export_rooms(topology.rooms, folder / "r.geojson", frame="floor")
    table = rows_of(folder / "r.csv")
    assert tuple(row["room"] for row in table) == renamed
    found = features_of(folder / "r.geojson")[1]
    assert len(found.get("room", [])) == len(renamed)
    beside: dict[str, set[int]] = {name: set() for name in renamed}
    for known, at in found.get("door", []):
        place = 2 * np.array(grid.frame.position_of(at.x, at.y))
        assert np.abs(place - place.round()).max() < 1e-3 / side  # the middle or end of a side
        for name in known["rooms"]:
            beside[name].add(known["number"])
    for index, (row, (known, area)) in enumerate(zip(table, found.get("room", []), strict=True)):
        assert float(row["area_m2"]) == pytest.approx(counts[index] * side**2, abs=1e-5)
        cell = grid.frame.cells_of([float(row["x"]), float(row["y"])])
        assert label_of[tuple(cell)] == index
        assert {int(number) for number in row["doors"].split()} == beside[renamed[index]]
        assert (row["fits"], known["room"]) == ("true", renamed[index])
        assert [known["x"], known["y"]] == [float(row["x"]), float(row["y"])]
        # Free cells of the room lie in the outline, but for those near its simplified border.
        # Small parts beside the largest one have no outline.
        part_of, _ = ndimage.label(label_of == index)
        sizes = np.bincount(part_of.ravel())[1:]
        drawn_parts = np.append(False, sizes >= min(0.25 / side**2, sizes.max()))
        cells = np.argwhere(drawn_parts[part_of] & (classes == hn.CellClass.FREE))
        points = [Point(*point) for point in grid.frame.points_of(cells)]
        reach = 0.3 + 1.5 * side
        assert max((area.distance(point) for point in points), default=0.0) <= reach


@tried(40, class_grids(14), st.floats(-3, 3), st.integers(1, 12))
def test_places_survive_both_formats(tmp_path_factory, classes, yaw, first):
    tmp_path = tmp_path_factory.mktemp("places")
    frame = hn.Frame(0.1, (3.0, 4.0), yaw)
    grid = hn.OccupancyGrid(occupancy_grid(classes).probability, frame, robot_radius_m=0)
    label_of = np.full(grid.shape, -1)
    label_of[:, :first] = 0
    rooms = hn.RoomLabels(NAMES[:1], label_of)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=0.4, rooms=rooms)
    topology = hn.TopologicalMap(pyramid)
    hn.export_places(topology, tmp_path / "p.csv")
    hn.export_places(topology, tmp_path / "p.geojson", frame="floor")
    table = rows_of(tmp_path / "p.csv")
    name, found = features_of(tmp_path / "p.geojson")
    places, joins = found.get("place", []), found.get("arc", [])
    assert name == "floor"
    assert len(table) == len(places) == topology.n_places
    assert len(joins) == topology.n_arcs
    for index, (row, (known, at)) in enumerate(zip(table, places, strict=True)):
        field = topology.level.receptive_field(index)
        assert float(row["area_m2"]) == pytest.approx(len(field) * 0.01)
        cell = grid.frame.cells_of([at.x, at.y]).tolist()
        assert cell in field.tolist()
        assert row["class"] == ("free" if grid.classes[tuple(cell)] == 1 else "unexplored")
        assert row["room"] == (NAMES[0] if cell[1] < first else "")
        assert known.get("room", "") == row["room"]
        assert (float(row["x"]), float(row["y"])) == (at.x, at.y)
    arcs = {known["arc"]: known for known, _ in joins}
    for arc, (tail, head) in enumerate(topology.arcs.tolist()):
        assert arcs[arc]["places"] == [tail, head]
        assert arcs[arc]["through_m"] > 0
    for known, at in joins:
        beside = grid.frame.position_of(at.x, at.y)
        around = {
            topology.place_at((math.floor(beside[0] + dr), math.floor(beside[1] + dc)))
            for dr, dc in ((-0.2, 0), (0.2, 0), (0, -0.2), (0, 0.2))
        }
        assert set(known["places"]) <= around


GRID = grid_of(np.zeros((2, 4)), robot_radius_m=0)
TOPOLOGY = hn.TopologicalMap(hn.DualGraphPyramid.build(GRID))


@pytest.mark.parametrize(
    ("export", "thing"), [(hn.export_path, planned([(0, 0), (1, 1)])), (hn.export_places, TOPOLOGY)]
)
def test_what_cannot_be_written_is_refused_in_one_line(export, thing, tmp_path):
    for name, kind, words in (
        ("out.txt", hn.errors.MapError, r"must be named \.csv"),
        ("none/out.csv", hn.errors.MapError, "cannot write: No such file"),
        ("folder.csv", hn.errors.MapError, "cannot write: Is a directory"),
    ):
        (tmp_path / "folder.csv").mkdir(exist_ok=True)
        with pytest.raises(kind, match=words) as error:
            export(thing, tmp_path / name)
        assert "\n" not in str(error.value)
    for frame in ("", None, 7):
        with pytest.raises(hn.errors.InvalidValueError, match="name of the map frame"):
            export(thing, tmp_path / "out.geojson", frame=frame)
    with pytest.raises(hn.errors.InvalidValueError, match="expected a"):
        export("nothing", tmp_path / "out.csv")


def test_rooms_that_are_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="expected a Rooms"):
        hn.export_rooms(TOPOLOGY, tmp_path / "r.csv")  # type: ignore[arg-type]
    rooms = hn.RoomLabels(("a",), np.zeros((2, 4), int))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(GRID, rooms=rooms))
    for tolerance in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(hn.errors.InvalidValueError, match="tolerance_m must be positive"):
            hn.export_rooms(topology.rooms, tmp_path / "r.geojson", tolerance_m=tolerance)
