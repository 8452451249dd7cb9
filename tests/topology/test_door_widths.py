"""Doors and openings: how wide they are, where they lie, and what they are called."""

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.viz import plot_rooms
from tests.strategies import occupancy_grid
from tests.topology.test_room_level import named

RESOLUTION_M = 0.1


def doors_of(free, label_of):
    grid = occupancy_grid(free.astype(np.uint8), resolution_m=RESOLUTION_M)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=named(label_of))
    return hn.TopologicalMap(pyramid).rooms.doors


def bay(width):
    """A corridor of 2 m x 20 m, and a bay over it that is open along its side."""
    free = np.zeros((64, 204), dtype=bool)
    free[2:22, 2:202] = True
    label_of = np.where(free, 0, -1)
    free[22:62, 60 : 60 + width], label_of[22:62, 60 : 60 + width] = True, 1
    return free, label_of


def test_an_opening_is_as_wide_as_it_is_though_the_corridor_before_it_is_narrow():
    (opening,) = doors_of(*bay(75))
    assert opening.width_m == pytest.approx(7.5)
    assert opening.position == pytest.approx((9.75, 2.2), abs=0.06)
    assert (opening.kind, opening.is_opening) == ("opening", True)
    assert opening.passage_m < 5.0


@pytest.mark.parametrize(("width", "kind"), [(9, "door"), (20, "door"), (23, "opening")])
def test_a_passage_of_more_than_2_m_is_no_door(width, kind):
    (found,) = doors_of(*bay(width))
    assert found.width_m == pytest.approx(width * RESOLUTION_M)
    assert found.kind == kind


def test_an_outline_that_lies_before_its_door_makes_the_door_no_wider():
    free, label_of = bay(10)
    label_of[21, 40:90] = 1  # drawn a cell too far, along the wall on both sides of the door
    (door,) = doors_of(free, label_of)
    assert door.width_m == pytest.approx(1.0, abs=0.25)
    assert door.kind == "door"


def test_rooms_that_meet_in_the_open_have_no_door_between_them():
    free = np.zeros((64, 64), dtype=bool)
    free[2:62, 2:62] = True
    label_of = np.where(free, 0, -1)
    label_of[2:22, 25:40] = 1
    label_of[22:40, 25:40] = 2
    between = [d for d in doors_of(free, label_of) if d.rooms in {("r1", "r2"), ("r2", "r1")}]
    assert [door.kind for door in between] == ["opening"]
    assert between[0].width_m == pytest.approx(1.5)


def test_lists_and_pictures_tell_doors_from_openings():
    free, label_of = bay(75)
    free[22, 20:29], label_of[22, 20:29] = True, 2
    free[23:62, 10:50], label_of[23:62, 10:50] = True, 2
    grid = occupancy_grid(free.astype(np.uint8), resolution_m=RESOLUTION_M)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=named(label_of)))
    assert topology.rooms.counted()[1] == "1 door, 1 opening"
    drawn = {line.get_gid(): line for line in plot_rooms(topology).lines}
    positions = {door.kind: door.position for door in topology.rooms.doors}
    for kind in ("door", "opening"):
        assert np.asarray(drawn[f"{kind}s"].get_xydata())[0] == pytest.approx(positions[kind])
    assert drawn["doors"].get_marker() != drawn["openings"].get_marker()


def hall_beside(posts):
    """A hall of 8 m x 4 m beside a corridor; between both an opening with some posts in it."""
    free = np.zeros((64, 104), dtype=bool)
    free[2:22, 2:102] = True
    free[22:62, 10:90] = True
    free[22, 10:90] = ~np.isin(np.arange(80) // 2, list(posts))
    label_of = np.where(free, 0, -1)
    label_of[22:62][free[22:62]] = 1
    return free, label_of


def test_posts_in_a_wide_opening_make_no_doors_of_it():
    found = doors_of(*hall_beside(range(0, 40, 5)))
    assert len(found) == 8
    assert all(door.width_m == pytest.approx(0.8) for door in found[:-1])
    assert {door.kind for door in found} == {"opening"}


def test_two_doors_beside_each_other_and_doors_along_a_wall_stay_doors():
    wall = set(range(40))
    near = doors_of(*hall_beside(wall - {10, 11, 12, 13, 17, 18, 19, 20}))
    assert [door.kind for door in near] == ["door", "door"]
    apart = doors_of(*hall_beside(wall - {1, 2, 3, 4, 13, 14, 15, 16, 25, 26, 27, 28, 35, 36, 37}))
    assert [door.kind for door in apart] == ["door"] * 4


@pytest.mark.parametrize("beside", [[(27, 30)], [(20, 24), (24, 41)]])
def test_an_object_beside_a_border_in_the_open_makes_no_door_of_it(beside):
    free = np.zeros((64, 64), dtype=bool)
    free[2:62, 2:62] = True
    for row, col in beside:
        free[row, col] = False
    label_of = np.where(free, 0, -1)
    label_of[2:22, 25:40][free[2:22, 25:40]] = 1
    label_of[22:40, 25:40][free[22:40, 25:40]] = 2
    between = [d for d in doors_of(free, label_of) if set(d.rooms) == {"r1", "r2"}]
    assert [door.kind for door in between] == ["opening"]
