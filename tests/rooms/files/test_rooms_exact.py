"""What is written is read again: every label, door and number, on maps as clean or raw as any."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.maps import Frame, RoomLabels
from hybridnav.rooms.doors import RoomBoundaries, measured_clearance_m
from tests.strategies import drawn, labelled, occupancy_grid, seeds, tried


def doors_of(rooms, grid):
    """Each boundary between rooms: its number, the names on both sides, its middle."""
    found = RoomBoundaries.of(rooms, grid, measured_clearance_m(grid))
    names = (*rooms.names, None)
    numbers = found.numbers(rooms.doors).tolist()
    sides = [{names[one], names[other]} for one, other in found.labels.tolist()]
    return dict(zip(numbers, zip(sides, found.middles.tolist(), strict=True), strict=True))


def assert_read_again(rooms, grid, path):
    hn.save_rooms(path, rooms, grid)
    again = hn.load_rooms(path, grid)
    assert again.names == rooms.names
    assert (again.label_of == rooms.label_of).all()
    assert doors_of(again, grid) == doors_of(rooms, grid)
    hn.save_rooms(path, again, grid)  # over itself
    twice = hn.load_rooms(path, grid)
    assert (twice.label_of == rooms.label_of).all()
    assert (twice.names, dict(twice.doors)) == (again.names, dict(again.doors))


@st.composite
def raw_maps(draw):
    """A floor as a robot maps it: rooms and doors, ragged walls, specks, pockets behind walls, and
    rays through glass; turned, in cells of any size."""
    rng = np.random.default_rng(draw(seeds))
    side_m = draw(st.sampled_from([0.05, 0.08, 0.15]))
    rows, cols = (int(metres / side_m) for metres in rng.uniform(3, 8, 2))
    classes = np.ones((rows, cols), dtype=np.uint8)
    for _ in range(draw(st.integers(0, 5))):  # walls, each with a gap
        thick, gap, at = int(rng.integers(1, 5)), int(rng.integers(1, 1.2 / side_m)), rng.random()
        lines = classes if rng.random() < 0.5 else classes.T
        first, door = int(at * len(lines)), int(rng.integers(0, lines.shape[1]))
        lines[first : first + thick, :door] = 0
        lines[first : first + thick, door + gap :] = 0
    classes[[0, -1]], classes[:, [0, -1]] = 0, 0
    wall = classes == 0
    ragged = rng.random(classes.shape) < draw(st.sampled_from([0.0, 0.3]))
    classes[ndimage.binary_dilation(wall) & ragged] = 0
    speck = rng.random(classes.shape)
    share = draw(st.sampled_from([0.0, 0.02, 0.3]))
    classes[speck < share] = 0
    classes[(speck > 1 - share / 4) & (classes == 0)] = 1
    unknown = ndimage.gaussian_filter(rng.standard_normal(classes.shape), 4)
    classes[unknown > draw(st.sampled_from([9.0, 0.08, 0.0]))] = 2
    around = np.full((rows + 20, cols + 20), 2, dtype=np.uint8)
    around[10:-10, 10:-10] = classes
    for _ in range(draw(st.integers(0, 4))):  # rays
        line = around if rng.random() < 0.5 else around.T
        line[int(rng.integers(len(line))), int(rng.integers(len(line))) :] = 1
    frame = Frame(side_m, (rng.uniform(-50, 50), 3.0), draw(st.sampled_from([0.0, 0.3, -2.0])))
    return replace(occupancy_grid(around), frame=frame)


@tried(60, grid=raw_maps(), least_area_m2=st.sampled_from([1.0, 0.2, 3.0]))
def test_rooms_of_a_raw_map_are_read_as_they_were_found(tmp_path_factory, grid, least_area_m2):
    path = tmp_path_factory.mktemp("raw") / "rooms.yaml"
    assert_read_again(hn.find_rooms(grid, least_area_m2=least_area_m2), grid, path)


@tried(60, scene=labelled(), resolution_m=st.sampled_from([0.05, 0.3, 1.0]))
def test_any_labels_are_read_as_they_were_written(tmp_path_factory, scene, resolution_m):
    classes, labels = scene
    has_cells = np.unique(labels.label_of[(classes == 1) & (labels.label_of >= 0)])
    dense = np.full(len(labels.names) + 1, -1)
    dense[has_cells] = np.arange(len(has_cells))
    names = tuple(f"r{n}" for n in range(len(has_cells)))
    rooms = RoomLabels(names, dense[labels.label_of])
    path = tmp_path_factory.mktemp("any") / "rooms.yaml"
    grid = occupancy_grid(classes, resolution_m=resolution_m)
    assert_read_again(rooms, grid, path)


def test_no_door_leads_into_a_pocket_that_has_no_room(tmp_path):
    """An outline runs through pockets of free cells in a thick wall: they stay without a room."""
    rng = np.random.default_rng(2)
    classes = np.zeros((60, 120), dtype=np.uint8)
    classes[8:30, 5:115] = 1
    classes[30:36] = rng.random((6, 120)) < 0.4
    grid = occupancy_grid(classes, resolution_m=0.05)
    rooms = hn.find_rooms(grid)
    path = tmp_path / "rooms.yaml"
    assert rooms.names == ("room-1",)
    assert not doors_of(rooms, grid)
    hn.save_rooms(path, rooms, grid)
    assert not doors_of(hn.load_rooms(path, grid), grid)
    assert "doors:" not in path.read_text()


def test_free_cells_of_the_office_without_a_room_get_none(tmp_path):
    grid = hn.load_map("maps/office/office.yaml", robot_radius_m=0.25)
    rooms = hn.find_rooms(grid)
    assert (rooms.label_of[grid.measured == hn.CellClass.FREE] == -1).any()
    assert_read_again(rooms, grid, tmp_path / "rooms.yaml")


MAPS = (
    "willow/willow-2010-02-18-0.10.yaml",
    "bwi_mapper/intel.yaml",
    "bwi_gdc/3ne/3ne.yaml",
    "strands/g4s/g4s_y2.yaml",
)


def map_rows(data):
    rows = (line.split("\t") for line in (data / "maps.tsv").read_text().splitlines())
    return [name for name, kind in rows if kind == "map"]


@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
@pytest.mark.parametrize("name", MAPS)
def test_rooms_of_a_real_map_are_read_as_they_were_found(data, tmp_path, name):
    grid = hn.load_map(data / name, robot_radius_m=0.25)
    rooms = hn.find_rooms(grid)
    assert_read_again(rooms, grid, tmp_path / "rooms.yaml")


@pytest.mark.full
@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
def test_rooms_of_all_real_maps_are_read_as_they_were_found(data, tmp_path):
    names = map_rows(data)
    assert len(names) > 40
    for name in names:
        grid = hn.load_map(data / name, robot_radius_m=0.25)
        assert_read_again(hn.find_rooms(grid), grid, tmp_path / f"{name.replace('/', '-')}")


OLD_MAP = drawn(
    "##############################",
    "#............##....#.........#",
    "#............#...............#",
    "#............#...............#",
    "#............##....#.........#",
    "#..................#.........#",
    "#..................###.#######",
    "#............#######...?.....#",
    "#............#....#....?.....#",
    "#............#.##.#....?.....#",
    "##.#######.###....#####?######",
    "##.##.############.###########",
)
OLD_FILE = """\
# Rooms of map: outlines in metres, map frame, [x, y].
rooms:
- name: hall
  polygon: [[3.25,3], [3.05,1.27], [3.21,0], [0,0.03], [0.03,3]]
