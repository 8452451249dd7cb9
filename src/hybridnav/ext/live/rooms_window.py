"""The rooms and doors that a change touches, found anew in a window of the map."""

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.typing import BoolArray, IntArray, LongArray
from hybridnav.ext.live.identities import Events
from hybridnav.ext.live.tiles import Box
from hybridnav.maps import NO_ROOM, CellClass, Frame, OccupancyGrid, RoomLabels
from hybridnav.maps.areas import box_of_mask
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.room_labels import Point
from hybridnav.rooms.doors import LEAST_DOOR_M, RoomBoundaries, measured_clearance_m
from hybridnav.rooms.find import LEFT_OUT, WALL_REACH_M, reaching, renewed_rooms

_MARGIN_M = 0.3
"""A changed cell touches the rooms within this distance: walls belong to rooms up to 0.25 m."""
_CONTEXT_M = 10.0
"""Map around the rooms that are found anew. A build looks at walls on one line over 5 to 9 m; where
3 m of a corridor was left, rooms merged with it that a build keeps apart."""
_STEP = 16
"""Cells by which a box is widened until no cell at its sides is to be found."""


class RoomCells(NamedTuple):
    """The rooms of a version, on the cells of the next map."""

    number_of: IntArray
    """int32 (rows, cols), the number of the room of each cell, -1 for none."""
    free: BoolArray
    """bool (rows, cols), free cells inside the building, as measured."""


def renew(
    before: RoomCells,
    grid: OccupancyGrid,
    outside: BoolArray,
    differs: BoolArray,
    settings: tuple[float, int],
) -> tuple[IntArray, Events]:
    """Find the rooms anew that changed cells touch; all others keep their free cells.

    `before`: the rooms before; `grid`: the map now; `outside`: bool (rows, cols), its free cells
    outside of the building; `differs`: bool (rows, cols), cells that changed; at least one;
    `settings`: the least area of a room in square metres, and the least number that no room has
    had.
    """
    free = (grid.measured == CellClass.FREE) & ~outside
    touched = _touched(before.number_of, differs, grid)
    window, room_of = _part(before.number_of, free, differs, touched, grid)
    inside = window.inside(_whole(grid))
    part = part_of(grid, window)
    number, is_free = before.number_of[inside], free[inside]
    old = np.where(before.free[inside], number, np.int32(NO_ROOM))
    labels = renewed_rooms(part, outside[inside], room_of, old, settings[0])
    labels = np.where(room_of >= 0, room_of, labels)
    gone = np.where(np.isin(old, touched), old, np.int32(NO_ROOM))
    areas = np.bincount(before.number_of[before.free & (before.number_of >= 0)], minlength=1)
    first = int(room_of.max(initial=NO_ROOM)) + 1
    matches = match(gone, labels, (first, settings[1]), areas[:first])
    new = np.where(is_free, number, np.int32(NO_ROOM))
    new[room_of == NO_ROOM] = matches.number_of[labels[room_of == NO_ROOM]]
    moved = old != new
    number_of = before.number_of.copy()
    # Labels spread along sides: cells that they reach lie at most so far in a straight line.
    near = within_radius(differs[inside] | moved, radius_cells=_cells(WALL_REACH_M, grid))
    number_of[inside][near] = reaching(new, part)[near]
    has = set(np.unique(new).tolist())
    died = tuple(number for number in touched if number not in has)
    # Outlines that people draw hold walls and furniture far from free cells.
    number_of[np.isin(number_of, died)] = NO_ROOM
    changed = set(np.unique(np.append(old[moved], new[moved])).tolist()) - {NO_ROOM}
    kept = tuple(sorted((changed & has) - set(matches.born)))
    return number_of, Events(matches.born, died, matches.merged, matches.split, kept)


def beside_rooms(number_of: IntArray, grid: OccupancyGrid) -> BoolArray:
    """Return the cells so near to rooms that these may reach them, bool (rows, cols)."""
    return within_radius(number_of >= 0, radius_cells=_cells(WALL_REACH_M, grid))


def box_of_rooms(number_of: IntArray, rooms: Collection[int]) -> Box | None:
    """Return the least box that holds some rooms, walls included; None without any."""
    boxes = ndimage.find_objects(number_of + 1)
    own_boxes = [at for at in (boxes[n] for n in rooms if n < len(boxes)) if at is not None]
    joined = [Box(at[0].start, at[1].start, at[0].stop, at[1].stop) for at in own_boxes]
    return reduce(Box.joined, joined) if joined else None


