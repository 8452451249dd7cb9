"""Random plans of every kind: cost, length of the points, and bound <= cost.

Plans by every preset and finish, with and without costs, by every space of OMPL, and tours, on
random maps, and through a building. Each result is compared with its points: the length from poses
a hundredth of a cell apart, the cost from the factors that these meet. Exits with 1 where one
states something else.
"""

import itertools
import math
import time
from argparse import Namespace
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy import ndimage

import hybridnav as hn
from benchmarks.common import ROOT
from benchmarks.options import SEED, option

BUILDING = ROOT / "maps" / "building" / "building.yaml"
FINISHES = ("none", "line-of-sight", "arcs")
CURVED = ("dubins", "reeds-shepp")
SPACES = ("r2", "se2", "differential", *CURVED)
FINE = 0.01
"""Cells from pose to pose."""

OPTIONS = [option("--count", type=int, default=100_000, help="plans (100,000)"), SEED]


def random_grid(rng: np.random.Generator) -> hn.OccupancyGrid:
    """Return a turned map of blobs, for a point or a disc."""
    rows, cols = rng.integers(12, 30, 2).tolist()
    smooth = ndimage.uniform_filter(rng.random((rows, cols)), int(rng.integers(1, 4)))
    occupied = smooth < np.quantile(smooth, rng.uniform(0.0, 0.35))
    frame = hn.Frame(0.1, origin_m=(-10.0, -55.0), yaw_rad=float(rng.uniform(-3, 3)))
    radius_m = float(rng.choice([0.0, 0.1]))
    return hn.OccupancyGrid(occupied.astype(np.float32), frame, robot_radius_m=radius_m)


def planners_of(
    grid: hn.OccupancyGrid, *, samples: bool
) -> Iterator[tuple[str, hn.HybridPlanner, Any]]:
    """Yield what a plan is called, its planner and its finish."""
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    layer = hn.CostLayer.clearance(grid, inflation_radius_m=0.3)
    for space in SPACES if samples else ():
        radius = ["planner.ompl.turning_radius_m=0.3"] if space in CURVED else []
        own = [f"planner.ompl.space={space}", "planner.ompl.budget_s=0.1", *radius]
        preset_of = hn.load_preset("ompl", overrides=own)
        yield f"ompl, {space}", hn.HybridPlanner(topology, preset=preset_of), None
    for preset in ("shortest", "octile", "paper", "grid-astar", "robot"):
        layers = (layer, None) if preset == "grid-astar" else (None,)
        for costs in layers:
            planner = hn.HybridPlanner(topology, preset=preset, costs=costs)
            by_costs = costs is not None or preset == "robot"
            for finish in FINISHES if by_costs else FINISHES[:2]:
                yield f"{preset}, {finish}" + ", costs" * (costs is not None), planner, finish


def recounted(
    grid: hn.OccupancyGrid, path: hn.Path, factors: Any = None
) -> tuple[float, float, float]:
    """Return the length of a path and the least and the most that it may cost, from fine poses."""
    poses = path.poses(FINE * grid.resolution_m)[:, :2]
    steps = np.sqrt((np.diff(poses, axis=0) ** 2).sum(axis=1))
    length = math.fsum(steps.tolist())
    if factors is None:
        return length, length, length
    at = grid.frame.positions_of((poses[1:] + poses[:-1]) / 2)
    around = [
        factors[tuple(np.clip(np.floor(at + off), 0, np.subtract(factors.shape, 1)).astype(int).T)]
        for off in itertools.product((-1e-6, 1e-6), repeat=2)
    ]
    low, high = (np.sum(pick(around, axis=0) * steps) for pick in (np.min, np.max))
    return length, float(low), float(high)


