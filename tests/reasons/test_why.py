"""Reasons, against brute force: every radius by flooding, every set of closures by trying it."""

import copy
import itertools
import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.maps.widest import WidestPaths
from hybridnav.reasons.why_words import Closure
from tests.strategies import class_grids, drawn, examples, occupancy_grid

PLAIN = settings(max_examples=examples(150), deadline=None, derandomize=True)
EIGHT = np.ones((3, 3))
HOUSE = drawn(
    "............",
    "............",
    "#####..#####",
    "............",
    "............",
    "#####..#####",
    "............",
    "............",
)


def joined(cells, one, other, *, corners=False):
    labels, _ = ndimage.label(cells, EIGHT if corners else None)
    return labels[one] == labels[other] != 0


def radii_of(grid):
    """All radii at which the enterable cells change, and those between them, by distances of
    all pairs of cells."""
    rows, cols = np.indices(grid.shape).reshape(2, -1)
    occupied = (grid.measured == CellClass.OCCUPIED).ravel()
    squared = (rows[:, None] - rows[occupied]) ** 2 + (cols[:, None] - cols[occupied]) ** 2
    steps = np.sqrt(np.unique(squared))
    return np.unique(np.concatenate([[0.0], steps, (steps[1:] + steps[:-1]) / 2, steps[-1:] + 1]))


def endpoints(grid, seed):
    cells = np.argwhere(grid.measured != CellClass.OCCUPIED)
    picked = np.random.default_rng(seed).choice(cells, 2)
    return tuple(tuple(cell) for cell in picked.tolist())


@PLAIN
@given(class_grids(), st.integers(0, 9), st.booleans(), st.booleans())
def test_exactly_the_radii_below_the_bottleneck_have_a_path(classes, seed, corners, unexplored):
    grid = replace(occupancy_grid(classes), corner_cutting=corners)
    if not (grid.measured != CellClass.OCCUPIED).any():
        return
    one, other = endpoints(grid, seed)
    widest = WidestPaths(grid, allow_unexplored=unexplored).between(one, other)
    if not (grid.measured == CellClass.OCCUPIED).any():
        cells = grid.enterable(allow_unexplored=unexplored)
        assert widest.radius_m == (math.inf if joined(cells, one, other, corners=corners) else 0)
        return
    for radius in radii_of(grid):
        cells = replace(grid, robot_radius_m=radius).enterable(allow_unexplored=unexplored)
        has_path = joined(cells, one, other, corners=corners)
        assert has_path == (radius < widest.radius_m), radius
    if widest.cell is not None:
        occupied = np.argwhere(grid.measured == CellClass.OCCUPIED)
        apart = math.sqrt(((occupied - widest.cell) ** 2).sum(axis=1).min())
        assert apart == widest.radius_m
        closed = np.zeros(grid.shape, np.bool_)
        closed[widest.cell] = True
        beside = WidestPaths(grid, closed=closed, allow_unexplored=unexplored)
        assert beside.between(one, other).radius_m <= widest.radius_m


@settings(max_examples=examples(600), deadline=None, derandomize=True)
@given(st.integers(0, 10**6), st.booleans())
def test_the_fewest_closed_doors_are_those_of_all_subsets(seed, corners):
    rng = np.random.default_rng(seed)
    side, across = rng.integers(2, 5), rng.integers(2, 4)
    shape = side * 3, side * across
    classes = np.where(rng.random(shape) < rng.choice([0.1, 0.3]), 0, 1).astype(np.uint8)
    numbers = np.arange(3 * across, dtype=np.int32).reshape(3, across)
    if rng.random() < 0.5:
        numbers = rng.integers(0, 4, (3, across), np.int32)  # doors of several passages
    labels = hn.RoomLabels(tuple("abcdefghi"), np.kron(numbers, np.ones((side, side), np.int32)))
    grid = replace(occupancy_grid(classes), corner_cutting=corners)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    planner = hn.HybridPlanner(topology, preset="octile")
    doors = [door.number for door in topology.rooms.doors if door.arcs][:11]
    free = np.argwhere(grid.classes == CellClass.FREE)
    if not doors or len(free) < 2:
        return
    start, goal = grid.frame.points_of(rng.choice(free, 2, replace=False))
    result = planner.plan(start, goal, blocked={"doors": doors})
    if result.status is not hn.PlanStatus.NO_PATH:
        return
    why = why_of(result)
    check_cut(planner, why, start, doors)
    if not planner.plan(start, goal).solved or why.blocked_ends:
        assert why.to_open == ()
        return
    goes_with = planned if corners else walked
    assert all(one.kind == "doors" for one in why.to_open)
    opened = {one.which for one in why.to_open}
    ends = tuple(map(tuple, grid.frame.cells_of(np.array([start, goal])).tolist()))
    if not walked(planner, ends, set(doors)):
        assert opened
        assert goes_with(planner, ends, set(doors) - opened)
    for size in range(len(opened)):
        for some in itertools.combinations(doors, size):
            assert not goes_with(planner, ends, set(doors) - set(some)), (some, opened)


