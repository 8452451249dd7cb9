"""Plans by costs: cheapest paths, their bounds and finish, closed cells, tours, refusals."""

import json
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import segment_faults
from hybridnav.maps.costs import cost_along
from tests.layers import grid_of, layer_of
from tests.oracle.grid import assert_legal, distances, move_graph, weighted
from tests.strategies import class_grids, occupancy_grid, seeds, tried


def topology_of(grid: hn.OccupancyGrid, rooms: Any = None) -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))


def random_layer(shape: tuple[int, int], rng: np.random.Generator) -> hn.CostLayer:
    """Noise, zones of equal factors, or a slope."""
    kind = rng.integers(3)
    if kind == 0:
        factors = rng.uniform(1, 4, shape)
    elif kind == 1:
        factors = np.kron(rng.choice([1.0, 1.5, 6.0], (shape[0], shape[1])), np.ones((4, 4)))
        factors = factors[: shape[0], : shape[1]]
    else:
        factors = 1 + np.add.outer(np.arange(shape[0]), np.arange(shape[1])) / 7
    closed = rng.random(shape) < rng.choice([0.0, 0.05])
    return layer_of(factors, closed)


def scene(classes: Any, seed: int) -> tuple[Any, ...]:
    """Map, layer, cells that may be entered, and two of them."""
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    layer = random_layer(grid.shape, rng)
    is_open = grid.enterable()
    is_open.flat[layer.closed_flat] = False
    assume(is_open.any())
    cells = np.argwhere(is_open)
    start, goal = (tuple(cells[rng.integers(len(cells))].tolist()) for _ in range(2))
    return grid, layer, is_open, start, goal, rng


def optimum_m(grid: hn.OccupancyGrid, layer: hn.CostLayer, is_open: Any, start: Any) -> Any:
    graph = weighted(move_graph(is_open), layer.factors.astype(float))
    return distances(graph, grid.shape, start) * grid.resolution_m


@tried(80, class_grids(max_side=20), seeds)
def test_the_path_is_the_cheapest_with_gap_0(classes: Any, seed: int) -> None:
    grid, layer, is_open, start, goal, rng = scene(classes, seed)
    planner = hn.HybridPlanner(topology_of(grid), preset="grid-astar", costs=layer)
    ends = grid.frame.points_of([start, goal])
    least = optimum_m(grid, layer, is_open, start)[goal]
    result = planner.plan(*ends)
    assert result.solved == np.isfinite(least)
    assert result.metric == "weighted"
    if result.path is not None:
        assert_legal(result.path.cells, is_open)
        assert result.cost == pytest.approx(least, rel=1e-9)
        assert result.lower_bound <= least * (1 + 1e-9)
        assert result.gap == pytest.approx(0, abs=1e-9)
        assert result.cost >= result.path.length_m * (1 - 1e-12)
        assert cost_along(grid, layer, result.path.points) == pytest.approx(result.cost)
    closed = np.argwhere(rng.random(grid.shape) < 0.1)
    closed = closed[~(closed == start).all(axis=1) & ~(closed == goal).all(axis=1)]
    is_open[tuple(closed.T)] = False
    least = optimum_m(grid, layer, is_open, start)[goal]
    around = planner.plan(*ends, blocked={"cells": closed})
    assert around.solved == np.isfinite(least)
    if around.path is not None:
        assert_legal(around.path.cells, is_open)
        assert around.cost == pytest.approx(least, rel=1e-9)
        assert around.lower_bound <= least * (1 + 1e-9)


@tried(100, class_grids(max_side=24), seeds, st.booleans())
def test_the_any_angle_finish_never_raises_the_cost(classes, seed, off_centre):
    grid, layer, is_open, start, goal, rng = scene(classes, seed)
    planner = hn.HybridPlanner(topology_of(grid), preset="grid-astar", costs=layer)
    ends = grid.frame.points_of([start, goal])
    if off_centre:
        ends = ends + rng.uniform(-0.24, 0.24, (2, 2))
    cells = planner.plan(*ends, smooth="none")
    result = planner.plan(*ends, smooth="line-of-sight")
    assert result.status == cells.status
    if result.path is None or cells.path is None:
        return
    assert result.metric == "any-angle-weighted"
    points = result.path.points
    line = np.concatenate([ends[:1], cells.path.points[1:-1], ends[1:]])
    assert result.cost <= cost_along(grid, layer, line) + 1e-6  # positions are rounded
    assert result.cost == pytest.approx(cost_along(grid, layer, points), rel=1e-9, abs=1e-6)
    assert np.hypot(*(ends[1] - ends[0])) <= result.path.length_m * (1 + 1e-9)
    assert result.lower_bound <= result.cost
    assert (points[0] == ends[0]).all()
    if len(points) > 1:
        assert (points[-1] == ends[1]).all()
    shut = np.where(is_open, classes, hn.CellClass.OCCUPIED).astype(np.uint8)
    assert segment_faults(occupancy_grid(shut, resolution_m=0.5), points) == ()


