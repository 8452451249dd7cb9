"""Any-angle paths judged: ends, exact geometry, length, and the cells that they pass."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.harness.judges.judge import (
    Verdict,
    free_classes,
    grid_positions,
    more,
    segment_faults,
)
from hybridnav.maps.checks import checked_points
from hybridnav.maps.geometry import cells_of_line

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._base.typing import FloatArray, LongArray
    from hybridnav.maps import OccupancyGrid

Cell = tuple[int, int]

_NEAR_CELLS = 2.0**-20
"""Greatest distance of an end from the centre of its cell."""


def judge_line(
    grid: OccupancyGrid,
    points: ArrayLike,
    *,
    start: Cell,
    goal: Cell,
    allow_unexplored: bool = False,
) -> Verdict:
    """Judge an any-angle path between the centres of two cells.

    Parameters
    ----------
    grid
        The map.
    points
        `(x, y)` in metres, map frame, shape (n, 2), n >= 1, finite.
    start, goal
        The cells whose centres the path should join.
    allow_unexplored
        Whether unexplored cells count as free.

    Returns
    -------
    Verdict
        Faults: the first or last point is not the centre of its cell; those of `segment_faults`.

    Raises
    ------
    InvalidValueError
        When the points are no finite array of shape (n, 2) or there is none.

    Examples
    --------
    >>> from hybridnav.harness.judges import judge_line
    >>> grid = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
    >>> judge_line(grid, [(0.5, 0.5), (2.5, 0.5)], start=(0, 0), goal=(0, 2)).ok
    True
    """
    xy = checked_points(points)
    steps = np.diff(xy, axis=0)
    crossed = segment_faults(grid, xy, allow_unexplored=allow_unexplored)
    faults = _wrong_endpoints(grid, xy, start, goal)
    faults += [f"{crossed[0]}{more(len(crossed))}"] if crossed else []
    return Verdict(tuple(faults), math.fsum(np.hypot(steps[:, 0], steps[:, 1]).tolist()))


def line_cells(
    grid: OccupancyGrid, points: ArrayLike, *, allow_unexplored: bool = False
) -> LongArray:
    """Return the cells that a legal any-angle path passes.

    Along the side between two cells, one free cell of them is listed.

    Parameters
    ----------
    grid
        The map.
    points
        A path without `segment_faults`.
    allow_unexplored
        Whether unexplored cells count as free.

    Returns
    -------
    LongArray
        int64 (n, 2), (row, col), each a neighbour of the one before, diagonally where the line
        passes a corner.

    Raises
    ------
    InvalidValueError
        When the points are no finite array of shape (n, 2) or there is none.

    Examples
    --------
    >>> from hybridnav.harness.judges import line_cells
    >>> grid = hn.OccupancyGrid(np.zeros((2, 3)), robot_radius_m=0)
    >>> line_cells(grid, [(0.5, 0.5), (2.5, 1.5)])
    array([[0, 0],
           [0, 1],
           [1, 1],
           [1, 2]])
    """
    positions = grid_positions(grid.frame, checked_points(points))
    free = free_classes(allow_unexplored=allow_unexplored)[grid.classes]
    return cells_of_line(free, positions)


def _wrong_endpoints(grid: OccupancyGrid, xy: FloatArray, start: Cell, goal: Cell) -> list[str]:
    endpoints = grid_positions(grid.frame, xy[[0, -1]])
    off = np.abs(endpoints - (np.array([start, goal]) + 0.5)).max(axis=1) > _NEAR_CELLS
    return [
        f"the {which} point ({point[0]:.3f}, {point[1]:.3f}) m is not the centre of cell "
        f"({int(cell[0])}, {int(cell[1])})"
        for which, point, cell, wrong in zip(
            ("first", "last"), xy[[0, -1]], (start, goal), off, strict=True
        )
        if wrong
    ]
