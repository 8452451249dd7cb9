"""Random small maps: what `paper` answers down the levels, against Dijkstra's algorithm of scipy.

Maps of noise, rooms and blobs, with unexplored cells, corners that may be cut, closures, costs, and
changes of the map under a planner; fields, steps, rings and horizons at random, with and without
blocks above small places. On half of the maps the places are versions of an on-line pyramid, which
the planner follows: then it answers as a planner made anew. A path is found if and only if there is
one, is legal, has the cost that it states, and none lies below the optimum; the bound is the
optimum. Exits with 1 at the first answer that is not so, and prints what gives it
again.
"""

import math
import time
from argparse import Namespace
from typing import Any, NamedTuple

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

import hybridnav as hn
from benchmarks.common import SEED, option
from hybridnav.ext.live import OnlinePyramid
from hybridnav.search import descent

OPTIONS = [option("--count", type=int, default=100_000, help="maps (100,000)"), SEED]
PAIRS = 3
"""Pairs of cells that each map is asked for, before and after its change."""
SIDES = ((0, 1, 1.0), (1, 0, 1.0), (1, 1, math.sqrt(2)), (1, -1, math.sqrt(2)))


class Case(NamedTuple):
    """What a planner is asked about."""

    grid: hn.OccupancyGrid
    open: Any
    """bool (rows, cols), the cells that may be entered: by classes and costs."""
    factors: Any
    """float64 (rows, cols), what a metre costs; ones for lengths."""


def random_classes(rng: np.random.Generator) -> Any:
    """Return occupancy of noise, blobs or rooms, NaN where nothing is known."""
    rows, cols = rng.integers(2, 34, 2).tolist()
    kind = rng.integers(3)
    if kind == 0:
        occupied = rng.random((rows, cols)) < rng.uniform(0, 0.45)
    elif kind == 1:
        smooth = ndimage.uniform_filter(rng.random((rows, cols)), int(rng.integers(2, 5)))
        occupied = smooth < np.quantile(smooth, rng.uniform(0.0, 0.45))
    else:
        side = int(rng.integers(3, 9))
        occupied = np.indices((rows, cols))[0] % side == 0
        occupied |= np.indices((rows, cols))[1] % side == 0
        occupied &= rng.random((rows, cols)) < rng.uniform(0.6, 1.0)
    values = occupied.astype(np.float32)
    values[rng.random((rows, cols)) < rng.choice([0.0, 0.0, 0.1, 0.3])] = np.nan
    return values


def optimum(case: Case, is_open: Any, start: tuple[int, int]) -> Any:
    """Return the least cost from a cell to each, cells, infinite without a path."""
    rows, cols = is_open.shape
    flat = np.arange(rows * cols).reshape(rows, cols)
    tails, heads, costs = [], [], []
    for down, right, length in SIDES:
        low, high = max(-right, 0), cols - max(right, 0)
        first = np.s_[: rows - down, low:high]
        last = np.s_[down:, low + right : high + right]
        legal = is_open[first] & is_open[last]
        if down and right and not case.grid.corner_cutting:
            legal &= is_open[down:, low:high] & is_open[: rows - down, low + right : high + right]
        tails.append(flat[first][legal])
        heads.append(flat[last][legal])
        factor = (case.factors[first] + case.factors[last]) / 2
        costs.append(length * factor[legal])
    ends = np.concatenate(tails), np.concatenate(heads)
    graph = sparse.coo_array((np.concatenate(costs), ends), shape=(flat.size,) * 2).tocsr()
    least = csgraph.dijkstra(graph, directed=False, indices=[int(flat[start])])
    return least.reshape(rows, cols)


def illegal(case: Case, cells: Any, is_open: Any) -> str:
    """Return what is illegal about a path of cells, nothing where all is legal."""
    steps = np.diff(cells, axis=0)
    sides = is_open[cells[:-1, 0], cells[1:, 1]] & is_open[cells[1:, 0], cells[:-1, 1]]
    if not is_open[tuple(cells.T)].all():
        return "the path stands on a closed cell"
    if (np.abs(steps).max(axis=1, initial=0) > 1).any() or (steps == 0).all(axis=1).any():
        return "the path jumps"
    return "" if case.grid.corner_cutting or sides.all() else "the path cuts a corner"


def faults(case: Case, result: Any, shut: Any, ends: Any) -> str:
    """Return what is wrong with an answer, nothing where all is right."""
    is_open, per_cell = case.open & ~shut, case.grid.resolution_m
    least_m = float(optimum(case, is_open, tuple(ends[0]))[tuple(ends[1])]) * per_cell
    if not result.solved or math.isinf(least_m):
        is_right = result.solved is math.isfinite(least_m)
        return "" if is_right else f"{result.status}, optimum {least_m}"
    cells = result.path.cells
    if cells[[0, -1]].tolist() != ends.tolist():
        return "the path ends elsewhere"
    if fault := illegal(case, cells, is_open):
        return fault
    factors = case.factors[tuple(cells.T)]
    lengths = np.hypot(*np.diff(cells, axis=0).T)
    cost_m = float((lengths * (factors[:-1] + factors[1:]) / 2).sum()) * per_cell
    bound_m = result.lower_bound
    is_sound = bound_m <= cost_m * (1 + 1e-12) and least_m <= cost_m * (1 + 1e-6)
    is_exact = math.isclose(bound_m, least_m, rel_tol=1e-9, abs_tol=1e-12)
    if is_sound and is_exact and math.isclose(result.cost, cost_m, rel_tol=1e-6, abs_tol=1e-9):
        return ""
    return f"states {result.cost}, bound {bound_m}; the path costs {cost_m}, the optimum {least_m}"


