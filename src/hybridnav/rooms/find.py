"""Rooms that the map itself shows: segmentation of free space at its narrow passages, of the whole
map, or anew in a part of it beside rooms that stay.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from scipy import ndimage

from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, RoomLabels
from hybridnav.maps.areas import box_of_mask
from hybridnav.maps.orientation import Orientation
from hybridnav.maps.room_labels import MAX_ROOMS
from hybridnav.rooms.cutting import (
    Ground,
    Kind,
    fine_segments,
    least_cells,
    spread,
    without_noise,
)
from hybridnav.rooms.kernels import cutting as _cell_kernels
from hybridnav.rooms.merging import (
    Forest,
    GoesOn,
    Judge,
    JudgedSegments,
    Likely,
    Rule,
    Small,
    grown,
    merge,
)
from hybridnav.rooms.views import voted_rooms

Cell = tuple[int, int]

_LEAST_INSIDE = 0.1
"""Area cut off inside free space that reaches all sides of the map, as a share of it, from which
on that is the outside."""
_SIDES = (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1])
"""Indices of the first and last row and column."""
_LARGEST_LEAST_M2 = 1e9
"""Least areas beyond it are taken for a mistake."""
SPECK_M2 = 0.25
"""Segments below it go to a neighbour before boundaries are judged."""
KINDS = np.array([Kind.WALL, Kind.OUTSIDE, Kind.UNKNOWN], np.uint8)
"""Kind of each class of cells, free ones as if outside: plus 1 inside."""
LEAST_LIKELY = 0.5
"""Segments of one room: the least probability at which they merge."""
WALL_REACH_M = 0.25
"""How far rooms reach into walls, and into the unexplored cells of their own side: outlines that
people edit then run inside walls, not along the free cells' steps."""


def find_rooms(grid: OccupancyGrid, *, least_area_m2: float = 1.0) -> RoomLabels:
    """Find the rooms of a map.

    Free space is cut finely, along the lines of walls in every local direction and at narrow
    passages. Then a small forest, learnt from people's rooms, judges each boundary by its evidence.
    Segments merge if both lie in one room. So it is done in four views of the map, turned against
    its walls, which vote.

    Parameters
    ----------
    grid
        The map. Its cells count as they were measured: the robot's radius changes no room.
    least_area_m2
        In square metres of free cells, positive, at most 1e9. Smaller segments go to the neighbour
        with the longest open border; without one they are no room. Free space outside the building
        is no room either: it surrounds other free space, along most of the map's border.

    Returns
    -------
    RoomLabels
        Rooms `room-1`, `room-2`, ..., in reading order of their first cells: highest row first.

    Raises
    ------
    InvalidValueError
        When the area is out of range, or there are too many rooms.

    Examples
    --------
    >>> hn.find_rooms(hn.example_map("figure1")).names
    ('room-1',)
    """
    check_least_area(least_area_m2)
    labels = judged_rooms(grid, Forest.shipped(), least_area_m2)
    n_rooms = int(labels.max(initial=NO_ROOM)) + 1
    if n_rooms > MAX_ROOMS:
        raise InvalidValueError(
            f"the map falls into {n_rooms} rooms of {least_area_m2:g} square metres and more, "
            f"at most {MAX_ROOMS} are kept: raise the least area"
        )
    names = tuple(f"room-{number}" for number in range(1, n_rooms + 1))
    return RoomLabels(names, reaching(labels, grid))


def check_least_area(least_area_m2: float) -> None:
    """Raise `InvalidValueError` if the least area of a room is out of range, or no number."""
    is_number = isinstance(least_area_m2, int | float | np.number)
    if not is_number or not 0 < least_area_m2 <= _LARGEST_LEAST_M2:
        raise InvalidValueError(
            "least area must be a positive number of square metres, at most "
            f"{_LARGEST_LEAST_M2:g}, got {least_area_m2!r:.40}"
        )


def divide_rooms(room_of: IntArray, seeds: Mapping[int, Cell]) -> IntArray:
    """Divide rooms among the seeds that lie in them: each cell goes to the nearest by walking.

    `room_of`: int32 (rows, cols), -1 for cells of no room; `seeds`: a label >= 0 and the cell (row,
    col) that it spreads from, inside a room. Returns int32 (rows, cols), the labels; -1 where none
    spreads to: outside the rooms with seeds. Distances are counted in steps along sides, ties go to
    the lower cell's label.
    """
    divided = np.full(room_of.shape, NO_ROOM, dtype=np.int32)
    for label, cell in seeds.items():
        divided[cell] = label
    spread(divided, room_of, room_of.size)
    return divided


