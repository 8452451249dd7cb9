"""The cells that paths may use, less those that costs or a query close."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav.errors import InvalidValueError
from hybridnav.refine.kernels import line_of_sight as kernels
from hybridnav.refine.kernels.taut import marks_of

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.maps import OccupancyGrid


def open_cells(grid: OccupancyGrid, *closed: LongArray | None, allow_unexplored: bool) -> BoolArray:
    """Return which cells may be entered, bool (rows, cols), in an array of its own.

    Parameters
    ----------
    grid
        The map.
    closed
        int64 (n,), flat cells that may not be entered; None for none.
    allow_unexplored
        Whether unexplored cells may be entered.
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

    The string start, centres of the inner cells, goal is pulled taut: a bend between two points in
    sight of it gives way to the convex hull of the corners of blocked cells inside the triangle of
    the three (the triangle step of Hershberger and Snoeyink). The taut string bends only at corners
    of blocked cells, and is the shortest path that passes the obstacles on the same sides. Then
    parts of the string are led past the other sides of obstacles on the straight line between their
    ends, always on one hand (V. Lumelsky, A. Stepanov: Path-planning strategies for a point mobile
    automaton, 1987), pulled taut, and kept if they are shorter.

    Turns are decided exactly and new segments are tested exactly, so a path never leaves the union
    of the closed squares of the enterable cells. It does not pass between two blocked cells that
    meet at a corner either, unless the grid allows corner cutting and the cell path does so: then
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
        self._frame = grid.frame
        self._corner_cutting = grid.corner_cutting
        self._marks = marks_of(open_cells(grid, closed, allow_unexplored=allow_unexplored))
        self._per_metre = grid.frame.per_metre
        self._origin_m = np.array(grid.frame.origin_m)

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
        points = self._frame.points_of_grid(positions)
        points[0], points[-1] = metres
        return points
