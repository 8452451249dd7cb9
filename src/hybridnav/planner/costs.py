"""Costs of cells in a planner: those of its preset, those given to it, and the finish of paths."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.costs import CostLayer, cost_along
from hybridnav.errors import InvalidValueError
from hybridnav.grid.lines import polyline_length
from hybridnav.planner.closed import ClosedCells
from hybridnav.refine import CostLine
from hybridnav.result import Path
from hybridnav.search.moves import path_length_in_cells

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, LongArray
    from hybridnav.config import Preset
    from hybridnav.grid import OccupancyGrid


def costs_of(grid: OccupancyGrid, preset: Preset, given: CostLayer | None) -> CostLayer | None:
    """Return the costs by which a planner plans: of its preset, joined with those given to it.

    Parameters
    ----------
    grid
        The map.
    preset
        A preset, which may name costs that are computed from the map.
    given
        A layer for this planner; None for none.

    Returns
    -------
    CostLayer | None
        The layer of the larger factors; None where neither has costs.

    Raises
    ------
    InvalidValueError
        When the layer is one of another map, or the preset plans on a structure that knows no
        costs.
    """
    if given is not None:
        if not isinstance(given, CostLayer):
            raise InvalidValueError(f"costs must be a CostLayer, got a {type(given).__name__}")
        given.check_fits(grid)
        if why := preset.planner.refusal_of_costs():
            raise InvalidValueError(f"preset {preset.name} cannot plan by costs: {why}")
    named = preset.planner.costs
    if named is None or named.clearance is None:
        return given
    own = CostLayer.clearance(grid, **named.clearance.model_dump())
    return own if given is None else own | given


@copies_alike
class CostFinish:
    """The last step of plans by costs: length and cost of a path, and its any-angle finish.

    Parameters
    ----------
    grid
        The map.
    layer
        Costs of its cells.
    allow_unexplored
        Whether unexplored cells may be entered.
    """

    def __init__(self, grid: OccupancyGrid, layer: CostLayer, *, allow_unexplored: bool) -> None:
        self.layer = layer
        self._grid = grid
        self._allow_unexplored = allow_unexplored

    def with_closed(self, closed: ClosedCells | None) -> ClosedCells | None:
        """Return the closed cells of a query with those that the layer closes for all queries."""
        flat = self.layer.closed_flat
        if not len(flat):
            return closed
        return ClosedCells(flat if closed is None else np.union1d(closed.flat, flat))

    def cell_path(self, cells: LongArray) -> tuple[Path, float]:
        """Return a path of cells and its cost in metres."""
        per_cell = self._grid.resolution_m
        points = self._grid.frame.points_of(cells)
        path = Path(cells, points, path_length_in_cells(cells) * per_cell)
        return path, self.layer.cost_of_cells(cells) * per_cell

    def line(
        self, cells: LongArray, poses: tuple[FloatArray, FloatArray], closed: ClosedCells | None
    ) -> tuple[Path, float]:
        """Return the any-angle path that a path of cells is cut short to, and its cost in
        metres."""
        line = self._line
        if closed is not None:
            allowed = self._allow_unexplored
            line = CostLine(self._grid, self.layer, allow_unexplored=allowed, closed=closed.flat)
        points = line.shorten(cells, poses[0][:2], poses[1][:2])
        length_m = polyline_length(points)
        cost_m = max(cost_along(self._grid, self.layer, points), length_m)
        return Path(cells, points if length_m > 0 else points[:1], length_m), cost_m

    @cached_property
    def _line(self) -> CostLine:
        return CostLine(self._grid, self.layer, allow_unexplored=self._allow_unexplored)
