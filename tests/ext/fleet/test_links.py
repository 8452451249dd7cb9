"""Links between floors."""

import itertools
import math

import pytest

from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet import Link, LinkEnd

ENDS = LinkEnd("1", (0.0, 4.0)), LinkEnd("2", (0.5, 4.0)), LinkEnd("3", (0.0, 4.0))


def test_a_ride_costs_the_same_both_ways():
    lift = Link(name="lift", kind="lift", ends=ENDS, wait_s=20, ride_s=5, cost_m=1)
    for a, b, seconds in (("1", "2", 25), ("1", "3", 30), ("2", "3", 25)):
        assert lift.seconds(a, b) == lift.seconds(b, a) == seconds
        assert lift.charge_m(a, b, speed_m_s=0.4) == pytest.approx(1 + 0.4 * seconds)
    assert lift.end_on("2") == ENDS[1]
    assert lift.end_on("4") is None


def test_a_link_leads_up_or_down_or_both_ways():
    led = {
        way: [
            one.floor + other.floor
            for one, other in itertools.permutations(ENDS, 2)
            if Link(name="way", kind="stairs", ends=ENDS, one_way=way).leads(one.floor, other.floor)
        ]
        for way in (None, "up", "down")
    }
    assert led["up"] == ["12", "13", "23"]
    assert led["down"] == ["21", "31", "32"]
    assert sorted(led[None]) == sorted(led["up"] + led["down"])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ends": ENDS[:1]}, "two or more different floors"),
        ({"ends": (*ENDS, ENDS[0])}, "two or more different floors"),
        ({"kind": "ladder"}, "not one of lift, stairs, ramp"),
        ({"one_way": "2"}, "one_way is '2', expected up, down, or None for both ways"),
        ({"wait_s": math.nan}, "wait_s is nan"),
        ({"ride_s": -1.0}, "ride_s is -1.0"),
        ({"cost_m": math.inf}, "cost_m is inf"),
        ({"max_radius_m": 0.0}, "max_radius_m is 0.0"),
    ],
)
def test_what_no_planner_could_use_is_refused(change, words):
    with pytest.raises(InvalidValueError, match=words):
        Link(**({"name": "lift", "kind": "lift", "ends": ENDS} | change))


def test_an_end_lies_at_two_finite_numbers():
    for position in ((math.nan, 0.0), (0.0, math.inf)):
        with pytest.raises(InvalidValueError, match="two finite numbers"):
            LinkEnd("1", position)


def test_a_ride_to_a_floor_where_the_link_does_not_stop_is_refused():
    lift = Link(name="lift", kind="lift", ends=ENDS)
    for a, b in (("1", "9"), ("9", "1")):
        with pytest.raises(InvalidValueError, match="link lift does not stop on floor 9"):
            lift.seconds(a, b)
        with pytest.raises(InvalidValueError, match="it stops on 1, 2, 3"):
            lift.charge_m(a, b, speed_m_s=0.5)
