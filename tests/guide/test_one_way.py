"""Tours, alternatives, words, profiles and the agent on a map whose doors are passed one way."""

from dataclasses import replace

import pytest

import hybridnav as hn
from hybridnav.closures.one_way import directions_on

RULES = tuple(map(hn.OneWayRule.of, ("door:2=room-17", "door:7=room-8")))
"""Into room-17 by door 2, out of it by door 7."""


@pytest.fixture(scope="module")
def planner() -> hn.HybridPlanner:
    grid = hn.example_map("office")
    rooms = replace(hn.find_rooms(grid), one_way=RULES)
    return hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms)))


def doors_of(tour: hn.Tour) -> list[int]:
    return [leg.door.number for leg in tour.legs if leg.door is not None]


def assert_obeys(planner: hn.HybridPlanner, tour: hn.Tour) -> None:
    directed = directions_on(planner.topology)
    assert directed is not None
    for result in tour.results:
        assert not directed.meets(result.path.cells)


def test_a_tour_goes_in_by_one_door_and_out_by_the_other(planner: hn.HybridPlanner) -> None:
    tour = hn.plan_tour(planner, ["room-8", "room-17", "room-8"], at="point")
    assert tour.solved
    assert doors_of(tour) == [2, 7]
    assert_obeys(planner, tour)
    assert any("room-17" in line for line in tour.words("en"))


def test_alternatives_obey(planner: hn.HybridPlanner) -> None:
    found = hn.plan_alternatives(planner, "room-17", "room-6", 3, at="point")
    assert len(found) > 1
    for each in found:
        assert doors_of(each.tour)[0] == 7
        assert_obeys(planner, each.tour)


def test_profiles_and_closures_of_a_query_keep_the_rules(planner: hn.HybridPlanner) -> None:
    staff = hn.under(planner, "staff")
    for one in (planner, staff):
        for blocked in (None, hn.Blocked(rooms=["room-1"])):
            tour = hn.plan_tour(one, ["room-17", "room-8"], at="point", blocked=blocked)
            assert doors_of(tour) == [7]
            shut = (blocked or hn.Blocked()) | hn.Blocked(doors=[7])
            assert not hn.plan_tour(one, ["room-17", "room-8"], at="point", blocked=shut).solved
    shut = hn.Blocked(doors=[7])
    words = hn.explain(planner, "room-17", "room-8", blocked=shut).words("en")
    assert any("door 7" in line or "door 2" in line for line in words)
