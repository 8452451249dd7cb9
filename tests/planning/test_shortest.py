"""The preset `shortest`: any-angle paths that nothing is shorter than, between any points."""

import importlib
import itertools
import math
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import VisibilityGraph, segment_faults
from hybridnav.planning.methods import shortest as methods_shortest
from hybridnav.planning.methods.shortest import OverMesh
from hybridnav.search.mesh import build_mesh
from tests.oracle.any_angle import some_positions
from tests.strategies import class_grids, drawn, occupancy_grid, seeds, tried

FRAMES = (hn.Frame(1.0), hn.Frame(0.05, (12.3, -400.0), 0.7), hn.Frame(0.1, (5e5, 4e6), -2.0))


def mapped(classes: Any, frame: hn.Frame = FRAMES[0]) -> hn.TopologicalMap:
    probability = occupancy_grid(classes).probability
    grid = hn.OccupancyGrid(probability, frame, robot_radius_m=0)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4 * 0.05))


def shortest(topology: hn.TopologicalMap, *overrides: str) -> hn.HybridPlanner:
    return hn.HybridPlanner(topology, preset=hn.load_preset("shortest", overrides=overrides))


def assert_optimal(grid: hn.OccupancyGrid, result: hn.PlanResult, optimum_m: float) -> None:
    """A result that claims gap 0, against the length of a shortest path in metres."""
    assert result.metric == "any-angle"
    if math.isinf(optimum_m):
        assert result.status is hn.PlanStatus.NO_PATH
        assert result.lower_bound == math.inf
        return
    assert result.gap == 0
    # Far from the origin coordinates are rounded more coarsely.
    assert result.cost == pytest.approx(optimum_m, rel=1e-9, abs=1e-7)
    assert not segment_faults(grid, result.path.points)
    cells = result.path.cells
    assert np.abs(np.diff(cells, axis=0)).max(initial=0) <= 1
    assert len(result.route.arcs) == len(result.route.places) - 1


@tried(50, class_grids(max_side=14), seeds, st.sampled_from(FRAMES))
def test_paths_are_optimal_between_any_points(classes: Any, seed: int, frame: hn.Frame) -> None:
    free = classes == hn.CellClass.FREE
    assume(free.any())
    topology = mapped(classes, frame)
    graph, planner = VisibilityGraph(topology.grid), shortest(topology)
    for (first, start), (last, goal) in itertools.pairwise(some_positions(free, seed)):
        endpoints = frame.points_of_grid([start, goal])
        if (frame.cells_of(endpoints) != [first, last]).any():
            continue  # a point on a side belongs to the cell behind it
        result = planner.plan(*endpoints)
        assert_optimal(topology.grid, result, graph.between(start, goal).length_m)
        if result.path is not None:
            np.testing.assert_array_equal(result.path.points[[0, -1]], endpoints)
            assert result.path.cells[[0, -1]].tolist() == [list(first), list(last)]


@tried(50, class_grids(max_side=14), seeds, st.booleans())
def test_paths_round_closed_cells_are_optimal(classes, seed, is_prepared):
    cells = np.argwhere(classes == hn.CellClass.FREE)
    assume(len(cells) > 4)
    rng = np.random.default_rng(seed)
    topology = mapped(classes)
    planner = shortest(topology)
    if is_prepared:
        planner.prepare()
    for _ in range(3):
        shut = rng.choice(cells, rng.integers(1, 4))
        left = classes.copy()
        left[tuple(shut.T)] = hn.CellClass.OCCUPIED
        grid = occupancy_grid(left)
        graph, closed = VisibilityGraph(grid), planner.closed({"cells": shut})
        endpoints = grid.frame.points_of(rng.choice(cells, 4))
        for start, goal in itertools.pairwise(endpoints):
            result = planner.plan(start, goal, blocked=closed)
            if "blocked" in result.status:
                held = grid.frame.cells_of([start, goal])
                assert (held[:, None] == shut).all(axis=2).any()
                continue
            optimum = graph.between(tuple(start[::-1]), tuple(goal[::-1]))
            assert_optimal(grid, result, optimum.length_m)


def test_searches_round_what_was_closed_are_kept_for_the_next_query() -> None:
    topology = mapped(drawn("............", "............", "............"))
    planner = shortest(topology)
    ways = [
        planner.plan((0.5, 1.5), (11.5, 1.5), blocked={"cells": [(1, col)]}).cost
        for col in range(1, 11)
    ] * 3
    assert ways == ways[:10] * 3
    assert isinstance(planner.method, OverMesh)
    assert len(planner.method._detours) == 8


