"""Names as people type and sort them."""

import random
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridnav.maps.names import did_you_mean, folded, matching, natural_key

WARDS = [
    "entrance",
    "Ward 1",
    "ward 2",
    "ward 2b",
    "WARD 10",
    "ward 10.2",
    "ward 10.11",
    "Zimmer 3",
]
NAMES = st.lists(st.text(st.characters(codec="utf-8"), min_size=1, max_size=12), max_size=8)


def test_names_are_sorted_as_people_sort() -> None:
    mixed = WARDS.copy()
    random.Random(1).shuffle(mixed)
    assert sorted(mixed, key=natural_key) == WARDS


@given(st.lists(st.integers(0, 10**6), min_size=1, max_size=9))
def test_numbers_in_names_are_sorted_by_their_value(numbers: list[int]) -> None:
    found = sorted([f"room {n}" for n in numbers], key=natural_key)
    assert [int(name[5:]) for name in found] == sorted(numbers)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Küche", "KUCHE"),
        ("Straße", "strasse"),
        ("Ærø", "aero"),
        ("Łódź", "lodz"),
        ("  a  b", "A B"),
    ],
)
def test_case_accents_and_spaces_do_not_count(one: str, other: str) -> None:
    assert folded(one) == folded(other)
    assert matching(other, [one, "elsewhere"])[:1] == [0]


@given(NAMES, st.text(max_size=6))
def test_what_matches_holds_every_word(names: list[str], text: str) -> None:
    found = matching(text, names)
    words = folded(text).split()
    expected = {at for at, name in enumerate(names) if all(word in folded(name) for word in words)}
    assert set(found) == expected
    assert len(found) == len(expected)
    same = [at for at in found if folded(names[at]) == folded(text)]
    assert found[: len(same)] == same


def test_the_best_matches_come_first() -> None:
    names = ["old kitchen 2", "kitchenette", "x-kitchen", "kitchen", "old kitchen 10", "hall"]
    found = [names[at] for at in matching("Kitchen", names)]
    assert found == ["kitchen", "kitchenette", "old kitchen 2", "old kitchen 10", "x-kitchen"]
    assert [names[at] for at in matching("2 kit", names)] == ["old kitchen 2"]


def test_a_refusal_suggests_a_name_without_its_accents() -> None:
    assert re.search("did you mean Küche", did_you_mean("kuche", ("Küche", "hall")))
