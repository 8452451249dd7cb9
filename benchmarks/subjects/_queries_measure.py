"""One map of the table of queries: planners prepared, queries interleaved, answers checked."""

from __future__ import annotations

import gc
import math
import os
import resource
import time
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

import hybridnav as hn
from benchmarks.common import RADIUS_M
from benchmarks.worlds import figure1_world, office_world
from hybridnav.harness.adapters import _nbytes
from hybridnav.harness.judges import judge_line, judge_path
from hybridnav.harness.outcome import loss_of
from hybridnav.harness.scenes import sample_pairs
from hybridnav.harness.yardstick import AnyAngleOptimum
from hybridnav.planning import load_preset

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from hybridnav._base.typing import FloatArray
    from hybridnav.harness.scenes import Pair
    from hybridnav.harness.tables import Row

YARDSTICK = "grid-astar"
ROS_MERGE_DISTANCE_M, MOVINGAI_MERGE_DISTANCE_M = 4.0, 40.0
OPEN_SHARE = 0.1
"""A floor is open where more of its free cells than this lie further from all that is not free
than the merge distance."""
N_WARM = 3
"""Pairs that every planner answers before the clock runs."""
SLACK = 1e-9
"""Relative difference of two lengths that is rounding."""

Presets = dict[str, hn.Preset]


def presets_of(names: Iterable[str]) -> Presets:
    """Presets by what they were called: a name, and overrides behind colons, such as
    `octile:planner.smooth=line-of-sight`; that of grid A* comes first."""
    found = {}
    for text in dict.fromkeys((YARDSTICK, *names)):
        name, *overrides = text.split(":")
        found[text] = load_preset(name, overrides=overrides)
    return found


def warm_up(presets: Presets) -> None:
    """Load every kernel, so that no preparation includes it."""
    for world in (figure1_world(), office_world()):
        grid = world.grid(robot_radius_m=RADIUS_M)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        AnyAngleOptimum(grid)
        pairs = sample_pairs(grid, N_WARM, seed=0)
        for preset in presets.values():
            planner = hn.HybridPlanner(topology, preset=preset)
            for pair in pairs:
                planner.plan(*_endpoints(grid, pair))


def measure(
    path: Path, grid: hn.OccupancyGrid, presets: Presets, asked: Mapping[str, int]
) -> tuple[list[Row], list[str]]:
    """Prepare all presets on a map and ask them the same queries.

    Parameters
    ----------
    path
        The map's file, for its kind.
    grid
        The map.
    presets
        Those of `presets_of`.
    asked
        How many pairs, and their seed.

    Returns
    -------
    tuple
        A row of figures for each preset, times over the pairs that all solved; and a line for each
        answer that breaks a promise. `core %` is the part of the time that the process had a core
        to itself: well below 100 the machine was busy, and times are too long.

    Raises
    ------
    InvalidValueError
        When the map has no pair of cells to ask for.
    """
    queries = sample_pairs(grid, asked["asked"], seed=asked["seed"])
    if not queries:
        raise hn.errors.InvalidValueError(f"map {grid.name} has no two free cells that are joined")
    is_movingai = path.suffix == ".map"
    distance_m = MOVINGAI_MERGE_DISTANCE_M if is_movingai else ROS_MERGE_DISTANCE_M
    load = os.getloadavg()[0]
    began = time.perf_counter()
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m))
    about: Row = {
        "kind": f"MovingAI {path.parent.name}" if is_movingai else _kind(path, grid),
        "free cells": int((grid.classes == hn.CellClass.FREE).sum()),
        "load": load,
        "places s": time.perf_counter() - began,
    }
    planners, rows = _prepare(topology, presets, _endpoints(grid, queries[-1]))
    solved, answers, faults, core = _ask(planners, grid, queries, asked["seed"])
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    about |= {"core %": 100 * core, "peak GB": peak_gb}
    planners.clear()
    optimum = AnyAngleOptimum(grid)
    any_angle_m = np.array([optimum.length_m(pair.start, pair.goal) for pair in solved])
    octile_m = answers[YARDSTICK]["cost_m"]
    for name in rows:
        rows[name] |= about
    for name in answers:
        is_line = bool(answers[name]["is_line"].any())
        best_m = any_angle_m if is_line else octile_m
        epsilon = getattr(presets[name].planner, "epsilon", None)
        faults[name] += _broken(solved, answers[name], best_m, epsilon)
        rows[name] |= {
            "metric": "any-angle" if is_line else "octile",
            **_figures(answers[name], answers[YARDSTICK]["us"], best_m),
            **_losses(answers[name]["cost_m"], any_angle_m, None if is_line else octile_m),
            **_per_cell(rows[name]),
            "broken": len(faults[name]),
        }
    return list(rows.values()), [f"{name}: {line}" for name in faults for line in faults[name]]


