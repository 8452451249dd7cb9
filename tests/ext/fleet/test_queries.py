"""Queries over floors: alternatives, closures, changes, names, statuses, words, copies, threads."""

import copy
import itertools
import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from tests.ext.fleet.scenes import (
    Scene,
    optimum_any_angle,
    optimum_on_cells,
    random_building,
    usable,
)
from tests.houses import LIFT, STAIRS, two_rooms
from tests.plans import PLAIN

SEEDS = st.integers(0, 10**6)


def floor_of(name: str, names: tuple[str, str], **how: Any) -> hn.ext.fleet.Floor:
    """A floor with two rooms, `names`."""
    grid = two_rooms(f"map {name}")
    label_of = np.where(np.indices(grid.shape)[1] < 4, 0, 1)
    rooms = hn.RoomLabels(names, label_of)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0, rooms=rooms))
    return hn.ext.fleet.Floor(name, hn.HybridPlanner(topology, **how))


def office(**how: Any) -> hn.ext.fleet.Building:
    """Two floors: a lift in the left rooms, which one leaves to the east, and stairs."""
    floors = [floor_of("1", ("lab", "kitchen"), **how), floor_of("2", ("store", "kitchen"), **how)]
    lift = hn.ext.fleet.Link(
        name="west lift",
        kind="lift",
        ends=(hn.ext.fleet.LinkEnd("1", LIFT, 0.0), hn.ext.fleet.LinkEnd("2", LIFT, 0.0)),
        wait_s=2,
        max_radius_m=0.4,
    )
    stairs = hn.ext.fleet.Link(
        name="B",
        kind="stairs",
        ends=(hn.ext.fleet.LinkEnd("1", STAIRS), hn.ext.fleet.LinkEnd("2", STAIRS)),
        cost_m=3,
    )
    return hn.ext.fleet.Building(floors, [lift, stairs])


def sequences_of(links: list[hn.ext.fleet.Link]) -> list[tuple[hn.ext.fleet.Link, ...]]:
    """All sequences of different links, up to three of them."""
    return [chosen for count in range(4) for chosen in itertools.permutations(links, count)]


@PLAIN
@given(SEEDS)
def test_alternatives_are_the_cheapest_of_each_sequence_of_links(seed: int) -> None:
    scene = random_building(seed, preset="octile", most_floors=3, shape=(6, 7))
    building = scene.building
    building = hn.ext.fleet.Building(
        building.floors, building.links[:3], speed_m_s=building.speed_m_s
    )
    scene = replace(scene, building=building)
    start, goal = scene.somewhere(), scene.somewhere()
    found = building.alternatives(scene.named(start), scene.named(goal), 30, max_stretch=math.inf)
    cells = [grid.enterable() for grid in scene.grids]
    links = usable(scene, set(), stairs=True)
    costs = {}
    for chosen in sequences_of(links):
        cost = cheapest_by(scene, start, goal, chosen, cells)
        if math.isfinite(cost):
            costs[tuple(link.name for link in chosen)] = cost
    by_name = {tuple(ride.link.name for ride in plan.rides): plan.cost for plan in found}
    if not costs:
        assert not found[0].solved
        return
    assert by_name == pytest.approx(costs)
    assert [plan.cost for plan in found] == sorted(plan.cost for plan in found)
    best = building.plan(scene.named(start), scene.named(goal))
    assert {plan.lower_bound for plan in found} == {best.lower_bound}
    assert (found.complete, len(found)) == (True, len(costs))
    assert found.note.startswith(f"{len(costs)} of 30: no other sequence of links")
    near = building.alternatives(scene.named(start), scene.named(goal), 30, max_stretch=1.5)
    assert [plan.cost for plan in near] == [
        plan.cost for plan in found if plan.cost <= 1.5 * best.cost * (1 + 1e-12)
    ]


