"""Motions of a robot: a disc is judged like by the judge, a shape like by shapely."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass, Frame, OccupancyGrid
from hybridnav.metrics import segment_faults
from hybridnav.refine import MotionCheck
from tests.strategies import class_grids, drawn, occupancy_grid

seeds = st.integers(0, 2**32 - 1)
yaws = st.sampled_from([0.0, 0.7, -2.5])


def framed(classes: Any, yaw_rad: float = 0.0, *, corner_cutting: bool = False) -> OccupancyGrid:
    frame = Frame(resolution_m=0.05, origin_m=(12.3, -7.1), yaw_rad=yaw_rad)
    probability = occupancy_grid(classes).probability
    return OccupancyGrid(probability, frame=frame, corner_cutting=corner_cutting)


def segments_of(grid: OccupancyGrid, rng: np.random.Generator, n: int) -> list[Any]:
    """Segments anywhere on the map and a little beyond; many between corners and centres."""
    ends = (1.2 * rng.random((n, 2, 2)) - 0.1) * grid.shape
    ends[::2] = np.rint(2 * ends[::2]) / 2
    ends[::3, 1] = ends[::3, 0] + rng.integers(-3, 4, (len(ends[::3]), 2))
    ends[::6, 1, 0] = ends[::6, 0, 0]
    return list(grid.frame.points_of_grid(ends))


@given(class_grids(max_side=16), seeds, yaws)
@settings(max_examples=300, derandomize=True)
def test_straight_motions_of_a_disc_are_those_that_the_judge_passes(
    classes: Any, seed: int, yaw_rad: float
) -> None:
    grid = framed(classes, yaw_rad)
    allow_unexplored = bool(seed % 2)
    check = MotionCheck(grid, allow_unexplored=allow_unexplored)
    for points in segments_of(grid, np.random.default_rng(seed), 40):
        faults = segment_faults(grid, points, allow_unexplored=allow_unexplored)
        assert check.motion_valid(*points[0], *points[1]) is not bool(faults)
        faults = segment_faults(grid, points[:1], allow_unexplored=allow_unexplored)
        assert check.state_valid(*points[0]) is not bool(faults)


@given(class_grids(max_side=16), seeds, yaws)
@settings(max_examples=150, derandomize=True)
def test_corridor_holds_what_stays_in_it_and_forbids_no_corner_between_free_cells(
    classes: Any, seed: int, yaw_rad: float
) -> None:
    rng = np.random.default_rng(seed)
    grid = framed(classes, yaw_rad)
    inside = rng.random(grid.shape) < 0.7
    closed = np.flatnonzero(rng.random(grid.shape) < 0.1)
    check = MotionCheck(grid, inside=inside, closed=closed)
    # The same with walls around the corridor: stricter at its corners only.
    walled, free = classes.copy(), classes.copy()
    free.flat[closed] = CellClass.OCCUPIED
    walled[(free == CellClass.OCCUPIED) | ~inside] = CellClass.OCCUPIED
    for points in segments_of(grid, rng, 40):
        valid = check.motion_valid(*points[0], *points[1])
        faults = segment_faults(framed(walled, yaw_rad), points)
        if not valid:
            assert faults
        elif faults:
            assert "meet at a corner" in faults[0]
            assert not segment_faults(framed(free, yaw_rad), points)


def test_diagonal_leaves_the_corridor_at_a_corner_only_where_the_map_is_free() -> None:
    inside = np.eye(3, dtype=np.bool_)
    free = framed(drawn("...", "...", "..."))
    ends = free.frame.points_of([[0, 0], [2, 2]]).ravel().tolist()
    assert MotionCheck(free, inside=inside).motion_valid(*ends)
    walled = drawn("##.", "#.#", ".##")
    assert not MotionCheck(framed(walled), inside=inside).motion_valid(*ends)
    assert MotionCheck(framed(walled, corner_cutting=True)).motion_valid(*ends)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e300, -1e300])
def test_what_is_no_place_on_the_map_is_not_valid(wrong: float) -> None:
    grid = framed(drawn("...", "...", "..."))
    check = MotionCheck(grid)
    x, y = grid.frame.points_of((1, 1)).tolist()
    assert check.state_valid(x, y)
    assert not check.state_valid(wrong, y)
    assert not check.motion_valid(x, y, x, wrong)
    assert not check.motion_valid(wrong, wrong, x, y)


def test_masks_and_closed_cells_of_another_map_are_refused() -> None:
    grid = framed(drawn("...", "..."))
    with pytest.raises(InvalidValueError, match=r"shape \(2, 3\), got \(3, 2\)"):
        MotionCheck(grid, inside=np.ones((3, 2), dtype=np.bool_))
    with pytest.raises(InvalidValueError, match="below 6, got 0 to 6"):
        MotionCheck(grid, closed=np.array([0, 6]))
