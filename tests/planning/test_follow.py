"""Planners that follow a changed map: optima by independent judges after each change, threads,
interrupts, closures, and what is refused."""

import pickle
import threading
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import VisibilityGraph, segment_faults
from tests.interrupts import Struck, lines_of
from tests.layers import layer_of
from tests.oracle.grid import assert_legal, distances, move_graph
from tests.strategies import class_grids, occupancy_grid, seeds, tried

FOLLOWING = "shortest", "octile", "grid-astar"
REBUILT = ("paper",)


def topology_of(grid: hn.OccupancyGrid) -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))


def with_box(
    grid: hn.OccupancyGrid, rng: np.random.Generator
) -> tuple[hn.OccupancyGrid, tuple[float, float, float, float]]:
    """The map with a box of other probabilities, and the area of the box in metres."""
    probability = grid.probability.copy()
    row, col = (int(rng.integers(side)) for side in grid.shape)
    box = np.s_[row : row + rng.integers(1, 6), col : col + rng.integers(1, 6)]
    probability[box] = rng.choice([[0.0], [1.0], [0.0, 0.0, 0.5, 1.0]][rng.integers(3)], 1)
    if rng.random() < 0.3:
        probability[box] = rng.choice([0.0, 1.0], probability[box].shape)
    high = row + probability[box].shape[0], col + probability[box].shape[1]
    corners = grid.frame.points_of_grid([(row, col), high])
    return replace(grid, probability=probability), (*corners[0], *corners[1])


def check(planner: hn.HybridPlanner, grid: hn.OccupancyGrid, rng: np.random.Generator) -> None:
    """Hold that answers on the map are legal and optimal, and that no bound lies above."""
    free = grid.enterable()
    cells = np.argwhere(free)
    if not len(cells):
        return
    visible, moves = VisibilityGraph(grid), move_graph(free)
    for start, goal in cells[rng.integers(len(cells), size=(4, 2))]:
        result = planner.plan(*grid.frame.points_of([start, goal]))
        cell, last = tuple(start.tolist()), tuple(goal.tolist())
        least = distances(moves, free.shape, cell)[last] * grid.resolution_m
        assert result.solved == np.isfinite(least)
        if result.path is None:
            assert result.lower_bound == np.inf
            continue
        if result.metric == "any-angle":
            least = visible.shortest(cell, last).length_m
            assert not segment_faults(grid, result.path.points)
        else:
            assert_legal(result.path.cells, free)
        assert result.lower_bound <= least * (1 + 1e-9)
        if planner.preset.name == "paper":
            assert result.cost >= least * (1 - 1e-9)
        else:
            assert result.cost == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize("preset", FOLLOWING)
