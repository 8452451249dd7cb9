"""The judges of any-angle paths, of arcs, and of cheapest costs, against shapely and scipy."""

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import (
    CheapestCost,
    ScipyOptimum,
    VisibilityGraph,
    chords_of,
    judge_line,
    line_cells,
)
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.costs import cost_along
from tests.layers import grid_of, layer_of
from tests.oracle.grid import distances, move_graph, weighted
from tests.strategies import class_grids, drawn, framed, occupancy_grid, seeds, tried

ROOM = drawn(".....", "..#..", ".....", ".#.?.", "..#..")


@tried(60, class_grids(max_side=8), seeds)
def test_the_cells_of_a_shortest_path_are_those_that_it_passes(classes: Any, seed: int) -> None:
    free = classes == CellClass.FREE
    assume(free.any())
    rng, grid = np.random.default_rng(seed), framed(classes, 0.4)
    graph = VisibilityGraph(grid)
    for _ in range(4):
        start, goal = (tuple(cell) for cell in rng.choice(np.argwhere(free), 2).tolist())
        points = graph.shortest(start, goal).points
        if points is None:
            continue
        assert judge_line(grid, points, start=start, goal=goal).ok
        cells = line_cells(grid, points)
        assert tuple(cells[0]) == start
        assert tuple(cells[-1]) == goal
        assert free[tuple(cells.T)].all()
        for (row, col), (next_row, next_col) in itertools.pairwise(cells):
            assert max(abs(row - next_row), abs(col - next_col)) == 1
            assert free[row, next_col] or free[next_row, col]
        named = set(map(tuple, cells.tolist()))
        inside, touched = cells_by_shapely(grid, points)
        assert inside <= named <= touched


def cells_by_shapely(grid: OccupancyGrid, points: Any) -> tuple[set[Any], set[Any]]:
    """Cells whose inside a line passes, and those along whose side it runs too."""
    # Shortest paths bend at corners of cells and end at centres: halves, exactly.
    positions = np.rint(2 * np.array([grid.frame.position_of(x, y) for x, y in points])) / 2
    if len(positions) == 1:
        cell = tuple(np.floor(positions[0]).astype(int).tolist())
        return {cell}, {cell}
    line = shapely.LineString(positions)
    boxes = {
        (row, col): shapely.box(row, col, row + 1, col + 1) for row, col in np.ndindex(*grid.shape)
    }
    inside = {cell for cell, box in boxes.items() if line.relate_pattern(box, "1********")}
    beside = {cell for cell, box in boxes.items() if line.intersection(box).length > 1e-9}
    return inside, inside | beside


def test_a_line_along_a_wall_is_on_its_free_side() -> None:
    for sketch, row in ((("...", "###"), 1), (("###", "..."), 0)):
        grid = occupancy_grid(drawn(*sketch))
        points = grid.frame.points_of_grid([(row + 0.5, 0.5), (1.0, 1.0), (1.0, 2.0), (1.0, 3.0)])
        assert set(map(tuple, line_cells(grid, points).tolist())) == {(row, c) for c in range(3)}


def test_a_line_through_a_corner_steps_diagonally() -> None:
    grid = framed(drawn("...", "...", "..."), 0.4)
    points = grid.frame.points_of([(0, 0), (2, 2)])
    assert line_cells(grid, points).tolist() == [[0, 0], [1, 1], [2, 2]]
    bent = grid.frame.points_of_grid([(0.5, 0.5), (1.0, 1.0), (1.0, 1.0), (0.5, 1.5)])
    assert line_cells(grid, bent).tolist() == [[0, 0], [0, 1]]


def test_unexplored_cells_are_passed_only_when_allowed() -> None:
    grid = occupancy_grid(ROOM)
    points = grid.frame.points_of([(2, 3), (1, 3), (1, 4)])
    endpoints: Any = {"start": (2, 3), "goal": (1, 4)}
    assert not judge_line(grid, points, **endpoints).ok
    assert judge_line(grid, points, **endpoints, allow_unexplored=True).ok
    assert line_cells(grid, points, allow_unexplored=True).tolist() == [[2, 3], [1, 3], [1, 4]]


