"""What a person does to a file of rooms with a text editor, and what writing it again keeps."""

import io
import json
import re
from typing import Any

import numpy as np
import pytest
import shapely
import yaml
from hypothesis import strategies as st
from PIL import Image
from PIL.PngImagePlugin import PngInfo

import hybridnav as hn
from hybridnav.maps import CellClass, RoomLabels
from hybridnav.rooms.files.outlines import TOLERANCE_M, outlines_of
from tests.drawn_rooms import write_ros
from tests.strategies import drawn, occupancy_grid, tried

FLOOR = drawn(
    "#############################",
    "#.........#........#........#",
    "#.........#........#........#",
    "#..................#........#",
    "#..................#........#",
    "#..................#........#",
    "#.........#.................#",
    "#.........#.................#",
    "#.........#.................#",
    "#############################",
)
SIDE = 0.25


@pytest.fixture
def floor():
    """Three rooms in a row, walls of one cell, doors of three."""
    label_of = np.full(FLOOR.shape, -1, dtype=np.int32)
    label_of[:, :11], label_of[:, 11:20], label_of[:, 20:] = 0, 1, 2
    names = ("room-1", "room-2", "room-3")
    return occupancy_grid(FLOOR, resolution_m=SIDE), RoomLabels(names, label_of)


@pytest.fixture
def path(floor, tmp_path):
    grid, rooms = floor
    hn.save_rooms(tmp_path / "rooms.yaml", rooms, grid)
    return tmp_path / "rooms.yaml"


def free_rooms(rooms, grid):
    names = np.array([*rooms.names, None], dtype=object)
    return names[rooms.label_of][grid.measured == 1].tolist()


@st.composite
def layouts(draw):
    """Rooms on a map with obstacles, cut by random lines and blocks."""
    rows, cols = draw(st.integers(4, 12)), draw(st.integers(4, 12))
    seed = draw(st.integers(0, 2**16))
    rng = np.random.default_rng(seed)
    classes = (rng.random((rows, cols)) > draw(st.sampled_from([0.0, 0.1, 0.4]))).astype(np.uint8)
    label_of = np.zeros((rows, cols), dtype=np.int32)
    for label in range(1, draw(st.integers(1, 5))):
        row, col = rng.integers(0, rows), rng.integers(0, cols)
        height, width = rng.integers(1, rows), rng.integers(1, cols)
        label_of[row : row + height, col : col + width] = label
    named = [n for n in range(6) if (classes[label_of == n] == 1).any()]
    dense = np.full(7, -1)
    dense[named] = np.arange(len(named))
    names = tuple(f"r{n}" for n in range(len(named)))
    resolution_m = draw(st.sampled_from([0.05, 0.3, 1.0]))
    return occupancy_grid(classes, resolution_m=resolution_m), RoomLabels(names, dense[label_of])


@tried(20, layout=layouts())
def test_every_free_cell_is_read_with_the_room_that_it_had(tmp_path_factory, layout):
    grid, rooms = layout
    path = tmp_path_factory.mktemp("any") / "rooms.yaml"
    hn.save_rooms(path, rooms, grid)
    again = hn.load_rooms(path, grid)
    assert again.names == rooms.names
    assert free_rooms(again, grid) == free_rooms(rooms, grid)
    hn.save_rooms(path, again, grid)  # over itself
    assert free_rooms(hn.load_rooms(path, grid), grid) == free_rooms(rooms, grid)


def test_outlines_are_few_corners_on_walls_which_neighbours_share():
    """A ragged wall: the outline of each room is a rectangle, and both share its side."""
    rng = np.random.default_rng(3)
    classes = np.ones((80, 160), dtype=np.uint8)
    classes[[0, 1, 2, -3, -2, -1]], classes[:, [0, 1, 2, -3, -2, -1]], classes[:, 78:82] = 0, 0, 0
    classes[30:50, 78:82] = 1
    for row in range(80):  # scan noise on both faces of the wall
        if not 28 <= row < 52:
            classes[row, 78 - rng.integers(0, 2) : 82 + rng.integers(0, 2)] = 0
    label_of = np.full(classes.shape, 0, dtype=np.int32)
    label_of[:, 80:] = 1
    grid = occupancy_grid(classes, resolution_m=0.05)
    rings = outlines_of(label_of, 2, grid)
    assert [len(room) for room in rings] == [1, 1]
    west, east = (shapely.Polygon(room[0]) for room in rings)
    assert shapely.coverage_is_valid([west, east])
    assert shapely.intersection(west, east).length == pytest.approx(4.0, abs=0.05)
    assert len(rings[0][0]) <= 5
    assert west.hausdorff_distance(shapely.box(0, 0, 4, 4)) <= 0.05 + 1e-9