def test_unexplored_cells_are_entered_where_that_is_allowed() -> None:
    topology = mapped(drawn(".?.", ".#."))
    endpoints = (0.5, 0.5), (2.5, 0.5)
    assert shortest(topology).plan(*endpoints).status is hn.PlanStatus.NO_PATH
    allowed = shortest(topology, "planner.allow_unexplored=true")
    assert allowed.plan(*endpoints).cost == pytest.approx(1 + 2 * math.hypot(0.5, 0.5))
    assert allowed.plan((1.5, 1.5), endpoints[1]).solved
    allowed.prepare()
    row = allowed.topology.grid.frame.cell_of(1.5, 1.5)[0]
    for column, status in ((1, hn.PlanStatus.NO_PATH), (0, hn.PlanStatus.START_BLOCKED)):
        closed = {"cells": [(row, column)], "polygons": []}
        start = (0.5, 1.5) if column == 0 else endpoints[0]
        assert allowed.plan(start, endpoints[1], blocked=closed).status is status


def test_a_map_whose_corners_may_be_cut_is_refused() -> None:
    probability = occupancy_grid(drawn(".#", "#.")).probability
    grid = hn.OccupancyGrid(probability, FRAMES[0], robot_radius_m=0, corner_cutting=True)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
    with pytest.raises(hn.errors.InvalidValueError, match="preset grid-astar"):
        shortest(topology)


def test_many_pairs_are_answered_as_one_by_one() -> None:
    rng = np.random.default_rng(1)
    topology = mapped((rng.random((30, 30)) > 0.3).astype(np.uint8))
    planner = shortest(topology)
    starts, goals = rng.uniform(-1, 31, (2, 400, 2))
    closed = planner.closed({"cells": rng.choice(30, (5, 2))})
    for shut, is_prepared in ((None, False), (None, True), (closed, True)):
        if is_prepared:
            planner.prepare()
        many = planner.plan_many(starts, goals, blocked=shut)
        assert (many.status == "solved").sum() > 100
        for query, endpoints in enumerate(zip(starts, goals, strict=True)):
            one = planner.plan(*endpoints, blocked=shut)
            assert many.status[query] == one.status
            assert many.cost[query] == one.cost
            assert many.lower_bound[query] == one.lower_bound
            if one.path is not None:
                np.testing.assert_array_equal(many.path(query), one.path.points)


def test_smoothing_changes_nothing() -> None:
    topology = mapped(drawn(".....", ".###.", "....."))
    results = [
        shortest(topology).plan((0.5, 0.5), (4.5, 2.5), smooth=way)
        for way in (None, "none", "line-of-sight")
    ]
    assert len({result.cost for result in results}) == 1
    assert {result.metric for result in results} == {"any-angle"}


@tried(30, class_grids(max_side=14), seeds, st.sampled_from([0.0, 0.01, 0.3]))
def test_a_path_is_as_near_the_optimum_as_it_was_asked_to_be(classes, seed, epsilon):
    cells = np.argwhere(classes == hn.CellClass.FREE)
    assume(len(cells))
    topology = mapped(classes)
    exact, near = shortest(topology), shortest(topology, f"planner.epsilon={epsilon}")
    starts, goals = np.random.default_rng(seed).choice(cells, (2, 8)) + 0.5
    many = near.plan_many(starts[:, ::-1], goals[:, ::-1])
    for query, endpoints in enumerate(zip(starts[:, ::-1], goals[:, ::-1], strict=True)):
        optimum, found = exact.plan(*endpoints).cost, near.plan(*endpoints)
        assert many.cost[query] == found.cost
        assert many.lower_bound[query] == found.lower_bound
        assert found.solved == math.isfinite(optimum)
        if found.solved:
            assert found.gap <= epsilon + 1e-9
            assert found.lower_bound <= optimum * (1 + 1e-9)
            assert optimum <= found.cost * (1 + 1e-9)


def test_a_query_whose_time_is_up_has_a_path_and_a_bound() -> None:
    rng = np.random.default_rng(2)
    topology = mapped((rng.random((60, 60)) > 0.25).astype(np.uint8))
    exact, late = shortest(topology), shortest(topology, "planner.budget_s=0")
    starts, goals = rng.uniform(0, 60, (2, 40, 2))
    for is_prepared in (False, True):
        if is_prepared:
            late.prepare()
        many = late.plan_many(starts, goals)
        for query, endpoints in enumerate(zip(starts, goals, strict=True)):
            optimum, found = exact.plan(*endpoints), late.plan(*endpoints)
            assert many.status[query] == found.status == optimum.status
            if found.path is not None:
                assert found.lower_bound <= optimum.cost * (1 + 1e-9)
                assert optimum.cost <= found.cost * (1 + 1e-9)
                assert not segment_faults(topology.grid, found.path.points)
                assert found.lower_bound >= math.dist(*endpoints) * (1 - 1e-9)
    shut = {"cells": [(30, 30)]}
    assert late.plan((1.5, 30.5), (58.5, 30.5), blocked=shut).gap >= 0


