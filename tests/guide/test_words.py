"""A path in words: every turn is told, to the right hand, where it lies, and nothing else."""

import itertools
import math
import re
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.guide.words import Instruction, sentences
from hybridnav.guide.words.itinerary import instructions_of
from tests.drawn_rooms import HOUSE, SIDE, house, topology_of
from tests.oracle.bends import Windows, simplified_corners
from tests.strategies import tried


def turns_of(instructions: tuple[Instruction, ...]) -> list[tuple[float, float]]:
    """Where each turn is told, in metres along the path, and its degrees."""
    found = []
    for one in instructions:
        behind = one.doorway.behind if one.doorway is not None else None
        found += [
            (one.at_m, math.degrees(turn.angle_rad))
            for turn in (one.turn, behind)
            if turn is not None
        ]
    return found


def hands_of(words: list[str]) -> list[str]:
    """The turns of a description: L and R."""
    return [
        hand[0].upper()
        for line in words
        for hand in re.findall(r"(?:turn|bear) (left|right|\w+)\b(?! along)", line)
    ]


def swapped(words: list[str]) -> list[str]:
    other = {"left": "right", "right": "left"}
    return [re.sub(r"\b(left|right)\b", lambda hand: other[hand[0]], line) for line in words]


def test_the_kitchen_is_left_to_the_left_and_doors_are_landmarks():
    words = hn.plan_tour(house(), [(1.25, 5.75), "lab"], at="point").words()
    assert words == [
        "start in the kitchen",
        "leave the kitchen by door 2 into the corridor",
        "keep to the wall on the left and go through the fourth door (door 6) into the lab",
        "after 1 m you are there",
    ]


def test_the_same_words_for_a_plan_a_tour_and_another_preset():
    start, goal = (1.25, 5.75), (19.75, 6.25)
    plan, tour = house().plan(start, goal), hn.plan_tour(house(), [start, goal])
    assert hn.words(plan) == tour.words()
    assert hn.words(plan)[-1].endswith("you are at (19.75, 6.25) in the lab")
    by_cells = house("octile").plan(start, goal)
    assert by_cells.metric == "octile"
    assert [re.sub(r"\d+ m", "", line) for line in hn.words(by_cells)[:-1]] == [
        re.sub(r"\d+ m", "", line) for line in hn.words(plan)[:-1]
    ]


def test_a_turn_at_a_waypoint_comes_after_the_arrival():
    """The nearest point of a room lies in its door, and the way on leads back by that door."""
    words = hn.plan_tour(house(), [(1.25, 5.75), "archive", (1.75, 3.0)]).words()
    assert words[2].endswith(" first door (door 3) into the archive, and you are there")
    assert words[3].startswith("turn sharply right and leave the archive by door 3 ")


def test_a_turn_at_a_waypoint_before_a_door_is_told_at_the_waypoint():
    """Into the kitchen, to a point behind its door, and back: one turns there."""
    words = hn.plan_tour(house(), [(10.0, 3.0), (2.75, 5.25), (16.0, 3.0)], at="point").words()
    arrival = next(n for n, line in enumerate(words) if "(2.75, 5.25)" in line)
    assert words[arrival + 1] == "in the kitchen turn round"
    assert re.match(r"leave the kitchen by door 2 .*into the corridor", words[arrival + 2])


def test_a_start_far_from_doors_has_a_landmark():
    starts = {
        ((7.0, 3.0), (21.0, 3.0)): "start in the corridor with door 3 to the archive on the left",
        ((16.0, 3.0), (3.0, 3.0)): "start in the corridor with door 5 to the den on the right",
        ((1.0, 1.0), (14.0, 3.5)): "start in the hall towards the opening to the corridor",
        ((1.0, 6.0), (2.0, 3.5)): "start in the kitchen",
    }
    for (start, goal), first in starts.items():
        assert hn.words(house().plan(start, goal))[0] == first


def test_slight_bends_inside_a_room_are_told():
    """Two bends of 50 degrees, 13 m apart: a person who goes straight on meets a wall."""
    middle = shapely.LineString([(1.5, 2), (9, 2), (17, 12), (24, 12)])
    x, y = np.meshgrid((np.arange(52) + 0.5) * SIDE, (np.arange(30) + 0.5) * SIDE)
    inside = np.asarray(shapely.dwithin(middle, shapely.points(x, y), 0.6))
    topology = topology_of(["".join("m" if one else "#" for one in row) for row in inside[::-1]])
    words = hn.words(hn.HybridPlanner(topology).plan((1.75, 2.25), (23.75, 12.25)))
    assert [line.split()[-2:] for line in words[1:-1]] == [["bear", "left"], ["bear", "right"]]


def test_an_opening_is_no_door():
    words = hn.plan_tour(house(), [(13.9, 5.9), (2.2, 1.1)]).words()
    assert words[2] == (
        "go straight across to the opposite wall, turn right along it and go through the first "
        "opening (6.0 m wide) into the hall, then right"
    )
    assert words[1] == "leave the den by door 5 into the corridor"


