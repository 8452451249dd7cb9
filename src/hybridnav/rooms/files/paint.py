"""Outlines painted on a grid, in time and memory that no file can inflate."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from scipy import ndimage

from hybridnav._base.rows import in_runs, unique_rows
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.errors import RoomsError
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid
from hybridnav.rooms.files.entries import Outline, Read

_MOST_PAINTED = 4
"""Most times that outlines may cover the map."""
_LEAST_NAMELESS_M2 = 1.0
"""Least area of a space outside rooms; the default for rooms that are found."""
_MOST_CROSSINGS = 5_000_000
"""Most rows that all sides of a file cross together: a second and 400 MB. Rooms of a real floor
cross some ten thousand."""


def outlined(read: Read, outlines: Sequence[Outline], grid: OccupancyGrid) -> IntArray:
    """Return for each cell the room whose outline contains its centre, by the even-odd rule.

    In the order of the file, each outline takes the cells that it contains from those before.

    `read`: the file; `outlines`: some of its outlines, which may cross themselves and others.
    Returns int32 (rows, cols), -1 for no room. Raises `RoomsError` when the outlines have too many
    sides, or cover too much, for rooms.
    """
    n_crossings = sum(_n_crossings(ring) for outline in outlines for ring in outline.rings)
    if n_crossings > _MOST_CROSSINGS:
        raise RoomsError(
            f"{read.where}: the outlines cross {n_crossings:,} rows of the map in all, "
            f"at most {_MOST_CROSSINGS:,} are read"
        )
    room_of = np.full(grid.shape, NO_ROOM, dtype=np.int32)
    n_painted = 0
    # In the form with locations the first one keeps its cells.
    for outline in outlines if read.lines else reversed(outlines):
        cells = cells_inside(outline.rings, grid.shape)
        n_painted += len(cells)
        if n_painted > _MOST_PAINTED * room_of.size:
            raise RoomsError(
                f"{read.of(outline.room, outline.line)}: the outlines up to here cover the map "
                f"more than {_MOST_PAINTED} times: remove rooms that lie in others"
            )
        room_of.ravel()[cells] = outline.room
    return room_of


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
    is_free = grid.measured == CellClass.FREE
    free = np.where(is_free, label_of, np.int32(NO_ROOM))
    below = _LEAST_NAMELESS_M2 / grid.cell_area_m2
    filled = with_small_parts(free, is_free & (free == NO_ROOM), below, rooms=rooms)
    return np.where(is_free, filled, label_of)


def with_small_parts(
    label_of: IntArray,
    nameless: BoolArray,
    below_cells: float,
    *,
    rooms: Collection[int] | None = None,
    spared: BoolArray | None = None,
) -> IntArray:
    """Assign small connected sets of cells to the rooms with which they have the longest border.

    `nameless`: bool (rows, cols), the cells to assign, of no room in `label_of`; `below_cells`:
    number below which a set is small; `rooms`: only sets beside one of them are assigned, None for
    all; `spared`: cells whose sets are not. Result: the labels with these.
    """
    part_of, n_parts = ndimage.label(nameless)
    small = np.bincount(part_of.ravel(), minlength=n_parts + 1) < below_cells
    small[0] = False
    if spared is not None:
        small[part_of[spared]] = False
    inside = small[part_of]
    pairs = []
    for one, other in (
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:, 1:], np.s_[:, :-1]),
        (np.s_[:-1], np.s_[1:]),
        (np.s_[1:], np.s_[:-1]),
    ):
        beside = inside[one] & (label_of[other] != NO_ROOM)
        pairs.append(np.stack([part_of[one][beside], label_of[other][beside]], axis=1))
    found, _, _, length = unique_rows(np.concatenate(pairs))
    if rooms is not None:
        is_beside = np.isin(found[:, 0], found[np.isin(found[:, 1], list(rooms)), 0])
        found, length = found[is_beside], length[is_beside]
    room_of = np.full(n_parts + 1, NO_ROOM, dtype=np.int32)
    order = np.lexsort((-found[:, 1], length))  # the last one written counts
    room_of[found[order, 0]] = found[order, 1]
    return np.where(inside, room_of[part_of], label_of)


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