def grid_of(values: Any, *, cutting: bool) -> hn.OccupancyGrid:
    """Return a map of a robot without width."""
    return hn.OccupancyGrid(values, hn.Frame(0.1), robot_radius_m=0, corner_cutting=cutting)


def pyramid_of(grid: hn.OccupancyGrid, rng: np.random.Generator) -> hn.DualGraphPyramid:
    """Return a pyramid with places of a random size."""
    merge_m = float(rng.choice([0.15, 0.3, 0.8, 3.0]))
    return hn.DualGraphPyramid.build(grid, merge_distance_m=merge_m)


def differs(one: hn.PlanResult, other: hn.PlanResult) -> str:
    """Return how two answers differ, nothing where they are equal, points and effort too."""
    told = [
        (
            each.status,
            each.cost,
            each.lower_bound,
            None if each.path is None else each.path.points.tolist(),
            (each.stats.expanded, each.stats.expanded_places, each.stats.corridor_cells),
        )
        for each in (one, other)
    ]
    return "" if told[0] == told[1] else f"{told[0]}, and made anew {told[1]}"


def asked(
    case: Case, planner: hn.HybridPlanner, rng: np.random.Generator, anew: hn.HybridPlanner | None
) -> tuple[int, str]:
    """Ask for some pairs, and return how many were, and the first fault.

    `anew`: a planner that must answer alike; None for none.
    """
    n = 0
    for _ in range(PAIRS):
        shut = rng.random(case.open.shape) < rng.choice([0.0, 0.0, 0.05, 0.2])
        left = np.argwhere(case.open & ~shut)
        if not len(left):
            continue
        ends = rng.choice(left, 2)
        closed = {"cells": np.argwhere(shut & case.open)} if shut.any() else None
        result = planner.plan(*case.grid.frame.points_of(ends), blocked=closed)
        n += 1
        fault = faults(case, result, shut, ends)
        if not fault and anew is not None:
            again = anew.plan(*case.grid.frame.points_of(ends), blocked=closed)
            fault = differs(result, again)
        if fault:
            return n, fault
    return n, ""


def checked(seed: int) -> tuple[int, str]:
    """Check one map; return its plans and its fault."""
    rng = np.random.default_rng(seed)
    values, cutting = random_classes(rng), bool(rng.random() < 0.2)
    pyramid = pyramid_of(grid_of(values, cutting=cutting), rng)
    version = OnlinePyramid.of(pyramid) if rng.random() < 0.5 else None
    topology = hn.TopologicalMap(version or pyramid)
    unexplored, by_costs = bool(rng.random() < 0.3), bool(rng.random() < 0.2)
    descent.MANY_PLACES = int(rng.choice([0, 1000]))
    descent.MOST_AT_TOP, descent.MOST_BLOCKS = rng.choice([2, 10, 1000], 2).tolist()
    keys = {
        "allow_unexplored": str(unexplored).lower(),
        "field_cells": rng.choice([1, 4, 16, 128]),
        "step": rng.choice([1.0, 2.0, 8.0]),
        "ring": rng.integers(3),
        "horizon_cells": rng.choice([0, 1, 3, 8, 128]),
        "levels": rng.choice(["descent", "descent", "places"]),
    }
    preset = hn.load_preset("paper", overrides=[f"planner.{k}={v}" for k, v in keys.items()])
    shape = values.shape
    factors = rng.integers(4, 13, shape) / 4 if by_costs else np.ones(shape)
    always = rng.random(shape) < 0.1 if by_costs else np.zeros(shape, np.bool_)
    costs = hn.CostLayer(factors, closed=always) if by_costs else None
    planner = hn.HybridPlanner(topology, preset=preset, costs=costs)
    total, anew = 0, None
    for turn in range(2 if version is None else 5):
        if turn:
            low, high = np.sort(rng.integers(0, np.array(shape) + 1, (2, 2)), axis=0)
            values = values.copy()
            values[low[0] : high[0], low[1] : high[1]] = rng.choice([0.0, 1.0])
            grid = grid_of(values, cutting=cutting)
            if version is None:
                planner.update(topology=hn.TopologicalMap(pyramid_of(grid, rng)))
            else:
                version = version.update(grid).version
                planner.update(grid=version)
                now = hn.TopologicalMap(version.pyramid)
                anew = hn.HybridPlanner(now, preset=preset, costs=costs)
        grid = planner.grid
        case = Case(grid, grid.enterable(allow_unexplored=unexplored) & ~always, factors)
        n, fault = asked(case, planner, rng, anew)
        total += n
        if fault:
            return total, f"{fault}; costs {by_costs}, cutting {cutting}, {keys}"
    return total, ""


def main(given: Namespace) -> None:
    """Check all maps."""
    began, plans = time.perf_counter(), 0
    for number in range(given.count):
        seed = given.seed + number
        n, fault = checked(seed)
        plans += n
        if fault:
            print(f"map {seed}: {fault}; again by --seed {seed} --count 1")
            raise SystemExit(1)
        if (number + 1) % 5_000 == 0:
            print(f"{number + 1:,} maps, {plans:,} plans", flush=True)
    took = time.perf_counter() - began
    print(f"{given.count:,} maps, {plans:,} plans, 0 faults, {took:.0f} s")
