"""Kernels of closed cells: whether a segment of free space meets them, and their new corners.

Points are x = column, y = row in grid units, as for the search of intervals: the endpoints of a
query are rounded so that every side test is exact (see `turn_of`). Floats choose the candidate
cells, with a margin; side tests alone decide whether a segment meets a cell.
"""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.search.exact import turn_of

_MARGIN = 1e-6
"""Rounding of the point where a segment meets a row of cells, in cells."""


@guarded
@njit(cache=True, nogil=True)
def closure_of(flat, polygon_at):
    """Sort closed cells that were free into rows.

    Parameters
    ----------
    flat
        int64 (m,), flat cells, sorted, each once.
    polygon_at
        int32 (rows, cols), below 0 where no cell is free.

    Returns
    -------
    tuple
        int64 (4,) first and last row, first and last column of the closed cells; int64 offsets of
        the cells of each of these rows; int64 their columns.
    """
    n_cols = polygon_at.shape[1]
    cols = np.empty(len(flat), np.int64)
    rows = np.empty(len(flat), np.int64)
    box = np.array([1, 0, n_cols, -1])
    n = 0
    for cell in flat:
        row, col = cell // n_cols, cell % n_cols
        if polygon_at[row, col] >= 0:
            rows[n], cols[n] = row, col
            box[2], box[3] = min(box[2], col), max(box[3], col)
            n += 1
    if n == 0:
        return box, np.zeros(1, np.int64), cols[:0].copy()
    box[0], box[1] = rows[0], rows[n - 1]
    starts = np.zeros(box[1] - box[0] + 2, np.int64)
    for row in rows[:n]:
        starts[row - box[0] + 1] += 1
    return box, np.cumsum(starts), cols[:n].copy()


@njit(cache=True, nogil=True)
def _first_from(closure, row, col):
    """Return the range of the closed cells of a row that lie in a column or behind it."""
    box, starts, cols = closure
    low, high = starts[row - box[0]], starts[row - box[0] + 1]
    end = high
    while low < high:
        middle = (low + high) >> 1
        if cols[middle] < col:
            low = middle + 1
        else:
            high = middle
    return low, end


@njit(cache=True, nogil=True)
def is_closed(closure, row, col):
    """Return whether a cell was free and is closed."""
    box, _, cols = closure
    if row < box[0] or row > box[1] or col < box[2] or col > box[3]:
        return False
    at, end = _first_from(closure, row, col)
    return at < end and cols[at] == col


@njit(cache=True, nogil=True)
def is_shut(closure, polygon_at, row, col):
    """Return whether a cell is closed or blocked; cells outside the map are blocked."""
    if not (0 <= row < polygon_at.shape[0] and 0 <= col < polygon_at.shape[1]):
        return True
    return polygon_at[row, col] < 0 or is_closed(closure, row, col)


@njit(cache=True, nogil=True)
def is_at_closed(closure, x, y):
    """Return whether a lattice point is a corner of a closed cell."""
    box = closure[0]
    if y < box[0] or y > box[1] + 1 or x < box[2] or x > box[3] + 1:
        return False
    row, col = int(y), int(x)
    return (
        is_closed(closure, row, col)
        or is_closed(closure, row, col - 1)
        or is_closed(closure, row - 1, col)
        or is_closed(closure, row - 1, col - 1)
    )


@njit(cache=True, nogil=True)
def is_at_shut(closure, polygon_at, x, y):
    """Return whether a point is a corner of a cell that is not free."""
    if x != math.floor(x) or y != math.floor(y):
        return False
    row, col = int(y), int(x)
    return (
        is_shut(closure, polygon_at, row, col)
        or is_shut(closure, polygon_at, row, col - 1)
        or is_shut(closure, polygon_at, row - 1, col)
        or is_shut(closure, polygon_at, row - 1, col - 1)
    )


@njit(cache=True, nogil=True)
def _meets_cell(closure, polygon_at, segment, row, col):
    """Return whether a cell that is not free makes a segment illegal.

    The segment passes its inside, or between it and another such cell, along their common side or
    through the corner where they meet.
    """
    ax, ay, bx, by = segment
    if min(ax, bx) > col + 1 or max(ax, bx) < col or min(ay, by) > row + 1 or max(ay, by) < row:
        return False
    least = most = 0
    for k in range(4):
        x, y = col + (k & 1), row + (k >> 1)
        hand = turn_of(ax, ay, bx, by, float(x), float(y))
        least, most = min(least, hand), max(most, hand)
        if hand == 0 and (x - ax) * (x - bx) + (y - ay) * (y - by) < 0.0:
            # Through a corner of the cell: the cell beyond that corner must be free.
            if is_shut(closure, polygon_at, row + 2 * (k >> 1) - 1, col + 2 * (k & 1) - 1):
                return True
    is_across = min(ax, bx) < col + 1 and max(ax, bx) > col
    is_along = min(ay, by) < row + 1 and max(ay, by) > row
    if least < 0 < most:
        return is_across and is_along
    if ay == by and is_across and (ay == row or ay == row + 1):
        return is_shut(closure, polygon_at, row - 1 if ay == row else row + 1, col)
    if ax == bx and is_along and (ax == col or ax == col + 1):
        return is_shut(closure, polygon_at, row, col - 1 if ax == col else col + 1)
    return False


