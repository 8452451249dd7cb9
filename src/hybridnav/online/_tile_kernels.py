"""Kernels on the cells of one tile."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit


@guarded
@njit(cache=True, nogil=True)
def find_differing(tile, classes, low, box, found, count):
    """Add the cells of a tile whose class is another than one given; return their number.

    Parameters
    ----------
    tile
        Its places and classes, and its least row and column.
    classes
        uint8 (rows, cols), `CellClass` of the cells of a map now.
    low
        Row and column of its first cell.
    box
        Where to look: least row and column and the first ones beyond.
    found
        int32 (n, 4), receives row, column, place and class now, from `count` on.
    count
        Cells in it; it has space for all cells of a tile.
    """
    place, of_class, tile_row, tile_col = tile
    side = len(place)
    first, beyond = max(box[1], tile_col), min(box[3], tile_col + side)
    for row in range(max(box[0], tile_row), min(box[2], tile_row + side)):
        before = of_class[row - tile_row, first - tile_col : beyond - tile_col]
        now = classes[row - low[0], first - low[1] : beyond - low[1]]
        differs = np.uint8(0)
        for k in range(beyond - first):  # one instruction for many cells
            differs |= before[k] ^ now[k]
        if differs == 0:
            continue
        for k in range(beyond - first):
            if before[k] != now[k]:
                found[count, 0], found[count, 1] = row, first + k
                found[count, 2] = place[row - tile_row, first + k - tile_col]
                found[count, 3] = now[k]
                count += 1
    return count


@guarded
@njit(cache=True, nogil=True)
def put_cells(tile, low, cells, order):
    """Set the places and classes of cells of a tile, in place.

    Parameters
    ----------
    tile
        Its places and classes; changed.
    low
        Its least row and column.
    cells
        Rows, columns, places and classes in four arrays.
    order
        int64 (n,), which of them lie in the tile.
    """
    place, of_class = tile
    rows, cols, places, classes = cells
    for i in order:
        row, col = rows[i] - low[0], cols[i] - low[1]
        place[row, col], of_class[row, col] = places[i], classes[i]


@guarded
@njit(cache=True, nogil=True)
def moved_cells(before, after, moved, count):
    """Add the pairs of places of the cells of a tile whose place changed; return their number.

    Parameters
    ----------
    before, after
        int32 (rows, cols), the places of its cells.
    moved
        int64 (n,), receives old place and new place, both plus 1, 32 bits each, from `count` on.
    count
        Pairs in it; it has space for all cells.
    """
    for row in range(before.shape[0]):
        differs = np.int32(0)
        for col in range(before.shape[1]):  # one instruction for many cells
            differs |= before[row, col] ^ after[row, col]
        if differs == 0:
            continue
        for col in range(before.shape[1]):
            if before[row, col] != after[row, col]:
                moved[count] = (np.int64(before[row, col] + 1) << 32) + after[row, col] + 1
                count += 1
    return count
