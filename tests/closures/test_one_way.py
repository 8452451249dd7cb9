"""`OneWay`: lines snapped to sides, sides of doors and arcs, the moves that these forbid."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.closures.one_way import as_one_way
from hybridnav.errors import InvalidValueError
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.pyramid import LevelArc
from hybridnav.search.found import ClosedCells, Query
from tests.plans import TWO_ROOMS as ROOMS
from tests.strategies import examples, occupancy_grid

PLAIN = settings(max_examples=examples(100), deadline=None, derandomize=True)
STEPS = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
"""Directions of moves, counter-clockwise from east."""
CORNERS = st.tuples(st.integers(0, 6), st.integers(0, 6)).map(lambda at: (at[0], at[1]))


def open_map(shape: tuple[int, int] = (6, 6), frame: Frame | None = None) -> OccupancyGrid:
    return OccupancyGrid(np.zeros(shape, np.float32), frame=frame or Frame(), robot_radius_m=0)


def forbidden_by(sides: Any, shape: tuple[int, int]) -> np.ndarray[Any, Any]:
    """The forbidden moves, read off the definition move by move."""
    wrong = {(*row[2:], *row[:2]) for row in sides.tolist()}
    moves = np.zeros(shape, np.uint8)
    for row, col in np.ndindex(shape):
        for k, (up, right) in enumerate(STEPS):
            to = row + up, col + right
            if not (0 <= to[0] < shape[0] and 0 <= to[1] < shape[1]):
                continue
            ways: list[list[tuple[int, int]]] = [[(row, col), to]]
            if k % 2:
                ways = [[(row, col), by, to] for by in ((row, to[1]), (to[0], col))]
            if all(any((*a, *b) in wrong for a, b in pairwise(way)) for way in ways):
                moves[row, col] |= 1 << k
    return moves


@PLAIN
@given(st.lists(st.lists(CORNERS, min_size=2, max_size=4, unique=True), min_size=1, max_size=6))
def test_moves_are_those_of_the_definition(lines: list[list[tuple[int, int]]]) -> None:
    try:
        found = hn.OneWay(lines=lines).on(open_map())
    except InvalidValueError:  # along the edge of the map, or back on itself
        return
    assert np.array_equal(found.moves, forbidden_by(found.sides, (6, 6)))
    assert found.sides.tolist() == sorted(found.sides.tolist())


@PLAIN
@given(
    st.lists(CORNERS, min_size=2, max_size=4, unique=True),
    st.floats(0, 6.28),
    st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
)
def test_a_line_in_any_frame_is_the_same_and_turned_round_its_sides_are(line, yaw, at):
    plain = open_map((9, 9))
    frame = Frame(resolution_m=0.5, origin_m=at, yaw_rad=yaw)
    turned = frame.points_of_grid(np.array(line, dtype=float)[:, ::-1] + 1.1)
    moved = np.array(line) + 1.1
    found = hn.OneWay(lines=[moved]).on(plain).sides
    assert np.array_equal(hn.OneWay(lines=[turned]).on(open_map((9, 9), frame)).sides, found)
    back = hn.OneWay(lines=[moved[::-1]]).on(plain).sides
    assert sorted(back[:, [2, 3, 0, 1]].tolist()) == found.tolist()


def test_a_line_is_crossed_from_its_left_to_its_right_by_sides_that_lie_nearest() -> None:
    def across(*line: tuple[float, float]) -> list[list[int]]:
        sides: list[list[int]] = hn.OneWay(lines=[line]).on(open_map()).sides.tolist()
        return sides

    assert across((2.2, 0.9), (1.8, 3.4)) == [[1, 1, 1, 2], [2, 1, 2, 2]]  # north: west to east
    assert across((2, 3), (2, 1)) == [[1, 2, 1, 1], [2, 2, 2, 1]]
    assert across((1, 2), (3, 2)) == [[2, 1, 1, 1], [2, 2, 1, 2]]  # east: from above to below
    # A line of slope 1/3 goes up in the middle of its steps.
    assert across((0, 1), (6, 3))[0] == [1, 0, 0, 0]
    assert across((1, 1), (4, 1), (2, 1)) == across((1, 1), (2, 1))  # runs back on itself


def test_a_path_goes_round_the_end_of_a_line_and_not_through() -> None:
    found = hn.OneWay(lines=[[(2, 1), (2, 3)]]).on(open_map())
    assert found.meets(np.array([[1, 2], [1, 1]]))
    assert not found.meets(np.array([[1, 1], [1, 2]]))
    assert not found.meets(np.array([[0, 2], [1, 1]]))  # round the end, touching it
    assert not found.meets(np.array([[3, 2], [2, 1]]))
    assert found.meets(np.array([[1, 2], [2, 1]]))  # through the middle
    shut = hn.OneWay(lines=[[(2, 1), (2, 3)], [(2, 3), (2, 1)]]).on(open_map())
    assert len(shut.sides) == 4
    assert shut.meets(np.array([[1, 1], [1, 2]]))
    assert {name: at.tolist() for name, at in shut.parts.items()} == {
        "line 1": [0, 2],
        "line 2": [1, 3],
    }


def rooms() -> hn.TopologicalMap:
    grid = occupancy_grid(ROOMS)
    labels = np.full(grid.shape, -1)
    labels[:, : grid.shape[1] // 2] = 0
    names = hn.RoomLabels(("west",), labels.astype(np.int32))
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=names))


def test_a_door_leads_into_the_room_that_is_named() -> None:
    topology = rooms()
    door = topology.rooms.doors[0]
    (name,) = {one for one in door.rooms if one is not None}
    into = hn.OneWay(doors=[(door.number, name)]).on(topology.grid, topology)
    out = hn.OneWay(doors=[(door, None)]).on(topology.grid, topology)
    assert len(into.sides) == len(topology.rooms.moves_through(door.number))
    label_of = topology.rooms.labels.label_of
    assert (label_of[tuple(into.sides[:, 2:].T)] == topology.rooms.labels.index(name)).all()
    assert (label_of[tuple(into.sides[:, :2].T)] == -1).all()
    assert sorted(into.sides[:, [2, 3, 0, 1]].tolist()) == out.sides.tolist()
    assert list(into.parts) == [f"{door.kind} {door.number}"]
    assert into.lost(np.zeros(topology.grid.shape, np.bool_)) == tuple(into.parts)
    assert into.lost(topology.grid.enterable()) == ()
    with pytest.raises(InvalidValueError, match="and leads into no 'cellar': name the room"):
        hn.OneWay(doors=[(door, "cellar")]).on(topology.grid, topology)


def test_an_arc_leads_into_the_place_that_is_named() -> None:
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(occupancy_grid(ROOMS), merge_distance_m=3.0)
    )
    level, checked = topology.level, 0
    for index, (one, other) in enumerate(level.arcs.tolist()):
        arc, into = int(topology.arc_ids[index]), int(topology.place_ids[other])
        if level.is_self_loop[index]:
            with pytest.raises(InvalidValueError, match="has no direction into"):
                hn.OneWay(arcs=[(arc, into)]).on(topology.grid, topology)
            continue
        checked += 1
        found = hn.OneWay(arcs=[(arc, into)]).on(topology.grid, topology).sides
        assert (level.field_of[tuple(found[:, :2].T)] == one).all()
        assert (level.field_of[tuple(found[:, 2:].T)] == other).all()
        assert len(found) == level.n_cracks[index]
        same = LevelArc(topology.pyramid.place_level, index)
        assert np.array_equal(
            hn.OneWay(arcs=[(same, other)]).on(topology.grid, topology).sides, found
        )
    assert checked


def test_the_union_keeps_all_and_equal_values_have_equal_keys() -> None:
    line, sides = hn.OneWay(lines=[[(2, 1), (2, 3)]]), hn.OneWay(sides=[(0, 4, 0, 5), (0, 4, 0, 5)])
    both = line | sides | hn.OneWay(named={"drawn": line})
    found = both.on(open_map())
    assert {name: at.tolist() for name, at in found.parts.items()} == {
        "line 1": [1, 2],
        "sides": [0],
        "drawn": [1, 2],
    }
    again = hn.OneWay(lines=[shapely.LineString([(2, 1), (2, 3)])])
    assert again.key == line.key != sides.key
    assert as_one_way(shapely.LineString([(2, 1), (2, 3)])).key == line.key
    assert as_one_way({"lines": [[(2, 1), (2, 3)]]}).key == line.key
    assert not hn.OneWay().on(open_map()).moves.any()


@pytest.mark.parametrize(
    ("given_", "said"),
    [
        ({"lines": [[(0, 0)]]}, "two or more finite points"),
        ({"lines": [[(0, 0), (math.nan, 1)]]}, "two or more finite points"),
        ({"lines": [shapely.Point(0, 0)]}, "two or more finite points"),
        ({"lines": shapely.LineString([(0, 0), (1, 1)])}, "lines must be a sequence"),
        ({"lines": [[(0, 0), (0.1, 0.1)]]}, "longer than a cell of 1 m"),
        ({"lines": [[(0, 0), (1e9, 0.1)]]}, "within 1e.06 cells of the map"),
        ({"lines": [[(50, 50), (60, 50)]]}, "lies beside it: draw it through free space"),
        ({"doors": [3]}, "doors must be pairs"),
        ({"doors": [(True, "a")]}, "doors must be pairs"),
        ({"arcs": [(3, None)]}, r"as \(7, 12\)"),
        ({"sides": [(0, 0, 1, 1)]}, r"must be 4-neighbours, got \(0, 0, 1, 1\)"),
        ({"sides": [(0.5, 0, 1, 1)]}, "integers"),
        ({"sides": [(0, 5, 0, 6)]}, "must lie on the map of 6 x 6 cells"),
        ({"named": {"a": 3}}, "a mapping of names to OneWay"),
        ({"walls": []}, "one_way takes lines, doors, arcs, sides, named, got walls"),
        (7, "must be a OneWay, a LineString or a mapping"),
    ],
)
def test_mistakes_end_in_one_line(given_: Any, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said) as caught:
        as_one_way(given_).on(open_map())
    assert "\n" not in str(caught.value)


def test_closed_cells_hold_directions_and_join_them() -> None:
    grid = open_map()
    none = np.empty(0, np.int64)
    line = ClosedCells(none, one_way=hn.OneWay(lines=[[(2, 1), (2, 3)]]).on(grid))
    back = ClosedCells(none, one_way=hn.OneWay(lines=[[(2, 2), (2, 1)]]).on(grid))
    east, west = np.array([[1, 1], [1, 2]]), np.array([[1, 2], [1, 1]])
    assert (line.meets(east, grid), line.meets(west, grid)) == (False, True)
    both = line | back | ClosedCells(np.array([0]))
    assert both.meets(east, grid)
    assert not both.meets(east + np.array([1, 0]), grid)
    assert both.one_way.parts["line 1"].tolist() == [0, 1, 2]
    query = Query(((1, 1), (1, 2)), (np.zeros(2), np.zeros(2)), both)
    assert query.one_way is both.one_way
    assert Query(query.cells, query.points).one_way is None