def judged_rooms(grid: OccupancyGrid, forest: Forest, least_area_m2: float) -> IntArray:
    """Cut free space finely, merge the segments by a judge of their boundaries, and let views vote.

    All is done on the known cells alone, in the one of their eight images that `Orientation`
    chooses: equal places have equal rooms, whatever lies round the map and however it is turned.

    `grid`: the map; cells count as they were measured; `least_area_m2`: see `find_rooms`. Returns
    int32 (rows, cols), rooms in reading order, -1 elsewhere.
    """
    free = (grid.measured == CellClass.FREE) & ~outside_of(grid)
    if not free.any():
        return np.full(grid.shape, NO_ROOM, dtype=np.int32)
    top, bottom, left, right = box_of_mask(grid.measured != CellClass.UNEXPLORED)
    known = np.s_[top:bottom, left:right]
    margin = int(WALL_REACH_M / grid.resolution_m) + 1
    kinds = np.pad(KINDS[grid.measured[known]] + free[known], margin)
    kinds = without_noise(kinds, grid.resolution_m)
    image = Orientation.of(kinds)
    image = replace(image, swaps=1 - image.swaps, flips=image.flips[::-1])  # longer along columns
    rules = partial(_rules, forest.judge, least_area_m2)
    voted = voted_rooms(image.turned(kinds), grid.resolution_m, rules, least_area_m2)
    found = image.turned_back(voted)[margin:-margin, margin:-margin]
    labels = np.full(grid.shape, NO_ROOM, dtype=np.int32)
    np.copyto(labels[known], found, where=free[known])
    least = least_cells(least_area_m2, grid.cell_area_m2)
    _cell_kernels.number_from_above(labels, least)
    return labels


def _rules(judge: Judge, least_area_m2: float, cell_m2: float) -> list[Rule]:
    """Return the rules by which segments become rooms, but for the least area of a room."""
    specks = least_cells(min(SPECK_M2, least_area_m2), cell_m2)
    return [Small(specks), Likely(judge, LEAST_LIKELY), GoesOn(judge)]


def reaching(label_of: IntArray, grid: OccupancyGrid) -> IntArray:
    """Return labels spread into walls, and through unexplored cells, but never through a wall.

    They reach 0.25 m. On some maps only a wall of one cell separates two rooms: labels do not
    spread through it into unexplored cells, or into free cells without a room.
    """
    reach = WALL_REACH_M / grid.resolution_m
    inside = label_of.copy()
    entered = (label_of >= 0) | (grid.measured == CellClass.UNEXPLORED)
    spread(inside, entered, int(reach))
    return grown(label_of, reach, into=(inside, grid.measured == CellClass.OCCUPIED))


def outside_of(grid: OccupancyGrid) -> BoolArray:
    """Return the free cells outside the building, which belong to no room.

    They are connected along sides, reach all four sides of the known cells, and fill at least half
    of that border. They surround free space that they cannot reach, at least a tenth of their own
    area. So the margin of a building's image is outside, and so is the ground round a race track,
    but not a hall that the map's border cuts off.
    """
    top, bottom, left, right = box_of_mask(grid.measured != CellClass.UNEXPLORED)
    known = np.s_[top:bottom, left:right]
    found = np.zeros(grid.shape, dtype=np.bool_)
    free = grid.measured[known] == CellClass.FREE
    n_rim = sum(np.count_nonzero(free[side]) for side in _SIDES) if free.size else 0
    if n_rim < max(1, sum(free.shape)):
        return found  # most maps: their border is unexplored
    part_of, n_parts = ndimage.label(free)
    borders = [part_of[side] for side in _SIDES]
    on_border = [np.bincount(border, minlength=n_parts + 1) for border in borders]
    n_border = sum(len(border) for border in borders)
    around = np.all(np.stack(on_border) > 0, axis=0) & (2 * sum(on_border) >= n_border)
    around[0] = False
    if not around.any():
        return found
    areas = np.bincount(part_of.ravel(), minlength=n_parts + 1)
    inside = areas[1:][~np.any(np.stack(on_border) > 0, axis=0)[1:]].sum()
    around &= inside >= _LEAST_INSIDE * areas
    found[known] = around[part_of]
    return found


LEFT_OUT = -2
"""Cells that are in no room, or in one that takes no part."""

_ODDS = 2.0
"""Odds of one room, times this for two segments of one room before, by this for those of two. Over
a log in cells of 0.1 m, 0.9 % of the cells change their number in an update, 5.7 % without it."""


