"""Any-angle finish for costs: a cell path cut short wherever that is no dearer."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.costs.integral import line_cost, positions_on
from hybridnav.refine import _cost_line_kernels as kernels
from hybridnav.refine._arc_kernels import round_bends

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, LongArray
    from hybridnav.costs import CostLayer
    from hybridnav.grid import OccupancyGrid

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


@copies_alike
class CostLine:
    """Shortener of cell paths of one grid that never raises their cost; it holds a byte a cell.

    The points of the new path are start, goal, and centres of cells of the old path. A dynamic
    program finds the cheapest path that leaves out some of these, up to 23 a segment; it is
    repeated on the points that are left. Costs are exact integrals of the factors along the
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
    closed
        int64 (n,), flat cells that may not be entered either; None for none.

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
        closed: LongArray | None = None,
    ) -> None:
        self._frame = grid.frame
        self._corner_cutting = grid.corner_cutting
        self._factors = layer.factors
        free = grid.enterable(allow_unexplored=allow_unexplored)
        free.flat[layer.closed_flat] = False
        if closed is not None:
            free.flat[closed] = False
        self._free = free.view(np.uint8)

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
        return self._in_metres(self._short(self._line(cells, start, goal)), start, goal)

    def arcs(
        self, cells: LongArray, start: FloatArray, goal: FloatArray, *, radius_m: float
    ) -> ArcLine:
        """Shorten a cell path, and round its bends by arcs of circles.

        Bends that lie too close to each other are merged. An arc has the radius or up to four times
        that; no cell that it meets, or passes by less than a quarter of a cell, may be blocked.
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
        line = self._line(cells, start, goal)
        short = self._short(line)
        if len(short) == 1:
            return ArcLine(np.array([start], dtype=np.float64), np.zeros(1), 0.0)
        least = line_cost(self._factors, short)
        spare = min(line_cost(self._factors, line) - least, _TOLERANCE * least)
        radius_cells = radius_m / self._frame.resolution_m
        points, ahead, cost = round_bends(
            self._free, self._factors, short, radius_cells, max(spare, 0.0)
        )
        origin = self._frame.points_of_grid(np.zeros((1, 2)))
        east, north = (self._frame.points_of_grid(ahead) - origin).T
        found = self._in_metres(points, start, goal)
        return ArcLine(found, np.arctan2(north, east), float(cost) * self._frame.resolution_m)

    def _line(self, cells: LongArray, start: FloatArray, goal: FloatArray) -> FloatArray:
        """Return the positions of a cell path between two points, no two in a row equal."""
        metres = np.array([start, goal], dtype=np.float64)
        endpoints = np.clip(positions_on(self._frame, metres), cells[[0, -1]], cells[[0, -1]] + 1)
        inner = cells if self._corner_cutting else cells[1:-1]
        line = np.concatenate([endpoints[:1], inner + 0.5, endpoints[1:]])
        repeated = np.concatenate([[False], (line[1:] == line[:-1]).all(axis=1)])
        kept: FloatArray = line[~repeated]
        return kept

    def _short(self, line: FloatArray) -> FloatArray:
        short: FloatArray = kernels.shorten(self._free, self._factors, line)
        return short

    def _in_metres(self, line: FloatArray, start: FloatArray, goal: FloatArray) -> FloatArray:
        """Return the points of positions, the first and last being exact."""
        points = self._frame.points_of_grid(line)
        points[-1], points[0] = goal, start
        return points
