"""Words of routes exist on any map: by zones without walls, at its edge, in rooms of a cell."""

import re

import numpy as np
import pytest

import hybridnav as hn
from tests.drawn_rooms import topology_of
from tests.guide.random_words import fault_of
from tests.strategies import examples

COUNT = examples(700)


@pytest.mark.parametrize("tenth", range(10))
def test_words_on_random_maps_are_words(tenth):
    faults = {seed: fault_of(seed) for seed in range(tenth, COUNT, 10)}
    assert not {seed: fault for seed, fault in faults.items() if fault}


def hall_with_a_zone():
    """A hall of 20 x 12 m, a zone of 4 x 4 m in it without walls, an office behind a door."""
    letters = np.full((12, 30), "o")
    letters[:, 20] = "#"
    letters[5:7, 20] = "o"
    letters[:, 21:] = "l"
    letters[4:8, 6:10] = "k"
    return topology_of(["".join(row.repeat(2)) for row in letters.repeat(2, axis=0)])


def test_a_zone_inside_a_hall_is_left_by_the_direction_of_the_path():
    """Its boundary lies all round: it shows nobody a direction, and no hand behind it."""
    planner = hn.HybridPlanner(hall_with_a_zone())
    assert hn.plan_tour(planner, ["kitchen", "lab"], at="point").words() == [
        "start in the kitchen heading east",
        "after 4 m leave the kitchen by the opening (5.7 m wide) into the hall",
        "go through door 2 into the lab",
        "after 9 m you are there",
    ]
    assert hn.plan_tour(planner, [(2.0, 6.0), (18.0, 6.0)]).words()[0] == (
        "start in the hall towards door 2 to the lab"
    )


@pytest.mark.parametrize("lines", [["kk", "oo"], ["ok", "ko"], ["k", "o"], ["ko"]])
def test_rooms_of_a_cell_have_words(lines):
    planner = hn.HybridPlanner(topology_of(lines))
    words = hn.plan_tour(planner, ["kitchen", "hall"]).words()
    assert words[0].startswith("start in the kitchen")
    assert re.fullmatch("leave the kitchen by .* into the hall, and you are there", words[-1])
