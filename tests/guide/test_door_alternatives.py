"""Alternatives by doors: other sequences of doors, the plain plan first, within their limits."""

import math
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely

import hybridnav as hn
from tests.door_alternatives import Planned, check_alternatives, doors_by_cells, line_of, two_points
from tests.floors import random_floor
from tests.strategies import occupancy_grid, seeds, tried

PRESETS = ["shortest", "octile", "grid-astar", "paper"]


def planner_of(floor, preset="grid-astar"):
    return hn.HybridPlanner(floor.topology, preset=preset)


@tried(60, seed=seeds)
def test_each_is_the_shortest_path_by_its_doors_and_within_the_limits(seed):
    def by_lengths(floor, _rng):
        return Planned(planner_of(floor), floor.moves, lambda line: line.length)

    for other in check_alternatives(seed, by_lengths):
        assert other.path.length_m == pytest.approx(other.result.cost)


def test_no_sequence_of_doors_within_the_limits_is_shorter_than_the_second():
    """Against all sequences of networkx, of which only those over one pair of doors are tried."""
    rng = np.random.default_rng(11)
    equal = compared = 0
    for _ in range(25):
        floor = random_floor(rng)
        first, last = two_points(floor, rng)
        planner = planner_of(floor)
        ends = planner.grid.frame.points_of([first, last])
        found = hn.plan_alternatives(planner, ends[0], ends[1], 2, max_overlap=0.5, max_stretch=3.0)
        if not found or found[0].path.length_m <= 0:
            continue
        best = math.inf
        own = line_of(found[0].path).buffer(planner.grid.resolution_m)
        plain_doors = doors_by_cells(floor, found[0].path)
        darts = floor.darts(first, last)
        for n_tried, path in enumerate(nx.shortest_simple_paths(darts, "start", "goal", "weight")):
            doors = [number for number, _ in path[1:-1]]
            rooms = floor.rooms_passed(first, path[1:-1])
            inside = floor.moves(doors=set(doors))
            cells = nx.dijkstra_path(inside, first, last)
            length = nx.path_weight(inside, cells, "weight")
            if n_tried == 200 or nx.path_weight(darts, path, "weight") > 3 * found[0].path.length_m:
                break
            if len(set(rooms)) < len(rooms) or doors == plain_doors:
                continue
            line = shapely.LineString(planner.grid.frame.points_of(np.array(cells)))
            if line.intersection(own).length <= 0.45 * line.length:
                best = length
                break
        second = found[1].path.length_m if len(found) > 1 else math.inf
        if math.isfinite(best):
            compared += 1
            equal += second <= best + 1e-9
    assert compared > 8
    assert equal >= 0.8 * compared


@pytest.mark.parametrize("preset", PRESETS)
def test_the_first_is_the_plain_plan_of_each_preset(preset):
    rng = np.random.default_rng(5)
    more = 0
    for _ in range(8):
        floor = random_floor(rng)
        planner = planner_of(floor, preset)
        ends = planner.grid.frame.points_of(two_points(floor, rng)) + 0.25
        plain = planner.plan(*ends)
        found = hn.plan_alternatives(planner, ends[0], ends[1], 3)
        assert bool(found) == plain.solved
        if not found:
            continue
        assert np.array_equal(found[0].path.points, plain.path.points)
        assert found[0].result.lower_bound == plain.lower_bound
        for other in found:
            assert other.result.metric == plain.metric
            assert other.result.start == plain.start
            assert other.result.goal == plain.goal
            assert other.result.lower_bound <= other.result.cost
            assert other.tour.words()[0].startswith("start in room ")
            json = other.to_dict()
            assert json["doors"] == [leg["door"] for leg in json["legs"] if leg["door"]]
        more += len(found) > 1
    assert more > 2