@tried(30, class_grids(max_side=24), seeds)
def test_answers_after_each_change_are_optimal(preset: str, classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = replace(occupancy_grid(classes, resolution_m=0.5), robot_radius_m=rng.choice([0, 0.6]))
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    check(planner, grid, rng)
    for turn in range(5):
        grid, area = with_box(grid, rng)
        planner.update(grid=grid, changed=area if turn % 2 == 0 else None)
        check(planner, grid, rng)
        if rng.random() < 0.5:
            planner.prepare()
            check(planner, grid, rng)


@pytest.mark.parametrize("seed", range(3))
def test_answers_of_octile_after_changes_are_those_of_a_planner_made_anew(seed: int) -> None:
    rng = np.random.default_rng(seed)
    classes = (rng.random((70, 90)) > 0.05).astype(np.uint8)
    grid = occupancy_grid(classes, resolution_m=0.5)
    planner, maps = hn.HybridPlanner(grid, preset="octile"), [grid]
    planner.prepare()
    for turn in range(8):
        grid, area = with_box(grid, rng) if turn % 4 else (maps[0], None)
        maps.append(grid)
        planner.update(grid=grid, changed=area)
        fresh, cells = hn.HybridPlanner(grid, preset="octile"), np.argwhere(grid.enterable())
        for start, goal, shut in cells[rng.integers(len(cells), size=(12, 3))]:
            ends, line = grid.frame.points_of([start, goal]), grid.frame.points_of([start, shut])
            one_way = hn.OneWay(lines=[line.tolist()]) if (start != shut).any() else None
            for closed in ({}, {"blocked": {"cells": [tuple(shut)]}}, {"one_way": one_way}):
                found, expected = (each.plan(*ends, **closed) for each in (planner, fresh))
                assert (found.status, found.cost) == (expected.status, expected.cost)
                assert found.lower_bound == expected.lower_bound
                if found.path is not None:
                    assert found.path.cells.tobytes() == expected.path.cells.tobytes()
                    assert found.path.points.tobytes() == expected.path.points.tobytes()


@pytest.mark.parametrize("preset", REBUILT)
@tried(8, class_grids(max_side=16), seeds)
def test_presets_on_places_follow_with_the_places_of_now(preset, classes, seed):
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    for _ in range(2):
        new, area = with_box(grid, rng)
        with pytest.raises(hn.errors.InvalidValueError, match="plans on the places of its map"):
            planner.update(grid=new, changed=area)
        check(planner, grid, rng)
        grid = new
        planner.update(topology=topology_of(grid), changed=area)
        check(planner, grid, rng)


@pytest.mark.parametrize("preset", FOLLOWING)
def test_closed_cells_are_avoided_after_a_change(preset: str) -> None:
    grid = hn.OccupancyGrid(np.zeros((12, 21), np.float32), robot_radius_m=0)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    ends = (0.5, 6.5), (20.5, 6.5)
    assert planner.plan(*ends).cost == 20
    probability = np.zeros((12, 21), np.float32)
    probability[:, 10] = 1.0
    probability[[1, 10], 10] = 0.0
    grid = replace(grid, probability=probability)
    planner.update(grid=grid, changed=(10.0, 0.0, 11.0, 12.0))
    both = planner.plan(*ends)
    closed = planner.plan(*ends, blocked={"cells": [(10, 10)]})
    assert closed.cost > both.cost
    expected = hn.HybridPlanner(topology_of(grid), preset=preset)
    assert closed.cost == pytest.approx(expected.plan(*ends, blocked={"cells": [(10, 10)]}).cost)


def test_results_have_no_route_until_the_places_of_now_are_given() -> None:
    grid = hn.OccupancyGrid(np.zeros((6, 30), np.float32), robot_radius_m=0)
    planner = hn.HybridPlanner(topology_of(grid), preset="shortest")
    probability = np.zeros((6, 30), np.float32)
    probability[:5, 15] = 1.0
    now = replace(grid, probability=probability)
    planner.update(grid=now, changed=(15.0, 0.0, 16.0, 5.0))
    ends = (0.5, 0.5), (29.5, 0.5)
    assert planner.plan(*ends).route is None
    for blocked in ({"places": [0]}, {"arcs": [0]}, {"rooms": ["kitchen"]}):
        with pytest.raises(hn.errors.InvalidValueError, match="the map changed after its places"):
            planner.plan(*ends, blocked=blocked)
    with pytest.raises(hn.errors.InvalidValueError, match="the map changed after its places"):
        planner.plan("kitchen", ends[1])
    copied = pickle.loads(pickle.dumps(planner))  # noqa: S301 - of this test
    assert copied.plan(*ends).cost == planner.plan(*ends).cost
    planner.update(topology=topology_of(now))
    route = planner.plan(*ends).route
    assert len(route.places) > 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"probability": np.zeros((6, 7), np.float32)}, "a shape of cells"),
        ({"frame": hn.Frame(0.5)}, "a frame"),
        ({"corner_cutting": True}, "corner_cutting"),
    ],
)
def test_another_map_is_refused_and_changes_nothing(change: dict[str, Any], message: str) -> None:
    grid = hn.OccupancyGrid(np.zeros((6, 6), np.float32), robot_radius_m=0)
    planner = hn.HybridPlanner(topology_of(grid), preset="octile")
    with pytest.raises(hn.errors.InvalidValueError, match=message):
        planner.update(grid=replace(grid, **change))
    assert planner.plan((0.5, 0.5), (5.5, 0.5)).cost == 5
    other = replace(grid, probability=np.ones((6, 6), np.float32))
    with pytest.raises(hn.errors.InvalidValueError, match="different maps"):
        planner.update(grid=other, topology=topology_of(grid))


