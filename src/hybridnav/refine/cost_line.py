"""Any-angle finish for costs: a cell path cut short wherever that is no dearer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.costs.integral import positions_on
from hybridnav.refine import _cost_line_kernels as kernels

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, LongArray
    from hybridnav.costs import CostLayer
    from hybridnav.grid import OccupancyGrid


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
        metres = np.array([start, goal], dtype=np.float64)
        endpoints = np.clip(positions_on(self._frame, metres), cells[[0, -1]], cells[[0, -1]] + 1)
        inner = cells if self._corner_cutting else cells[1:-1]
        line = np.concatenate([endpoints[:1], inner + 0.5, endpoints[1:]])
        repeated = np.concatenate([[False], (line[1:] == line[:-1]).all(axis=1)])
        points = self._frame.points_of_grid(
            kernels.shorten(self._free, self._factors, line[~repeated])
        )
        points[-1], points[0] = metres[1], metres[0]
        return points