def test_a_search_that_stops_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    building = office()
    query = ("1", (1.5, 4.5)), ("2", (1.5, 4.5))
    two = building.alternatives(*query, 2, max_stretch=99.0)
    assert (len(two), two.complete, two.note) == (2, True, "")
    three = building.alternatives(*query, 3, max_stretch=99.0)
    assert (len(three), three.complete) == (2, True)
    assert (
        three.note == "2 of 3: no other sequence of links is at most 99 times as dear as the first"
    )
    monkeypatch.setattr("hybridnav.ext.fleet.search._MOST_LABELS", 4)
    stopped = building.alternatives(*query, 3, max_stretch=99.0)
    assert (len(stopped), stopped.complete) == (2, False)
    assert stopped.note == "the search stopped after 2 of 3 routes: there may be more"
    assert [plan.cost for plan in stopped] == [plan.cost for plan in two]
    none = building.alternatives(*query, 3, closed_links=["west lift", "B"])
    assert (len(none), none.complete, none.note) == (1, True, "no route was planned: no path")


def cheapest_by(
    scene: Scene, start: Any, goal: Any, links: tuple[hn.ext.fleet.Link, ...], cells: list[Any]
) -> float:
    """The cost of a cheapest route by a sequence of links: Dijkstra on layers, link by link."""
    best = {start[0]: [(0.0, start[1])]}
    names = [floor.name for floor in scene.building.floors]
    speed = scene.building.speed_m_s
    for link in links:
        arrived: dict[int, list[tuple[float, Any]]] = {}
        for one, other in itertools.permutations(range(len(link.ends)), 2):
            entered, left = link.ends[one], link.ends[other]
            index = names.index(entered.floor)
            cost = min(
                (
                    before + on_floor(scene, index, point, entered.position_m, cells)
                    for before, point in best.get(index, [])
                ),
                default=math.inf,
            )
            charge = link.cost_m + speed * (link.wait_s + link.ride_s * abs(one - other))
            if math.isfinite(cost):
                arrived.setdefault(names.index(left.floor), []).append(
                    (cost + charge, left.position_m)
                )
        best = arrived
    return min(
        (
            before + on_floor(scene, goal[0], point, goal[1], cells)
            for before, point in best.get(goal[0], [])
        ),
        default=math.inf,
    )


def on_floor(scene: Scene, index: int, start: Any, goal: Any, cells: list[Any]) -> float:
    """The cost on one floor, by Dijkstra."""
    alone = [grid & (number == index) for number, grid in enumerate(cells)]
    return optimum_on_cells(scene, (index, start), (index, goal), [], alone)


@PLAIN
@given(SEEDS)
def test_closures_on_floors_leave_no_false_bound(seed: int) -> None:
    scene = random_building(seed, preset="octile")
    building, rng = scene.building, scene.rng
    building.prepare()
    for _ in range(3):
        start, goal = scene.somewhere(), scene.somewhere()
        cells, blocked = [], {}
        for number, grid in enumerate(scene.grids):
            is_open = grid.enterable().copy()
            shut = np.argwhere(rng.random(grid.shape) < 0.15)
            if rng.random() < 0.7 and len(shut):
                is_open[tuple(shut.T)] = False
                blocked[building.floors[number].name] = {"cells": shut}
            cells.append(is_open)
        plan = building.plan(scene.named(start), scene.named(goal), blocked=blocked)
        links = usable(scene, set(), stairs=True)
        ends_shut = [
            not cells[index][scene.grids[index].frame.cell_of(*point)]
            for index, point in (start, goal)
        ]
        if any(ends_shut):
            expected = hn.PlanStatus.START_BLOCKED if ends_shut[0] else hn.PlanStatus.GOAL_BLOCKED
            assert plan.status is expected
            continue
        optimum = optimum_on_cells(scene, start, goal, links, cells)
        assert plan.cost == pytest.approx(optimum, abs=1e-9)
        assert plan.lower_bound == pytest.approx(optimum, abs=1e-9)
        again = building.plan(scene.named(start), scene.named(goal))
        whole = [grid.enterable() for grid in scene.grids]
        assert again.cost == pytest.approx(optimum_on_cells(scene, start, goal, links, whole))