@pytest.mark.parametrize("preset", FOLLOWING)
@pytest.mark.parametrize("kind", ["mask", "box"])
def test_changes_outside_the_stated_area_are_refused(preset: str, kind: str) -> None:
    probability = np.zeros((20, 30), np.float32)
    probability[:, 15], probability[10, 15] = 1.0, 0.0
    grid = hn.OccupancyGrid(probability, robot_radius_m=0)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    before = planner.plan((4.5, 4.5), (24.5, 4.5)).cost
    probability[[10, 3], 15] = 1.0, 0.0  # the door closes, another one opens
    now = hn.OccupancyGrid(probability, robot_radius_m=0)
    for area in ((15.0, 3.0, 16.0, 4.0), (40.0, 40.0, 50.0, 50.0)):
        cells = np.zeros(grid.shape, np.bool_)
        cells[3, 15] = area[0] < 40
        with pytest.raises(hn.errors.InvalidValueError, match="cells changed outside") as error:
            planner.update(grid=now, changed=cells if kind == "mask" else area)
        assert "\n" not in str(error.value)
        assert planner.plan((4.5, 4.5), (24.5, 4.5)).cost == before
    planner.update(grid=now, changed=(15.0, 3.0, 16.0, 11.0))
    assert planner.plan((4.5, 4.5), (24.5, 4.5)).cost < before


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "no costs, grid or topology, expected one of them"),
        ({"grid": 3}, "grid is 3 of type int, expected an OccupancyGrid"),
        ({"topology": "x"}, "topology is 'x' of type str, expected a TopologicalMap"),
    ],
)
def test_updates_by_nothing_or_by_other_things_are_refused(given, message):
    grid = hn.OccupancyGrid(np.zeros((6, 6), np.float32), robot_radius_m=0)
    planner = hn.HybridPlanner(topology_of(grid), preset="octile")
    with pytest.raises(hn.errors.InvalidValueError, match=message):
        planner.update(**given)


@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_an_interrupted_update_leaves_the_map_before_or_now(preset: str) -> None:
    grid = hn.OccupancyGrid(np.zeros((10, 20), np.float32), robot_radius_m=0)
    probability = np.zeros((10, 20), np.float32)
    probability[:9, 10] = 1.0
    now = replace(grid, probability=probability)
    topology, ends = topology_of(grid), ((0.5, 0.5), (19.5, 0.5))
    for _ in range(2):  # the first time loads more
        planner = hn.HybridPlanner(topology, preset=preset)
        planner.plan(*ends)
        count = lines_of(partial(planner.update, grid=now))
        costs = [19.0, planner.plan(*ends).cost]
    for strike_at in np.linspace(1, count, 60).astype(int).tolist():
        planner = hn.HybridPlanner(topology, preset=preset)
        planner.plan(*ends)
        with pytest.raises(Struck):
            lines_of(partial(planner.update, grid=now), strike_at=strike_at)
        assert planner.plan(*ends).cost in costs
        planner.update(grid=now)
        assert planner.plan(*ends).cost == costs[1]


@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_plans_of_threads_are_those_of_one_version(preset: str) -> None:
    grid = hn.OccupancyGrid(np.zeros((30, 60), np.float32), robot_radius_m=0)
    maps = [grid]
    for hole in (3, 15, 27):
        probability = np.zeros((30, 60), np.float32)
        probability[:, 30] = 1.0
        probability[hole, 30] = 0.0
        maps.append(replace(grid, probability=probability))
    ends = (0.5, 10.5), (59.5, 20.5)
    fresh = [hn.HybridPlanner(topology_of(each), preset=preset) for each in maps]
    costs = [each.plan(*ends).cost for each in fresh]
    planner, found, done = hn.HybridPlanner(topology_of(grid), preset=preset), [], threading.Event()

    def ask() -> None:
        while not done.is_set():
            found.append(planner.plan(*ends).cost)

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for turn in range(40):
        planner.update(grid=maps[turn % 4], changed=(30.0, 0.0, 31.0, 30.0))
    done.set()
    for thread in threads:
        thread.join()
    assert all(min(abs(cost - each) for each in costs) < 1e-9 for cost in found)


