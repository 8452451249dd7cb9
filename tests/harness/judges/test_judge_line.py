"""The judge of any-angle paths, and the cells that they pass, against shapely."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import VisibilityGraph, judge_line, line_cells
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from tests.strategies import class_grids, drawn, examples, occupancy_grid

ROOM = drawn(
    ".....",
    "..#..",
    ".....",
    ".#.?.",
    "..#..",
)


def framed(classes: Any) -> OccupancyGrid:
    """The map with a resolution, an origin and a yaw that no rounding is kind to."""
    frame = Frame(resolution_m=0.05, origin_m=(12.3, -7.1), yaw_rad=0.4)
    return OccupancyGrid(occupancy_grid(classes).probability, frame=frame, robot_radius_m=0)


@given(class_grids(max_side=8), st.integers(0, 2**32 - 1))
@settings(max_examples=examples(60))
def test_the_cells_of_a_shortest_path_are_those_that_it_passes(classes: Any, seed: int) -> None:
    free = classes == CellClass.FREE
    assume(free.any())
    rng, grid = np.random.default_rng(seed), framed(classes)
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
    grid = framed(drawn("...", "...", "..."))
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
    grid = framed(ROOM)
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
