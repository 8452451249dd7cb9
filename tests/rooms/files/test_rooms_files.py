"""Files of rooms: both forms in, outlines out, and one line for what is wrong."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

import hybridnav as hn
from hybridnav.maps import Frame, RoomLabels
from hybridnav.rooms.files.paint import cells_inside
from tests.strategies import class_grids, drawn, occupancy_grid

FLAT = drawn(
    "############", "#....#.....#", "#....#.....#", "#..........#", "#....#.....#", "############"
)
KITCHEN = "[[1, 1], [5, 1], [5, 5], [1, 5]]"
LAB = "[[6, 1], [11, 1], [11, 5], [6, 5]]"


@pytest.fixture
def grid():
    return occupancy_grid(FLAT)


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "rooms.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def two(first=f"polygon: {KITCHEN}", second=f"polygon: {LAB}", more=""):
    return f"rooms:\n- name: kitchen\n  {first}\n- name: lab\n  {second}\n{more}"


def test_polygons_hold_the_cells_whose_centres_lie_inside(grid, write):
    rooms = hn.load_rooms(write(two(more="points:\n- name: sink\n  point: [2, 3]\n")), grid)
    assert rooms.names == ("kitchen", "lab")
    assert (rooms.label_of[1:5, 1:5] == 0).all()
    assert (rooms.label_of[1:5, 6:11] == 1).all()
    assert (rooms.label_of >= 0).sum() == 16 + 20
    assert dict(rooms.points) == {"sink": (2.0, 3.0)}


def test_several_rings_leave_holes_open(grid, write):
    hole = "[[2, 2], [3, 2], [3, 3], [2, 3]]"
    rooms = hn.load_rooms(write(two(first=f"polygons: [{KITCHEN}, {hole}]")), grid)
    assert rooms.label_of[2, 2] == -1
    assert (rooms.label_of == 0).sum() == 15


@st.composite
def crossing_rings(draw):
    """Rings with corners anywhere, so that sides cross; some corners on centre lines of cells."""
    step = draw(st.sampled_from([0.5, 0.01]))
    corner = st.tuples(*[st.integers(-2, round(12 / step)).map(lambda n: n * step)] * 2)
    ring = st.lists(corner, min_size=3, max_size=12)
    return [np.array(ring, dtype=float) for ring in draw(st.lists(ring, min_size=1, max_size=3))]


@given(rings=crossing_rings())
def test_cells_inside_rings_are_those_by_the_even_odd_rule(rings):
    rows, cols = 9, 11
    found = np.zeros((rows, cols), dtype=bool)
    found.ravel()[cells_inside(rings, (rows, cols))] = True
    sides = [pair for ring in rings for pair in zip(ring, np.roll(ring, -1, axis=0), strict=True)]
    lines = [shapely.LineString(side) for side in sides]
    for row, col in np.ndindex(rows, cols):
        centre = shapely.Point(col + 0.5, row + 0.5)
        if min(line.distance(centre) for line in lines) < 1e-6:
            continue  # on a side, where either is right
        # Winding by angles, ring by ring: no scan line in it.
        odd = 0
        for ring in rings:
            offset = (ring - [centre.x, centre.y]) @ [1, 1j]
            turns = np.angle(np.roll(offset, -1) / offset).sum() / (2 * np.pi)
            odd += round(turns)
        assert found[row, col] == odd % 2


def test_rings_beside_each_other_share_no_cell_and_leave_none_out():
    left, right = (np.array([[x, 0.5], [x + 2, 0.5], [x + 2, 4.5], [x, 4.5]]) for x in (0.5, 2.5))
    one, other = cells_inside([left], (5, 6)), cells_inside([right], (5, 6))
    assert len(one) == len(other) == 8
    assert not set(one.tolist()) & set(other.tolist())


def test_outlines_of_a_hostile_file_are_refused_before_they_cost_much(write):
    zigzag = ", ".join(f"[{x % 7}, {6 * (x % 2)}]" for x in range(30_000))
    tall = occupancy_grid(np.ones((600, 700), dtype=np.uint8), resolution_m=0.01)
    with pytest.raises(hn.errors.RoomsError, match="rows of the map"):
        hn.load_rooms(write(f"rooms:\n- name: a\n  polygon: [{zigzag}]\n"), tall)


def test_outlines_that_cover_the_map_many_times_are_refused(write):
    floor = occupancy_grid(np.ones((20, 20), dtype=np.uint8))
    square = "[[0, 0], [20, 0], [20, 20], [0, 20]]"
    entries = "".join(f"- name: r{n}\n  polygon: {square}\n" for n in range(9))
    with pytest.raises(hn.errors.RoomsError, match=r"line 10: room 'r4': .* more than 4 times"):
        hn.load_rooms(write("rooms:\n" + entries), floor)


def test_seeds_name_what_segmentation_finds_there(grid, write):
    # On cells of a metre the doorway of one cell parts the two rooms.
    rooms = hn.load_rooms(write(two(first="seed: [2.5, 2.5]", second="seed: [8.5, 2.5]")), grid)
    assert rooms.label_of[1, 1] == rooms.label_of[4, 4] == 0
    assert rooms.label_of[1, 10] == rooms.label_of[4, 7] == 1


def test_seeds_in_one_room_share_it_by_the_way_to_walk(write):
    hall = occupancy_grid(drawn("#######", "#.....#", "#.....#", "#######"))
    rooms = hn.load_rooms(write(two(first="seed: [1.5, 1.5]", second="seed: [5.5, 1.5]")), hall)
    assert rooms.label_of[2, 1:6].tolist() in ([0, 0, 0, 1, 1], [0, 0, 1, 1, 1])


def test_a_polygon_is_where_the_frame_puts_it(write):
    frame = Frame(0.5, (10.0, -3.0), 0.7)
    grid = hn.OccupancyGrid(np.zeros((20, 30), np.float32), frame, robot_radius_m=0)
    corners = frame.points_of_grid([[2, 3], [2, 9], [8, 9], [8, 3]])
    ring = ", ".join(f"[{x:.6f}, {y:.6f}]" for x, y in corners.tolist())
    rooms = hn.load_rooms(write(f"rooms:\n- name: a\n  polygon: [{ring}]\n"), grid)
    expected = np.full((20, 30), -1)
    expected[2:8, 3:9] = 0
    assert (rooms.label_of == expected).all()


def test_seeds_of_many_rooms_stay_inside_their_own(write):
    hall = drawn("###############", "#...#...#.....#", "#...#...#.....#", "###############")
    seeds = [(1, 1), (3, 1), (5, 1), (7, 1), (9, 1), (13, 1)]
    entries = [f"- name: s{n}\n  seed: [{x}.5, {y}.5]\n" for n, (x, y) in enumerate(seeds)]
    rooms = hn.load_rooms(write("rooms:\n" + "".join(entries)), occupancy_grid(hall))
    for row in (1, 2):
        assert set(rooms.label_of[row, 1:4].tolist()) == {0, 1}
        assert set(rooms.label_of[row, 5:8].tolist()) == {2, 3}
        assert set(rooms.label_of[row, 9:14].tolist()) == {4, 5}


@pytest.mark.parametrize("yaw_rad", [0.0, 1.1])
def test_rooms_that_are_written_are_read_again(tmp_path, yaw_rad):
    frame = Frame(0.05, (500_000.0, -3.0), yaw_rad)

    def at(x, y):
        return tuple(frame.points_of_grid(np.array([y, x]) / 0.05).round(3).tolist())

    grid = hn.OccupancyGrid(np.zeros((60, 80), np.float32), frame, name="a\nb", robot_radius_m=0)
    labels = np.full((60, 80), -1, dtype=np.int32)
    labels[5:40, 3:41], labels[5:40, 41:77] = 0, 1
    labels[15:25, 10:30] = 2  # inside the first
    rooms = RoomLabels(("yes", "Küche: 1", "- c"), labels, {"yes": at(1.5, 2.25), "dock": at(1, 1)})
    hn.save_rooms(tmp_path / "rooms.yaml", rooms, grid)
    again = hn.load_rooms(tmp_path / "rooms.yaml", grid)
    assert again.names == rooms.names
    assert dict(again.points) == dict(rooms.points)
    assert (again.label_of == labels).all()


def blocks(side):
    """A map of rooms of 4 x 4 cells, walls of one cell between; so many along each side."""
    classes = np.zeros((5 * side + 1, 5 * side + 1), dtype=np.uint8)
    label_of = np.full(classes.shape, -1, dtype=np.int32)
    for room in range(side * side):
        row, col = 5 * (room // side) + 1, 5 * (room % side) + 1
        classes[row : row + 4, col : col + 4] = 1
        label_of[row : row + 4, col : col + 4] = room
    names = tuple(f"room {room}" for room in range(side * side))
    return occupancy_grid(classes, resolution_m=0.1), RoomLabels(names, label_of)


def test_a_thousand_rooms_that_are_written_are_read_again(tmp_path):
    grid, rooms = blocks(32)
    hn.save_rooms(tmp_path / "rooms.yaml", rooms, grid)
    again = hn.load_rooms(tmp_path / "rooms.yaml", grid)
    assert again.names == rooms.names
    assert (again.label_of == rooms.label_of).all()


@pytest.mark.full
def test_more_rooms_than_can_be_read_are_not_written(tmp_path):
    grid, rooms = blocks(88)
    with pytest.raises(hn.errors.RoomsError, match="7744 rooms take"):
        hn.save_rooms(tmp_path / "rooms.yaml", rooms, grid)
    assert not (tmp_path / "rooms.yaml").exists()


def test_a_room_thinner_than_its_outline_is_rounded_keeps_its_corners(tmp_path):
    classes = np.ones((40, 40), dtype=np.uint8)
    labels = np.zeros((40, 40), dtype=np.int32)
    labels[10:30, 20] = 1  # a strip of 5 cm in the middle of another room
    grid = occupancy_grid(classes, resolution_m=0.05)
    rooms = RoomLabels(("hall", "strip"), labels)
    hn.save_rooms(tmp_path / "rooms.yaml", rooms, grid)
    again = hn.load_rooms(tmp_path / "rooms.yaml", grid)
    assert (again.label_of[:, 20] == 1).any()


@given(labels=class_grids(12))
def test_whatever_is_written_is_read_again(tmp_path_factory, labels):
    names = tuple(f"r{n}" for n in range(int(labels.max()) + 1))
    grid = occupancy_grid(np.ones(labels.shape, dtype=np.uint8), resolution_m=0.1)
    rooms = RoomLabels(names, labels.astype(np.int32))
    path = tmp_path_factory.mktemp("any") / "rooms.yaml"
    try:
        hn.save_rooms(path, rooms, grid)
    except hn.errors.RoomsError:
        # Refused for a room without a cell alone.
        assert len(np.unique(labels)) < len(names)
        return
    assert hn.load_rooms(path, grid).names == names


def locations(tmp_path, image, text="data: l.pgm\nlocations: [kitchen, lab]\n"):
    Image.fromarray(image).save(tmp_path / "l.pgm")
    (tmp_path / "locations.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "locations.yaml"


def test_pixels_of_a_label_image_index_the_names(grid, tmp_path):
    image = np.full(FLAT.shape, 255, dtype=np.uint8)
    image[1:3, 1:5], image[1:3, 6:11] = 0, 1
    rooms = hn.load_rooms(locations(tmp_path, image), grid)
    expected = np.full(FLAT.shape, -1)
    expected[3:5, 1:5], expected[3:5, 6:11] = 0, 1  # the image's top is the map's last row
    assert (rooms.label_of == expected).all()


def test_flat_polygons_in_pixels_win_over_the_image(grid, tmp_path):
    text = (
        "data: l.pgm\nlocations: [kitchen, lab]\n"
        "polygons: [[1, 1, 5, 1, 5, 3, 1, 3], [6, 1, 11, 1, 11, 5, 6, 5]]\n"
    )
    rooms = hn.load_rooms(locations(tmp_path, np.zeros(FLAT.shape, np.uint8), text), grid)
    assert (rooms.label_of[3:5, 1:5] == 0).all()
    assert (rooms.label_of == 0).sum() == 8
    assert (rooms.label_of == 1).sum() == 20


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            two(second=f"polygon: {KITCHEN}"),
            ["line 2: room 'kitchen'", "no free cell of its own", "line 4: room 'lab'"],
        ),
        (two(second="polygon: [[6, 1], [99, 1], [9, 5]]"), ["'lab'", "leaves the map"]),
        (two(second="polygon: [[0, 0], [1, 0], [1, 1], [0, 1]]"), ["'lab'", "no free cell"]),
        (two(second="polygon: [[6, 1], [9, 1]]"), ["'lab'", "three corners"]),
        (two(second="polygon: []"), ["'lab'", "three corners", "got 0"]),
        (two(second=f"polygons: [{LAB}, []]"), ["'lab'", "three corners", "got 0"]),
        (two(second="polygons: []"), ["'lab'", "no area"]),
        (two(second="polygon: [[6, 1], [9, 1], [7, 1]]"), ["'lab'", "no area"]),
        (two(second="polygon: [[6, 1], [9, .nan], [7, 1]]"), ["'lab'", "number"]),
        (two(second="polygon: [[6, 1], [9, 1e300], [7, 1]]"), ["'lab'", "number"]),
        (two(second="polygon: [6, 1, 9, 1]"), ["'lab'", "[x, y]"]),
        (two(second="polygon: 7"), ["'lab'", "list"]),
        (two(second="sead: [1, 2]"), ["'lab'", "unknown key 'sead'", "seed"]),
        (two(second="point: [1, 2]"), ["'lab'", "one of polygon, polygons and seed"]),
        (two(second="seed: [99, 2]"), ["'lab'", "outside the map"]),
        (two(second="seed: [0.5, 0.5]"), ["'lab'", "no free cell"]),
        (two(second="seed: [2.5, 2.5]"), ["'lab'", "lies in room 'kitchen'"]),
        (
            f"rooms:\n- name: a\n  polygon: {KITCHEN}\n- name: a\n  polygon: {LAB}\n",
            ["line 4: room 'a'", "given twice, first in line 2", "0.5 m apart"],
        ),
        (two(more="points:\n- name: lab\n  point: [1, 1]\n"), ["'lab'", "twice"]),
        (two(more="points:\n- name: dock\n  point: here\n"), ["'dock'", "[x, y]"]),
        (two(more="points:\n- name: dock\n  point: [.nan, 1]\n"), ["'dock'", "number"]),
        (two(more="points:\n- name: dock\n  point: [99, 1]\n"), ["'dock'", "outside the map"]),
        (two(more="points:\n- name: dock\n  point: [0.5, 1]\n"), ["'dock'", "in an obstacle"]),
        (two(second=f"polygon: {LAB}\n  point: [5.5, 1]"), ["'lab'", "in an obstacle"]),
        (two(second="polygon: [[6, 1], [9, 1], [9, 1]]"), ["'lab'", "no area"]),
        (two(more="doors: 7\n"), ["doors", "expected a list"]),
        (two(more="doors: {0: [1, 1]}\n"), ["whole number from 1", "got 0"]),
        (two(more="doors: {3: [1]}\n"), ["door 3", "[x, y]"]),
        (two(more="doors: {3: [1, .nan]}\n"), ["door 3", "number"]),
        (two(more="doors: {3: [1, 1], 3: [2, 1]}\n"), ["key '3' is given twice"]),
        (two(more="doors:\n- point: [1, 1]\n"), ["doors", "a number and a point"]),
        (two(more="doors:\n- {number: 0, point: [1, 1]}\n"), ["whole number from 1", "got 0"]),
        (two(more="doors:\n- {number: 1.5, point: [1, 1]}\n"), ["whole number", "1.5"]),
        (two(more="doors:\n- {number: true, point: [1, 1]}\n"), ["whole number", "True"]),
        (two(more="doors:\n- {number: 3, point: [.inf, 1]}\n"), ["door 3", "number"]),
        (two(more="doors:\n- {number: 3}\n"), ["door 3", "[x, y]"]),
        (two(more="doors:\n- {number: 3, width: 1}\n"), ["door 3", "unknown key 'width'"]),
        (
            two(more="doors:\n- {number: 3, point: [1, 1]}\n- {number: 3, point: [2, 1]}\n"),
            ["door 3", "given twice"],
        ),
        ("rooms:\n- polygon: []\n", ["room 1", "name"]),
        ("rooms: 7\n", ["expected a list"]),
        ("roms: []\n", ["lacks rooms"]),
        ("", ["mapping"]),
        ("locations: [a]\n", ["data"]),
        ("locations: [a]\ndata: gone.pgm\n", ["gone.pgm", "no such file"]),
        ("locations: [a]\npolygons: []\n", ["1 locations but 0 polygons"]),
        ("locations: [a]\npolygons: [[1, 2, 3]]\n", ["'a'", "3 numbers"]),
        ("locations: [[]]\n", ["expected names"]),
    ],
)
def test_a_file_that_is_wrong_says_so_in_one_line(grid, write, text, words):
    with pytest.raises(hn.errors.RoomsError) as error:
        hn.load_rooms(write(text), grid)
    message = str(error.value)
    assert message.isprintable()
    for word in (*words, "rooms.yaml"):
        assert word in message


def test_a_room_that_the_radius_fills_is_read_for_smaller_robots(grid, write):
    fat = hn.OccupancyGrid((FLAT == 0).astype(np.float32), robot_radius_m=2.0)
    path = write(two())
    assert (hn.load_rooms(path, fat).label_of == hn.load_rooms(path, grid).label_of).all()


def test_a_point_beside_a_wall_is_kept_for_robots_of_any_radius(write):
    fat = hn.OccupancyGrid((FLAT == 0).astype(np.float32), robot_radius_m=1.0)
    rooms = hn.load_rooms(write(two(more="points:\n- name: dock\n  point: [1.5, 1.5]\n")), fat)
    assert dict(rooms.points) == {"dock": (1.5, 1.5)}


def test_an_image_of_another_size_and_a_missing_file_are_refused(grid, tmp_path):
    with pytest.raises(hn.errors.RoomsError, match="5 x 4 pixels"):
        hn.load_rooms(locations(tmp_path, np.zeros((4, 5), np.uint8)), grid)
    with pytest.raises(hn.errors.RoomsNotFoundError, match="no such file"):
        hn.load_rooms(tmp_path / "gone.yaml", grid)


def test_rooms_that_could_not_be_read_again_are_not_written(grid, tmp_path):
    full = RoomLabels(("a",), np.zeros(FLAT.shape, dtype=np.int32), {"b": (0.5, 0.5)})
    with pytest.raises(hn.errors.RoomsError, match=r"'b'.*in an obstacle"):
        hn.save_rooms(tmp_path / "rooms.yaml", full, grid)


def test_a_disc_that_is_full_leaves_the_file_that_was_there(grid, write, tmp_path):
    resource = pytest.importorskip("resource")
    path = write(two())
    before = path.read_bytes()
    rooms = hn.load_rooms(path, grid)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, hard))
    try:
        with pytest.raises(hn.errors.RoomsError, match="cannot write"):
            hn.save_rooms(path, rooms, grid)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_a_file_that_is_replaced_keeps_its_mode_and_the_link_to_it(grid, write, tmp_path):
    path = write(two())
    path.chmod(0o640)
    link = tmp_path / "link.yaml"
    link.symlink_to(path)
    hn.save_rooms(link, hn.load_rooms(path, grid), grid)
    assert link.is_symlink()
    assert path.stat().st_mode & 0o777 == 0o640
    assert "cells:" in path.read_text()


def test_rooms_without_cells_or_a_folder_are_not_written(grid, tmp_path):
    empty = RoomLabels(("a",), np.full(FLAT.shape, -1, dtype=np.int32))
    with pytest.raises(hn.errors.RoomsError, match="'a'"):
        hn.save_rooms(tmp_path / "rooms.yaml", empty, grid)
    full = RoomLabels(("a",), np.zeros(FLAT.shape, dtype=np.int32))
    with pytest.raises(hn.errors.RoomsError, match="cannot write"):
        hn.save_rooms(tmp_path / "gone" / "rooms.yaml", full, grid)


@pytest.mark.parametrize("floor", ["2", "3", "3ne"])
def test_the_labels_of_a_real_floor_load(data, floor):
    folder = data / "bwi_gdc" / floor
    grid = hn.load_map(folder / f"{floor}.yaml", robot_radius_m=0.25)
    rooms = hn.load_rooms(folder / "locations.yaml", grid)
    assert (np.bincount(rooms.label_of[rooms.label_of >= 0]) > 1000).all()
