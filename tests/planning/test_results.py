"""Results of plans: what they hold."""

import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import pytest

import hybridnav as hn
from tests.strategies import drawn, occupancy_grid

GRID = occupancy_grid(drawn(".......", ".##.##.", "......."))


@pytest.mark.parametrize("preset", ["shortest", "octile", "paper", "grid-astar"])
def test_a_result_outlives_its_planner_and_does_not_hold_it(preset: str) -> None:
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(GRID, merge_distance_m=2.0))
    planner = hn.HybridPlanner(topology, preset=preset)
    result, known = planner.plan((0.5, 0.5), (6.5, 2.5)), planner.plan((0.5, 0.5), (6.5, 2.5)).route
    gone = weakref.ref(planner)
    del planner
    gc.collect()
    assert gone() is None
    assert known is not None
    assert result.route == known


def test_threads_may_read_the_routes_of_one_planner() -> None:
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(GRID, merge_distance_m=2.0))
    planner = hn.HybridPlanner(topology, preset="octile")
    results = [planner.plan((0.5, 0.5), (6.5, 2.5)) for _ in range(8)]
    with ThreadPoolExecutor(4) as threads:
        routes = set(threads.map(lambda result: result.route, results))
    assert len(routes) == 1
