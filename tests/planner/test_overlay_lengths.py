"""The overlay without costs: its paths are legal, consistent, and as good as claimed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

import hybridnav as hn
from benchmarks.worlds import office_world
from hybridnav._base.moves import path_length_in_cells
from hybridnav.harness.consistency import Consistency
from hybridnav.harness.judges import judge_path
from hybridnav.harness.scenes import sample_pairs
from hybridnav.search.grid_search import GridSearch
from tests.certificates import ROUNDING
from tests.strategies import examples, scenes

EPSILONS = (None, 0.01, 0.05)


def planned(planner, start, goal):
    endpoints = planner.grid.frame.points_of(np.array([start, goal]))
    return planner.plan(endpoints[0], endpoints[1])


@pytest.fixture(scope="module")
def office():
    grid = office_world().grid(robot_radius_m=0.25)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid))


def planner_of(topology, epsilon, *overrides):
    """A prepared planner with a part by which paths may be longer than the shortest; None for
    none."""
    given = ["planner.method=cheapest", *overrides]
    given += [] if epsilon is None else [f"planner.epsilon={epsilon}"]
    planner = hn.HybridPlanner(topology, preset=hn.load_preset("octile", overrides=given))
    planner.prepare()  # before that, A* answers
    return planner


@pytest.fixture(scope="module")
def planners(office):
    return {epsilon: planner_of(office, epsilon) for epsilon in EPSILONS}


@pytest.fixture(scope="module")
def pairs(office):
    return sample_pairs(office.grid, 120, seed=3)


def check(result, topology, endpoints, optimum_cells, checks):
    """A result against the grid's optimum, the judge and the definition of consistency."""
    grid, (start, goal) = topology.grid, endpoints
    if optimum_cells is None:
        assert result.status is hn.PlanStatus.NO_PATH
        assert result.route is None
        return
    assert result.solved
    assert judge_path(grid, result.path.cells, start=start, goal=goal).faults == ()
    optimum = path_length_in_cells(optimum_cells) * grid.resolution_m
    assert result.cost >= optimum * (1 - 1e-9)
    assert result.lower_bound <= optimum * (1 + 1e-9)
    assert len(result.route.arcs) == len(result.route.places) - 1
    wrong = checks.check_plan(start, goal, result.route.places, result.route.arcs)
    assert wrong is None
    assert checks.check_walk(result.path.cells) is None


@pytest.mark.parametrize("epsilon", EPSILONS)
@given(scene=scenes(max_side=20))
@settings(max_examples=examples(15), deadline=None, derandomize=True)
def test_paths_are_legal_and_walk_along_arcs_on_any_map(scene, epsilon):
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(scene.grid, merge_distance_m=scene.merge_distance_m)
    )
    free = np.argwhere(scene.classes == hn.CellClass.FREE)
    planner = planner_of(topology, epsilon)
    checks = Consistency(scene.grid, topology.level.field_of, topology=topology)
    search = GridSearch(scene.classes == hn.CellClass.FREE)
    rng = np.random.default_rng(scene.seed)
    for _ in range(6 if len(free) else 0):
        start, goal = (tuple(cell) for cell in free[rng.integers(len(free), size=2)].tolist())
        optimum = search.search(start, goal).cells
        check(planned(planner, start, goal), topology, (start, goal), optimum, checks)


@pytest.mark.parametrize("epsilon", EPSILONS)
def test_the_office_is_planned_well(office, planners, pairs, epsilon):
    planner = planners[epsilon]
    checks = Consistency(office.grid, office.level.field_of, topology=office)
    search = GridSearch(office.grid.classes == hn.CellClass.FREE)
    losses = []
    for pair in pairs:
        optimum = search.search(pair.start, pair.goal).cells
        result = planned(planner, pair.start, pair.goal)
        check(result, office, (pair.start, pair.goal), optimum, checks)
        if optimum is not None:
            length = path_length_in_cells(optimum) * office.grid.resolution_m
            losses.append(result.cost / length - 1)
    assert max(losses) <= (epsilon or 0) + 1e-9


@pytest.mark.parametrize("epsilon", EPSILONS)
def test_what_was_promised_is_proved_on_every_query(planners, pairs, epsilon):
    results = [planned(planners[epsilon], pair.start, pair.goal) for pair in pairs]
    gaps = [result.gap for result in results if result.solved]
    assert len(gaps) > 100
    assert max(gaps) <= (epsilon or 0) + ROUNDING


@pytest.mark.parametrize(
    "distance_m",
    [0.5, 4.0, *(pytest.param(d, marks=pytest.mark.full) for d in (2.0, float("inf")))],
)
def test_any_merge_distance_of_the_places_will_do(distance_m):
    grid = office_world().grid(robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m))
    planner = planner_of(topology, None)
    search = GridSearch(grid.classes == hn.CellClass.FREE)
    for pair in sample_pairs(grid, 10, seed=1):
        optimum = search.search(pair.start, pair.goal).cells
        result = planned(planner, pair.start, pair.goal)
        assert result.solved == (optimum is not None)
        if optimum is not None:
            length = path_length_in_cells(optimum) * grid.resolution_m
            assert result.cost == pytest.approx(length, rel=1e-9)


@pytest.mark.parametrize("epsilon", EPSILONS)
def test_unexplored_cells_are_entered_where_they_may_be(epsilon):
    classes = np.zeros((9, 30), dtype=np.float32)
    classes[:, 12:18] = 0.5
    grid = hn.OccupancyGrid(classes, hn.Frame(0.05), robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=0.3))
    plain = planner_of(topology, epsilon)
    assert planned(plain, (4, 2), (4, 27)).status is hn.PlanStatus.NO_PATH
    opened = planner_of(topology, epsilon, "planner.allow_unexplored=true")
    result = planned(opened, (4, 2), (4, 27))
    assert result.solved
    assert result.cost == pytest.approx(25 * 0.05)
