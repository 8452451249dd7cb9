"""Directions ride where closures ride: in `Blocked`, and from rooms into every query."""

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.planning.planning import Planning

INTO_HALL = hn.OneWayRule.of("door:1=hall")


def planner(*rules: hn.OneWayRule) -> hn.HybridPlanner:
    """A kitchen on the left of a hall, with a door in the wall between them."""
    occupied = np.zeros((4, 9), np.float32)
    occupied[[0, 1, 3], 4] = 1
    grid = hn.OccupancyGrid(occupied, robot_radius_m=0)
    label_of = np.where(np.arange(9) < 5, 0, 1)[None].repeat(4, axis=0).astype(np.int32)
    rooms = hn.RoomLabels(("kitchen", "hall"), label_of, one_way=rules)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    return hn.HybridPlanner(topology, preset="grid-astar")


def now(of: hn.HybridPlanner) -> Planning:
    return of._now


def test_nothing_changes_where_nothing_has_a_direction() -> None:
    assert now(planner()).closed(None) is None


def test_the_rules_of_rooms_hold_for_every_query() -> None:
    asked = now(planner(INTO_HALL))
    always = asked.closed(None)
    assert always.one_way.sides.tolist() == [[2, 4, 2, 5]]
    shut = asked.closed(hn.Blocked(cells=[(0, 0)]))
    assert shut.flat.tolist() == [0]
    assert shut.one_way is always.one_way
    assert asked.closed(hn.Blocked(cells=[(0, 0)])) is shut
    assert asked.closed(shut) is shut


def test_closures_and_directions_are_joined() -> None:
    rule = hn.OneWay.of([INTO_HALL])
    one, other = hn.Blocked(one_way=rule), hn.Blocked(one_way={"lines": [[(1, 0), (1, 4)]]})
    both = hn.Blocked(named={"doors": one}) | other
    assert one.key != other.key != hn.Blocked().key
    found = now(planner()).closed(both)
    assert {*found.one_way.parts} == {"door 1", "line 1"}
    assert len(found.one_way.sides) == 1 + 4


@pytest.mark.parametrize(
    "given", [5, {"door": [(1, "hall")]}, {"doors": [(9, "hall")]}, "door:1=hall"]
)
def test_what_is_no_direction_is_refused(given: object) -> None:
    with pytest.raises(InvalidValueError, match=r"one_way|no door has the number"):
        planner().plan((0.5, 0.5), (8.5, 0.5), one_way=given)  # type: ignore[arg-type]


def test_reasons_know_that_a_direction_closes_no_cell() -> None:
    shut = hn.Blocked(one_way=hn.OneWay.of([INTO_HALL]), doors=[1])
    asked = planner(INTO_HALL).plan((0.5, 0.5), (8.5, 0.5), blocked=shut)
    assert [each.kind for each in asked.explanation.to_open] == ["doors"]
