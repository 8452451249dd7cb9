"""Kernels that merge whole places; see `cells` for windows and tables."""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.ext.live.kernels.cells import join_each_other, join_nearest
from hybridnav.ext.live.kernels.near import beside_of, is_within, look_again, step_to, with_rows

_NO, _YES, _BEYOND = 0, 1, 2
_FEW_CELLS = 256
"""Cells of a box that are looked at sooner than all places near."""


@guarded
@njit(cache=True, nogil=True)
def merge_pairs(window, low, table, pairs, limit, first):
    """Merge places beside each other until none of them may merge, under the linkage "radius".

    Places of different parts never merge; those of no part, -1, merge with all.

    Parameters
    ----------
    window
        Places and classes; the places change.
    low, table
        Rows change.
    pairs
        int64 (n, 2), places of one class beside each other; a place twice stands for all its pairs.
    limit
        The squared distance to a surviving cell stays below it.
    first
        The least number that the version before does not have: older numbers stay, then those of
        the larger places.

    Returns
    -------
    int64 (m, 2)
        The pairs that cannot be decided on in the window.
    """
    numbers, area, box = table.numbers, table.area, table.box
    place = window[0]
    stack, size = with_rows(pairs, len(pairs), 64), len(pairs)
    beyond, n_beyond = np.empty((8, 2), np.int64), 0
    while size > 0:
        size -= 1
        one, other = stack[size]
        i, j = np.searchsorted(numbers, one), np.searchsorted(numbers, other)
        if area[i] == 0 or area[j] == 0:
            continue
        if one != other:
            may, survives = may_merge(place, low, table, (i, j), limit)
            if may == _NO:
                continue
            goes = j if (one < first, area[i]) >= (other < first, area[j]) else i
            stays = i + j - goes
            if may == _YES and is_inside(box[goes], low, place.shape, 0):
                merge(place, low, table, (stays, goes), survives)
                one = other = numbers[stays]
                i = stays
            if one != other:
                beyond = with_rows(beyond, n_beyond, 1)
                beyond[n_beyond, 0], beyond[n_beyond, 1] = one, other
                n_beyond += 1
                continue
        if is_inside(box[i], low, place.shape, 1):
            stack, size = add_pairs(window, low, (one, box[i]), stack, size)
        else:
            beyond = with_rows(beyond, n_beyond, 1)
            beyond[n_beyond, 0] = beyond[n_beyond, 1] = one
            n_beyond += 1
    return beyond[:n_beyond].copy()


@guarded
@njit(cache=True, nogil=True)
def absorbing(window, low, table, lost, limit):
    """Return the pairs of places that only lost cells and ones that may take them in now.

    A smaller place merges with no more than before, but for places whose surviving cells reach all
    that is left of it. There are few of these: the table is searched for them, not the cells beside
    the place.

    Parameters
    ----------
    window, low, table
        See `merge_pairs`.
    lost
        int64 (n,), places in the window.
    limit
        The squared distance to a surviving cell stays below it.

    Returns
    -------
    int64 (m, 2)
        Pairs, as `merge_pairs` takes them.
    """
    numbers, area, survivor, box = table.numbers, table.area, table.survivor, table.box
    place, of_class = window
    pairs, count = np.empty((16, 2), np.int64), 0
    around = np.empty(4, np.int64)

    # A surviving cell farther out reaches no cell here; an infinite limit needs an integer too.
    reach = np.int64(min(np.sqrt(limit) + 1, 2.0**31))
    rows, cols = place.shape
    near, n_near = np.empty((numbers.size, 3), np.int32), 0
    for i in range(numbers.size):
        row, col = survivor[i, 0] - low[0], survivor[i, 1] - low[1]
        if -reach < row < rows + reach and -reach < col < cols + reach and area[i] > 0:
            near[n_near, 0], near[n_near, 1], near[n_near, 2] = row, col, i
            n_near += 1
    for number in lost:
        j = np.searchsorted(numbers, number)
        if area[j] == 0:
            continue
        for k in range(4):
            around[k] = box[j, k] - low[k & 1]
        # A pair of one place stands for all its pairs: `merge_pairs` looks at the few cells.
        if (around[2] - around[0]) * (around[3] - around[1]) < _FEW_CELLS:
            pairs = with_rows(pairs, count, 1)
            pairs[count, 0] = pairs[count, 1] = number
            count += 1
            continue
        of_place = of_class[survivor[j, 0] - low[0], survivor[j, 1] - low[1]]
        # A surviving cell that may reach the whole place is within reach of all sides of its box.
        low_row, high_row = around[2] - 1 - reach, around[0] + reach
        low_col, high_col = around[3] - 1 - reach, around[1] + reach
        for n in range(n_near):
            row, col, i = near[n]
            if row < low_row or row > high_row or col < low_col or col > high_col or i == j:
                continue
            # Beyond the window `of_class` has no entry: `are_beside` compares the classes then.
            if 0 <= row < rows and 0 <= col < cols and of_class[row, col] != of_place:
                continue
            # A place has a cell at each side of its box: a side too far away excludes it. A box
            # near enough up to its farthest corner needs no look at the cells.
            far_row = max(abs(row - around[0]), abs(around[2] - 1 - row))
            far_col = max(abs(col - around[1]), abs(around[3] - 1 - col))
            if max(far_row, far_col) ** 2 >= limit or not are_beside(window, low, table, (i, j)):
                continue
            is_near = far_row * far_row + far_col * far_col < limit
            if is_near or is_within(place, number, around, (row, col), limit):
                pairs = with_rows(pairs, count, 1)
                pairs[count, 0], pairs[count, 1] = number, numbers[i]
                count += 1
    return pairs[:count].copy()