@pytest.mark.full
@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
@pytest.mark.parametrize("preset", FOLLOWING)
def test_a_real_map_that_changes(preset: str, data: Path) -> None:
    grid = hn.load_map(data / "nav2/maps/depot.yaml", robot_radius_m=0.25)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    rng = np.random.default_rng(0)
    planner.plan((0.0, 0.0), (1.0, 1.0))
    for _ in range(10):
        grid, area = with_box(grid, rng)
        planner.update(grid=grid, changed=area)
        fresh = hn.HybridPlanner(topology_of(grid), preset=preset)
        cells = np.argwhere(grid.enterable())
        for start, goal in cells[rng.integers(len(cells), size=(30, 2))]:
            ends = grid.frame.points_of([start, goal])
            found, expected = planner.plan(*ends), fresh.plan(*ends)
            assert found.status is expected.status
            assert found.cost == pytest.approx(expected.cost, rel=1e-9)
            assert found.lower_bound <= expected.cost * (1 + 1e-9)


def test_costs_of_a_preset_are_those_of_the_map_now() -> None:
    grid = hn.OccupancyGrid(np.zeros((20, 40), np.float32), hn.Frame(0.1), robot_radius_m=0)
    topology = topology_of(grid)
    planner = hn.HybridPlanner(topology, preset="robot")
    ends = (0.05, 1.05), (3.95, 1.05)
    planner.plan(*ends)
    probability = np.zeros((20, 40), np.float32)
    probability[8:12, 15:25] = 1.0
    now = topology_of(replace(grid, probability=probability))
    planner.update(topology=now, changed=(1.5, 0.8, 2.5, 1.2))
    expected = hn.HybridPlanner(now, preset="robot").plan(*ends)
    found = planner.plan(*ends)
    assert found.cost == pytest.approx(expected.cost, rel=1e-9)
    planner.prepare()
    assert planner.plan(*ends).lower_bound <= expected.cost * (1 + 1e-9)


def with_speckles(grid: hn.OccupancyGrid, rng: np.random.Generator) -> hn.OccupancyGrid:
    """The map with some obstacles elsewhere."""
    return replace(grid, probability=(rng.random(grid.shape) < 0.12).astype(np.float32))


def factors_of(grid: hn.OccupancyGrid, rng: np.random.Generator) -> hn.CostLayer:
    """A layer of random factors that closes some cells."""
    return layer_of(rng.uniform(1, 6, grid.shape), rng.random(grid.shape) < 0.05)


@pytest.mark.parametrize("preset", ["robot", "paper", "grid-astar"])
@tried(6, seeds, st.booleans())
def test_given_costs_stay_with_their_cells_on_a_changed_map(preset, seed, prepared):
    """A planner that followed answers as one that is made of the map and the costs of now."""
    rng = np.random.default_rng(seed)
    blank = hn.OccupancyGrid(np.zeros((20, 30), np.float32), hn.Frame(0.1), robot_radius_m=0)
    grid = with_speckles(blank, rng)
    factors: Any = np.ones(grid.shape)
    closed: Any = np.zeros(grid.shape, np.bool_)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    for turn in range(4):
        if prepared:
            planner.prepare()
        given = factors_of(grid, rng)
        if turn != 1:  # the second turn brings no costs
            rows = slice(0, 20) if turn == 0 else slice(5, 12)
            factors[rows] = given.factors[rows]
            closed[rows] = False if given.closed is None else given.closed[rows]
        grid = with_speckles(grid, rng) if turn != 2 else grid  # the third one no map
        planner.update(
            costs=None if turn == 1 else given,
            topology=None if turn == 2 else topology_of(grid),
            changed=(0.0, 0.5, 3.0, 1.2) if turn == 2 else None,
        )
        if turn == 3:
            factors, closed = given.factors, given.closed
        fresh = hn.HybridPlanner(topology_of(grid), preset=preset, costs=layer_of(factors, closed))
        assert planner.costs.digest == fresh.costs.digest
        cells = np.argwhere(grid.enterable())
        for ends in grid.frame.points_of(cells[rng.integers(len(cells), size=8)]).reshape(4, 2, 2):
            found, expected = planner.plan(*ends), fresh.plan(*ends)
            assert found.status is expected.status
            assert found.cost == expected.cost
            assert found.lower_bound == expected.lower_bound


