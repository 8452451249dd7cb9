"""What a tour is as JSON: the keys of a plan, for the whole tour."""

import json
import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from tests.strategies import drawn, occupancy_grid

MAP = drawn("...........", "....#.#....", "....#.#....", "....#.#....")
STOPS: list[Any] = [(0.5, 0.5), "east", (5.5, 0.5)]


@cache
def planner(preset: str = "shortest") -> hn.HybridPlanner:
    grid = occupancy_grid(MAP)
    label_of = np.full(grid.shape, -1, np.int32)
    label_of[:3, :4], label_of[:3, 7:] = 0, 1
    rooms = hn.RoomLabels(("west", "east"), label_of)
    return hn.HybridPlanner(
        hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=3.0, rooms=rooms)),
        preset=preset,
    )


def read(thing: Any) -> dict[str, Any]:
    """What a strict reader makes of it."""
    told: dict[str, Any] = json.loads(json.dumps(thing.to_dict(), allow_nan=False))
    assert told == thing.to_dict()
    return told


@pytest.mark.parametrize("preset", ["shortest", "octile", "paper", "grid-astar"])
@pytest.mark.parametrize("smooth", ["none", "line-of-sight"])
def test_a_tour_has_the_keys_of_a_plan_for_the_whole_way(preset: str, smooth: Any) -> None:
    tour = hn.plan_tour(planner(preset), STOPS, smooth=smooth)
    told, parts = read(tour), [read(result) for result in tour.results]
    assert set(told) == {*parts[0], "legs", "instructions", "words"}
    assert tour.start == (0.5, 0.5)
    assert tour.goal == (5.5, 0.5)
    assert (told["start"], told["goal"]) == ([0.5, 0.5], [5.5, 0.5])
    assert (told["status"], told["metric"]) == (str(tour.status), tour.metric)
    assert told["length_m"] == tour.length_m
    assert (told["cost"], told["lower_bound"], told["gap"]) == (
        tour.cost,
        tour.lower_bound,
        tour.gap,
    )
    assert len(told["headings_rad"]) == len(told["points"])
    walked = np.hypot(*np.diff(np.array(told["points"]), axis=0).T).sum()
    assert walked == pytest.approx(tour.length_m, abs=1e-5)
    for part in parts:
        assert all(point in told["points"] for point in part["points"])
    for counted in ("expanded", "expanded_intervals"):
        assert told[counted] == sum(part[counted] for part in parts)
    assert told["settings"] == parts[0]["settings"]
    assert told["legs"][0]["room"] == "west"
    assert told["words"] == tour.words()
    assert len(told["places"]) == len(told["arcs"]) + 1
    endpoints = [part["places"][0] for part in parts], parts[-1]["places"][-1]
    assert told["places"][0] == endpoints[0][0]
    assert told["places"][-1] == endpoints[1]


def test_a_tour_that_is_not_solved_says_so_in_the_same_keys() -> None:
    tour = hn.plan_tour(planner(), [(0.5, 0.5), "east", (4.5, 0.5)])
    told = read(tour)
    assert told["status"] == "goal occupied"
    assert (told["start"], told["goal"]) == ([0.5, 0.5], [4.5, 0.5])
    for name in ("length_m", "cost", "lower_bound", "gap", "points", "headings_rad", "places"):
        assert told[name] is None
    assert math.isnan(tour.gap)
    assert told["legs"] == told["words"] == []


def test_a_plan_to_a_room_says_where_in_it() -> None:
    result = planner().plan((0.5, 0.5), "east")
    assert result.goal is not None
    assert result.goal == tuple(result.path.points[-1])
    assert planner().plan((0.5, 0.5), (99.0, 0.0)).goal == (99.0, 0.0)


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_stop_where_the_robot_is_has_no_heading_of_its_own(place: int) -> None:
    waypoints = [(0.55, 0.15), (0.55, 1.95), (0.55, 3.5)]
    twice = [*waypoints[: place + 1], *waypoints[place:]]
    told, plain = (read(hn.plan_tour(planner(), path)) for path in (twice, waypoints))
    for key in ("points", "headings_rad"):
        assert told[key] == plain[key]


def test_a_tour_that_stays_where_it_is_has_a_point() -> None:
    told = read(hn.plan_tour(planner(), [(0.5, 0.5)] * 3))
    assert told["points"] == [[0.5, 0.5]]
    assert len(told["headings_rad"]) == 1
