"""Kinds of rooms: shapes with a known answer, and rooms that a person has looked at."""

import numpy as np
import pytest

from hybridnav.rooms.listing import kinds_of
from research._rooms_buildings import Building

SEEN = {
    "2": ({2, 4, 5, 6, 8, 12, 13}, {9}),
    "3": ({1, 2, 3, 5, 6, 25, 27, 38, 39, 48}, {0, 4, 26}),
    "freiburg_building79": ({6, 12, 14}, set()),
    "freiburg_building101": ({0, 2}, {1}),
    "map_with_clutter": ({4}, {12}),
    "ubremen-cartesium-demo4": (set(), {8}),
}
"""Numbers of people's rooms that are corridors and halls, by a look at each of them. Of the last
map one room is a corridor with two halls; on the first rooms are 5 cm a cell as assumed."""


def kinds(*shapes: tuple[float, float]):
    """The kinds of rectangles of some breadth and length in metres, at 0.1 m."""
    rows, cols = 1200, sum(round(10 * breadth) + 2 for breadth, _ in shapes)
    label = np.full((rows, cols), -1, dtype=np.int32)
    col = 1
    for number, (breadth, length) in enumerate(shapes):
        label[1 : 1 + round(10 * length), col : col + round(10 * breadth)] = number
        col += round(10 * breadth) + 2
    return [kind and kind.name for kind in kinds_of(label, label >= 0, 0.1)]


def test_long_rooms_are_corridors_and_large_ones_halls() -> None:
    found = kinds((2, 20), (2, 7), (4.7, 19), (10, 10), (5, 40), (0.5, 20))
    assert found == ["corridor", None, None, "hall", "hall", None]


def test_furniture_makes_no_corridor_of_a_hall_and_no_room_of_a_hall() -> None:
    label = np.zeros((120, 100), dtype=np.int32)
    label[10:110:4, 10:90:4] = -1  # legs of chairs
    (kind,) = kinds_of(label, label >= 0, 0.1)
    assert kind is not None
    assert kind.name == "hall"
    assert kind.confidence == pytest.approx(1 - 0.5 * 90 / 120)


@pytest.mark.parametrize("label_inside", [1, -1])
def test_a_ring_round_rooms_is_a_corridor_whether_they_have_names_or_not(label_inside) -> None:
    label = np.zeros((200, 200), dtype=np.int32)
    label[20:180, 20:180] = -1
    label[22:178, 22:178] = label_inside
    is_free = np.ones(label.shape, np.bool_)
    is_free[20:180, 20:180] = False
    is_free[22:178, 22:178] = True
    kind = kinds_of(label, is_free, 0.1)[0]
    assert kind is not None
    assert kind.name == "corridor"
    is_free[:] = label == 0  # a block of furniture, or what nobody has seen
    kind = kinds_of(np.where(is_free, 0, -1), is_free, 0.1)[0]
    assert kind is not None
    assert kind.name == "hall"


def test_the_kind_is_the_same_turned_and_mirrored() -> None:
    rng = np.random.default_rng(0)
    label = np.zeros((30, 200), dtype=np.int32)
    label[rng.random(label.shape) < 0.02] = -1
    label[:, 100:] = np.where(label[:, 100:] == 0, 1, -1)
    found = kinds_of(label, label >= 0, 0.1)
    for turned in (label.T, label[::-1], label[:, ::-1].T):
        label = np.ascontiguousarray(turned)
        assert kinds_of(label, label >= 0, 0.1) == found


def test_a_room_without_free_cells_has_no_kind() -> None:
    label = np.array([[0, 2]], dtype=np.int32)
    assert kinds_of(label, label >= 0, 0.1) == (None, None, None)
    assert kinds_of(label - 5, label >= 9, 0.1) == ()


def test_nine_of_ten_kinds_are_what_a_person_sees(data) -> None:
    right, told, there = 0, 0, 0
    for name, (corridors, halls) in SEEN.items():
        building = Building.read(data, name)
        found = kinds_of(building.true, building.free, building.grid.resolution_m)
        of_kind = {"corridor": corridors, "hall": halls}
        told += sum(kind is not None for kind in found)
        there += len(corridors) + len(halls)
        right += sum(
            kind is not None and number in of_kind[kind.name] for number, kind in enumerate(found)
        )
    assert right >= 0.9 * told
    assert right >= 0.7 * there