@PLAIN
@given(SEEDS)
def test_a_changed_floor_is_followed(seed: int) -> None:
    scene = random_building(seed, most_floors=3)
    scene.building.prepare()
    start, goal = scene.somewhere(), scene.somewhere()
    keep = (
        {start[0]: [start[1]], goal[0]: [goal[1]]}
        if start[0] != goal[0]
        else {start[0]: [start[1], goal[1]]}
    )
    for link in scene.building.links:
        for end in link.ends:
            index = [floor.name for floor in scene.building.floors].index(end.floor)
            keep.setdefault(index, []).append(end.position_m)
    for number, floor in enumerate(scene.building.floors):
        grid = floor.planner.grid
        probability = np.array(grid.probability)
        probability[scene.rng.random(grid.shape) < 0.2] = 1.0
        probability[scene.rng.random(grid.shape) < 0.2] = 0.0
        for point in keep.get(number, []):
            probability[grid.frame.cell_of(*point)] = 0.0
        floor.planner.update(grid=replace(grid, probability=probability))
    plan = scene.building.plan(scene.named(start), scene.named(goal))
    optimum = optimum_any_angle(scene, start, goal, usable(scene, set(), stairs=True))
    assert plan.cost == pytest.approx(optimum, abs=1e-9)
    assert plan.lower_bound == pytest.approx(optimum, abs=1e-9)


def test_costs_of_cells_count_on_floors() -> None:
    building = office(preset="grid-astar", costs=hn.CostLayer(np.full((6, 9), 2.0)))
    before = building.plan(("1", (1.5, 2.5)), ("2", (2.5, 1.5)))
    assert before.metric == "weighted"
    assert before.cost == pytest.approx(2 * before.length_m + before.charge_m)
    planner = building.floor("2").planner
    planner.update(costs=hn.CostLayer(np.full((6, 9), 5.0)))
    after = building.plan(("1", (1.5, 2.5)), ("2", (2.5, 1.5)))
    assert after.cost == pytest.approx(before.cost + 3 * 1.0)
    assert after.gap == 0.0


def test_words_say_which_link_to_take_and_how_to_leave_it() -> None:
    building = office()
    up = building.plan(("1", (1.5, 3.5)), "store")
    assert up.words() == [
        "start in the lab with door 1 to the kitchen on the left",
        "after 2 m take the west lift to floor 2, go straight on",
        "you are there",
    ]
    over = building.plan(("1", (1.5, 3.5)), ("2", (1.5, 4.5)), closed_links=["B"])
    assert over.words()[1:] == [
        "after 2 m take the west lift to floor 2, turn left out of it",
        (
            "after 3 m you are at (1.5, 4.5) in the store, "
            "with door 1 to the kitchen behind you on the right"
        ),
    ]
    assert over.words("de")[1] == (
        "nach 2 m mit dem Aufzug „west lift“ auf Etage 2 fahren, beim Aussteigen links abbiegen"
    )
    lifts = [one.change for one in over.instructions if one.kind == "ride"]
    assert [change.to_dict() for change in lifts if change is not None] == [
        {"link": "west lift", "kind": "lift", "floor": "2", "has_exit": True}
    ]
    lengths = [one.at_m for one in over.instructions]
    assert lengths == sorted(lengths)
    assert lengths[-1] == pytest.approx(over.length_m)
    stairs = building.plan(("1", (7.5, 3.5)), ("2", (7.5, 2.5)))
    assert "take stairs B to floor 2" in stairs.words()[1]


def test_floors_without_rooms_have_the_rides_in_words() -> None:
    named = office()
    bare = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(two_rooms())))
    building = hn.ext.fleet.Building([named.floors[0], hn.ext.fleet.Floor("2", bare)], named.links)
    assert building.plan(("1", (1.5, 3.5)), ("2", (1.5, 4.5))).words() == [
        "start in the lab with door 1 to the kitchen on the left",
        "after 2 m take the west lift to floor 2",
        "after 3 m you are at (1.5, 4.5) on this floor",
    ]
    floors = [hn.ext.fleet.Floor(name, bare) for name in ("1", "2")]
    assert (
        hn.ext.fleet.Building(floors, named.links)
        .plan(("1", (1.5, 3.5)), ("2", (1.5, 4.5)))
        .words()
        == []
    )


