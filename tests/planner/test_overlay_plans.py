"""Plans on the overlay: least costs as scipy finds them, before and after it is built, and changes
of costs between and beside queries."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon
from shapely import box as area

import hybridnav as hn
from hybridnav.maps.costs import cost_along
from tests.layers import grid_of, layer_of
from tests.oracle.grid import assert_legal, distances, move_graph
from tests.planner.test_costs import optimum_m, random_layer, scene, seeds, topology_of
from tests.search.test_grid_search import weighted
from tests.strategies import class_grids, examples, occupancy_grid

ROUNDING = 1e-4
"""Share of a cost by which the overlay's integers may miss the least one."""


def preset_of(*, epsilon: float | None = None) -> hn.Preset:
    """`coarse: overlay`, without costs of its own."""
    given = [] if epsilon is None else [f"planner.epsilon={epsilon}"]
    return hn.load_preset("octile", overrides=["planner.method=cheapest", *given])


def check(result: hn.PlanResult, least: float, is_open: Any, *, epsilon: float = 0.0) -> None:
    """The path is legal, costs at most epsilon more than the least, and its bound holds."""
    assert result.metric == "weighted"
    assert result.solved == np.isfinite(least)
    if result.path is None:
        assert result.lower_bound == np.inf
        return
    assert_legal(result.path.cells, is_open)
    assert result.lower_bound <= least * (1 + 1e-9)
    assert least * (1 - 1e-9) <= result.cost <= least * (1 + epsilon) * (1 + ROUNDING)
    assert result.gap <= epsilon + 2 * ROUNDING


@given(
    class_grids(max_side=20),
    seeds,
    st.sampled_from([0.0, 0.1]),
)
@settings(max_examples=examples(60), deadline=None)
def test_paths_are_the_cheapest_with_proof_before_and_after_preparation(
    classes: Any, seed: int, epsilon: float
) -> None:
    grid, layer, is_open, start, goal, rng = scene(classes, seed)
    preset = preset_of(epsilon=epsilon)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset, costs=layer)
    ends = grid.frame.points_of([start, goal])
    least = optimum_m(grid, layer, is_open, start)[goal]
    check(planner.plan(*ends), least, is_open, epsilon=epsilon)
    planner.prepare()
    result = planner.plan(*ends)
    check(result, least, is_open, epsilon=epsilon)
    if result.path is not None:
        assert cost_along(grid, layer, result.path.points) == pytest.approx(result.cost)
    closed = np.argwhere(rng.random(grid.shape) < 0.1)
    closed = closed[~(closed == start).all(axis=1) & ~(closed == goal).all(axis=1)]
    is_open[tuple(closed.T)] = False
    least = optimum_m(grid, layer, is_open, start)[goal]
    check(planner.plan(*ends, blocked={"cells": closed}), least, is_open, epsilon=epsilon)


@given(class_grids(max_side=20), seeds, st.booleans(), st.booleans())
@settings(max_examples=examples(60), deadline=None)
def test_answers_follow_updates_exactly(
    classes: Any,
    seed: int,
    prepared: bool,  # noqa: FBT001 - drawn
    has_own: bool,  # noqa: FBT001 - drawn
) -> None:
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    preset = [preset_of(), hn.load_preset("grid-astar")][rng.integers(2)]
    if has_own:
        preset = hn.load_preset(preset, overrides=["planner.costs.clearance.multiplier=3"])
    layer = random_layer(grid.shape, rng)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset, costs=layer)
    own = hn.CostLayer.clearance(grid, multiplier=3.0).factors if has_own else np.ones(grid.shape)
    factors = layer.factors.astype(float)
    closed = np.zeros(grid.shape, np.bool_) if layer.closed is None else layer.closed.copy()
    if prepared:
        planner.prepare()
    cells = np.argwhere(grid.enterable())
    for _ in range(5):
        new = random_layer(grid.shape, rng)
        rows, cols = (np.sort(rng.integers(0, size + 1, 2)) for size in grid.shape)
        inside = slice(*rows), slice(*cols)
        if rows[0] < rows[1] and cols[0] < cols[1]:
            factors[inside] = new.factors[inside]
            closed[inside] = False if new.closed is None else new.closed[inside]
            corners = grid.frame.points_of([(rows[0], cols[0]), (rows[1] - 1, cols[1] - 1)])
            low, high = corners.min(axis=0) - 0.2, corners.max(axis=0) + 0.2
            planner.update(costs=new, changed=area(*low, *high))
        is_open = grid.enterable() & ~closed
        graph = weighted(move_graph(is_open), np.maximum(own, factors))
        for start, goal in (
            cells[rng.integers(len(cells), size=(3, 2))].tolist() if len(cells) else []
        ):
            ends = grid.frame.points_of([start, goal])
            result = planner.plan(*ends)
            if closed[tuple(start)] or closed[tuple(goal)]:
                assert result.status in {hn.PlanStatus.START_BLOCKED, hn.PlanStatus.GOAL_BLOCKED}
                continue
            least = distances(graph, grid.shape, tuple(start))[tuple(goal)] * grid.resolution_m
            check(result, least, is_open)
            near = planner.plan(*ends, smooth="line-of-sight")
            assert near.solved == result.solved
            assert near.cost <= result.cost * (1 + 1e-9) or not near.solved
            shut = cells[rng.random(len(cells)) < 0.1]
            shut = shut[~(shut == start).all(axis=1) & ~(shut == goal).all(axis=1)]
            is_left = is_open.copy()
            is_left[tuple(shut.T)] = False
            costs = weighted(move_graph(is_left), np.maximum(own, factors))
            least = distances(costs, grid.shape, tuple(start))[tuple(goal)] * grid.resolution_m
            check(planner.plan(*ends, blocked={"cells": shut}), least, is_left)
        if rng.random() < 0.3:
            planner.prepare()


