"""Doors in words: which one it is, the side of each, and those beside a goal."""

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


def test_the_way_on_behind_a_door_is_told_as_from_its_wall():
    """Who knows no direction finds the only door; behind it the way on is told as from its wall."""
    planner = hn.HybridPlanner(topology_of(ASLANT))
    start, goal = (0.9, 4.9), (12.9, 0.9)
    there, back = planner.plan(start, goal), planner.plan(goal, start)
    assert hn.words(there)[1] == ("leave the corridor by door 1 into the hall, then left")
    assert not any("turn" in line for line in hn.words(there))
    assert hn.words(back)[1] == "leave the hall by door 1 into the corridor, then left"


def test_doors_before_the_right_one_are_counted_on_short_ways_too():
    """Before the door to the archive lies that to the kitchen, at the same hand."""
    words = hn.words(house().plan((0.9, 3.0), (7.25, 5.9)))
    assert words[1] == (
        "after 6 m leave the corridor by the second door on the left (door 3) into the archive"
    )
    back = hn.words(house().plan((11.0, 3.0), (7.25, 5.9)))
    assert "door 3 on the right" in back[1]


def test_a_goal_has_a_door_beside_it():
    """A person cannot see coordinates."""
    goals = {
        (7.25, 3.0): "in the corridor, with door 3 to the archive on the left",
        (20.5, 2.75): "in the corridor, with door 6 to the lab on the left",
        (19.75, 6.25): "in the lab",
    }
    for goal, last in goals.items():
        assert hn.words(house().plan((0.9, 3.0), goal))[-1].endswith(last)


def test_a_goal_beside_a_wide_opening_has_it_at_its_hand():
    """Its middle lies behind, its edge beside."""
    words = hn.words(house().plan((0.9, 3.0), (10.4, 2.75)))
    assert words[-1] == (
        "after 10 m you are at (10.4, 2.75) in the corridor, "
        "with the opening to the hall on the right"
    )


# Three rooms on one line aslant: two doors whose walls stand at right angles.
CORNER = (
    "####################",
    "#bbbbbaaaaaa########",
    "#bbbbbaaaaaa########",
    "#bbbbb#aaaaa########",
    "#bbbbb#aaaaa########",
    "#########aa#########",
    *("#kkkkkkkkkkkkkkkkkk#",) * 7,
    "####################",
)


def test_a_door_in_the_wall_beside_the_door_before_has_its_side():
    """Nothing bends: but a person who stands in the first door looks past the second."""
    words = hn.words(hn.HybridPlanner(topology_of(CORNER)).plan((8.4, 1.2), (2.2, 6.3)))
    assert words[1] == "leave the kitchen by door 1 into the archive"
    assert words[2] == "go through door 2 ahead on the left into the bath"


def test_a_path_inside_one_room_has_a_direction():
    """A door if there is one, though behind; else the points of the compass."""
    words = hn.words(house().plan((19.75, 6.25), (18.75, 6.25)))
    assert words[0] == "start in the lab with door 6 to the corridor on the left"
    assert hn.words(house().plan((2.5, 5.25), (2.5, 6.25)))[0] == (
        "start in the kitchen with door 2 to the corridor behind you"
    )
    hall = hn.HybridPlanner(topology_of(["ooooooooo"] * 9))
    ends = {"east": (4, 2.25), "north-east": (4, 4), "west": (0.25, 2.25), "south": (2.25, 0.25)}
    for compass, goal in ends.items():
        result = hall.plan((2.25, 2.25), goal)
        assert hn.words(result)[0] == f"start in the hall heading {compass}"
        assert result.instructions[0].to_dict()["heading_rad"] is not None


# A hall 3 m broad with a door to the kitchen, and opposite it those to four rooms.
OPPOSITE = (
    "#######################################",
    "#aaaaaaaaaaaa#bbbbbbb#ddddddd#llllllll#",
    "#aaaaaaaaaaaa#bbbbbbb#ddddddd#llllllll#",
    "#####aa##########bb#######dd######ll###",
    *("#ooooooooooooooooooooooooooooooooooooo#",) * 6,
    "#####kk################################",
    *("#kkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkk#",) * 6,
    "#######################################",
)


def test_the_metres_along_the_wall_opposite_begin_at_that_wall():
    """They lead to the second door, six metres on; nine with the way across end near the third."""
    tour = hn.plan_tour(hn.HybridPlanner(topology_of(OPPOSITE)), ["kitchen", "bath"])
    assert tour.words()[2].startswith(
        "go straight across to the opposite wall, turn right along it for about 6 m and go through"
    )
    assert ", dort nach rechts an ihr entlang, etwa 6 m weit, und" in tour.words("de")[2]
    wall = tour.to_dict()["instructions"][2]["doorway"]["wall"]
    assert abs(wall["length_m"] - 6.0) <= 0.5