@njit(cache=True, nogil=True)
def are_beside(window, low, table, rows):
    """Return whether a place is beside another one of its class, which lies in the window."""
    place, of_class = window
    numbers, box = table.numbers, table.box
    i, j = rows
    one, other = numbers[i], numbers[j]
    n_rows, n_cols = place.shape
    flat, classes = place.ravel(), of_class.ravel()
    # Cells of one beside the other lie in both boxes, if each is a cell wider.
    low_row, low_col = max(box[i, 0], box[j, 0] - 1), max(box[i, 1], box[j, 1] - 1)
    high_row, high_col = min(box[i, 2], box[j, 2] + 1), min(box[i, 3], box[j, 3] + 1)
    for row in range(low_row - low[0], high_row - low[0]):
        for col in range(low_col - low[1], high_col - low[1]):
            if place[row, col] != one:
                continue
            for side in range(4):
                beside = beside_of(row * n_cols + col, side, n_rows, n_cols)
                if beside >= 0 and flat[beside] == other:
                    return of_class[row, col] == classes[beside]
    return False


@njit(cache=True, nogil=True)
def is_inside(box, low, shape, margin):
    """Return whether a box lies in a window that is so many cells wider on each side."""
    return (
        box[0] - low[0] >= margin
        and box[1] - low[1] >= margin
        and box[2] - low[0] + margin <= shape[0]
        and box[3] - low[1] + margin <= shape[1]
    )


@njit(cache=True, nogil=True)
def may_merge(place, low, table, rows, limit):
    """Return whether two places may merge, and the row of the one whose cell survives."""
    area, survivor, part = table.area, table.survivor, table.part
    i, j = rows
    if part[i] != part[j] and min(part[i], part[j]) >= 0:
        return _NO, i
    apart_rows = np.int64(survivor[i, 0]) - survivor[j, 0]
    apart_cols = np.int64(survivor[i, 1]) - survivor[j, 1]
    if apart_rows * apart_rows + apart_cols * apart_cols >= limit:
        return _NO, i
    larger, smaller = (i, j) if area[i] >= area[j] else (j, i)
    first = reaches(place, low, table, (larger, smaller), limit)
    if first == _YES:
        return _YES, larger
    second = reaches(place, low, table, (smaller, larger), limit)
    if second == _YES and first == _NO:
        return _YES, smaller
    return max(first, second) if first == _NO else _BEYOND, i


@njit(cache=True, nogil=True)
def reaches(place, low, table, rows, limit):
    """Return whether all cells of a second place are near enough to the surviving one of a first.

    A place has a cell at each side of its box, which decides on most of them.
    """
    numbers, survivor, box = table.numbers, table.survivor, table.box
    i, j = rows
    row, col = np.int64(survivor[i, 0]), np.int64(survivor[i, 1])
    of_rows = max(abs(row - box[j, 0]), abs(box[j, 2] - 1 - row))
    of_cols = max(abs(col - box[j, 1]), abs(box[j, 3] - 1 - col))
    if max(of_rows, of_cols) ** 2 >= limit:
        return _NO
    if of_rows * of_rows + of_cols * of_cols < limit:
        return _YES
    if not is_inside(box[j], low, place.shape, 0):
        return _BEYOND
    around = np.empty(4, np.int64)
    for k in range(4):
        around[k] = box[j, k] - low[k & 1]
    found = is_within(place, numbers[j], around, (row - low[0], col - low[1]), limit)
    return _YES if found else _NO


@njit(cache=True, nogil=True)
def merge(place, low, table, rows, survives):
    """Put the cells of a place, which lies in the window, into another one."""
    numbers, area, survivor, box = table.numbers, table.area, table.survivor, table.box
    stays, goes = rows
    number, gone = numbers[stays], numbers[goes]
    for row in range(box[goes, 0] - low[0], box[goes, 2] - low[0]):
        for col in range(box[goes, 1] - low[1], box[goes, 3] - low[1]):
            if place[row, col] == gone:
                place[row, col] = number
    area[stays] += area[goes]
    area[goes] = 0
    table.part[stays] = max(table.part[stays], table.part[goes])
    survivor[stays, 0], survivor[stays, 1] = survivor[survives, 0], survivor[survives, 1]
    for k in range(2):
        box[stays, k] = min(box[stays, k], box[goes, k])
        box[stays, k + 2] = max(box[stays, k + 2], box[goes, k + 2])