@given(class_grids(max_side=20), seeds, st.booleans())
@settings(max_examples=examples(20), deadline=None)
def test_a_changed_map_is_taken_into_the_overlay_that_was_built(
    classes: Any,
    seed: int,
    has_own: bool,  # noqa: FBT001 - drawn
) -> None:
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    chosen = preset_of()
    layer = None if has_own else hn.CostLayer((1 + 3 * rng.random(grid.shape)).astype(np.float32))
    if has_own:
        named = chosen.planner.model_copy(update={"costs": hn.load_preset("robot").planner.costs})
        chosen = chosen.model_copy(update={"planner": named})
    planner = hn.HybridPlanner(topology_of(grid), preset=chosen, costs=layer)
    was_built = bool(grid.enterable().any())
    planner.prepare()
    for _ in range(3):
        probability = grid.probability.copy()
        row, col = (int(rng.integers(side)) for side in grid.shape)
        box = np.s_[row : row + rng.integers(1, 6), col : col + rng.integers(1, 6)]
        probability[box] = rng.choice([0.0, 1.0], probability[box].shape)
        grid = replace(grid, probability=probability)
        planner.update(topology=topology_of(grid))
        costs = hn.CostLayer.clearance(grid) if layer is None else layer
        is_open = grid.enterable()
        cells = np.argwhere(is_open)
        for start, goal in cells[rng.integers(len(cells), size=(3 if len(cells) else 0, 2))]:
            result = planner.plan(*grid.frame.points_of([start, goal]))
            check(result, optimum_m(grid, costs, is_open, tuple(start))[tuple(goal)], is_open)
            assert not was_built or set(result.stats.seconds) >= {"search"}
            assert "overlay" not in result.stats.seconds


