"""Doors and openings as a person meets them: how they lie to a path, and which are passed."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.grid import CellClass
from hybridnav.sentences import Landmark, Passed, Space

if TYPE_CHECKING:
    from collections.abc import Collection

    from hybridnav.planner.bends import Line
    from hybridnav.sentences.instruction import Hand, Side
    from hybridnav.topology import Door, Rooms

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
_AHEAD_RAD = math.radians(35.0)
"""Angle to the path up to which a landmark lies ahead, or behind."""
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

    @cached_property
    def _doors_of(self) -> dict[str | None, list[Door]]:
        """The doors that a person notices, by the room on each side."""
        found: dict[str | None, list[Door]] = {}
        for door in self._rooms.doors:
            if door.width_m >= _NARROWEST_M and not door.is_gap:
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
        return math.atan2(across[1], across[0]) + self._rooms.grid.frame.yaw_rad

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
            The exit if it lies ahead, over furniture too; else the nearest other door in sight,
            within 20 m; else the exit in sight; else the nearest other door that lies ahead.
        """
        (x, y), heading_rad = line.at(0.0), line.first_heading()
        found: list[tuple[bool, bool, float, int, Landmark]] = []
        for door in () if math.isnan(heading_rad) else self._doors_of.get(room, ()):
            away_m, is_exit = math.dist((x, y), door.position), door.number in exits
            if away_m < _NEAREST_M or (away_m > _FARTHEST_M and not is_exit):
                continue
            way = math.atan2(door.position[1] - y, door.position[0] - x)
            side = _side(math.remainder(way - heading_rad, math.tau))
            beyond = door.rooms[1] if door.rooms[0] == room else door.rooms[0]
            if door.is_opening and beyond is None:
                continue
            seen = Landmark(door.number, Space(beyond), side, is_opening=door.is_opening)
            if is_exit and side == "ahead":
                return seen
            is_hidden = not self._is_seen([x, y], door)
            if is_hidden and side != "ahead":
                continue
            found.append((is_hidden, is_exit, away_m, door.number, seen))
        return min(found, key=lambda one: one[:4])[4] if found else None

    def at_goal(
        self, line: Line, between_m: tuple[float, float], room: str | None, but: Collection[int]
    ) -> Landmark | None:
        """Return the door that shows a person where a path ends.

        Parameters
        ----------
        line
            The path.
        between_m
            Begin and end of its last stretch, by the length of the path.
        room
            The room in which it ends, None outside rooms.
        but
            Numbers of the doors by which the path comes.

        Returns
        -------
        Landmark or None
            The nearest other door in sight, within 5 m.
        """
        begin_m, end_m = between_m
        (x, y), heading_rad = line.at(end_m), line.heading(max(begin_m, end_m - _LOOK_M), end_m)
        near = [
            (away_m, door.number, door)
            for door in self._doors_of.get(room, ())
            for away_m in [math.dist((x, y), door.position)]
            if _NEAREST_M <= away_m <= _NEARBY_M and door.number not in but
            if not (door.is_opening and None in door.rooms) and self._is_seen([x, y], door)
        ]
        if not near or math.isnan(heading_rad):
            return None
        door = min(near)[2]
        way = math.atan2(door.position[1] - y, door.position[0] - x)
        beyond = door.rooms[1] if door.rooms[0] == room else door.rooms[0]
        side = _side(math.remainder(way - heading_rad, math.tau))
        return Landmark(door.number, Space(beyond), side, is_opening=door.is_opening)

    def _hand_of(self, door: Door, room: str | None, heading_rad: float) -> Hand | None:
        """Return the hand to which a door leads out of a room; None if it lies across the path."""
        way = self.way_out_rad(door, is_forward=door.rooms[0] == room)
        sideways = math.sin(way - heading_rad)
        if not abs(sideways) >= _LEAST_SIDEWAYS:
            return None
        return "left" if sideways > 0 else "right"

    def _is_seen_in_part(self, point: list[float], door: Door) -> bool:
        """Return whether no occupied cell lies between a point and the middle of a door, or some
        part of one between two rooms."""
        if self._is_seen(point, door) or None in door.rooms:
            return self._is_seen(point, door)
        frame, cols = self._rooms.grid.frame, self._rooms.grid.shape[1]
        flat = self._rooms.cells_beside(door.number)
        ends = frame.points_of(np.column_stack(np.divmod(flat, cols))).tolist()
        return any(self._is_free(point, end) for end in ends)

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


def _side(angle_rad: float) -> Side:
    """Return where something lies, by its angle to the direction of the path."""
    if abs(angle_rad) <= _AHEAD_RAD:
        return "ahead"
    if abs(angle_rad) >= math.pi - _AHEAD_RAD:
        return "behind"
    return "left" if angle_rad > 0 else "right"


def _is_known(door: Door, others: list[Door]) -> bool:
    """Return whether a door is part of one that was counted: doors of two rooms are two."""
    return any(
        math.dist(door.position, other.position) < _ONE_DOOR_M
        and (None in door.rooms + other.rooms or set(door.rooms) == set(other.rooms))
        for other in others
    )
