"""Paths on the cells that a query and its corridor leave open: the optimal path of cells, the
string pulled tight along it, and which positions see each other. Public: `LineOfSight`, `Sight`,
`Refiner` and `GridRefiner`.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Protocol

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import path_length_in_cells
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.refine.kernels import line_of_sight as kernels
from hybridnav.refine.kernels.line_of_sight import clear_segments
from hybridnav.refine.kernels.taut import marks_of
from hybridnav.route import Corridor
from hybridnav.search.found import ClosedCells
from hybridnav.search.grid_search import Cell, GridSearch


def open_cells(grid: OccupancyGrid, *closed: LongArray | None, allow_unexplored: bool) -> BoolArray:
    """Return which cells may be entered, bool (rows, cols), in an array of its own.

    `closed`: int64 (n,), flat cells that may not be entered; None for none; `allow_unexplored`:
    whether unexplored cells may be entered.
    """
    free = grid.enterable(allow_unexplored=allow_unexplored)
    for cells in closed:
        if cells is not None:
            free.flat[cells] = False
    return free


# Any-angle finish: a cell path pulled taut in its free space.
#
# J. Hershberger, J. Snoeyink: Computing minimum length paths of a given homotopy class, 1994.


@copies_alike
class LineOfSight:
    """Shortener of cell paths of one grid to any-angle paths; it holds one byte a cell.

    The string start, centres of the inner cells, goal is pulled taut. A bend between two points in
    sight of it gives way to the convex hull of the corners of blocked cells inside the triangle of
    the three. That is the triangle step of Hershberger and Snoeyink. The taut string bends only at
    corners of blocked cells, and is the shortest path that passes the obstacles on the same sides.
    Then parts of the string are led past the other sides of obstacles on the straight line between
    their ends, always on one hand. So do V. Lumelsky and A. Stepanov (Path-planning strategies for
    a point mobile automaton, 1987). They are pulled taut, and kept if they are shorter.

    Turns are decided exactly and new segments are tested exactly, so a path never leaves the union
    of the closed squares of the enterable cells. It does not pass between two blocked cells that
    meet at a corner either, unless the grid allows corner cutting and the cell path does so. Then
    the path goes through that corner, which stays one of its points.

    Parameters
    ----------
    grid
        The map; its blocked and occupied cells are never entered.
    allow_unexplored
        Whether unexplored cells may be entered.
    closed
        int64 (n,), flat cells that may not be entered either; None for none.

    Examples
    --------
    >>> from hybridnav.refine import LineOfSight
    >>> sight = LineOfSight(hn.OccupancyGrid(np.zeros((2, 4)), robot_radius_m=0))
    >>> cells = np.array([[0, 0], [0, 1], [0, 2], [1, 3]])
    >>> sight.shorten(cells, np.array([0.5, 0.5]), np.array([3.5, 1.5]))
    array([[0.5, 0.5],
           [3.5, 1.5]])
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        allow_unexplored: bool = False,
        closed: LongArray | None = None,
    ) -> None:
        self.frame = grid.frame
        self._grid, self._closed, self._allow_unexplored = grid, closed, allow_unexplored
        self._corner_cutting = grid.corner_cutting
        self._marks = marks_of(self.free)
        self._per_metre = grid.frame.per_metre
        self._origin_m = np.array(grid.frame.origin_m)

    @property
    def free(self) -> BoolArray:
        """bool (rows, cols), the cells that it may enter."""
        return open_cells(self._grid, self._closed, allow_unexplored=self._allow_unexplored)

    def closing(self, closed: LongArray) -> LineOfSight:
        """Return a shortener that does not enter some other cells either.

        Parameters
        ----------
        closed
            int64 (n,), flat cells.
        """
        both = closed if self._closed is None else np.concatenate([self._closed, closed])
        return LineOfSight(self._grid, allow_unexplored=self._allow_unexplored, closed=both)

    def shorten(self, cells: LongArray, start: FloatArray, goal: FloatArray) -> FloatArray:
        """Shorten a cell path to an any-angle path between two points.

        Parameters
        ----------
        cells
            int64 (n, 2), n >= 1, a legal path of the octile grid.
        start, goal
            `(x, y)` in metres, map frame, in the first and the last cell.

        Returns
        -------
        FloatArray
            float64 (m, 2), `(x, y)` in metres: `start`, corners of blocked cells, `goal`; one point
            if the two are the same. Never longer than the line from `start` over the centres of the
            inner cells to `goal`.

        Raises
        ------
        InvalidValueError
            When a point does not lie in its cell.
        """
        metres = np.array([start, goal], dtype=np.float64)
        # Kernels are compiled for each memory layout, and again for read-only arrays.
        cells = np.ascontiguousarray(cells).view()
        cells.flags.writeable = False
        positions = kernels.shorten(
            self._marks, cells, metres, self._origin_m, self._per_metre, self._corner_cutting
        )
        if not len(positions):
            raise InvalidValueError(
                f"a path from cell {tuple(cells[0].tolist())} to cell {tuple(cells[-1].tolist())} "
                f"cannot run from {tuple(metres[0].tolist())} to {tuple(metres[1].tolist())} "
                "in metres: a point lies outside its cell"
            )
        points = self.frame.points_of_grid(positions)
        points[0], points[-1] = metres
        return points


