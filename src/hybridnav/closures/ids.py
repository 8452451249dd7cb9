"""Doors, arcs and places of a map by what callers give: numbers, or objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hybridnav._base.typing import LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.pyramid import LevelArc
from hybridnav.rooms import Door, Rooms
from hybridnav.topology import TopologicalMap


def door_on(rooms: Rooms, door: int | Door) -> Door:
    """Return the door of a map for a number, as lists show it, or a door."""
    if not isinstance(door, Door):
        return rooms.listed_door(door)
    own = rooms.door(door.number)
    if (own.rooms, own.position) != (door.rooms, door.position):  # its arcs depend on the robot
        raise InvalidValueError(
            f"door {door.number} is one of another map, between {_rooms_of(door)} and not "
            f"{_rooms_of(own)}: give a door of this map, or its number"
        )
    return own


def _rooms_of(door: Door) -> str:
    x, y = door.position
    one, other = (name or "unnamed space" for name in door.rooms)
    return f"{one} and {other} at ({x:.2f}, {y:.2f})"


def arc_on(topology: TopologicalMap, arc: int | LevelArc) -> LevelArc:
    """Return the arc of a map for an id of the arcs of places, or an arc of any level."""
    if not isinstance(arc, LevelArc):
        (index,) = found_ids("arc", [arc], topology.arc_ids).tolist()
        return LevelArc(topology.pyramid.place_level, index)
    levels = len(topology.pyramid)
    if not 0 <= arc.level < levels:
        raise InvalidValueError(f"there is no level {arc.level}, levels are 0 to {levels - 1}")
    count = topology.pyramid[arc.level].n_arcs
    if not 0 <= arc.index < count:
        raise InvalidValueError(
            f"there is no arc {arc.index} at level {arc.level} of this map, it has {count}"
        )
    return arc


def found_ids(what: str, ids: Sequence[int], known: LongArray) -> LongArray:
    """Return the dense indices of ids."""
    if not ids:
        return np.empty(0, dtype=np.int64)
    wanted = np.unique(ids)
    missing = wanted[~np.isin(wanted, known)]
    if len(missing):
        ids_are = f"ids are {known.min()} to {known.max()}" if len(known) else "it has none"
        raise InvalidValueError(f"there is no {what} {missing[0]} on this map, {ids_are}")
    return np.flatnonzero(np.isin(known, wanted))
