"""What happens along a path: doors, waypoints, and bends, in order."""

import bisect
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hybridnav._base.trig import cos, sin
from hybridnav.guide.words import Space, Turn, Wall
from hybridnav.guide.words.bends import Bend, Leg, Line
from hybridnav.guide.words.glances import Glance
from hybridnav.guide.words.instruction import LEAST_BEND_RAD, Kind
from hybridnav.guide.words.landmarks import Landmarks
from hybridnav.rooms import Door

_SLIVER_M = 1.0
"""Length of a leg outside rooms that is not mentioned, as across a gap between two outlines."""
_GRAZE_M = 3.0
"""Length of a visit in a room, in and out by one door, that is not mentioned."""
_IN_DOORWAY_M = 1.5
"""Distance from a door within which a bend is described with it."""
_AT_WAYPOINT_M = 0.5
"""Distance from a waypoint at which a bend lies at it, and not at a door farther on."""
_BEYOND_M = 0.75
"""Distance from a door from which a bend lies clearly before or behind it."""
_INSIDE_M = 0.6
"""Distance from a door at which a person stands behind it who looks round."""
_LEAST_WALL_M, _DETOUR = 15.0, 3.0
"""Length of wall that a person follows at most: 15 m and three times the path."""
_NEARER_RAD = math.radians(10.0)
_LEAST_HALF_RAD = math.radians(20.0)
"""Turn from which the path into a door, or out of it, is half of a turn there."""


@dataclass(frozen=True)
class Stretch:
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
class Event:
    """What happens at a length of the line."""

    kind: Kind
    at_m: float
    stretch: Stretch
    """Where one is before it."""
    following: Stretch | None = None
    """The stretch that a crossing leads to."""
    turn: Bend | None = None
    """The bend here, or into a door."""
    behind: Bend | None = None
    """The bend behind a door."""
    is_oriented: bool = True
    """Whether a person knows the direction of the path before it."""
    glance: Glance | None = None
    """How a person finds its door who looks round where the event before ends; None for one who
    has to go there first."""
    wall: Wall | None = None
    """The wall to which one keeps from the door before on; None where one does not."""
    is_before_glance: bool = False
    """Whether the door behind it is found so: nobody turns between the two."""

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


def stretches_of(line: Line, legs: Sequence[Sequence[Leg]]) -> Iterator[Stretch]:
    """Yield the stretches of the line inside the space of each leg."""
    begin_m = 0.0
    for own, ends_m in zip(legs, line.ends_m, strict=True):
        shares = np.cumsum([begin_m, *(leg.length_m for leg in own)])[1:].tolist()
        for leg, guess_m in zip(own[:-1], shares, strict=False):
            end_m = line.nearest(leg.endpoint, begin_m, guess_m)
            doors = () if leg.door is None else (leg.door,)
            yield Stretch(leg.space, begin_m, end_m, doors)
            begin_m = end_m
        yield Stretch(own[-1].space, begin_m, ends_m, (), own[-1].waypoint, is_last=True)
        begin_m = ends_m


def without_slivers(stretches: Sequence[Stretch]) -> list[Stretch]:
    """Join the stretches on both sides of a gap between two outlines, and of a graze.

    The doors on both sides of the gap are one, which lies where the narrower of them does.
    """
    kept: list[Stretch] = []
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


def _is_graze(last: Sequence[Stretch], stretch: Stretch) -> bool:
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


def events_of(line: Line, stretches: Sequence[Stretch], landmarks: Landmarks) -> list[Event]:
    """Return what happens along the line, in order: doors, waypoints, and bends."""
    events = [
        Event("arrive" if one.is_last else "cross", one.end_m, one, None if one.is_last else other)
        for one, other in zip(stretches, [*stretches[1:], None], strict=True)
    ]
    ends_m = [one.end_m for one in stretches]
    near: dict[int, list[Bend]] = {}
    turns: list[Event] = []
    for bend in line.bends():
        crossing = _crossing_near(events, bend.at_m)
        if crossing is not None and Turn(bend.angle_rad).is_slight:
            continue  # where a door lies and leads is described with it
        if crossing is None:
            stretch = stretches[min(bisect.bisect_right(ends_m, bend.at_m), len(stretches) - 1)]
            turns.append(Event("turn", bend.at_m, stretch, turn=bend))
        else:
            near.setdefault(crossing, []).append(bend)
    for crossing, bends in near.items():
        events[crossing], others = _with_bends(events[crossing], bends, landmarks)
        turns += others
    return sorted([*events, *turns], key=lambda event: (event.at_m, event.kind == "turn"))