@pytest.mark.parametrize(
    ("preset", "built"),
    [
        ("shortest", "planning.methods.shortest.build_mesh"),
        ("octile", "planning.methods.octile.build_jump_graph"),
    ],
)
def test_a_planner_builds_at_its_first_query_and_once_for_all_threads(preset, built, monkeypatch):
    home, _, name = built.rpartition(".")
    module, calls = importlib.import_module(f"hybridnav.{home}"), []
    build = getattr(module, name)

    def slowly(*args: Any, **kwargs: Any) -> Any:
        calls.append(args)
        time.sleep(0.05)
        return build(*args, **kwargs)

    monkeypatch.setattr(module, name, slowly)
    topology = mapped(drawn(".....", ".###.", "....."))
    planner = hn.HybridPlanner(topology, preset=preset)
    assert planner.plan((2.5, 1.5), (0.5, 0.5)).status is hn.PlanStatus.START_OCCUPIED
    assert not calls
    with ThreadPoolExecutor(4) as threads:
        costs = set(threads.map(lambda _: planner.plan((0.5, 0.5), (4.5, 2.5)).cost, range(4)))
    assert len(costs) == len(calls) == 1
    planner.prepare()
    assert len(calls) == 1
    other = hn.HybridPlanner(topology, preset=preset)
    other.prepare()
    assert len(calls) == 2
    assert {other.plan((0.5, 0.5), (4.5, 2.5)).cost} == costs
    assert len(calls) == 2


def test_a_path_from_a_point_to_itself_is_that_point() -> None:
    for smooth in (None, "none", "line-of-sight"):
        result = shortest(mapped(drawn("..."))).plan((1.2, 0.3), (1.2, 0.3), smooth=smooth)
        assert result.path.points.tolist() == [[1.2, 0.3]]
        assert (result.cost, result.lower_bound, result.gap) == (0, 0, 0)


def test_counts_name_what_was_expanded() -> None:
    topology = mapped(drawn(".....", ".###.", "....."))
    stats = shortest(topology).plan((0.5, 0.5), (4.5, 2.5)).stats
    assert stats.expanded_intervals > 0
    assert stats.expanded == 0
    assert (
        hn.HybridPlanner(topology, preset="grid-astar")
        .plan((0.5, 0.5), (4.5, 2.5))
        .stats.expanded_intervals
        == 0
    )


@pytest.mark.parametrize("preset", ["shortest", "octile", "paper", "grid-astar"])
def test_preparing_reports_every_step_and_nothing_that_is_done_already(preset: str) -> None:
    planner = hn.HybridPlanner(mapped(drawn(".....", ".###.", ".....")), preset=preset)
    steps: list[tuple[int, int]] = []
    planner.prepare(progress=lambda done, total: steps.append((done, total)))
    total = steps[-1][1]
    assert steps == [(done, total) for done in range(1, total + 1)]
    if preset != "grid-astar":  # which has nothing to build, and reports that at once
        again: list[int] = []
        planner.prepare(progress=lambda done, _: again.append(done))
        assert not again


@pytest.mark.filterwarnings("default:the map has")
def test_a_large_mesh_is_announced_before_it_is_built(monkeypatch, cli, tmp_path):
    free = np.ones((40, 50), dtype=bool)
    free[1:-1:3, 1:-1:3] = False
    grid = hn.OccupancyGrid(np.where(free, 0, 1).astype(np.float32), robot_radius_m=0)
    hn.write_ros_map(grid, tmp_path / "m.yaml")
    ends = (0.025, 0.025), (2.475, 1.975)
    n_corners = len(build_mesh(free).corners)
    monkeypatch.setattr(methods_shortest, "_LARGE", n_corners)
    monkeypatch.setattr(methods_shortest, "_S", 0.5)
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    takes = rf"about {n_corners * 0.5:.0f} s and [\d.]+ GB, once, and a far path as much again"
    with pytest.warns(UserWarning, match=takes) as told:
        planner.plan(*ends)
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        planner.plan(*ends)
    command = ["plan", tmp_path / "m.yaml", "--robot-radius", 0]
    command += ["--start", "0.025,0.025", "--goal", "2.475,1.975"]
    assert cli(*command).err.count("million corners") == 1
    assert "corners" not in cli(*command, "--preset", "grid-astar").err
    monkeypatch.setattr(methods_shortest, "_LARGE", n_corners + 1)
    assert "corners" not in cli(*command).err
