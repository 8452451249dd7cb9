"""Recorded paths on random maps: touching corners, collinear runs, points again, off the map."""

from tests.harness.judges.random_recorded import count
from tests.strategies import examples


def test_verdicts_on_random_paths_are_those_of_shapely_and_fractions():
    found = count(examples(1000))
    assert found.keys() == {"paths", "legal"}, found
    assert 0.2 < found["legal"] / found["paths"] < 0.8
