"""A task: one method on one map, some pairs. It runs in any process and yields records."""

import math
import traceback
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from hybridnav._base.clock import clock
from hybridnav.errors import HybridNavError, InvalidValueError, UnsuitableMapError
from hybridnav.harness.adapters import checked
from hybridnav.harness.baselines import AnyAngleResult, MethodResult
from hybridnav.harness.judging import Judge, status_of, warm_up
from hybridnav.harness.methods import Prepared, prepare
from hybridnav.harness.names import REFERENCE, MethodSpec, own_settings
from hybridnav.harness.records import (
    Record,
    encode_path,
    environment,
    fault_fields,
    pair_id,
    preparation_id,
)
from hybridnav.harness.scenes import (
    SAMPLER_VERSION,
    MapSpec,
    Pair,
    Scene,
    map_digest,
    read_map,
    read_scene,
    text_of_costs,
)
from hybridnav.harness.yardstick import NOT_ASKED, TOO_SLOW, Fault
from hybridnav.maps import CellClass


@dataclass(frozen=True)
class Task:
    """The work of one worker: a map, a method, and pairs."""

    map: MapSpec
    map_sha: str
    method: MethodSpec
    pairs: tuple[Pair, ...]

    sample: frozenset[Pair] = frozenset()
    """Those of the pairs whose optima independent code computes too. They are chosen when a run is
    planned: a run that is resumed samples the same ones."""

    attempt: int = 0
    """Number of times that the task was lost before it began."""
    limit_s: float | None = None
    """Seconds that the method may take, for its preparation and all answers; None for any."""

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """Ids of the task's records: of the preparation, then of the pairs."""
        of_pairs = (pair_id(self.map_sha, self.method, pair) for pair in self.pairs)
        return preparation_id(self.map_sha, self.method), *of_pairs

    def run(self) -> Iterator[Record]:
        """Yield the records; see `run_task`."""
        return run_task(self)

    def failed_record(self, index: int, status: str) -> Record:
        """Return the record of a query, or with index 0 of a preparation, whose process was lost or
        too slow."""
        common: Record = {
            "id": self.ids[index],
            "type": "pair" if index else "preparation",
            "map_sha": self.map_sha,
            "map": Path(self.map.path).stem,
            "method": self.method.name,
            "method_sha": self.method.digest,
            "status": status,
            "faults": [],
        }
        if index:
            return common | self.pairs[index - 1].fields
        costs = {"costs": text_of_costs(self.map.costs)} if self.map.costs else {}
        return common | _of_method(self.method) | costs


def run_task(task: Task) -> Iterator[Record]:
    """Prepare the method, answer the pairs, judge the answers.

    `task`: the map, the method, and the pairs. Yields the record of the preparation, then one for
    each pair; failures are records too.
    """
    scene = read_scene(task.map)
    common = {
        "map": scene.grid.name,
        "map_sha": task.map_sha,
        "method": task.method.name,
        "method_sha": task.method.digest,
    }
    head = {"id": task.ids[0], "type": "preparation", **common, **_of_method(task.method)}
    try:
        prepared, judge = _ready(scene, task)
        about = _about(scene, task) | _of_preparation(prepared, judge)
    except Exception as error:  # noqa: BLE001 - a method that cannot be made is a result
        status, why = _of_refusal(error)
        yield {**head, "status": status, **why, **_about(scene, task)}
        why = {"status": status, "error": why["error"], "faults": []}
        for name, pair in zip(task.ids[1:], task.pairs, strict=True):
            yield {**_of_pair(name, pair, common), **why}
        return
    with closing(prepared):
        yield {**head, "status": "ready", **about}
        spent = prepared.pyramid_seconds + prepared.method_seconds
        for done, (name, pair) in enumerate(zip(task.ids[1:], task.pairs, strict=True)):
            if task.limit_s is not None and spent > task.limit_s:
                answer = _too_slow(spent, task.limit_s, f"{done} of {len(task.pairs)} queries")
            else:
                answer = _answer(prepared, judge, pair)
                spent += answer.get("seconds") or 0.0
            yield {**_of_pair(name, pair, common), **answer}