@njit(cache=True, nogil=True)
def _columns(segment, row):
    """Return the first and last column of the cells of a row that a segment may touch."""
    ax, ay, bx, by = segment
    if ay == by:
        return math.floor(min(ax, bx) - _MARGIN) - 1, math.floor(max(ax, bx) + _MARGIN)
    begin = min(max((row - ay) / (by - ay), 0.0), 1.0)
    end = min(max((row + 1 - ay) / (by - ay), 0.0), 1.0)
    low, high = ax + begin * (bx - ax), ax + end * (bx - ax)
    if low > high:
        low, high = high, low
    return math.floor(low - _MARGIN) - 1, math.floor(high + _MARGIN)


@njit(cache=True, nogil=True)
def is_beside(box, ax, ay, bx, by):
    """Return whether a segment comes so near to closed cells that it may touch one.

    `box` holds their first and last row, first and last column.
    """
    return (
        max(ay, by) >= box[0]
        and min(ay, by) <= box[1] + 1
        and max(ax, bx) >= box[2]
        and min(ax, bx) <= box[3] + 1
    )


@njit(cache=True, nogil=True)
def crosses(closure, polygon_at, ax, ay, bx, by):
    """Return whether a segment that is legal in free space is illegal with cells closed.

    Parameters
    ----------
    closure, polygon_at
        See `closure_of`.
    ax, ay, bx, by
        The segment. Its endpoints are not tested: a path that goes on in another direction must be
        tested there.
    """
    box, starts, cols = closure
    if not is_beside(box, ax, ay, bx, by) or (ax == bx and ay == by):
        return False
    segment = (ax, ay, bx, by)
    first = max(box[0], math.ceil(min(ay, by)) - 1)
    last = min(box[1], math.floor(max(ay, by)))
    for row in range(first, last + 1):
        low, high = _columns(segment, row)
        at, end = starts[row - box[0]], starts[row - box[0] + 1]
        if at == end or cols[at] > high or cols[end - 1] < low:
            continue
        at, end = _first_from(closure, row, low)
        while at < end and cols[at] <= high:
            if _meets_cell(closure, polygon_at, segment, row, cols[at]):
                return True
            at += 1
    return False


@njit(cache=True, nogil=True)
def is_clear(closure, polygon_at, ax, ay, bx, by):
    """Return whether a segment is legal with cells closed; see `crosses`."""
    segment = (ax, ay, bx, by)
    if ax == bx and ay == by:
        return True
    for row in range(math.ceil(min(ay, by)) - 1, math.floor(max(ay, by)) + 1):
        low, high = _columns(segment, row)
        for col in range(low, high + 1):
            if is_shut(closure, polygon_at, row, col) and _meets_cell(
                closure, polygon_at, segment, row, col
            ):
                return False
    return True


@guarded
@njit(cache=True, nogil=True)
def path_crosses(closure, polygon_at, path):
    """Return whether a shortest path of free space is, or may be, illegal with cells closed.

    An end at a corner of a closed cell counts, because the cell of the end decides.

    Parameters
    ----------
    closure, polygon_at
        See `closure_of`.
    path
        float64 (n, 2), (row, col) in grid units: the start, the corners at which it turns, the
        goal.
    """
    for k in range(len(path)):
        y, x = path[k]
        if y == math.floor(y) and x == math.floor(x) and is_at_closed(closure, x, y):
            return True
        if k and crosses(closure, polygon_at, path[k - 1, 1], path[k - 1, 0], x, y):
            return True
    return False


@guarded
@njit(cache=True, nogil=True)
def paths_cross(closure, polygon_at, positions, starts):
    """Return which of many paths cross closed cells, bool (n,); see `path_crosses`.

    Path k is `positions[starts[k]:starts[k + 1]]`.
    """
    found = np.empty(len(starts) - 1, np.bool_)
    for k in range(len(found)):
        found[k] = path_crosses(closure, polygon_at, positions[starts[k] : starts[k + 1]])
    return found


@guarded
@njit(cache=True, nogil=True)
def corners_of_closure(closure, polygon_at):
    """Find the corners of closed cells at which paths may bend.

    Three cells round such a corner are free; before the closure all four were.

    Returns
    -------
    tuple
        float64 (n,) x, float64 (n,) y, uint8 (n,) kinds as in `kinds_of`; int64 (n, 2) the closed
        cell (row, col) at each.
    """
    box, starts, cols = closure
    n_most = 4 * len(cols)
    xs, ys = np.empty(n_most), np.empty(n_most)
    kinds, cells = np.empty(n_most, np.uint8), np.empty((n_most, 2), np.int64)
    n = 0
    for row in range(box[0], box[1] + 1):
        low, high = starts[row - box[0]], starts[row - box[0] + 1]
        for at in range(low, high):
            col = cols[at]
            is_left = at > low and cols[at - 1] == col - 1
            is_right = at + 1 < high and cols[at + 1] == col + 1
            for k in range(4):
                # Most closed cells have closed ones beside them.
                if is_right if k & 1 else is_left:
                    continue
                down, across = row + 2 * (k >> 1) - 1, col + 2 * (k & 1) - 1
                if (
                    is_shut(closure, polygon_at, row, across)
                    or is_shut(closure, polygon_at, down, col)
                    or is_shut(closure, polygon_at, down, across)
                ):
                    continue
                xs[n], ys[n] = col + (k & 1), row + (k >> 1)
                kinds[n] = 3 - k
                cells[n] = row, col
                n += 1
    return xs[:n].copy(), ys[:n].copy(), kinds[:n].copy(), cells[:n].copy()
