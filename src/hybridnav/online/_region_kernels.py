"""Kernels on the cells of places that regions are made of."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit


@guarded
@njit(cache=True, nogil=True)
def touched_cells(before, after, touched, count):
    """Add the pairs of places of the cells of a tile that changed; return their number.

    Parameters
    ----------
    before, after
        int32 and uint8 (rows, cols), the places and classes of its cells. A cell changes if one of
        the two does: a place may keep its number while all its cells change class.
    touched
        int64 (n,), receives old place and new place, both plus 1, 32 bits each, from `count` on.
    count
        Pairs in it; it has space for all cells.
    """
    old, old_class = before
    new, new_class = after
    for row in range(old.shape[0]):
        differs = np.int32(0)
        for col in range(old.shape[1]):  # one instruction for many cells
            differs |= (old[row, col] ^ new[row, col]) | (old_class[row, col] ^ new_class[row, col])
        if differs == 0:
            continue
        for col in range(old.shape[1]):
            if old[row, col] != new[row, col] or old_class[row, col] != new_class[row, col]:
                touched[count] = (np.int64(old[row, col] + 1) << 32) + new[row, col] + 1
                count += 1
    return count


@guarded
@njit(cache=True, nogil=True)
def cracks_of(place, of_class, is_one):
    """Return the pairs of places of all cracks between some places and those of their class beside.

    Parameters
    ----------
    place, of_class
        int32 and uint8 (rows, cols), a window that has all cells beside the places.
    is_one
        Integers (rows, cols), above 0 for the cells of the places.

    Returns
    -------
    int64 (n,)
        The lesser and the greater number of each crack, 32 bits each, with repeats.
    """
    rows, cols = place.shape
    found, count = np.empty(256, np.int64), 0
    for row in range(rows):
        for col in range(cols):
            one = place[row, col]
            for north in range(2):
                to_row, to_col = row + north, col + 1 - north
                if to_row == rows or to_col == cols:
                    continue
                other = place[to_row, to_col]
                if one == other or of_class[row, col] != of_class[to_row, to_col]:
                    continue
                if one < 0 or other < 0 or is_one[row, col] + is_one[to_row, to_col] == 0:
                    continue
                if count == len(found):
                    longer = np.empty(2 * count, np.int64)
                    longer[:count] = found
                    found = longer
                found[count] = (np.int64(min(one, other)) << 32) + max(one, other)
                count += 1
    return found[:count].copy()
