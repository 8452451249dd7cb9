"""Kernels on the cells of tiles.

`tiles` are the places and the classes of some tiles, two tuples of read-only arrays: a call for
many tiles takes as long as one for a single tile. They follow each other in the order of rows among
the tiles that a box of cells meets, from the one with the number `begin`; what lies beyond the last
one is passed over. A box has its least row and column and the first ones beyond it.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.ext.live.kernels.near import with_rows


@njit(cache=True, nogil=True)
def part_of(box, side, at):
    """Return the part of a box that one of its tiles holds, and the tile's least row and column."""
    n_cols = -(-box[3] // side) - box[1] // side
    row = (box[0] // side + at // n_cols) * side
    col = (box[1] // side + at % n_cols) * side
    low = max(box[0], row), max(box[1], col)
    return (low[0], low[1], min(box[2], row + side), min(box[3], col + side)), (row, col)


@njit(cache=True, nogil=True)
def copy_row(row, to):
    """Copy a row of cells."""
    for j in range(row.size):  # one instruction for many cells
        to[j] = row[j]


@guarded
@njit(cache=True, nogil=True)
def read_tiles(tiles, begin, box, planes):
    """Copy the places and the classes of the cells of a box, in tiles, into `planes`."""
    to_place, to_class = planes
    for k in range(len(tiles[0])):
        place, of_class = tiles[0][k], tiles[1][k]
        part, low = part_of(box, len(place), begin + k)
        for row in range(part[0], part[2]):
            here = slice(part[1] - low[1], part[3] - low[1])
            there = slice(part[1] - box[1], part[3] - box[1])
            copy_row(place[row - low[0], here], to_place[row - box[0], there])
            copy_row(of_class[row - low[0], here], to_class[row - box[0], there])


@guarded
@njit(cache=True, nogil=True)
def find_differing(tiles, begin, box, given, found, count):
    """Add the cells of tiles in a box whose class is another than one given.

    Parameters
    ----------
    tiles, begin, box
        See above.
    given
        uint8 (rows, cols), `CellClass` of the cells of a map now; row and column of its first cell.
    found
        int64 (n, 4), receives row, column, place and class now, from `count` on.
    count
        Cells in it.

    Returns
    -------
    int64 (m, 4)
        The cells, a longer array where they need it.
    int
        How many there are.
    """
    classes, first = given
    for k in range(len(tiles[0])):
        place, of_class = tiles[0][k], tiles[1][k]
        part, low = part_of(box, len(place), begin + k)
        width = part[3] - part[1]
        for row in range(part[0], part[2]):
            before = of_class[row - low[0], part[1] - low[1] : part[3] - low[1]]
            now = classes[row - first[0], part[1] - first[1] : part[3] - first[1]]
            if not differs_in(before, now, np.uint8(0)):
                continue
            found = with_rows(found, count, width)
            for j in range(width):
                if before[j] != now[j]:
                    found[count, 0], found[count, 1] = row, part[1] + j
                    found[count, 2] = place[row - low[0], part[1] + j - low[1]]
                    found[count, 3] = now[j]
                    count += 1
    return found, count


@njit(cache=True, nogil=True)
def differs_in(some, others, nothing):
    """Return whether two rows differ; `nothing` is 0 of their type."""
    differs = nothing
    for j in range(some.size):  # one instruction for many cells
        differs |= some[j] ^ others[j]
    return differs != nothing


@guarded
@njit(cache=True, nogil=True)
def tiles_differ(places, begin, box, plane):
    """Return the numbers of tiles in which the places in a box are others than those given.

    The result is int64 (n,); `places` is the first part of `tiles`, `plane` has the places of the
    box.
    """
    differing, count = np.empty(len(places), np.int64), 0
    for k in range(len(places)):
        part, low = part_of(box, len(places[k]), begin + k)
        for row in range(part[0], part[2]):
            here = places[k][row - low[0], part[1] - low[1] : part[3] - low[1]]
            now = plane[row - box[0], part[1] - box[1] : part[3] - box[1]]
            if differs_in(here, now, np.int32(0)):
                differing[count] = begin + k
                count += 1
                break
    return differing[:count].copy()


@guarded
@njit(cache=True, nogil=True)
def put_cells(tile, key, box, planes):
    """Set the cells of a tile that lie in a box.

    Parameters
    ----------
    tile
        Its places and classes; changed.
    key
        Its row and column among tiles.
    box
        See above.
    planes
        Places and classes of the box.
    """
    place, of_class = tile
    row, col = key[0] * len(place), key[1] * len(place)
    first, beyond = max(box[1], col), min(box[3], col + len(place))
    here, there = slice(first - col, beyond - col), slice(first - box[1], beyond - box[1])
    for i in range(max(box[0], row), min(box[2], row + len(place))):
        copy_row(planes[0][i - box[0], there], place[i - row, here])
        copy_row(planes[1][i - box[0], there], of_class[i - row, here])


@guarded
@njit(cache=True, nogil=True)
def moved_cells(before, after, runs, count):
    """Add the pairs of places of the cells of tiles whose place changed.

    Parameters
    ----------
    before, after
        The places of the tiles, two tuples of int32 (rows, cols).
    runs
        int64 (n, 2), receives old place and new place, both plus 1, 32 bits each, and how many
        cells after each other have them, from `count` on.
    count
        Rows in it.

    Returns
    -------
    int64 (m, 2)
        The runs, a longer array where they need it.
    int
        How many there are.
    """
    for k in range(len(before)):
        old, new = before[k], after[k]
        last = np.int64(-1)
        for row in range(old.shape[0]):
            if not differs_in(old[row], new[row], np.int32(0)):
                continue
            runs = with_rows(runs, count, old.shape[1])
            for col in range(old.shape[1]):
                if old[row, col] == new[row, col]:
                    continue
                pair = (np.int64(old[row, col] + 1) << 32) + new[row, col] + 1
                if pair != last:
                    runs[count, 0], runs[count, 1] = pair, 0
                    last = pair
                    count += 1
                runs[count - 1, 1] += 1
    return runs, count


@guarded
@njit(cache=True, nogil=True)
def sums_of(runs, count):
    """Return the runs of `moved_cells` by pairs of places, int64 (n, 3): both, and their cells."""
    sums, n_sums = np.empty((count, 3), np.int64), 0
    last = np.int64(-1)
    for at in np.argsort(runs[:count, 0]):
        pair = runs[at, 0]
        if pair != last:
            sums[n_sums, 0], sums[n_sums, 1] = (pair >> 32) - 1, (pair & 0xFFFFFFFF) - 1
            sums[n_sums, 2] = 0
            last = pair
            n_sums += 1
        sums[n_sums - 1, 2] += runs[at, 1]
    return sums[:n_sums].copy()