def test_without_obstacles_and_costs_the_finish_is_the_straight_line() -> None:
    grid = grid_of(np.zeros((30, 40)), robot_radius_m=0)
    layer = layer_of(np.ones(grid.shape))
    planner = hn.HybridPlanner(topology_of(grid), preset="grid-astar", costs=layer)
    result = planner.plan((1.2, 2.3), (37.1, 20.4), smooth="line-of-sight")
    assert result.path.points.tolist() == [[1.2, 2.3], [37.1, 20.4]]
    assert result.gap == pytest.approx(0, abs=1e-9)


def corridor_map() -> hn.OccupancyGrid:
    """Walls, two doors: a narrow one on the straight line, a wide one farther off."""
    probability = np.zeros((60, 80))
    probability[[0, -1]] = probability[:, [0, -1]] = 1.0
    probability[1:20, 40] = probability[25:40, 40] = 1.0
    probability[20:25, 40] = 0.0
    return grid_of(probability, hn.Frame(0.1), robot_radius_m=0.1)


def test_the_preset_names_clearance_and_results_record_it() -> None:
    grid = corridor_map()
    topology = topology_of(grid)
    preset = hn.load_preset("grid-astar", overrides=["planner.costs.clearance.multiplier=4"])
    by_preset = hn.HybridPlanner(topology, preset=preset)
    layer = hn.CostLayer.clearance(grid, multiplier=4.0)
    by_layer = hn.HybridPlanner(topology, preset="grid-astar", costs=layer)
    first, second = (p.plan((2.0, 2.2), (6.0, 2.2)) for p in (by_preset, by_layer))
    assert first.cost == second.cost > first.raise_for_status().path.length_m
    source = {
        "kind": "clearance",
        "inflation_radius_m": 0.7,
        "scaling": 3.0,
        "inscribed_radius_m": 0.1,
        "multiplier": 4.0,
    }
    assert first.settings["costs"] == second.settings["costs"] == source
    answer = json.loads(json.dumps(first.to_dict(), allow_nan=False))
    assert answer["metric"] == "weighted"
    assert answer["cost"] == answer["lower_bound"] == first.cost
    assert answer["length_m"] < answer["cost"]
    assert answer["settings"]["costs"] == source
    both = hn.HybridPlanner(topology, preset=preset, costs=layer_of(np.full(grid.shape, 2.0)))
    assert (both.costs.factors == np.maximum(layer.factors, 2)).all()


def test_a_cheaper_route_takes_the_wide_door() -> None:
    grid = corridor_map()
    topology = topology_of(grid)
    shortest = hn.HybridPlanner(topology, preset="grid-astar").plan((3.0, 2.25), (5.0, 2.25))
    layer = hn.CostLayer.clearance(grid, multiplier=400.0)
    cheapest = hn.HybridPlanner(topology, preset="grid-astar", costs=layer).plan(
        (3.0, 2.25), (5.0, 2.25)
    )
    assert shortest.path.points[:, 1].max() < 2.6
    assert cheapest.path.points[:, 1].max() > 4.0
    assert shortest.path.length_m < cheapest.path.length_m
    assert cheapest.cost < cost_along(grid, layer, shortest.path.points)


def test_many_plans_are_those_of_plan() -> None:
    grid = corridor_map()
    layer = hn.CostLayer.clearance(grid)
    planner = hn.HybridPlanner(topology_of(grid), preset="grid-astar", costs=layer)
    rng = np.random.default_rng(0)
    starts, goals = rng.uniform(0, (8, 6), (2, 12, 2))
    for smooth in ("none", "line-of-sight"):
        batch = planner.plan_many(starts, goals, smooth=smooth)
        for i in range(12):
            alone = planner.plan(starts[i], goals[i], smooth=smooth)
            assert batch.status[i] == str(alone.status)
            assert batch.cost[i] == alone.cost
            assert batch.lower_bound[i] == alone.lower_bound


def test_the_corridor_of_paper_is_searched_by_costs() -> None:
    grid = corridor_map()
    layer = hn.CostLayer.clearance(grid)
    topology = topology_of(grid)
    best = hn.HybridPlanner(topology, preset="grid-astar", costs=layer)
    paper = hn.HybridPlanner(topology, preset="paper", costs=layer)
    for goal in ((6.0, 2.2), (7.5, 5.5), (3.5, 0.5)):
        result, least = paper.plan((2.0, 2.2), goal), best.plan((2.0, 2.2), goal)
        assert result.metric == "weighted"
        assert result.lower_bound <= least.cost * (1 + 1e-9)
        assert result.cost >= least.cost * (1 - 1e-9)
        assert result.cost == pytest.approx(cost_along(grid, layer, result.path.points))


