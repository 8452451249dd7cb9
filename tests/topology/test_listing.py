"""What lists and pictures leave out: rays of a scan, nameless pockets, doors to them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy import ndimage
from scipy.spatial.distance import cdist

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, RoomLabels
from hybridnav.maps.files.write import write_ros_map
from hybridnav.viz import plot_rooms
from tests.strategies import drawn, examples, labelled, occupancy_grid

# A hall, a lab behind a door, and what a laser saw through the glass of the hall.
GLASS = drawn(
    "????????????????????????",
    "##############????????.?",
    "#......#.....#??????..??",
    "#......#.....#????..????",
    "#............#??..??????",
    "#............#..????????",
    "#......#.....#??????????",
    "#......#.....###########",
    "########################",
)
SIDE = 0.4


def rooms_of(grid, labels):
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)).rooms


def glass(names=("room-1", "room-2", "room-3"), radius_m=0.25):
    label_of = np.full(GLASS.shape, -1, dtype=np.int32)
    free = GLASS == 1
    label_of[:, :8][free[:, :8]] = 0
    label_of[:, 8:13][free[:, 8:13]] = 1
    label_of[:, 13:][free[:, 13:]] = 2
    grid = replace(occupancy_grid(GLASS, resolution_m=SIDE), robot_radius_m=radius_m)
    return grid, RoomLabels(names, label_of)


def test_a_ray_through_glass_is_not_listed_unless_somebody_named_it():
    rooms = rooms_of(*glass())
    assert rooms.is_listed.tolist() == [True, True, False]
    assert rooms.counted() == ("2 rooms", "1 door", "1 narrow room without a way in")
    assert rooms.counted(everything=True) == ("3 rooms", "1 door", "")
    assert rooms_of(*glass(("hall", "lab", "window"))).is_listed.all()


def test_a_narrow_room_that_the_robot_can_enter_is_listed():
    opened, label_of = GLASS.copy(), glass()[1].label_of.copy()
    opened[3, 13], label_of[3, 13] = CellClass.FREE, 2
    rooms = rooms_of(
        occupancy_grid(opened, resolution_m=SIDE),
        RoomLabels(("room-1", "room-2", "room-3"), label_of),
    )
    assert rooms.is_listed.all()
    assert len(rooms.listed_doors) == 2


def test_doors_to_a_nameless_pocket_are_not_listed_and_those_to_a_nameless_hall_are():
    _, labels = glass(radius_m=0.0)
    grid = occupancy_grid(GLASS, resolution_m=SIDE)
    hall = RoomLabels(("lab",), np.where(labels.label_of == 1, 0, -1))
    rooms = rooms_of(grid, hall)
    assert [door.rooms for door in rooms.listed_doors] == [(None, "lab")]
    pocket = labels.label_of.copy()
    pocket[6, 1:3] = -1
    rooms = rooms_of(grid, RoomLabels(labels.names, pocket))
    assert [door.rooms for door in rooms.doors] == [("room-1", "room-2"), ("room-1", None)]
    assert [door.rooms for door in rooms.listed_doors] == [("room-1", "room-2")]
    assert rooms.counted()[2] == "1 narrow room without a way in, 1 door to what is not listed"
    (listed,), (hidden,) = rooms.listed_doors, set(rooms.doors) - set(rooms.listed_doors)
    for ask in (rooms.door, rooms.listed_door):
        assert ask(hidden.number) is hidden
        with pytest.raises(InvalidValueError, match=f"999: the doors are {listed.number};"):
            ask(999)


@given(labelled(), st.sampled_from([0.0, 0.3, 0.8]), st.sampled_from([0.25, 0.5, 1.0]))
@settings(max_examples=examples(120))
def test_what_is_listed_is_what_cells_counted_one_by_one_say(scene, radius_m, side_m):
    classes, labels = scene
    labels = RoomLabels(tuple(f"room-{n}" for n in range(len(labels.names))), labels.label_of)
    grid = replace(occupancy_grid(classes, resolution_m=side_m), robot_radius_m=radius_m)
    rooms = rooms_of(grid, labels)
    spaces: dict[object, list[tuple[int, int]]] = {}
    is_wide, parts = {}, ndimage.label(grid.classes == CellClass.FREE)[0]
    free = classes == CellClass.FREE
    nameless = ndimage.label(free & (labels.label_of < 0))[0]
    for row, col in np.argwhere(free).tolist():
        cell = (int(row), int(col))
        label = int(labels.label_of[cell])
        spaces.setdefault(label if label >= 0 else (int(nameless[cell]),), []).append(cell)
    for space, cells in spaces.items():
        inside = set(cells)
        rim = [
            (row, col)
            for row, col in cells
            if not {(row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)} <= inside
        ]
        depths = cdist(cells, rim).min(axis=1) + 0.5
        is_wide[space] = 4 * depths.mean() * side_m >= 1 - 1e-12
    most = max(map(len, spaces.values()), default=0)
    begins = [s for s, cells in spaces.items() if is_wide[s] or len(cells) == most]
    joined = {int(parts[c]) for space in begins for c in spaces[space]}
    enters = {s: any(int(parts[c]) in joined - {0} for c in cells) for s, cells in spaces.items()}
    expected = {
        space: (is_wide[space] or enters[space])
        if isinstance(space, int)
        else is_wide[space] and enters[space] and len(cells) * side_m**2 >= 1
        for space, cells in spaces.items()
    }
    assert rooms.is_listed.tolist() == [expected.get(n, False) for n in range(len(labels.names))]
    shown = {door.number for door in rooms.listed_doors}
    space_of = {cell: space for space, cells in spaces.items() for cell in cells}
    for door in rooms.doors:
        beside = {
            space_of[tuple(divmod(flat, grid.shape[1]))]
            for flat in rooms.cells_beside(door.number).tolist()
        }
        if len(beside) == 2:  # else a boundary passes several nameless spaces
            assert (door.number in shown) == (all(map(expected.get, beside)) and not door.is_gap)


@pytest.fixture
def map_file(tmp_path):
    """The map with the ray, and its rooms beside it under the names that are found."""
    grid, labels = glass()
    value = {CellClass.OCCUPIED: 0, CellClass.FREE: 254, CellClass.UNEXPLORED: 205}
    pixels = np.vectorize(value.get)(GLASS).astype(np.uint8)
    Image.fromarray(pixels[::-1]).save(tmp_path / "glass.pgm")
    path = tmp_path / "glass.yaml"
    path.write_text(
        f"image: glass.pgm\nresolution: {SIDE}\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    hn.save_rooms(tmp_path / "rooms.yaml", labels, grid)
    return path


def test_the_list_leaves_the_ray_out_and_all_shows_it(cli, map_file, tmp_path):
    query = ("rooms", map_file, "--rooms", tmp_path / "rooms.yaml")
    told = cli(*query).out
    assert "room-3" not in told
    assert "not listed without --all: 1 narrow room without a way in" in told
    assert "room-3" in cli(*query, "--all").out
    answer = cli(*query, "--json").answer
    assert [room["is_listed"] for room in answer["rooms"]] == [True, True, False]
    assert answer["is_building"]


def test_exports_leave_the_ray_out_and_everything_writes_it(tmp_path):
    grid, labels = glass()
    rooms = rooms_of(grid, labels)
    for everything in (False, True):
        for ending, mark in (("csv", "room-3,"), ("geojson", '"room-3"')):
            file = tmp_path / f"rooms.{ending}"
            hn.export_rooms(rooms, file, everything=everything)
            assert (mark in file.read_text()) == everything


def test_the_picture_leaves_the_ray_out_and_everything_shows_it():
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(glass()[0], rooms=glass()[1]))
    names = [text.get_gid() for text in plot_rooms(topology).texts]
    assert "room-2" not in names
    names = [text.get_gid() for text in plot_rooms(topology, everything=True).texts]
    assert any(name is not None and name.endswith("-2") for name in names)


def test_a_map_without_doors_between_walls_says_that_it_is_no_building(cli, tmp_path):
    track = np.full((40, 60), CellClass.OCCUPIED, dtype=np.uint8)
    track[4:36, 4:56], track[12:28, 12:48] = CellClass.FREE, CellClass.OCCUPIED
    grid = occupancy_grid(track, resolution_m=SIDE)
    assert not rooms_of(grid, hn.find_rooms(grid)).is_building
    write_ros_map(grid, tmp_path / "track.yaml")
    told = cli("rooms", tmp_path / "track.yaml").out
    assert "building   no door between walls: these rooms are parts of open space" in told
