"""Turns at doors a second time: the path against the right angle of each door that it passes.

Doors are found by the rooms of the cells along the path, and their right angle by the line
between the two ends of the door. Nothing is shared with `hybridnav.planning`.
"""

import itertools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybridnav as hn
from hybridnav.guide.words import Instruction

FloatArray = NDArray[np.float64]

STEP_M = 0.02
NEAR_M, FAR_M = 0.5, 3.0
"""The part of the path beside a door that has a direction."""
LEAST_PART_M = 1.0
"""Length of that part from which it has one, where the room behind is left before."""
LEAST_DEGREES = 40.0
"""Turn that a person must be told."""
TURN_DEGREES = 50.0
"""Turn from which nobody takes one for a half of another."""
AT_DOOR_M = 1.5
"""Distance from a door within which the instruction for it lies."""
GRAZE_M = 3.0
"""Length of a way in and out by one door below which nobody says that it was a visit: a path past
a wide mouth cuts the line between the two rooms."""
KEPT_M = 5.0
"""Length up to which a person goes on in the direction of the door that was passed."""


@dataclass(frozen=True)
class Passage:
    """A door that a path passes from one room into another."""

    number: int
    kind: str
    at_m: float
    into: float
    """Degrees from the path before the door to its right angle; NaN where it has no direction."""
    out: float
    """Degrees from there to the path behind it."""
    normal_rad: float


class Walk:
    """A path through rooms, sampled every 2 cm."""

    def __init__(self, topology: hn.TopologicalMap, points: FloatArray) -> None:
        self.rooms = topology.rooms
        lengths = np.hypot(*np.diff(points, axis=0).T)
        where = np.concatenate([[0.0], np.cumsum(lengths)])
        self.length_m = float(where[-1])
        self._along = np.arange(0.0, self.length_m + STEP_M / 2, STEP_M)
        self._x, self._y = (np.interp(self._along, where, part) for part in points.T)
        cells = self.rooms.grid.frame.cells_of(np.column_stack([self._x, self._y]))
        self._label = self.rooms.labels.label_of[tuple(cells.T)]

    def heading(self, begin_m: float, end_m: float) -> float:
        """Direction of a chord, NaN for one shorter than `LEAST_PART_M` of the path."""
        begin_m, end_m = max(begin_m, 0.0), min(end_m, self.length_m)
        if end_m - begin_m < LEAST_PART_M:
            return math.nan
        (x, to_x), (y, to_y) = (
            np.interp([begin_m, end_m], self._along, part) for part in (self._x, self._y)
        )
        return math.atan2(to_y - y, to_x - x)

    def passages(self) -> list[Passage]:
        """Doors between two named rooms, each of which the path stays in for half a metre."""
        found = []
        for (before, came, at), (behind, _, left) in itertools.pairwise(self._runs()):
            stays = min(at - came, left - at) * STEP_M >= NEAR_M or came == 0
            if before >= 0 and behind >= 0 and stays and (left - at) * STEP_M >= NEAR_M:
                found += self._passage(before, behind, (came, at, left))
        return found

    def _runs(self) -> list[tuple[int, int, int]]:
        """Room, first sample and end of each part of the path, grazes left out."""
        begins = [0, *(np.flatnonzero(np.diff(self._label)) + 1).tolist()]
        runs: list[tuple[int, int, int]] = []
        for begin, end in zip(begins, [*begins[1:], len(self._label)], strict=True):
            room = int(self._label[begin])
            if len(runs) > 1 and runs[-2][0] == room and self._is_graze(room, *runs[-1]):
                runs[-2:] = [(room, runs[-2][1], end)]
            else:
                runs.append((room, begin, end))
        return runs

    def _is_graze(self, beside: int, visited: int, enters: int, leaves: int) -> bool:
        doors = [self._door(beside, visited, at) for at in (enters, leaves)]
        return (leaves - enters) * STEP_M < GRAZE_M and None is not doors[0] == doors[1]

    def _door(self, before: int, behind: int, at: int) -> hn.Door | None:
        """The door of two rooms at a sample of the path; None where none is near."""
        if min(before, behind) < 0:
            return None
        names = self.rooms.labels.names
        point = np.array([self._x[at], self._y[at]])
        near = [
            (float(np.hypot(*(middles - point).T).min()), door.number, door, middles)
            for door in self.rooms.doors
            if set(door.rooms) == {names[before], names[behind]}
            for middles in [sides_of(self.rooms, door.number, before, behind)[0]]
            if len(middles)
        ]
        is_near = near and min(near)[0] <= 2 * self.rooms.grid.resolution_m
        return min(near)[2] if is_near else None

    def _passage(self, before: int, behind: int, run: tuple[int, int, int]) -> list[Passage]:
        came, at, left = (index * STEP_M for index in run)
        door = self._door(before, behind, run[1])
        if door is None:
            return []
        normal_rad = normal_of(self.rooms, door.number, before, behind)
        into = degrees_to(self.heading(max(at - FAR_M, came), at - NEAR_M), normal_rad)
        out = degrees_to(normal_rad, self.heading(at + NEAR_M, min(at + FAR_M, left)))
        return [Passage(door.number, door.kind, at, into, out, normal_rad)]


