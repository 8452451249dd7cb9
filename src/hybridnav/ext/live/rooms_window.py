"""The rooms that a change touches, found anew in a window of the map."""

from __future__ import annotations

import math
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import ndimage

from hybridnav.ext.live.identities import Events
from hybridnav.ext.live.tiles import Box
from hybridnav.maps import NO_ROOM, CellClass, Frame, OccupancyGrid
from hybridnav.maps.areas import box_of_mask
from hybridnav.maps.clearance import within_radius
from hybridnav.topology.rooms.find import LEFT_OUT, WALL_REACH_M, reaching, renewed_rooms

if TYPE_CHECKING:
    from collections.abc import Collection

    from hybridnav._base.typing import BoolArray, IntArray, LongArray


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


class Renewed(NamedTuple):
    """Rooms after a change."""

    number_of: IntArray
    """int32 (rows, cols), the number of the room of each cell of the map."""
    events: Events
    """What became of the rooms."""


class _Part(NamedTuple):
    """The part of the map that is looked at."""

    window: Box
    """Its cells."""
    room_of: IntArray
    """int32, the rooms beside that stay, -1 where rooms are to be found; see `renewed_rooms`."""


def renew(
    before: RoomCells,
    grid: OccupancyGrid,
    outside: BoolArray,
    differs: BoolArray,
    settings: tuple[float, int],
) -> Renewed:
    """Find the rooms anew that changed cells touch; all others keep their free cells.

    Parameters
    ----------
    before
        The rooms before.
    grid
        The map now.
    outside
        bool (rows, cols), its free cells outside of the building.
    differs
        bool (rows, cols), cells that changed; at least one.
    settings
        The least area of a room in square metres, and the least number that no room has had.
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
    return Renewed(
        number_of,
        Events(
            matches.born,
            died,
            matches.merged,
            matches.split,
            tuple(sorted((changed & has) - set(matches.born))),
        ),
    )


def beside_rooms(number_of: IntArray, grid: OccupancyGrid) -> BoolArray:
    """Return the cells so near to rooms that these may reach them, bool (rows, cols)."""
    return within_radius(number_of >= 0, radius_cells=_cells(WALL_REACH_M, grid))


def box_of_rooms(number_of: IntArray, rooms: Collection[int]) -> Box | None:
    """Return the least box that holds some rooms, walls included; None without any."""
    boxes = ndimage.find_objects(number_of + 1)
    found = [at for at in (boxes[n] for n in rooms if n < len(boxes)) if at is not None]
    joined = [Box(at[0].start, at[1].start, at[0].stop, at[1].stop) for at in found]
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
) -> _Part:
    """Return the rooms to find, and what lies beside, in a window with some of the map around."""
    of_rooms, box = box_of_rooms(number_of, touched), bounds(differs)
    box = box if of_rooms is None else box.joined(of_rooms)
    box, found = _to_find(number_of, free, differs, touched, box)
    inside = box.inside(_whole(grid))
    near = within_radius(found, radius_cells=_cells(_MARGIN_M, grid)) & free[inside]
    beside = np.setdiff1d(number_of[inside][near], [NO_ROOM, *touched])
    window = box.widened(_cells(_CONTEXT_M, grid)).common(_whole(grid))
    inside = window.inside(_whole(grid))
    number = number_of[inside]
    stays = free[inside] & np.isin(number, beside)
    room_of: IntArray = np.where(stays, number, np.int32(LEFT_OUT))
    room_of[box.inside(window)][found] = NO_ROOM
    return _Part(window, room_of)


def _to_find(
    number_of: IntArray,
    free: BoolArray,
    differs: BoolArray,
    touched: list[int],
    box: Box,
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
        found: BoolArray = is_kept[parts]
        if not _is_cut_off(found, box, whole):
            return box, found


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

    Parameters
    ----------
    old
        int32 (rows, cols), the old rooms that were given up, -1 elsewhere.
    labels
        int32 (rows, cols), the rooms now: the numbers of those that stay, and labels of those that
        were found anew; -1 elsewhere.
    first
        The least label of a room that was found anew, and the least number that no room has had.
    areas_staying
        int64 (n,), the free cells of each room that stayed by its number, where it was before.
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
