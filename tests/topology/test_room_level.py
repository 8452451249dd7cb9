"""Rooms as a level of the pyramid: what merges at which level, and the doors between rooms."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.maps import RoomLabels
from tests.strategies import drawn, examples, labelled, occupancy_grid

TWO_ROOMS = drawn(
    "#########",
    "#...#...#",
    "#.......#",
    "#...#...#",
    "#...#...#",
    "#.......#",
    "#########",
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


@settings(max_examples=examples(25))
@given(scene=labelled(), merge_distance_m=st.sampled_from([1.5, 4.0, 30.0]))
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


@settings(max_examples=examples(40))
@given(scene=labelled(), linkage=st.sampled_from(["survivor", "radius", "diameter"]))
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
    with pytest.raises(hn.InvalidValueError, match="no rooms"):
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
    with pytest.raises(hn.InvalidValueError, match=says):
        RoomLabels(names, np.full((2, 2), label))


def test_labels_of_another_shape_are_refused():
    with pytest.raises(hn.InvalidValueError, match=r"\(3, 3\)"):
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
    with pytest.raises(hn.InvalidValueError, match=says):
        labels.index(given_name)
