"""Doors and openings as a person meets them: how they lie to a path, and which are passed."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.poses import wrapped
from hybridnav._base.trig import atan2, directions, sin
from hybridnav.maps import CellClass
from hybridnav.planner.guide import Landmark, Passed, Space

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from hybridnav._base.typing import FloatArray
    from hybridnav.planner.guide.bends import Line
    from hybridnav.planner.guide.instruction import Hand, Side
    from hybridnav.topology.rooms import Door, Rooms

_LATERAL_M = 3.5
"""Distance from the path at which a door counts as passed, at most."""
_NARROWEST_M = 0.5
"""Width below which a person sees no door."""
_MARGIN_M = 0.75
"""Ends of a stretch at which no door counts: it lies at the corner, not on the way."""
_ONE_DOOR_M = 1.0
"""Distance of boundaries that belong to one door, as on both sides of a pillar."""
_LOOK_M = 1.0
_FARTHEST_M = 20.0
"""Distance at which a person recognises a door from the start, at most."""
_NEARBY_M = 5.0
"""Distance of a door that shows a person where a path ends, at most."""
_NEAREST_M = 0.7
"""Distance from a door below which nobody can tell where it lies."""
_AHEAD_RAD = math.radians(15.0)
"""Angle to the path up to which a landmark lies ahead, or behind."""
_TOWARDS_RAD = math.radians(20.0)
"""Angle to the first stretch up to which a path leads towards some part of its exit."""
_BESIDE_RAD = math.radians(60.0)
"""Angle to the path from which a landmark lies at one hand."""
_LEAST_SIDEWAYS = 0.5
"""Sine of the least angle between a path and the way out by a door beside it."""


class Landmarks:
    """The doors of a map, as a person on a path sees them.

    Parameters
    ----------
    rooms
        The rooms.
    """

    def __init__(self, rooms: Rooms) -> None:
        self._rooms = rooms
        self._way_through_rad: dict[int, float] = {}
        self._points_of: dict[int, FloatArray] = {}

    @cached_property
    def _doors_of(self) -> dict[str | None, list[Door]]:
        """The doors that a person notices, by the room on each side."""
        found: dict[str | None, list[Door]] = {}
        for door in self._rooms.listed_doors:
            if door.width_m >= _NARROWEST_M:
                for room in set(door.rooms):
                    found.setdefault(room, []).append(door)
        return found

    def way_out_rad(self, door: Door, *, is_forward: bool) -> float:
        """Return the direction in which one passes a door at right angles.

        Parameters
        ----------
        door
            The door.
        is_forward
            Whether one comes from the first of its rooms.

        Returns
        -------
        float
            Radians, map frame: the mean of the steps across its boundary, which does not depend on
            how the boundary winds between its ends; NaN for one that closes into a ring.
        """
        way = self._way_through_rad.get(door.number)
        if way is None:
            way = self._way_through_rad[door.number] = self._way_through(door)
        return way if is_forward else way + math.pi

    def _way_through(self, door: Door) -> float:
        """Return the direction from the first room of a door to the other."""
        labels, cols = self._rooms.labels, self._rooms.grid.shape[1]
        first, other = (-1 if name is None else labels.index(name) for name in door.rooms)
        flat = self._rooms.cells_beside(door.number)
        label_of = labels.label_of.ravel()
        across = []
        for step in (1, cols):
            pairs = flat[np.isin(flat + step, flat)]
            if step == 1:
                pairs = pairs[pairs % cols != cols - 1]
            tail, head = label_of[pairs], label_of[pairs + step]
            onward = np.count_nonzero((tail == first) & (head == other))
            back = np.count_nonzero((tail == other) & (head == first))
            across.append(int(onward) - int(back))
        if across == [0, 0]:
            return math.nan
        return atan2(across[1], across[0]) + self._rooms.grid.frame.yaw_rad

    def passed(
        self, line: Line, between_m: tuple[float, float], room: str | None, but: Collection[int]
    ) -> tuple[Passed, ...]:
        """Return the doors and openings beside a stretch of a path in one room.

        Parameters
        ----------
        line
            The path.
        between_m
            Begin and end of the stretch, by the length of the path.
        room
            The room in which it lies, None outside rooms.
        but
            Numbers of doors that do not count: those at its ends.

        Returns
        -------
        tuple of Passed
            The counts at each hand, more first. A door counts if it lies within 3.5 m of the path,
            beside it, and nothing occupied stands between.
        """
        begin_m, end_m = between_m
        points, along = line.between(begin_m, end_m)
        counted: dict[Hand, list[Door]] = {"left": [], "right": []}
        for door in self._doors_of.get(room, ()):
            away = np.hypot(*(points - door.position).T)
            nearest = int(np.argmin(away))
            at_m = float(along[nearest])
            is_beside = begin_m + _MARGIN_M < at_m < end_m - _MARGIN_M
            if door.number in but or away[nearest] > _LATERAL_M or not is_beside:
                continue
            hand = self._hand_of(door, room, line.heading(at_m - _LOOK_M, at_m + _LOOK_M))
            if (
                hand is not None
                and self._is_seen_in_part(points[nearest].tolist(), door)
                and not _is_known(door, counted[hand])
            ):
                counted[hand].append(door)
        found = [
            Passed(hand, len(doors) - wide, wide)
            for hand, doors in counted.items()
            if doors
            for wide in [sum(door.is_opening for door in doors)]
        ]
        return tuple(sorted(found, key=lambda one: (-one.n_doors, -one.n_openings)))

    def at_start(self, line: Line, room: str | None, exits: Collection[int]) -> Landmark | None:
        """Return the door that shows a person at the begin of a path in which direction to go.

        Parameters
        ----------
        line
            The path.
        room
            The room of its begin, None outside rooms.
        exits
            Numbers of the doors by which the path leaves the room.

        Returns
        -------
        Landmark or None
            The exit straight ahead, over furniture too; else the exit in sight if it lies ahead at
            one hand; else the nearest other door in sight, within 20 m; else the exit in sight;
            else what lies ahead behind furniture, or, for a path that stays in the room, anywhere.
        """
        point, heading_rad = line.at(0.0), line.first_heading()
        found: list[tuple[bool, int, float, int, Landmark]] = []
        for door in self._doors_of.get(room, ()):
            away_m, is_exit = math.dist(point, door.position), door.number in exits
            is_far = away_m > _FARTHEST_M and not is_exit
            if away_m < _NEAREST_M or is_far or (door.is_opening and None in door.rooms):
                continue
            seen = self._mark(door, room, point, heading_rad)
            if is_exit and self._leads_to(door, point, heading_rad):
                return replace(seen, side="ahead")
            is_hidden = not self._is_seen(list(point), door)
            is_ahead = seen.side.startswith("ahead")
            if not is_hidden or not exits or is_ahead:
                rank = (0 if is_ahead else 2) if is_exit else 1
                found.append((is_hidden, rank, away_m, door.number, seen))
        return min(found, key=lambda one: one[:4])[4] if found else None

    def at_goal(
        self,
        point: tuple[float, float],
        heading_rad: float,
        room: str | None,
        but: Collection[int],
    ) -> Landmark | None:
        """Return the door that shows a person where a path ends.

        Parameters
        ----------
        point
            Where it ends, `(x, y)` in metres, map frame.
        heading_rad
            Direction in which the person looks, radians; NaN without one.
        room
            The room in which it ends, None outside rooms.
        but
            Numbers of the doors by which the path comes.

        Returns
        -------
        Landmark or None
            The nearest other door in sight, within 5 m.
        """
        near = [
            (away_m, door.number, door)
            for door in self._doors_of.get(room, ())
            for away_m in [math.dist(point, door.position)]
            if _NEAREST_M <= away_m <= _NEARBY_M and door.number not in but
            if not (door.is_opening and None in door.rooms) and self._is_seen(list(point), door)
        ]
        if not near or math.isnan(heading_rad):
            return None
        return self._mark(min(near)[2], room, point, heading_rad)

    def _mark(
        self, door: Door, room: str | None, point: tuple[float, float], heading_rad: float
    ) -> Landmark:
        """Return a door as a landmark for a person at a point of a room.

        Where it lies is judged by its nearest point: the middle of a wide opening lies ahead of one
        who stands beside it.
        """
        span = self._span(door)
        away_m = np.hypot(*(span - point).T)
        nearest = int(np.argmin(away_m))
        middle = _turn_to(heading_rad, point, door.position)
        if away_m[nearest] < _NEAREST_M:
            way = self.way_out_rad(door, is_forward=door.rooms[0] == room)
            angle = math.remainder(way - heading_rad, math.tau)
        else:
            angle = _turn_to(heading_rad, point, span[nearest].tolist())
        if abs(middle) <= _AHEAD_RAD and abs(angle) <= _BESIDE_RAD:
            angle = middle
        beyond = door.rooms[1] if door.rooms[0] == room else door.rooms[0]
        return Landmark(door.number, Space(beyond), _side(angle), is_opening=door.is_opening)

    def _leads_to(self, door: Door, point: tuple[float, float], heading_rad: float) -> bool:
        """Return whether some part of a door lies in the direction of a path."""
        across, up = (self._span(door) - point).T
        off = wrapped(directions(up, across) - heading_rad)
        return bool((np.abs(off) <= _TOWARDS_RAD).any())

    def _span(self, door: Door) -> FloatArray:
        """Return the points of a door from end to end, float64 (n, 2), metres."""
        span = self._points_of.get(door.number)
        if span is None:
            frame, cols = self._rooms.grid.frame, self._rooms.grid.shape[1]
            flat = self._rooms.cells_beside(door.number)
            span = frame.points_of(np.column_stack(np.divmod(flat, cols)))
            self._points_of[door.number] = span
        return span

    def _hand_of(self, door: Door, room: str | None, heading_rad: float) -> Hand | None:
        """Return the hand to which a door leads out of a room; None if it lies across the path."""
        way = self.way_out_rad(door, is_forward=door.rooms[0] == room)
        sideways = sin(way - heading_rad)
        if not abs(sideways) >= _LEAST_SIDEWAYS:
            return None
        return "left" if sideways > 0 else "right"

    def _is_seen_in_part(self, point: list[float], door: Door) -> bool:
        """Return whether no occupied cell lies between a point and the middle of a door, or some
        part of one between two rooms."""
        if self._is_seen(point, door) or None in door.rooms:
            return self._is_seen(point, door)
        return any(self._is_free(point, end) for end in self._span(door).tolist())

    def _is_seen(self, point: list[float], door: Door) -> bool:
        """Return whether no occupied cell lies between a point and the middle of a door."""
        return self._is_free(point, list(door.position))

    def _is_free(self, point: list[float], end: list[float]) -> bool:
        """Return whether no occupied cell lies between two points."""
        grid = self._rooms.grid
        count = 2 + math.ceil(2 * math.dist(point, end) / grid.resolution_m)
        points = np.linspace(point, end, count)[1:-1]
        cells = grid.frame.cells_of(points)
        return not (grid.measured[tuple(cells.T)] == CellClass.OCCUPIED).any()


def _turn_to(heading_rad: float, point: tuple[float, float], end: Sequence[float]) -> float:
    """Return the turn from a heading towards a point, radians in [-pi, pi]."""
    way = atan2(end[1] - point[1], end[0] - point[0])
    return math.remainder(way - heading_rad, math.tau)


def _side(angle_rad: float) -> Side:
    """Return where something lies, by its angle to the direction of the path."""
    is_left, off = angle_rad > 0, abs(angle_rad)
    if off <= _AHEAD_RAD:
        return "ahead"
    if off >= math.pi - _AHEAD_RAD:
        return "behind"
    if off < _BESIDE_RAD:
        return "ahead-left" if is_left else "ahead-right"
    if off > math.pi - _BESIDE_RAD:
        return "behind-left" if is_left else "behind-right"
    return "left" if is_left else "right"


def _is_known(door: Door, others: list[Door]) -> bool:
    """Return whether a door is part of one that was counted: doors of two rooms are two."""
    return any(
        math.dist(door.position, other.position) < _ONE_DOOR_M
        and (None in door.rooms + other.rooms or set(door.rooms) == set(other.rooms))
        for other in others
    )
