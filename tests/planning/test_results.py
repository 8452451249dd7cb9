"""Results of plans: what they hold."""

import gc
import weakref

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
