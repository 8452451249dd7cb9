"""Kernels of closed cells: whether a path of free space meets them.

Points are x = column, y = row in grid units, as for the search of intervals: the endpoints of a
query are rounded so that every side test is exact (see `turn_of`). Floats choose the candidate
cells, with a margin; side tests alone decide whether a segment meets a cell.
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import turn_of

_MARGIN = 1e-6
"""Rounding of the point where a segment meets a row of cells, in cells."""


@guarded
@njit(cache=True, nogil=True)
def closure_of(flat, n_cols):
    """Sort closed cells into rows.

    `flat`: int64 (m,), flat cells that were free, sorted, each once; `n_cols`: columns of the map.
    """
    cols = flat % n_cols
    if len(flat) == 0:
        return np.array([1, 0, n_cols, -1]), np.zeros(1, np.int64), cols
    box = np.array([flat[0] // n_cols, flat[-1] // n_cols, cols.min(), cols.max()])
    starts = np.zeros(box[1] - box[0] + 2, np.int64)
    for cell in flat:
        starts[cell // n_cols - box[0] + 1] += 1
    return box, np.cumsum(starts), cols


@njit(cache=True, nogil=True)
def _first_from(closure, row, col):
    """Return the range of the closed cells of a row that lie in a column or behind it."""
    starts, cols, first = closure.starts, closure.cols, closure.box[0]
    low, high = starts[row - first], starts[row - first + 1]
    end = high
    while low < high:
        middle = (low + high) >> 1
        if cols[middle] < col:
            low = middle + 1
        else:
            high = middle
    return low, end


@njit(cache=True, nogil=True)
def _is_closed(closure, row, col):
    """Return whether a cell was free and is closed."""
    box = closure.box
    if row < box[0] or row > box[1] or col < box[2] or col > box[3]:
        return False
    at, end = _first_from(closure, row, col)
    return at < end and closure.cols[at] == col


@njit(cache=True, nogil=True)
def _is_shut(closure, free, row, col):
    """Return whether a cell is closed or blocked; cells outside the map are blocked."""
    if not (0 <= row < free.shape[0] and 0 <= col < free.shape[1]):
        return True
    return not free[row, col] or _is_closed(closure, row, col)


@njit(cache=True, nogil=True)
def _is_at_closed(closure, x, y):
    """Return whether a lattice point is a corner of a closed cell."""
    box = closure.box
    if y < box[0] or y > box[1] + 1 or x < box[2] or x > box[3] + 1:
        return False
    row, col = int(y), int(x)
    return (
        _is_closed(closure, row, col)
        or _is_closed(closure, row, col - 1)
        or _is_closed(closure, row - 1, col)
        or _is_closed(closure, row - 1, col - 1)
    )


@njit(cache=True, nogil=True)
def _meets_cell(closure, free, segment, row, col):
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
            if _is_shut(closure, free, row + 2 * (k >> 1) - 1, col + 2 * (k & 1) - 1):
                return True
    is_across = min(ax, bx) < col + 1 and max(ax, bx) > col
    is_along = min(ay, by) < row + 1 and max(ay, by) > row
    if least < 0 < most:
        return is_across and is_along
    if ay == by and is_across and (ay == row or ay == row + 1):
        return _is_shut(closure, free, row - 1 if ay == row else row + 1, col)
    if ax == bx and is_along and (ax == col or ax == col + 1):
        return _is_shut(closure, free, row, col - 1 if ax == col else col + 1)
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
def _is_beside(box, ax, ay, bx, by):
    """Return whether a segment comes so near to closed cells that it may touch one.

    `box` holds their first and last row, first and last column.
    """
    low_y, high_y, low_x, high_x = box[0], box[1] + 1, box[2], box[3] + 1
    if max(ay, by) < low_y or min(ay, by) > high_y or max(ax, bx) < low_x or min(ax, bx) > high_x:
        return False
    # The line may pass all four corners of the box on one side.
    dx, dy = bx - ax, by - ay
    left = max(dx * (low_y - ay), dx * (high_y - ay)) - min(dy * (low_x - ax), dy * (high_x - ax))
    right = min(dx * (low_y - ay), dx * (high_y - ay)) - max(dy * (low_x - ax), dy * (high_x - ax))
    return left >= -_MARGIN and right <= _MARGIN


@njit(cache=True, nogil=True)
def _crosses(closure, free, ax, ay, bx, by):
    """Return whether a segment that is legal in free space is illegal with cells closed.

    `closure`: a `MeshClosure`; `free`: bool (rows, cols), before it; `ax`, `ay`, `bx`, `by`: the
    segment. Its endpoints are not tested: a path that goes on in another direction must be tested
    there.
    """
    box, starts, cols = closure.box, closure.starts, closure.cols
    if not _is_beside(box, ax, ay, bx, by) or (ax == bx and ay == by):
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
            if _meets_cell(closure, free, segment, row, cols[at]):
                return True
            at += 1
    return False


@guarded
@njit(cache=True, nogil=True)
def path_crosses(closure, free, path):
    """Return whether a shortest path of free space is, or may be, illegal with cells closed.

    An end at a corner of a closed cell counts, because the cell of the end decides.

    `closure`, `free`: see `_crosses`; `path`: float64 (n, 2), (row, col) in grid units: the
    start, the corners at which it turns, the goal.
    """
    for k in range(len(path)):
        y, x = path[k]
        if y == math.floor(y) and x == math.floor(x) and _is_at_closed(closure, x, y):
            return True
        if k and _crosses(closure, free, path[k - 1, 1], path[k - 1, 0], x, y):
            return True
    return False


@guarded
@njit(cache=True, nogil=True)
def paths_cross(closure, free, positions, starts):
    """Return which of many paths cross closed cells, bool (n,); see `path_crosses`.

    Path k is `positions[starts[k]:starts[k + 1]]`.
    """
    found = np.empty(len(starts) - 1, np.bool_)
    for k in range(len(found)):
        found[k] = path_crosses(closure, free, positions[starts[k] : starts[k + 1]])
    return found