class Sight:
    """Exact tests of segments against the free cells of a map; it holds one byte a cell.

    Parameters
    ----------
    free
        bool (rows, cols); cells outside are blocked.

    Examples
    --------
    >>> from hybridnav.refine import Sight
    >>> sight = Sight(np.array([[True, False, True], [True, True, True]]))
    >>> sight.clear(np.array([[0.5, 0.5], [1.5, 0.5]]), np.array([[0.5, 2.5], [1.5, 2.5]]))
    array([False,  True])
    """

    def __init__(self, free: BoolArray) -> None:
        cells = np.ascontiguousarray(free).view()
        cells.flags.writeable = False
        self._marks = marks_of(cells)

    def clear(self, tails: FloatArray, heads: FloatArray) -> BoolArray:
        """Return which segments stay in free space, as `LineOfSight` defines it.

        Parameters
        ----------
        tails, heads
            float64 (n, 2), endpoints (row, col) in grid units, inside the map, in free space and
            rounded to 2^-24 of a cell.

        Returns
        -------
        BoolArray
            bool (n,); true for two equal endpoints.
        """
        return clear_segments(self._marks, np.ascontiguousarray(tails), np.ascontiguousarray(heads))


class Refiner(Protocol):
    """The protocol of refiners, which find a path in a corridor."""

    def refine(
        self, start: Cell, goal: Cell, corridor: Corridor | None
    ) -> tuple[LongArray | None, int]:
        """Find a path between two cells that stands on cells of the corridor only.

        `None` as the corridor is the whole map. Return the cells of the path, int64 (n, 2), None if
        there is no path, and the number of expansions.
        """
        ...


class GridRefiner:
    """Grid A* on the cells of a corridor: optimal there, in the octile metric or by costs.

    Parameters
    ----------
    grid
        The map; its blocked and occupied cells are never entered.
    allow_unexplored
        Whether unexplored cells may be entered.
    costs
        Costs of the cells; closed ones are never entered. None makes costs lengths.

    Examples
    --------
    >>> from hybridnav.refine import GridRefiner
    >>> refiner = GridRefiner(hn.OccupancyGrid(np.zeros((2, 4)), robot_radius_m=0))
    >>> cells, expanded = refiner.refine((0, 0), (1, 3), None)
    >>> cells
    array([[0, 0],
           [1, 1],
           [1, 2],
           [1, 3]])
    """

    def __init__(
        self, grid: OccupancyGrid, *, allow_unexplored: bool = False, costs: CostLayer | None = None
    ) -> None:
        self.grid = grid
        self.costs = costs
        self._allow_unexplored = allow_unexplored

    def on(self, grid: OccupancyGrid) -> GridRefiner:
        """Return the refiner of another map of the same shape, with the same costs."""
        return GridRefiner(grid, allow_unexplored=self._allow_unexplored, costs=self.costs)

    @cached_property
    def search(self) -> GridSearch:
        """The search of cells, built on first use."""
        enterable = self.enterable(None)
        if self.costs is None:
            return GridSearch(enterable, corner_cutting=self.grid.corner_cutting)
        corner_cutting, units = self.grid.corner_cutting, self.costs.units
        return GridSearch(enterable, corner_cutting=corner_cutting, units=units)

    def enterable(self, closed: ClosedCells | None) -> BoolArray:
        """Return the cells that may be entered, bool (rows, cols), without closed ones."""
        always = None if self.costs is None else self.costs.closed_flat
        flat = None if closed is None else closed.flat
        return open_cells(self.grid, always, flat, allow_unexplored=self._allow_unexplored)

    def cost_in_cells(self, cells: LongArray | None) -> float:
        """Return the cost of a path of cells in cells, infinite for none: without costs its
        length."""
        if cells is None:
            return math.inf
        return (
            path_length_in_cells(cells) if self.costs is None else self.costs.cost_of_cells(cells)
        )

    def refine(
        self, start: Cell, goal: Cell, corridor: Corridor | None
    ) -> tuple[LongArray | None, int]:
        """Find the shortest path between two cells; see `Refiner`."""
        found = self.search.search(
            start,
            goal,
            field_of=None if corridor is None else corridor.field_of,
            in_corridor=None if corridor is None else corridor.places,
        )
        return found.cells, found.expanded
