"""Costs of cells in a planner: those of its preset, those given to it, and the finish of paths."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav.errors import InvalidValueError
from hybridnav.maps.checks import checked_type
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.costs import CostLayer, cost_along
from hybridnav.maps.costs.factors import joined_cells
from hybridnav.maps.geometry import polyline_length
from hybridnav.planning import Path
from hybridnav.refine.one_way import shorten, wrong_at
from hybridnav.search.found import ClosedCells

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.areas import Box
    from hybridnav.planning import PlannerSettings, Preset
    from hybridnav.refine import CostLine
    from hybridnav.search.found import Query

_CHORD = 0.25
"""Cells from one point of a curve to the next that is looked at for sides with a direction."""


@copies_alike
class PlannerCosts:
    """The costs by which a planner plans: of its preset, joined with those given to it.

    `preset`: a preset, which may name costs that are computed from the map; `given`: a layer for
    this planner; None for none. Raises `InvalidValueError` when the layer is one of another map, or
    the preset plans on a structure that knows no costs.
    """

    def __init__(self, grid: OccupancyGrid, preset: Preset, given: CostLayer | None) -> None:
        self._grid, self._preset = grid, preset
        named = preset.planner.clearance
        self._named: CostLayer | None = None
        if named is not None:
            self._named = CostLayer.clearance(grid, **named.model_dump())
        self.given = given
        """The layer given to the planner, which stays with its cells when the map changes."""
        self.layer = self._named
        """The layer of the larger factors; None where neither has costs. Its `keepout` holds the
        cells within the robot's radius of the closed ones too."""
        if given is not None:
            self._check(given)
            inflated = given.inflated(grid)
            self.layer = inflated if self._named is None else self._named | inflated

    def on(self, grid: OccupancyGrid) -> PlannerCosts:
        """Return the costs on the same map after its cells changed: those of the preset are
        computed anew, and given ones stay with their cells."""
        return PlannerCosts(grid, self._preset, self.given)

    def changed(self, given: CostLayer, box: Box) -> tuple[PlannerCosts, Box]:
        """Return the costs with the cells in a box as another given layer has them.

        Return also the box of all cells that this changes: closed ones reach as far as the robot's
        radius.

        `given`: a layer of the map; it is read inside the box only; `box`: first row, last row + 1,
        first column, last column + 1 of its cells. Raises `InvalidValueError` as for the first one.
        """
        self._check(given)
        none = CostLayer(np.ones(self._grid.shape, np.float32))
        costs = copy(self)
        vars(costs).pop("closed", None)
        costs.given = own = none if self.given is None else self.given
        costs.layer = layer = none if self.layer is None else self.layer
        if box[0] >= box[1] or box[2] >= box[3]:
            return costs, box
        part, shape = given.part(box), layer.shape
        costs.given = own.changed(part, box[0], box[2])
        if self._named is not None:
            part = self._named.part(box) | part
        if own.closed is None and costs.given.closed is None:
            costs.layer = layer.changed(part, box[0], box[2])
            return costs, box
        reach = math.ceil(self._grid.robot_radius_m / self._grid.resolution_m)
        wide = _grown(box, reach, shape)
        whole = layer.changed(replace(part, closed=None), box[0], box[2]).part(wide)
        keepout = self._shut(costs.given, wide, _grown(wide, reach, shape))
        costs.layer = layer.changed(
            replace(whole, keepout=keepout, source=part.source), wide[0], wide[2]
        )
        return costs, wide

    def opened(self, cells: list[int]) -> PlannerCosts:
        """Return the costs with flat cells open that they close; all factors stay."""
        assert self.layer is not None  # noqa: S101 - the caller has found closed cells
        keepout = np.zeros(self.layer.shape, np.bool_)
        keepout.ravel()[np.setdiff1d(self.layer.closed_flat, cells)] = True
        costs = copy(self)
        vars(costs).pop("closed", None)
        costs.layer = replace(self.layer, closed=None, keepout=keepout)
        return costs

    def _shut(self, given: CostLayer, box: Box, window: Box) -> BoolArray | None:
        """Return the cells of a box that a layer keeps the robot's centre out of; the closed cells
        that lie within its radius are in the window."""
        closed, keepout = (
            None if cells is None else cells[each[0] : each[1], each[2] : each[3]]
            for cells, each in ((given.closed, window), (given.keepout, box))
        )
        near = None
        if closed is not None:
            radius_cells = self._grid.robot_radius_m / self._grid.resolution_m
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

    def _check(self, given: CostLayer) -> None:
        """Raise `InvalidValueError` if a planner cannot plan by a layer."""
        checked_type("costs", given, CostLayer).check_fits(self._grid)
        if why := self._preset.planner.refusal_of_costs():
            closes = "" if not len(given.closed_flat) else "; closed cells alone go as `blocked`"
            raise InvalidValueError(
                f"preset {self._preset.name} cannot plan by costs: {why}{closes}"
            )


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