@pytest.mark.parametrize("at", ["anywhere", "point"])
def test_rooms_are_named_by_the_floor_or_alone(at: Any) -> None:
    building = office()
    plan = building.plan("lab", "store", at=at)
    assert plan.start == ("1", "lab")
    assert plan.goal == ("2", "store")
    assert plan.gap == 0.0
    assert (plan.length_m == 0.0) == (at == "anywhere")
    assert building.plan(("1", "kitchen"), ("2", "kitchen")).solved
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"on floors 1 and 2: .* as in 1:kitchen, or"
    ):
        building.plan("kitchen", "lab")
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"no room .* 'kitchn'; did you|did you mean kit"
    ):
        building.plan("kitchn", "lab")
    with pytest.raises(hn.errors.InvalidValueError, match="no floor is called '3': there are 1, 2"):
        building.plan(("3", (1.0, 1.0)), "lab")


def test_who_may_use_a_link() -> None:
    building = office()
    start, goal = ("1", (1.5, 3.5)), ("2", (1.5, 4.5))
    lift = building.plan(start, goal)
    assert [ride.link.name for ride in lift.rides] == ["west lift"]
    stairs = building.plan(start, goal, closed_links=["west lift"])
    assert [ride.link.name for ride in stairs.rides] == ["B"]
    assert stairs.cost > lift.cost
    none = building.plan(start, goal, closed_links=["west lift"], stairs=False)
    assert none.status is hn.PlanStatus.NO_PATH
    assert math.isinf(none.lower_bound)
    assert none.to_dict()["cost"] is None
    with pytest.raises(hn.errors.PlanError, match="no route over floors was planned: no path"):
        none.raise_for_status()
    narrow = [replace(link, max_radius_m=0.1) for link in building.links]
    wide = [
        hn.ext.fleet.Floor(
            floor.name,
            hn.HybridPlanner(
                hn.TopologicalMap(
                    hn.DualGraphPyramid.build(
                        replace(floor.planner.grid, robot_radius_m=0.3, radius_is_default=False)
                    )
                )
            ),
        )
        for floor in building.floors
    ]
    assert not hn.ext.fleet.Building(wide, narrow).plan(start, goal).solved
    assert hn.ext.fleet.Building(wide, building.links).plan(start, goal).solved


def test_statuses_say_which_endpoint_is_at_fault() -> None:
    building = office()
    inside, wall, outside = (1.5, 3.5), (0.5, 0.5), (-5.0, 0.0)
    for start, goal, status in (
        (outside, inside, hn.PlanStatus.START_OUTSIDE),
        (inside, outside, hn.PlanStatus.GOAL_OUTSIDE),
        (wall, inside, hn.PlanStatus.START_OCCUPIED),
        (inside, wall, hn.PlanStatus.GOAL_OCCUPIED),
    ):
        plan = building.plan(("1", start), ("2", goal))
        assert plan.status is status
        assert plan.results == ()
        assert plan.words() == []
        assert math.isnan(plan.gap)


