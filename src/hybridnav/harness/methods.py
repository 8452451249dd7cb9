"""All methods of the harness by name: presets of our planner, and baselines."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import json
import time
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.baselines import AnyAngleResult, CostClaim, MethodResult
from hybridnav.config import Preset, load_preset
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.harness.graph_method import GraphMethod
from hybridnav.planner import HybridPlanner
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.result import PlanStatus
from hybridnav.topology import TopologicalMap

if TYPE_CHECKING:
    from hybridnav._typing import IntArray
    from hybridnav.baselines import Method
    from hybridnav.costs import CostLayer
    from hybridnav.graphs import WaypointGraph
    from hybridnav.grid import OccupancyGrid
    from hybridnav.result import Metric, PlanResult

Cell = tuple[int, int]

REFERENCE = "grid-astar"
"""The baseline whose lengths are the optimum; part of every run."""

LINE_OF_SIGHT = "line-of-sight"
"""Value of `planner.smooth`; added to the names of presets that have it, as in
`portals+line-of-sight`."""

BASELINES: dict[str, tuple[str, dict[str, Any]]] = {
    "grid-astar": ("hybridnav.baselines.grid:GridAstar", {}),
    "grid-dijkstra": ("hybridnav.baselines.grid:GridDijkstra", {}),
    "weighted-astar": ("hybridnav.baselines.grid:WeightedAstar", {}),
    "hpa-star": ("hybridnav.baselines.hpa:HpaStar", {}),
    "hpa-star-raw": ("hybridnav.baselines.hpa:HpaStar", {"smooth": False}),
    "hpa-star-lines": ("hybridnav.baselines.hpa:HpaStar", {"line_cells": 1000}),
    "simple-graph": ("hybridnav.baselines.simple_graph:SimpleGraphPyramid", {}),
    "exact-overlay": ("hybridnav.baselines.overlay:ExactOverlay", {}),
    "thrun": ("hybridnav.baselines.thrun:ThrunMap", {}),
}
"""Class of each baseline and its options; those named in `ON_PLACES` are made from a
`TopologicalMap`, the others from an `OccupancyGrid`. Work outside this package names its own class
as `module:class`."""

ON_PLACES = frozenset({"simple-graph", "exact-overlay"})


@dataclass(frozen=True)
class MethodSpec:
    """A method to build: a preset or a baseline, and the pyramid under it. Plain values, so that it
    can go to another process."""

    name: str
    preset: dict[str, Any] | None
    """The preset's sections; None for a baseline."""
    pyramid: dict[str, Any] = field(default_factory=dict)
    """merge_distance_m, linkage, seed: of the places that it plans on."""
    graph: WaypointGraph | None = None
    """The graph whose routes it follows, if that is all that it does."""
    clear_edges_only: bool = False
    """Whether edges of the graph that the robot cannot follow are left out."""

    @property
    def metric(self) -> Metric:
        """Metric of its paths; octile for baselines, even for those whose answers have an
        `any_angle` path."""
        if self.graph is not None:
            return "any-angle"
        planner = (self.preset or {}).get("planner", {})
        settings = (
            ("refine", "ompl"),
            ("smooth", LINE_OF_SIGHT),
            ("smooth", "arcs"),
            ("coarse", "mesh"),
        )
        is_any_angle = any(planner.get(key) == value for key, value in settings)
        return "any-angle" if is_any_angle else "octile"

    @cached_property
    def digest(self) -> str:
        """Short hash of all settings, part of every record's id."""
        parts: list[Any] = [self.name, self.preset, self.pyramid]
        if self.graph is not None:
            parts += [self.graph.digest, self.clear_edges_only]
        text = json.dumps(parts, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:12]


def preset_spec(
    source: str | Preset,
    *,
    merge_distance_m: float | None = None,
    seed: int | None = None,
    by_costs: bool = False,
) -> MethodSpec:
    """Return the method of a preset, with its merge distance and seed where they are given.

    In a run with costs those take the place of the preset's own.

    Raises
    ------
    InvalidValueError
        When the preset plans in a metric in which the harness has nothing to compare with.
    OmplError
        When it needs OMPL, which is not installed.
    """
    preset = load_preset(source)
    _check_metric(preset, by_costs=by_costs)
    pyramid = preset.pyramid.model_dump(exclude={"robot_radius_m"})
    smoothed = preset.planner.smooth == LINE_OF_SIGHT
    return MethodSpec(
        f"{preset.name}+{LINE_OF_SIGHT}" if smoothed else preset.name,
        preset.model_dump(exclude={"description": True, "planner": {"costs"}}),
        pyramid | _given(merge_distance_m, seed),
    )


def _check_metric(preset: Preset, *, by_costs: bool) -> None:
    ompl, costs = preset.planner.ompl, preset.planner.costs
    needs_costs = preset.planner.smooth == "arcs" or (costs and costs.clearance)
    if needs_costs and not by_costs:
        raise InvalidValueError(
            f"preset {preset.name} plans by costs, and this run measures lengths: state costs for "
            "all methods, as in --costs clearance"
        )
    if ompl is None:
        return
    if ompl.has_heading:
        raise InvalidValueError(
            f"preset {preset.name}: space {ompl.space} needs headings at start and goal, and the "
            "harness asks for paths between cells: it evaluates space r2"
        )
    if ompl.objective != "length":
        raise InvalidValueError(
            f"preset {preset.name}: the harness measures lengths, objective {ompl.objective} makes "
            "something else small: it evaluates objective length"
        )
    from hybridnav.refine.ompl import require_ompl  # noqa: PLC0415 - workers need it not

    require_ompl()