@pytest.mark.parametrize(
    ("positions", "faults"),
    [
        ([(0.5, 0.5), (0.5, 1.5), (2.0, 4.0), (2.5, 4.5)], ["enters a blocked cell"]),
        ([(2.5, 0.5), (2.5, 4.5)], ["first point"]),
        ([(0.5, 0.5), (2.5, 0.5), (2.5, 4.4)], ["last point"]),
        ([(0.5, 0.5), (0.5, 5.5), (2.5, 4.5)], ["(and 1 more)"]),
        ([(0.5, 0.5), (2.5, 0.5), (2.5, 4.5)], []),
        ([(0.5, 0.5), (0.5, 0.5)], ["last point"]),
    ],
)
def test_each_planted_fault_is_named_once(positions: Any, faults: list[str]) -> None:
    grid = framed(ROOM, 0.4)
    verdict = judge_line(grid, grid.frame.points_of_grid(positions), start=(0, 0), goal=(2, 4))
    assert len(verdict.faults) == len(faults), verdict.faults
    assert all(want in got for want, got in zip(faults, verdict.faults, strict=True))
    steps = np.diff(positions, axis=0)
    length = math.fsum(math.hypot(*step) for step in steps.tolist()) * 0.05
    assert verdict.length_m == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("points", [[], [1.0, 2.0], [(0.0, math.nan)], [(0.0, 0.0, 0.0)]])
def test_what_is_no_line_is_refused(points: Any) -> None:
    with pytest.raises(InvalidValueError, match="points"):
        judge_line(occupancy_grid(ROOM), points, start=(0, 0), goal=(0, 0))
    with pytest.raises(InvalidValueError, match="points"):
        line_cells(occupancy_grid(ROOM), points)


GRID = grid_of(np.zeros((40, 40)), hn.Frame(0.5), robot_radius_m=0)
CENTRE = np.array([10.0, 10.0])


def arc(radius_m: float, start_rad: float, turn_rad: float) -> tuple[Any, Any]:
    """Points and headings of an arc about the centre of the map, in two parts."""
    at = start_rad + turn_rad * np.array([0.0, 0.4, 1.0])
    points = CENTRE + radius_m * np.stack([np.cos(at), np.sin(at)], axis=1)
    return points, at + math.copysign(math.pi / 2, turn_rad)


@tried(60, st.floats(0.3, 9.0), st.floats(-4, 4), st.floats(0.01, 3.0), st.booleans(), seeds)
def test_chords_lie_on_the_circle_and_have_its_length(
    radius_m: float, start_rad: float, turn_rad: float, to_the_left: bool, seed: int
) -> None:
    turn_rad = turn_rad if to_the_left else -turn_rad
    points, headings = arc(radius_m, start_rad, turn_rad)
    chords = chords_of(GRID, points, headings)
    assert chords.faults == ()
    assert chords.length_m == pytest.approx(radius_m * abs(turn_rad), rel=1e-9)
    assert np.hypot(*(chords.points - CENTRE).T) == pytest.approx(radius_m, rel=1e-9)
    middle = (chords.points[1:] + chords.points[:-1]) / 2 - CENTRE
    assert (radius_m - np.hypot(*middle.T) <= 1.01e-4 * 0.5).all()
    layer = layer_of(np.random.default_rng(seed).uniform(1, 4, GRID.shape))
    n = math.ceil(radius_m * abs(turn_rad) / 0.125)
    at = start_rad + turn_rad * np.arange(n + 1) / n
    priced = CENTRE + radius_m * np.stack([np.cos(at), np.sin(at)], axis=1)
    cost_m = cost_along(GRID, layer, chords.points)
    ratio = radius_m * abs(turn_rad) / np.hypot(*np.diff(priced, axis=0).T).sum()
    slack_m = chords.cost_slack_m(GRID, layer) + 1e-5 * cost_m
    assert abs(cost_along(GRID, layer, priced) * ratio - cost_m) <= slack_m * 1.001
    smooth = layer_of(1 + (layer.factors - 1) / 60)
    assert chords.cost_slack_m(GRID, smooth) < 0.05 * chords.length_m


def test_a_line_between_arcs_and_turns_on_the_spot() -> None:
    points = np.array([[2.0, 2.0], [3.0, 3.0], [5.0, 3.0], [5.0, 3.0], [5.0, 4.0]])
    headings = np.array([math.pi / 2, 0.0, 0.0, math.pi / 2, math.pi / 2])
    chords = chords_of(GRID, points, headings)
    assert chords.faults == ()
    assert chords.length_m == pytest.approx(math.pi / 2 + 3)
    assert chords.cost_slack_m(GRID, layer_of(np.ones(GRID.shape))) == 0


