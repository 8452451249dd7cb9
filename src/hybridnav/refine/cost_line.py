"""Any-angle finish for costs: a cell path cut short wherever that is no dearer."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.poses import wrapped
from hybridnav._base.trig import directions
from hybridnav.refine.grid import open_cells
from hybridnav.refine.kernels import cost_line as kernels
from hybridnav.refine.kernels.arcs import round_bends

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.costs import CostLayer

_TOLERANCE = 0.01
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
    """Shortener of cell paths of one grid that never raises their cost; it holds a byte a cell.

    The points of the new path are start, goal, and centres of cells of the old path. A dynamic
    program finds the cheapest path whose bends are six cells of the old one apart, or multiples of
    that up to 24. Then bends move along the old path where that is cheaper, and the dynamic program
    leaves out up to three at a time, in turn. Costs are exact integrals of the factors along the
    segments (`costs.cost_along`), and new segments are tested exactly, so a path never leaves the
    union of the closed squares of the enterable cells.

    Parameters
    ----------
    grid
        The map; its blocked and occupied cells are never entered.
    layer
        Costs of its cells; closed ones are never entered.
    allow_unexplored
        Whether unexplored cells may be entered.

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
        self,
        grid: OccupancyGrid,
        layer: CostLayer,
        *,
        allow_unexplored: bool = False,
    ) -> None:
        self._frame = grid.frame
        self._corner_cutting = grid.corner_cutting
        self._factors = layer.factors
        free = open_cells(grid, layer.inflated(grid).closed_flat, allow_unexplored=allow_unexplored)
        self._free = free.view(np.uint8)

    def closing(self, closed: LongArray) -> CostLine:
        """Return a shortener that does not enter some other cells either.

        Parameters
        ----------
        closed
            int64 (n,), flat cells.
        """
        free = self._free.copy()
        free.flat[closed] = 0
        other = copy(self)
        vars(other)["_free"] = free
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
            float64 (m, 2), `(x, y)` in metres: `start`, centres of cells of the path, `goal`; one
            point if the two are the same. Never dearer than the line from `start` over the centres
            of the inner cells to `goal`; where corners may be cut, over those of all cells.
        """
        return self._in_metres(self._short(cells, start, goal)[0], start, goal)

    def arcs(
        self, cells: LongArray, start: FloatArray, goal: FloatArray, *, radius_m: float
    ) -> ArcLine:
        """Shorten a cell path, and round its bends by arcs of circles.

        Bends that lie too close to each other are merged. An arc has the radius or up to four times
        that; no cell may be blocked that the box round any short piece of it meets.
        Where no such arc fits, the robot turns on the spot.

        Parameters
        ----------
        cells, start, goal
            As in `shorten`.
        radius_m
            Least radius of an arc in metres, > 0.

        Returns
        -------
        ArcLine
            Never dearer than the line over the centres of the cells (see `shorten`), and at most
            1 % dearer than what `shorten` returns.
        """
        line, least, whole = self._short(cells, start, goal)
        if len(line) == 1:
            return ArcLine(np.array([start], dtype=np.float64), np.zeros(1), 0.0, 0.0)
        spare = max(min(whole - least, _TOLERANCE * least), 0.0)
        per_cell = self._frame.resolution_m
        points, ahead, cost, length = round_bends(
            self._free, self._factors, line, radius_m / per_cell, spare
        )
        headings = directions(ahead[:, 0], ahead[:, 1])
        if self._frame.yaw_rad != 0:
            headings = wrapped(headings + self._frame.yaw_rad)
        found = self._in_metres(points, start, goal)
        return ArcLine(found, headings, cost * per_cell, length * per_cell)

    def _short(
        self, cells: LongArray, start: FloatArray, goal: FloatArray
    ) -> tuple[FloatArray, float, float]:
        """Return the positions of the short line, its cost in cells, and that of the cells."""
        position_of = self._frame.position_of
        ends = np.array([position_of(*start.tolist()), position_of(*goal.tolist())])
        # Kernels are compiled for each memory layout, and again for read-only arrays.
        cells = np.ascontiguousarray(cells).view()
        cells.flags.writeable = False
        path = kernels.line_of_cells(cells, ends, self._corner_cutting)
        found: tuple[FloatArray, float, float] = kernels.shorten(self._free, self._factors, path)
        return found

    def _in_metres(self, line: FloatArray, start: FloatArray, goal: FloatArray) -> FloatArray:
        """Return the points of positions, the first and last being exact."""
        points = self._frame.points_of_grid(line)
        points[-1], points[0] = goal, start
        return points