- name: nook
  polygon: [[4.74,1.48], [3.05,1.27], [3.25,3], [4.76,3]]
- name: lab
  polygon: [[4.76,3], [7.5,2.95], [7.49,1.48], [4.74,1.48]]
doors:  # their numbers; a point of each
  2: [3.12,1.5]
cells:  # which the outlines miss; hybridnav's own
- AQAh4dLI4wsEAACX+pOBBwLkjf3WCAHTo5eJBwDAAR6mAQIBAwA=
"""
OLD_ROOMS = """\
aaaaaaaaaaaaabbbbbbccccccccccc
aaaaaaaaaaaaabbbbbbccccccccccc
aaaaaaaaaaaaabbbbbbccccccccccc
aaaaaaaaaaaaabbbbbbccccccccccc
aaaaaaaaaaaaabbbbbbccccccccccc
aaaaaaaaaaaaaabbbbbccccccccccc
aaaaaaaaaaaabbbbbbb...........
aaaaaaaaaaaa..................
aaaaaaaaaaaa..................
aaaaaaaaaaaaa.................
aaaaaaaaaaaaa.................
aaaaaaaaaaaaa.................
"""


LATER_FILE = """\
rooms:
- name: r1
  polygon: [[4.76,1], [4.5,1], [4.5,1.24], [3.51,1.26], [3.49,0.5], [3.25,0.5], [3.25,0.25],
    [2.75,0.25], [2.75,0], [2.5,0], [2.5,0.24], [1,0.26], [1,0], [0.25,0.01], [0.25,0.5],
    [0,0.5], [0.02,2.75], [0.25,2.75], [0.25,3], [3.25,2.97], [3.25,2.75], [3.75,2.75],
    [3.75,3], [4.75,2.99], [4.75,2.75], [5,2.75], [5,2.5], [4.75,2.5], [4.75,2], [5,2],
    [5,1.52], [5,1.25], [4.75,1.25]]
