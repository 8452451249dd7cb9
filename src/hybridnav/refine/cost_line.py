"""Any-angle finish for costs: a line that settles where it costs least, and arcs at its bends."""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.poses import wrapped
from hybridnav._base.typing import AnyArray, FloatArray, LongArray
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.geometry import points_at
from hybridnav.refine.grid import open_cells
from hybridnav.refine.kernels import cost_line as kernels
from hybridnav.refine.kernels.arcs import round_bends
from hybridnav.refine.one_way import on_grain

_SPARE = 0.005
"""Most that arcs may add to the cost of a line, as a part of it."""


class ArcLine(NamedTuple):
    """Straight lines and arcs of circles, each tangent to the next but at turns on the spot."""

    points: FloatArray
    """float64 (m, 2), `(x, y)` in metres: where they meet; two equal ones at a turn on the spot."""
    headings_rad: FloatArray
    """float64 (m,), the direction of travel at each."""
    cost_m: float
    """The integral of the factors along it."""
    length_m: float
    """The length of lines and arcs."""


@copies_alike
class CostLine:
    """Finisher of paths by costs, on one grid: it moves a path to where it costs least.

    The path is cut short, and where it passes costs it becomes a chain of points some cells apart.
    All points move aside at a time, by dynamic programming on the exact cost, far at first and less
    and less then. Then its bends at walls move one at a time. So the line passes obstacles on the
    sides that the path takes, and lines that begin near each other end in the same place.
    New segments are tested exactly: a line never leaves the union of the closed squares of the
    enterable cells.

    Parameters
    ----------
    grid
        The map; its blocked and occupied cells are never entered.
    layer
        Costs of its cells; closed ones are never entered.
    allow_unexplored
        Whether unexplored cells may be entered.

    Notes
    -----
    S. Quinlan, O. Khatib: Elastic bands, 1993, is the idea; here the whole chain moves at a
    time, by R. Bellman: Dynamic programming, 1957.

    Examples
    --------
    >>> from hybridnav.refine import CostLine
    >>> grid = hn.OccupancyGrid(np.zeros((2, 4)), robot_radius_m=0)
    >>> line = CostLine(grid, hn.CostLayer(np.ones((2, 4))))
    >>> cells = np.array([[0, 0], [0, 1], [0, 2], [1, 3]])
    >>> line.shorten(cells, np.array([0.5, 0.5]), np.array([3.5, 1.5]))
    array([[0.5, 0.5],
           [3.5, 1.5]])
    """

    def __init__(
        self, grid: OccupancyGrid, layer: CostLayer, *, allow_unexplored: bool = False
    ) -> None:
        self.frame = grid.frame
        self._corner_cutting = grid.corner_cutting
        self.factors: AnyArray = layer.factors
        """float32 (rows, cols), >= 1."""
        free = open_cells(grid, layer.inflated(grid).closed_flat, allow_unexplored=allow_unexplored)
        self.free: AnyArray = free.view(np.uint8)
        """uint8 (rows, cols), 1 where a cell may be entered."""

    def closing(self, closed: LongArray) -> CostLine:
        """Return a finisher that does not enter some other cells either.

        Parameters
        ----------
        closed
            int64 (n,), flat cells.
        """
        other = copy(self)
        other.free = self.free.copy()
        other.free.flat[closed] = 0
        return other

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
            float64 (m, 2), `(x, y)` in metres, from `start` to `goal`; one point if the two are the
            same. Never dearer than the line from `start` over the centres of the inner cells to
            `goal`; where corners may be cut, over those of all cells.
        """
        position_of = self.frame.position_of
        ends = np.array([position_of(*start.tolist()), position_of(*goal.tolist())])
        path = kernels.line_of_cells(_read_only(cells), ends, self._corner_cutting)
        return self.in_metres(self.settle(path), start, goal)

    def settle(self, path: FloatArray) -> FloatArray:
        """Move a path to where it costs least.

        Parameters
        ----------
        path
            float64 (n, 2), n >= 1, positions (row, col) in grid units, multiples of 2^-24, no two
            in a row equal, joined by legal segments.

        Returns
        -------
        FloatArray
            float64 (m, 2), positions with the same ends; never dearer.
        """
        return kernels.settle(self.free, self.factors, path)

    def rest_of(self, line: FloatArray, start: FloatArray, most_m: float) -> FloatArray | None:
        """Return the rest of a line from a point beside it.

        Parameters
        ----------
        line
            float64 (n, 2), n >= 2, `(x, y)` in metres, map frame, as `shorten` returns it.
        start
            `(x, y)` in metres, in a cell that may be entered.
        most_m
            Largest cost in metres.

        Returns
        -------
        FloatArray
            float64 (m, 2), `(x, y)` in metres: `start`, and the points of the line from the first
            one in its sight. None where a segment or a bend may not be driven, or it costs more.
        """
        here, most = self.on_grain(np.array([start]))[0], most_m / self.frame.resolution_m
        rest = kernels.rest_of(self.free, self.factors, self.on_grain(line), here, most)
        if not len(rest) or not (self._corner_cutting or self._turns_freely(rest)):
            return None
        return self.in_metres(rest, start, line[-1])

    def _turns_freely(self, line: FloatArray) -> bool:
        """Return whether no bend lies between two blocked cells that meet there at a corner."""
        inner = line[1:-1]
        rows, cols = inner[(inner == np.rint(inner)).all(axis=1)].astype(np.int64).T
        shape = self.free.shape
        within = (rows > 0) & (cols > 0) & (rows < shape[0]) & (cols < shape[1])
        rows, cols = rows[within], cols[within]
        down = self.free[rows - 1, cols - 1] | self.free[rows, cols]
        up = self.free[rows - 1, cols] | self.free[rows, cols - 1]
        return bool((down & up).all())

    def on_grain(self, points: FloatArray) -> FloatArray:
        """Return the positions of points, on the grain of exact tests; points on the rim of the map
        stay there."""
        return on_grain(points, self.frame, self.free.shape)

    def in_metres(self, line: FloatArray, start: FloatArray, goal: FloatArray) -> FloatArray:
        """Return the points of positions, the first and last being exact."""
        points = points_at(line, self.frame.for_kernels)
        points[-1], points[0] = goal, start
        return points

    def arcs(self, points: FloatArray, *, radius_m: float) -> ArcLine:
        """Round the bends of a line by arcs of circles.

        Bends that lie too close to each other are merged. An arc has the radius or up to four times
        that; the box round any short piece of it meets no blocked cell. Where no such arc fits, the
        robot turns on the spot.

        Parameters
        ----------
        points
            float64 (n, 2), `(x, y)` in metres, map frame, as `shorten` returns them.
        radius_m
            Least radius of an arc in metres, > 0.

        Returns
        -------
        ArcLine
            At most 0.5 % dearer than the line.
        """
        if len(points) == 1:
            return ArcLine(points, np.zeros(1), 0.0, 0.0)
        line = self.on_grain(points)
        per_cell = self.frame.resolution_m
        spare = _SPARE * kernels.cost_of(self.factors, line)
        found, headings, cost, length = round_bends(
            self.free, self.factors, line, radius_m / per_cell, spare
        )
        if self.frame.yaw_rad != 0:
            headings = wrapped(headings + self.frame.yaw_rad)
        rounded = self.in_metres(found, points[0], points[-1])
        return ArcLine(rounded, headings, cost * per_cell, length * per_cell)


def _read_only(cells: LongArray) -> LongArray:
    """Return cells for kernels, which are compiled for each memory layout, and again for arrays
    that may be written."""
    view = np.ascontiguousarray(cells).view()
    view.flags.writeable = False
    return view
