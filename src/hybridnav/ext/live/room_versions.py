"""Rooms and doors that follow their map, with numbers and names that last."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.typing import BoolArray, IntArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.ext.live import rooms_window as window
from hybridnav.ext.live.identities import placed, shift_of
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, RoomLabels
from hybridnav.maps.checks import checked_type
from hybridnav.maps.names import check_names
from hybridnav.maps.one_way import OneWayRule
from hybridnav.maps.room_labels import Point
from hybridnav.rooms.carrying import NUMBERED
from hybridnav.rooms.doors import one_way_that_holds
from hybridnav.rooms.find import check_least_area, find_rooms, outside_of


@copies_alike
@dataclass(frozen=True, eq=False)
class OnlineRooms:
    """One version of the rooms and doors of a map that changes.

    `update` returns the next version and leaves this one as it is. Rooms and doors have numbers
    that are never used again, and a room has the name that a person gave to its number.

    Examples
    --------
    >>> from hybridnav.ext.live import OnlineRooms
    >>> cells = np.zeros((9, 21))
    >>> cells[:, 10] = 1.0
    >>> cells[4, 10] = 0.0
    >>> grid = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    >>> rooms = OnlineRooms.of(grid).with_name(1, "kitchen")
    >>> rooms.name_of(1), rooms.name_of(2), list(rooms.doors)
    ('kitchen', 'room-2', [1])
    >>> cells[4, 10] = 1.0
    >>> update = rooms.update(hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0))
    >>> update.version.name_of(1), update.doors.died
    ('kitchen', (1,))
    """

    grid: OccupancyGrid
    """The map of this version."""
    number_of: IntArray = field(repr=False)
    """int32 (rows, cols), the number of the room of each cell, -1 for none. Walls between rooms
    belong to them up to 0.25 m."""
    names: Mapping[int, str]
    """The names that people gave, by the number of the room."""
    doors: Mapping[int, window.OnlineDoor] = field(repr=False)
    """All boundaries between rooms by number, gaps included."""
    points: Mapping[str, Point]
    """Named points, `(x, y)` in metres: they stay whatever the rooms."""
    one_way: tuple[OneWayRule, ...] = field(repr=False)
    """What is passed in one direction alone; rooms as `room-` and their number."""
    least_area_m2: float
    """As in `find_rooms`."""
    low: tuple[int, int]
    """Row and column of cell (0, 0) among the cells of the first version."""
    _outside: BoolArray = field(repr=False)
    _next: tuple[int, int] = field(repr=False)
    """The least numbers that no room and no door has had."""

    @classmethod
    def of(
        cls, grid: OccupancyGrid, labels: RoomLabels | None = None, *, least_area_m2: float = 1.0
    ) -> OnlineRooms:
        """Make the first version.

        Parameters
        ----------
        grid
            The map; the robot's radius changes no room.
        labels
            Its rooms; None to find them by `find_rooms`. A room called `room-7` has the number 7
            and no name, all others have the least numbers that are left. Doors keep their numbers.
        least_area_m2
            As in `find_rooms`.

        Raises
        ------
        InvalidValueError
            When the labels are no `RoomLabels` of the grid, or the area is out of range.
        """
        checked_type("grid", grid, OccupancyGrid)
        check_least_area(least_area_m2)
        if labels is None:
            labels = find_rooms(grid, least_area_m2=least_area_m2)
        checked_type("labels", labels, RoomLabels)
        if labels.label_of.shape != grid.shape:
            raise InvalidValueError(
                f"rooms are labels of {labels.label_of.shape} cells, expected those of the grid, "
                f"{grid.shape}: find or read them for this map"
            )
        numbers = _numbers(labels.names)
        names = {
            n: name
            for n, name in zip(numbers, labels.names, strict=True)
            if not NUMBERED.fullmatch(name)
        }
        called = {name: f"room-{n}" for n, name in zip(numbers, labels.names, strict=True)}
        number_of = np.append(np.array(numbers, np.int32), np.int32(NO_ROOM))[labels.label_of]
        own_doors = window.doors_of(number_of, grid, (0, 0), labels.doors)
        doors = {door.number: door for door in sorted(own_doors, key=lambda door: door.number)}
        return cls(
            grid,
            frozen(number_of),
            MappingProxyType(names),
            MappingProxyType(doors),
            labels.points,
            tuple(rule.renamed(called) for rule in labels.one_way),
            float(least_area_m2),
            (0, 0),
            frozen(outside_of(grid)),
            (max(numbers, default=0) + 1, max([*doors, *labels.doors], default=0) + 1),
        )

    def update(self, grid: OccupancyGrid) -> RoomsUpdate:
        """Return the next version, that of a changed map.

        Rooms within 0.3 m of a changed cell are found anew, as a build does, in a window that has
        them whole and 10 m of the map around them. All others keep their free cells; one of them
        may grow by cells of a room that was found anew. Rooms cover what those of a build cover. On
        scans of single rays, connected free cells below the least area may differ: whether a build
        joins them to others depends on the whole map. They keep their room when the map is no such
        scan any more, until it is found anew.

        Where two rooms meet may differ. A build looks farther, at the main directions of the map
        and at whole rooms. It does not know the rooms before, which an update holds on to. Borders
        that a person drew where the map shows none may go when a room is found anew.

        All cells are compared, the numbers of all cells are copied, and all doors are measured. The
        rest takes as long as a fresh build of the window. That is more than an update of the places
        takes: a robot calls this every few scans, or before rooms are needed.

        Parameters
        ----------
        grid
            The map now; it has to cover the one of this version, cell on cell.

        Raises
        ------
        InvalidValueError
            When the grid has cells of another size or at other points, or does not cover the one of
            this version.
        """
        checked_type("grid", grid, OccupancyGrid)
        rows, cols = shift_of(self.grid, grid, otherwise="find the rooms anew")
        low = self.low[0] - rows, self.low[1] - cols
        measured, number_of, was_outside = (
            placed(array, grid.shape, (rows, cols), nothing)
            for array, nothing in (
                (self.grid.measured, CellClass.UNEXPLORED),
                (self.number_of, NO_ROOM),
                (self._outside, False),
            )
        )
        outside = frozen(outside_of(grid))
        differs = (measured != grid.measured) | (was_outside != outside)
        if grid.shape != self.grid.shape:  # rooms reach into new cells, known or not
            new = placed(np.zeros(self.grid.shape, np.bool_), grid.shape, (rows, cols), 1)
            differs |= new & window.beside_rooms(number_of, grid)
        moved = replace(self, grid=grid, number_of=frozen(number_of), low=low, _outside=outside)
        if not differs.any():
            return RoomsUpdate(
                moved, (), (), {}, {}, (), window.DoorEvents((), (), (), {}, {}), {}, ()
            )
        before = window.RoomCells(number_of, (measured == CellClass.FREE) & ~was_outside)
        settings = self.least_area_m2, self._next[0]
        number_of, events = window.renew(before, grid, outside, differs, settings)
        # How wide a door is, walls decide that lie in no room and at any distance.
        positions = {n: door.position for n, door in self.doors.items()}
        new_doors, door_events = window.follow_doors(
            self.doors, window.doors_of(number_of, grid, low, positions), self._next[1]
        )
        lost = {n: self.names[n] for n in events.died if n in self.names}
        version = replace(
            moved,
            number_of=frozen(number_of),
            names=MappingProxyType({n: name for n, name in self.names.items() if n not in lost}),
            doors=MappingProxyType(new_doors),
            _next=(self._next[0] + len(events.born), self._next[1] + len(door_events.born)),
        )
        version, gone = _with_rules(version, self, door_events.split)
        return RoomsUpdate(version, *events, door_events, lost, gone)

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the rooms, ascending."""
        return tuple(np.flatnonzero(np.bincount(self.number_of.ravel() + 1)[1:]).tolist())

    def name_of(self, number: int) -> str:
        """Return the name of a room: the given one, or `room-` and the number.

        Raises
        ------
        InvalidValueError
            When the version has no such room.
        """
        self._check(number)
        return self.names.get(number, f"room-{number}")

    def with_name(self, number: int, name: str) -> OnlineRooms:
        """Return the version with a name for a room, which lasts as its number does.

        Raises
        ------
        InvalidValueError
            When the version has no such room, or another one has the name. When it is no name:
            empty, too long, not one printable line, a point, or `room-` with another number.
        """
        self._check(number)
        check_names((name,))
        numbered = NUMBERED.fullmatch(name)
        if numbered and int(numbered[1]) != number:
            raise InvalidValueError(
                f"room {number} cannot be called {brief(name)}, the name of room {numbered[1]} as "
                "long as it has no other: choose another name"
            )
        others = {n: other for n, other in self.names.items() if n != number}
        if name in others.values():
            raise InvalidValueError(
                f"another room is called {name!r:.80}, expected names that differ: choose another "
                "name"
            )
        names = others if numbered else {**others, number: name}
        return replace(self, names=MappingProxyType(dict(sorted(names.items()))))

    def _check(self, number: int) -> None:
        if number not in self.numbers:
            raise InvalidValueError(
                f"there is no room {number!r:.40} in this version, expected one of its "
                f"{len(self.numbers)}: an update states what became of a room"
            )

    @property
    def called(self) -> dict[str, str]:
        """The name of each room by `room-` and its number."""
        return {f"room-{n}": self.names.get(n, f"room-{n}") for n in self.numbers}

    @cached_property
    def labels(self) -> RoomLabels:
        """The rooms for all who plan, draw and write: with names, points and numbers of doors.

        Raises
        ------
        InvalidValueError
            When there are too many rooms.
        """
        label_of = np.full((self.numbers[-1] if self.numbers else 0) + 2, NO_ROOM, np.int32)
        label_of[list(self.numbers)] = np.arange(len(self.numbers))
        called = self.called
        return RoomLabels(
            tuple(called.values()),
            label_of[self.number_of],
            self.points,
            {n: door.position for n, door in self.doors.items()},
            one_way=tuple(rule.renamed(called) for rule in self.one_way),
        )