def _crossing_near(events: Sequence[Event], at_m: float) -> int | None:
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
    event: Event, bends: Sequence[Bend], landmarks: Landmarks
) -> tuple[Event, list[Event]]:
    """Return a crossing with the bends at it, and the turns that remain.

    A single bend in a door leads into it if the path behind it is clearly nearer to the right angle
    with the door than the path before it; else it lies behind the door. So does a bend before the
    door that only half leads into it, and half out of it.
    """
    before = [bend for bend in bends if bend.at_m < event.at_m]
    behind = [bend for bend in bends if bend.at_m >= event.at_m]
    way = math.nan
    if event.door is not None:
        way = landmarks.way_out_rad(event.door, is_forward=event.leads_forward)
    if len(bends) == 1 and abs(bends[0].at_m - event.at_m) < _BEYOND_M and event.door is not None:
        off = [abs(turned(way, heading)) for heading in (bends[0].before_rad, bends[0].after_rad)]
        leads_in = off[1] + _NEARER_RAD < off[0]
        before, behind = (list(bends), []) if leads_in else ([], list(bends))
    if before and not behind:
        last = before[-1]
        if are_halves(turned(last.before_rad, way), turned(way, last.after_rad)):
            behind = [before.pop()]
    rest = [Event("turn", bend.at_m, event.stretch, turn=bend) for bend in before[:-1]]
    if event.following is not None:
        rest += [Event("turn", bend.at_m, event.following, turn=bend) for bend in behind[1:]]
    turn, after = before[-1] if before else None, behind[0] if behind else None
    return replace(event, turn=turn, behind=after), rest


def with_glances(  # noqa: C901 - a door is seen, led to by a wall, or walked to
    line: Line, events: Sequence[Event], landmarks: Landmarks, facing_rad: float
) -> list[Event]:
    """Return events without the turns on the way to a door that a person sees from afar.

    `events`: what happens along it; `landmarks`: the doors of the map; `facing_rad`: direction in
    which a person looks at the start, radians; NaN for one who knows none.
    """
    kept: list[Event] = []
    pose: tuple[tuple[float, float], float] | None = (line.at(0.0), facing_rad)
    came_by, at = 0, 0
    while at < len(events):
        following = at
        while events[following].kind == "turn":
            following += 1
        event, glance, wall = events[following], None, None
        door = event.door
        if pose is not None and door is not None:
            room = event.stretch.space.name
            glance = landmarks.at_a_glance(door, room, pose, came_by)
            before = kept[-1] if kept else None
            if glance is not None and before is not None and before.kind == "cross":
                kept[-1] = replace(before, behind=None, is_before_glance=True)
            elif glance is None and before is not None and before.behind is not None:
                pose = (pose[0], before.behind.after_rad)
                glance = landmarks.at_a_glance(door, room, pose, came_by)
        is_counted = glance is not None and glance.ordinal is not None
        if (
            door is not None
            and kept
            and kept[-1].kind == "cross"
            and (glance is None or is_counted)
        ):
            wall = _wall_between(kept[-1], event, landmarks)
            if glance is not None and wall is not None:
                wall = None if wall.via or wall.past else wall
                glance = glance if wall is None else None
        elif door is not None and glance is None and not kept and not math.isnan(facing_rad):
            most_m = _LEAST_WALL_M + _DETOUR * event.at_m
            room = event.stretch.space.name
            wall = landmarks.from_a_door(line.at(0.0), event.stretch.doors[0], room, most_m)
        if wall is not None and kept:
            kept[-1] = replace(kept[-1], behind=None, is_before_glance=True)
        if glance is not None or wall is not None:
            kept.append(replace(event, turn=None, glance=glance, wall=wall))
            at = following + 1
        else:
            kept.append(events[at])
            at += 1
        pose = _pose_after(line, kept[-1], landmarks)
        if kept[-1].door is not None:
            came_by = kept[-1].door.number
    return kept


def _wall_between(before: Event, event: Event, landmarks: Landmarks) -> Wall | None:
    if not before.stretch.doors:
        return None
    most_m = _LEAST_WALL_M + _DETOUR * (event.at_m - before.at_m)
    room, came_by = event.stretch.space.name, before.stretch.doors[-1].number
    beyond = None if event.following is None else event.following.space.name
    return landmarks.along_a_wall(came_by, event.stretch.doors[0], room, most_m, beyond)


def _pose_after(
    line: Line, event: Event, landmarks: Landmarks
) -> tuple[tuple[float, float], float] | None:
    """Return where a person stands after an event, and looks to; None if that is not known."""
    if event.kind == "turn" and event.turn is not None:
        return line.at(event.at_m), event.turn.after_rad
    if event.kind != "cross" or event.door is None:
        return None
    way = landmarks.way_out_rad(event.door, is_forward=event.leads_forward)
    if math.isnan(way):
        return line.at(event.at_m), way
    x, y = event.door.position
    return (x + _INSIDE_M * cos(way), y + _INSIDE_M * sin(way)), way


def are_halves(into_rad: float, out_rad: float) -> bool:
    """Return whether the turns into a door and out of it are one, too slight to be told each."""
    slighter, greater = sorted((abs(into_rad), abs(out_rad)))
    is_one_turn = into_rad * out_rad > 0 and slighter + greater >= LEAST_BEND_RAD
    return is_one_turn and slighter >= _LEAST_HALF_RAD and greater < LEAST_BEND_RAD


def turned(heading_rad: float, to_rad: float) -> float:
    """Return the turn from one heading to another, radians in [-pi, pi]."""
    return math.remainder(to_rad - heading_rad, math.tau)
