"""The bound is a theorem: on floors, in worlds, on real maps, and what the presets promise."""

import math
import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.worlds import figure1_world, office_world
from hybridnav.harness.scenes import sample_pairs
from tests.certificates import Cell, built, check_pairs, check_plan, planners_of, random_pairs
from tests.oracle.grid import components
from tests.strategies import Scene, full_but

UNEXPLORED_TOO = "planner.allow_unexplored=true"

SOME_MAPS = {
    "giraff_homes/UMA_236_237.yaml",
    "nav2/maps/depot.yaml",
    "movingai/da2/ht_chantry.map",
    "movingai/dao/lak303d.map",
    "movingai/mapf/warehouse-10-20-10-2-1.map",
}
"""Maps of the reference data that are always tested; the other ones with `full` only."""


# --- floors, worlds, and a frame that is turned -------------------------------------------------


def test_bounds_hold_on_an_open_floor() -> None:
    classes = np.ones((260, 300), dtype=np.uint8)
    classes[60:64, 40:260] = classes[130:200, 150:152] = 0
    topology = built(Scene(classes, 0.05, 2.0, 0))
    planners = planners_of(topology)
    pairs = random_pairs(topology.grid.enterable(), np.random.default_rng(1), 40)
    check_pairs(planners, pairs, by_scipy=False)


@pytest.fixture(scope="module")
def office() -> list[hn.HybridPlanner]:
    grid = office_world().grid(robot_radius_m=0.25)
    return planners_of(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))


def pairs_of(grid: hn.OccupancyGrid, count: int, seed: int) -> list[tuple[Cell, Cell]]:
    """Pairs of all distances, some across components, and some of neighbours."""
    near = random_pairs(grid.enterable(), np.random.default_rng(seed), count // 4)
    sampled = sample_pairs(grid, count // 2, seed=seed, least_distance_m=grid.resolution_m)
    return near + [(pair.start, pair.goal) for pair in sampled]


def test_bounds_hold_in_the_office(office: list[hn.HybridPlanner]) -> None:
    check_pairs(office, pairs_of(office[0].topology.grid, 160, 5), by_scipy=False)


@pytest.mark.parametrize("overrides", [(), (UNEXPLORED_TOO,)])
def test_bounds_hold_in_figure_1(overrides: tuple[str, ...]) -> None:
    grid = figure1_world().grid(robot_radius_m=0.0)
    enterable = grid.enterable(allow_unexplored=bool(overrides))
    for distance_m in (0.3, 1.0, 10.0):
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m))
        pairs = random_pairs(enterable, np.random.default_rng(2), 50)
        check_pairs(planners_of(topology, *overrides), pairs, by_scipy=True)


def test_bounds_are_lengths_in_metres_whatever_the_frame() -> None:
    probability = office_world().grid(robot_radius_m=0.25).classes != hn.CellClass.FREE
    frame = hn.Frame(0.1, origin_m=(431_207.3, -12.5), yaw_rad=2.3)
    grid = hn.OccupancyGrid(probability[:120, :160].astype(np.float32), frame, robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=3.0))
    check_pairs(planners_of(topology), pairs_of(grid, 60, 7), by_scipy=False)


# --- the reference data -------------------------------------------------------------------------


def reference_maps() -> list[Any]:
    """Every map of the reference data; one that cannot be there without it."""
    folder = Path(os.environ.get("HYBRIDNAV_DATA", ""))
    table = folder / "maps.tsv"
    if not table.is_file():
        return ["none"]
    rows = [line.split("\t") for line in table.read_text().splitlines()[1:]]
    names = [name for name, kind in rows if kind == "map"]
    games = (folder / "movingai").glob("**/*.map")
    names += sorted(file.relative_to(folder).as_posix() for file in games)
    return full_but(SOME_MAPS, names)


@pytest.mark.parametrize("name", reference_maps())
def test_bounds_hold_on_real_maps(data: Path, name: str) -> None:
    game = name.endswith(".map")
    with warnings.catch_warnings():
        # Some maps call grey free; they are planned on all the same.
        warnings.simplefilter("ignore", hn.errors.MapWarning)
        grid = hn.load_map(data / name, robot_radius_m=0.0 if game else 0.25)
    distance_m = 40.0 if game else 4.0
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m))
    planners = planners_of(topology)
    check_pairs(planners, pairs_of(grid, 100, 3), by_scipy=False)
    one = components(grid.enterable())
    labels = np.unique(one[one > 0])
    if len(labels) > 1:
        endpoints = [tuple(np.argwhere(one == label)[0].tolist()) for label in labels[:2]]
        for planner in planners:
            check_plan(planner, endpoints[0], endpoints[1], math.inf)