- name: r2
  polygon: [[6.01,1.5], [5,1.52], [5,2], [4.75,2], [4.75,2.5], [5,2.5], [5,2.75], [5,3],
    [7.25,2.98], [7.25,2.75], [7.5,2.75], [7.49,1.5], [7.25,1.48]]
- name: r3
  polygon: [[5.99,0.5], [5.75,0.5], [5.75,0.24], [4.74,0.26], [4.76,1], [4.75,1.25], [5,1.25],
    [5,1.52], [6.01,1.5]]
- name: r4
  polygon: [[5.99,0.5], [6.01,1.5], [7.25,1.48], [7.25,1.25], [7.5,1.25], [7.49,0.5],
    [7.25,0.5], [7.25,0.24], [6,0.26]]
- name: r5
  polygon: [[4.74,0.26], [4.5,0.25], [4.5,0], [3.5,0.01], [3.5,0.25], [3.25,0.25], [3.25,0.5],
    [3.49,0.5], [3.51,1.26], [4.5,1.24], [4.5,1], [4.76,1]]
cells:  # which the outlines miss; hybridnav's own
- AQAzm+vR/Q0GAACL9rHWBADT25nKDQCn8tTcBwC9qpv3BQOT6czOAgRUHh4sHgMbBQUFBAEBBAA=
"""
LATER_ROOMS = """\
.aaaaaaaaaaaa..aaaa.bbbbbbbbb.
aaaaaaaaaaaaaaaaaaaabbbbbbbbbb
aaaaaaaaaaaaaaaaaaabbbbbbbbbbb
aaaaaaaaaaaaaaaaaaabbbbbbbbbbb
aaaaaaaaaaaaaaaaaaaabbbbbbbbbb
aaaaaaaaaaaaaaaaaaaabbbbbbbbbb
aaaaaaaaaaaaaaaaaaaaccccddddd.
aaaaaaaaaaaaaaeeeeacccccdddddd
aaaaaaaaaaaaaaeeeeecccccdddddd
aaaaaaaaaaaaaaeeeeecccccdddddd
.aaaaaaaaaaaaeeeeeecccc.ddddd.
.aaa......a...eeee............
"""


@pytest.mark.parametrize(
    ("text", "expected"), [(OLD_FILE, OLD_ROOMS), (LATER_FILE, LATER_ROOMS)], ids=["old", "later"]
)
def test_a_file_of_an_earlier_version_is_read_as_before(tmp_path, text, expected):
    """Written by versions without images of cells, and read by them as `expected`."""
    grid = occupancy_grid(OLD_MAP, resolution_m=0.25)
    path = tmp_path / "rooms.yaml"
    path.write_text(text)
    rooms = hn.load_rooms(path, grid)
    letters = np.array(list("abcde."[: len(rooms.names)] + "."))[rooms.label_of[::-1]]
    assert "".join("".join(row) + "\n" for row in letters.tolist()) == expected
    assert_read_again(rooms, grid, path)
    again = yaml.safe_load(path.read_text())
    assert again["rooms"] == yaml.safe_load(text)["rooms"]  # its outlines hold
