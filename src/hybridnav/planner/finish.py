"""The finish of cell paths: from what a planner of cell paths has found to a result."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal, get_args

from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import path_length_in_cells
from hybridnav.errors import InvalidValueError
from hybridnav.maps.lines import polyline_length
from hybridnav.planner import Path
from hybridnav.planner.costs import CostFinish
from hybridnav.refine import LineOfSight

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.costs import CostLayer
    from hybridnav.planner import PlannerSettings, PlanResult
    from hybridnav.planner.cell_planner import CellPlan, CellPlanner
    from hybridnav.planner.closed import ClosedCells
    from hybridnav.planner.follow import Outcomes

Smooth = Literal["none", "line-of-sight", "arcs"]


@copies_alike
class Finish:
    """The last step of plans: the path in the metric asked for, its length or cost, its bound.

    Parameters
    ----------
    grid
        The map.
    cells
        The planner of cell paths.
    outcomes
        Makes the results.
    settings
        Section `planner` of the preset.
    costs
        Costs of the cells; None makes costs lengths.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        cells: CellPlanner,
        outcomes: Outcomes,
        settings: PlannerSettings,
        *,
        costs: CostLayer | None,
    ) -> None:
        self._grid = grid
        self._cells = cells
        self._outcomes = outcomes
        self._allow_unexplored = settings.allow_unexplored
        self._by_costs: CostFinish | None = None
        if costs is not None:
            self._by_costs = CostFinish(grid, costs, settings)

    def checked(self, smooth: Smooth | None, default: Smooth) -> Smooth:
        """Return the finish asked for, or that of the preset for None.

        Raises
        ------
        InvalidValueError
            When it is another word, or needs costs and there are none.
        """
        chosen = default if smooth is None else smooth
        if chosen not in get_args(Smooth):
            known = ", ".join(map(repr, get_args(Smooth)))
            raise InvalidValueError(f"smooth must be {known}, or None, got {smooth!r:.80}")
        if chosen == "arcs" and self._by_costs is None:
            raise InvalidValueError(
                "smooth 'arcs' rounds bends of paths by costs, and this planner plans by lengths: "
                "give it costs, or take 'line-of-sight'"
            )
        return chosen

    def with_closed(self, closed: ClosedCells | None) -> ClosedCells | None:
        """Return the closed cells of a query with those that the costs close for all queries."""
        return closed if self._by_costs is None else self._by_costs.with_closed(closed)

    def result(
        self,
        plan: CellPlan,
        poses: tuple[FloatArray, FloatArray],
        smooth: Smooth,
        closed: ClosedCells | None,
    ) -> PlanResult:
        """Return the result of a plan with a path."""
        if self._by_costs is not None:
            return self._cheapest(self._by_costs, plan, poses, smooth, closed)
        assert plan.cells is not None  # noqa: S101 - the caller has looked
        grid = self._grid
        bound = plan.bound_cells * grid.resolution_m
        points, metric = plan.points, self._cells.metric
        if metric == "octile" and smooth == "line-of-sight":
            began = time.perf_counter()
            ends = poses[0][:2], poses[1][:2]
            points, metric = self._sight(closed).shorten(plan.cells, *ends), "any-angle"
            plan.stats.seconds["smooth"] = time.perf_counter() - began
            bound = self._cells.bound(plan, ends)
        if points is None:
            points = grid.frame.points_of(plan.cells)
        if metric == "octile":
            length_m = (plan.length_cells or path_length_in_cells(plan.cells)) * grid.resolution_m
        else:
            length_m = polyline_length(points)
            points = points if length_m > 0 else points[:1]
        if self._cells.metric == "any-angle" and plan.length_cells:
            # A share of the length, so that a proved optimum has no gap by rounding.
            bound = length_m * (plan.bound_cells / plan.length_cells)
        path = Path(plan.cells, points, length_m)
        return self._outcomes.solved(plan, poses, path, metric, min(bound, length_m))

    def _cheapest(
        self,
        costs: CostFinish,
        plan: CellPlan,
        poses: tuple[FloatArray, FloatArray],
        smooth: Smooth,
        closed: ClosedCells | None,
    ) -> PlanResult:
        """Return the result of a cheapest path of cells."""
        assert plan.cells is not None  # noqa: S101 - the caller has looked
        grid_bound = plan.bound_cells * self._grid.resolution_m
        if smooth == "none":
            path, cost_m = costs.cell_path(plan.cells)
            bound = min(grid_bound, cost_m)
            return self._outcomes.solved(plan, poses, path, "weighted", bound, weighted_cost=cost_m)
        began = time.perf_counter()
        finish = costs.arcs if smooth == "arcs" else costs.line
        path, cost_m = finish(plan.cells, poses, closed)
        plan.stats.seconds["smooth"] = time.perf_counter() - began
        bound = min(self._cells.bound(plan, (poses[0][:2], poses[1][:2])), cost_m)
        found = self._outcomes.solved(
            plan, poses, path, "any-angle-weighted", bound, weighted_cost=cost_m
        )
        return replace(found, grid_bound=grid_bound)

    def _sight(self, closed: ClosedCells | None) -> LineOfSight:
        """Return the shortener of paths; with closed cells, one for this query."""
        if closed is None:
            return self._line_of_sight
        allowed = self._allow_unexplored
        return LineOfSight(self._grid, allow_unexplored=allowed, closed=closed.flat)

    @cached_property
    def _line_of_sight(self) -> LineOfSight:
        return LineOfSight(self._grid, allow_unexplored=self._allow_unexplored)