def _with_rules(
    version: OnlineRooms, before: OnlineRooms, split: Mapping[int, Sequence[int]]
) -> tuple[OnlineRooms, tuple[OneWayRule, ...]]:
    """Return a version with the rules that hold, also for the parts of doors, and the others as
    people know them."""
    called, bare = before.called | version.called, replace(version, one_way=())
    rule_of = {
        replace(rule, door=part): rule
        for rule in before.one_way
        for part in split.get(rule.door or 0, [rule.door])
    }
    shown = {rule: rule.renamed(called) for rule in rule_of}
    held = one_way_that_holds(shown.values(), bare.labels, version.grid) if shown else []
    kept = tuple(rule for rule in rule_of if shown[rule] in held)
    left = {rule_of[rule] for rule in kept}
    gone = tuple(rule.renamed(called) for rule in before.one_way if rule not in left)
    return replace(bare, one_way=kept), gone


@dataclass(frozen=True, eq=False)
class RoomsUpdate:
    """A new version of rooms, and what became of those of the one before, by number.

    Examples
    --------
    >>> from hybridnav.ext.live import OnlineRooms
    >>> cells = np.zeros((9, 21))
    >>> grid = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    >>> rooms = OnlineRooms.of(grid).with_name(1, "hall")
    >>> nothing = hn.OccupancyGrid(np.ones((9, 21)), hn.Frame(0.25), robot_radius_m=0)
    >>> update = rooms.update(nothing)
    >>> update.died, update.lost_names
    ((1,), {1: 'hall'})
    """

    version: OnlineRooms
    born: tuple[int, ...]
    """Rooms that are none of the old ones; their numbers are new."""
    died: tuple[int, ...]
    """Old rooms that are no more."""
    merged: dict[int, int]
    """Those of them most of whose cells went into another room, with that room."""
    split: dict[int, tuple[int, ...]]
    """Old rooms that fell into several new ones, with these."""
    changed: tuple[int, ...]
    """Rooms that kept their number, but have other cells."""
    doors: window.DoorEvents
    """What became of the doors."""
    lost_names: dict[int, str]
    """Names of rooms that died, by the number these had."""
    lost_one_way: tuple[OneWayRule, ...]
    """Rules that hold no more: of doors or rooms that are gone, of lines in no free cell."""

    def closed_doors(self, closed: Iterable[int]) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Carry closed doors over to the new version.

        Parameters
        ----------
        closed
            Numbers of doors that were closed in the version before.

        Returns
        -------
        tuple of tuple of int
            The doors to close now, ascending: doors that are left, and all parts of one that fell
            into several. Then the closed doors that are no more, also parts of a wider one now:
            `doors.merged` states which.

        Raises
        ------
        InvalidValueError
            When a number was that of no door.

        Examples
        --------
        >>> from hybridnav.ext.live import OnlineRooms
        >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
        >>> rooms = OnlineRooms.of(hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0), labels)
        >>> wall = np.array([[0.0, 0.0, 1.0, 0.0]])
        >>> rooms.update(hn.OccupancyGrid(wall, robot_radius_m=0)).closed_doors([1])
        ((), (1,))
        """
        given: list[Any] = list(closed) if np.iterable(closed) else [closed]
        born, died, _, split, _ = self.doors
        had = (set(self.version.doors) - set(born)) | set(died)
        for number in given:
            if not isinstance(number, int | np.integer) or number not in had:
                raise InvalidValueError(
                    f"there was no door {number!r:.40}, expected numbers of doors of the version "
                    "before: take them from its doors"
                )
        asked = sorted({int(number) for number in given})
        now = {part for number in asked for part in split.get(number, (number,))}
        gone = set(died) - set(split)
        return tuple(sorted(now - gone)), tuple(n for n in asked if n in gone)


def _numbers(names: tuple[str, ...]) -> list[int]:
    matches = [NUMBERED.fullmatch(name) for name in names]
    taken = {int(match[1]) for match in matches if match}
    free = iter(n for n in range(1, len(names) + len(taken) + 1) if n not in taken)
    return [int(match[1]) if match else next(free) for match in matches]