def _too_slow(spent: float, limit_s: float, done: str) -> Record:
    """Return the answer to a query that a method was too slow to be asked."""
    why = f"not asked after {spent:.1f} s for its preparation and {done}, at most {limit_s:g} s"
    return {"status": TOO_SLOW, "error": why, "faults": []}


def _of_refusal(error: Exception) -> tuple[str, Record]:
    """Return status and fields of the preparation of a method that could not be made."""
    reason = {"error": _reason(error)}
    if isinstance(error, UnsuitableMapError):
        return NOT_ASKED, reason
    return "error", {**reason, "traceback": _traceback_of(error)}


def _of_preparation(prepared: Prepared, judge: Judge) -> Record:
    method = prepared.method
    return {
        **({"label": prepared.label} if prepared.label else {}),
        **({"version": str(version)} if (version := getattr(method, "version", "")) else {}),
        **({"settings_text": words} if (words := own_settings(method)) else {}),
        **({"by_costs": True} if prepared.by_costs else {}),
        **_times_of(prepared),
        "n_nodes": int(method.n_nodes),
        "n_edges": int(method.n_edges),
        "memory_bytes": int(method.memory_bytes),
        **({} if method.region_of is None else {"checked": ["regions"]}),
        **fault_fields(Fault("regions", text) for text, _ in judge.region_faults),
        "fault_cells": [cells for _, cells in judge.region_faults],
    }


def _times_of(prepared: Prepared) -> Record:
    """Return the seconds of the preparation, none for recorded answers."""
    if prepared.is_recorded:
        return {}
    return {
        "pyramid_seconds": prepared.pyramid_seconds,
        "method_seconds": prepared.method_seconds,
    }


def _ready(scene: Scene, task: Task) -> tuple[Prepared, Judge]:
    if scene.digest != task.map_sha:
        raise InvalidValueError(f"map {task.map.path} has changed since the run began")
    warm_up(task.method, by_costs=scene.costs is not None)
    prepared = prepare(task.method, scene.grid, scene.costs)
    is_reference = task.method.name == REFERENCE
    judge = Judge(
        scene.grid, prepared, reference=is_reference, costs=scene.costs, sample=task.sample
    )
    return prepared, judge


def _about(scene: Scene, task: Task) -> Record:
    grid = scene.grid
    return {
        **_of_costs(scene, task.map),
        "file": task.map.path,
        "shape": list(grid.shape),
        "resolution_m": grid.resolution_m,
        "origin": [*grid.frame.origin_m, grid.frame.yaw_rad],
        "robot_radius_m": grid.robot_radius_m,
        "corner_cutting": grid.corner_cutting,
        "free_cells": int((grid.classes == CellClass.FREE).sum()),
        "environment": environment(),
    }


def _of_costs(scene: Scene, spec: MapSpec) -> Record:
    """Return the fields that the record of a preparation has in a run with costs."""
    if scene.costs is None:
        return {}
    return {
        "costs": text_of_costs(spec.costs),
        "cost_source": scene.costs.source,
        "grid_sha": map_digest(read_map(replace(spec, costs=()))),
    }


def _of_method(spec: MethodSpec) -> Record:
    """Return the fields that the record of a preparation has of its method, even where the method
    was lost."""
    graph, about = spec.graph, {}
    if graph is not None:
        about = {"name": graph.name, "format": graph.format, "sha256": graph.digest}
        about = {"graph": about | {"clear_edges_only": spec.clear_edges_only}}
    return {
        **about,
        "metric": spec.metric,
        "made_by": spec.made_by,
        **({"label": spec.label} if spec.label else {}),
        **({"source": spec.source, "settings_sha": spec.who} if spec.source else {}),
        **({"settings": spec.settings} if spec.settings else {}),
        "preset": None if spec.preset is None else _plain(spec.preset),
        "pyramid": _plain(spec.pyramid),
    }


def _plain(settings: Record) -> Record:
    """Return settings without infinities, which JSON has no number for."""
    plain: Record = {}
    for key, value in settings.items():
        if isinstance(value, dict):
            plain[key] = _plain(value)
        else:
            plain[key] = None if isinstance(value, float) and math.isinf(value) else value
    return plain