def test_costs_of_an_area_stay_when_the_map_changes_beside_it() -> None:
    grid = hn.OccupancyGrid(np.zeros((20, 40), np.float32), hn.Frame(0.1), robot_radius_m=0)
    planner = hn.HybridPlanner(topology_of(grid), preset="robot")
    slow = layer_of(np.full(grid.shape, 5.0))
    planner.update(costs=slow, changed=(1.0, 0.0, 2.0, 1.0))
    probability = np.zeros(grid.shape, np.float32)
    probability[15:, 30] = 1.0
    now = topology_of(replace(grid, probability=probability))
    planner.update(topology=now)
    expected = hn.CostLayer.clearance(now.grid).factors.copy()
    expected[:10, 10:20] = np.maximum(expected[:10, 10:20], 5.0)
    assert np.array_equal(planner.costs.factors, expected)


BAD_UPDATES: dict[str, tuple[dict[str, Any], str]] = {
    "costs of another map": ({"costs": layer_of(np.ones((3, 3)))}, "costs of 3 x 3 cells"),
    "no costs": ({"costs": np.ones((20, 30))}, "expected a CostLayer"),
    "no area": ({"changed": "all of it"}, "expected an area in metres"),
    "an area elsewhere": ({"changed": (50.0, 50.0, 51.0, 51.0)}, "cells changed outside"),
    "a mask of another map": ({"changed": np.ones((3, 3), np.bool_)}, "a mask of shape"),
    "no grid": ({"grid": np.ones((20, 30))}, "expected an OccupancyGrid"),
    "no topology": ({"topology": "office"}, "expected a TopologicalMap"),
}


@pytest.mark.parametrize("bad", BAD_UPDATES)
@pytest.mark.parametrize("preset", [*FOLLOWING, *REBUILT, "robot"])
@pytest.mark.parametrize("is_prepared", [False, True])
def test_a_refused_update_changes_nothing(preset, bad, is_prepared):
    rng = np.random.default_rng(1)
    blank = hn.OccupancyGrid(np.zeros((20, 30), np.float32), hn.Frame(0.1), robot_radius_m=0)
    before = topology_of(with_speckles(blank, rng))
    by_costs = preset not in {"shortest", "octile"}
    costs = factors_of(blank, rng) if by_costs else None
    planner = hn.HybridPlanner(before, preset=preset, costs=costs)
    cells = np.argwhere(before.grid.enterable())
    pairs = before.grid.frame.points_of(cells[rng.integers(len(cells), size=12)]).reshape(6, 2, 2)
    if is_prepared:
        planner.prepare()
    plans = [planner.plan(*pair) for pair in pairs]
    state = planner.topology, planner.costs, planner.prepared
    now = topology_of(with_speckles(blank, rng))
    given: dict[str, Any] = {"topology": now, "grid": now.grid}
    if by_costs:
        given["costs"] = factors_of(blank, rng)
    if preset in FOLLOWING:
        del given["topology"]
    wrong, message = BAD_UPDATES[bad]
    if not by_costs and bad == "costs of another map":
        message = "costs of 3 x 3 cells|cannot plan by costs"
    with pytest.raises(hn.errors.InvalidValueError, match=message):
        planner.update(**{**given, **wrong})
    held = planner.topology, planner.costs, planner.prepared
    assert all(one is other for one, other in zip(held, state, strict=True))
    for pair, plan in zip(pairs, plans, strict=True):
        again = planner.plan(*pair)
        assert (again.status, again.cost) == (plan.status, plan.cost)
        assert again.lower_bound == plan.lower_bound
        assert again.settings == plan.settings
        assert (again.route is None) == (plan.route is None)
    planner.update(**given)
    fresh = hn.HybridPlanner(now, preset=preset, costs=given.get("costs"))
    for pair in pairs:
        assert planner.plan(*pair).status is fresh.plan(*pair).status


@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_costs_that_a_preset_cannot_plan_by_refuse_the_map_too(preset: str) -> None:
    grid = hn.OccupancyGrid(np.zeros((6, 6), np.float32), robot_radius_m=0)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    probability = np.zeros((6, 6), np.float32)
    probability[:, 3] = 1.0
    now = replace(grid, probability=probability)
    with pytest.raises(hn.errors.InvalidValueError, match="cannot plan by costs"):
        planner.update(grid=now, costs=layer_of(np.ones((6, 6))))
    assert planner.plan((0.5, 0.5), (5.5, 0.5)).cost == 5
    assert planner.grid is grid