def test_closed_doors_and_rooms_are_closed_for_all_of_them():
    rng = np.random.default_rng(7)
    closed_some = 0
    for _ in range(10):
        floor = random_floor(rng)
        planner = planner_of(floor, "shortest")
        ends = planner.grid.frame.points_of([(1, 1), (14, 14)])
        opened = hn.plan_alternatives(planner, ends[0], ends[1], 3)
        if len(opened) < 2 or not opened[1].doors:
            continue
        shut = opened[1].doors[0]
        found = hn.plan_alternatives(planner, ends[0], ends[1], 3, blocked={"doors": [shut]})
        plain = planner.plan(*ends, blocked={"doors": [shut]})
        assert bool(found) == plain.solved
        assert all(shut not in other.doors for other in found)
        if found:
            assert np.array_equal(found[0].path.points, plain.path.points)
            closed_some += 1
        again = hn.plan_alternatives(planner, ends[0], ends[1], 3)
        assert [other.doors for other in again] == [other.doors for other in opened]
    assert closed_some > 3


# A ring of corridor, one room, round a block; an office at either end with a door of its own.
RING = np.ones((9, 21), np.uint8)
RING[2:7, 5:16] = 0
RING[:, [3, 17]] = 0
RING[4, [3, 17]] = 1
RING_LABELS = np.where(RING == 0, -1, np.repeat([0, 1, 2], [4, 13, 4])[None]).astype(np.int32)


@pytest.fixture(params=["shortest", "octile"])
def ring(request):
    rooms = hn.RoomLabels(("west", "corridor", "east"), RING_LABELS)
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(RING), merge_distance_m=3.0, rooms=rooms)
    return hn.HybridPlanner(hn.TopologicalMap(pyramid), preset=request.param)


def test_start_and_goal_in_one_room_have_the_plain_plan_alone(ring):
    found = hn.plan_alternatives(ring, (4.5, 0.5), (16.5, 0.5), 3)
    assert len(found) == 1
    assert found.note == ("1 of 3: no door lies between start and goal")
    assert hn.plan_alternatives(ring, (4.5, 0.5), (16.5, 0.5), 1).note == ""


def test_a_map_without_rooms_has_the_plain_plan_alone():
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(RING)))
    planner = hn.HybridPlanner(topology)
    found = hn.plan_alternatives(planner, (1.5, 4.5), (19.5, 4.5), 2)
    plain: Any = planner.plan((1.5, 4.5), (19.5, 4.5)).path
    assert np.array_equal(found[0].path.points, plain.points)
    assert found.complete
    assert found.note == ("1 of 2: the map has no rooms, so no doors")


def test_without_a_path_the_note_has_the_status(ring):
    found = hn.plan_alternatives(ring, (1.5, 4.5), (5.5, 4.5), 2)
    assert len(found) == 0
    assert found.note == "no path was planned: goal occupied"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"max_overlap": 1.5}, "max_overlap must be a number from 0 to 1, got 1.5"),
        ({"max_overlap": math.nan}, "max_overlap must be a number from 0 to 1, got nan"),
        ({"max_stretch": 0.5}, "max_stretch must be a number from 1 or more, got 0.5"),
        ({"max_stretch": "long"}, "max_stretch must be a number from 1 or more, got 'long'"),
    ],
)
def test_options_out_of_range_are_refused(ring, options, message):
    with pytest.raises(hn.errors.InvalidValueError) as caught:
        hn.plan_alternatives(ring, (1.5, 4.5), (19.5, 4.5), 2, **options)
    assert str(caught.value) == message


def test_ompl_plans_by_other_doors_too():
    pytest.importorskip("ompl")
    rng = np.random.default_rng(5)
    floor = random_floor(rng)
    planner = planner_of(floor, "ompl")
    ends = planner.grid.frame.points_of([(1, 1), (13, 13)])
    found = hn.plan_alternatives(planner, ends[0], ends[1], 2, max_stretch=3.0)
    plain = planner.plan(*ends)
    assert found
    assert found[0].result.start == plain.start
    assert found[0].path.length_m == pytest.approx(plain.path.length_m)
