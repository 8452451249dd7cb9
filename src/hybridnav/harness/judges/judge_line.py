"""Any-angle paths judged by exact geometry, and exact shortest ones by a visibility graph. Public:
`line_cells`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.trig import dist, hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import kernels
from hybridnav.harness.judges.judge import (
    Cell,
    Verdict,
    free_classes,
    grid_positions,
    more,
    segment_faults,
)
from hybridnav.maps.checks import checked_points
from hybridnav.maps.geometry import cells_of_line

if TYPE_CHECKING:
    from hybridnav.maps import OccupancyGrid


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
    return Verdict(tuple(faults), math.fsum(hypots(steps[:, 0], steps[:, 1]).tolist()))


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


# Exact shortest any-angle paths, by a visibility graph that tests sight on demand.

ROUNDING = 1e-9
"""Share by which bounds are slackened, because they are sums of rounded lengths."""


@dataclass(frozen=True, eq=False)
class AnyAnglePath:
    """A shortest path that may run at any angle."""

    points: FloatArray | None
    """float64 (n, 2), `(x, y)` in metres, map frame; None where there is no path. A path from a
    cell to itself has one point."""
    length_m: float
    """Length in metres, infinite where there is no path."""


class VisibilityGraph:
    """Exact Euclidean shortest paths between the centres of cells.

    Free space is the union of the closed squares of the free cells, without the passages between
    two blocked cells that meet at a corner (see `segment_faults`). A shortest path there bends at
    convex corners of blocked cells only: lattice corners with exactly one blocked cell of four.
    Visibility is tested exactly, of those corners alone that a search comes to.

    Parameters
    ----------
    grid
        The map.
    allow_unexplored
        Whether unexplored cells may be entered.

    Notes
    -----
    T. Lozano-Perez, M. A. Wesley: An algorithm for planning collision-free paths among polyhedral
    obstacles, 1979. J. P. Bailey and others: Path-length analysis for grid-based path planning,
    2021, on the bound of the search: an octile path over corners of the lattice is at most 8.24 %
    longer.

    Examples
    --------
    >>> from hybridnav.harness.judges import VisibilityGraph
    >>> graph = VisibilityGraph(hn.OccupancyGrid(np.zeros((3, 4)), robot_radius_m=0))
    >>> graph.shortest((0, 0), (2, 0)).length_m
    2.0
    """

    def __init__(self, grid: OccupancyGrid, *, allow_unexplored: bool = False) -> None:
        self._grid = grid
        self._free_of = free_classes(allow_unexplored=allow_unexplored)
        self.corners, self._blocked = _convex_corners(self._free_of[grid.classes])
        """float64 (n, 2), (row, col) of the corners in grid units, whole numbers."""

    def shortest(self, start_cell: Cell, goal_cell: Cell) -> AnyAnglePath:
        """Find a shortest path between the centres of two cells.

        Parameters
        ----------
        start_cell, goal_cell
            (row, col), inside the map.

        Returns
        -------
        AnyAnglePath
            Without points if there is no path or a cell is not free.

        Raises
        ------
        InvalidValueError
            When a cell lies outside the map.
        """
        start, goal = (_centre(self._grid, cell) for cell in (start_cell, goal_cell))
        if not all(
            self._free_of[self._grid.classes[tuple(cell)]] for cell in (start_cell, goal_cell)
        ):
            return AnyAnglePath(None, math.inf)
        return self.between(start, goal)

    def between(self, start: tuple[float, float], goal: tuple[float, float]) -> AnyAnglePath:
        """Find a shortest path between two positions in free space.

        Parameters
        ----------
        start, goal
            (row, col) in grid units, where the centre of cell (0, 0) is (0.5, 0.5); neither may be
            a corner at which two free cells meet alone.
        """
        classes = self._grid.classes
        endpoints = np.array([start, goal])
        if start == goal:
            return self._path(endpoints[:1])
        if kernels.segment_code(classes, self._free_of, *start, *goal) == kernels.CLEAR:
            return self._path(endpoints)
        octile, most = kernels.octile_lengths(classes, self._free_of, *start, *goal)
        if math.isinf(most):
            return AnyAnglePath(None, math.inf)
        most *= 1 + ROUNDING
        row, col = self.corners.astype(np.int64).T
        to_goal = _lower_bounds(octile[row, col], self.corners - endpoints[1])
        away = self.corners - endpoints[0]
        near = hypots(away[:, 0], away[:, 1]) + to_goal <= most
        nodes = np.concatenate([self.corners[near], endpoints])
        blocked = np.concatenate([self._blocked[near], np.zeros((2, 2), np.int64)])
        straight = np.array([dist(start, goal), 0.0])
        chain = kernels.shortest_chain(
            classes, self._free_of, nodes, blocked, np.concatenate([to_goal[near], straight]), most
        )
        return self._path(nodes[chain])

    def _path(self, positions: FloatArray) -> AnyAnglePath:
        steps = np.diff(positions, axis=0)
        length = math.fsum(hypots(steps[:, 0], steps[:, 1]).tolist())
        frame = self._grid.frame
        return AnyAnglePath(frame.points_of_grid(positions), length * frame.resolution_m)


def _lower_bounds(octile: FloatArray, offset: FloatArray) -> FloatArray:
    """Return lower bounds on paths at any angle by octile lengths, which begin at corners of the
    goal's cell, and by straight lines."""
    by_octile = (octile - kernels.ACROSS) / kernels.OCTILE_RATIO - kernels.ACROSS
    bounds: FloatArray = np.maximum(by_octile, hypots(offset[:, 0], offset[:, 1]))
    return bounds * (1 - ROUNDING)


def _convex_corners(free: BoolArray) -> tuple[FloatArray, LongArray]:
    """Return the lattice corners with one blocked cell of four, and the signs of the direction to
    it, int64 (n, 2)."""
    blocked = ~free
    here = blocked[:-1, :-1], blocked[:-1, 1:], blocked[1:, :-1], blocked[1:, 1:]
    row, col = np.nonzero(np.sum(here, axis=0, dtype=np.int8) == 1)
    is_above, is_right = (
        np.where(a[row, col] | b[row, col], 1, -1) for a, b in (here[2:], here[1::2])
    )
    corners = np.stack([row, col], axis=1).astype(np.float64) + 1
    return corners, np.stack([is_above, is_right], axis=1).astype(np.int64)


def _centre(grid: OccupancyGrid, cell: Cell) -> tuple[float, float]:
    row, col = int(cell[0]), int(cell[1])
    if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
        raise InvalidValueError(
            f"cell ({row}, {col}) lies outside the map of {grid.shape[0]} x {grid.shape[1]} cells"
        )
    return row + 0.5, col + 0.5