def faults_of(planner: hn.HybridPlanner, result: hn.PlanResult) -> list[str]:
    """Return what a result states that its points contradict."""
    grid, path = planner.grid, result.path
    if path is None or not result.solved:
        return [] if result.cost == math.inf else ["a cost without a path"]
    layer = planner._now.costs.layer  # noqa: SLF001
    by_costs = result.metric in {"weighted", "any-angle-weighted"}
    length, low, high = recounted(grid, path, layer.factors if by_costs and layer else None)
    slack = 2e-3 * max(length, grid.resolution_m)
    found = []
    if not abs(path.length_m - length) <= (slack if path.is_curved else 1e-6):
        found.append(f"states {path.length_m} m, drives {length} m")
    if result.metric == "weighted":  # the mean of the factors of two cells, not those on the way
        low, high = length, high + math.inf
    spare = slack * (1 + 20 * by_costs)
    if not low - spare <= result.cost <= high + spare:
        found.append(f"costs {result.cost}, its points {low} to {high}")
    if not 0 <= result.lower_bound <= result.cost:
        found.append(f"bound {result.lower_bound} above the cost {result.cost}")
    if result.metric in {"dubins", "reeds-shepp"} and result.start and result.goal:
        straight = math.dist(result.start[:2], result.goal[:2])
        if result.lower_bound < straight - 1e-9 or result.lower_bound > length + slack:
            found.append(f"bound {result.lower_bound}, straight {straight}, driven {length}")
    return found


def claims(
    rng: np.random.Generator, count: int, *, samples: bool = True
) -> Iterator[tuple[str, list[str]]]:
    """Yield the name of each of some plans, and its faults."""
    done = 0
    for number in itertools.count():
        grid = random_grid(rng)
        free = np.argwhere(grid.enterable())
        if len(free) < 2:
            continue
        for name, planner, finish in planners_of(grid, samples=samples and not number % 4):
            for _ in range(5 if "ompl" in name else 25):
                cells = free[rng.integers(len(free), size=3)]
                points = grid.frame.points_of_grid(cells + rng.uniform(0.02, 0.98, (3, 2)))
                yaws = rng.uniform(-math.pi, math.pi, (3, 1))
                ends = np.hstack([points, yaws]) if "ompl" in name else points
                if rng.random() < 0.2 and finish in {None, planner.preset.planner.finish}:
                    tour = hn.plan_tour(planner, list(ends))
                    for part in tour.results:
                        yield f"tour, {name}", faults_of(planner, part)
                    if tour.solved and not tour.lower_bound <= tour.cost:
                        yield f"tour, {name}", ["bound above the cost"]
                    done += len(tour.results)
                    continue
                yield name, faults_of(planner, planner.plan(*ends[:2], smooth=finish))
                done += 1
                if done >= count:
                    return


def claims_of_floors(rng: np.random.Generator, count: int) -> Iterator[tuple[str, list[str]]]:
    """Yield the faults of plans through the building of the project, by two presets."""
    for preset in ("shortest", "robot"):
        building = hn.ext.fleet.load_building(BUILDING, robot_radius_m=0.25, preset=preset)
        floors = [(floor, np.argwhere(floor.planner.grid.enterable())) for floor in building.floors]
        for _ in range(-(-count // 2)):
            ends: list[tuple[str, Any]] = []
            for number in rng.integers(len(floors), size=2):
                floor, free = floors[number]
                at = free[rng.integers(len(free))] + rng.uniform(0.02, 0.98, 2)
                ends.append((floor.name, floor.planner.grid.frame.points_of_grid(at)))
            plan = building.plan(*ends)
            found = [] if plan.lower_bound <= plan.cost else ["bound above the cost"]
            for name, result in zip(plan.floors, plan.results, strict=True):
                found += faults_of(building.floor(name).planner, result)
            yield f"building, {preset}", found


def main(given: Namespace) -> int:
    """Print what was found, kind by kind."""
    rng, began = np.random.default_rng(given.seed), time.process_time()
    counts: dict[str, list[int]] = {}
    floors = given.count // 10
    every = itertools.chain(claims_of_floors(rng, floors), claims(rng, given.count - floors))
    for name, found in every:
        kind = counts.setdefault(name, [0, 0])
        kind[0] += 1
        kind[1] += bool(found)
        if found and sum(bad for _, bad in counts.values()) <= 20:
            print(name, *found, sep="; ", flush=True)
    for name, (plans, bad) in sorted(counts.items()):
        print(f"{name:40}{plans:8}{bad:8}")
    bad = sum(each for _, each in counts.values())
    plans = sum(each for each, _ in counts.values())
    seconds = time.process_time() - began
    print(f"{plans} plans, seed {given.seed}: {bad} with a fault; {seconds:.0f} s of CPU")
    return int(bad > 0)