@pytest.mark.parametrize("seed", range(30))
def test_a_link_closed_on_a_floor_passes_it(seed: int) -> None:
    """Against a building with a link for each pair of its open ends."""
    scene = random_building(seed)
    building, links, closed = scene.building, [], set()
    for link in building.links:
        shut = {end.floor for end in link.ends if scene.rng.random() < 0.3}
        closed |= {f"{link.name}@{floor}" for floor in shut}
        stops = [(at, end) for at, end in enumerate(link.ends) if end.floor not in shut]
        for (i, one), (j, other) in itertools.combinations(stops, 2):
            name, ride_s = f"{link.name} {i} {j}", link.ride_s * (j - i)
            links.append(replace(link, name=name, ends=(one, other), ride_s=ride_s))
    pairs = hn.ext.fleet.Building(building.floors, links, speed_m_s=building.speed_m_s)
    for _ in range(5):
        ends = scene.named(scene.somewhere()), scene.named(scene.somewhere())
        plan, expected = building.plan(*ends, closed_links=closed), pairs.plan(*ends)
        assert plan.status is expected.status
        for ride in plan.rides:
            assert (
                not {f"{ride.link.name}@{at}" for at in (ride.from_floor, ride.to_floor)} & closed
            )
        if plan.solved:
            assert plan.cost == pytest.approx(expected.cost)
            assert plan.lower_bound == pytest.approx(expected.lower_bound)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"start": 7}, "start must be a floor and a point or name on it"),
        ({"start": ("1", (1.0,))}, "start must be two finite coordinates"),
        ({"goal": ("2", (math.nan, 1.0))}, "goal must be two finite coordinates"),
        ({"closed_links": "west lift"}, "must be a list of names of links"),
        ({"closed_links": ["west lft"]}, "no link is called 'west lft': did you mean west lift?"),
        ({"closed_links": ["B@3"]}, "no link is called 'B@3': did you mean B@2 or B@1"),
        ({"closed_links": [["B"]]}, "the name of a link is a text, got ['B']"),
        ({"blocked": {"4": {"doors": [1]}}}, "no floor is called '4'"),
        ({"blocked": {"1": {"doors": [99]}}}, "no door has the number 99"),
    ],
)
def test_mistakes_of_a_caller_are_one_line(asked: dict[str, Any], message: str) -> None:
    given_all = {"start": ("1", (1.5, 1.5)), "goal": ("2", (1.5, 1.5))} | asked
    start, goal = given_all.pop("start"), given_all.pop("goal")
    with pytest.raises(hn.errors.InvalidValueError) as refused:
        office().plan(start, goal, **given_all)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_floors_and_links_that_do_not_fit_are_refused() -> None:
    one, other = office().floors
    lift = office().links[0]
    shifted = replace(lift, ends=(lift.ends[0], hn.ext.fleet.LinkEnd("2", (4.5, 1.5))))
    far = replace(lift, ends=(lift.ends[0], hn.ext.fleet.LinkEnd("2", (40.0, 1.5))))
    unknown = replace(lift, ends=(lift.ends[0], hn.ext.fleet.LinkEnd("3", (1.5, 1.5))))
    octile = hn.ext.fleet.Floor("3", hn.HybridPlanner(other.planner.topology, preset="octile"))
    cases: list[tuple[list[hn.ext.fleet.Floor], list[hn.ext.fleet.Link], str]] = [
        ([], [], "at least one floor"),
        ([one, one], [], "floor 1: the name is given twice"),
        ([one, other], [lift, lift], "link west lift: the name is given twice"),
        ([one, other], [shifted], r"\(4.5, 1.5\) on floor 2 lies in an occupied cell"),
        ([one, other], [far], r"\(40, 1.5\) on floor 2 lies outside the map"),
        ([one, other], [unknown], "no floor is called '3': there are 1, 2"),
        ([one, octile], [], "floor 3 is planned by preset octile and floor 1 by shortest"),
    ]
    for floors, links, message in cases:
        with pytest.raises(hn.errors.InvalidValueError, match=message):
            hn.ext.fleet.Building(floors, links)
    for name in ("", " ", "a\nb", "x" * 81):
        with pytest.raises(hn.errors.InvalidValueError):
            hn.ext.fleet.Floor(name, one.planner)
    for speed in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(hn.errors.InvalidValueError, match="speed_m_s"):
            hn.ext.fleet.Building([one], speed_m_s=speed)


def test_copies_and_pickles_answer_alike() -> None:
    building = office()
    building.prepare()
    plan = building.plan("lab", ("2", "kitchen"))
    for twin in (copy.deepcopy(building), pickle.loads(pickle.dumps(building))):  # noqa: S301 - ours
        again = twin.plan("lab", ("2", "kitchen"))
        assert (again.cost, again.lower_bound) == (plan.cost, plan.lower_bound)
        assert again.words() == plan.words()
    kept = pickle.loads(pickle.dumps(plan))  # noqa: S301 - ours
    assert kept.words() == plan.words()
    assert kept.to_dict() == plan.to_dict()


def test_threads_share_a_building() -> None:
    scene = random_building(11)
    alone = random_building(11)
    pairs = [(scene.somewhere(), scene.somewhere()) for _ in range(40)]
    expected = [alone.building.plan(scene.named(a), scene.named(b)).cost for a, b in pairs]
    with ThreadPoolExecutor(4) as pool:
        found = list(
            pool.map(lambda pair: scene.building.plan(*map(scene.named, pair)).cost, pairs)
        )
    np.testing.assert_allclose(found, expected)
