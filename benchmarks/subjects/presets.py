"""What presets are for: length, cost, distance from walls and time of their paths on one map.

All plan between the same centres of free cells. Costs are those of `CostLayer.clearance` along each
path, whatever it was planned by; clearance is the distance to the nearest occupied cell, on average
along the paths, every 5 cm. Times are of one process, planners prepared.
"""

import time
from argparse import Namespace
from pathlib import Path

import numpy as np

import hybridnav as hn
from benchmarks.common import OFFICE, read
from benchmarks.options import option
from hybridnav._base.typing import FloatArray
from hybridnav.harness.tables import Row, to_markdown
from hybridnav.maps.clearance import clearance_cells
from hybridnav.maps.costs import cost_along

BY_COSTS = "grid-astar, costs"
PRESETS = ("shortest", "octile", "grid-astar", "paper", BY_COSTS, "robot")
_LEAST_M = 2.0
"""Shortest way between two points that are drawn."""


def pairs_on(topology: hn.TopologicalMap, count: int) -> FloatArray:
    """Draw pairs of points that a path joins, float64 (n, 2, 2)."""
    grid = topology.grid
    free = np.argwhere(grid.enterable())
    cells = free[np.random.default_rng(0).integers(len(free), size=(3 * count, 2))]
    points = grid.frame.points_of(cells.reshape(-1, 2)).reshape(-1, 2, 2)
    cost = hn.HybridPlanner(topology).plan_many(points[:, 0], points[:, 1]).cost
    return points[np.isfinite(cost) & (cost > _LEAST_M)][:count]


def measured(
    topology: hn.TopologicalMap, name: str, pairs: FloatArray, clearance_m: FloatArray
) -> Row:
    """Plan all pairs by one preset, and return its line of the table."""
    grid = topology.grid
    layer = hn.CostLayer.clearance(grid)
    by_costs = layer if name == BY_COSTS else None
    planner = hn.HybridPlanner(topology, preset=name.partition(",")[0], costs=by_costs)
    began = time.perf_counter()
    planner.prepare()
    prepared_s = time.perf_counter() - began
    planner.plan(*pairs[0])
    lengths, costs, seconds, turns = [], [], [], 0
    near: list[FloatArray] = []
    for start, goal in pairs:
        now = time.perf_counter()
        result = planner.plan(start, goal)
        seconds.append(time.perf_counter() - now)
        path = result.raise_for_status().path
        assert path is not None  # noqa: S101 - it is solved
        poses = path.poses()[:, :2]
        near.append(clearance_m[tuple(grid.frame.cells_of(poses).T)])
        lengths.append(path.length_m)
        costs.append(cost_along(grid, layer, poses))
        turns += len(path.spot_turns)
    return {
        "preset": name,
        "length m": float(np.mean(lengths)),
        "cost m": float(np.mean(costs)),
        "clearance m": float(np.concatenate(near).mean()),
        "turns on the spot per 100 m": 100 * turns / float(np.sum(lengths)),
        "query ms": 1e3 * float(np.median(seconds)),
        "preparation s": prepared_s,
    }


OPTIONS = [option("--map", type=Path, default=OFFICE), option("--pairs", type=int, default=200)]


def main(given: Namespace) -> None:
    """Print the table."""
    grid = read(given.map)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    occupied = grid.measured == hn.CellClass.OCCUPIED
    clearance_m = clearance_cells(occupied) * grid.resolution_m
    pairs = pairs_on(topology, given.pairs)
    rows = [measured(topology, name, pairs, clearance_m) for name in PRESETS]
    print(f"{grid.name}, {len(pairs)} pairs")
    print(to_markdown(rows), end="")