@pytest.mark.parametrize(("degrees", "tolerance_m"), [(0, 0.05), (7, 0.3), (30, 0.3)])
def test_outlines_of_few_corners_lie_along_walls_of_any_direction(degrees, tolerance_m):
    """Two wings, one turned: few steps of cells are left, and no corner lies far from the walls."""
    side_m, wing = 0.05, shapely.box(2, 2, 12, 7)
    other = shapely.affinity.rotate(shapely.box(16, 3, 26, 8), degrees)
    rows, cols = 220, 560
    x, y = np.meshgrid((np.arange(cols) + 0.5) * side_m, (np.arange(rows) + 0.5) * side_m)
    label_of = np.full((rows, cols), -1, dtype=np.int32)
    for room, shape in enumerate((wing, other)):
        label_of[shapely.contains_xy(shape, x, y)] = room
    grid = occupancy_grid((label_of >= 0).astype(np.uint8), resolution_m=side_m)
    rings = outlines_of(label_of, 2, grid, tolerance_m)
    for (ring,), shape in zip(rings, (wing, other), strict=True):
        assert len(ring) <= (4 if shape is wing else 10)
        assert shapely.Polygon(ring).hausdorff_distance(shape) <= 3 * side_m


def test_exported_outlines_have_the_cells_of_their_rooms(tmp_path):
    """An export has no image of cells beside it, so its outlines are finer than those of a file."""
    grid = hn.example_map("office")
    rooms = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid))).rooms
    assert rooms is not None
    missed = []
    for tolerance_m in (None, TOLERANCE_M):
        path = tmp_path / "rooms.geojson"
        if tolerance_m == TOLERANCE_M:
            hn.export_rooms(rooms, path, tolerance_m=tolerance_m)
        else:
            hn.export_rooms(rooms, path)
        features = json.loads(path.read_text())["features"]
        areas = {
            feature["properties"]["room"]: shapely.from_geojson(json.dumps(feature["geometry"]))
            for feature in features
            if feature["properties"]["feature"] == "room"
        }
        outside = 0
        for label, name in enumerate(rooms.names):
            if name in areas:
                inside = (rooms.labels.label_of == label) & (grid.measured == CellClass.FREE)
                x, y = grid.frame.points_of(np.argwhere(inside)).T
                outside += int(np.count_nonzero(~shapely.intersects_xy(areas[name], x, y)))
        missed.append(outside)
    assert missed[0] <= 10  # of 333,577
    assert missed[1] >= 100


def test_the_tolerance_may_be_chosen(tmp_path):
    rng = np.random.default_rng(5)
    label_of = np.full((120, 160), -1, dtype=np.int32)
    label_of[20:100, 20:140] = 0
    for row in range(20, 100):
        label_of[row, 80 + rng.integers(-4, 5) : 140] = 1
    grid = occupancy_grid((label_of >= 0).astype(np.uint8), resolution_m=0.05)
    rooms = RoomLabels(("west", "east"), label_of)
    sizes = {}
    for tolerance_m in (0.06, 0.2, 0.5, 1.0, None):
        path = tmp_path / f"{tolerance_m}.yaml"
        hn.save_rooms(path, rooms, grid, tolerance_m=tolerance_m)
        assert free_rooms(hn.load_rooms(path, grid), grid) == free_rooms(rooms, grid)
        sizes[tolerance_m] = sum(line.count("[") for line in path.read_text().splitlines())
    assert sizes[0.06] > sizes[0.2] > sizes[None] > sizes[0.5] >= sizes[1.0]
    for wrong in (0, -1, float("nan"), float("inf")):
        with pytest.raises(
            hn.errors.InvalidValueError, match="tolerance_m must be positive and finite"
        ):
            hn.save_rooms(tmp_path / "x.yaml", rooms, grid, tolerance_m=wrong)
    given: Any
    for given in ((rooms.label_of, grid), (rooms, grid.classes)):
        with pytest.raises(
            hn.errors.InvalidValueError, match=r"expected an? (RoomLabels|OccupancyGrid)"
        ):
            hn.save_rooms(tmp_path / "x.yaml", *given)