def baseline_spec(
    name: str, *, merge_distance_m: float | None = None, seed: int | None = None
) -> MethodSpec:
    """Return the method of a baseline.

    Raises
    ------
    InvalidValueError
        When there is none of that name, or its class cannot be imported.
    """
    if name not in BASELINES and ":" not in name:
        raise InvalidValueError(
            f"no baseline is called {name!r}: there are {', '.join(BASELINES)}, or module:class"
        )
    _class_of(name)
    if name not in ON_PLACES:
        return MethodSpec(name, None)
    pyramid = Preset().pyramid.model_dump(exclude={"robot_radius_m"})
    return MethodSpec(name, None, pyramid | _given(merge_distance_m, seed))


def graph_spec(graph: WaypointGraph, *, clear_edges_only: bool = False) -> MethodSpec:
    """Return the method that follows a graph; see `GraphMethod`."""
    name = f"graph {graph.name}" + (" (clear edges)" if clear_edges_only else "")
    return MethodSpec(name, None, graph=graph, clear_edges_only=clear_edges_only)


def _given(merge_distance_m: float | None, seed: int | None) -> dict[str, Any]:
    settings = {"merge_distance_m": merge_distance_m, "seed": seed}
    return {key: value for key, value in settings.items() if value is not None}


class HybridMethod:
    """A preset of `HybridPlanner` as a method; see `baselines.Method`."""

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
        endpoints = self._frame.points_of(np.array([start, goal]))
        result = self._planner.plan(endpoints[0], endpoints[1])
        route, stats = result.route, result.stats
        path = result.path if result.solved else None
        line = _line(result)
        arc_ids = self.topology.arc_ids
        by_costs = self._planner.costs is not None
        claim = None
        if by_costs and result.solved:
            claim = CostClaim(result.cost, result.lower_bound, result.grid_bound)
        is_factor = result.solved and line is None and not by_costs
        return MethodResult(
            None if path is None or line is not None else path.cells,
            any_angle=line,
            gave_up=str(result.status) if result.status in _GAVE_UP else "",
            nodes=None if route is None else _dense(self.topology.place_ids, route.places),
            arcs=None if route is None or -1 in route.arcs else _dense(arc_ids, route.arcs),
            bound=1 + result.gap if is_factor else np.inf,
            by_costs=claim,
            expanded=stats.expanded,
            expanded_nodes=stats.expanded_places,
            expanded_border_cells=stats.expanded_border_cells,
            expanded_intervals=stats.expanded_intervals,
            seconds=_stages(result),
        )

    def close(self) -> None:
        """End the process of a planner with OMPL."""
        self._planner.close()


LINE_METRICS: frozenset[Metric] = frozenset({"any-angle", "any-angle-weighted"})
_GAVE_UP = (PlanStatus.APPROXIMATE, PlanStatus.TIMEOUT)


def _line(result: PlanResult) -> AnyAngleResult | None:
    """Return the path of a solved query if it is an any-angle path."""
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
    if not module.startswith("hybridnav.") or module.startswith("hybridnav.grid"):
        return 0
    return _nbytes(getattr(thing, "__dict__", {}), seen)


@dataclass
class Prepared:
    """A method ready for one map, and the effort of its preparation."""

    method: Method
    topology: TopologicalMap | None
    """The places that it plans on, None for methods that need none."""
    pyramid_seconds: float
    method_seconds: float
    by_costs: bool = False
    """Whether it plans by the costs of the run."""

    def close(self) -> None:
        """End the processes of the method, which answers no more."""
        close = getattr(self.method, "close", None)
        if callable(close):
            close()


def prepare(spec: MethodSpec, grid: OccupancyGrid, costs: CostLayer | None = None) -> Prepared:
    """Build a method for a map, with the costs of its cells if it can plan by them."""
    began = time.perf_counter()
    topology = None
    if spec.pyramid:
        topology = TopologicalMap(DualGraphPyramid.build(grid, **spec.pyramid))
    built = time.perf_counter()
    method: Method
    if spec.preset is not None and topology is not None:
        preset = Preset.model_validate(spec.preset)
        if preset.planner.refusal_of_costs():
            costs = None
        method = HybridMethod(topology, preset, costs)
    elif spec.graph is not None:
        costs = None
        method = GraphMethod(grid, spec.graph, clear_edges_only=spec.clear_edges_only)
    else:
        made_of, options = _class_of(spec.name)
        if not _takes_costs(made_of):
            costs = None
        if costs is not None:
            options = options | {"costs": costs}
        method = made_of(grid if topology is None else topology, **options)
    by_costs = costs is not None
    return Prepared(method, topology, built - began, time.perf_counter() - built, by_costs)


def _takes_costs(made_of: Any) -> bool:
    """Return whether a class is made with costs."""
    try:
        return "costs" in inspect.signature(made_of).parameters
    except (TypeError, ValueError):  # a class without a signature
        return False


def _class_of(name: str) -> tuple[Any, dict[str, Any]]:
    path, options = BASELINES.get(name, (name, {}))
    module, _, attribute = path.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute), options
    except (ImportError, AttributeError) as error:
        raise InvalidValueError(f"baseline {name}: {error}") from None
