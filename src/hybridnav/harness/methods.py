"""All methods of the harness by name: presets of our planner, and baselines."""

import inspect
import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from hybridnav._base.clock import clock
from hybridnav._base.extension import extension
from hybridnav.errors import InvalidValueError
from hybridnav.harness.adapters import FoundMethod, HybridMethod, close_method
from hybridnav.harness.baselines import MethodResult, Solver
from hybridnav.harness.names import (
    BASELINES,
    LINE_OF_SIGHT,
    ON_PLACES,
    RECORDED,
    MethodSpec,
    NamedMethod,
    baseline_name,
    class_of,
    own_name,
    source_hash,
)
from hybridnav.harness.recorded_method import content_of
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.planning import Preset, load_preset
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.topology import TopologicalMap


def preset_spec(
    source: str | Preset,
    *,
    merge_distance_m: float | None = None,
    seed: int | None = None,
    by_costs: bool = False,
) -> MethodSpec:
    """Return the method of a preset, with its merge distance and seed where they are given.

    In a run with costs those take the place of the preset's own.

    Raises `InvalidValueError` when the preset plans in a metric in which the harness has nothing to
    compare with. Raises `OmplError` when it needs OMPL, which is not installed.
    """
    preset = load_preset(source)
    _check_metric(preset, by_costs=by_costs)
    pyramid = preset.pyramid.model_dump(exclude={"robot_radius_m"})
    smoothed = preset.planner.finish == LINE_OF_SIGHT
    return MethodSpec(
        f"{preset.name}+{LINE_OF_SIGHT}" if smoothed else preset.name,
        preset.model_dump(exclude={"description": True, "planner": {"costs"}}),
        pyramid | _given(merge_distance_m, seed),
    )


def _check_metric(preset: Preset, *, by_costs: bool) -> None:
    ompl, costs = preset.planner.sampling, preset.planner.clearance
    needs_costs = preset.planner.finish == "arcs" or costs is not None
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
    from hybridnav.refine.ompl import require_ompl  # noqa: PLC0415 - workers need it not

    require_ompl()


def baseline_spec(
    name: str,
    *,
    merge_distance_m: float | None = None,
    seed: int | None = None,
    named: NamedMethod | None = None,
) -> MethodSpec:
    """Return the method of a baseline, or of a class written `module:class`.

    Names are those of `BASELINES`, or as in the literature, such as "HPA*"; `named` adds a name and
    settings.

    Raises `InvalidValueError` when there is none of that name, or its class cannot be imported.
    """
    if ":" not in name:
        name = baseline_name(name, BASELINES)
    made_of = class_of(BASELINES.get(name, (name, {}))[0])
    spec = MethodSpec(name, None)
    if name not in BASELINES:
        spec = replace(spec, source=source_hash(name), label=own_name(made_of) or name)
    if named is not None and (named.name or named.settings):
        spec = replace(
            spec, name=named.name or name, factory=name, settings=named.settings, label=""
        )
    if name not in ON_PLACES:
        return spec
    pyramid = Preset().pyramid.model_dump(exclude={"robot_radius_m"})
    return replace(spec, pyramid=pyramid | _given(merge_distance_m, seed))


def named_spec(
    method: NamedMethod, *, merge_distance_m: float | None, by_costs: bool, clear_edges_only: bool
) -> MethodSpec:
    """Return the method that a user named.

    Raises `InvalidValueError` when there is no such baseline or class, or settings do not go with
    the source.
    """
    if method.kind in {"baseline", "class"}:
        return baseline_spec(method.source, merge_distance_m=merge_distance_m, named=method)
    if method.kind == "recorded":
        return recorded_spec(method)
    if method.kind == "preset":
        overrides = [f"{key}={json.dumps(value)}" for key, value in method.settings.items()]
        preset = load_preset(method.source, overrides=overrides)
        spec = preset_spec(preset, merge_distance_m=merge_distance_m, by_costs=by_costs)
    else:
        if method.settings:
            raise InvalidValueError(f"a graph has no settings, got {sorted(method.settings)}")
        spec = graph_spec(method.source, clear_edges_only=clear_edges_only)
    return replace(spec, name=method.name or spec.name)


def recorded_spec(method: NamedMethod) -> MethodSpec:
    """Return the method of the paths that a folder has; see `RecordedMethod`."""
    settings = recorded_settings(method)
    name = method.name or f"recorded {Path(method.source).stem}"
    source = content_of(settings["folder"])
    return MethodSpec(name, None, factory=RECORDED, settings=settings, source=source)