def _endpoints(grid: hn.OccupancyGrid, pair: Pair) -> FloatArray:
    return grid.frame.points_of(np.array([pair.start, pair.goal]))


def _kind(path: Path, grid: hn.OccupancyGrid) -> str:
    """A raw scan, an open floor, or a building."""
    if "radish_grids" in path.parts:
        return "raw SLAM"
    free = np.pad(grid.classes == hn.CellClass.FREE, 1)
    far = ndimage.distance_transform_edt(free)[free] > ROS_MERGE_DISTANCE_M / grid.resolution_m
    return "open floor" if far.mean() > OPEN_SHARE else "building"


def _prepare(
    topology: hn.TopologicalMap, presets: Presets, endpoints: FloatArray
) -> tuple[dict[str, hn.HybridPlanner], dict[str, Row]]:
    """Planners by name, and rows that hold what each adds to the topological map: seconds up to
    the first answer, and bytes."""
    planners, rows = {}, {}
    for name, preset in presets.items():
        counted: set[int] = set()
        _nbytes(topology, counted)
        gc.collect()
        row: Row = {"preset": name}
        rows[name] = row
        began = time.perf_counter()
        try:
            planner = hn.HybridPlanner(topology, preset=preset)
            planner.plan(*endpoints)  # makes what is made on demand
        except hn.errors.InvalidValueError as error:
            row["error"] = str(error)
            continue
        row["preparation s"] = time.perf_counter() - began
        row["bytes"] = _nbytes(planner, counted)
        planners[name] = planner
    return planners, rows


def _ask(
    planners: dict[str, hn.HybridPlanner], grid: hn.OccupancyGrid, queries: list[Pair], seed: int
) -> tuple[list[Pair], dict[str, dict[str, FloatArray]], dict[str, list[str]], float]:
    """Ask pair by pair, the planners in another order each time: the pairs that all solved, what
    they answered, what is wrong with it, and the share of a core."""
    solved: list[Pair] = []
    faults: dict[str, list[str]] = {name: [] for name in planners}
    answers: dict[str, list[tuple[float, ...]]] = {name: [] for name in planners}
    rng = np.random.default_rng(seed)
    for pair in queries[:N_WARM]:
        for planner in planners.values():
            planner.plan(*_endpoints(grid, pair))
    gc.disable()  # as timeit does
    wall, cpu = time.perf_counter(), time.process_time()
    for pair in queries:
        endpoints = _endpoints(grid, pair)
        # Results wait until all have answered: to judge one would empty the caches for the next.
        results = {}
        for name in rng.permutation(list(planners)).tolist():
            began = time.perf_counter()
            result = planners[name].plan(*endpoints)
            results[name] = result, 1e6 * (time.perf_counter() - began)
        expected = results[YARDSTICK][0].status
        for name, (result, _) in results.items():
            wrong = _faults(grid, pair, result)
            wrong += [] if result.status == expected else [f"{result.status}, not {expected}"]
            faults[name] += [f"{pair.start} to {pair.goal}: {text}" for text in wrong]
        if all(result.solved for result, _ in results.values()):
            solved.append(pair)
            for name, (result, us) in results.items():
                answers[name].append(_columns_of(result, us))
    core = (time.process_time() - cpu) / (time.perf_counter() - wall)
    gc.enable()
    columns = ("us", "cost_m", "bound_m", "expanded", "is_line")
    arrays = {
        name: dict(zip(columns, np.array(rows, np.float64).reshape(-1, 5).T, strict=True))
        for name, rows in answers.items()
    }
    return solved, arrays, faults, core


