"""Names of rooms and numbers of doors, carried from a map of a building to a later one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hybridnav._base.trig import hypots
from hybridnav._base.typing import FloatArray, IntArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, OneWayRule, RoomLabels
from hybridnav.maps.checks import checked_type
from hybridnav.maps.room_labels import Point
from hybridnav.rooms.doors import (
    LEAST_DOOR_M,
    RoomBoundaries,
    measured_clearance_m,
    numbered,
    one_way_that_holds,
)
from hybridnav.rooms.recutting import Side, recut_rooms
from hybridnav.rooms.registering import (
    Candidate,
    Surface,
    Transform,
    refine,
    register,
    transform_of,
    turned,
)

NUMBERED = re.compile(r"room-([1-9][0-9]{0,8})")
"""Names of rooms that nobody has named."""
Overlap = tuple[int, int, float]
"""An old room or place, a new one or -1 for none, and the cells that they have in common."""
_VISIBLE = 0.25
"""Least share of an old room's cells that the new map has to know: else the room is lost."""
_REMAINS = 0.2
"""Least share of those that lie in one new room: else the room is lost."""
_ROOM_SAMPLE = 600
"""Most points of a room's walls by which its drift is measured."""
_FEWEST_POINTS = 20
"""Fewest points by which it is measured; other rooms move as all do."""
_TINY_M2 = 1e-9
_SURE_DOOR_M = 0.5
"""How far a door may lie from an old one if it is a gap now or only one room is carried."""
_MOST_CELLS = 400_000
"""Cells by which overlaps are measured, of larger maps every second, third, ... one."""


class Heirs(NamedTuple):
    """The heirs of old places, or of old rooms."""

    of: dict[int, int]
    """The heir of each old place that has one, by the number that it has in the draft."""
    name: dict[int, int]
    """The old place whose number each heir takes."""


def heirs_of(found: Iterable[Overlap], areas: Mapping[int, float]) -> Heirs:
    """Return the heirs of old places whose old cells are given.

    The heir of an old place is the new one that holds more than half of its cells. An heir of
    several takes the number of the one with which it shares the most cells; the least number breaks
    ties.
    """
    of, shared = {}, {}
    for old, new, cells in found:
        if 2 * cells > areas[old] and new != NO_ROOM:
            of[old], shared[old] = new, cells
    name: dict[int, int] = {}
    for old in sorted(of, key=lambda place: (-shared[place], place)):
        name.setdefault(of[old], old)
    return Heirs(of, name)


@dataclass(frozen=True)
class Carried:
    """One room or door of the old map, and what became of it.

    Examples
    --------
    >>> from hybridnav.rooms import Carried
    >>> Carried("room-7", 0.93, "carried").new
    'room-7'
    """

    new: str | int | None
    """The new room, by its name before names were carried, or the new door, by its number before;
    None for none."""
    confidence: float
    """From 0 to 1; no probability. 0 for none."""
    status: str
    """`"carried"`, `"undecided"` or `"lost"`."""
    reason: str = ""
    """Why it is not carried, or which rooms of the new map, or parts of them, it is cut from."""


@dataclass(frozen=True, eq=False)
class CarriedNames:
    """What became of the rooms and doors of a map on a later map of the same building.

    Examples
    --------
    >>> from hybridnav.rooms import carry_names
    >>> grid = hn.OccupancyGrid(np.zeros((4, 8)), robot_radius_m=0)
    >>> rooms = hn.RoomLabels(("hall",), np.zeros((4, 8), dtype=int))
    >>> carry_names(rooms, grid, rooms, grid).reason
    'the old map has too few walls to recognize it by'
    """

    labels: RoomLabels = field(repr=False)
    """The rooms of the new map, cut as the old ones, with the names, points and numbers that were
    carried. Other rooms keep theirs, or become `room-` and a number that neither map has if an old
    room is called so; other doors have new numbers."""
    transform: Transform | None
    """From the frame of the old map to that of the new one; None if none was found."""
    reason: str
    """Why no transform was found; empty if one was. Nothing is carried then."""
    rooms: Mapping[str, Carried]
    """Each old room by its name."""
    doors: Mapping[int, Carried]
    """Each old door by its number, gaps left out."""
    new_rooms: tuple[str, ...]
    """Rooms of the new map that no old name was carried to, as `labels` call them."""
    new_doors: tuple[int, ...]
    """Doors of the new map that no old number was carried to, as `labels` number them."""
    lost_points: tuple[str, ...]
    """Named points that lie in an obstacle or outside of the new map."""
    lost_one_way: tuple[OneWayRule, ...]
    """Rules whose door or room was not carried, or whose line meets no free cell."""

    @property
    def undecided(self) -> tuple[str, ...]:
        """Old rooms that a person has to decide on."""
        return tuple(name for name, each in self.rooms.items() if each.status == "undecided")

    @property
    def lost(self) -> tuple[str, ...]:
        """Old rooms that the new map hardly shows."""
        return tuple(name for name, each in self.rooms.items() if each.status == "lost")


