"""Outlines painted on a grid, in time and memory that no file can inflate."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from scipy import ndimage

from hybridnav._base.rows import in_runs, unique_rows
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.errors import RoomsError
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid
from hybridnav.rooms.files.entries import NAMELESS, Missed, Outline, Read, Runs

_MOST_PAINTED = 4
"""Most times that outlines may cover the map."""
_LEAST_NAMELESS_M2 = 1.0
"""Least area of a space outside rooms; the default for rooms that are found."""
_MOST_CROSSINGS = 5_000_000
"""Most rows that all sides of a file cross together: a second and 400 MB. Rooms of a real floor
cross some ten thousand."""


def painted(read: Read, missed: Missed, grid: OccupancyGrid) -> IntArray:
    """Return for each cell the room whose outline contains its centre, by the even-odd rule.

    Outlines that were written with their cells come first, corrected by the cells that they miss,
    then the outlines that a person has drawn or changed, in the order of the file: each takes the
    cells that it contains from those before.

    `read`: the outlines, which may cross themselves and others; `missed`: the cells that outlines
    miss; an outline whose fingerprint it lacks was drawn by hand. Returns int32 (rows, cols), -1
    for no room. Raises `RoomsError` when the outlines have too many sides, or cover too much, for
    rooms.
    """
    written, by_hand = outlined(read, missed.runs_of, grid)
    outlines = [each for each in read.outlines if each.fingerprint in missed.runs_of]
    if missed.by_rule and outlines:
        written[apart(grid)] = NO_ROOM
        _give(written, outlines, missed.runs_of)
        written = by_rule(np.where(by_hand == NO_ROOM, written, np.int32(NO_ROOM)), grid)
    _give(written, outlines, missed.runs_of)
    return np.where(by_hand == NO_ROOM, written, by_hand)


def outlined(
    read: Read, written: Collection[int], grid: OccupancyGrid
) -> tuple[IntArray, IntArray]:
    """Paint the outlines alone: those that were written, and those drawn by hand.

    `read`, `grid`: see `painted`; `written`: fingerprints of outlines that were written. Returns
    int32 (rows, cols) each, -1 for no room. Raises `RoomsError` as by `painted`.
    """
    n_crossings = sum(_n_crossings(ring) for outline in read.outlines for ring in outline.rings)
    if n_crossings > _MOST_CROSSINGS:
        raise RoomsError(
            f"{read.where}: the outlines cross {n_crossings:,} rows of the map in all, "
            f"at most {_MOST_CROSSINGS:,} are read"
        )
    found = [np.full(grid.shape, NO_ROOM, dtype=np.int32) for _ in range(2)]
    n_painted = 0
    # In the form with locations the first one keeps its cells.
    for outline in read.outlines if read.lines else reversed(read.outlines):
        cells = cells_inside(outline.rings, grid.shape)
        n_painted += len(cells)
        if n_painted > _MOST_PAINTED * found[0].size:
            raise RoomsError(
                f"{read.of(outline.room, outline.line)}: the outlines up to here cover the map "
                f"more than {_MOST_PAINTED} times: remove rooms that lie in others"
            )
        found[outline.fingerprint not in written].ravel()[cells] = outline.room
    return found[0], found[1]


def apart(grid: OccupancyGrid) -> BoolArray:
    """Return the free cells that are below a square metre in one piece, bool (rows, cols).

    Rooms that are found have none of them. An outline of few corners runs across many, and doors
    would lead from the part inside into the part outside.
    """
    part_of, _ = ndimage.label(grid.measured == CellClass.FREE)
    side_m = grid.resolution_m
    small = np.bincount(part_of.ravel()) * (side_m * side_m) < _LEAST_NAMELESS_M2
    small[0] = False
    return small[part_of]


def by_rule(label_of: IntArray, grid: OccupancyGrid) -> IntArray:
    """Return labels of which those of free cells are kept, and reach into walls as rooms that are
    found do."""
    # Loads scipy and numba.
    from hybridnav.rooms.find import reaching  # noqa: PLC0415

    is_free = grid.measured == CellClass.FREE
    free = np.where(is_free, label_of, np.int32(NO_ROOM))
    return np.where(is_free, label_of, reaching(free, grid))


def _give(label_of: IntArray, written: Sequence[Outline], runs_of: Mapping[int, Runs]) -> None:
    """Give the cells that outlines miss to their rooms, and take away those of no room."""
    flat = label_of.ravel()
    if NAMELESS in runs_of:
        flat[in_runs(*runs_of[NAMELESS])] = NO_ROOM
    for outline in written:
        flat[in_runs(*runs_of[outline.fingerprint])] = outline.room


def without_slivers(label_of: IntArray, grid: OccupancyGrid, rooms: Collection[int]) -> IntArray:
    """Assign the slivers between outlines to the rooms beside them.

    Outlines have few corners where the rim of the free cells has many, and people leave strips
    between rooms: each would be nameless space with its own doors.

    `label_of`: int32 (rows, cols), -1 for no room; `rooms`: rooms that a person has drawn: only
    slivers beside one of them are assigned. Result: labels in which connected cells of no room,
    measured as free and together below one square metre, have the room with which they have the
    longest border.
    """
    if not rooms:
        return label_of
    nameless = (grid.measured == CellClass.FREE) & (label_of == NO_ROOM)
    part_of, n_parts = ndimage.label(nameless)
    cells = np.bincount(part_of.ravel(), minlength=n_parts + 1)
    small = cells * grid.cell_area_m2 < _LEAST_NAMELESS_M2
    small[0] = False
    taken = np.where((grid.measured == CellClass.FREE), label_of, np.int32(NO_ROOM))
    pairs = []
    for one, other in (
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:, 1:], np.s_[:, :-1]),
        (np.s_[:-1], np.s_[1:]),
        (np.s_[1:], np.s_[:-1]),
    ):
        beside = small[part_of[one]] & (taken[other] != NO_ROOM)
        pairs.append(np.stack([part_of[one][beside], taken[other][beside]], axis=1))
    found, _, _, length = unique_rows(np.concatenate(pairs))
    is_beside = np.isin(found[:, 0], found[np.isin(found[:, 1], list(rooms)), 0])
    found, length = found[is_beside], length[is_beside]
    room_of = np.full(n_parts + 1, NO_ROOM, dtype=np.int32)
    order = np.lexsort((-found[:, 1], length))  # the last one written counts
    room_of[found[order, 0]] = found[order, 1]
    return np.where(nameless, room_of[part_of], label_of)


def cells_inside(rings: Sequence[FloatArray], shape: tuple[int, int]) -> LongArray:
    """Return the cells whose centres lie inside rings by the even-odd rule, a scan line for each
    row.

    `rings`: float64 (n, 2) each, in cells, x along columns and y along rows; closed by themselves;
    `shape`: rows and columns of the grid. Returns int64 (n,), flat cells, ascending. A centre on a
    side counts as inside on the left and lower sides alone, so that rooms with a common side share
    no cell.
    """
    crossed = [_crossings(ring) for ring in rings]
    row = np.concatenate([rows for rows, _ in crossed])
    # The first cell whose centre lies on a crossing or to the right of it.
    col = np.concatenate([np.ceil(x - 0.5) for _, x in crossed]).clip(0, shape[1])
    inside = (row >= 0) & (row < shape[0])
    order = np.lexsort((col[inside], row[inside]))
    row, col = row[inside][order], col[inside][order].astype(np.int64)
    # Closed rings cross every line an even number of times.
    return in_runs(row[::2] * shape[1] + col[::2], col[1::2] - col[::2])


def _rows_crossed(ring: FloatArray) -> tuple[LongArray, LongArray]:
    """Return the first row whose centre line each side crosses, and the one after the last."""
    rows = np.ceil(ring[:, 1] - 0.5).astype(np.int64)
    other = np.roll(rows, -1)
    return np.minimum(rows, other), np.maximum(rows, other)


def _n_crossings(ring: FloatArray) -> int:
    first, last = _rows_crossed(ring)
    return int((last - first).sum())


def _crossings(ring: FloatArray) -> tuple[LongArray, FloatArray]:
    """Return the row of each crossing of a ring with a centre line of rows, and its x in cells."""
    first, last = _rows_crossed(ring)
    counts = last - first
    side = np.repeat(np.arange(len(ring)), counts)
    row = in_runs(first, counts)
    (x, y), (to_x, to_y) = ring[side].T, np.roll(ring, -1, axis=0)[side].T
    return row, x + (row + 0.5 - y) / (to_y - y) * (to_x - x)