@copies_alike
class CostFinish:
    """The last step of plans by costs: length and cost of a path, and its any-angle finish.

    `layer`: costs of its cells; `settings`: whether unexplored cells may be entered, and the
    turning radius.
    """

    def __init__(self, grid: OccupancyGrid, layer: CostLayer, settings: PlannerSettings) -> None:
        self.layer = layer
        self._grid = grid
        self._allow_unexplored = settings.allow_unexplored
        self._turning_radius_m: float = getattr(settings, "turning_radius_m", math.nan)

    def line(
        self, cells: LongArray, poses: tuple[FloatArray, FloatArray], closed: ClosedCells | None
    ) -> tuple[Path, float]:
        """Return the any-angle path that a path of cells is cut short to, and its cost in
        metres."""
        points = shorten(self._line, closed, cells, (poses[0][:2], poses[1][:2]))
        length_m = polyline_length(points)
        cost_m = max(cost_along(self._grid, self.layer, points), length_m)
        return Path(cells, points if length_m > 0 else points[:1], length_m), cost_m

    def arcs(
        self, cells: LongArray, poses: tuple[FloatArray, FloatArray], closed: ClosedCells | None
    ) -> tuple[Path, float]:
        """Return the same path with rounded bends, and its cost in metres."""
        points = shorten(self._line, closed, cells, (poses[0][:2], poses[1][:2]))
        return self.arcs_along(cells, points, closed)

    def arcs_along(
        self, cells: LongArray, points: FloatArray, closed: ClosedCells | None
    ) -> tuple[Path, float]:
        """Return an any-angle path, which passes some cells, with rounded bends, and its cost in
        metres. Where arcs would cross a side the wrong way, the path keeps its bends."""
        line = self._line_for(closed)
        found = line.arcs(points, radius_m=self._turning_radius_m)
        path = Path(cells, found.points, found.length_m, found.headings_rad, is_curved=True)
        if closed is not None and closed.one_way is not None and len(points) > 1:
            curve = line.on_grain(path.poses(_CHORD * self._grid.resolution_m)[:, :2])
            first, last = map(tuple, cells[[0, -1]].tolist())
            if wrong_at(closed.one_way, line.free, curve, (first, last)) is not None:
                length_m = polyline_length(points)
                cost_m = cost_along(self._grid, self.layer, points)
                return Path(cells, points, length_m), max(cost_m, length_m)
        return path, max(found.cost_m, found.length_m)

    def bound(self, query: Query, cost_m: float) -> float:
        """Return a lower bound on the cost of all any-angle paths of a query, in metres.

        It is at most the cost of a path that is known; where corners may be cut, it is the
        distance.
        """
        if self._grid.corner_cutting:
            return min(query.straight_m, cost_m)
        # Loads modules that plans whose bound nobody reads do not need.
        from hybridnav.search.lattice import cost_bound  # noqa: PLC0415

        line, frame = self._line_for(query.closed), self._grid.frame
        first, last = (frame.position_of(*point.tolist()) for point in query.points)
        per_cell = frame.resolution_m
        known = cost_m / per_cell
        found = cost_bound(line.free, line.factors, (first, last), query.cells, known) * per_cell
        return min(max(found, query.straight_m), cost_m)

    def _line_for(self, closed: ClosedCells | None) -> CostLine:
        """Return the shortener of paths; with closed cells, one for this query."""
        return self._line if closed is None else self._line.closing(closed.flat)

    @cached_property
    def _line(self) -> CostLine:
        from hybridnav.refine import CostLine  # noqa: PLC0415 - with costs alone

        return CostLine(self._grid, self.layer, allow_unexplored=self._allow_unexplored)
