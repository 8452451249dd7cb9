"""Cheapest plans at any angle: legal, priced and bounded as other programs say, and the same after
changes of costs and maps as those of a planner that is made anew."""

import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from shapely import Polygon
from shapely import box as area

import hybridnav as hn
from hybridnav.harness.judges import segment_faults
from hybridnav.maps.costs import cost_along
from tests.layers import grid_of, layer_of
from tests.oracle.any_angle_cost import SidePoints
from tests.planning.test_costs import optimum_m, random_layer, scene, topology_of
from tests.strategies import class_grids, occupancy_grid, seeds, tried


def preset_of() -> hn.Preset:
    """Method `cheapest`, without costs of its own and without arcs."""
    return hn.load_preset("octile", overrides=["planner.method=cheapest"])


def check(result: hn.PlanResult, state: tuple[Any, Any, Any], ends: Any, cells: Any) -> None:
    """The path is legal, costs what it says, and no path costs less than its bound.

    A state is a map, the costs of its cells, and which of these may be entered.
    """
    grid, layer, is_open = state
    least = optimum_m(grid, layer, is_open, cells[0])[cells[1]]
    assert result.solved == np.isfinite(least)
    if result.path is None:
        assert result.status is hn.PlanStatus.NO_PATH
        assert result.lower_bound == np.inf
        return
    points = result.path.points
    assert result.metric == "any-angle-weighted"
    assert (points[0] == ends[0]).all()
    assert (points[-1] == ends[1]).all() or cells[0] == cells[1]
    shut = np.where(is_open, hn.CellClass.FREE, hn.CellClass.OCCUPIED).astype(np.uint8)
    assert segment_faults(occupancy_grid(shut, resolution_m=grid.resolution_m), points) == ()
    passed = result.path.cells
    assert is_open[tuple(passed.T)].all()
    assert passed[[0, -1]].tolist() == [list(cells[0]), list(cells[1])]
    assert np.abs(np.diff(passed, axis=0)).max(initial=0) <= 1
    assert result.cost == pytest.approx(cost_along(grid, layer, points), rel=1e-9, abs=1e-6)
    assert np.hypot(*(ends[1] - ends[0])) <= result.lower_bound * (1 + 1e-9)
    assert result.lower_bound <= result.cost
    if (ends == grid.frame.points_of(list(cells))).all():
        assert result.lower_bound <= least * (1 + 1e-9)


def told(result: hn.PlanResult) -> tuple[Any, ...]:
    """All that may not depend on what was asked before."""
    points = None if result.path is None else result.path.points.tolist()
    return result.status, result.cost, result.lower_bound, points


@tried(25, class_grids(max_side=12), seeds)
def test_paths_are_legal_and_no_path_is_below_their_bound(classes: Any, seed: int) -> None:
    grid, layer, is_open, start, goal, rng = scene(classes, seed)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset_of(), costs=layer)
    ends = grid.frame.points_of([start, goal]) + rng.uniform(-0.24, 0.24, (2, 2))
    result = planner.plan(*ends)
    check(result, (grid, layer, is_open), ends, (start, goal))
    first, last = (tuple(at) for at in grid.frame.positions_of(ends).tolist())
    least = SidePoints(is_open, layer.factors).cost(first, last) * grid.resolution_m
    assert result.lower_bound <= least * (1 + 1e-9)
    # The graph has few points on a side, and takes no line along one from cell to cell.
    assert result.solved == np.isfinite(least)
    closed = np.argwhere(rng.random(grid.shape) < 0.1)
    closed = closed[~(closed == start).all(axis=1) & ~(closed == goal).all(axis=1)]
    is_open[tuple(closed.T)] = False
    around = planner.plan(*ends, blocked={"cells": closed})
    check(around, (grid, layer, is_open), ends, (start, goal))
    assert told(planner.plan(*ends)) == told(result)
    assert told(planner.plan(*ends, blocked={"cells": closed})) == told(around)