def recorded_settings(method: NamedMethod) -> dict[str, Any]:
    """Return the keyword arguments of `RecordedMethod`."""
    if unknown := sorted(method.settings.keys() - {"unit", "frame"}):
        raise InvalidValueError(f"recorded paths have the settings unit and frame, got {unknown}")
    return {"folder": str(Path(method.source).resolve()), **method.settings}


def graph_spec(given: Any, *, clear_edges_only: bool = False) -> MethodSpec:
    """Return the method that follows a graph, or that of a file; see `graphs.GraphMethod`."""
    graph = extension("methods", "graph").checked_graph(given)
    name = f"graph {graph.name}" + (" (clear edges)" if clear_edges_only else "")
    return MethodSpec(name, None, graph=graph, clear_edges_only=clear_edges_only)


def _given(merge_distance_m: float | None, seed: int | None) -> dict[str, Any]:
    settings = {"merge_distance_m": merge_distance_m, "seed": seed}
    return {key: value for key, value in settings.items() if value is not None}


@dataclass
class Prepared:
    """A method ready for one map, and the effort of its preparation."""

    method: Solver
    topology: TopologicalMap | None
    """The places that it plans on, None for methods that need none."""
    pyramid_seconds: float
    method_seconds: float
    by_costs: bool = False
    """Whether it plans by the costs of the run."""
    label: str = ""
    """Name that a class of others gives itself, empty for other methods."""
    is_recorded: bool = False
    """Whether its answers were recorded: times would be those of looking them up."""

    def ask(self, start: tuple[int, int], goal: tuple[int, int]) -> Callable[[], MethodResult]:
        """Ask the method for a path; return what tells the answer whole.

        A process that the method forked goes no further than this.
        """
        own = os.getpid()
        try:
            if ask := getattr(self.method, "ask", None):
                return cast("Callable[[], MethodResult]", ask(start, goal))
            answer = self.method.solve(start, goal)
            return lambda: answer
        finally:
            _end_fork_of(own)

    def close(self) -> None:
        """End the processes of the method, which answers no more."""
        close_method(self.method)


def prepare(spec: MethodSpec, grid: OccupancyGrid, costs: CostLayer | None = None) -> Prepared:
    """Build a method for a map, with the costs of its cells if it can plan by them."""
    began = clock()
    topology = None
    if spec.pyramid:
        topology = TopologicalMap(DualGraphPyramid.build(grid, **spec.pyramid))
    built = clock()
    method: Solver
    if spec.preset is not None and topology is not None:
        preset = Preset.model_validate(spec.preset)
        if preset.planner.refusal_of_costs():
            costs = None
        method = HybridMethod(topology, preset, costs)
    elif spec.graph is not None:
        costs = None
        method = extension("methods", "graph").GraphMethod(
            grid, spec.graph, clear_edges_only=spec.clear_edges_only
        )
    else:
        method, costs = _of_class(spec, grid if topology is None else topology, costs)
    by_costs = costs is not None
    seconds = built - began, clock() - built
    label = spec.label and (own_name(method) or spec.label)
    return Prepared(method, topology, *seconds, by_costs, label, spec.is_recorded)


def _of_class(
    spec: MethodSpec, given: OccupancyGrid | TopologicalMap, costs: CostLayer | None
) -> tuple[Solver, CostLayer | None]:
    """Return the method of a baseline or a class of others, and the costs that it plans by."""
    path, options = BASELINES.get(spec.made_by, (spec.made_by, {}))
    made_of = class_of(path)
    options = options | spec.settings
    if not _takes(made_of, "costs"):
        costs = None
    if costs is not None:
        options = options | {"costs": costs}
    if spec.factory and _takes(made_of, "name"):
        options = {"name": spec.name} | options
    own = os.getpid()
    try:
        made: Any = made_of(given, **options)
    finally:
        _end_fork_of(own)
    is_search = not hasattr(made, "solve") and hasattr(made, "find")
    grid = given.grid if isinstance(given, TopologicalMap) else given
    return FoundMethod(made, grid) if is_search else made, costs


def _end_fork_of(own: int) -> None:
    """End this process if foreign code forked it and let it run on: it would work on as a second
    worker and send the same records. No context manager: that would be a part of short times."""
    if os.getpid() != own:
        os._exit(0)


def _takes(made_of: Any, parameter: str) -> bool:
    """Return whether a class is made with a keyword argument of a name."""
    try:
        return parameter in inspect.signature(made_of).parameters
    except (TypeError, ValueError):  # a class without a signature
        return False
