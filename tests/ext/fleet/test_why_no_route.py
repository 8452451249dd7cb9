"""Why there is no route over floors: what would have to open, or where an end lies."""

import math
import re
from dataclasses import replace

import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, PlanError
from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd
from tests.drawn_rooms import HOUSE, house, topology_of

KITCHEN, LAB = (1.25, 5.75), (19.75, 6.25)


def building(upper=None, *, links=("lift", "stairs")):
    """Two floors of the house with a lift and stairs in the corridor."""
    floors = [Floor("1", house()), Floor("2", upper or house())]
    at = {"lift": (1.0, 3.0), "stairs": (20.0, 3.0)}
    ends = {name: tuple(LinkEnd(floor, at[name]) for floor in ("1", "2")) for name in links}
    return Building(floors, [Link(name=name, kind=name, ends=ends[name]) for name in links])


@pytest.mark.parametrize(
    ("goal", "closed", "reason"),
    [
        (
            ("2", LAB),
            {"closed_links": ["lift", "stairs"]},
            r"Link (lift|stairs) is closed, and there is no other way\.",
        ),
        (
            ("2", LAB),
            {"closed_links": ["lift@2", "stairs"], "blocked": {"1": {"doors": [6]}}},
            r"Link (lift on floor 2|stairs) is closed, and there is no other way\.",
        ),
        (
            ("2", "lab"),
            {"closed_links": ["lift"], "stairs": False, "blocked": {"2": {"doors": [6, 3]}}},
            r"If link lift and floor 2, door 6 open, there is a route; .* one of them .* none\.",
        ),
        (
            ("2", LAB),
            {"blocked": {"2": {"doors": [6, 3]}}},
            r"Floor 2, door 6 is closed, and there is no other way\.",
        ),
        (
            ("2", "lab"),
            {"blocked": {"2": {"rooms": ["lab"]}}},
            r"Floor 2, room lab is closed, and there is no other way\.",
        ),
        (("2", (99.0, 1.0)), {}, r"Floor 2: The goal lies outside the map\. .*"),
        (("2", (0.1, 0.1)), {}, r"Floor 2: The goal lies in an obstacle\. The nearest point .*"),
    ],
)
def test_a_route_that_is_not_there_has_a_reason(goal, closed, reason):
    plan = building().plan(("1", KITCHEN), goal, **closed)
    assert not plan.solved
    assert re.fullmatch(reason, " ".join(plan.reasons["en"]))
    assert plan.to_dict()["why"] == {
        "words": list(plan.reasons["en"]),
        "to_open": list(plan.to_open),
    }
    assert plan.reasons["de"]
    with pytest.raises(PlanError, match=re.escape(plan.reasons["en"][0][:-1])):
        plan.raise_for_status()
    opened = building().plan(("1", KITCHEN), ("2", LAB))
    assert opened.solved
    assert (opened.reasons, opened.to_dict()["why"]) == ({}, None)


def test_what_opens_a_route_does_and_nothing_of_it_can_stay_closed():
    shut = {
        "closed_links": ["lift", "stairs"],
        "blocked": {"2": {"doors": [6]}, "1": {"doors": [2]}},
    }
    (reason,) = building().plan(("1", KITCHEN), ("2", LAB), **shut).reasons["en"]
    named = re.fullmatch(r"If link (?:lift|stairs), (.*) and (.*) open, there .*", reason)
    assert sorted(named.groups()) == ["floor 1, door 2", "floor 2, door 6"]


def private_corridor():
    """The house with a corridor that visitors do not pass."""
    grown = topology_of(HOUSE)
    uses = {"corridor": hn.RoomUse(private=True)}
    rooms = replace(grown.rooms.labels, uses=uses)
    pyramid = hn.DualGraphPyramid.build(grown.grid, rooms=rooms)
    return hn.HybridPlanner(hn.TopologicalMap(pyramid))


@pytest.mark.parametrize(
    ("profile", "closed", "reason"),
    [
        (
            {"through_private": True, "stairs": False},
            {"closed_links": ["lift@1"]},
            "Link lift on floor 1 is closed, .*",
        ),
        (
            {"through_private": True, "stairs": False},
            {"closed_links": ["stairs", "lift"]},
            "Link lift is closed, .*",
        ),
        (
            {"through_private": True},
            {"blocked": {"2": {"doors": [6, 3]}}},
            r"Floor 2, door 6 is closed, .*",
        ),
        ({"through_private": False}, {}, "Floor 2, room corridor is closed, .*"),
        (
            {"through_private": True, "turn_m": 20.0},
            {},
            "Floor 2: The goal is closed by the given set of cells.",
        ),
    ],
)
def test_reasons_hold_under_a_profile(profile, closed, reason):
    made = hn.Profile(name="somebody", **profile)
    two = building(private_corridor())
    plan = two.plan(("1", KITCHEN), ("2", LAB), profile=made, **closed)
    assert not plan.solved
    assert re.fullmatch(reason, plan.reasons["en"][0])
    assert two.plan(("1", KITCHEN), ("2", LAB)).solved