def test_cells_that_costs_close_are_blocked_for_all_queries() -> None:
    grid = grid_of(np.zeros((9, 9)), robot_radius_m=0)
    closed = np.zeros(grid.shape, np.bool_)
    closed[2:7, 4] = True
    layer = layer_of(np.ones(grid.shape), closed)
    planner = hn.HybridPlanner(topology_of(grid), preset="grid-astar", costs=layer)
    assert planner.plan((4.5, 4.5), (0.5, 0.5)).status is hn.PlanStatus.START_BLOCKED
    assert planner.plan((0.5, 0.5), (4.5, 4.5)).status is hn.PlanStatus.GOAL_BLOCKED
    for smooth in ("none", "line-of-sight"):
        result = planner.plan((1.5, 4.5), (7.5, 4.5), smooth=smooth)
        assert not closed[tuple(result.path.cells.T)].any()
        shut = grid_of(closed.astype(float), robot_radius_m=0)
        assert segment_faults(shut, result.path.points) == ()
    assert not planner.plan(
        (1.5, 4.5), (7.5, 4.5), blocked={"cells": [(r, 4) for r in (0, 1, 7, 8)]}
    ).solved


def test_tours_choose_the_cells_of_rooms_by_costs_and_sum_them() -> None:
    probability = np.zeros((20, 31))
    grid = grid_of(probability, robot_radius_m=0)
    labels = np.full(grid.shape, -1, np.int32)
    labels[:, :10], labels[:, 20:] = 0, 1
    rooms = hn.RoomLabels(("west", "east"), labels)
    factors = np.full(grid.shape, 9.0)
    factors[16] = 1.0  # the only cheap way between the rooms
    topology = topology_of(grid, rooms)
    layer = layer_of(factors)
    planner = hn.HybridPlanner(topology, preset="grid-astar", costs=layer)
    result = planner.plan("west", "east")
    assert set(result.path.cells[:, 0]) == {16}
    assert result.cost == 11.0
    tour = hn.plan_tour(planner, [(5.5, 3.5), "east", (5.5, 18.5)])
    graph = weighted(move_graph(grid.enterable()), factors)
    there, back = (distances(graph, grid.shape, cell) for cell in ((3, 5), (18, 5)))
    least = (there + back)[labels == 1].min()
    assert tour.cost == pytest.approx(least, rel=1e-9)
    assert tour.gap == pytest.approx(0, abs=1e-9)
    assert tour.metric == "weighted"
    assert tour.to_dict()["cost"] == tour.cost > tour.length_m
    assert hn.plan_alternatives(planner, "west", "east", 2)[0].result.cost == result.cost


@pytest.mark.parametrize(
    ("costs", "message"),
    [
        (layer_of(np.ones((3, 4))), "costs of 4 x 3 cells are not those of a map of"),
        (np.ones((3, 4)), "of type ndarray, expected a CostLayer"),
    ],
)
def test_costs_of_another_map_are_refused(costs: Any, message: str) -> None:
    topology = topology_of(hn.example_map("figure1"))
    with pytest.raises(hn.errors.InvalidValueError, match=re.escape(message)):
        hn.HybridPlanner(topology, preset="grid-astar", costs=costs)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("planner.costs.clearance.multiplier=-1", "planner.costs.clearance.multiplier"),
        ("planner.costs.clearance.multiplier=1e4", "planner.costs.clearance.multiplier"),
        ("planner.costs.clearance.scaling=.nan", "planner.costs.clearance.scaling"),
        ("planner.costs.clearance.inflation_radius_m=.inf", "inflation_radius_m"),
        ("planner.costs.speed=x", "planner.costs.speed: unknown key; known are clearance"),
    ],
)
def test_settings_of_costs_out_of_range_are_refused(override: str, message: str) -> None:
    with pytest.raises(hn.errors.PresetError, match=re.escape(message)) as refused:
        hn.load_preset("grid-astar", overrides=[override])
    assert "\n" not in str(refused.value)


def test_a_corridor_that_costs_close_is_left_as_one_that_is_blocked_is() -> None:
    free = np.zeros((20, 41), dtype=np.bool_)
    free[1:-1, 1:20] = free[1:-1, 21:-1] = True
    free[3:6, 20] = free[14:17, 20] = True
    grid = grid_of(1.0 - free, robot_radius_m=0)
    closed = np.zeros(grid.shape, np.bool_)
    closed[3:6, 20] = True
    layer = layer_of(np.ones(grid.shape), closed)
    start, goal = grid.frame.points_of([(4, 15), (4, 25)])
    topology = topology_of(grid)
    shut = hn.HybridPlanner(topology, preset="paper", costs=layer).plan(start, goal)
    blocked = hn.HybridPlanner(topology, preset="paper").plan(
        start, goal, blocked={"cells": np.argwhere(closed)}
    )
    assert shut.solved
    assert shut.path.length_m == pytest.approx(blocked.cost)