@pytest.mark.parametrize(
    "headings", [[0.3, 0.0], [math.pi / 2, 0.2], [-math.pi / 2, math.pi], [math.pi, math.pi]]
)
def test_a_step_that_is_no_arc_is_a_fault(headings: Any) -> None:
    chords = chords_of(GRID, [(2.0, 2.0), (3.0, 3.0)], headings)
    assert len(chords.faults) == 1
    assert "step 0 of the path is neither" in chords.faults[0]


def test_an_arc_through_an_obstacle_is_seen_though_its_chord_is_free() -> None:
    probability = np.zeros((40, 40))
    probability[20:, 20] = 1.0
    grid = grid_of(probability, hn.Frame(0.5), robot_radius_m=0)
    points = grid.frame.points_of([(18, 10), (18, 30)])
    ends: Any = {"start": (18, 10), "goal": (18, 30)}
    assert judge_line(grid, points, **ends).ok
    chords = chords_of(grid, points, [math.pi / 2, -math.pi / 2])
    assert chords.faults == ()
    assert not judge_line(grid, chords.points, **ends).ok
    below = chords_of(grid, points, [-0.5, 0.5])
    assert judge_line(grid, below.points, **ends).ok


@pytest.mark.parametrize("headings", [[0.0], [0.0, math.nan], [[0.0, 0.0]]])
def test_headings_that_are_none_are_refused(headings: Any) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="state one for each point"):
        chords_of(GRID, [(2.0, 2.0), (3.0, 3.0)], headings)


def test_a_step_far_beyond_the_map_takes_no_more_points_than_its_ends() -> None:
    chords = chords_of(GRID, [(1.0, 1.0), (1e12, 1.0)], [0.5, -0.5])
    assert chords.points.tolist() == [[1.0, 1.0], [1e12, 1.0]]


@tried(80, class_grids(max_side=20), seeds)
def test_costs_are_those_of_scipy(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    most = rng.choice([1.0, 3.0, 1000.0])
    layer = layer_of(rng.uniform(1, most, grid.shape), rng.random(grid.shape) < 0.05)
    is_open = grid.enterable()
    is_open.flat[layer.closed_flat] = False
    graph = weighted(move_graph(is_open), layer.factors.astype(float))
    start = tuple(rng.integers(grid.shape).tolist())
    least = distances(graph, grid.shape, start) * 0.5
    least[start] = 0.0
    search = CheapestCost(grid, layer)
    for goal in np.ndindex(grid.shape):
        known = least[goal] if is_open[goal] and is_open[start] else np.inf
        assert search.cost_m(start, goal) == pytest.approx(known, rel=1e-12)


def test_lengths_are_those_of_scipy_on_a_map() -> None:
    grid = hn.example_map("office", robot_radius_m=0.25)
    free = np.argwhere(grid.enterable())
    rng = np.random.default_rng(0)
    lengths, scipy = CheapestCost(grid), ScipyOptimum(grid)
    start = tuple(free[rng.integers(len(free))].tolist())
    known = scipy.lengths_from(start)
    for cell in free[rng.integers(len(free), size=20)].tolist():
        goal = (cell[0], cell[1])
        assert lengths.cost_m(start, goal) == pytest.approx(known[goal], rel=1e-12)


def test_corners_are_cut_where_the_map_allows_it() -> None:
    grid = grid_of(np.array([[0.0, 1.0], [0.0, 0.0]]), robot_radius_m=0)
    cut = dataclasses.replace(grid, corner_cutting=True)
    layer = layer_of(np.array([[1.0, 1.0], [9.0, 3.0]]))
    assert CheapestCost(grid, layer).cost_m((0, 0), (1, 1)) == 11.0
    assert CheapestCost(cut, layer).cost_m((0, 0), (1, 1)) == pytest.approx(2 * 2**0.5)


def test_cells_and_layers_of_other_maps_are_refused() -> None:
    grid = grid_of(np.zeros((2, 3)), robot_radius_m=0)
    with pytest.raises(
        hn.errors.InvalidValueError,
        match=r"goal is cell \(2, 0\), expected one of the map of 2 rows and 3 columns",
    ):
        CheapestCost(grid).cost_m((0, 0), (2, 0))
    with pytest.raises(hn.errors.InvalidValueError, match="costs of 4 x 4 cells are not those"):
        CheapestCost(grid, layer_of(np.ones((4, 4))))
