"""Presets, and methods on a grid of their own, as methods of the harness."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.typing import IntArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.harness.baselines import AnyAngleResult, CostClaim, MethodResult
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.planning import HybridPlanner, Metric, PlanResult, PlanStats, PlanStatus, Preset
from hybridnav.search import found as search
from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]


class HybridMethod:
    """A preset of `HybridPlanner` as a method; see `baselines.Solver`."""

    def __init__(
        self, topology: TopologicalMap, preset: Preset, costs: CostLayer | None = None
    ) -> None:
        self.topology = topology
        self.name = preset.name
        self._planner = HybridPlanner(topology, preset=preset, costs=costs)
        self._planner.prepare()
        self._frame = topology.grid.frame
        free = topology.classes == CellClass.FREE
        self.region_of: IntArray = topology.level.field_of
        self.n_nodes = int(free.sum())
        plain = ~topology.level.is_self_loop & free[topology.arcs].all(axis=1)
        self.n_edges = int(plain.sum())

    @cached_property
    def memory_bytes(self) -> int:
        """Sum of the arrays of the planner, the topological map and the record, in bytes."""
        return _nbytes(self._planner, set())

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        return self._told(self._planned(start, goal))

    def ask(self, start: Cell, goal: Cell) -> Callable[[], MethodResult]:
        """Plan and read the path; return what tells all that only judges read."""
        return partial(self._told, self._planned(start, goal))

    def _planned(self, start: Cell, goal: Cell) -> PlanResult:
        endpoints = self._frame.points_of(np.array([start, goal]))
        result = self._planner.plan(endpoints[0], endpoints[1])
        if result.path is not None:
            _ = result.path.points if result.metric in LINE_METRICS else result.path.cells
        return result

    def _told(self, result: PlanResult) -> MethodResult:
        route, stats = result.route, result.stats
        path = result.path if result.solved else None
        line = _line(result)
        arc_ids = self.topology.arc_ids
        by_costs = self._planner.costs is not None
        claim = None
        if by_costs and result.solved:
            bound = partial(getattr, result, "lower_bound")
            claim = CostClaim(result.cost, bound, result.grid_bound)
        is_factor = result.solved and line is None and not by_costs
        return MethodResult(
            None if path is None or line is not None else path.cells,
            any_angle=line,
            gave_up=str(result.status) if result.status in _GAVE_UP else "",
            nodes=None if route is None else _dense(self.topology.place_ids, route.places),
            arcs=None if route is None or -1 in route.arcs else _dense(arc_ids, route.arcs),
            bound=1 + result.gap if is_factor else np.inf,
            by_costs=claim,
            seconds=_stages(result),
            **_counts(stats),
        )

    def close(self) -> None:
        """End the process of a planner with OMPL."""
        self._planner.close()


class FoundMethod:
    """A search method that a preset could name too, as a method of the harness.

    `method`: answers a `Query` with a `Found`; its `prepare`, if it has one, is called here. Its
    `name`, `n_nodes`, `n_edges`, `memory_bytes`, `version` and `settings` are shown if it has them.
    """

    def __init__(self, method: search.Method, grid: OccupancyGrid) -> None:
        self._method, self._frame = method, grid.frame
        if callable(prepare := getattr(method, "prepare", None)):
            prepare()
        cells = int((grid.classes == CellClass.FREE).sum())
        usual = {"n_nodes": cells, "n_edges": 0, "memory_bytes": 0, "version": "", "settings": ""}
        for name, default in {"name": type(method).__name__, **usual}.items():
            setattr(self, name, getattr(method, name, default))
        self.region_of: IntArray | None = None

    if TYPE_CHECKING:
        name: str
        n_nodes: int
        n_edges: int
        memory_bytes: int

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        ends = self._frame.points_of(np.array([start, goal]))
        answer = self._method.find(search.Query((start, goal), (ends[0], ends[1])))
        stats, cost_m, least_m = answer.stats, answer.cost_m, answer.lower_bound_m
        counts = _counts(stats) | {"seconds": stats.seconds, "proof": answer.proof}
        if not answer.has_path:
            gave_up = "" if math.isinf(least_m) else "no path, and no proof of none"
            return MethodResult(None, gave_up=gave_up, **counts)
        if self._method.metric == "any-angle" and answer.points is not None:
            line = AnyAngleResult(answer.points, cost_m, lower_bound_m=least_m)
            return MethodResult(None, any_angle=line, **counts)
        if self._method.metric == "weighted":
            claim = CostClaim(cost_m, least_m)
            return MethodResult(answer.cells, by_costs=claim, **counts)
        bound = cost_m / least_m if least_m > 0 else math.inf
        return MethodResult(answer.cells, bound=bound if cost_m > 0 else 1.0, **counts)

    def close(self) -> None:
        """End the processes of the method."""
        close_method(self._method)


def close_method(method: object) -> None:
    """End the processes of a method, if it has a `close`."""
    close = getattr(method, "close", None)
    if callable(close):
        close()


def _counts(stats: PlanStats) -> dict[str, Any]:
    """Return what a search took from its queues, under the names of the harness."""
    return {
        "expanded": stats.expanded,
        "expanded_nodes": stats.expanded_places,
        "expanded_intervals": stats.expanded_intervals,
    }


LINE_METRICS: frozenset[Metric] = frozenset({"any-angle", "any-angle-weighted"})
_GAVE_UP = (PlanStatus.APPROXIMATE, PlanStatus.TIMEOUT)


def _line(result: PlanResult) -> AnyAngleResult | None:
    is_line = result.metric in LINE_METRICS
    if not is_line or result.path is None or not result.solved:
        return None
    how = result.refinement
    return AnyAngleResult(
        result.path.points,
        result.path.length_m,
        lower_bound_m=result.lower_bound if result.metric == "any-angle" else 0.0,
        headings_rad=result.path.headings_rad if result.path.is_curved else None,
        by_grid=None if how is None else how.by_grid,
    )


def _stages(result: PlanResult) -> dict[str, float]:
    """Return seconds by stage, under the names that all methods use."""
    seconds = dict(result.stats.seconds)
    if "ompl" in seconds:
        seconds["refine"] = seconds.pop("ompl")
    if result.refinement is not None and result.refinement.trace:
        seconds["first path"] = result.refinement.trace[0][0]
    return seconds


def _dense(ids: Any, named: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(np.searchsorted(ids, np.array(named, dtype=np.int64)).tolist())


def _nbytes(thing: Any, seen: set[int]) -> int:
    """Return the bytes of all arrays that a thing of this package holds, each counted once."""
    if id(thing) in seen:
        return 0
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        owner = thing
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        counted = id(owner) in seen and owner is not thing
        seen.add(id(owner))
        return 0 if counted else owner.nbytes
    if isinstance(thing, (list, tuple)):
        return sum(_nbytes(item, seen) for item in thing)
    if isinstance(thing, dict):
        return sum(_nbytes(item, seen) for item in thing.values())
    module = type(thing).__module__
    if not module.startswith("hybridnav.") or module.startswith("hybridnav.maps"):
        return 0
    return _nbytes(getattr(thing, "__dict__", {}), seen)


def checked(answer: object) -> MethodResult:
    """Return the answer of a method; raise `InvalidValueError` for what is none."""
    if not isinstance(answer, MethodResult):
        raise InvalidValueError(
            f"solve must return a MethodResult, got {brief(answer)}: return MethodResult(cells), "
            "or MethodResult(None) for no path"
        )
    return answer
