"""The preset `octile` answers what `grid-astar` answers, with a route and a bound without a gap."""

import threading
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume
from hypothesis import strategies as st

import hybridnav as hn
from benchmarks.worlds import figure1_world, office_world
from hybridnav.harness.scenes import sample_pairs
from tests.oracle.grid import assert_legal, recounted
from tests.strategies import class_grids, occupancy_grid, seeds, tried

MAPS = [
    "nav2/maps/depot.yaml",
    "aws_small_warehouse/005/map.yaml",
    "bwi_mapper/intel.yaml",
    "bwi_gdc/3/3.yaml",
    "cob_environments/ipa-production-plant/map.yaml",
    "radish_grids/freiburg-101.yaml",
]
QUICK_MAPS = MAPS[:1]


def topology_of(grid: hn.OccupancyGrid, merge_distance_m: float = 4.0) -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m))


def both(topology: hn.TopologicalMap, *overrides: str) -> tuple[hn.HybridPlanner, hn.HybridPlanner]:
    octile, whole = (
        hn.HybridPlanner(topology, preset=hn.load_preset(name, overrides=overrides))
        for name in ("octile", "grid-astar")
    )
    return octile, whole


def assert_same(found: hn.PlanResult, expected: hn.PlanResult, enterable: Any) -> None:
    """Assert that two results have the same status and cost, and that the first has no gap."""
    assert found.status is expected.status
    assert found.cost == pytest.approx(expected.cost, rel=1e-12)
    if found.path is not None:
        assert found.metric == "octile"
        assert found.gap == 0
        assert_legal(found.path.cells, enterable)
        assert (found.path.points[[0, -1]] == expected.path.points[[0, -1]]).all()


@tried(40, class_grids(), st.booleans(), seeds)
def test_it_answers_what_the_whole_grid_answers(classes: Any, unexplored: bool, seed: int) -> None:
    grid = occupancy_grid(classes)
    assume((classes != 0).any())
    octile, whole = both(topology_of(grid), f"planner.allow_unexplored={str(unexplored).lower()}")
    enterable = grid.enterable(allow_unexplored=unexplored)
    cells = np.argwhere(classes < 3)
    rng = np.random.default_rng(seed)
    for _ in range(8):
        start, goal = grid.frame.points_of(cells[rng.integers(len(cells), size=2)])
        assert_same(octile.plan(start, goal), whole.plan(start, goal), enterable)


def test_its_route_is_read_off_its_path() -> None:
    topology = topology_of(figure1_world().grid(robot_radius_m=0.0), 1.0)
    octile, _ = both(topology)
    result = octile.plan((0.3, 0.3), (0.3, 2.7))
    places = topology.place_ids[[topology.place_at(tuple(cell)) for cell in result.path.cells]]
    changes = np.flatnonzero(np.diff(places, prepend=-1))
    assert list(result.route.places) == places[changes].tolist()


def test_what_is_closed_is_passed_by() -> None:
    grid = occupancy_grid(np.ones((9, 9), np.uint8))
    octile, whole = both(topology_of(grid))
    wall = shapely.box(0.0, 4.0, 8.0, 5.0)
    for start, goal in (
        ((0.5, 0.5), (0.5, 8.5)),
        ((0.5, 0.5), (8.5, 0.5)),
        ((4.5, 2.5), (4.5, 4.5)),
    ):
        found = octile.plan(start, goal, blocked=wall)
        expected = whole.plan(start, goal, blocked=wall)
        assert found.status is expected.status
        assert found.cost == pytest.approx(expected.cost)
        batch = octile.plan_many([start], [goal], blocked=wall)
        assert batch.status[0] == found.status
        assert batch.cost[0] == pytest.approx(found.cost)


def assert_equal_on(path: Path, count: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hn.errors.MapWarning)
        grid = hn.load_map(path, robot_radius_m=0.25)
    octile, whole = both(topology_of(grid))
    pairs = sample_pairs(grid, count, seed=0)
    endpoints = [grid.frame.points_of([pair.start, pair.goal]) for pair in pairs]
    expected = [whole.plan(*of) for of in endpoints]
    for result, of in zip(expected, endpoints, strict=True):
        assert_same(octile.plan(*of), result, grid.enterable())
    starts, goals = np.swapaxes(np.array(endpoints), 0, 1)
    batch = octile.plan_many(starts, goals)
    assert batch.cost == pytest.approx([result.cost for result in expected], rel=1e-12)
    for i, start in enumerate(batch.path_start[:-1].tolist()):
        points = batch.points[start : batch.path_start[i + 1]]
        if len(points):
            cells = grid.frame.cells_of(points)
            assert_legal(cells, grid.enterable())
            assert batch.cost[i] == pytest.approx(recounted(cells) * grid.resolution_m)


@pytest.mark.parametrize("name", QUICK_MAPS)
def test_costs_equal_those_of_the_whole_grid_on_a_real_map(data: Path, name: str) -> None:
    assert_equal_on(data / name, 40)


@pytest.mark.full
@pytest.mark.parametrize("name", MAPS)
def test_costs_equal_those_of_the_whole_grid_on_real_maps(data: Path, name: str) -> None:
    assert_equal_on(data / name, 1000)


def test_queries_of_a_large_map_do_not_wait_for_the_graph(monkeypatch: pytest.MonkeyPatch) -> None:
    """A* answers until the graph is built behind them, which begins once."""
    started: list[threading.Thread] = []

    def keep(thread: threading.Thread) -> None:
        started.append(thread)

    grid = office_world().grid(robot_radius_m=0.25)
    octile, whole = both(topology_of(grid))
    monkeypatch.setattr("hybridnav.planning.methods.octile.MANY_CELLS", 0)
    monkeypatch.setattr(threading.Thread, "start", keep)
    pairs = [
        grid.frame.points_of(np.array([pair.start, pair.goal]))
        for pair in sample_pairs(grid, 12, seed=4)
    ]
    for number, (start, goal) in enumerate(pairs[:12]):
        assert (octile.prepared is None) == (number < 6)
        assert_same(octile.plan(start, goal), whole.plan(start, goal), grid.enterable())
        if number == 5:
            started[0].run()
    assert len(started) == 1