def _columns_of(result: hn.PlanResult, us: float) -> tuple[float, ...]:
    stats = result.stats
    return us, result.cost, result.lower_bound, stats.expanded, result.metric == "any-angle"


def _faults(grid: hn.OccupancyGrid, pair: Pair, result: hn.PlanResult) -> list[str]:
    """What is wrong with a path by code that the planners do not share."""
    path = result.path
    if path is None:
        return []
    if result.metric == "any-angle":
        verdict = judge_line(grid, path.points, start=pair.start, goal=pair.goal)
    else:
        verdict = judge_path(grid, path.cells, start=pair.start, goal=pair.goal)
    faults = list(verdict.faults)
    if abs(path.length_m - verdict.length_m) > SLACK * verdict.length_m:
        faults.append(f"states {path.length_m!r} m, is {verdict.length_m!r} m long")
    return faults


def _figures(answers: Mapping[str, FloatArray], yard_us: FloatArray, best_m: FloatArray) -> Row:
    """Times in milliseconds, beside A*'s on the same pairs; what was optimal, what was proved."""
    ms, cost, bound = 1e-3 * answers["us"], answers["cost_m"], answers["bound_m"]
    gaps = 100 * (cost / bound - 1)
    return {
        "pairs": len(ms),
        "ms median": _quantile(ms, 0.5),
        "ms mean": _mean(ms),
        "ms p95": _quantile(ms, 0.95),
        "ms max": _quantile(ms, 1.0),
        "times A*": _quantile(yard_us / answers["us"], 0.5),
        "optimal %": 100 * _mean(np.where(cost <= best_m * (1 + SLACK), 1.0, 0.0)),
        "gap mean %": _mean(gaps),
        "gap p95 %": _quantile(gaps, 0.95),
        "expanded": _mean(answers["expanded"]),
    }


def _losses(cost_m: FloatArray, any_angle_m: FloatArray, octile_m: FloatArray | None) -> Row:
    """Losses over both optima; paths at any angle have none over the octile one."""
    row: Row = {}
    for words, best in (("any-angle", any_angle_m), ("octile", octile_m)):
        percent = np.empty(0) if best is None else 100 * loss_of(cost_m, best)
        row[f"{words} loss %"] = _mean(percent)
        row[f"{words} loss max %"] = _quantile(percent, 1.0)
    return row


def _per_cell(row: Row) -> Row:
    cells = float(row["free cells"])
    return {
        "us/cell": 1e6 * float(row["preparation s"]) / cells,
        "B/cell": float(row.pop("bytes")) / cells,
    }


def _mean(values: FloatArray) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _quantile(values: FloatArray, share: float) -> float:
    return float(np.quantile(values, share)) if len(values) else math.nan


def _broken(
    pairs: list[Pair], answers: Mapping[str, FloatArray], best: FloatArray, epsilon: float | None
) -> list[str]:
    """Bounds above the optimum, costs below it, gaps above epsilon."""
    cost, bound = answers["cost_m"], answers["bound_m"]
    checks = [
        ("lower bound above the optimum", bound > best * (1 + SLACK)),
        ("cost below the optimum", cost < best * (1 - SLACK)),
    ]
    if epsilon is not None and not answers["is_line"].any():
        limit = (1 + epsilon) * (1 + SLACK)
        checks.append(("gap above epsilon", cost > bound * limit))
    return [
        f"{pairs[i].start} to {pairs[i].goal}: {text}: cost {cost[i]:.17g} m, "
        f"bound {bound[i]:.17g} m, optimum {best[i]:.17g} m"
        for text, wrong in checks
        for i in np.flatnonzero(wrong)
    ]
