"""Doors in words: the side of each, those passed before it, and those beside a goal."""

from __future__ import annotations

import hybridnav as hn
from tests.drawn_rooms import house, topology_of

# A corridor that opens into a hall beside it, and a hall whose door lies aslant on the way.
ASLANT = (
    "############################",
    "#cccccccccccccccccccc#######",
    "#cccccccccccccccccccc#######",
    "#cccccccccccccccccccc#######",
    "####################c#######",
    "#oooooooooooooooooooooooooo#",
    "#oooooooooooooooooooooooooo#",
    "#oooooooooooooooooooooooooo#",
    "#oooooooooooooooooooooooooo#",
    "#oooooooooooooooooooooooooo#",
    "#oooooooooooooooooooooooooo#",
    "############################",
)


def test_the_side_of_a_door_is_that_of_its_wall():
    """The line through the door bends slightly: its wall lies along the way all the same."""
    planner = hn.HybridPlanner(topology_of(ASLANT))
    start, goal = (0.9, 4.9), (12.9, 0.9)
    there, back = planner.plan(start, goal), planner.plan(goal, start)
    assert there.words()[1] == "after 10 m leave the corridor by door 1 on the right into the hall"
    assert not any("turn" in line for line in there.words())
    assert back.words()[1] == "after 4 m leave the hall by door 1 into the corridor, then left"


def test_doors_before_the_right_one_are_counted_on_short_ways_too():
    """Before the door to the archive lies that to the kitchen, at the same hand."""
    words = house().plan((0.9, 3.0), (7.25, 5.9)).words()
    assert words[1] == (
        "after 6 m, past one door on the left, turn left and leave the corridor by door 3 "
        "into the archive"
    )
    back = house().plan((11.0, 3.0), (7.25, 5.9)).words()
    assert not any("past" in line for line in back)


def test_a_goal_has_a_door_beside_it():
    """A person cannot see coordinates."""
    goals = {
        (7.25, 3.0): "in the corridor, with door 3 to the archive on the left",
        (20.5, 2.75): "in the corridor, with door 6 to the lab on the left",
        (19.75, 6.25): "in the lab",
    }
    for goal, last in goals.items():
        assert house().plan((0.9, 3.0), goal).words()[-1].endswith(last)


# A pillar hides the middle of the opening; the doors of the kitchen and the archive touch.
HIDDEN = (
    "##############################",
    "#kkkkkkkkaaaaaaa##ooooooo#bbb#",
    "#kkkkkkk##aaaaaa##ooooooo#bbb#",
    "########ka########ooooooo##b##",
    "#cccccccccccccccccccccccccccc#",
    "#cccccccccccccccccccc#ccccccc#",
    "#cccccccccccccccccccccccccccc#",
    "##############################",
)


def test_doors_are_counted_that_touch_or_are_hidden_in_part():
    words = hn.HybridPlanner(topology_of(HIDDEN)).plan((0.9, 0.9), (13.8, 0.9)).words()
    assert "past three openings on the left" in words[1]