def test_names_may_be_changed(floor, path):
    grid, rooms = floor
    path.write_text(path.read_text().replace("name: room-2", "name: lab  # since May"))
    again = hn.load_rooms(path, grid)
    assert again.names == ("room-1", "lab", "room-3")
    assert (again.label_of == rooms.label_of)[grid.measured == 1].all()


def test_two_entries_of_one_name_are_one_room(floor, path):
    grid, _ = floor
    path.write_text(re.sub("name: room-[12]", "name: suite", path.read_text()))
    again = hn.load_rooms(path, grid)
    assert again.names == ("suite", "room-3")
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=again))
    assert [door.rooms for door in topology.rooms.doors] == [("suite", "room-3")]
    hn.save_rooms(path, again, grid)
    assert free_rooms(hn.load_rooms(path, grid), grid) == free_rooms(again, grid)


def test_rooms_far_apart_are_not_joined_by_a_name(floor, path):
    grid, _ = floor
    path.write_text(re.sub("name: room-[13]", "name: office", path.read_text()))
    with pytest.raises(
        hn.errors.RoomsError, match=r"line \d+: room 'office': .* first in line \d+"
    ):
        hn.load_rooms(path, grid)


def test_a_room_drawn_over_another_takes_its_cells_wherever_it_stands(floor, path):
    grid, rooms = floor
    nook = "- name: nook\n  polygon: [[0.2, 0.2], [1.3, 0.2], [1.3, 1.2], [0.2, 1.2]]\n"
    centres = grid.frame.points_of(np.argwhere(grid.measured == 1))
    inside = shapely.contains_xy(shapely.box(0.2, 0.2, 1.3, 1.2), centres)
    expected = np.where(inside, "nook", free_rooms(rooms, grid)).tolist()
    text = path.read_text()
    for place in ("rooms:\n", "- name: room-3\n"):
        at = text.index(place) + (len(place) if place == "rooms:\n" else 0)
        path.write_text(text[:at] + nook + text[at:])
        again = hn.load_rooms(path, grid)
        assert free_rooms(again, grid) == expected
        assert again.at((0.5, 0.5), grid) == "nook"


def test_moving_a_corner_changes_no_room_but_those_beside_it(floor, path):
    grid, rooms = floor
    first = yaml.safe_load(path.read_text())["rooms"][0]
    right = max(x for x, _ in first["polygon"]) + 0.5
    wider = f"[[0, 0], [{right}, 0], [{right}, 2.5], [0, 2.5]]"
    text = re.sub(r"(name: room-1\n  polygon: ).*", rf"\g<1>{wider}", path.read_text())
    path.write_text(text)
    again = hn.load_rooms(path, grid)
    was, is_now = free_rooms(rooms, grid), free_rooms(again, grid)
    changed = {pair for pair in zip(was, is_now, strict=True) if pair[0] != pair[1]}
    assert changed == {("room-2", "room-1")}


def test_a_room_that_others_cover_is_refused_with_both_lines(floor, path):
    grid, _ = floor
    big = "- name: all\n  polygon: [[0, 0], [7, 0], [7, 2.5], [0, 2.5]]\n"
    path.write_text(path.read_text().replace("- name: room-3", f"{big}- name: room-3"))
    with pytest.raises(hn.errors.RoomsError) as error:
        hn.load_rooms(path, grid)
    assert re.search(
        r"line \d+: room 'room-1': holds no free cell.*line \d+: room 'all'", str(error.value)
    )


