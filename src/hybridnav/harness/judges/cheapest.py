"""Costs of cheapest paths of cells, by a search that no planner shares."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges.kernels.cheapest import cheapest_cost
from hybridnav.maps import CellClass
from hybridnav.maps.checks import checked_cell, checked_type

if TYPE_CHECKING:
    from hybridnav.harness.judges.judge import Cell
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.costs import CostLayer


class CheapestCost:
    """Dijkstra's algorithm on the legal moves of a grid, with a factor in each cell.

    A move costs its length times the mean factor of its two cells. With the planners this shares
    the classes of the cells and their factors; the search is its own, in floating point. It takes
    24 bytes a cell.

    Parameters
    ----------
    grid
        The map. Free cells are entered; whether corners may be cut is that of the map.
    layer
        Costs of its cells; None for lengths. Cells that it closes are not entered.

    Raises
    ------
    InvalidValueError
        When the grid or the layer is none, or the layer is one of another map.

    Examples
    --------
    >>> from hybridnav.harness.judges import CheapestCost
    >>> grid = hn.OccupancyGrid(np.zeros((2, 3)), robot_radius_m=0)
    >>> layer = hn.CostLayer(np.array([[1.0, 9.0, 1.0], [1.0, 1.0, 1.0]]))
    >>> round(CheapestCost(grid, layer).cost_m((0, 0), (0, 2)), 3)
    2.828
    """

    def __init__(self, grid: OccupancyGrid, layer: CostLayer | None = None) -> None:
        # What imports the other judges needs neither settings nor costs.
        from hybridnav.maps import OccupancyGrid  # noqa: PLC0415
        from hybridnav.maps.costs import CostLayer  # noqa: PLC0415

        checked_type("grid", grid, OccupancyGrid)
        free = np.array(grid.classes == CellClass.FREE)
        factors = np.ones(grid.shape)
        if layer is not None:
            checked_type("layer", layer, CostLayer).check_fits(grid)
            factors = layer.factors.astype(np.float64)
            free.flat[layer.inflated(grid).closed_flat] = False
        self._factors = np.pad(np.where(free, factors, 0.0), 1)
        self._cuts_corners = grid.corner_cutting
        self._shape = grid.shape
        self._resolution_m = grid.resolution_m

    def cost_m(self, start: Cell, goal: Cell) -> float:
        """Return the cost of a cheapest path between two cells in metres, a sum of moves.

        It is infinite where there is no path.

        Parameters
        ----------
        start, goal
            (row, col), inside the map.

        Raises
        ------
        InvalidValueError
            When start or goal is no cell of the map.

        Notes
        -----
        E. W. Dijkstra: A note on two problems in connexion with graphs, 1959.
        """
        (rows, cols), flat = self._shape, []
        for name, cell in (("start", start), ("goal", goal)):
            row, col = checked_cell(name, cell)
            if not (0 <= row < rows and 0 <= col < cols):
                raise InvalidValueError(
                    f"{name} is cell ({row}, {col}), expected one of the map of {rows} rows and "
                    f"{cols} columns: give a cell inside"
                )
            flat.append((row + 1) * (cols + 2) + col + 1)
        if not self._factors.ravel()[flat].all():
            return np.inf
        cost = cheapest_cost(self._factors, self._cuts_corners, flat[0], flat[1])
        return float(cost) * self._resolution_m