class _Apart:
    """A rule by which segments merge as by another one, but no two rooms that stay.

    `stays`: int64 (n,), segments that are rooms that stay.
    """

    def __init__(self, rule: Rule, stays: LongArray) -> None:
        self._rule, self._stays = rule, stays

    def ratings(self, segments: JudgedSegments, grown: LongArray) -> FloatArray:
        """Return the rating of each pair; see `Rule`."""
        ratings = self._rule.ratings(segments, grown).copy()
        stays = np.zeros(segments.n_segments, np.bool_)
        stays[segments.owner_of[self._stays]] = True
        endpoints = segments.state.endpoints
        ratings[(endpoints[:, 0] >= 0) & stays[endpoints].all(axis=1)] = 0.0
        return ratings


class _Lasting:
    """The judge of boundaries, who holds on to the rooms before: rooms near the threshold would
    change with every scan.

    `segments`: the segments, before any of them merge; `before`: int32 (rows, cols), the room of
    each cell before, -1 for none.
    """

    def __init__(self, segments: JudgedSegments, before: IntArray) -> None:
        self._segments = segments
        label_of = segments.label_of
        both = (label_of >= 0) & (before >= 0)
        rooms, dense = np.unique(before[both], return_inverse=True)
        shape = segments.n_segments, max(1, len(rooms))
        keys = label_of[both] * np.int64(shape[1]) + dense
        self._cells = np.bincount(keys, minlength=shape[0] * shape[1]).reshape(shape)

    def judge(self, pairs: LongArray, evidence: FloatArray) -> FloatArray:
        """Return the probability that two segments belong to one room, float64 (n,)."""
        probability = Forest.shipped().judge(pairs, evidence)
        cells = np.zeros_like(self._cells)
        np.add.at(cells, self._segments.owner_of, self._cells)
        had = np.where(cells.any(axis=1), cells.argmax(axis=1), NO_ROOM)
        one, other = had[self._segments.state.endpoints[pairs].T]
        both = (one >= 0) & (other >= 0)
        odds = np.where(both, np.where(one == other, _ODDS, 1 / _ODDS), 1.0)
        return probability * odds / (probability * odds + 1 - probability)


def renewed_rooms(
    grid: OccupancyGrid,
    outside: BoolArray,
    room_of: IntArray,
    before: IntArray,
    least_area_m2: float,
) -> IntArray:
    """Find the rooms of some free cells, with the rooms beside them as they are.

    The method is that of `find_rooms` in one view, the map as it is. Each room that stays is one
    segment from the start. Others may merge with it, so that it grows; two of them never merge.

    `grid`: the map, or a window of it; cells count as they were measured; `outside`: bool (rows,
    cols), free cells outside of the building; `room_of`: int32 (rows, cols): the room of free cells
    that stays, at least 0; -1 for free cells whose room is to be found; `LEFT_OUT` elsewhere;
    `before`: int32 (rows, cols), the room of each cell before, -1 for none. What was one room tends
    to stay one, what was two rooms to stay two. `least_area_m2`: see `find_rooms`. Returns int32
    (rows, cols). Where rooms were to be found: a room that stays, a new label above all of them, or
    -1 for segments that are too small. -1 elsewhere.
    """
    to_find = room_of == NO_ROOM
    free = (grid.measured == CellClass.FREE) & ~outside
    ground = Ground.of(KINDS[grid.measured] + free, grid.resolution_m)
    first = int(room_of.max(initial=NO_ROOM)) + 1
    label_of = np.where(room_of >= 0, room_of, np.int32(NO_ROOM))
    fine = fine_segments(ground)
    cut = (fine >= 0) & (to_find | (grid.measured != CellClass.FREE))  # rays of a scan
    label_of[cut] = first + fine[cut]
    if not cut.any():
        return np.full(room_of.shape, NO_ROOM, np.int32)
    _, dense = np.unique(np.append(label_of, NO_ROOM), return_inverse=True)
    segments = JudgedSegments(dense[:-1].reshape(label_of.shape).astype(np.int32) - 1, ground)
    # The numbers of rooms that stay lie below all others, and segments keep the order.
    stays = np.arange(len(np.unique(room_of[room_of >= 0])))
    rules = _rules(_Lasting(segments, before).judge, least_area_m2, grid.cell_area_m2)
    rules.append(Small(least_cells(least_area_m2, grid.cell_area_m2)))
    merge(segments, [_Apart(rule, stays) for rule in rules])
    known = np.full(segments.n_segments, NO_ROOM, np.int32)
    known[segments.owner_of[stays]] = np.unique(room_of[room_of >= 0])
    merged = segments.label_of
    areas = np.bincount(merged[to_find & (merged >= 0)], minlength=segments.n_segments)
    new = (known == NO_ROOM) & (areas >= least_cells(least_area_m2, grid.cell_area_m2))
    known[new] = first + np.arange(np.count_nonzero(new), dtype=np.int32)
    found: IntArray = np.append(known, np.int32(NO_ROOM))[merged]
    return np.where(to_find, found, np.int32(NO_ROOM))