def sides_of(rooms: Any, number: int, before: int, behind: int) -> tuple[FloatArray, FloatArray]:
    """Middles of the sides between the cells of two rooms at a door, and the steps across them."""
    cols = rooms.grid.shape[1]
    cells = {tuple(divmod(int(flat), cols)) for flat in rooms.cells_beside(number)}
    label_of = rooms.labels.label_of
    middles, steps = [], []
    for row, col in cells:
        for up, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            to = row + up, col + right
            if label_of[row, col] == before and to in cells and label_of[to] == behind:
                middles.append((row + up / 2, col + right / 2))
                steps.append((up, right))
    frame = rooms.grid.frame
    at = np.array(middles).reshape(-1, 2)
    step = np.array(steps).reshape(-1, 2)
    origin = frame.points_of(np.zeros((1, 2), dtype=np.int64))[0]
    axes = [frame.points_of(np.array([one]))[0] - origin for one in ((1, 0), (0, 1))]
    turn = np.array(axes)
    return origin + at @ turn, step @ turn


def normal_of(rooms: Any, number: int, before: int, behind: int) -> float:
    """Right angle of a door towards the room behind it: across the line between its two ends, the
    corners of its sides that lie farthest apart."""
    middles, steps = sides_of(rooms, number, before, behind)
    across = np.column_stack([-steps[:, 1], steps[:, 0]]) / 2
    corners = np.concatenate([middles - across, middles + across])
    apart = np.hypot(*(corners[:, None] - corners[None]).transpose(2, 0, 1))
    one, other = np.unravel_index(int(apart.argmax()), apart.shape)
    x, y = corners[other] - corners[one]
    normal = np.array([-y, x])
    normal = normal * (1 if normal @ steps.sum(axis=0) > 0 else -1)
    return math.atan2(normal[1], normal[0])


def degrees_to(heading_rad: float, to_rad: float) -> float:
    """Degrees from one heading to another; NaN if one is missing."""
    if math.isnan(heading_rad) or math.isnan(to_rad):
        return math.nan
    return math.degrees(math.remainder(to_rad - heading_rad, math.tau))


@dataclass(frozen=True)
class Verdict:
    """What the words of one path say of its doors."""

    turns: list[Passage]
    """Those behind which the path turns by 40 degrees or more."""
    missed: list[Passage]
    """Those of them that nothing tells."""
    beside: list[Passage]
    """Doors that lie ahead, and are told at one hand."""
    behind: list[Passage]
    """Doors with a turn told behind them that the path does not make."""
    double: list[Passage]
    """Doors with two turns told where the path makes one right angle in halves."""
    halves: list[Passage]
    """Doors at which the path turns by 60 degrees and more in parts, none of which is told."""
    bears: list[Instruction]
    """Slight turns that a person who passed the door before straight on must not make."""
    untold: list[Instruction]
    """Instructions with a number that is none."""