def part_of(grid: OccupancyGrid, box: Box) -> OccupancyGrid:
    """Return a window of a map as measured, without a robot."""
    inside = box.inside(_whole(grid))
    x, y = grid.frame.points_of_grid([box.low_row, box.low_col]).tolist()
    return OccupancyGrid(
        grid.probability[inside],
        Frame(grid.resolution_m, (x, y), grid.frame.yaw_rad),
        free_threshold=grid.free_threshold,
        occupied_threshold=grid.occupied_threshold,
        robot_radius_m=0,
    )


def bounds(mask: BoolArray) -> Box:
    """Return the least box that holds the cells of a mask, which has some."""
    low_row, high_row, low_col, high_col = box_of_mask(mask)
    return Box(low_row, low_col, high_row, high_col)


def _whole(grid: OccupancyGrid) -> Box:
    return Box(0, 0, *grid.shape)


def _cells(length_m: float, grid: OccupancyGrid) -> int:
    return math.ceil(length_m / grid.resolution_m) + 1


def _touched(number_of: IntArray, differs: BoolArray, grid: OccupancyGrid) -> list[int]:
    """Return the rooms near changed cells, ascending."""
    margin = _cells(_MARGIN_M, grid)
    box = bounds(differs).widened(margin).common(_whole(grid))
    inside = box.inside(_whole(grid))
    near = within_radius(differs[inside], radius_cells=margin)
    return [int(n) for n in np.unique(number_of[inside][near]) if n != NO_ROOM]


def _part(
    number_of: IntArray,
    free: BoolArray,
    differs: BoolArray,
    touched: list[int],
    grid: OccupancyGrid,
) -> tuple[Box, IntArray]:
    """Return a window with some of the map around the rooms to find, and the rooms beside that stay
    in it, -1 where rooms are to be found; see `renewed_rooms`."""
    of_rooms, box = box_of_rooms(number_of, touched), bounds(differs)
    box = box if of_rooms is None else box.joined(of_rooms)
    box, to_find = _to_find(number_of, free, differs, touched, box)
    inside = box.inside(_whole(grid))
    near = within_radius(to_find, radius_cells=_cells(_MARGIN_M, grid)) & free[inside]
    beside = np.setdiff1d(number_of[inside][near], [NO_ROOM, *touched])
    window = box.widened(_cells(_CONTEXT_M, grid)).common(_whole(grid))
    inside = window.inside(_whole(grid))
    number = number_of[inside]
    stays = free[inside] & np.isin(number, beside)
    room_of: IntArray = np.where(stays, number, np.int32(LEFT_OUT))
    room_of[box.inside(window)][to_find] = NO_ROOM
    return window, room_of


def _to_find(
    number_of: IntArray, free: BoolArray, differs: BoolArray, touched: list[int], box: Box
) -> tuple[Box, BoolArray]:
    """Return the free cells whose room is to be found, in a box that has all of them.

    Those are the cells of touched rooms, and cells without a room that are connected with these or
    with changed ones.
    """
    whole = Box(0, 0, *free.shape)
    while True:
        box = box.widened(_STEP).common(whole)
        inside = box.inside(whole)
        of_touched = np.isin(number_of[inside], touched)
        loose = free[inside] & (of_touched | (number_of[inside] == NO_ROOM))
        parts, n_parts = ndimage.label(loose)
        is_kept = np.zeros(n_parts + 1, np.bool_)
        is_kept[parts[loose & (of_touched | differs[inside])]] = True
        to_find: BoolArray = is_kept[parts]
        if not _is_cut_off(to_find, box, whole):
            return box, to_find


def _is_cut_off(mask: BoolArray, box: Box, whole: Box) -> bool:
    """Return whether cells of a mask lie at a side of a box that is none of the map's."""
    at_side = mask[0].any(), mask[:, 0].any(), mask[-1].any(), mask[:, -1].any()
    return any(at and side != end for at, side, end in zip(at_side, box, whole, strict=True))


# Which of the rooms that were found anew are old ones.


class Matches(NamedTuple):
    """The numbers of rooms that were found anew, and what became of old ones."""

    number_of: LongArray
    """int64 (n_labels + 1,), the number of the room of each label, -1 for the last."""
    born: tuple[int, ...]
    """New numbers."""
    merged: dict[int, int]
    """Old rooms whose heir bears another number, with it."""
    split: dict[int, tuple[int, ...]]
    """Old rooms, and several new ones that mostly consist of them."""


