"""The rooms of a later map, cut as on the older one where no wall has come or gone."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hybridnav._base.rows import connected_parts
from hybridnav._base.trig import hypots
from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, RoomLabels
from hybridnav.rooms.cutting import spread
from hybridnav.rooms.kernels import cutting as _cell_kernels

_WIDER, _SLACK_M = 2.0, 0.3
"""An opening is another one if it is wider by this factor, and, against noise, this much more."""
_LEAST_M2 = 0.5
"""Area below which what an old room and a new one have in common is noise."""


class Side(NamedTuple):
    """One of two maps, as the other one sees it."""

    rooms: RoomLabels
    """Its rooms."""
    grid: OccupancyGrid
    """The map."""
    there: Callable[[FloatArray, IntArray], FloatArray]
    """Moves points to the other map, float64 (n, 2), with the old rooms that they are of, -1 for
    none."""

    @property
    def rooms_of(self) -> IntArray:
        """int32 (rows, cols), the room of each free cell, -1 elsewhere."""
        is_free = self.grid.measured == CellClass.FREE
        return np.where(is_free, self.rooms.label_of, np.int32(NO_ROOM))

    def at(self, labels: IntArray | ByteArray, points: FloatArray) -> IntArray:
        """Return the labels of some cells at points, -1 outside of the map."""
        row, col = self.grid.frame.cells_of(points).T
        inside = (row >= 0) & (row < labels.shape[0]) & (col >= 0) & (col < labels.shape[1])
        labels_there = np.full(len(points), NO_ROOM, np.int32)
        labels_there[inside] = labels[row[inside], col[inside]]
        return labels_there

    def is_known(self, points: FloatArray) -> BoolArray:
        """Return whether the map knows what is at points."""
        return np.isin(self.at(self.grid.measured, points), (CellClass.FREE, CellClass.OCCUPIED))

    def widths(self, piece_of: IntArray, n: int, other: Side) -> tuple[LongArray, FloatArray]:
        """Return how wide pieces touch in places that the other map knows too: `n` times one piece
        and another, ascending, and metres."""
        keys = []
        for row, col in ((1, 0), (0, 1)):
            low, high = piece_of[: -row or None, : -col or None], piece_of[row:, col:]
            at = np.argwhere((low != high) & (low >= 0) & (high >= 0))
            middles = self.grid.frame.points_of_grid(at + 0.5 + np.array([row, col]) / 2)
            at = at[other.is_known(self.there(middles, np.full(len(at), NO_ROOM, np.int32)))]
            ends = np.sort([low[tuple(at.T)], high[tuple(at.T)]], axis=0).astype(np.int64)
            keys.append(ends[0] * n + ends[1])
        touching, of = np.unique(np.concatenate(keys), return_inverse=True)
        both = [np.bincount(each, minlength=len(touching)) for each in np.split(of, [len(keys[0])])]
        return touching, hypots(*both) * self.grid.resolution_m


def recut_rooms(old: Side, new: Side) -> tuple[IntArray, LongArray]:
    """Join and split the rooms of a later map where only the cut differs from that of an older one.

    A piece is what a new room and an old one have in common. Two pieces of a new room part unless
    the opening between them is wider than it was: then a wall has gone. Two pieces of an old room
    join unless it is narrower: then a wall has come, and the new map is right.

    Returns the rooms, int32 (rows, cols), -1 for none: each has the number of the new room of which
    it is the largest part, or one above all; and int64 (n, 2), all pairs of a new room and a room
    with cells in common, those with the most first.
    """
    was, region = _old_rooms(old, new), new.rooms_of
    piece_of = region.copy()
    _cell_kernels.cross(piece_of, was + np.int32(1))
    is_in = piece_of >= 0
    area = np.bincount(piece_of[is_in])
    n = len(area)
    if not n:
        return new.rooms.label_of, np.empty((0, 2), np.int64)
    room_of, old_of = np.zeros((2, n), np.int64)
    room_of[piece_of[is_in]], old_of[piece_of[is_in]] = region[is_in], was[is_in]
    part_of = _joined(area, room_of, old_of, _openings(piece_of, old_of, old, new))

    # Each part has the number of the new room that it is the largest part of.
    shares = _shares(part_of, room_of, area)
    number = len(new.rooms.names) + np.arange(len(shares))
    mains = shares.argmax(axis=1)
    order = np.lexsort((-shares.max(axis=1), mains))
    first = order[np.diff(mains[order], prepend=NO_ROOM) != 0]
    number[first] = mains[first]
    label_of: IntArray = np.append(number[part_of], NO_ROOM).astype(np.int32)[piece_of]
    spread(label_of, new.rooms.label_of, label_of.size)
    # Cells in walls that no step leads to stay, if there still is such a room.
    still = ~np.isin(np.arange(len(new.rooms.names) + 1), np.setdiff1d(room_of, number))
    label_of = np.where((label_of < 0) & still[new.rooms.label_of], new.rooms.label_of, label_of)
    part, room = np.nonzero(shares)
    order = np.argsort(-shares[part, room], kind="stable")
    return label_of, np.stack([room, number[part]], axis=1)[order]


def _joined(
    area: LongArray,
    room_of: LongArray,
    old_of: LongArray,
    openings: tuple[LongArray, FloatArray, FloatArray],
) -> LongArray:
    """Return the part that each piece belongs to; see `_openings`."""
    pairs, width, before = openings
    n, (one, other), was = len(area), pairs.T, old_of[pairs]
    # What the old map does not know goes with the largest piece of its room.
    order = np.lexsort((-area, room_of))
    largest = order[np.searchsorted(room_of[order], room_of)]
    unknown = np.stack([np.arange(n), largest], axis=1)[old_of == NO_ROOM]
    in_one = room_of[one] == room_of[other]
    kept = np.concatenate([unknown, pairs[in_one & (width > _WIDER * before + _SLACK_M)]])
    part_of = connected_parts(kept, n)
    shares = _shares(part_of, old_of + 1, area * (old_of != NO_ROOM))
    most = np.where(2 * shares.max(axis=1) > shares.sum(axis=1), shares.argmax(axis=1) - 1, NO_ROOM)
    is_old = (was[:, 0] == was[:, 1]) & (was >= 0).all(axis=1) & ~in_one
    is_old &= (was == most[part_of[pairs]]).all(axis=1) & ~(before > _WIDER * width + _SLACK_M)
    return connected_parts(np.concatenate([kept, pairs[is_old]]), n)


def _shares(of: LongArray, room_of: LongArray, area: LongArray) -> FloatArray:
    """Return the area that each part has of each room, float64 (n_parts, n_rooms)."""
    shares = np.zeros((of.max() + 1, room_of.max() + 1))
    np.add.at(shares, (of, room_of), area)
    return shares


def _old_rooms(old: Side, new: Side) -> IntArray:
    """Return the old room of each free cell of the new rooms, -1 for none."""
    before, region = old.rooms_of, new.rooms_of
    points = new.grid.frame.points_of(np.argwhere(region >= 0))
    rooms = np.full(len(points), NO_ROOM, np.int32)
    for _ in range(2):  # as all move, then as the room does that is found there
        rooms = old.at(before, new.there(points, rooms))
    return _spread(rooms, region, _LEAST_M2 / new.grid.cell_area_m2)


def _openings(
    piece_of: IntArray, old_of: LongArray, old: Side, new: Side
) -> tuple[LongArray, FloatArray, FloatArray]:
    """Return pairs of pieces that touch on either map, int64 (n, 2), and how wide they do in
    metres, on the new map and on the old one."""
    n, region = len(old_of), old.rooms_of
    rooms = region[region >= 0]
    pieces = new.at(piece_of, old.there(old.grid.frame.points_of(np.argwhere(region >= 0)), rooms))
    pieces[np.append(old_of, NO_ROOM)[pieces] != rooms] = NO_ROOM
    before = _spread(pieces, region, _LEAST_M2 / old.grid.cell_area_m2)
    borders = new.widths(piece_of, n, old), old.widths(before, n, new)
    keys = np.union1d(borders[0][0], borders[1][0])
    widths = np.zeros((2, len(keys)))
    for row, (own, width) in zip(widths, borders, strict=True):
        row[np.searchsorted(keys, own)] = width
    return np.stack([keys // n, keys % n], axis=1), widths[0], widths[1]


def _spread(labels: IntArray, region: IntArray, least: float) -> IntArray:
    """Return the labels of the cells of some regions, -1 where none is in one.

    Parts of less than the `least` cells, without their rims, take the nearest label of their
    region.
    """
    label_of = np.full(region.shape, NO_ROOM, np.int32)
    label_of[region >= 0] = labels
    inner = region >= 0
    for low, high in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        same = (label_of[low] == label_of[high]) & (region[low] == region[high])
        inner[low] &= same | (region[high] < 0)
    label_of[_cell_kernels.large_parts(inner, least) < 0] = NO_ROOM
    spread(label_of, region, label_of.size)
    return label_of
