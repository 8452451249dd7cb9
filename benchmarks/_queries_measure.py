"""One map of the table of queries: planners prepared, queries interleaved, answers checked."""

from __future__ import annotations

import gc
import resource
import time
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

import hybridnav as hn
from hybridnav.config import load_preset
from hybridnav.grid.worlds import figure1_world, office_world
from hybridnav.harness.methods import _nbytes
from hybridnav.harness.pairs import sample_pairs
from hybridnav.harness.records import environment
from hybridnav.harness.yardstick import AnyAngleOptimum
from hybridnav.metrics import judge_path, segment_faults

if TYPE_CHECKING:
    from pathlib import Path

    from hybridnav._typing import FloatArray
    from hybridnav.harness.pairs import Pair

Record = dict[str, Any]

YARDSTICK = "grid-astar"
RADIUS_M = 0.25
ROS_MERGE_DISTANCE_M, MOVINGAI_MERGE_DISTANCE_M = 4.0, 40.0
OPEN_SHARE = 0.1
"""A floor is open where more of its free cells than this lie further from all that is not free
than the merge distance."""
N_WARM = 3
"""Pairs that every planner answers before the clock runs."""
SLACK = 1e-9
"""Relative difference of two lengths that is rounding."""


@dataclass(frozen=True)
class Method:
    """A row of the table: a preset, what is set otherwise in it, and what it promises."""

    preset: str
    overrides: tuple[str, ...] = ()
    metric: str = "octile"
    epsilon: float | None = None


METHODS = {
    YARDSTICK: Method("grid-astar"),
    "paper": Method("paper"),
    "fast": Method("fast"),
    "balanced": Method("balanced"),
    "certified, epsilon 0.01": Method("certified", ("planner.epsilon=0.01",), epsilon=0.01),
    "certified, epsilon 0": Method("certified", ("planner.epsilon=0",), epsilon=0.0),
    "balanced, any-angle": Method("balanced", ("planner.smooth=line-of-sight",), "any-angle"),
}


