"""Planners that threads share: four on one return the answers of one."""

import importlib
import pkgutil
import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import hybridnav
import hybridnav as hn
from benchmarks.baselines.hpa import HpaStar
from benchmarks.baselines.thrun import ThrunMap
from hybridnav.harness.baselines.grid import GridAstar, GridDijkstra, WeightedAstar
from hybridnav.harness.baselines.regions import SimpleGraphPyramid
from hybridnav.harness.judges import segment_faults
from hybridnav.planning import load_preset
from tests.strategies import full_but, occupancy_grid

N_THREADS = 4
OVER_CELLS = [name for name in hn.preset_names() if name != "ompl"]
BY_OMPL = ["BITstar", "InformedRRTstar", "PRMstar", "RRTConnect", "RRTstar"]


def grid_with_rooms(seed: int, side: int = 90) -> hn.OccupancyGrid:
    """Rooms with doors and clutter: searches of some hundred cells, not all alike."""
    rng = np.random.default_rng(seed)
    classes = np.ones((side, side), np.uint8)
    classes[side // 3 :: side // 3] = classes[:, side // 3 :: side // 3] = 0
    classes[rng.random(classes.shape) < 0.08] = 0
    for at in range(side // 6, side, side // 3):
        classes[:, at : at + 3] = classes[at : at + 3] = 1
    return occupancy_grid(classes, resolution_m=0.1)


def free_pairs(grid: hn.OccupancyGrid, count: int, seed: int) -> Any:
    """Pairs of free cells, int (count, 2, 2)."""
    cells = np.argwhere(grid.enterable())
    rng = np.random.default_rng(seed)
    return cells[rng.integers(len(cells), size=(count, 2))]


def by_threads(jobs: Sequence[Callable[[], Any]], repeats: int = 1) -> list[list[Any]]:
    """What each of four threads gets from the jobs, each beginning at another one."""
    found: list[list[Any]] = [[None] * len(jobs) for _ in range(N_THREADS)]
    start = threading.Barrier(N_THREADS)

    def work(number: int) -> None:
        start.wait()
        for _ in range(repeats):
            for i in range(len(jobs)):
                at = (i + number * len(jobs) // N_THREADS) % len(jobs)
                found[number][at] = jobs[at]()

    # Daemons, so that a search without an end fails this test and does not hang all others.
    threads = [threading.Thread(target=work, args=(n,), daemon=True) for n in range(N_THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert not any(thread.is_alive() for thread in threads)
    return found


def told(result: hn.PlanResult) -> tuple[Any, ...]:
    path = result.path
    points = None if path is None else (path.cells.tolist(), path.points.tolist())
    return result.status, result.metric, result.cost, result.lower_bound, result.route, points


@pytest.mark.parametrize("preset", OVER_CELLS)
def test_four_threads_on_one_planner_get_the_answers_of_one(preset: str) -> None:
    grid = grid_with_rooms(seed=1)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=3.0))
    planner = hn.HybridPlanner(topology, preset=preset)
    pairs = free_pairs(grid, 24, seed=2)
    closed = [
        hn.Blocked(cells=np.unique(part, axis=0)) for part in free_pairs(grid, 40, 3).swapaxes(0, 1)
    ]

    def job(pair: Any, blocked: Any, smooth: Any) -> Callable[[], Any]:
        start, goal = grid.frame.points_of(pair)
        return lambda: told(planner.plan(start, goal, blocked=blocked, smooth=smooth))

    smooths = ("none", "line-of-sight")
    jobs = [
        job(pair, blocked, smooths[i % 2])
        for i, pair in enumerate(pairs)
        for blocked in (None, *closed)
    ]
    alone = [each() for each in jobs]
    assert sum(answer[0] is hn.PlanStatus.SOLVED for answer in alone) > len(jobs) / 2
    planner = hn.HybridPlanner(topology, preset=preset)  # whichever thread is first fills caches
    for answers in by_threads(jobs, repeats=4):
        assert answers == alone


@pytest.mark.parametrize("name", full_but(BY_OMPL[:1], BY_OMPL))
def test_four_threads_on_one_planner_with_ompl_get_paths_of_their_own(name: str) -> None:
    pytest.importorskip("ompl")
    grid = grid_with_rooms(seed=6, side=60)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=3.0))
    overrides = [f"planner.ompl.planner={name}", "planner.ompl.budget_s=0.15"]
    settings = load_preset("ompl", overrides=overrides)
    planner = hn.HybridPlanner(topology, preset=settings)
    closed = hn.Blocked(cells=np.argwhere(grid.enterable())[::500])
    endpoints = grid.frame.points_of(np.argwhere(grid.enterable())[[0, 700, -1]])
    queries = [(endpoints[0], endpoints[2], None), (endpoints[2], endpoints[1], closed)]
    jobs = [
        lambda start=start, goal=goal, blocked=blocked: planner.plan(start, goal, blocked=blocked)
        for start, goal, blocked in queries
    ]
    try:
        alone = [each() for each in jobs]
        threads = by_threads(jobs)
    finally:
        planner.close()
    for answers in threads:
        for one, other, query in zip(answers, alone, queries, strict=True):
            assert one.status is other.status is hn.PlanStatus.SOLVED
            np.testing.assert_allclose(one.path.points[[0, -1]], query[:2], atol=1e-9)
            assert segment_faults(grid, one.path.points) == ()


@pytest.mark.parametrize(
    "method", [GridAstar, GridDijkstra, WeightedAstar, HpaStar, SimpleGraphPyramid, ThrunMap]
)
def test_four_threads_on_one_baseline_get_the_answers_of_one(method: Any) -> None:
    grid = grid_with_rooms(seed=4, side=60)
    made_of: Any = grid
    if method is SimpleGraphPyramid:
        made_of = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.5))
    planner = method(made_of)

    def job(pair: Any) -> Callable[[], Any]:
        def solve() -> Any:
            answer = planner.solve(*(tuple(cell) for cell in pair.tolist()))
            cells = None if answer.cells is None else answer.cells.tolist()
            return cells, answer.nodes, answer.bound, answer.expanded, answer.expanded_nodes

        return solve

    jobs = [job(pair) for pair in free_pairs(grid, 24, seed=5)]
    alone = [each() for each in jobs]
    for answers in by_threads(jobs, repeats=4):
        assert answers == alone


def test_every_kernel_releases_the_lock_of_the_interpreter() -> None:
    kernels = {}
    for module in pkgutil.walk_packages(hybridnav.__path__, "hybridnav."):
        if ".kernels." in module.name:
            for name, value in vars(importlib.import_module(module.name)).items():
                if isinstance(value, Dispatcher):
                    kernels[f"{module.name}.{name}"] = value
    assert len(kernels) > 100
    assert [name for name, kernel in kernels.items() if not kernel.targetoptions.get("nogil")] == []
