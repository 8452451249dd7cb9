"""From the legs of a path to instructions: what a person does, where, and past what."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from hybridnav.planner.guide import Doorway, Instruction, Turn
from hybridnav.planner.guide.bends import LEAST_SLIGHT_RAD, Line
from hybridnav.planner.guide.events import (
    are_halves,
    events_of,
    stretches_of,
    turned,
    without_slivers,
)
from hybridnav.planner.guide.instruction import LEAST_BEND_RAD

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hybridnav.planner import Path
    from hybridnav.planner.guide import Landmark, Passed
    from hybridnav.planner.guide.bends import Bend, Leg
    from hybridnav.planner.guide.events import Event, Stretch
    from hybridnav.planner.guide.instruction import Hand
    from hybridnav.planner.guide.landmarks import Landmarks

_NEAR_EXIT_M = 4.0
"""Distance of the first door up to which a start needs no landmark."""
_STRAIGHT_RAD = math.radians(25.0)
"""Turn below which one passes an opening straight on, however it lies."""
_ALONG_M = 6.0
"""Length from which a path that passes an opening aslant leads along its wall before."""
_LONG_M = 8.0
"""Length above which a stretch needs landmarks at both hands."""
_KEPT_M = 5.0
"""Length up to which a person goes on in the direction of the door that was passed."""
_LAST_M = 1.0
"""End of a path that has a direction."""
_ASIDE_RAD = math.radians(60.0)
"""Angle between two doors from which the second lies at one hand for a person in the first."""
_LOOK_M, _CLEAR_M, _LEAST_M = 3.0, 0.5, 1.0
"""Stretch of a path beside a door that has a direction: from 0.5 to 3 m off it, and its length."""


@dataclass(frozen=True)
class _Since:
    """What a person knows since the instruction before."""

    at_m: float = 0.0
    """Where it is followed, by the length of the line."""
    is_first: bool = True
    """Whether the next door is the first one after the start or a waypoint."""
    entered: frozenset[int] = frozenset()
    """Numbers of the doors by which one has entered the room."""
    facing_rad: float = math.nan
    """Direction in which one has passed the last door, and goes on; NaN where another was told."""
    towards: int | None = None
    """Number of the door towards which one has started."""


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
    stretches = without_slivers(list(stretches_of(line, legs)))
    events = events_of(line, stretches, landmarks)
    start = _start(line, events[0], landmarks, heading_rad)
    yield start
    if heading_rad is None and start.landmark is None and start.heading_rad is None:
        events[0] = replace(events[0], is_oriented=False)
    mark = start.landmark
    towards = mark.door if mark is not None and mark.side == "ahead" else None
    since = _Since(entered=_left_behind(mark), towards=towards)
    for event, following in zip(events, [*events[1:], None], strict=True):
        if _is_undone(event, since):
            continue
        until_m = line.length_m if following is None else following.at_m
        instruction = _told(line, event, until_m, since, landmarks)
        yield instruction
        since = _after(event, instruction.doorway, since, landmarks)


def _start(
    line: Line, first: Event, landmarks: Landmarks, heading_rad: float | None
) -> Instruction:
    """Return the start, with what shows the direction to a person who knows none."""
    space, onward_rad = first.stretch.space, line.first_heading()
    start = Instruction("start", line.at(0.0), 0.0, 0.0, space)
    if heading_rad is not None:
        angle = turned(heading_rad, onward_rad)
        return replace(start, turn=Turn(angle)) if abs(angle) >= LEAST_BEND_RAD else start
    if math.isnan(onward_rad) or (first.kind == "cross" and first.at_m <= _NEAR_EXIT_M):
        return start
    seen = landmarks.at_start(line, space.name, {door.number for door in first.stretch.doors})
    return replace(start, landmark=seen, heading_rad=onward_rad if seen is None else None)


def _left_behind(mark: Landmark | None) -> frozenset[int]:
    """Return the door named at the start, if a person does not pass it afterwards."""
    is_passed = mark is None or mark.side.startswith("ahead")
    return frozenset() if is_passed or mark is None else frozenset({mark.door})


def _told(
    line: Line, event: Event, until_m: float, since: _Since, landmarks: Landmarks
) -> Instruction:
    """Return the instruction for an event, with what is passed before it."""
    stretch, between_m = event.stretch, (since.at_m, event.at_m)
    room, but = stretch.space.name, since.entered | {door.number for door in stretch.doors}
    doorway = mark = waypoint = None
    if event.following is not None:
        doorway = _doorway(line, event, event.following, landmarks, (since, until_m))
    elif event.kind == "arrive":
        waypoint = stretch.waypoint
        if waypoint is not None and waypoint != room:
            mark = landmarks.at_goal(line.at(event.at_m), _facing(line, event, since), room, but)
            but |= frozenset() if mark is None else {mark.door}
    passed = landmarks.passed(line, between_m, room, but)
    return Instruction(
        event.kind,
        line.at(event.at_m),
        event.at_m,
        event.at_m - since.at_m,
        stretch.space,
        _needed(passed, event.at_m - since.at_m, _hand_of(event, doorway)),
        None if event.turn is None else Turn(event.turn.angle_rad),
        doorway,
        waypoint,
        mark,
    )


def _facing(line: Line, event: Event, since: _Since) -> float:
    """Return the direction in which a person looks who arrives, radians; NaN without motion."""
    if event.at_m - since.at_m <= _KEPT_M and not math.isnan(since.facing_rad):
        return since.facing_rad
    return line.heading(max(since.at_m, event.at_m - _LAST_M), event.at_m)


def _after(event: Event, doorway: Doorway | None, since: _Since, landmarks: Landmarks) -> _Since:
    """Return what a person knows after an instruction."""
    if event.kind == "arrive":
        return _Since(event.at_m, entered=since.entered)
    if doorway is None:
        return replace(since, at_m=event.at_m, facing_rad=math.nan)
    is_told = not doorway.is_opening or doorway.beside is not None or event.turn is not None
    facing_rad = math.nan
    if event.door is not None and is_told and doorway.behind is None and doorway.onward is None:
        facing_rad = landmarks.way_out_rad(event.door, is_forward=event.leads_forward)
    entered = frozenset(door.number for door in event.stretch.doors)
    return _Since(event.at_m, False, entered, facing_rad)


def _hand_of(event: Event, doorway: Doorway | None) -> Hand | None:
    """Return the hand at which a person looks for a door; None for no door, and for ahead."""
    if doorway is None:
        return None
    return doorway.beside if event.turn is None else Turn(event.turn.angle_rad).hand


def _needed(passed: tuple[Passed, ...], length_m: float, hand: Hand | None) -> tuple[Passed, ...]:
    """Return what a person needs of what is passed: on a short stretch, the hand of the door."""
    if length_m > _LONG_M:
        return passed
    return tuple(one for one in passed if one.hand == hand)


def _doorway(
    line: Line,
    event: Event,
    following: Stretch,
    landmarks: Landmarks,
    known: tuple[_Since, float],
) -> Doorway:
    """Return a crossing for sentences: its door, and how the path comes and goes.

    Where it lies is told to a person who knows the direction of the path before it. A bend to the
    hand at which the door lies may be the turn into it: the way on is then told as one who stands
    in the door sees it.
    """
    door, (since, until_m) = event.door, known
    doorway = Doorway(following.space, is_first=since.is_first, behind=_turn_of(event.behind))
    if door is None:
        return doorway
    doorway = replace(
        doorway,
        door=door.number,
        width_m=door.width_m,
        passage_m=door.passage_m,
        is_opening=door.is_opening,
    )
    way = landmarks.way_out_rad(door, is_forward=event.leads_forward)
    before_m, behind_m = event.at_m - since.at_m, until_m - event.at_m
    comes_rad = _heading(line, event.at_m, -before_m)
    goes_rad = _heading(line, event.at_m, behind_m)
    into_rad, out_rad = turned(comes_rad, way), turned(way, goes_rad)
    faces_rad = comes_rad
    if before_m <= _KEPT_M and not math.isnan(since.facing_rad):
        faces_rad = since.facing_rad
    is_beside = event.is_oriented and event.turn is None
    is_straight = event.is_oriented and abs(turned(faces_rad, goes_rad)) < _STRAIGHT_RAD
    if doorway.is_opening and is_straight:
        is_beside = is_beside and before_m > _ALONG_M
        return replace(doorway, beside=_hand(into_rad, before_m) if is_beside else None)
    aside_rad = turned(since.facing_rad, way)
    if is_beside and abs(aside_rad) >= _ASIDE_RAD and before_m <= _KEPT_M:
        into_rad = aside_rad
    elif is_beside and are_halves(into_rad, out_rad):
        return replace(doorway, behind=doorway.behind or Turn(into_rad + out_rad))
    seen_m = 0.0 if door.number == since.towards else before_m
    beside = _hand(into_rad, seen_m) if is_beside else None
    onward, behind = _hand(out_rad, behind_m), doorway.behind
    is_told = behind is not None and behind.hand == beside
    if behind is not None and not (is_told and (onward == beside or _has_direction(behind_m))):
        return replace(doorway, beside=beside)
    return replace(doorway, beside=beside, behind=None, onward=onward)


def _heading(line: Line, at_m: float, length_m: float) -> float:
    """Return the direction of the path behind a door, or before it if the length is negative.

    Parameters
    ----------
    line
        The path.
    at_m
        Where it passes the door.
    length_m
        Length from there to the instruction behind it, or, negative, to that before it.

    Returns
    -------
    float
        Radians, map frame, from 0.5 to 3 m off the door; NaN where the path is shorter.
    """
    sign = math.copysign(1.0, length_m)
    near_m, far_m = (at_m + sign * min(each, abs(length_m)) for each in (_CLEAR_M, _LOOK_M))
    return line.heading(min(near_m, far_m), max(near_m, far_m))


def _is_undone(event: Event, since: _Since) -> bool:
    """Return whether a slight bend leads back into the direction of a person who went straight on
    out of the door before, for the path left it by less than anyone tells."""
    bend = event.turn
    is_slight = event.kind == "turn" and bend is not None and Turn(bend.angle_rad).is_slight
    if bend is None or not is_slight or event.at_m - since.at_m > _KEPT_M:
        return False
    angle_rad = turned(since.facing_rad, bend.after_rad)
    return abs(angle_rad) < LEAST_SLIGHT_RAD or angle_rad * bend.angle_rad < 0


def _turn_of(bend: Bend | None) -> Turn | None:
    return None if bend is None else Turn(bend.angle_rad)


def _hand(angle_rad: float, length_m: float) -> Hand | None:
    """Return the hand of a turn between a door and a part of the path; None for ahead, and for NaN.

    A slight turn counts where the part is long enough to have a direction.
    """
    least_rad = LEAST_SLIGHT_RAD if _has_direction(length_m) else LEAST_BEND_RAD
    if not abs(angle_rad) >= least_rad:
        return None
    return "left" if angle_rad > 0 else "right"


def _has_direction(length_m: float) -> bool:
    """Return whether a part of the path beside a door is long enough to have a direction."""
    return length_m - _CLEAR_M >= _LEAST_M