def test_comments_and_drawn_outlines_survive_writing_again(floor, tmp_path):
    grid, _ = floor
    path = tmp_path / "rooms.yaml"
    path.write_text(
        "# measured by Ann\nrooms:\n# the kitchen\n- name: 'kit#chen'  # with a stove\n"
        "  polygon: [[0, 0], [2.6, 0], [2.6, 2.5], [0, 2.5]]  # by tape\n"
        "- name: lab\n  polygon:\n  - [2.6, 0]  # post\n  - [4.9, 0]\n  - [4.9, 2.5]\n"
        "  - [2.6, 2.5]\n"
        "points:  # of interest\n- name: sink\n  point: [1, 1]\n"
    )
    rooms = hn.load_rooms(path, grid)
    hn.save_rooms(path, rooms, grid)
    text = path.read_text()
    for words in ("# measured by Ann", "# the kitchen", "# with a stove", "# by tape", "# post"):
        assert text.count(words) == 1
    assert "[[0, 0], [2.6, 0], [2.6, 2.5], [0, 2.5]]  # by tape" in text
    again = hn.load_rooms(path, grid)
    assert again.names == ("kit#chen", "lab")
    assert dict(again.points) == {"sink": (1.0, 1.0)}
    assert (again.label_of == rooms.label_of).all()
    hn.save_rooms(path, again, grid)
    assert path.read_text() == text
    other = RoomLabels(("hall",), np.zeros(FLOOR.shape, dtype=np.int32))
    hn.save_rooms(path, other, grid)
    for words in ("# measured by Ann", "# with a stove", "# by tape", "# post", "# of interest"):
        assert words in path.read_text()
    assert re.search(r"# Formerly 'kit#chen', round \[1\.\d+, 1\.\d+\]", path.read_text())
    assert hn.load_rooms(path, grid).names == ("hall",)


@pytest.mark.parametrize("lines", ["[eJw]", "['!']", "[7]", "[AAAA, AAAA]", "['']"])
def test_damaged_cells_end_in_one_line(floor, path, lines):
    grid, _ = floor
    text = path.read_text()
    path.write_text(text[: text.index("cells:")] + f"cells: {lines}\n")
    with pytest.raises(hn.errors.RoomsError, match="cells: damaged, delete the list") as error:
        hn.load_rooms(path, grid)
    assert str(error.value).isprintable()


def png(text=None, size=(29, 10)):
    """A grey image, with a text for the keyword of rooms."""
    info, stream = PngInfo(), io.BytesIO()
    if text is not None:
        info.add_text("hybridnav rooms", text)
    Image.new("L", size).save(stream, "PNG", pnginfo=info)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (None, "no such file: copy it there"),
        (lambda whole: whole[:-30], "damaged PNG"),
        (lambda whole: whole[:60] + b"?" + whole[61:], "header is damaged"),
        (lambda _: b"", "not an image"),
        (lambda _: png(), "no image that save_rooms has written"),
        (lambda _: png("1;;x"), "no image that save_rooms has written"),
        (lambda _: png("here;" * 99_999), "no image that save_rooms has written"),
        (lambda _: png("1;" + "f" * 3000), ""),
        (lambda _: png("1;2", (9, 9)), ""),
    ],
)
def test_a_wrong_image_of_cells_ends_in_one_line_or_in_outlines(floor, path, change, words):
    grid, rooms = floor
    image = path.with_suffix(".cells.png")
    whole = image.read_bytes()
    image.unlink() if change is None else image.write_bytes(change(whole))
    if not words:
        assert hn.load_rooms(path, grid).names == rooms.names
        return
    with pytest.raises(hn.errors.RoomsError, match=words) as error:
        hn.load_rooms(path, grid)
    assert "delete the line 'cells'" in str(error.value)
    assert str(error.value).isprintable()


def test_the_image_of_cells_is_named_by_a_text(floor, path):
    grid, _ = floor
    path.write_text(re.sub("cells:.*", "cells: 7", path.read_text()))
    with pytest.raises(hn.errors.RoomsError, match="cells: expected the name of an image, got 7"):
        hn.load_rooms(path, grid)
    path.write_text(re.sub("cells:.*", "cells: /dev/zero", path.read_text()))
    with pytest.raises(hn.errors.RoomsError, match="not a regular file"):
        hn.load_rooms(path, grid)


def test_without_its_cells_and_on_another_map_the_outlines_count(floor, path):
    grid, rooms = floor
    text = path.read_text()
    larger = occupancy_grid(np.pad(FLOOR, ((0, 1), (0, 0))), resolution_m=SIDE)
    assert hn.load_rooms(path, larger).names == rooms.names
    path.write_text(text[: text.index("cells:")])
    assert hn.load_rooms(path, grid).names == rooms.names