def test_walls_and_floors_that_no_link_joins_are_named():
    alone = building(links=()).plan(("1", KITCHEN), ("2", LAB))
    assert alone.reasons["en"] == (
        "No lift, stairs or ramp that this robot can take leads from floor 1 to floor 2.",
    )
    lines = [line.replace("######ll", "########") for line in HOUSE]
    walled = building(hn.HybridPlanner(topology_of(lines))).plan(("1", KITCHEN), ("2", LAB))
    assert walled.reasons["en"][0].startswith("Floor 2: Obstacles and unexplored cells enclose")


def test_links_that_lead_the_other_way_are_named():
    two = building()
    lift, stairs = (
        replace(link, one_way=way) for link, way in zip(two.links, ("up", "down"), strict=True)
    )
    up = Building(two.floors, [replace(stairs, one_way="up"), lift])
    assert up.plan(("1", KITCHEN), ("2", LAB)).solved
    back = up.plan(("2", LAB), ("1", KITCHEN))
    assert back.reasons["en"] == (
        "No lift, stairs or ramp that this robot can take leads from floor 2 to floor 1.",
        "One way only, and not that way: stairs ↑, lift ↑.",
    )
    assert back.reasons["de"][1] == "Nur in einer Richtung, und nicht in dieser: stairs ↑, lift ↑."
    assert back.lower_bound == math.inf
    # Up by the lift and down by the stairs: each way has its own link.
    both = Building(two.floors, [lift, stairs])
    for start, goal, by in (("1", "2", "lift"), ("2", "1", "stairs")):
        plan = both.plan((start, KITCHEN), (goal, KITCHEN), closed_links=[])
        assert [ride.link.name for ride in plan.rides] == [by]
        assert [
            one.rides[0].link.name for one in both.alternatives((start, KITCHEN), (goal, LAB), 3)
        ] == [by]


def test_a_direction_of_a_link_may_be_left_for_a_query():
    two = building()
    there, back = (("1", KITCHEN), ("2", LAB)), (("2", LAB), ("1", KITCHEN))
    shut = {"closed_links": ["lift", "stairs=up"]}
    assert [ride.link.name for ride in two.plan(*there, **shut).rides] == ["stairs"]
    down = two.plan(*back, **shut)
    assert down.status == "no path"
    assert down.to_open == ("link lift",)
    none = two.plan(*there, closed_links=["lift", "stairs=up", "stairs=down"])
    assert not none.solved
    alone = two.plan(*back, closed_links=["lift@2", "stairs=up"], stairs=True)
    assert not alone.solved
    one = building(links=("stairs",)).plan(*back, closed_links=["stairs=up"])
    assert one.to_open == ("the way down by link stairs",)
    assert one.reasons["de"] == (
        "Gesperrt ist der Weg hinab über Verbindung stairs, und einen anderen Weg gibt es nicht.",
    )
    with pytest.raises(InvalidValueError, match=r"no link is called 'stair=up'.*stairs=up"):
        two.plan(*there, closed_links=["stair=up"])


def test_a_goal_that_doors_lead_out_of_alone_is_named():
    two = building()
    out = {"2": {"one_way": {"doors": [(6, "corridor"), (3, "corridor")]}}}
    plan = two.plan(("1", KITCHEN), ("2", "lab"), blocked=out)
    assert not plan.solved
    assert plan.reasons["en"] == (
        "Floor 2: Only door 6 leads to the goal, and may be crossed only away from it.",
    )
    assert two.plan(("2", "lab"), ("1", KITCHEN), blocked=out).solved


@pytest.mark.parametrize("blocked", [["door 4"], 5, "2:door:6", [{"doors": [4]}]])
def test_closures_without_floors_are_refused(blocked):
    with pytest.raises(InvalidValueError, match=r"mapping from names of floors .* as \{'1'"):
        building().plan(("1", KITCHEN), ("2", LAB), blocked=blocked)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"closed_links": 5}, r"list of names of links, as \['lift', 'stairs@2'\], got 5"),
        ({"closed_links": None}, "list of names of links.* got None"),
        ({"closed_links": "lift"}, "list of names of links.* got 'lift'"),
        ({"closed_links": [5]}, "the name of a link is a text, got 5"),
        (
            {"blocked": {2: {"doors": [4]}}},
            "the name of a floor is a text, got 2: put it in quotes",
        ),
        ({"blocked": {"2": ["door 4"]}}, r"or a mapping, as \{'doors': \[4\]\}, got \['door 4'\]"),
    ],
)
def test_closures_of_the_wrong_kind_are_refused_with_an_example(given, message):
    with pytest.raises(InvalidValueError, match=message):
        building().plan(("1", KITCHEN), ("2", LAB), **given)
