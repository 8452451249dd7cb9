"""Paths in words: rooms and doors passed, metres per leg."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.route import RouteFinder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import FloatArray, LongArray
    from hybridnav.result import Path
    from hybridnav.topology import Door, Rooms

_LOOK_M = 1.5
"""Distance before and behind a door at which headings are compared for a turn."""
_TURN_RAD = math.radians(40.0)
_SLIVER_M = 0.5
_AT_ONCE_M = 0.1
NOWHERE = "unnamed space"
"""Description of cells outside rooms."""


@dataclass(frozen=True)
class Leg:
    """The part of a path inside one room."""

    room: str | None
    """Name of the room, None outside rooms."""
    length_m: float
    door: Door | None = None
    """The door at the end of the leg; None on the last leg, and at a boundary that is no door (to
    or from unexplored cells)."""
    turn: str = ""
    """`"left"` or `"right"` behind the door, empty for straight on."""
    waypoint: str | None = None
    """Stop at the end of the leg: its name or its coordinates."""

    def to_dict(self) -> dict[str, Any]:
        """Return the plain values for JSON."""
        return {
            "room": self.room,
            "length_m": self.length_m,
            "door": None if self.door is None else self.door.number,
            "door_kind": None if self.door is None else self.door.kind,
            "door_width_m": None if self.door is None else self.door.width_m,
            "door_m": None if self.door is None else list(self.door.position),
            "turn": self.turn,
            "waypoint": self.waypoint,
        }


class Guide:
    """Descriptions of paths on a map with rooms.

    Parameters
    ----------
    rooms
        The rooms; the crossings of their doors are computed once.
    """

    def __init__(self, rooms: Rooms) -> None:
        self._rooms = rooms
        self._route_finder = RouteFinder(rooms)

    def legs(self, path: Path, *, waypoint: str | None = None) -> list[Leg]:
        """Divide a path into its legs.

        Parameters
        ----------
        path
            A cell path, or an any-angle one, whose length is divided in the proportions of its cell
            path.
        waypoint
            Stop at the end of the path.

        Returns
        -------
        list of Leg
            At least one leg; the lengths sum to that of the path.
        """
        rooms, cells = self._rooms, path.cells
        vertices, arcs, steps = self._route_finder.crossings(cells)
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(cells, axis=0).T))])
        scale = path.length_m / along[-1] if along[-1] > 0 else 0.0
        labels = rooms.label_of_vertex[vertices].tolist()
        legs: list[Leg] = []
        begun = 0.0
        for number, (arc, step) in enumerate(zip(arcs, steps, strict=True)):
            if labels[number] == labels[number + 1]:
                continue
            # A diagonal past the corner of a third room crosses two boundaries, both at its middle.
            ended = (along[step] + along[step + 1]) / 2
            legs.append(
                Leg(
                    rooms.name_of(labels[number]),
                    float((ended - begun) * scale),
                    rooms.door_of_arc.get(arc),
                    self._turn(cells, along, step),
                )
            )
            begun = ended
        last = float((along[-1] - begun) * scale)
        return _without_grazes([*legs, Leg(rooms.name_of(labels[-1]), last, waypoint=waypoint)])

    def _turn(self, cells: LongArray, along: FloatArray, step: int) -> str:
        """Return the side to which a path bends at a step, over a few metres."""
        reach = _LOOK_M / self._rooms.grid.resolution_m
        before = int(np.searchsorted(along, along[step] - reach))
        behind = int(np.searchsorted(along, along[step + 1] + reach))
        behind = min(behind, len(cells) - 1)
        arriving = cells[step + 1] - cells[max(before, 0)]
        leaving = cells[behind] - cells[step]
        cross = float(arriving[1] * leaving[0] - arriving[0] * leaving[1])
        angle = math.atan2(cross, float(arriving @ leaving))
        if abs(angle) < _TURN_RAD:
            return ""
        return "left" if angle > 0 else "right"


def _without_grazes(legs: Sequence[Leg]) -> list[Leg]:
    """Join the legs on both sides of a leg that only touches a room.

    Such a leg enters by a door and returns by the same one within half a metre.
    """
    kept: list[Leg] = []
    for leg in legs:
        kept.append(leg)
        while len(kept) > 2:  # noqa: PLR2004
            before, within, behind = kept[-3:]
            if before.door is None or before.door != within.door or within.length_m > _SLIVER_M:
                break
            length_m = before.length_m + within.length_m + behind.length_m
            kept[-3:] = [replace(behind, length_m=length_m)]
    return kept


def in_words(legs: Sequence[Leg]) -> list[str]:
    """Return a description of a path for a person, one line a leg.

    Parameters
    ----------
    legs
        Legs in the order walked, at least one.
    """
    lines = [f"start in {legs[0].room or NOWHERE}"]
    carried_m = 0.0
    for leg, following in zip(legs, [*legs[1:], None], strict=True):
        length_m, carried_m = carried_m + leg.length_m, 0.0
        metres = f"{length_m:.1f} m"
        if leg.waypoint is not None and leg.waypoint == leg.room and length_m < _SLIVER_M:
            lines[-1] += ", and you are there"
        elif leg.waypoint is not None:
            place = f" in {leg.room}" if leg.room not in {None, leg.waypoint} else ""
            lines.append(f"{metres} to {leg.waypoint}{place}")
        elif following is None:
            lines.append(f"{metres} to the goal in {leg.room or NOWHERE}")
        elif _is_sliver(following):
            carried_m = length_m  # a threshold without a name is not mentioned
        else:
            into = f"into {following.room or NOWHERE}"
            if leg.door is not None:
                into = (
                    f"to {leg.door.kind} {leg.door.number} ({leg.door.width_m:.1f} m wide), {into}"
                )
                if length_m < _AT_ONCE_M:
                    metres, into = "at", into.removeprefix("to ")
            turn = f", then {leg.turn}" if leg.turn and following.length_m >= _SLIVER_M else ""
            lines.append(f"{metres} {into}{turn}")
    return lines


def _is_sliver(leg: Leg) -> bool:
    """Return whether a leg is too short to mention, as across a gap between two outlines."""
    return leg.room is None and leg.waypoint is None and leg.length_m < _SLIVER_M