def match(
    old: IntArray, labels: IntArray, first: tuple[int, int], areas_staying: LongArray
) -> Matches:
    """Return the numbers of rooms that were found anew: those of old ones that have heirs, or new.

    The heir of an old room is the one that now has more than half of its cells. An heir of several
    bears the number of the one with which it shares the most cells, the least number on a tie; a
    room that stayed bears its own.

    `old`: int32 (rows, cols), the old rooms that were given up, -1 elsewhere; `labels`: int32
    (rows, cols), the rooms now: the numbers of those that stay, and labels of those that were found
    anew; -1 elsewhere; `first`: the least label of a room that was found anew, and the least number
    that no room has had; `areas_staying`: int64 (n,), the free cells of each room that stayed by
    its number, where it was before.
    """
    first_label, first_number = first
    areas = np.bincount(labels[labels >= 0], minlength=first_label)
    areas[: len(areas_staying)] = np.maximum(areas[: len(areas_staying)], areas_staying)
    areas_before = np.bincount(old[old >= 0])
    both = (old >= 0) & (labels >= 0)
    keys, counts = np.unique(old[both] * np.int64(len(areas)) + labels[both], return_counts=True)
    shared = {
        (key // len(areas), key % len(areas)): cells
        for key, cells in zip(keys.tolist(), counts.tolist(), strict=True)
    }
    heirs = {pair: cells for pair, cells in shared.items() if 2 * cells > areas_before[pair[0]]}
    number_of = np.append(np.arange(len(areas)), NO_ROOM)
    number_of[first_label:-1] = NO_ROOM
    for was, label in sorted(heirs, key=lambda pair: (-heirs[pair], pair)):
        if number_of[label] == NO_ROOM:
            number_of[label] = was
    new = first_label + np.flatnonzero(number_of[first_label:-1] == NO_ROOM)
    number_of[new] = first_number + np.arange(len(new))
    merged = {was: int(number_of[label]) for was, label in heirs if number_of[label] != was}
    split: dict[int, list[int]] = {}
    for (was, label), cells in shared.items():
        if 2 * cells > areas[label]:
            split.setdefault(was, []).append(int(number_of[label]))
    return Matches(
        number_of,
        tuple(number_of[new].tolist()),
        merged,
        {was: tuple(sorted(parts)) for was, parts in split.items() if len(parts) > 1},
    )


# Doors with lasting numbers: the boundaries between the rooms of a map that changes.


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
    """Numbers of the rooms on both sides; -1 for nameless space."""
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
    """Doors that fell into several, with these: the one that kept the number among them."""
    merged: dict[int, int]
    """Doors that died and are part of one other door now, wider or moved, with that door."""


def doors_of(
    number_of: IntArray, grid: OccupancyGrid, low: tuple[int, int], positions: Mapping[int, Point]
) -> list[OnlineDoor]:
    """Return the doors between rooms.

    `number_of`: int32 (rows, cols), the number of the room of each cell, -1 for none; `grid`: the
    map of these cells; `low`: row and column of cell (0, 0) in the lasting numbering; `positions`:
    a point of each door that has a number; see `RoomBoundaries.numbers`.
    """
    rooms = np.flatnonzero(np.bincount(number_of.ravel() + 1)[1:])
    dense = np.full(int(rooms.max(initial=NO_ROOM)) + 2, NO_ROOM, np.int32)
    dense[rooms] = np.arange(len(rooms))
    labels = RoomLabels(tuple(f"room-{room}" for room in rooms.tolist()), dense[number_of])
    boundaries = RoomBoundaries.of(labels, grid, measured_clearance_m(grid))
    room_of = np.append(rooms, NO_ROOM)
    numbers = boundaries.numbers(positions)
    order = np.argsort(boundaries.boundary_of, kind="stable")
    ends = np.cumsum(np.bincount(boundaries.boundary_of, minlength=boundaries.n_boundaries))
    row, col = np.divmod(boundaries.edges >> 1, grid.shape[1])
    cracks = ((row + low[0] + _BIAS) << 32) + ((col + low[1] + _BIAS) << 1) + (boundaries.edges & 1)
    sides = np.split(cracks[order], ends[:-1])
    return [
        OnlineDoor(
            int(numbers[at]),
            (int(room_of[boundaries.labels[at, 0]]), int(room_of[boundaries.labels[at, 1]])),
            (float(boundaries.middles[at, 0]), float(boundaries.middles[at, 1])),
            float(boundaries.widths_m[at]),
            float(boundaries.passages_m[at]),
            frozen(sides[at]),
        )
        for at in range(boundaries.n_boundaries)
    ]


def follow_doors(
    before: Mapping[int, OnlineDoor], after: Iterable[OnlineDoor], first_number: int
) -> tuple[dict[int, OnlineDoor], DoorEvents]:
    """Return the doors after a change, and what became of those before.

    Doors that are none of the old ones have numbers that none of these has.
    `first_number` is the least number that no door has had.
    """
    doors: dict[int, OnlineDoor] = {}
    born: list[int] = []
    for door in sorted(after, key=lambda door: door.number):
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