def read(path: Path) -> hn.OccupancyGrid:
    """The grid of a map file: ROS maps inflated, MovingAI maps for a point robot."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hn.MapWarning)
        return hn.load_map(path, robot_radius_m=0.0 if path.suffix == ".map" else RADIUS_M)


def warm_up() -> None:
    """Load every kernel, so that no preparation includes it."""
    for world in (figure1_world(), office_world()):
        grid = world.grid(robot_radius_m=RADIUS_M)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        pairs = sample_pairs(grid, N_WARM, seed=0)
        for method in METHODS.values():
            planner = hn.HybridPlanner(topology, preset=_preset(method))
            for pair in pairs:
                planner.plan(*_ends(grid, pair))


def measure(path: Path, grid: hn.OccupancyGrid, *, pairs: int, seed: int) -> Record:
    """Prepare all methods on a map and ask them the same queries.

    Parameters
    ----------
    path
        The map's file, for its kind.
    grid
        The map.
    pairs, seed
        As `sample_pairs` takes them.

    Returns
    -------
    dict
        Plain values: the map, its pairs that have a path, and under `methods` for each method
        arrays over these pairs (`us`, `search_us`, `cost_m`, `bound_m`, `expanded`), or why it
        could not be prepared. `violations` has one line for each answer that breaks a promise.
        `core_share` is the part of the time that the process had a core to itself: well below
        1 the machine was busy, and times are too long.

    Raises
    ------
    InvalidValueError
        When the map has no pair of cells to ask for.
    """
    is_movingai = path.suffix == ".map"
    merge_distance_m = MOVINGAI_MERGE_DISTANCE_M if is_movingai else ROS_MERGE_DISTANCE_M
    queries = sample_pairs(grid, pairs, seed=seed)
    if not queries:
        raise hn.InvalidValueError(f"map {grid.name} has no two free cells that are joined")
    began = time.perf_counter()
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m))
    places_seconds = time.perf_counter() - began
    open_floor = _is_open(grid, merge_distance_m)
    record: Record = {
        "kind": "MovingAI" if is_movingai else "open floor" if open_floor else "building",
        "cells": int(grid.classes.size),
        "traversable_cells": int((grid.classes == hn.CellClass.FREE).sum()),
        "resolution_m": grid.resolution_m,
        "places": topology.n_places,
        "places_seconds": places_seconds,
        "places_bytes": _nbytes(topology, set()),
        "environment": environment(),
        "methods": {},
    }
    planners = _prepare(topology, record["methods"], _ends(grid, queries[0])[0])
    _ask(planners, grid, queries, record, seed)
    record["peak_gb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    planners.clear()
    record["any_angle_m"] = _any_angle_optima(grid, record)
    record["violations"] += _broken_promises(record)
    return record


def _preset(method: Method) -> hn.Preset:
    return load_preset(method.preset, overrides=method.overrides)


def _ends(grid: hn.OccupancyGrid, pair: Pair) -> FloatArray:
    return grid.frame.points_of(np.array([pair.start, pair.goal]))


def _is_open(grid: hn.OccupancyGrid, distance_m: float) -> bool:
    free = np.pad(grid.classes == hn.CellClass.FREE, 1)
    far = ndimage.distance_transform_edt(free)[free] > distance_m / grid.resolution_m
    return bool(far.mean() > OPEN_SHARE)


def _prepare(
    topology: hn.TopologicalMap, notes: dict[str, Record], point: FloatArray
) -> dict[str, hn.HybridPlanner]:
    """Planners by name; what each adds to the topological map, in seconds and bytes, is noted."""
    planners = {}
    for name, method in METHODS.items():
        counted: set[int] = set()
        _nbytes(topology, counted)
        gc.collect()
        began, cpu = time.perf_counter(), time.process_time()
        try:
            planner = hn.HybridPlanner(topology, preset=_preset(method))
        except hn.InvalidValueError as error:
            notes[name] = {"error": str(error)}
            continue
        planner.plan(point, point)  # makes what is made on demand
        notes[name] = {
            "seconds": time.perf_counter() - began,
            "cpu_seconds": time.process_time() - cpu,
            "bytes": _nbytes(planner, counted),
        }
        planners[name] = planner
    return planners


def _ask(
    planners: dict[str, hn.HybridPlanner],
    grid: hn.OccupancyGrid,
    queries: list[Pair],
    record: Record,
    seed: int,
) -> None:
    """Ask pair by pair, the methods in another order each time, and note what they answer."""
    solved: list[Pair] = []
    faults: list[str] = []
    answers: dict[str, list[tuple[float, ...]]] = {name: [] for name in planners}
    agreed = dict.fromkeys(planners, 0)
    rng = np.random.default_rng(seed)
    for pair in queries[:N_WARM]:
        for planner in planners.values():
            planner.plan(*_ends(grid, pair))
    gc.disable()  # as timeit does
    wall, cpu = time.perf_counter(), time.process_time()
    for pair in queries:
        ends = _ends(grid, pair)
        # Results wait until all have answered: to judge one would empty the caches for the next.
        results = {}
        for name in rng.permutation(list(planners)).tolist():
            began = time.perf_counter()
            result = planners[name].plan(*ends)
            results[name] = result, 1e6 * (time.perf_counter() - began)
        expected = results[YARDSTICK][0].status
        for name, (result, _) in results.items():
            agreed[name] += result.status == expected
            faults += [f"{name}: {_at(pair)}: {text}" for text in _faults(grid, pair, result)]
            if result.status != expected:
                faults.append(f"{name}: {_at(pair)}: {result.status}, not {expected}")
        if all(result.solved for result, _ in results.values()):
            solved.append(pair)
            for name, (result, us) in results.items():
                answers[name].append(_figures_of(result, us))
    record["core_share"] = (time.process_time() - cpu) / (time.perf_counter() - wall)
    gc.enable()
    record["asked"] = len(queries)
    record["starts"] = [pair.start for pair in solved]
    record["goals"] = [pair.goal for pair in solved]
    record["violations"] = faults
    columns = ("us", "search_us", "cost_m", "bound_m", "expanded")
    for name, rows in answers.items():
        by_column = np.array(rows, dtype=np.float64).reshape(-1, len(columns)).T.tolist()
        record["methods"][name] |= dict(zip(columns, by_column, strict=True))
        record["methods"][name]["agreed"] = agreed[name]


def _figures_of(result: hn.PlanResult, us: float) -> tuple[float, ...]:
    stats = result.stats
    search_us = 1e6 * sum(stats.seconds.values())
    expanded = stats.expanded + stats.expanded_gates
    return us, search_us, result.cost, result.lower_bound, expanded


def _at(pair: Pair) -> str:
    return f"{pair.start} to {pair.goal}"


def _faults(grid: hn.OccupancyGrid, pair: Pair, result: hn.PlanResult) -> list[str]:
    """What is wrong with a path by code that the planners do not share."""
    path = result.path
    if path is None:
        return []
    verdict = judge_path(grid, path.cells, start=pair.start, goal=pair.goal)
    faults = list(verdict.faults)
    if result.metric == "any-angle":
        faults += segment_faults(grid, path.points)
        if path.length_m > verdict.length_m * (1 + SLACK):
            faults.append(f"{path.length_m!r} m, its cells {verdict.length_m!r} m")
    elif abs(path.length_m - verdict.length_m) > SLACK * verdict.length_m:
        faults.append(f"states {path.length_m!r} m, is {verdict.length_m!r} m long")
    return faults


def _any_angle_optima(grid: hn.OccupancyGrid, record: Record) -> list[float]:
    """Any-angle optima in metres, in the order of the pairs."""
    optimum = AnyAngleOptimum(grid)
    ends = zip(record["starts"], record["goals"], strict=True)
    return [optimum.length_m(start, goal) for start, goal in ends]


def _broken_promises(record: Record) -> list[str]:
    """Bounds above the optimum, costs below it, gaps above epsilon."""
    broken = []
    for name, method in METHODS.items():
        answers = record["methods"][name]
        best = optima_m(record, method)
        if "error" in answers or best is None:
            continue
        cost, bound = (np.array(answers[key]) for key in ("cost_m", "bound_m"))
        checks = [
            ("lower bound above the optimum", bound > best * (1 + SLACK)),
            ("cost below the optimum", cost < best * (1 - SLACK)),
        ]
        if method.epsilon is not None:
            limit = (1 + method.epsilon) * (1 + SLACK)
            checks.append(("gap above epsilon", cost > bound * limit))
            checks.append(("loss above epsilon", cost > best * limit))
        for text, wrong in checks:
            for i in np.flatnonzero(wrong):
                ends = f"{record['starts'][i]} to {record['goals'][i]}"
                figures = (
                    f"cost {cost[i]:.17g} m, bound {bound[i]:.17g} m, optimum {best[i]:.17g} m"
                )
                broken.append(f"{name}: {ends}: {text}: {figures}")
    return broken


def optima_m(record: Record, method: Method) -> FloatArray | None:
    """Optima of a method's metric in metres, in the order of the pairs; None where not known."""
    octile = method.metric == "octile"
    known = record["methods"][YARDSTICK]["cost_m"] if octile else record["any_angle_m"]
    return None if known is None else np.array(known, dtype=np.float64)
