"""Turns behind doors in words: the judge looks along the right angle of each door."""

from functools import cache
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from tests.drawn_rooms import topology_of
from tests.oracle.doorways import LEAST_DEGREES, Verdict, Walk, judged
from tests.strategies import IS_FULL

OFFICE = FilePath(__file__).parents[2] / "maps" / "office" / "office.yaml"

# A door of a metre between two halls: paths come to it and leave it by any angle.
HALLS = (
    "##########################################",
    *("#oooooooooooooooooooooooooooooooooooooooo#",) * 8,
    "####################oo####################",
    *("#kkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkkk#",) * 16,
    "##########################################",
)
DOOR_M = (10.5, 8.5)
"""The middle of the cells of the door, which belong to the hall."""


@cache
def halls() -> hn.HybridPlanner:
    return hn.HybridPlanner(topology_of(HALLS))


def far_from_door(degrees: float, reach_m: float = 3.6) -> tuple[float, float]:
    """A point so many degrees to the left of the right angle, of one who comes from below."""
    angle = np.radians(degrees)
    return DOOR_M[0] - reach_m * np.sin(angle), DOOR_M[1] + reach_m * np.cos(angle)


def words_at_door(into: float, out: float) -> str:
    """The sentence of the door, of a path that comes and leaves by these angles."""
    return hn.words(halls().plan(far_from_door(180.0 - into, reach_m=6.0), far_from_door(out)))[1]


@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize(("into", "out"), [(0, 50), (0, 65), (-18, 48), (-30, 48), (-48, 48)])
def test_a_turn_behind_a_door_is_told(into: int, out: int, hand: int) -> None:
    """Also where the path leads straight on through a door that lies aslant."""
    assert words_at_door(hand * into, hand * out).endswith(" left" if hand > 0 else " right")


@pytest.mark.parametrize("degrees", [0, 10, 20, -20])
def test_straight_on_is_not_told(degrees: int) -> None:
    assert words_at_door(0, degrees).endswith(" by door 1 into the hall")


@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize(("into", "out"), [(18, 12), (30, 0), (36, -6), (36, 6)])
def test_a_door_that_lies_ahead_is_at_no_hand(into: int, out: int, hand: int) -> None:
    """A person who comes along a path with a jog sees the door ahead."""
    assert words_at_door(hand * into, hand * out).endswith(" by door 1 into the hall")


@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize(("into", "out"), [(42, 42), (48, 42)])
def test_halves_of_a_right_angle_are_one_turn(into: int, out: int, hand: int) -> None:
    word = "left" if hand > 0 else "right"
    line = words_at_door(hand * into, hand * out)
    assert line.endswith(f" by door 1 into the hall and turn {word}")
    assert line.count(word) == 1


# A door whose jamb recedes: paths turn through it over more than a metre.
RECEDING = (
    "##############################",
    *("#oooooooooooooooooooooooooooo#",) * 12,
    "################o#############",
    "################ooo###########",
    *("#kkkkkkkkkkkkkkkkkkkkkkkkkkkk#",) * 3,
    "##############################",
)


@pytest.mark.parametrize("x", [7.25, 7.75, 8.25, 8.75])
def test_a_turn_into_a_door_is_not_told_again_behind_it(x: float) -> None:
    """The direction behind it is that of somebody who looks out of it."""
    topology = topology_of(RECEDING)
    result = hn.HybridPlanner(topology).plan((14.25, 0.75), (x, 7.25))
    line = hn.words(result)[1]
    assert "door on the right (door 1) into the hall" in line
    assert not line.endswith("right")
    check([judged(topology, result)], least_turns=0)


@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_a_route_that_starts_in_a_doorway_has_its_turn(preset: str) -> None:
    """The nearest point of the hall to a goal in the kitchen lies in the door."""
    planner = hn.HybridPlanner(halls().topology, preset=preset)
    result = planner.plan("hall", (14.5, 4.5))
    assert hn.words(result)[1].endswith("into the kitchen, then left")
    assert all(np.isfinite([one.at_m, one.after_m]).all() for one in result.instructions)
    ends = planner.plan((14.5, 4.5), "hall")
    told = [str(one.to_dict()) for one in (*result.instructions, *ends.instructions)]
    assert not any("nan" in each for each in told)