def check_cut(planner, why, start, doors):
    """The cut is a closed chain of neighbours, none of which is reached from the start."""
    if why.blocked_ends or planner.grid.corner_cutting:
        assert why.cut is None
        return
    cells = planner.grid.frame.cells_of(why.cut)
    assert (cells[0] == cells[-1]).all()
    assert (np.abs(np.diff(cells, axis=0)).max(axis=1) == 1).all() or len(cells) == 1
    able = planner.grid.classes == CellClass.FREE
    able.ravel()[planner.closed({"doors": doors}).flat] = False
    labels, _ = ndimage.label(np.pad(able, 1))
    row, col = planner.grid.frame.cells_of(start)
    assert not (labels[tuple((cells + 1).T)] == labels[row + 1, col + 1]).any()


def planned(planner, ends, closed):
    """Whether the planner goes from one cell to another with closed doors."""
    start, goal = planner.grid.frame.points_of(np.array(ends))
    return planner.plan(start, goal, blocked={"doors": sorted(closed)}).solved


def walked(planner, ends, closed):
    """The same by steps to the side over no closed door; a planner closes cells, and more of
    them."""
    able = planner.grid.classes == CellClass.FREE
    rooms = planner.topology.rooms
    barred = {tuple(move) for door in closed for move in rooms.moves_through(door).tolist()}
    cols = able.shape[1]
    known, queue = {ends[0]}, [ends[0]]
    while queue:
        row, col = queue.pop()
        for near in ((row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)):
            if near in known or not (0 <= near[0] < len(able) and 0 <= near[1] < cols):
                continue
            move = tuple(sorted((row * cols + col, near[0] * cols + near[1])))
            if able[near] and move not in barred:
                known.add(near)
                queue.append(near)
    return ends[1] in known


def why_of(result: hn.PlanResult) -> Any:
    assert result.explanation is not None
    return result.explanation


def house():
    """Three rooms in a column, a door of two cells between each two."""
    grid = OccupancyGrid(
        (HOUSE == CellClass.OCCUPIED).astype(np.float32), Frame(), robot_radius_m=0
    )
    labels = np.repeat([0, 0, 0, 1, 1, 1, 2, 2], 12).reshape(8, 12)
    rooms = hn.RoomLabels(("low", "middle", "high"), labels)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))


def test_closures_of_every_kind_are_named_and_counted():
    topology = house()
    planner = hn.HybridPlanner(topology, preset="octile")
    resolution = topology.grid.resolution_m
    start, goal = topology.grid.frame.points_of([[0, 1], [7, 1]])
    one, other = (door.number for door in topology.rooms.doors)
    band = shapely.box(0, 3.2 * resolution, 12 * resolution, 3.8 * resolution)
    blocked = {"doors": [one], "cells": [(2, 5), (2, 6)], "keepout": [band], "rooms": ["high"]}
    why = hn.explain(planner, start, goal, blocked={"doors": [one, other], "keepout": [band]})
    assert set(why.to_open) == {
        Closure("doors", one),
        Closure("doors", other),
        Closure("keepout", 0),
    }
    assert "no fewer suffice" in why.reason
    ended = hn.explain(planner, start, goal, blocked=blocked)
    assert [end.closures for end in ended.blocked_ends] == [(Closure("rooms", "high"),)]
    assert "room high" in ended.reason
    single = planner.plan(start, goal, blocked={"doors": [one]})
    assert single.reason == f"Door {one} is closed, and there is no other way."
    assert why_of(single).words("de") == [
        f"Gesperrt ist Tür {one}, und einen anderen Weg gibt es nicht."
    ]
    flat = planner.closed({"cells": [(2, 5), (2, 6)]})
    assert why_of(planner.plan(start, goal, blocked=flat)).to_open == (Closure("cells", None),)


