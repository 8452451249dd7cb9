"""From the legs of a path to instructions: what a person does, where, and past what."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.planner.bends import Line
from hybridnav.sentences import Doorway, Instruction, Turn
from hybridnav.sentences.instruction import LEAST_BEND_RAD

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hybridnav.planner.bends import Bend
    from hybridnav.planner.landmarks import Landmarks
    from hybridnav.planner.legs import Leg
    from hybridnav.result import Path
    from hybridnav.sentences import Passed, Space
    from hybridnav.sentences.instruction import Hand, Kind
    from hybridnav.topology import Door

_SLIVER_M = 1.0
"""Length of a leg outside rooms that is not mentioned, as across a gap between two outlines."""
_GRAZE_M = 3.0
"""Length of a visit in a room, in and out by one door, that is not mentioned."""
_IN_DOORWAY_M = 1.5
"""Distance from a door within which a bend is described with it."""
_AT_WAYPOINT_M = 0.5
"""Distance from a waypoint at which a bend lies at it, and not at a door farther on."""
_NEAR_EXIT_M = 4.0
"""Distance of the first door up to which a start needs no landmark."""
_BEYOND_M = 0.75
"""Distance from a door from which a bend lies clearly before or behind it."""
_NEARER_RAD = math.radians(10.0)
_SLIGHT_RAD = math.radians(25.0)
"""Turn below which one passes an opening straight on, however it lies."""
_ASTRAY_RAD = math.radians(30.0)
"""Turn in a door from which a person who goes straight on goes astray."""
_ALONG_M = 6.0
"""Length from which a path that passes an opening aslant leads along its wall before."""
_LONG_M = 8.0
"""Length above which a stretch needs landmarks at both hands."""
_LOOK_M, _CLEAR_M = 3.0, 0.5
"""Stretch of a path beside a door that has a direction: from 0.5 to 3 m off the door."""


@dataclass(frozen=True)
class _Stretch:
    """The part of the line inside one space."""

    space: Space
    begin_m: float
    end_m: float
    doors: tuple[Door, ...] = ()
    """Doors at its end: two or more across a gap between two outlines."""
    waypoint: str | None = None
    is_last: bool = False
    """Whether its path ends with it."""


@dataclass(frozen=True)
class _Event:
    """What happens at a length of the line."""

    kind: Kind
    at_m: float
    stretch: _Stretch
    """Where one is before it."""
    following: _Stretch | None = None
    """The stretch that a crossing leads to."""
    turn: Bend | None = None
    """The bend here, or into a door."""
    behind: Bend | None = None
    """The bend behind a door."""
    is_oriented: bool = True
    """Whether a person knows the direction of the path before it."""

    @property
    def door(self) -> Door | None:
        """The door crossed: the narrowest of those on both sides of a gap."""
        return min(self.stretch.doors, key=lambda door: door.width_m, default=None)

    @property
    def leads_forward(self) -> bool:
        """Whether it leads from the first room of its door to the other."""
        doors = self.stretch.doors
        forward = True
        name = self.stretch.space.name
        for door in doors:
            forward = door.rooms[0] == name
            name = door.rooms[1] if forward else door.rooms[0]
            if door is self.door:
                break
        return forward


def instructions_of(
    paths: Sequence[Path],
    legs: Sequence[Sequence[Leg]],
    landmarks: Landmarks,
    heading_rad: float | None,
) -> Iterator[Instruction]:
    """Yield the instructions for a person who walks along paths.

    Parameters
    ----------
    paths
        Those of a tour in order.
    legs
        The legs of each.
    landmarks
        The doors of the map.
    heading_rad
        Heading at the start, None if there is none.
    """
    line = Line(paths)
    stretches = _without_slivers(list(_stretches(line, legs)))
    before_m, is_first, entered = 0.0, True, set[int]()
    events = _events(line, stretches, landmarks)
    start = _start(line, stretches[0].space, heading_rad)
    first = events[0]
    if heading_rad is None and not (first.kind == "cross" and first.at_m <= _NEAR_EXIT_M):
        left = {door.number for door in stretches[0].doors}
        start = replace(start, landmark=landmarks.at_start(line, start.space.name, left))
    yield start
    if heading_rad is None and start.landmark is None:
        events[0] = replace(events[0], is_oriented=False)
    for event, following in zip(events, [*events[1:], None], strict=True):
        stretch = event.stretch
        left = {door.number for door in stretch.doors}
        doorway = None
        if event.following is not None:
            until_m = line.length_m if following is None else following.at_m
            doorway = _doorway(line, event, event.following, landmarks, (before_m, until_m))
            doorway = replace(doorway, is_first=is_first)
        between_m = (before_m, event.at_m)
        passed = landmarks.passed(line, between_m, stretch.space.name, entered | left)
        instruction = Instruction(
            event.kind,
            line.at(event.at_m),
            event.at_m,
            event.at_m - before_m,
            stretch.space,
            _needed(passed, event.at_m - before_m, _hand_of(event, doorway)),
            None if event.turn is None else Turn(event.turn.angle_rad),
            doorway,
        )
        if event.following is not None:
            is_first, entered = False, left
        elif event.kind == "arrive":
            is_point = stretch.waypoint is not None and stretch.waypoint != stretch.space.name
            seen = landmarks.at_goal(line, between_m, stretch.space.name, entered)
            instruction = replace(
                instruction, waypoint=stretch.waypoint, landmark=seen if is_point else None
            )
            is_first = True
        yield instruction
        before_m = event.at_m


def _hand_of(event: _Event, doorway: Doorway | None) -> Hand | None:
    """Return the hand at which a person looks for a door; None for no door, and for ahead."""
    if doorway is None:
        return None
    return doorway.beside if event.turn is None else Turn(event.turn.angle_rad).hand


def _needed(passed: tuple[Passed, ...], length_m: float, hand: Hand | None) -> tuple[Passed, ...]:
    """Return what a person needs of what is passed: on a short stretch, the hand of the door."""
    if length_m > _LONG_M:
        return passed
    return tuple(one for one in passed if one.hand == hand)


def _start(line: Line, space: Space, heading_rad: float | None) -> Instruction:
    x, y = line.at(0.0)
    turn = None
    if heading_rad is not None:
        angle = _turned(heading_rad, line.first_heading())
        turn = Turn(angle) if abs(angle) >= LEAST_BEND_RAD else None
    return Instruction("start", (x, y), 0.0, 0.0, space, turn=turn)


def _stretches(line: Line, legs: Sequence[Sequence[Leg]]) -> Iterator[_Stretch]:
    """Yield the stretches of the line inside the space of each leg."""
    begin_m = 0.0
    for own, ends_m in zip(legs, line.ends_m, strict=True):
        shares = np.cumsum([begin_m, *(leg.length_m for leg in own)])[1:].tolist()
        for leg, guess_m in zip(own[:-1], shares, strict=False):
            end_m = line.nearest(leg.endpoint, begin_m, guess_m)
            doors = () if leg.door is None else (leg.door,)
            yield _Stretch(leg.space, begin_m, end_m, doors)
            begin_m = end_m
        yield _Stretch(own[-1].space, begin_m, ends_m, (), own[-1].waypoint, is_last=True)
        begin_m = ends_m


def _without_slivers(stretches: Sequence[_Stretch]) -> list[_Stretch]:
    """Join the stretches on both sides of a gap between two outlines, and of a graze.

    The doors on both sides of the gap are one, which lies where the narrower of them does.
    """
    kept: list[_Stretch] = []
    for stretch in stretches:
        before = kept[-1] if kept and not kept[-1].is_last else None
        if before is not None and _is_graze(kept[-2:], stretch):
            kept.pop()
            before = kept[-1]
        is_gap = stretch.space.name is None and stretch.end_m - stretch.begin_m < _SLIVER_M
        if before is not None and is_gap and not stretch.is_last:
            is_narrower = _narrowest_m(stretch.doors) < _narrowest_m(before.doors)
            end_m = stretch.end_m if is_narrower else before.end_m
            kept[-1] = replace(before, end_m=end_m, doors=before.doors + stretch.doors)
        elif before is not None and before.space.name == stretch.space.name:
            kept[-1] = replace(stretch, begin_m=before.begin_m)
        else:
            kept.append(stretch if before is None else replace(stretch, begin_m=before.end_m))
    return kept


def _is_graze(last: Sequence[_Stretch], stretch: _Stretch) -> bool:
    """Return whether the last stretch is a short visit between the one before and another."""
    if len(last) < 2 or last[0].is_last:  # noqa: PLR2004
        return False
    before, visit = last
    is_short = visit.end_m - visit.begin_m < _GRAZE_M
    return (
        is_short and before.doors == visit.doors[::-1] and before.space.name == stretch.space.name
    )


def _narrowest_m(doors: Sequence[Door]) -> float:
    return min((door.width_m for door in doors), default=math.inf)


def _events(line: Line, stretches: Sequence[_Stretch], landmarks: Landmarks) -> list[_Event]:
    """Return what happens along the line, in order: doors, waypoints, and bends."""
    events = [
        _Event("arrive" if one.is_last else "cross", one.end_m, one, None if one.is_last else other)
        for one, other in zip(stretches, [*stretches[1:], None], strict=True)
    ]
    ends_m = [one.end_m for one in stretches]
    near: dict[int, list[Bend]] = {}
    turns: list[_Event] = []
    for bend in line.bends():
        crossing = _crossing_near(events, bend.at_m)
        if crossing is not None and Turn(bend.angle_rad).is_slight:
            continue  # where a door lies and leads is described with it
        if crossing is None:
            stretch = stretches[min(bisect.bisect_right(ends_m, bend.at_m), len(stretches) - 1)]
            turns.append(_Event("turn", bend.at_m, stretch, turn=bend))
        else:
            near.setdefault(crossing, []).append(bend)
    for crossing, bends in near.items():
        events[crossing], others = _with_bends(events[crossing], bends, landmarks)
        turns += others
    return sorted([*events, *turns], key=lambda event: (event.at_m, event.kind == "turn"))


def _crossing_near(events: Sequence[_Event], at_m: float) -> int | None:
    """Return the index of the nearest crossing within reach of a bend, without a waypoint between;
    None if there is none."""
    waypoints = [number for number, event in enumerate(events) if event.kind == "arrive"]
    beside = [other for other in waypoints if abs(events[other].at_m - at_m) <= _AT_WAYPOINT_M]
    near = [
        (abs(event.at_m - at_m), number)
        for number, event in enumerate(events)
        if event.kind == "cross"
        and abs(event.at_m - at_m) <= _IN_DOORWAY_M
        and not any((other > number) == (events[other].at_m <= at_m) for other in waypoints)
        and all(abs(event.at_m - events[other].at_m) <= _AT_WAYPOINT_M for other in beside)
    ]
    return min(near)[1] if near else None


def _with_bends(
    event: _Event, bends: Sequence[Bend], landmarks: Landmarks
) -> tuple[_Event, list[_Event]]:
    """Return a crossing with the bends at it, and the turns that remain.

    A single bend in a door leads into it if the path behind it is clearly nearer to the right angle
    with the door than the path before it; else it lies behind the door.
    """
    before = [bend for bend in bends if bend.at_m < event.at_m]
    behind = [bend for bend in bends if bend.at_m >= event.at_m]
    if len(bends) == 1 and abs(bends[0].at_m - event.at_m) < _BEYOND_M and event.door is not None:
        way = landmarks.way_out_rad(event.door, is_forward=event.leads_forward)
        off = [abs(_turned(way, heading)) for heading in (bends[0].before_rad, bends[0].after_rad)]
        leads_in = off[1] + _NEARER_RAD < off[0]
        before, behind = (list(bends), []) if leads_in else ([], list(bends))
    rest = [_Event("turn", bend.at_m, event.stretch, turn=bend) for bend in before[:-1]]
    if event.following is not None:
        rest += [_Event("turn", bend.at_m, event.following, turn=bend) for bend in behind[1:]]
    turn, after = before[-1] if before else None, behind[0] if behind else None
    return replace(event, turn=turn, behind=after), rest


def _doorway(
    line: Line,
    event: _Event,
    following: _Stretch,
    landmarks: Landmarks,
    between_m: tuple[float, float],
) -> Doorway:
    """Return a crossing for sentences: its door, and how the path comes and goes.

    Where it lies is told to a person who knows the direction of the path before it. A bend to the
    hand at which the door lies is then told as one who stands in the door sees it.
    """
    door, at_m = event.door, event.at_m
    if door is None:
        return Doorway(following.space, behind=_turn_of(event.behind))
    doorway = Doorway(
        following.space,
        door.number,
        door.width_m,
        is_opening=door.is_opening,
        behind=_turn_of(event.behind),
    )
    way = landmarks.way_out_rad(door, is_forward=event.leads_forward)
    comes = line.heading(max(at_m - _LOOK_M, between_m[0]), max(at_m - _CLEAR_M, between_m[0]))
    goes = line.heading(min(at_m + _CLEAR_M, between_m[1]), min(at_m + _LOOK_M, between_m[1]))
    into_rad, out_rad = _turned(comes, way), _turned(way, goes)
    is_straight = doorway.is_opening and abs(_turned(comes, goes)) < _SLIGHT_RAD
    is_beside = event.is_oriented and event.turn is None
    if is_straight:
        is_beside = is_beside and at_m - between_m[0] > _ALONG_M
        return replace(doorway, beside=_hand(into_rad) if is_beside else None)
    beside, onward = _hand(into_rad) if is_beside else None, _hand(out_rad)
    behind = doorway.behind
    if behind is not None and not (beside and beside == onward == behind.hand):
        return replace(doorway, beside=beside)
    if not (event.turn or beside or onward):
        is_long = (
            event.is_oriented and between_m[0] + _LOOK_M < at_m,
            at_m + _LOOK_M < between_m[1],
        )
        beside, onward = _slight_hands(into_rad, out_rad, is_long)
    return replace(doorway, beside=beside, behind=None, onward=onward)


def _slight_hands(
    into_rad: float, out_rad: float, is_long: tuple[bool, bool]
) -> tuple[Hand | None, Hand | None]:
    """Return the hands of a door that lies, or leads, slightly aside.

    Parameters
    ----------
    into_rad
        Turn from the path before the door to the right angle with its boundary.
    out_rad
        Turn from there to the path behind it.
    is_long
        Whether the path before it, and that behind it, has a direction.

    Returns
    -------
    tuple of (str or None)
        The hand at which it lies, and the one to which it leads: the greater turn alone, and
        neither if the two cancel.
    """
    total = into_rad + out_rad
    hand: Hand = "left" if total > 0 else "right"
    if abs(into_rad) >= abs(out_rad):
        return (hand if abs(total) >= _SLIGHT_RAD and is_long[0] else None), None
    return None, (hand if abs(total) >= _ASTRAY_RAD and is_long[1] else None)


def _turn_of(bend: Bend | None) -> Turn | None:
    return None if bend is None else Turn(bend.angle_rad)


def _hand(angle_rad: float) -> Hand | None:
    """Return the hand of a turn; None for ahead, and for NaN."""
    if not abs(angle_rad) >= LEAST_BEND_RAD:
        return None
    return "left" if angle_rad > 0 else "right"


def _turned(heading_rad: float, to_rad: float) -> float:
    """Return the turn from one heading to another, radians in [-pi, pi]."""
    return math.remainder(to_rad - heading_rad, math.tau)