def judged(topology: hn.TopologicalMap, result: hn.PlanResult) -> Verdict:
    """Compare the words of a path with its doors."""
    walk = Walk(topology, result.path.points)
    told = result.instructions
    passages = [one for one in walk.passages() if not _is_by_sight(told, _instruction(told, one))]
    at_door = {one.at_m: _instruction(told, one) for one in passages}
    wide = [one for one in passages if abs(one.out) >= LEAST_DEGREES]
    turns = [one for one in wide if not _is_straight_opening(walk, one)]
    lately = [_from_the_last_turn(walk, told, one) for one in passages]
    return Verdict(
        turns,
        [one for one in turns if not _is_told(told, at_door[one.at_m], one)],
        [one for one in lately if _is_wrongly_beside(at_door[one.at_m], one, passages)],
        [one for one in passages if _is_wrongly_behind(at_door[one.at_m], one)],
        [one for one in passages if _is_double(at_door[one.at_m], one, passages)],
        [one for one in passages if _is_unsaid_half(told, at_door[one.at_m], one)],
        _wrong_bears(walk, told, passages),
        [one for one in told if not _is_finite(one)],
    )


def _is_by_sight(told: tuple[Instruction, ...], at_door: Instruction | None) -> bool:
    """Whether a person sees the door from the instruction before, or from it the next one: then
    that is told, and no turn."""
    crossed = [one for one in told if one.doorway is not None]
    around = crossed[crossed.index(at_door) :][:2] if at_door in crossed else []
    doorways = [one.doorway for one in around if one.doorway is not None]
    return any(one.is_seen or one.wall is not None for one in doorways)


def _is_straight_opening(walk: Walk, passage: Passage) -> bool:
    """Whether a path leads straight on through a wide opening: nobody looks along its right
    angle."""
    if passage.kind == "door":
        return False
    comes = walk.heading(passage.at_m - LEAST_PART_M, passage.at_m)
    goes = walk.heading(passage.at_m + NEAR_M, passage.at_m + FAR_M)
    return abs(degrees_to(comes, goes)) < LEAST_DEGREES


def _instruction(told: tuple[Instruction, ...], passage: Passage) -> Instruction | None:
    through = [one for one in told if one.doorway and one.doorway.door == passage.number]
    near = [one for one in through if abs(one.at_m - passage.at_m) <= AT_DOOR_M]
    return min(near, key=lambda one: abs(one.at_m - passage.at_m), default=None)


def _hands_behind(one: Instruction | None) -> list[float]:
    """Signs of the turns told behind a door."""
    if one is None or one.doorway is None:
        return []
    behind, onward = one.doorway.behind, one.doorway.onward
    found = [] if behind is None else [behind.angle_rad]
    return found + ([] if onward is None else [1.0 if onward == "left" else -1.0])


def _is_told(told: tuple[Instruction, ...], at_door: Instruction | None, passage: Passage) -> bool:
    """A turn behind the door, or a turn or a door at that hand within the next 3 m."""
    hands = _hands_behind(at_door)
    for one in told:
        if one is at_door or not passage.at_m - NEAR_M <= one.at_m <= passage.at_m + FAR_M:
            continue
        if one.kind == "arrive" and one.after_m < FAR_M and one.landmark is not None:
            continue
        if one.turn is not None:
            hands.append(one.turn.angle_rad)
        elif one.doorway is not None and one.doorway.beside is not None:
            hands.append(1.0 if one.doorway.beside == "left" else -1.0)
    return any(hand * passage.out > 0 for hand in hands)


def _from_the_last_turn(walk: Walk, told: tuple[Instruction, ...], passage: Passage) -> Passage:
    """The passage of one who came since the turn that was told last: nobody looks back past it."""
    turns = [one.at_m for one in told if one.kind == "turn" and one.at_m < passage.at_m]
    if not turns or turns[-1] < passage.at_m - FAR_M:
        return passage
    comes = walk.heading(turns[-1], passage.at_m - NEAR_M)
    return replace(passage, into=degrees_to(comes, passage.normal_rad))