def test_a_closed_door_lets_no_smaller_robot_through():
    topology = house()
    grid = replace(topology.grid, robot_radius_m=1.2 * topology.grid.resolution_m)
    rooms = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=topology.pyramid.rooms))
    planner = hn.HybridPlanner(rooms, preset="octile")
    start, goal = grid.frame.points_of([[0, 1], [7, 1]])
    door = rooms.rooms.doors[0]
    assert not door.arcs
    free = why_of(planner.plan(start, goal))
    assert free.closed.radius_m == grid.resolution_m
    assert free.to_open == ()
    shut = hn.explain(planner, start, goal, blocked={"doors": [door.number]})
    assert shut.closed.radius_m == 0
    assert shut.opened == free.opened
    assert "even with nothing closed" in shut.reason


def test_costs_that_close_cells_are_a_closure():
    topology = house()
    factors = np.ones(topology.grid.shape)
    closed = np.zeros(topology.grid.shape, np.bool_)
    closed[2, 5:7] = True
    costs = hn.CostLayer(factors, closed=closed)
    planner = hn.HybridPlanner(topology, preset="grid-astar", costs=costs)
    start, goal = topology.grid.frame.points_of([[0, 1], [7, 1]])
    result = planner.plan(start, goal)
    assert why_of(result).to_open == (Closure("costs", None),)
    assert result.reason == "The keep-out of the costs is closed, and there is no other way."


def test_unexplored_cells_may_lead_through():
    classes = HOUSE.copy()
    classes[2, 5:7] = CellClass.UNEXPLORED
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(classes)))
    start, goal = topology.grid.frame.points_of([[0, 1], [7, 1]])
    why = why_of(hn.HybridPlanner(topology, preset="octile").plan(start, goal))
    assert why.through_unexplored
    assert why.reason == "Unexplored cells lie between, and a way may lead through them."
    classes[2, 5:7] = CellClass.OCCUPIED
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(classes)))
    walls = hn.HybridPlanner(topology, preset="octile").plan(start, goal)
    assert walls.reason.startswith("Obstacles and unexplored cells enclose the start: 24.0 m²")


@pytest.mark.parametrize(
    ("point", "said"),
    [
        ((-1.0, 0.5), "The goal lies outside the map. The nearest point"),
        ((0.5, 2.5), "The goal lies in an obstacle. The nearest point"),
    ],
)
def test_ends_that_no_robot_can_stand_on(point, said):
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(HOUSE)))
    result = hn.HybridPlanner(topology, preset="octile").plan((1.5, 0.5), point)
    assert result.reason.startswith(said)
    assert why_of(result).blocked_ends[0].status is result.status


def test_results_take_their_explanation_along():
    topology = house()
    planner = hn.HybridPlanner(topology, preset="octile")
    start, goal = topology.grid.frame.points_of([[0, 1], [7, 1]])
    blocked = {"doors": [topology.rooms.doors[0].number]}
    result = planner.plan(start, goal, blocked=blocked)
    sent = pickle.loads(pickle.dumps(result))  # noqa: S301 - our own
    for twin in (copy.copy(result), copy.deepcopy(result), sent):
        assert why_of(twin).to_dict() == why_of(result).to_dict()
    solved = planner.plan(start, goal)
    assert solved.explanation is None
    assert not solved.reason


def test_hostile_questions_end_in_one_line():
    planner = hn.HybridPlanner(house())
    radii: list[Any] = [-1.0, math.nan, math.inf, "wide"]
    for radius in radii:
        with pytest.raises(InvalidValueError, match=r"\A[^\n]+\Z"):
            hn.explain(planner, (0.1, 0.1), (0.2, 0.1), radius_m=radius)
    with pytest.raises(InvalidValueError, match="language must be one of"):
        hn.explain(planner, (0.1, 0.1), (0.2, 0.1)).words("xx")


def test_a_found_room_is_not_called_a_room_twice():
    grid = hn.example_map("figure1")
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid)))
    why = hn.explain(
        hn.HybridPlanner(topology),
        (0.5, 0.5),
        (2.0, 2.5),
        blocked={"rooms": [topology.rooms.at((0.5, 0.5))]},
    )
    assert why.reason.startswith("The start is closed by room-")
