"""Refinement by grid search: the optimal cell path inside a corridor."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

from hybridnav._base.moves import path_length_in_cells
from hybridnav.refine.line_of_sight import open_cells
from hybridnav.search.grid_search import Cell, GridSearch

if TYPE_CHECKING:
    from hybridnav._base.typing import LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.costs import CostLayer
    from hybridnav.route import Corridor


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
        self,
        grid: OccupancyGrid,
        *,
        allow_unexplored: bool = False,
        costs: CostLayer | None = None,
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
        closed = None if self.costs is None else self.costs.closed_flat
        enterable = open_cells(self.grid, closed, allow_unexplored=self._allow_unexplored)
        if self.costs is None:
            return GridSearch(enterable, corner_cutting=self.grid.corner_cutting)
        corner_cutting, units = self.grid.corner_cutting, self.costs.units
        return GridSearch(enterable, corner_cutting=corner_cutting, units=units)

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