def _is_wrongly_beside(
    at_door: Instruction | None, passage: Passage, passages: list[Passage]
) -> bool:
    if at_door is None or at_door.doorway is None or at_door.doorway.beside is None:
        return False
    sign = 1 if at_door.doorway.beside == "left" else -1
    return not _is_aside(passage, passages) and sign * passage.into < LEAST_DEGREES - 5


def _is_aside(passage: Passage, passages: list[Passage]) -> bool:
    """Whether its wall is at an angle to that of the door just before: it lies at one hand of a
    person who looks out of that door."""
    before = [one for one in passages if 0 < passage.at_m - one.at_m <= KEPT_M]
    aside = degrees_to(before[-1].normal_rad, passage.normal_rad) if before else 0.0
    return abs(aside) >= LEAST_DEGREES


def _is_double(at_door: Instruction | None, passage: Passage, passages: list[Passage]) -> bool:
    """Two turns to one hand told where both are parts of one: each is far from a right angle."""
    if at_door is None or at_door.doorway is None or _is_aside(passage, passages):
        return False
    hands = [] if at_door.turn is None else [at_door.turn.angle_rad]
    if at_door.doorway.beside is not None:
        hands.append(1.0 if at_door.doorway.beside == "left" else -1.0)
    is_told_twice = any(a * b > 0 for a in hands for b in _hands_behind(at_door))
    is_neither_whole = abs(passage.into) < TURN_DEGREES and abs(passage.out) < TURN_DEGREES
    return is_told_twice and is_neither_whole


def _is_wrongly_behind(at_door: Instruction | None, passage: Passage) -> bool:
    """A turn told behind a door for a way on that is straight on, or to the other hand."""
    return any(hand * passage.out < 0 or abs(passage.out) < 15 for hand in _hands_behind(at_door))


def _is_unsaid_half(
    told: tuple[Instruction, ...], at_door: Instruction | None, passage: Passage
) -> bool:
    """A turn of 60 degrees and more in parts to one hand, of which nothing is told."""
    total = passage.into + passage.out
    if not (abs(total) >= 60 and passage.into * passage.out > 0) or at_door is None:
        return False
    if at_door.turn is not None or (at_door.doorway is not None and at_door.doorway.beside):
        return False
    if at_door is told[1] and (told[0].turn, told[0].landmark, told[0].heading_rad) == (None,) * 3:
        return False  # who faces anywhere at the start has found the door, and stands in it
    before = any(
        one.turn is not None and one.turn.angle_rad * total > 0
        for one in told
        if one.kind == "turn" and abs(one.at_m - passage.at_m) <= FAR_M
    )
    return not before and not _is_told(told, at_door, passage)


def _wrong_bears(
    walk: Walk, told: tuple[Instruction, ...], passages: list[Passage]
) -> list[Instruction]:
    """Slight turns just behind a door that was passed without a turn told: a person who looks out
    of it at right angles must be turned to the way on by them."""
    found = []
    for before, one in itertools.pairwise(told):
        if one.kind != "turn" or one.turn is None or not one.turn.is_slight:
            continue
        passage = next((each for each in passages if _instruction(told, each) is before), None)
        is_far = one.at_m - before.at_m > KEPT_M
        if passage is None or is_far or _hands_behind(before) or passage.kind != "door":
            continue
        onward = walk.heading(one.at_m + NEAR_M, one.at_m + FAR_M)
        turn = degrees_to(passage.normal_rad, onward)
        if not math.isnan(turn) and turn * one.turn.angle_rad < math.radians(20):
            found.append(one)
    return found


def _is_finite(one: Instruction) -> bool:
    turns = [one.turn, None if one.doorway is None else one.doorway.behind]
    numbers = [turn.angle_rad for turn in turns if turn is not None]
    numbers += [*one.position, one.at_m, one.after_m]
    numbers += [] if one.heading_rad is None else [one.heading_rad]
    return all(map(math.isfinite, numbers))