def halls(n: int = 40) -> hn.OccupancyGrid:
    """Two halls with two doors between them."""
    probability = np.zeros((n, n))
    probability[:, n // 2] = 1.0
    probability[[4, 5, 34, 35], n // 2] = 0.0
    return grid_of(probability, hn.Frame(0.5), robot_radius_m=0)


def test_a_closed_door_opens_again_and_results_name_the_change() -> None:
    grid = halls()
    planner = hn.HybridPlanner(
        topology_of(grid), preset=preset_of(), costs=layer_of(np.ones(grid.shape))
    )
    planner.prepare()
    before = planner.plan((5.0, 2.0), (15.0, 2.0))
    closed = np.zeros(grid.shape, np.bool_)
    closed[:10] = True
    shut = hn.CostLayer(np.ones(grid.shape, np.float32), closed, {"kind": "door"})
    planner.update(costs=shut, changed=(10.0, 0.0, 10.5, 5.0))
    around = planner.plan((5.0, 2.0), (15.0, 2.0))
    assert around.path is not None
    assert around.path.points[:, 1].max() > 16
    assert around.gap <= ROUNDING
    assert around.settings["costs"] == {
        "kind": "changed",
        "of": [{"kind": "array"}, {"kind": "door"}],
    }
    planner.update(costs=layer_of(np.ones(grid.shape)), changed=(10.0, 0.0, 10.5, 5.0))
    assert planner.plan((5.0, 2.0), (15.0, 2.0)).cost == before.cost


def test_a_planner_of_lengths_takes_costs_later() -> None:
    grid = halls()
    for preset in (preset_of(), "grid-astar", "paper"):
        planner = hn.HybridPlanner(topology_of(grid), preset=preset)
        assert planner.plan((5.0, 2.0), (15.0, 2.0)).metric == "octile"
        planner.update(costs=layer_of(np.full(grid.shape, 2.0)))
        result = planner.plan((5.0, 2.0), (15.0, 2.0))
        assert result.metric == "weighted"
        assert result.cost == 20.0


def test_the_overlay_is_built_once_queries_have_spent_as_much() -> None:
    grid = halls(60)
    layer = layer_of(np.random.default_rng(1).uniform(1, 4, grid.shape))
    planner = hn.HybridPlanner(topology_of(grid), preset=preset_of(), costs=layer)
    free = np.argwhere(grid.enterable())
    stages = []
    for pair in free[np.random.default_rng(0).integers(len(free), size=(400, 2))]:
        result = planner.plan(*grid.frame.points_of(pair))
        assert result.gap <= 2 * ROUNDING
        stages.append(set(result.stats.seconds))
    assert "refine" in stages[0]
    assert sum("overlay" in stage for stage in stages) == 1
    assert "search" in stages[-1]


def test_factors_too_large_for_the_overlay_are_planned_by_on_the_grid() -> None:
    probability = np.zeros((60, 60))
    probability[1::4, :-1] = probability[3::4, 1:] = 1.0  # one long winding corridor
    grid = grid_of(probability, hn.Frame(0.5), robot_radius_m=0)
    layer = layer_of(np.full(grid.shape, 1000.0))
    planner = hn.HybridPlanner(topology_of(grid), preset=preset_of(), costs=layer)
    planner.prepare()
    result = planner.plan((0.25, 0.25), (0.25, 29.25))
    plain = hn.HybridPlanner(topology_of(grid), preset="grid-astar", costs=layer)
    assert result.cost == plain.plan((0.25, 0.25), (0.25, 29.25)).cost


def test_threads_finish_by_the_costs_before_or_after_an_update() -> None:
    """Each answer is the optimum of one of two states, and each batch that of one alone."""
    grid = halls(60)
    topology = topology_of(grid)
    layers = [
        layer_of(np.random.default_rng(seed).uniform(1, 4, grid.shape).round()) for seed in (1, 2)
    ]
    free = np.argwhere(grid.enterable())
    pairs = grid.frame.points_of(free[np.random.default_rng(3).integers(len(free), size=(12, 2))])
    starts, goals = pairs[:, 0], pairs[:, 1]
    optima = [
        hn.HybridPlanner(topology, preset="grid-astar", costs=layer).plan_many(starts, goals).cost
        for layer in layers
    ]
    assert (np.abs(optima[0] / optima[1] - 1) > 10 * ROUNDING).all()
    planner = hn.HybridPlanner(topology, preset=preset_of(), costs=layers[0])
    planner.prepare()
    wrong, seen, done = [], set(), threading.Event()

    def is_of(state: int, cost: Any, bound: Any, pair: Any) -> Any:
        least = optima[state][pair]
        return (np.abs(cost / least - 1) <= ROUNDING) & (bound <= least * (1 + 1e-9))

    def ask(seed: int) -> None:
        rng = np.random.default_rng(seed)
        while not done.is_set():
            pair = int(rng.integers(len(pairs)))
            one = planner.plan(*pairs[pair])
            many = planner.plan_many(starts, goals)
            states = [
                [state for state in range(2) if is_of(state, one.cost, one.lower_bound, pair)],
                [
                    state
                    for state in range(2)
                    if is_of(state, many.cost, many.lower_bound, slice(None)).all()
                ],
            ]
            if [] in states:
                wrong.append((pair, one.cost, many.cost))
            seen.update(states[1])

    threads = [threading.Thread(target=ask, args=(seed,), daemon=True) for seed in range(3)]
    for thread in threads:
        thread.start()
    for turn in range(40):
        planner.update(costs=layers[(turn + 1) % 2])
    done.set()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)
    assert not wrong
    assert seen == {0, 1}


@pytest.mark.parametrize("preset", ["shortest", "octile", "robot", "grid-astar"])
def test_a_progress_callback_may_plan(preset: str) -> None:
    grid = halls()
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    costs: list[float] = []
    planner.prepare(progress=lambda *_: costs.append(planner.plan((5.0, 2.0), (15.0, 2.0)).cost))
    assert costs
    assert costs == pytest.approx([planner.plan((5.0, 2.0), (15.0, 2.0)).cost] * len(costs))


@pytest.mark.parametrize("is_built", [False, True])
def test_a_progress_callback_may_change_costs(is_built: bool) -> None:  # noqa: FBT001 - drawn
    grid = halls(60)
    layers = [
        layer_of(np.random.default_rng(seed).uniform(1, 4, grid.shape).round()) for seed in (1, 2)
    ]
    topology, ends = topology_of(grid), ((2.0, 2.0), (28.0, 28.0))
    planner = hn.HybridPlanner(topology, preset=preset_of(), costs=layers[0])
    if is_built:
        planner.prepare()
        planner.update(costs=layers[1])
        planner.update(costs=layers[0])
    left = [layers[1], layers[0], layers[1]]
    planner.prepare(progress=lambda *_: planner.update(costs=left.pop()) if left else None)
    for _ in range(2):
        exact = hn.HybridPlanner(topology, preset="grid-astar", costs=planner.costs).plan(*ends)
        found = planner.plan(*ends)
        assert planner.costs is not None
        assert found.cost == pytest.approx(exact.cost, rel=ROUNDING)
        assert found.lower_bound <= exact.cost * (1 + 1e-9)
        planner.prepare()


@pytest.mark.parametrize(
    "changed",
    [
        (0, 0, 1),
        (0, 0, np.nan, 1),
        (2, 0, 1, 1),
        "here",
        (0, 0, np.inf, 1),
        {"cells": [[0, 0]]},
        Polygon(),
        np.ones((2, 2), np.bool_),
        [np.ones((2, 2))] * 4,
    ],
)
def test_an_area_of_a_change_that_is_none_is_refused_in_one_line(changed: Any) -> None:
    grid = halls()
    planner = hn.HybridPlanner(topology_of(grid), preset="grid-astar")
    with pytest.raises(hn.errors.InvalidValueError, match="changed is") as refused:
        planner.update(costs=layer_of(np.ones(grid.shape)), changed=changed)
    assert "\n" not in str(refused.value)
    assert planner.costs is None


@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_a_preset_that_knows_lengths_only_refuses_updates(preset: str) -> None:
    grid = halls()
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    with pytest.raises(hn.errors.InvalidValueError, match="cannot plan by costs"):
        planner.update(costs=layer_of(np.ones(grid.shape)))
    with pytest.raises(hn.errors.InvalidValueError, match="are not those of a map of"):
        planner.update(costs=layer_of(np.ones((2, 2))))


def test_closed_cells_that_make_paths_too_long_leave_the_search_of_the_grid() -> None:
    grid = occupancy_grid(np.ones((2, 200), np.uint8))
    factors, closed = np.ones(grid.shape, np.float32), np.zeros(grid.shape, np.bool_)
    factors[1], closed[0, 5:195] = 1000.0, True
    planner = hn.HybridPlanner(
        topology_of(grid), preset="robot", costs=hn.CostLayer(factors, closed=closed)
    )
    planner.prepare()
    ends = grid.frame.points_of([(0, 0), (0, 199)])
    graph = weighted(move_graph(~closed), factors.astype(float))
    least = distances(graph, grid.shape, (0, 0))[0, 199] * grid.resolution_m
    assert planner.plan(*ends, smooth="none").cost >= least * (1 - 1e-9)


@pytest.mark.parametrize("shut_by", ["costs", "nothing"])
def test_a_map_without_a_free_cell_opens_after_preparation(shut_by: str) -> None:
    """Prepared while no cell may be entered, opened by a map, and then by costs."""
    walls = grid_of(np.ones((12, 16)), robot_radius_m=0)
    ones = np.ones(walls.shape, np.float32)
    shut = layer_of(ones, np.full(walls.shape, shut_by == "costs"))
    planner = hn.HybridPlanner(topology_of(walls), preset=preset_of(), costs=shut)
    planner.prepare()
    grid = grid_of(np.zeros((12, 16)), robot_radius_m=0)
    planner.update(topology=topology_of(grid))
    twice = layer_of(2 * ones)
    planner.update(costs=twice)
    for _ in range(3):
        result = planner.plan((0.5, 0.5), (15.5, 11.5))
        least = optimum_m(grid, twice, grid.enterable(), (0, 0))[11, 15]
        check(result, least, grid.enterable())
        planner.prepare()
    planner.update(topology=topology_of(walls))
    assert planner.plan((0.5, 0.5), (15.5, 11.5)).status is hn.PlanStatus.START_OCCUPIED
    planner.prepare()
    planner.update(topology=topology_of(grid), costs=twice)
    check(planner.plan((0.5, 0.5), (15.5, 11.5)), least, grid.enterable())
