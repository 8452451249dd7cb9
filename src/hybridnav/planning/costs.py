"""Costs of cells in a planner: those of its preset, those given to it, and the finish of paths."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.typing import BoolArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.cells import Box
from hybridnav.maps.checks import checked_type
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.costs.factors import joined_cells
from hybridnav.search.found import ClosedCells

if TYPE_CHECKING:
    from hybridnav.planning import Preset


@copies_alike
@dataclass(frozen=True, eq=False)
class PlannerCosts:
    """The costs by which a planner plans: of its preset, joined with those given to it."""

    grid: OccupancyGrid
    preset: Preset
    """It may name costs that are computed from the map."""
    named: CostLayer | None
    """The layer that the preset names; None for none."""
    given: CostLayer | None
    """The layer given to the planner, which stays with its cells when the map changes; None for
    none."""
    layer: CostLayer | None
    """The layer of the larger factors; None where neither has costs. Its `keepout` holds the cells
    within the robot's radius of the closed ones too."""

    @classmethod
    def of(cls, grid: OccupancyGrid, preset: Preset, given: CostLayer | None) -> PlannerCosts:
        """Return the costs of a planner.

        Raises `InvalidValueError` when the layer is one of another map, or the preset plans on a
        structure that knows no costs.
        """
        settings = preset.planner.clearance
        named = None if settings is None else CostLayer.clearance(grid, **settings.model_dump())
        if given is None:
            return cls(grid, preset, named, None, named)
        _check(given, grid, preset)
        inflated = given.inflated(grid)
        return cls(grid, preset, named, given, inflated if named is None else named | inflated)

    def on(self, grid: OccupancyGrid) -> PlannerCosts:
        """Return the costs on the same map after its cells changed: those of the preset are
        computed anew, and given ones stay with their cells."""
        return PlannerCosts.of(grid, self.preset, self.given)

    def changed(self, given: CostLayer, box: Box) -> tuple[PlannerCosts, Box]:
        """Return the costs with the cells in a box as another given layer has them.

        Return also the box of all cells that this changes: closed ones reach as far as the robot's
        radius.

        `given`: a layer of the map; it is read inside the box only; `box`: first row, last row + 1,
        first column, last column + 1 of its cells. Raises `InvalidValueError` as for the first one.
        """
        _check(given, self.grid, self.preset)
        none = CostLayer(np.ones(self.grid.shape, np.float32))
        own, layer = self.given or none, self.layer or none
        if box[0] >= box[1] or box[2] >= box[3]:
            return replace(self, given=own, layer=layer), box
        part, shape = given.part(box), layer.shape
        now = own.changed(part, box[0], box[2])
        if self.named is not None:
            part = self.named.part(box) | part
        if own.closed is None and now.closed is None:
            return replace(self, given=now, layer=layer.changed(part, box[0], box[2])), box
        reach = math.ceil(self.grid.robot_radius_m / self.grid.resolution_m)
        wide = _grown(box, reach, shape)
        whole = layer.changed(replace(part, closed=None), box[0], box[2]).part(wide)
        keepout = self._shut(now, wide, _grown(wide, reach, shape))
        whole = replace(whole, keepout=keepout, source=part.source)
        return replace(self, given=now, layer=layer.changed(whole, wide[0], wide[2])), wide

    def opened(self, cells: list[int]) -> PlannerCosts:
        """Return the costs with flat cells open that they close; all factors stay."""
        assert self.layer is not None  # noqa: S101 - the caller has found closed cells
        keepout = np.zeros(self.layer.shape, np.bool_)
        keepout.ravel()[np.setdiff1d(self.layer.closed_flat, cells)] = True
        return replace(self, layer=replace(self.layer, closed=None, keepout=keepout))

    def _shut(self, given: CostLayer, box: Box, window: Box) -> BoolArray | None:
        """Return the cells of a box that a layer keeps the robot's centre out of; the closed cells
        that lie within its radius are in the window."""
        closed, keepout = (
            None if cells is None else cells[each[0] : each[1], each[2] : each[3]]
            for cells, each in ((given.closed, window), (given.keepout, box))
        )
        near = None
        if closed is not None:
            radius_cells = self.grid.robot_radius_m / self.grid.resolution_m
            top, left = box[0] - window[0], box[2] - window[2]
            near = within_radius(closed, radius_cells=radius_cells)
            near = near[top : top + box[1] - box[0], left : left + box[3] - box[2]]
        return joined_cells(near, keepout)

    @cached_property
    def closed(self) -> ClosedCells | None:
        """The cells that the layer closes for all queries; None for none. A footprint stays off the
        closed ones as given, which are obstacles, and its base off all of them."""
        layer, given = self.layer, self.given
        if layer is None or not len(layer.closed_flat):
            return None
        closed = None if given is None else given.closed
        return ClosedCells(layer.closed_flat, None if closed is None else np.flatnonzero(closed))

    def closing(self, closed: ClosedCells | None) -> ClosedCells | None:
        """Return closed cells with those that the layer closes for all queries."""
        always = self.closed
        return closed | always if closed and always else closed or always


def _check(given: CostLayer, grid: OccupancyGrid, preset: Preset) -> None:
    """Raise `InvalidValueError` if a planner cannot plan by a layer."""
    checked_type("costs", given, CostLayer).check_fits(grid)
    if why := preset.planner.refusal_of_costs():
        closes = "" if not len(given.closed_flat) else "; closed cells alone go as `blocked`"
        raise InvalidValueError(f"preset {preset.name} cannot plan by costs: {why}{closes}")


def _grown(box: Box, reach: int, shape: tuple[int, int]) -> Box:
    """Return a box of cells with those around it, on the map."""
    top, bottom, left, right = box
    rows, cols = shape
    return (
        max(top - reach, 0),
        min(bottom + reach, rows),
        max(left - reach, 0),
        min(right + reach, cols),
    )
