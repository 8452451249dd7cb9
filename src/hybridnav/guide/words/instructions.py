"""From the legs of a path to instructions: what a person does, where, and past what."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from hybridnav.guide.words import Doorway, Instruction, Turn
from hybridnav.guide.words.bends import LEAST_SLIGHT_RAD, Bend, Leg, Line
from hybridnav.guide.words.events import (
    Event,
    Stretch,
    are_halves,
    events_of,
    stretches_of,
    turned,
    with_glances,
    without_slivers,
)
from hybridnav.guide.words.glances import Look
from hybridnav.guide.words.instruction import LEAST_BEND_RAD, Hand
from hybridnav.guide.words.landmarks import Landmarks
from hybridnav.planning import Path

_KEPT_M = 5.0
"""Length up to which a person goes on in the direction of the door that was passed."""
_NEARBY_M = 8.0
"""Length of a stretch whose direction is that of the start."""
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


def instructions_of(
    paths: Sequence[Path],
    legs: Sequence[Sequence[Leg]],
    landmarks: Landmarks,
    heading_rad: float | None,
) -> Iterator[Instruction]:
    """Yield the instructions for a person who walks along paths.

    `paths`: those of a tour in order; `landmarks`: the doors of the map; `heading_rad`: heading at
    the start, None if there is none.
    """
    line = Line(paths)
    stretches = without_slivers(list(stretches_of(line, legs)))
    events = events_of(line, stretches, landmarks)
    facing_rad = math.nan if heading_rad is None else line.first_heading()
    events = with_glances(line, events, landmarks, facing_rad)
    start = _start(line, events, landmarks, heading_rad)
    if start.landmark is not None or start.heading_rad is not None:
        onward_rad = line.first_heading() if start.heading_rad is None else start.heading_rad
        if start.landmark is not None and start.landmark.side == "ahead":
            onward_rad = landmarks.bearing_rad(line.at(0.0), start.landmark.door)
        events = with_glances(line, events, landmarks, onward_rad)
        if events[0].wall is not None:
            start = replace(start, landmark=None, heading_rad=None)
    yield start
    if heading_rad is None and start.landmark is None and start.heading_rad is None:
        events[0] = replace(events[0], is_oriented=False)
    since = _Since()
    for event, following in zip(events, [*events[1:], None], strict=True):
        if _is_undone(event, since):
            continue
        until_m = line.length_m if following is None else following.at_m
        instruction = _told(line, event, until_m, since, landmarks)
        yield instruction
        since = _after(event, instruction.doorway, since, landmarks)


def _start(
    line: Line, events: Sequence[Event], landmarks: Landmarks, heading_rad: float | None
) -> Instruction:
    """Return the start, with what shows the direction to a person who knows none."""
    first = events[0]
    space, onward_rad = first.stretch.space, line.first_heading()
    if first.kind != "turn":
        onward_rad = line.heading(0.0, min(first.at_m, _NEARBY_M))
    start = Instruction("start", line.at(0.0), 0.0, 0.0, space)
    if heading_rad is not None:
        angle = turned(heading_rad, onward_rad)
        return replace(start, turn=Turn(angle)) if abs(angle) >= LEAST_BEND_RAD else start
    if math.isnan(onward_rad) or first.glance is not None:
        return start
    seen = landmarks.at_start(line, space.name, {door.number for door in first.stretch.doors})
    if seen is not None:
        return replace(start, landmark=seen)
    out = next(event for event in events if event.kind != "turn")
    if out.door is not None:
        towards_rad = _eighth(landmarks.bearing_rad(line.at(0.0), out.door.number))
        if landmarks.at_a_glance(out.door, space.name, (line.at(0.0), towards_rad), 0) is not None:
            return replace(start, heading_rad=towards_rad)
    return replace(start, heading_rad=_eighth(onward_rad))


def _eighth(angle_rad: float) -> float:
    """Return the nearest point of the compass, radians."""
    eighth = math.pi / 4
    return round(angle_rad / eighth) * eighth


def _told(
    line: Line, event: Event, until_m: float, since: _Since, landmarks: Landmarks
) -> Instruction:
    """Return the instruction for an event, with what is passed before it."""
    stretch = event.stretch
    room, but = stretch.space.name, since.entered | {door.number for door in stretch.doors}
    doorway = mark = waypoint = None
    if event.following is not None:
        doorway = _doorway(line, event, event.following, landmarks, (since, until_m))
    elif event.kind == "arrive":
        waypoint = stretch.waypoint
        if waypoint is not None and waypoint != room:
            mark = landmarks.at_goal(line.at(event.at_m), _facing(line, event, since), room, but)
    return Instruction(
        event.kind,
        line.at(event.at_m),
        event.at_m,
        event.at_m - since.at_m,
        stretch.space,
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


def _doorway(
    line: Line, event: Event, following: Stretch, landmarks: Landmarks, span: tuple[_Since, float]
) -> Doorway:
    """Return a crossing for sentences: its door, and how the path comes and goes.

    Where it lies is told to a person who knows the direction of the path before it. A bend to the
    hand at which the door lies may be the turn into it: the way on is then told as one who stands
    in the door sees it.
    """
    door, (since, until_m) = event.door, span
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
    sign = event.glance or event.wall
    if sign is None:
        doorway = _on_the_way(line, event, landmarks, doorway, span)
    else:
        way = landmarks.way_out_rad(door, is_forward=event.leads_forward)
        goes_rad = _heading(line, event.at_m, until_m - event.at_m)
        onward = _hand(turned(way, goes_rad), until_m - event.at_m)
        doorway = replace(
            doorway,
            beside=None if event.glance is None else event.glance.side,
            ordinal=sign.ordinal,
            wall=event.wall,
            is_seen=event.glance is not None,
            onward=onward if doorway.behind is None else None,
        )
    return replace(doorway, onward=None) if event.is_before_glance else doorway


def _on_the_way(
    line: Line, event: Event, landmarks: Landmarks, doorway: Doorway, span: tuple[_Since, float]
) -> Doorway:
    """Return a crossing with its place for a person who has to walk to it."""
    since, door = span[0], event.door
    assert door is not None  # noqa: S101 - the caller has seen one
    doorway = _beside(line, event, span, landmarks, doorway)
    hand = doorway.beside if event.turn is None else Turn(event.turn.angle_rad).hand
    is_back = event.turn is not None and Turn(event.turn.angle_rad).is_sharp
    if hand not in ("left", "right") or is_back:
        return doorway
    look = Look(door, hand, min(since.entered, default=0))
    between_m, room = (since.at_m, event.at_m), event.stretch.space.name
    return replace(doorway, ordinal=landmarks.on_the_way(line, between_m, room, look))


def _beside(
    line: Line, event: Event, span: tuple[_Since, float], landmarks: Landmarks, doorway: Doorway
) -> Doorway:
    """Return a crossing with the hand at which its door lies, and the way on behind it."""
    (since, until_m), door = span, event.door
    assert door is not None  # noqa: S101 - the caller has seen one
    way = landmarks.way_out_rad(door, is_forward=event.leads_forward)
    before_m, behind_m = event.at_m - since.at_m, until_m - event.at_m
    comes_rad = _heading(line, event.at_m, -before_m)
    goes_rad = _heading(line, event.at_m, behind_m)
    into_rad, out_rad = turned(comes_rad, way), turned(way, goes_rad)
    is_beside = event.is_oriented and event.turn is None
    aside_rad = turned(since.facing_rad, way)
    if is_beside and abs(aside_rad) >= _ASIDE_RAD and before_m <= _KEPT_M:
        into_rad = aside_rad
    elif is_beside and are_halves(into_rad, out_rad):
        return replace(doorway, behind=doorway.behind or Turn(into_rad + out_rad))
    beside = _hand(into_rad, before_m) if is_beside else None
    onward, behind = _hand(out_rad, behind_m), doorway.behind
    is_told = behind is not None and behind.hand == beside
    if behind is not None and not (is_told and (onward == beside or _has_direction(behind_m))):
        return replace(doorway, beside=beside)
    return replace(doorway, beside=beside, behind=None, onward=onward)


def _heading(line: Line, at_m: float, length_m: float) -> float:
    """Return the direction of the path behind a door, or before it if the length is negative.

    `at_m`: where it passes the door; `length_m`: length from there to the instruction behind it,
    or, negative, to that before it. Result: radians, map frame, from 0.5 to 3 m off the door; NaN
    where the path is shorter.
    """
    sign = math.copysign(1.0, length_m)
    near_m, far_m = (at_m + sign * min(each, abs(length_m)) for each in (_CLEAR_M, _LOOK_M))
    return line.heading(min(near_m, far_m), max(near_m, far_m))


def _is_undone(event: Event, since: _Since) -> bool:
    """Return whether a slight bend leads back into the direction straight out of the door before.

    A person went straight on there, for the path left that direction by less than anyone tells.
    """
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