# A room whose cells reach two metres out of its mouth into the hall.
LIP = (
    "##############################",
    *("#oooooooooooooooooooooooooooo#",) * 3,
    *("#oooooooooookkkkkoooooooooooo#",) * 3,
    "############kkkkk#############",
    *("#kkkkkkkkkkkkkkkkkkkkkkkkkkkk#",) * 8,
    "##############################",
)


@pytest.mark.parametrize(
    ("start", "goal", "passed"), [((0.75, 5.75), (14.25, 5.75), 0), ((4.25, 7.5), (9.25, 1.25), 1)]
)
def test_a_path_past_a_mouth_visits_no_room(start: Any, goal: Any, passed: int) -> None:
    """Neither the words nor their judge tell of the line between two rooms that it cuts."""
    topology = topology_of(LIP)
    result = hn.HybridPlanner(topology).plan(start, goal)
    assert len(Walk(topology, result.path.points).passages()) == passed
    assert sum(one.kind == "cross" for one in result.instructions) == passed


def sampled(topology: hn.TopologicalMap, count: int, seed: int) -> list[tuple[Any, Any]]:
    """Points of the largest connected part, and half as many pairs of rooms by name."""
    grid, rooms = topology.grid, topology.rooms
    labels, _ = ndimage.label(grid.enterable())
    largest = labels == np.bincount(labels[labels > 0]).argmax()
    cells = np.argwhere(largest & (rooms.labels.label_of >= 0))
    rng = np.random.default_rng(seed)
    points = grid.frame.points_of(cells[rng.choice(len(cells), 2 * count)]).reshape(count, 2, 2)
    names = [rng.choice(rooms.labels.names, 2, replace=False).tolist() for _ in range(count // 2)]
    return [(a, b) for a, b in points] + [(a, b) for a, b in names]


def verdicts(
    topology: hn.TopologicalMap, count: int, preset: str = "shortest", seed: int = 3
) -> list[Verdict]:
    """What the words say of the doors of sampled routes."""
    planner = hn.HybridPlanner(topology, preset=preset)
    results = [planner.plan(*pair) for pair in sampled(topology, count, seed=seed)]
    return [judged(topology, result) for result in results if result.solved]


def found_rooms(path: FilePath) -> hn.TopologicalMap:
    grid = hn.load_map(path, robot_radius_m=0.2)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid)))


def check(judgements: list[Verdict], least_turns: int) -> None:
    """Every turn is told, to its hand, once, and nothing else."""
    assert sum(len(one.turns) for one in judgements) >= least_turns
    for one in judgements:
        assert one == Verdict(one.turns, [], [], [], [], [], [], [])


def until(
    topology: hn.TopologicalMap, least_turns: int, count: int, preset: str = "shortest"
) -> list[Verdict]:
    """Verdicts of as many routes as it takes: most doors are in sight or led to by a wall, and
    their turns are not told."""
    judgements: list[Verdict] = []
    for seed in range(1003, 1033):
        judgements += verdicts(topology, count, preset=preset, seed=seed)
        if sum(len(one.turns) for one in judgements) >= least_turns:
            break
    return judgements


@pytest.mark.full
def test_every_turn_behind_the_doors_of_the_office_is_told() -> None:
    assert LEAST_DEGREES == 40.0
    topology = found_rooms(OFFICE)
    by_lines, by_cells = (10, 5) if IS_FULL else (5, 3)
    check(until(topology, by_lines, 160), least_turns=by_lines)
    check(until(topology, by_cells, 160, preset="octile"), least_turns=by_cells)


@pytest.mark.full
@pytest.mark.parametrize(
    "name",
    [
        "bwi_gdc/2/2.yaml",
        "bwi_gdc/3/3.yaml",
        "radish_grids/belgioioso.yaml",
        "strands/g4s/g4s_y2.yaml",
        "strands/tsc_y4/tsc_1701.yaml",
        "radish_grids/orebro.yaml",
        "radish_grids/freiburg-101.yaml",
        "willow/willow-2010-02-18-0.10.yaml",
    ],
)
def test_every_turn_behind_the_doors_of_real_floors_is_told(data: FilePath, name: str) -> None:
    topology = found_rooms(data / name)
    check(until(topology, 5, 60), least_turns=5)
