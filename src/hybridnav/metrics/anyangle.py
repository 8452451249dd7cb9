"""Exact shortest any-angle paths on small maps, by a visibility graph."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from hybridnav.errors import InvalidValueError
from hybridnav.metrics import _segment_kernels as kernels
from hybridnav.metrics.judge import Cell, free_classes

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.grid import OccupancyGrid

MAX_CORNERS = 2000
"""Default limit of the corners of a visibility graph."""

Point = tuple[int, int]


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
    Visibility is tested exactly.

    Parameters
    ----------
    grid
        The map.
    allow_unexplored
        Whether unexplored cells may be entered.
    max_corners
        Most corners of the map; time and memory grow with their square.

    Raises
    ------
    InvalidValueError
        When the map has more corners.

    Notes
    -----
    T. Lozano-Perez, M. A. Wesley: An algorithm for planning collision-free paths among polyhedral
    obstacles, 1979.

    Examples
    --------
    >>> from hybridnav.metrics import VisibilityGraph
    >>> graph = VisibilityGraph(hn.OccupancyGrid(np.zeros((3, 4)), robot_radius_m=0))
    >>> graph.shortest((0, 0), (2, 0)).length_m
    2.0
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        allow_unexplored: bool = False,
        max_corners: int = MAX_CORNERS,
    ) -> None:
        self._grid = grid
        self._free_of = free_classes(allow_unexplored=allow_unexplored)
        self.corners, self._slopes = _convex_corners(self._free_of[grid.classes])
        """float64 (n, 2), (row, col) of the corners in grid units, whole numbers."""
        n = len(self.corners)
        if n > max_corners:
            raise InvalidValueError(
                f"a visibility graph of map {grid.name!r} would have {n} corners, "
                f"more than the limit of {max_corners}"
            )
        pairs = kernels.visible_pairs(grid.classes, self._free_of, self.corners, self._slopes)
        offset = self.corners[pairs[:, 0]] - self.corners[pairs[:, 1]]
        lengths = np.hypot(offset[:, 0], offset[:, 1])
        tails, heads = np.concatenate([pairs, pairs[:, ::-1]]).T
        # No two corners are at one place, so no length is 0 and every entry is kept.
        graph = sparse.coo_array((np.tile(lengths, 2), (tails, heads)), shape=(n, n)).tocsr()
        self._offsets = graph.indptr.astype(np.int64)
        self._heads = graph.indices.astype(np.int32)
        self._lengths = graph.data

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
        from_start, to_goal = (
            kernels.visible_from(classes, self._free_of, *end, self.corners, self._slopes)
            for end in (start, goal)
        )
        offset = self.corners - endpoints[1]
        chain = kernels.cheapest_corners(
            self._offsets,
            self._heads,
            self._lengths,
            from_start,
            to_goal,
            np.hypot(offset[:, 0], offset[:, 1]),
        )
        if not len(chain):
            return AnyAnglePath(None, math.inf)
        return self._path(np.concatenate([endpoints[:1], self.corners[chain], endpoints[1:]]))

    def _path(self, positions: FloatArray) -> AnyAnglePath:
        steps = np.diff(positions, axis=0)
        length = math.fsum(np.hypot(steps[:, 0], steps[:, 1]).tolist())
        frame = self._grid.frame
        return AnyAnglePath(frame.points_of_grid(positions), length * frame.resolution_m)


def _convex_corners(free: BoolArray) -> tuple[FloatArray, LongArray]:
    """Return the lattice corners with one blocked cell of four, and the sign of its diagonal."""
    blocked = ~free
    here = blocked[:-1, :-1], blocked[:-1, 1:], blocked[1:, :-1], blocked[1:, 1:]
    row, col = np.nonzero(np.sum(here, axis=0, dtype=np.int8) == 1)
    slopes = np.where(here[0][row, col] | here[3][row, col], 1, -1).astype(np.int64)
    return np.stack([row, col], axis=1).astype(np.float64) + 1, slopes


def _centre(grid: OccupancyGrid, cell: Cell) -> tuple[float, float]:
    row, col = int(cell[0]), int(cell[1])
    if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
        raise InvalidValueError(
            f"cell ({row}, {col}) lies outside the map of {grid.shape[0]} x {grid.shape[1]} cells"
        )
    return row + 0.5, col + 0.5
