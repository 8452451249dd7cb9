"""A walker who knows only the words arrives on the shipped map, and not with other words."""

import pytest

import hybridnav as hn
from benchmarks.common import OFFICE, prepared, read
from benchmarks.subjects._words_walker import Place
from benchmarks.subjects._words_walker import read as read_words
from benchmarks.subjects.words import corrupted, failure, routes


@pytest.fixture(scope="module")
def walks():
    planner = prepared(read(OFFICE), rooms=True)
    return Place(planner.topology), routes(planner, 15, seed=5)


@pytest.mark.parametrize("language", ["en", "de"])
def test_walkers_arrive_by_words_alone(walks, language):
    place, tours = walks
    lost = [failure(place, tour, tour.words(language), language) for tour in tours]
    assert sum(why is None for why in lost) >= 9, lost


def test_few_walkers_arrive_by_other_words(walks):
    place, tours = walks
    for how in ("hands", "numbers"):
        others = [(tour, corrupted(tour.words(), how)) for tour in tours]
        # Nobody gets lost by the metres of the last sentence, inside the goal.
        others = [(tour, words) for tour, words in others if words[:-1] != tour.words()[:-1]]
        assert len(others) >= 12, how
        lost = [failure(place, tour, words) for tour, words in others]
        assert sum(why is None for why in lost) <= 3, how


def test_both_languages_ask_for_the_same(walks):
    for tour in walks[1]:
        steps = [
            [
                (one.kind, one.metres, one.turn_rad, one.side_rad, one.ordinal, one.is_opening)
                for one in (read_words(line, code) for line in tour.words(code))
            ]
            for code in ("en", "de")
        ]
        assert steps[0] == steps[1], tour.words()


def test_openings_have_no_numbers_and_nobody_counts_past_five(walks):
    assert isinstance(walks[1][0], hn.Tour)
    for tour in walks[1]:
        assert not any("opening 1" in line or "past" in line for line in tour.words())
        assert all((read_words(line, "en").ordinal or 0) <= 5 for line in tour.words())


@pytest.mark.parametrize("language", ["en", "de"])
def test_the_metres_along_a_wall_lead_to_the_door(language):
    """Two doors of a wall may lead to one corridor: the metres tell which is meant."""
    grid = read(OFFICE)
    rooms = hn.load_rooms(OFFICE.parents[1] / "building" / "rooms-1.yaml", grid)
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms)))
    place = Place(planner.topology)
    ways = {
        "reception": ("seminar room", "lift lobby", "office 4"),
        "stairwell": ("office 2",),
        "lift lobby": ("seminar room",),
        "seminar room": ("office 1", "office 2"),
        "office 5": ("stairwell",),
    }
    for name, others in ways.items():
        for other in others:
            tour = hn.plan_tour(planner, [name, other], at="point")
            where = "opposite wall" if name == "reception" else "wall on the"
            assert any(where in line for line in tour.words() if "for about" in line)
            assert failure(place, tour, tour.words(language), language) is None