def test_paths_cost_little_more_than_the_best_that_a_fine_graph_finds() -> None:
    """Rooms with costs of clearance, small enough for a solver of another kind."""
    excess = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        probability = np.zeros((40, 56))
        probability[:, 28] = probability[20] = 1.0
        for row in (rng.integers(4, 14), rng.integers(23, 33)):
            probability[row : row + 5, 28] = 0.0
        for col in (rng.integers(4, 22), rng.integers(31, 49)):
            probability[20, col : col + 5] = 0.0
        grid = grid_of(probability, hn.Frame(0.05), robot_radius_m=0)
        layer = hn.CostLayer.clearance(grid, inflation_radius_m=0.35, inscribed_radius_m=0.05)
        planner = hn.HybridPlanner(topology_of(grid), preset=preset_of(), costs=layer)
        is_open = grid.enterable()
        free = np.argwhere(is_open)
        pair = free[rng.integers(len(free), size=2)]
        found = planner.plan(*grid.frame.points_of(pair)).cost
        first, last = (tuple((at + 0.5).tolist()) for at in pair)
        least = SidePoints(is_open, layer.factors).cost(first, last) * grid.resolution_m
        excess.append(found / least - 1)
    assert min(excess) >= -0.02  # the other solver's own error
    assert np.mean(excess) <= 0.02
    assert max(excess) <= 0.04


@tried(40, class_grids(max_side=20), seeds, st.booleans(), st.booleans())
def test_answers_follow_updates_as_a_planner_made_anew(classes, seed, prepared, has_own):
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    preset = preset_of()
    if has_own:
        preset = hn.load_preset(preset, overrides=["planner.costs.clearance.multiplier=3"])
    layer = random_layer(grid.shape, rng)
    topology = topology_of(grid)
    planner = hn.HybridPlanner(topology, preset=preset, costs=layer)
    factors = layer.factors.astype(float)
    closed = np.zeros(grid.shape, np.bool_) if layer.closed is None else layer.closed.copy()
    if prepared:
        planner.prepare()
    cells = np.argwhere(grid.enterable())
    for _ in range(4):
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
        fresh = hn.HybridPlanner(topology, preset=preset, costs=layer_of(factors, closed))
        for start, goal in (
            cells[rng.integers(len(cells), size=(3, 2))].tolist() if len(cells) else []
        ):
            ends = grid.frame.points_of([start, goal])
            result = planner.plan(*ends)
            assert told(result) == told(fresh.plan(*ends))
            if closed[tuple(start)] or closed[tuple(goal)]:
                assert result.status in {hn.PlanStatus.START_BLOCKED, hn.PlanStatus.GOAL_BLOCKED}
                continue
            assert fresh.costs is not None
            check(result, (grid, fresh.costs, is_open), ends, (tuple(start), tuple(goal)))
            shut = cells[rng.random(len(cells)) < 0.1]
            shut = shut[~(shut == start).all(axis=1) & ~(shut == goal).all(axis=1)]
            is_left = is_open.copy()
            is_left[tuple(shut.T)] = False
            around = planner.plan(*ends, blocked={"cells": shut})
            check(around, (grid, fresh.costs, is_left), ends, (tuple(start), tuple(goal)))
            assert told(around) == told(fresh.plan(*ends, blocked={"cells": shut}))
        if rng.random() < 0.3:
            planner.prepare()


@tried(20, class_grids(max_side=20), seeds, st.booleans())
def test_a_changed_map_is_planned_on_as_by_a_planner_made_anew(classes, seed, has_own):
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    chosen = preset_of()
    layer = None if has_own else hn.CostLayer((1 + 3 * rng.random(grid.shape)).astype(np.float32))
    if has_own:
        named = chosen.planner.model_copy(update={"costs": hn.load_preset("robot").planner.costs})
        chosen = chosen.model_copy(update={"planner": named})
    planner = hn.HybridPlanner(topology_of(grid), preset=chosen, costs=layer)
    first = grid
    planner.prepare()
    for turn in range(4):
        probability = grid.probability.copy()
        row, col = (int(rng.integers(side)) for side in grid.shape)
        box = np.s_[row : row + rng.integers(1, 6), col : col + rng.integers(1, 6)]
        probability[box] = rng.choice([0.0, 1.0], probability[box].shape)
        grid = first if turn == 3 else replace(grid, probability=probability)
        # Places are not needed: a changed grid is enough.
        planner.update(**({"grid": grid} if turn % 2 else {"topology": topology_of(grid)}))
        fresh = hn.HybridPlanner(topology_of(grid), preset=chosen, costs=layer)
        costs = hn.CostLayer.clearance(grid) if layer is None else layer
        is_open = grid.enterable()
        cells = np.argwhere(is_open)
        for start, goal in cells[rng.integers(len(cells), size=(3 if len(cells) else 0, 2))]:
            ends = grid.frame.points_of([start, goal])
            result = planner.plan(*ends)
            assert told(result) == told(fresh.plan(*ends))
            check(result, (grid, costs, is_open), ends, (tuple(start), tuple(goal)))


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
    assert around.path.points[:, 1].max() > 16
    assert around.settings["costs"] == {
        "kind": "changed",
        "of": [{"kind": "array"}, {"kind": "door"}],
    }
    planner.update(costs=layer_of(np.ones(grid.shape)), changed=(10.0, 0.0, 10.5, 5.0))
    assert told(planner.plan((5.0, 2.0), (15.0, 2.0))) == told(before)