def test_mirrored_ground_swaps_left_and_right_in_every_sentence():
    plain = house().topology
    width_m = plain.grid.shape[1] * SIDE
    doors = {
        door.number: (width_m - door.position[0], door.position[1]) for door in plain.rooms.doors
    }
    mirror = hn.HybridPlanner(topology_of([line[::-1] for line in HOUSE], doors))
    points = [(1.2, 5.8), (19.7, 6.3), (7.3, 5.3), (13.9, 5.9), (21.6, 2.6)]
    told = set[str]()
    for start, goal in itertools.permutations(points, 2):
        mirrored = [(width_m - x, y) for x, y in (start, goal)]
        told |= set(words := hn.words(house().plan(start, goal))[:-1])
        assert hn.words(mirror.plan(*mirrored))[:-1] == swapped(words)
    assert any("wall on the right" in line for line in told)


# Corridors a metre broad; the hands were read off the drawings, walking from S to G.
DRAWN = {
    "straight": ("", "S........................G", "........................."),
    "corner": (
        "L",
        "#############.G",
        "#############..",
        "#############..",
        "#############..",
        "#############..",
        "#############..",
        "S..............",
        "...............",
    ),
    "z": (
        "RL",
        "S..............########",
        "...............########",
        "#############..########",
        "#############..########",
        "#############..########",
        "#############..########",
        "#############..########",
        "#############.........G",
        "#############..........",
    ),
    "u": (
        "RR",
        "S..............",
        "...............",
        "#############..",
        "#############..",
        "#############..",
        "#############..",
        "G..............",
        "...............",
    ),
    "spiral": (
        "RRRRRR",
        "S..................",
        "...................",
        "#################..",
        "..............##...",
        "..............##...",
        "..##########..##...",
        "..##########..##...",
        "..##G.........##...",
        "..##..........##...",
        "..##############...",
        "..##############...",
        "...................",
        "...................",
    ),
    "a step of half a metre": (
        "",
        "S..........#########",
        "...................G",
        "#########...........",
    ),
}


@pytest.mark.parametrize("name", DRAWN)
@pytest.mark.parametrize("preset", ["shortest", "octile"])
@pytest.mark.parametrize("yaw_rad", [0.0, 2.3])
def test_the_turns_of_drawn_corridors_are_told(name, preset, yaw_rad):
    hands, *lines = DRAWN[name]
    width = max(map(len, lines))
    lines = ["#" * (width + 2), *(f"#{line:#<{width}}#" for line in lines), "#" * (width + 2)]
    letters = np.array([list(line) for line in reversed(lines)])
    topology = topology_of(
        [re.sub(r"[SG.]", "m", line) for line in lines], origin_m=(3.0, -7.0), yaw_rad=yaw_rad
    )
    start, goal = (
        topology.grid.frame.points_of(np.argwhere(letters == letter)[0]) for letter in "SG"
    )
    planner = hn.HybridPlanner(topology, preset=preset)
    result = planner.plan(start, goal)
    assert hands_of(hn.words(result)) == list(hands)
    compass = "east" if yaw_rad == 0 else "north-west"
    assert hn.words(result)[0] == f"start in the maze heading {compass}"
    assert all("in the maze" in line for line in hn.words(result))
    path = hn.Path(result.path.cells[::-1].copy(), result.path.points[::-1].copy(), result.cost)
    back = instructions_of(path, topology, "home", goal)
    expected = [(result.cost - at_m, -degrees) for at_m, degrees in turns_of(result.instructions)]
    assert np.allclose(turns_of(back)[::-1], expected)


@st.composite
def mazes(draw: st.DrawFn) -> tuple[set[frozenset[Any]], Any, Any]:
    """A tree of corridors on a lattice, a dead end to start from, and another node."""
    side = draw(st.integers(3, 4))
    nodes = list(itertools.product(range(side), repeat=2))
    order = draw(st.permutations(list(range(4 * len(nodes)))))
    edges = [
        frozenset((a, b))
        for a, b in itertools.combinations(nodes, 2)
        if abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1
    ]
    root = {node: node for node in nodes}

    def top(node):
        while root[node] != node:
            node = root[node]
        return node

    kept = set()
    for edge in sorted(edges, key=lambda edge: order[edges.index(edge)]):
        a, b = edge
        if top(a) != top(b):
            root[top(a)] = top(b)
            kept.add(edge)
    ends = [node for node in nodes if sum(node in edge for edge in kept) == 1]
    start = draw(st.sampled_from(ends))
    return kept, start, draw(st.sampled_from([node for node in nodes if node != start]))


