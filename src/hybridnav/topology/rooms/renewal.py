"""Rooms found anew in a part of a map, beside rooms that stay."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.maps import NO_ROOM, CellClass
from hybridnav.topology.rooms.cutting import Ground, fine_segments
from hybridnav.topology.rooms.find import LEAST_LIKELY, SPECK_M2
from hybridnav.topology.rooms.growing import Likely, Small, contract
from hybridnav.topology.rooms.judging import Forest, JudgedSegments
from hybridnav.topology.rooms.merging import least_cells

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.topology.rooms.growing import Rule

LEFT_OUT = -2
"""Cells that are in no room, or in one that takes no part."""

_ODDS = 2.0
"""Odds of one room, times this for two segments of one room before, by this for those of two. Over
a log in cells of 0.1 m, 0.9 % of the cells change their number in an update, 5.7 % without it."""


class _Apart:
    """A rule by which segments merge as by another one, but no two rooms that stay.

    Parameters
    ----------
    rule
        The other rule.
    stays
        int64 (n,), segments that are rooms that stay.
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

    Parameters
    ----------
    segments
        The segments, before any of them merge.
    before
        int32 (rows, cols), the room of each cell before, -1 for none.
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
        lasting: FloatArray = probability * odds / (probability * odds + 1 - probability)
        return lasting


def renewed_rooms(
    grid: OccupancyGrid,
    outside: BoolArray,
    room_of: IntArray,
    before: IntArray,
    least_area_m2: float,
) -> IntArray:
    """Find the rooms of some free cells, with the rooms beside them as they are.

    The method is that of `find_rooms`, `judged`. Each room that stays is one segment from the
    start. Others may merge with it, so that it grows; two of them never merge.

    Parameters
    ----------
    grid
        The map, or a window of it; cells count as they were measured.
    outside
        bool (rows, cols), free cells outside of the building.
    room_of
        int32 (rows, cols): the room of free cells that stays, at least 0; -1 for free cells whose
        room is to be found; `LEFT_OUT` elsewhere.
    before
        int32 (rows, cols), the room of each cell before, -1 for none. What was one room tends to
        stay one, what was two rooms to stay two.
    least_area_m2
        As in `find_rooms`.

    Returns
    -------
    IntArray
        int32 (rows, cols). Where rooms were to be found: a room that stays, a new label above all
        of them, or -1 for segments that are too small. -1 elsewhere.
    """
    to_find = room_of == NO_ROOM
    ground = Ground.of(grid, outside)
    first = int(room_of.max(initial=NO_ROOM)) + 1
    label_of = np.where(room_of >= 0, room_of, np.int32(NO_ROOM))
    fine = fine_segments(ground)
    cut = (fine >= 0) & (to_find | (grid.measured != CellClass.FREE))  # rays of a scan
    label_of[cut] = first + fine[cut]
    if not cut.any():
        return np.full(room_of.shape, NO_ROOM, np.int32)
    segments = JudgedSegments(label_of, ground)
    # The numbers of rooms that stay lie below all others, and segments keep the order.
    stays = np.arange(len(np.unique(room_of[room_of >= 0])))
    specks = least_cells(min(SPECK_M2, least_area_m2), grid.cell_area_m2)
    least = least_cells(least_area_m2, grid.cell_area_m2)
    rules = Small(specks), Likely(_Lasting(segments, before).judge, LEAST_LIKELY), Small(least)
    contract(segments, [_Apart(rule, stays) for rule in rules])
    known = np.full(segments.n_segments, NO_ROOM, np.int32)
    known[segments.owner_of[stays]] = np.unique(room_of[room_of >= 0])
    merged = segments.label_of
    areas = np.bincount(merged[to_find & (merged >= 0)], minlength=segments.n_segments)
    new = (known == NO_ROOM) & (areas >= least)
    known[new] = first + np.arange(np.count_nonzero(new), dtype=np.int32)
    found: IntArray = np.append(known, np.int32(NO_ROOM))[merged]
    return np.where(to_find, found, np.int32(NO_ROOM))