def test_a_planner_of_lengths_takes_costs_later() -> None:
    grid = halls()
    metrics = {"grid-astar": ("octile", "weighted"), "paper": ("octile", "weighted")}
    for preset in (preset_of(), "grid-astar", "paper"):
        planner = hn.HybridPlanner(topology_of(grid), preset=preset)
        name = preset if isinstance(preset, str) else ""
        first, then = metrics.get(name, ("any-angle", "any-angle-weighted"))
        assert planner.plan((5.0, 2.0), (15.0, 2.0)).metric == first
        planner.update(costs=layer_of(np.full(grid.shape, 2.0)))
        result = planner.plan((5.0, 2.0), (15.0, 2.0))
        assert result.metric == then
        assert result.cost == pytest.approx(20.0)


def test_large_factors_are_planned_by() -> None:
    probability = np.zeros((60, 60))
    probability[1::4, :-1] = probability[3::4, 1:] = 1.0  # one long winding corridor
    grid = grid_of(probability, hn.Frame(0.5), robot_radius_m=0)
    layer = layer_of(np.full(grid.shape, 1000.0))
    planner = hn.HybridPlanner(topology_of(grid), preset=preset_of(), costs=layer)
    result = planner.plan((0.25, 0.25), (0.25, 29.25))
    plain = hn.HybridPlanner(topology_of(grid), preset="grid-astar", costs=layer)
    assert result.cost <= plain.plan((0.25, 0.25), (0.25, 29.25)).cost
    assert result.gap < 0.1


def test_threads_finish_by_the_costs_before_or_after_an_update() -> None:
    """Each answer is that of one of two states, and each batch that of one alone."""
    grid = halls(60)
    topology = topology_of(grid)
    layers = [
        layer_of(np.random.default_rng(seed).uniform(1, 4, grid.shape).round()) for seed in (1, 2)
    ]
    free = np.argwhere(grid.enterable())
    pairs = grid.frame.points_of(free[np.random.default_rng(3).integers(len(free), size=(12, 2))])
    starts, goals = pairs[:, 0], pairs[:, 1]
    alone = [hn.HybridPlanner(topology, preset=preset_of(), costs=layer) for layer in layers]
    costs = [planner.plan_many(starts, goals).cost.tolist() for planner in alone]
    assert all(a != b for a, b in zip(*costs, strict=True))
    planner = hn.HybridPlanner(topology, preset=preset_of(), costs=layers[0])
    wrong, seen, done = [], set(), threading.Event()

    def ask(seed: int) -> None:
        rng = np.random.default_rng(seed)
        while not done.is_set():
            pair = int(rng.integers(len(pairs)))
            one = planner.plan(*pairs[pair]).cost
            many = planner.plan_many(starts, goals).cost.tolist()
            if one not in (costs[0][pair], costs[1][pair]) or many not in costs:
                wrong.append((pair, one, many))
            else:
                seen.add(costs.index(many))

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
    assert seen


@pytest.mark.parametrize("preset", ["shortest", "octile", "robot", "grid-astar"])
def test_a_progress_callback_may_plan(preset: str) -> None:
    grid = halls()
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    costs: list[float] = []
    planner.prepare(progress=lambda *_: costs.append(planner.plan((5.0, 2.0), (15.0, 2.0)).cost))
    assert costs
    assert costs == pytest.approx([planner.plan((5.0, 2.0), (15.0, 2.0)).cost] * len(costs))


@pytest.mark.parametrize("is_built", [False, True])
def test_a_progress_callback_may_change_costs(is_built: bool) -> None:
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
        fresh = hn.HybridPlanner(topology, preset=preset_of(), costs=planner.costs)
        assert told(planner.plan(*ends)) == told(fresh.plan(*ends))
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
    ends, cells = np.array([(0.5, 0.5), (15.5, 11.5)]), ((0, 0), (11, 15))
    for _ in range(3):
        check(planner.plan(*ends), (grid, twice, grid.enterable()), ends, cells)
        planner.prepare()
    planner.update(topology=topology_of(walls))
    assert planner.plan((0.5, 0.5), (15.5, 11.5)).status is hn.PlanStatus.START_OCCUPIED
    planner.prepare()
    planner.update(topology=topology_of(grid), costs=twice)
    check(planner.plan(*ends), (grid, twice, grid.enterable()), ends, cells)
