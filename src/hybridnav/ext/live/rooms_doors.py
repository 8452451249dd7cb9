"""Doors with lasting numbers: the boundaries between the rooms of a map that changes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav.maps import NO_ROOM, RoomLabels
from hybridnav.topology.rooms.doors import LEAST_DOOR_M, RoomBoundaries, measured_clearance_m

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from hybridnav._base.typing import IntArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.room_labels import Point

_BIAS = 1 << 20
"""Added to rows and columns so that none is negative."""


@copies_alike
@dataclass(frozen=True, eq=False)
class OnlineDoor:
    """A boundary between two rooms of a map that changes, with a number that lasts.

    Examples
    --------
    >>> from hybridnav.ext.live import OnlineRooms
    >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> door = OnlineRooms.of(grid, labels).doors[1]
    >>> door.rooms, door.position, door.width_m
    ((1, 2), (2.0, 0.5), 1.0)
    """

    number: int
    """Its number, from 1, never used again."""
    rooms: tuple[int, int]
    """Numbers of the rooms on both sides; -1 for what lies in no room."""
    position: tuple[float, float]
    """A point on the boundary, in its middle; `(x, y)` in metres, map frame."""
    width_m: float
    """As in `Door`."""
    passage_m: float
    """As in `Door`."""
    cracks: LongArray
    """int64 (n,), the base edges that it consists of, ascending, in a numbering that does not
    change when the map grows."""

    @property
    def is_gap(self) -> bool:
        """Whether its passage is below 0.3 m: lists and pictures count gaps and leave them out."""
        return self.passage_m < LEAST_DOOR_M


class DoorEvents(NamedTuple):
    """What became of doors, by number.

    Examples
    --------
    >>> from hybridnav.ext.live import OnlineRooms
    >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> rooms = OnlineRooms.of(hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0), labels)
    >>> wall = np.array([[0.0, 0.0, 1.0, 0.0]])
    >>> rooms.update(hn.OccupancyGrid(wall, robot_radius_m=0)).doors.died
    (1,)
    """

    born: tuple[int, ...]
    """New doors; their numbers are new."""
    died: tuple[int, ...]
    """Doors that are no more."""
    changed: tuple[int, ...]
    """Doors that kept their number, but have other cells or rooms."""
    split: dict[int, tuple[int, ...]]
    """Doors of which several are left, with these: the one that kept the number among them."""
    merged: dict[int, int]
    """Doors that died and are part of one other door now, wider or moved, with that door."""


def doors_of(
    number_of: IntArray,
    grid: OccupancyGrid,
    low: tuple[int, int],
    known: Mapping[int, Point],
) -> list[OnlineDoor]:
    """Return the doors between rooms.

    Parameters
    ----------
    number_of
        int32 (rows, cols), the number of the room of each cell, -1 for none.
    grid
        The map of these cells.
    low
        Row and column of cell (0, 0) in the lasting numbering.
    known
        A point of each door that has a number; see `RoomBoundaries.numbers`.
    """
    rooms = np.flatnonzero(np.bincount(number_of.ravel() + 1)[1:])
    dense = np.full(int(rooms.max(initial=NO_ROOM)) + 2, NO_ROOM, np.int32)
    dense[rooms] = np.arange(len(rooms))
    labels = RoomLabels(tuple(f"room-{room}" for room in rooms.tolist()), dense[number_of])
    found = RoomBoundaries.of(labels, grid, measured_clearance_m(grid))
    room_of = np.append(rooms, NO_ROOM)
    numbers = found.numbers(known)
    order = np.argsort(found.boundary_of, kind="stable")
    ends = np.cumsum(np.bincount(found.boundary_of, minlength=found.n_boundaries))
    row, col = np.divmod(found.edges >> 1, grid.shape[1])
    cracks = ((row + low[0] + _BIAS) << 32) + ((col + low[1] + _BIAS) << 1) + (found.edges & 1)
    sides = np.split(cracks[order], ends[:-1])
    return [
        OnlineDoor(
            int(numbers[at]),
            (int(room_of[found.labels[at, 0]]), int(room_of[found.labels[at, 1]])),
            (float(found.middles[at, 0]), float(found.middles[at, 1])),
            float(found.widths_m[at]),
            float(found.passages_m[at]),
            frozen(sides[at]),
        )
        for at in range(found.n_boundaries)
    ]


def follow_doors(
    before: Mapping[int, OnlineDoor], found: Iterable[OnlineDoor], first_number: int
) -> tuple[dict[int, OnlineDoor], DoorEvents]:
    """Return the doors after a change, and what became of those before.

    Parameters
    ----------
    before
        The doors before.
    found
        The doors now, those that are none of the old ones with numbers that none of these has.
    first_number
        The least number that no door has had.
    """
    doors: dict[int, OnlineDoor] = {}
    born: list[int] = []
    for door in sorted(found, key=lambda door: door.number):
        number = door.number
        if number not in before:
            number = first_number + len(born)
            born.append(number)
        doors[number] = replace(door, number=number)
    changed = tuple(n for n, door in before.items() if n in doors and not _same(door, doors[n]))
    died = tuple(n for n in before if n not in doors)
    fresh = [doors[n] for n in (*born, *changed)]
    parts = _parts([before[n] for n in sorted((*died, *changed))], fresh)
    split = {n: tuple(sorted(owners)) for n, owners in parts.items() if len(owners) > 1}
    merged = {n: owners[0] for n, owners in parts.items() if n not in doors and n not in split}
    return dict(sorted(doors.items())), DoorEvents(tuple(born), died, changed, split, merged)


def _same(one: OnlineDoor, other: OnlineDoor) -> bool:
    return one.rooms == other.rooms and np.array_equal(one.cracks, other.cracks)


def _parts(old: list[OnlineDoor], new: list[OnlineDoor]) -> dict[int, list[int]]:
    """Return the new doors that have cracks of each old door, for those with any."""
    if not old or not new:
        return {}
    cracks = np.concatenate([door.cracks for door in new])
    owner = np.repeat([door.number for door in new], [len(door.cracks) for door in new])
    order = np.argsort(cracks, kind="stable")
    parts: dict[int, list[int]] = {}
    for door in old:
        at = np.minimum(np.searchsorted(cracks[order], door.cracks), len(cracks) - 1)
        owners = np.unique(owner[order][at[cracks[order][at] == door.cracks]])
        if len(owners):
            parts[door.number] = owners.tolist()
    return parts