def carry_names(
    old: RoomLabels,
    old_grid: OccupancyGrid,
    new: RoomLabels,
    new_grid: OccupancyGrid,
    *,
    recut: bool = True,
) -> CarriedNames:
    """Carry the names of rooms and the numbers of doors from a map to a later one.

    The maps may have other frames, sizes and resolutions, and show other furniture and other parts
    of the building. The walls of both are registered by a rigid transform. Then the walls of each
    old room are moved a little more, against drift. New rooms are joined and split as the old ones
    were cut, unless an opening between them has become twice as wide or as narrow. A new room takes
    the name of an old one if more than half of the part of either that both maps show lies in the
    other. All other old rooms are listed. A door keeps its number if a boundary of new rooms lies
    within a metre of it, and both rooms were carried. Within half a metre one room is enough.

    Parameters
    ----------
    old, old_grid
        The rooms with names, and their map.
    new, new_grid
        The rooms of the later map, as `find_rooms` finds them, and that map.
    recut
        Whether to join and split the new rooms; False for rooms that a person has drawn.

    Returns
    -------
    CarriedNames
        The rooms of the new map with the names, what became of each old room and door, and the
        transform. Without one nothing is carried: maps of different buildings, or a building that
        looks the same turned round.

    Raises
    ------
    InvalidValueError
        When rooms and map do not fit.

    Examples
    --------
    >>> from hybridnav.rooms import carry_names
    >>> grid = hn.example_map("office")
    >>> rooms = hn.find_rooms(grid)
    >>> carried = carry_names(rooms, grid, rooms, grid)
    >>> carried.labels.names == rooms.names, carried.lost, carried.undecided
    (True, (), ())
    """
    for name, labels, grid in (("old", old, old_grid), ("new", new, new_grid)):
        checked_type(name, labels, RoomLabels)
        checked_type(f"{name}_grid", grid, OccupancyGrid)
        if labels.label_of.shape != grid.shape:
            raise InvalidValueError(
                f"the {name} rooms are labels of {labels.label_of.shape} cells, expected those of "
                f"the {name} grid, {grid.shape}: find or read them for that map"
            )
    one, other = Surface(old_grid), Surface(new_grid)
    found = register(one, other)
    if found.best is None:
        return _nothing(old, old_grid, new, found.reason)
    moving = _Moving.of(old, found.best, one, other)
    sides = Side(old, old_grid, moving.points), Side(new, new_grid, moving.back)
    cut = _Cut.of(*sides) if recut else _Cut(new, [[name] for name in new.names], set())
    new = cut.labels
    heir_of = _heirs(overlap := _Overlap.of(sides[0], after := sides[1]._replace(rooms=new)))
    names, new_rooms = _names(old, new, {heir: room for room, heir in heir_of.items()})
    rooms = _rooms(old, cut, overlap, heir_of, names)
    doors, door_points, new_doors = _doors((old, old_grid), (new, new_grid), moving, heir_of)
    points = {name: moving.moved(at, old, old_grid) for name, at in old.points.items()}
    kept = {}
    for name, at in points.items():
        room = RoomLabels(names, new.label_of).at(at, new_grid)
        is_free = after.at(new_grid.measured, np.array([at]))[0] == CellClass.FREE
        if is_free and (name not in old.names or room == name):
            kept[name] = at
    uses = {name: use for name, use in old.uses.items() if rooms[name].status == "carried"}
    labels = RoomLabels(names, new.label_of, kept, door_points, uses)
    moved = {
        rule: replace(rule, line=tuple(moving.moved(at, old, old_grid) for at in rule.line))
        for rule in old.one_way
    }
    held = one_way_that_holds(moved.values(), labels, new_grid)
    lost_doors, lost_rooms = (
        {name for name, fate in fates.items() if fate.status != "carried"}
        for fates in (doors, rooms)
    )
    held = [r for r in held if r.door not in lost_doors and r.into not in lost_rooms]
    return CarriedNames(
        replace(labels, one_way=tuple(held)),
        transform_of(found.best, one, other),
        "",
        MappingProxyType(rooms),
        MappingProxyType(doors),
        new_rooms,
        new_doors,
        tuple(name for name in points if name not in kept),
        tuple(rule for rule in moved if moved[rule] not in held),
    )