@tried(30, maze=mazes(), preset=st.sampled_from(["shortest", "octile"]))
def test_words_replayed_on_the_graph_of_corridors_reach_the_goal(maze, preset):
    """A turtle that knows the corridors and the words alone."""
    corridors, start, goal = maze
    spacing, broad = 12, 1
    cells = np.full((4 * spacing, 4 * spacing), "#")
    for a, b in map(sorted, corridors):
        low, high = (np.array(node) * spacing + 2 for node in (a, b))
        cells[low[0] : high[0] + broad, low[1] : high[1] + broad] = "m"
    topology = topology_of(["".join(row) for row in reversed(cells)])
    frame = topology.grid.frame
    ends = [frame.points_of(np.array(node) * spacing + 2) for node in (start, goal)]
    words = hn.words(hn.HybridPlanner(topology, preset=preset).plan(*ends))
    at = np.array(start)
    (first,) = (edge for edge in corridors if start in edge)
    (onward,) = first - {start}
    heading = np.array(onward) - at  # (row, col): a left turn maps (r, c) to (c, -r)
    compass = {(0, 1): "east", (1, 0): "north", (0, -1): "west", (-1, 0): "south"}
    assert words[0] == f"start in the maze heading {compass[tuple(heading.tolist())]}"
    for line in words[1:]:
        metres = re.search(r"after (\d+) m", line)
        steps = 0 if metres is None else round(int(metres[1]) / (spacing * SIDE))
        for _ in range(steps):
            assert frozenset((tuple(at), tuple(at + heading))) in corridors, words
            at = at + heading
        for hand in re.findall(r"turn (left|right)", line):
            row, col = heading
            heading = np.array((col, -row) if hand == "left" else (-col, row))
    assert tuple(at) == goal, words


def test_the_command_takes_a_language(cli):
    map_file = FilePath(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
    query = ("plan", map_file, "--from", "0.5,0.5", "--via", "1.5,0.5", "--to", "2.0,2.5")
    german = cli(*query, "--language", "de", "--json").answer
    assert german["words"][0].startswith("Start in „room-1“")
    assert german["instructions"][0]["space"] == {"name": "room-1", "shape": "room"}
    assert "words      start in room-1" in cli(*query).out
    assert cli(*query, "--language", "fr").refuses(2, "de (Deutsch), en (English)", "'fr'")


@pytest.fixture(scope="module")
def floor(data):
    """GDC floor 3 with people's rooms, as a planner."""
    grid = hn.load_map(data / "bwi_gdc" / "3" / "3.yaml", robot_radius_m=0.25)
    rooms = hn.load_rooms(data / "bwi_gdc" / "3" / "locations.yaml", grid)
    return hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms)))


def pairs_of(planner, count):
    """Pairs of points on the largest connected part of a map, drawn with a seed."""
    grid = planner.grid
    labels, _ = ndimage.label(grid.classes == hn.CellClass.FREE)
    cells = np.argwhere(labels == np.bincount(labels[labels > 0]).argmax())
    chosen = np.random.default_rng(19).choice(len(cells), (count, 2))
    return grid.frame.points_of(cells[chosen.ravel()]).reshape(count, 2, 2)


@pytest.mark.full
def test_all_bends_of_a_real_floor_are_told_and_none_is_wrong(floor):
    """120 pairs. Two judges: the corners of the simplified path, and headings over windows."""
    bends = undisputed = judged = 0
    for start, goal in pairs_of(floor, 120):
        result = floor.plan(start, goal)
        assert result.solved
        points = result.path.points
        told = turns_of(result.instructions)
        pointed = told + [
            (one.at_m, 90.0 if one.doorway.onward == "left" else -90.0)
            for one in result.instructions
            if one.doorway is not None and one.doorway.onward is not None
        ]
        windows = Windows(points)
        corners = simplified_corners(points)
        sure = windows.corners(60.0)
        bends, undisputed = bends + len(corners), undisputed + len(sure)
        ends_m = [one.at_m for one in result.instructions]
        by_sight = [
            (before - 1.6, one.at_m + 1.6)
            for before, one in zip(ends_m, result.instructions[1:], strict=False)
            if one.doorway is not None and (one.doorway.is_seen or one.doorway.wall is not None)
        ]
        for corner in [*corners, *sure]:
            if any(begin <= corner.at_m <= end for begin, end in by_sight):
                continue  # a person sees the door, and goes to it
            judged += 1
            near = [degrees for at_m, degrees in pointed if abs(at_m - corner.at_m) <= 1.6]
            assert any(degrees * corner.degrees > 0 for degrees in near), (start, goal, corner)
        for at_m, degrees in told:
            hand = 1 if degrees > 0 else -1
            assert windows.turns_near(at_m, hand, 45.0 if abs(degrees) >= 55 else 26.0), (
                start,
                goal,
                at_m,
                degrees,
            )
        # The hand of a turn into a door may be that at which the door lies.
        for one in result.instructions:
            if one.turn is not None and not one.turn.is_sharp:
                assert one.turn.hand in sentences([one])[0]
        assert len(hands_of(hn.words(result))) <= len(told)
        assert not any("unnamed" in line for line in hn.words(result))
    assert bends > 150
    assert undisputed > 60
    assert judged > 10  # most doors are told by walls, which the walker of the benchmark judges
