"""Doors and openings as a person meets them: how they lie to a path, and which are passed."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.poses import wrapped
from hybridnav._base.trig import directions
from hybridnav.planner.guide import Landmark, Space
from hybridnav.planner.guide.glances import DoorsInSight, is_named, turn_to

if TYPE_CHECKING:
    from collections.abc import Collection

    from hybridnav.planner.guide.bends import Line
    from hybridnav.planner.guide.instruction import Side
    from hybridnav.topology.rooms import Door

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


class Landmarks(DoorsInSight):
    """The doors of a map, as a person on a path sees them.

    Parameters
    ----------
    rooms
        The rooms.
    """

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
        found: list[tuple[int, float, int, Landmark]] = []
        for door in self._doors_of.get(room, ()):
            away_m, is_exit = math.dist(point, door.position), door.number in exits
            is_far = away_m > _FARTHEST_M and not is_exit
            named = self._beyond(door, room)
            others = [one for one in self._doors_of[room] if self._beyond(one, room) == named]
            if away_m < _NEAREST_M or is_far or not is_named(named) or len(others) > 1:
                continue
            seen = self._mark(door, room, point, heading_rad)
            if (
                is_exit
                and self._leads_to(door, point, heading_rad)
                and self._is_seen(list(point), door)
            ):
                return replace(seen, side="ahead")
            if self._is_seen(list(point), door):
                rank = (0 if seen.side.startswith("ahead") else 2) if is_exit else 1
                found.append((rank, away_m, door.number, seen))
        return min(found, key=lambda one: one[:3])[3] if found else None

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
        middle = turn_to(heading_rad, point, door.position)
        if away_m[nearest] < _NEAREST_M:
            way = self.way_out_rad(door, is_forward=door.rooms[0] == room)
            angle = math.remainder(way - heading_rad, math.tau)
        else:
            angle = turn_to(heading_rad, point, span[nearest].tolist())
        if abs(middle) <= _AHEAD_RAD and abs(angle) <= _BESIDE_RAD:
            angle = middle
        beyond = door.rooms[1] if door.rooms[0] == room else door.rooms[0]
        return Landmark(door.number, Space(beyond), _side(angle), is_opening=door.is_opening)

    def _leads_to(self, door: Door, point: tuple[float, float], heading_rad: float) -> bool:
        """Return whether some part of a door lies in the direction of a path."""
        across, up = (self._span(door) - point).T
        off = wrapped(directions(up, across) - heading_rad)
        return bool((np.abs(off) <= _TOWARDS_RAD).any())


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