@njit(cache=True, nogil=True)
def add_pairs(window, low, of_place, pairs, count):
    """Add the pairs of a place, given by number and box, and the places of its class beside it."""
    place, of_class = window
    number, box = of_place
    cols = place.shape[1]
    flat, classes = place.ravel(), of_class.ravel()
    first = count
    for row in range(box[0] - low[0], box[2] - low[0]):
        for col in range(box[1] - low[1], box[3] - low[1]):
            cell = row * cols + col
            if flat[cell] != number:
                continue
            for side in range(4):
                beside = cell + step_to(side, cols)
                other = flat[beside]
                if other < 0 or other == number or classes[beside] != classes[cell]:
                    continue
                known = False
                for k in range(count - 1, first - 1, -1):
                    if pairs[k, 1] == other:
                        known = True
                        break
                if not known:
                    pairs = with_rows(pairs, count, 1)
                    pairs[count, 0], pairs[count, 1] = number, other
                    count += 1
    return pairs, count


@guarded
@njit(cache=True, nogil=True)
def pairs_at(window, cells):
    """Return the pairs of the places of cells and those of their class beside, int64 (n, 2).

    `cells` are flat, none at a side of the window.
    """
    place, of_class = window
    cols = place.shape[1]
    flat, classes = place.ravel(), of_class.ravel()
    pairs, count = np.empty((64, 2), np.int64), 0
    for cell in cells:
        for side in range(4):
            beside = cell + step_to(side, cols)
            one, other = flat[cell], flat[beside]
            if one < 0 or other < 0 or one == other or classes[cell] != classes[beside]:
                continue
            known = False
            for k in range(count - 1, max(count - 9, -1), -1):
                known |= pairs[k, 0] == one and pairs[k, 1] == other
            if not known:
                pairs = with_rows(pairs, count, 1)
                pairs[count, 0], pairs[count, 1] = one, other
                count += 1
    return pairs[:count].copy()


# Kernels that move changed cells, many steps in one call; see `cells` for windows and
# tables.
#
# A call from Python takes longer than most of the steps do.


@guarded
@njit(cache=True, nogil=True)
def let_join(window, low, table, places, waiting, limit):
    """Bring places that lost cells up to date, and let cells without a place join others.

    Parameters
    ----------
    window, low, table
        See above; changed.
    places
        int64 (n,), places to look at again; two integers, the first number of more of them, and
        the one beyond the last.
    waiting
        int64 (m,), flat cells that are vertices and have no place.
    limit
        The squared distance to a surviving cell stays below it.

    Returns
    -------
    int64 (o,)
        All cells that had no place.
    int64 (p,)
        The places that have another surviving cell.
    int64 (q, 4)
        The boxes, in the window, of the places with numbers from that one on that the cells which
        no place took in have now; they are not in the table yet.
    """
    altered, first, beyond = places
    again = with_range(altered, first, beyond)
    lost, moved = look_again(window[0], low, table, again, limit)
    cells = np.concatenate((waiting, lost))
    join_nearest(window, low, table, cells, limit)
    return cells, moved, join_each_other(window, cells, beyond)


class AlteredPlaces(NamedTuple):
    """Places that `merge_after` looks at."""

    made: np.ndarray
    """int64 (n,), new places that `let_join` made, to be brought up to date."""
    moved: np.ndarray
    """int64 (k,), those that have another surviving cell."""
    lost: np.ndarray
    """int64 (m,), those that only lost cells."""
    first: int
    """The first number that was new in this window."""
    beyond: int
    """The number beyond the last one."""
    oldest: int
    """The least number that the version before does not have."""


@guarded
@njit(cache=True, nogil=True)
def merge_after(window, low, table, places, cells, limit):
    """Merge the places that may merge after cells moved.

    Parameters
    ----------
    window, low, table
        See above; changed.
    places
        `AlteredPlaces`.
    cells
        int64 (o,), the flat cells that joined places.
    limit
        The squared distance to a surviving cell stays below it.

    Returns
    -------
    int64 (p, 2)
        The pairs that cannot be decided on in the window.
    """
    lost = places.lost
    look_again(window[0], low, table, places.made, limit)
    again = with_range(places.moved, places.first, places.beyond)
    pairs = np.empty((again.size, 2), np.int64)
    pairs[:, 0] = pairs[:, 1] = again
    if lost.size > 0:  # the whole table is searched
        pairs = np.concatenate((pairs, absorbing(window, low, table, lost, limit)))
    pairs = np.concatenate((pairs, pairs_at(window, cells)))
    return merge_pairs(window, low, table, pairs, limit, places.oldest)


@njit(cache=True, nogil=True)
def with_range(numbers, first, beyond):
    """Return numbers, and after them all from a first one to the one before another."""
    longer = np.empty(numbers.size + beyond - first, np.int64)
    longer[: numbers.size] = numbers
    for k in range(beyond - first):
        longer[numbers.size + k] = first + k
    return longer