def _reason(error: Exception) -> str:
    """Return one line that describes an error."""
    known = isinstance(error, HybridNavError)
    text = str(error) if known else f"{type(error).__name__}: {error}"
    return " ".join(text.split())[:200]


def _traceback_of(error: Exception) -> str:
    """Return the end of a traceback, without the harness's own frames."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith(_HERE)]
    lines = traceback.format_list(own[-_FRAMES:]) + traceback.format_exception_only(error)
    return "".join(lines)[-_TRACEBACK:]


_HERE = str(Path(__file__).parent)
_FRAMES, _TRACEBACK = 8, 4000
"""Frames and characters of a traceback that a record holds."""


def _of_pair(name: str, pair: Pair, common: Record) -> Record:
    record = {"id": name, "type": "pair", **common, **pair.fields}
    if pair.seed is not None:
        record |= {"seed": pair.seed, "sampler_version": SAMPLER_VERSION}
    if pair.stated_optimum_cells is not None:
        record["stated_optimum_cells"] = pair.stated_optimum_cells
    return record


def _answer(prepared: Prepared, judge: Judge, pair: Pair) -> Record:
    began = clock()
    try:
        tell = prepared.ask(pair.start, pair.goal)
        seconds = None if prepared.is_recorded else clock() - began
        answer = tell()
    except Exception as error:  # noqa: BLE001 - a failing method is a result
        return {
            "status": "error",
            "error": _reason(error),
            "traceback": _traceback_of(error),
            "faults": [],
        }
    try:
        return _judged(answer, judge, pair, seconds)
    except (
        HybridNavError,
        AttributeError,
        IndexError,
        OverflowError,
        TypeError,
        ValueError,
    ) as error:
        # The answer names no cells, regions or arcs of this map.
        reason = _reason(error)
        wrong = Fault("paths", f"no answer to judge: {reason}")
        return {"status": "error", "error": reason, **fault_fields([wrong])}


def _judged(answer: MethodResult, judge: Judge, pair: Pair, seconds: float | None) -> Record:
    length_m, faults, checks = judge.faults(pair, checked(answer))
    known: Record = {}
    costs: Record = {}
    if not faults:
        costs, wrong = judge.cost(answer, length_m)
        faults = [Fault("bounds", text) for text in wrong]
    if not faults:
        known, wrong = judge.oracles(answer, pair, length_m)
        faults = [Fault("bounds", text) for text in wrong]
    return {
        "status": status_of(answer),
        "length_m": length_m,
        "bound": float(answer.bound) if math.isfinite(answer.bound) else None,
        "plan_steps": _plan_steps(answer),
        "plan_optimum_m": None if faults else judge.plan_optimum_m(pair, answer),
        "in_order_m": None if faults else judge.in_order_m(pair, answer),
        "path": None if answer.cells is None else encode_path(answer.cells),
        **({} if answer.any_angle is None else _of_line(answer.any_angle)),
        "expanded": int(answer.expanded),
        "expanded_nodes": int(answer.expanded_nodes),
        "expanded_intervals": int(answer.expanded_intervals),
        "seconds": seconds,
        "stages": {stage: _finite(value) for stage, value in answer.seconds.items()},
        **costs,
        **known,
        **({"checked": checks} if checks else {}),
        **fault_fields(faults),
    }


def _finite(value: float) -> float:
    """Return a number; raise `InvalidValueError` for what JSON has no number for."""
    if not math.isfinite(value):
        raise InvalidValueError(f"seconds of a stage are a finite number, got {value}")
    return float(value)


def _of_line(line: AnyAngleResult) -> Record:
    """Return the fields that the record of an any-angle path has beside those of a path of
    cells."""
    return {
        "metric": "any-angle",
        "lower_bound_m": float(line.lower_bound_m) if math.isfinite(line.lower_bound_m) else None,
        "by_grid": line.by_grid,
        "points": line.points.tolist(),
        **({} if line.headings_rad is None else {"headings_rad": line.headings_rad.tolist()}),
    }


def _plan_steps(answer: MethodResult) -> int | None:
    """Return the steps of the plan in the topological layer, None if there is no plan."""
    if answer.plan_steps is not None:
        return int(answer.plan_steps)
    return None if answer.nodes is None else len(answer.nodes) - 1