def test_a_room_of_two_entries_is_read_exactly_until_one_of_them_changes(floor, path):
    grid, rooms = floor
    path.write_text(path.read_text().replace("name: room-2", "name: room-1"))
    hn.save_rooms(path, hn.load_rooms(path, grid), grid)
    text = path.read_text()
    assert text.count("name: room-1") == 2  # both outlines are kept
    both = hn.load_rooms(path, grid)
    assert free_rooms(both, grid) == [
        name.replace("room-2", "room-1") for name in free_rooms(rooms, grid)
    ]
    at = text.rindex("name: room-1")
    path.write_text(text[:at] + text[at:].replace("name: room-1", "name: room-2"))
    assert free_rooms(hn.load_rooms(path, grid), grid) == free_rooms(rooms, grid)


def test_a_point_is_looked_up_in_one_call(floor):
    grid, rooms = floor
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    assert topology.rooms.at((0.5, 0.5)) == rooms.at((0.5, 0.5), grid) == "room-1"
    assert topology.rooms.at((6.0, 1.0)) == "room-3"
    assert topology.rooms.at((99.0, 1.0)) is None
    with pytest.raises(hn.errors.InvalidValueError, match="finite"):
        topology.rooms.at((float("nan"), 1.0))


@pytest.mark.parametrize("floor_name", ["2", "3", "3ne"])
@pytest.mark.full
def test_a_real_floor_is_a_small_file_and_read_exactly(data, tmp_path, floor_name):
    grid = hn.load_map(data / "bwi_gdc" / floor_name / f"{floor_name}.yaml", robot_radius_m=0.25)
    rooms = hn.find_rooms(grid)
    path = tmp_path / "rooms.yaml"
    hn.save_rooms(path, rooms, grid)
    again = hn.load_rooms(path, grid)
    assert path.stat().st_size <= 480 * len(rooms.names)  # bytes: some 27 corners a room
    named = (rooms.label_of >= 0) & (grid.measured == 1)
    assert (again.label_of == rooms.label_of)[named].all()


@pytest.fixture
def map_file(floor, tmp_path):
    grid, rooms = floor
    hn.save_rooms(tmp_path / "rooms.yaml", rooms, grid)
    return write_ros(tmp_path, "f", np.where(FLOOR == 0, 0, 254), SIDE)


def test_the_command_names_the_room_of_a_point(cli, map_file):
    query = ("rooms", map_file, "--rooms", map_file.parent / "rooms.yaml")
    done = cli(*query, "--at", "6,1")
    assert (done.code, done.out, done.err) == (0, "room-3\n", "")
    done = cli(*query, "--at", "-9,1")
    assert (done.code, done.out) == (1, "no room at (-9, 1), outside the map\n")
    told = cli(*query, "--at", "0.5,0.5", "--json").answer
    assert told == {"at_m": [0.5, 0.5], "room": "room-1", "cell": "free"}
    for wrong in ("1", "a,b", "nan,1", "1,2,3"):
        assert cli(*query, "--at", wrong).refuses(2, "--at must be two finite numbers", wrong)
    assert cli(*query, "--at", "1,1", "-o", "x.yaml").refuses(2, "--at prints one room")


def test_the_list_has_numbers_sizes_and_neighbours(cli, map_file):
    query = ("rooms", map_file, "--rooms", map_file.parent / "rooms.yaml", "--robot-radius", "0")
    done = cli(*query)
    (line,) = (line for line in done.out.splitlines() if line.startswith("room-2"))
    # 8 x 8 cells, and three in the doorway of the wall.
    assert re.match(r"room-2 2 +4\.19 m²  2\.2 x 2\.0 m +\(", line)
    first, second, third = cli(*query, "--json").answer["rooms"]
    assert [room["number"] for room in (first, second, third)] == [1, 2, 3]
    assert {beside["room"] for beside in second["neighbours"]} == {"room-1", "room-3"}
    assert [beside["room"] for beside in first["neighbours"]] == ["room-2"]
    assert first["extent_m"] == [[0.25, 0.25], [2.75, 2.25]]
    assert third["centre_m"] == pytest.approx([6.0, 1.25], abs=0.2)
