"""Rooms as a level of the pyramid, doors between them, and what lists and pictures leave out."""

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import strategies as st
from scipy import ndimage
from scipy.spatial.distance import cdist

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, RoomLabels
from hybridnav.maps.files.ros import write_ros_map
from hybridnav.viz import plot_rooms
from tests.drawn_rooms import write_ros
from tests.strategies import drawn, labelled, occupancy_grid, tried

TWO_ROOMS = drawn(
    "#########", "#...#...#", "#.......#", "#...#...#", "#...#...#", "#.......#", "#########"
)


def named(label_of, **points):
    label_of = np.asarray(label_of, dtype=np.int32)
    names = tuple(f"r{i}" for i in range(int(label_of.max()) + 1))
    return RoomLabels(names, label_of, points)


def left_and_right(classes, middle):
    labels = np.zeros(classes.shape, dtype=np.int32)
    labels[:, middle:] = 1
    return named(labels)


def connected_parts(classes, kinds):
    """Sets of 4-connected cells of one kind, by networkx: no code in common with the pyramid."""
    rows, cols = classes.shape
    graph = nx.grid_2d_graph(rows, cols)
    graph.remove_nodes_from([cell for cell in graph if classes[cell] == 0])
    graph.remove_edges_from([edge for edge in graph.edges if kinds[edge[0]] != kinds[edge[1]]])
    return {frozenset(part) for part in nx.connected_components(graph)}


def fields_of(level):
    return {
        frozenset(map(tuple, level.receptive_field(v).tolist())) for v in range(level.n_vertices)
    }


@tried(25, scene=labelled(), merge_distance_m=st.sampled_from([1.5, 4.0, 30.0]))
def test_rooms_are_the_connected_parts_of_one_label_whatever_the_merge_distance(
    scene, merge_distance_m
):
    classes, rooms = scene
    pyramid = hn.DualGraphPyramid.build(
        occupancy_grid(classes), merge_distance_m=merge_distance_m, rooms=rooms
    )
    kinds = classes.astype(int) + 10 * (rooms.label_of + 1)
    assert fields_of(pyramid[pyramid.room_level]) == connected_parts(classes, kinds)
    assert fields_of(pyramid[-1]) == connected_parts(classes, classes)
    for level in pyramid[: pyramid.room_level + 1]:
        labels = [
            np.unique(rooms.label_of[tuple(f.T)])
            for f in map(level.receptive_field, range(level.n_vertices))
        ]
        assert all(len(label) == 1 for label in labels)


@tried(40, scene=labelled(), linkage=st.sampled_from(["survivor", "radius", "diameter"]))
def test_places_below_rooms_keep_the_cap_and_every_level_has_its_dual(scene, linkage):
    classes, rooms = scene
    pyramid = hn.DualGraphPyramid.build(
        occupancy_grid(classes), merge_distance_m=3.0, linkage=linkage, rooms=rooms
    )
    places = pyramid[pyramid.place_level]
    for vertex in range(places.n_vertices):
        field = places.receptive_field(vertex)
        if linkage == "radius":
            assert (np.hypot(*(field - places.cells[vertex]).T) < 3.0).all()
        if linkage == "diameter":
            apart = field[:, None] - field[None]
            assert (np.hypot(apart[..., 0], apart[..., 1]) < 3.0).all()
    for level in pyramid:
        parts = connected_parts(classes, np.zeros_like(classes))
        isolated = level.n_vertices - len(np.unique(level.arcs))
        n_faces = level.dual.n_faces
        assert level.n_vertices - level.n_arcs + n_faces == 2 * len(parts) - isolated


def test_every_door_between_two_rooms_is_an_arc_of_its_own_with_a_width():
    grid = occupancy_grid(TWO_ROOMS, resolution_m=0.5)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=left_and_right(TWO_ROOMS, 4))
    doors = hn.TopologicalMap(pyramid).rooms.doors
    assert [door.rooms for door in doors] == [("r0", "r1")] * 2
    assert sorted(door.position[1] for door in doors) == [0.75, 2.25]
    assert [door.width_m for door in doors] == pytest.approx([0.5, 0.5])


def test_an_opening_is_as_wide_as_the_gap_between_its_posts():
    classes = drawn("#########", "#...#...#", *["#.......#"] * 5, "#...#...#", "#########")
    pyramid = hn.DualGraphPyramid.build(
        occupancy_grid(classes, resolution_m=0.2), rooms=left_and_right(classes, 4)
    )
    (door,) = hn.TopologicalMap(pyramid).rooms.doors
    assert door.width_m == pytest.approx(1.0)


