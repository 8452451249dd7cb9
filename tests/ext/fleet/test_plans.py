"""Routes over floors: against Dijkstra on the joined floors, and every figure counted again."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from tests.ext.fleet.scenes import (
    Scene,
    Where,
    charge,
    optimum_any_angle,
    optimum_on_cells,
    random_building,
    random_link,
    usable,
)
from tests.plans import PLAIN
from tests.strategies import full_but

SEEDS = st.integers(0, 10**6)


def drawn_conditions(scene: Scene) -> tuple[set[str], bool]:
    closed = {link.name for link in scene.building.links if scene.rng.random() < 0.2}
    return closed, bool(scene.rng.random() < 0.8)


def asked(scene: Scene) -> tuple[hn.ext.fleet.BuildingPlan, Where, Where, list[hn.ext.fleet.Link]]:
    """Return a plan of a drawn question, its ends, and the links that it may use."""
    start, goal = scene.somewhere(), scene.somewhere()
    closed, stairs = drawn_conditions(scene)
    ends = scene.named(start), scene.named(goal)
    plan = scene.building.plan(*ends, closed_links=closed, stairs=stairs)
    return plan, start, goal, usable(scene, closed, stairs=stairs)


def check_figures(
    scene: Scene,
    plan: hn.ext.fleet.BuildingPlan,
    start: Where,
    goal: Where,
    links: list[hn.ext.fleet.Link],
) -> None:
    """Count every figure of a route again from its parts."""
    building = scene.building
    assert len(plan.results) == len(plan.floors) == len(plan.rides) + 1
    at: tuple[str, Any]
    at, cost, seconds = scene.named(start), 0.0, 0.0
    for number, (floor, result) in enumerate(zip(plan.floors, plan.results, strict=True)):
        assert floor == at[0]
        assert result.path is not None
        assert result.start is not None
        assert result.goal is not None
        assert math.dist(result.start, at[1]) < 1e-9
        cost += result.cost
        assert result.lower_bound <= result.cost
        if number == len(plan.rides):
            assert floor == scene.named(goal)[0]
            assert math.dist(result.goal, goal[1]) < 1e-9
            break
        ride = plan.rides[number]
        assert ride.link in links
        assert ride.from_floor == floor
        entered, left = ride.link.end_on(floor), ride.link.end_on(ride.to_floor)
        assert math.dist(result.goal, entered.position_m) < 1e-9
        order = [end.floor for end in ride.link.ends]
        ends = order.index(floor), order.index(ride.to_floor)
        assert ride.charge_m == pytest.approx(charge(ride.link, *ends, building.speed_m_s))
        cost += ride.charge_m
        seconds += ride.seconds
        at = ride.to_floor, left.position_m
    length_m = sum(r.path.length_m for r in plan.results if r.path is not None)
    assert plan.length_m == pytest.approx(length_m)
    assert plan.cost == pytest.approx(cost)
    assert plan.travel_s == pytest.approx(length_m / building.speed_m_s + seconds)
    assert plan.lower_bound <= plan.cost
    figures = plan.to_dict()
    assert figures["cost"] == plan.cost
    assert [ride["link"] for ride in figures["rides"]] == [ride.link.name for ride in plan.rides]


@PLAIN
@given(SEEDS)
def test_shortest_is_exact(seed: int) -> None:
    scene = random_building(seed)
    for _ in range(4):
        plan, start, goal, links = asked(scene)
        optimum = optimum_any_angle(scene, start, goal, links)
        if math.isinf(optimum):
            assert plan.status is hn.PlanStatus.NO_PATH
            assert math.isinf(plan.lower_bound)
            continue
        assert plan.cost == pytest.approx(optimum, abs=1e-9)
        assert plan.gap == 0.0
        check_figures(scene, plan, start, goal, links)


@pytest.mark.parametrize("preset", ["octile", "grid-astar", "paper"])
@PLAIN
@given(SEEDS)
def test_cells(preset: str, seed: int) -> None:
    scene = random_building(seed, preset=preset)
    is_exact = preset != "paper"
    for _ in range(3):
        plan, start, goal, links = asked(scene)
        cells = [grid.enterable() for grid in scene.grids]
        optimum = optimum_on_cells(scene, start, goal, links, cells)
        assert plan.lower_bound <= optimum + 1e-9
        assert plan.cost >= optimum - 1e-9
        if plan.solved:
            check_figures(scene, plan, start, goal, links)
        if is_exact:
            assert plan.solved == math.isfinite(optimum)
            assert plan.cost == pytest.approx(optimum, abs=1e-9)
            assert not plan.gap > 0


@pytest.mark.parametrize("charged", full_but([True], [True, False]))
def test_hundreds_of_links(charged: bool) -> None:
    """The best of 300 links, also where rides cost nothing and floors have closed cells."""
    scene = random_building(11, preset="octile", most_floors=4, shape=(24, 28))
    floors, rng = scene.building.floors, scene.rng
    links = [random_link(f"link {number}", floors, rng) for number in range(300)]
    if not charged:
        links = [replace(link, wait_s=0.0, ride_s=0.0, cost_m=0.0) for link in links]
    scene = replace(scene, building=hn.ext.fleet.Building(floors, links, speed_m_s=0.5))
    rides = 0
    for query in range(8):
        start, goal = scene.somewhere(), scene.somewhere()
        cells, blocked = [grid.enterable().copy() for grid in scene.grids], {}
        if query > 3:
            shut = np.argwhere(cells[0] & (rng.random(cells[0].shape) < 0.1))
            cells[0][tuple(shut.T)] = False
            blocked = {floors[0].name: {"cells": shut}}
            if not all(
                cells[index][scene.grids[index].frame.cell_of(*point)]
                for index, point in (start, goal)
            ):
                continue
        plan = scene.building.plan(scene.named(start), scene.named(goal), blocked=blocked)
        optimum = optimum_on_cells(scene, start, goal, usable(scene, set(), stairs=True), cells)
        assert plan.cost == pytest.approx(optimum, abs=1e-9)
        assert plan.lower_bound == pytest.approx(optimum, abs=1e-9)
        assert plan.solved == math.isfinite(optimum)
        if plan.solved and not blocked:
            check_figures(scene, plan, start, goal, usable(scene, set(), stairs=True))
        rides += len(plan.rides)
    assert rides > 3


def test_a_floor_with_many_ends_is_prepared_without_all_pairs() -> None:
    """A million plans between the ends of 1,000 links would take minutes."""
    scene = random_building(11, most_floors=2, shape=(24, 28))
    floors, rng = scene.building.floors[:2], scene.rng
    links = [random_link(f"link {number}", floors, rng) for number in range(200)]
    many, few = (hn.ext.fleet.Building(floors, some) for some in (links, links[:10]))
    many.prepare()
    few.prepare()
    assert all(np.isnan(known.cost).all() for known in many.known)
    assert not any(np.isnan(known.cost[0, 1:]).any() for known in few.known)


@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_no_path_on_a_floor_without_links(preset: str) -> None:
    """Floors 0 and 1 are joined, and floor 2 is by itself."""
    for seed in range(30):
        scene = random_building(seed, preset=preset, most_floors=2)
        alone = random_building(seed + 100, preset=preset, most_floors=2)
        extra = replace(alone.building.floors[0], name="alone")
        building = hn.ext.fleet.Building((*scene.building.floors, extra), scene.building.links)
        scene = replace(scene, building=building)
        cells = [grid.enterable() for grid in scene.grids]
        at = len(cells) - 1
        free = np.argwhere(cells[at])
        points = scene.grids[at].frame.points_of(free[scene.rng.choice(len(free), 2)])
        start, goal = (at, points[0]), (at, points[1])
        plan = building.plan(scene.named(start), scene.named(goal))
        assert plan.solved == math.isfinite(optimum_on_cells(scene, start, goal, [], cells))
