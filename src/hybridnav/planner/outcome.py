"""Results of queries: with their routes, and with the settings that they were planned by."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from hybridnav.planner.follow import built_of, is_stale
from hybridnav.result import PlanResult, PlanStatus
from hybridnav.route.route_finder import RouteFinder, RouteOfCells

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray
    from hybridnav.config import Preset
    from hybridnav.costs import CostLayer
    from hybridnav.planner.cell_planner import CellPlan
    from hybridnav.planner.ompl_plans import OmplPlan
    from hybridnav.result import Metric, Path
    from hybridnav.topology import TopologicalMap

Poses = tuple["FloatArray", "FloatArray"]


class Outcomes:
    """Makes the results of one planner.

    Parameters
    ----------
    topology
        The map; with stale places results have no routes.
    preset
        The preset of the planner.
    costs
        The costs that it plans by; None for lengths.
    """

    def __init__(
        self, topology: TopologicalMap, preset: Preset, costs: CostLayer | None = None
    ) -> None:
        self._topology = topology
        self._preset = preset
        self._costs = costs
        self._built = built_of(topology)
        self._route_finder = None if is_stale(topology) else RouteFinder(topology)

    def answer(self, status: PlanStatus, poses: Poses, **outcome: Any) -> PlanResult:
        """Return a result that records the endpoints, the preset and the settings of the
        pyramid."""
        # Each result has its own settings, so that a change of one does not affect the next.
        settings = {
            key: dict(value) if isinstance(value, dict) else value
            for key, value in self._settings.items()
        }
        start, goal = tuple(poses[0].tolist()), tuple(poses[1].tolist())
        return PlanResult(status, settings=settings, start=start, goal=goal, **outcome)

    def no_path(self, plan: CellPlan, poses: Poses, metric: Metric) -> PlanResult:
        """Return the result of a plan without a path."""
        bound = plan.bound_cells * self._topology.grid.resolution_m
        return self.answer(
            PlanStatus.NO_PATH, poses, metric=metric, lower_bound=bound, stats=plan.stats
        )

    def solved(  # noqa: PLR0913 - the last has a default
        self,
        plan: CellPlan,
        poses: Poses,
        path: Path,
        metric: Metric,
        bound_m: float,
        *,
        weighted_cost: float | None = None,
    ) -> PlanResult:
        """Return the result of a plan with a path."""
        return self.answer(
            PlanStatus.SOLVED,
            poses,
            metric=metric,
            path=path.turned_at_ends(*poses),
            route_source=plan.route or self.route_of(path),
            lower_bound=bound_m,
            weighted_cost=weighted_cost,
            stats=plan.stats,
        )

    def by_ompl(self, found: OmplPlan, plan: CellPlan, poses: Poses, bound_m: float) -> PlanResult:
        """Return the result of a coarse plan refined by OMPL, with the bound of the coarse one."""
        bound = max(found.lower_bound, bound_m)
        if found.path is not None and found.status is PlanStatus.SOLVED:
            bound = min(bound, found.weighted_cost or found.path.length_m)
        path = found.path
        if path is not None and path.headings_rad is None and found.status is PlanStatus.SOLVED:
            path = path.turned_at_ends(*poses)
        return self.answer(
            found.status,
            poses,
            metric=found.metric,
            path=path,
            route_source=self.route_of(found.path),
            lower_bound=bound,
            weighted_cost=found.weighted_cost,
            refinement=found.refinement,
            stats=plan.stats,
        )

    def route_of(self, path: Path | None) -> RouteOfCells | None:
        """Return what the route of a path is found from, None for no path or stale places."""
        if path is None or self._route_finder is None:
            return None
        return RouteOfCells(self._topology, self._route_finder, path.cells)

    @cached_property
    def _settings(self) -> dict[str, Any]:
        pyramid = self._built
        costs = {} if self._costs is None else {"costs": self._costs.source}
        return {
            "preset": self._preset.name,
            "planner": self._preset.planner.model_dump(),
            "pyramid": {
                "merge_distance_m": pyramid.merge_distance_m,
                "linkage": pyramid.linkage,
                "seed": pyramid.seed,
                "robot_radius_m": self._topology.grid.robot_radius_m,
            },
            **costs,
        }