def _nothing(
    old: RoomLabels, old_grid: OccupancyGrid, new: RoomLabels, reason: str
) -> CarriedNames:
    """Return that nothing is carried."""
    none = Carried(None, 0.0, "undecided", reason)
    doors = dict.fromkeys(numbered(old, old_grid), none)
    rooms = dict.fromkeys(old.names, none)
    return CarriedNames(
        new, None, reason, rooms, doors, new.names, tuple(new.doors), tuple(old.points), old.one_way
    )


class _Moving(NamedTuple):
    """How each old room moves to the new map: as all do, and a little more."""

    angle_rad: float
    centre: FloatArray
    """Point `(x, y)` of the old frame about which everything turns."""
    shifts_m: FloatArray
    """float64 (n_rooms + 1, 2), where that point comes to lie; the last row is for no room."""

    @classmethod
    def of(cls, old: RoomLabels, best: Candidate, one: Surface, other: Surface) -> _Moving:
        """Measure the drift of each room by its own walls, against the walls of the new map.

        It stays with the others if no more of its walls meet walls where they are drawn to.
        """
        label_of = old.label_of[one.is_wall]
        order = np.argsort(label_of, kind="stable")
        ends = np.searchsorted(label_of[order], np.arange(len(old.names) + 1))
        shifts = np.tile(best.shift_m, (len(old.names) + 1, 1))
        for room, part in enumerate(np.split(order, ends)[1:-1]):
            if len(part) < _FEWEST_POINTS:
                continue
            walls = one.walls[part[:: max(1, -(-len(part) // _ROOM_SAMPLE))]]
            drawn = refine(best, walls, other.field, turns=False)
            met = []
            for each in (best, drawn):
                known, off, _ = other.field.at(turned(walls, best.angle_rad) + each.shift_m)
                met.append(np.count_nonzero(known & (off < other.hit_m)))
            if met[1] > met[0]:
                shifts[room] = drawn.shift_m
        return cls(best.angle_rad, one.centre, shifts + other.centre)

    def points(self, points: FloatArray, rooms: IntArray) -> FloatArray:
        """Return points of old rooms, -1 for none, in the new frame."""
        return turned(points - self.centre, self.angle_rad) + self.shifts_m[rooms]

    def back(self, points: FloatArray, rooms: IntArray) -> FloatArray:
        """Return points of the new map in the old frame, by the drift of old rooms, -1 for none."""
        return turned(points - self.shifts_m[rooms], -self.angle_rad) + self.centre

    def moved(self, point: Point, old: RoomLabels, grid: OccupancyGrid) -> Point:
        """Return a named point in the new frame, with its room."""
        room = old.at(point, grid)
        label = np.array([NO_ROOM if room is None else old.index(room)])
        x, y = self.points(np.array([point]), label)[0].tolist()
        return x, y


class _Overlap(NamedTuple):
    """What old and new rooms have in common, in square metres of free cells."""

    both: FloatArray
    """float64 (n_old, n_new)."""
    area_old: FloatArray
    seen_old: FloatArray
    """float64 (n_old,), of the area what the new map knows."""
    seen_new: FloatArray
    """float64 (n_new,), of the area what the old map knows."""

    @classmethod
    def of(cls, old: Side, new: Side) -> _Overlap:
        """Move the cells of the old rooms to the new map, and those of the new ones back."""
        n_old, n_new = len(old.rooms.names), len(new.rooms.names)
        rooms, points, cell_m2 = _cells(old)
        area = np.bincount(rooms, minlength=n_old) * cell_m2
        moved = old.there(points, rooms)
        seen = np.bincount(rooms[new.is_known(moved)], minlength=n_old) * cell_m2
        keys = rooms * (n_new + 1) + new.at(new.rooms_of, moved) + 1
        pairs = np.bincount(keys, minlength=n_old * (n_new + 1))
        both = pairs.reshape(n_old, n_new + 1)[:, 1:] * cell_m2
        rooms, points, cell_m2 = _cells(new)
        is_known = old.is_known(new.there(points, np.full(len(points), NO_ROOM, np.int32)))
        seen_new = np.bincount(rooms[is_known], minlength=n_new) * cell_m2
        # Back without drift, a few cells more are known: a share is one at most.
        most = np.maximum(seen_new, both.sum(axis=0))
        return cls(*(each.astype(np.float64) for each in (both, area, seen, most)))


def _cells(of: Side) -> tuple[IntArray, FloatArray, float]:
    """Return free cells of rooms: room, middle, and the area that each stands for."""
    labels = of.rooms_of.ravel()
    cells = np.flatnonzero(labels >= 0)
    step = max(1, len(cells) // _MOST_CELLS)
    at = np.stack(np.divmod(cells[::step], of.grid.shape[1]), axis=1)
    return labels[cells[::step]], of.grid.frame.points_of(at), step * of.grid.cell_area_m2


class _Cut(NamedTuple):
    """The new rooms as the older map cuts them."""

    labels: RoomLabels
    made_of: list[list[str]]
    """The new rooms, or parts of them, of which each is made, the one with the most cells first."""
    divided: set[str]
    """New rooms that are in parts."""

    @classmethod
    def of(cls, old: Side, new: Side) -> _Cut:
        """Cut the rooms; see `recut_rooms`."""
        label_of, common = recut_rooms(old, new)
        names, first = new.rooms.names, _first_number(old.rooms, new.rooms)
        used, dense = np.unique(np.append(label_of, NO_ROOM), return_inverse=True)
        made_of: dict[int, list[str]] = {at: [] for at in used[1:].tolist()}
        for room, at in common.tolist():
            made_of[at].append(names[room])
        every = [*names, *(f"room-{first + k}" for k in range(len(used)))]
        cells = dense[:-1].reshape(label_of.shape).astype(np.int32) - np.int32(1)
        labels = RoomLabels(tuple(every[at] for at in made_of), cells, doors=new.rooms.doors)
        of = np.bincount(common[:, 0], minlength=len(names))
        return cls(labels, list(made_of.values()), {names[k] for k in np.flatnonzero(of > 1)})

    def origin(self, room: int) -> str:
        """Return what a room was made of, empty for a new room as it is."""
        parts = self.made_of[room]
        if len(parts) < 2 and not self.divided.intersection(parts):  # noqa: PLR2004
            return ""
        told = [f"part of {name}" if name in self.divided else name for name in parts]
        return f"cut as before: {', '.join(told)}"


def _heirs(overlap: _Overlap) -> dict[int, int]:
    """Return the new room of each old one whose name is carried."""
    is_shown = overlap.seen_old >= _VISIBLE * overlap.area_old
    met = np.argwhere((overlap.both > 0) & is_shown[:, None]).tolist()
    pairs = [(old, new, float(overlap.both[old, new])) for old, new in met]
    heirs = heirs_of(pairs, dict(enumerate(overlap.seen_old.tolist())))
    return {
        old: new
        for new, old in heirs.name.items()
        if 2 * overlap.both[old, new] > overlap.seen_new[new]
    }


def _rooms(
    old: RoomLabels,
    cut: _Cut,
    overlap: _Overlap,
    heir_of: Mapping[int, int],
    names: tuple[str, ...],
) -> dict[str, Carried]:
    """Return what became of each old room; reasons call the new ones as the person will."""
    both, area, seen_old, seen_new = overlap
    of_old = both / np.maximum(seen_old, _TINY_M2)[:, None]
    of_new = both / np.maximum(seen_new, _TINY_M2)
    visible = seen_old / np.maximum(area, _TINY_M2)
    found: dict[str, Carried] = {}
    for room, name in enumerate(old.names):
        most = int(both[room].argmax()) if both.shape[1] else NO_ROOM
        if most == NO_ROOM or visible[room] < _VISIBLE or of_old[room, most] < _REMAINS:
            unknown = visible[room] < _VISIBLE
            why = "the new map does not show it" if unknown else "no new room lies there"
            found[name] = Carried(None, 0.0, "lost", why)
            continue
        mine, its = float(of_old[room, most]), float(of_new[room, most])
        confidence = round(min(mine, its), 3)
        if room in heir_of:
            heir = heir_of[room]
            was = cut.made_of[heir][0]
            found[name] = Carried(was, confidence, "carried", cut.origin(heir))
            continue
        parts = [names[at] for at in np.flatnonzero(2 * both[room] > seen_new).tolist()]
        why = f"{mine:.0%} of it lie in {names[most]}, {its:.0%} of that in it"
        why = f"divided into {', '.join(parts)}" if len(parts) > 1 else why
        found[name] = Carried(None, confidence, "undecided", why)
    return found


def _doors(
    old: tuple[RoomLabels, OccupancyGrid],
    new: tuple[RoomLabels, OccupancyGrid],
    moving: _Moving,
    heir_of: Mapping[int, int],
) -> tuple[dict[int, Carried], dict[int, Point], tuple[int, ...]]:
    """Return what became of each old door, the doors of the new map with their numbers, and which
    of these are new."""
    before, after = (
        RoomBoundaries.of(labels, grid, measured_clearance_m(grid)) for labels, grid in (old, new)
    )
    numbers = before.numbers(old[0].doors)
    listed = np.flatnonzero(
        (before.passages_m >= LEAST_DOOR_M) | np.isin(numbers, list(old[0].doors))
    )
    sides = before.labels[listed]
    moved = np.mean([moving.points(before.middles[listed], side) for side in sides.T], axis=0)
    known = dict(zip(numbers[listed].tolist(), map(tuple, moved.tolist()), strict=True))
    given, own = after.numbers(known), after.numbers(new[0].doors)
    at_of = {number: at for at, number in enumerate(given.tolist()) if number in known}
    found: dict[int, Carried] = {}
    for number, side in zip(known, sides.tolist(), strict=True):
        if number not in at_of:
            found[number] = Carried(None, 0.0, "lost", "no boundary of rooms is near")
            continue
        at = at_of[number]
        there = after.labels[at].tolist()
        heirs = [heir_of.get(room, NO_ROOM if room == NO_ROOM else None) for room in side]
        firm = sum(heir is not None and heir in there for heir in heirs)
        off_m = float(hypots(*(after.sides[after.boundary_of == at] - known[number]).T).min())
        confidence = round((1 - off_m) * firm / 2, 3)
        is_sure = firm == len(side) and after.passages_m[at] >= LEAST_DOOR_M
        if not firm or (off_m > _SURE_DOOR_M and not is_sure):
            why = "the door there joins other rooms"
            found[number] = Carried(None, confidence, "undecided", why)
        else:
            found[number] = Carried(int(own[at]), confidence, "carried")
    carried = {number for number, each in found.items() if each.status == "carried"}
    first = max([*numbers.tolist(), *old[0].doors], default=0) + 1
    numbered: dict[int, Point] = {}
    is_door = after.passages_m >= LEAST_DOOR_M
    new_doors: list[int] = []
    for at in np.argsort(own, kind="stable").tolist():
        number = int(given[at])
        if number not in carried:
            if not is_door[at]:
                continue
            number = first + len(new_doors)
            new_doors.append(number)
        numbered[number] = (float(after.middles[at, 0]), float(after.middles[at, 1]))
    return found, dict(sorted(numbered.items())), tuple(new_doors)


def _first_number(old: RoomLabels, new: RoomLabels) -> int:
    """Return the first number that no room of either map has."""
    found = (NUMBERED.fullmatch(name) for name in (*old.names, *new.names))
    return 1 + max((int(match[1]) for match in found if match), default=0)


def _names(
    old: RoomLabels, new: RoomLabels, room_of: Mapping[int, int]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    first = _first_number(old, new)
    names, others = list[str](), list[str]()
    for at, own in enumerate(new.names):
        if at in room_of:
            names.append(old.names[room_of[at]])
            continue
        is_taken = own in old.names
        names.append(f"room-{first}" if is_taken else own)
        first += is_taken
        others.append(names[-1])
    return tuple(names), tuple(others)