def test_what_lies_in_no_room_is_a_vertex_without_a_name():
    labels = np.full(TWO_ROOMS.shape, -1)
    labels[:, :4] = 0
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(TWO_ROOMS), rooms=named(labels))
    rooms = hn.TopologicalMap(pyramid).rooms
    assert {door.rooms for door in rooms.doors} == {("r0", None)}
    assert rooms.areas_m2.tolist() == [15.0]


def test_a_pyramid_without_rooms_says_so_and_ends_at_its_places():
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(TWO_ROOMS))
    assert pyramid.place_level == len(pyramid) - 1
    with pytest.raises(hn.errors.InvalidValueError, match="no rooms"):
        hn.TopologicalMap(pyramid).rooms  # noqa: B018


def test_one_room_for_all_changes_no_place():
    labels = named(np.zeros(TWO_ROOMS.shape, dtype=np.int32))
    plain = hn.DualGraphPyramid.build(occupancy_grid(TWO_ROOMS), merge_distance_m=2.0)
    with_room = hn.DualGraphPyramid.build(
        occupancy_grid(TWO_ROOMS), merge_distance_m=2.0, rooms=labels
    )
    same = with_room[with_room.place_level].field_of == plain[-1].field_of
    assert same.all()


def test_the_point_of_a_room_is_its_named_one_or_the_clearest():
    rooms = left_and_right(TWO_ROOMS, 4)
    points = RoomLabels(rooms.names, rooms.label_of, {"r1": (6.5, 1.5)})
    view = hn.TopologicalMap(
        hn.DualGraphPyramid.build(occupancy_grid(TWO_ROOMS), rooms=points)
    ).rooms
    assert view.point_of("r1") == (6.5, 1.5)
    assert view.point_of("r0") in {(2.5, 2.5), (2.5, 3.5), (2.5, 4.5)}


@pytest.mark.parametrize(
    ("names", "label", "says"),
    [
        (("a", "a"), 0, "room 'a': the name is given twice"),
        (("",), 0, "one printable line"),
        (("a\nb",), 0, "one printable line"),
        (("a" * 81,), 0, "at most 80"),
        (("a",), 1, "from -1 to 0"),
        (("a",), -2, "from -1 to 0"),
    ],
)
def test_labels_that_cannot_be_are_refused(names, label, says):
    with pytest.raises(hn.errors.InvalidValueError, match=says):
        RoomLabels(names, np.full((2, 2), label))


def test_labels_of_another_shape_are_refused():
    with pytest.raises(hn.errors.InvalidValueError, match=r"\(3, 3\)"):
        hn.DualGraphPyramid.build(
            occupancy_grid(TWO_ROOMS), rooms=RoomLabels(("a",), np.zeros((3, 3), dtype=np.int32))
        )


@pytest.mark.parametrize(
    ("given_name", "says"),
    [
        ("kitchn", "did you mean kitchen"),
        ("LAB", "did you mean lab"),
        ("zzzz", "there are kitchen"),
    ],
)
def test_a_misspelt_name_suggests_the_nearest(given_name, says):
    labels = RoomLabels(("kitchen", "lab"), np.zeros((2, 2), dtype=np.int32))
    with pytest.raises(hn.errors.InvalidValueError, match=says):
        labels.index(given_name)


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


@tried(120, labelled(), st.sampled_from([0.0, 0.3, 0.8]), st.sampled_from([0.25, 0.5, 1.0]))
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
    hn.save_rooms(tmp_path / "rooms.yaml", labels, grid)
    return write_ros(tmp_path, "glass", np.vectorize(value.get)(GLASS), SIDE)


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


def test_a_room_without_a_free_cell_has_a_point_and_the_largest_of_none_is_not_listed():
    grid = occupancy_grid(np.full((1, 2), CellClass.UNEXPLORED))
    rooms = rooms_of(grid, RoomLabels(("attic", "room-1"), np.array([[0, 1]], np.int32)))
    assert rooms.point_of("attic") == tuple(grid.frame.points_of(np.array([[0, 0]]))[0])
    assert rooms.is_listed.tolist() == [True, False]


def test_a_map_without_rooms_lists_none():
    grid = occupancy_grid(np.full((1, 1), CellClass.FREE))
    rooms = rooms_of(grid, RoomLabels((), np.full((1, 1), -1, np.int32)))
    assert rooms.is_listed.tolist() == []
    assert rooms.listed_doors == ()
