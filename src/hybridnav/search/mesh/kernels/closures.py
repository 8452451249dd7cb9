"""Kernels of closed cells: whether a path of free space meets them, and views past them.

Points are x = column, y = row in grid units, as for the search of intervals: the endpoints of a
query are rounded so that every side test is exact (see `turn_of`). Floats choose the candidate
cells, with a margin; side tests alone decide whether a segment meets a cell.
"""

import math

import numpy as np
from numba import types
from numba.extending import overload

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import turn_of
from hybridnav._base.trig import hypot
from hybridnav.search.contraction import grow_rows
from hybridnav.search.mesh.kernels.intervals import (
    APART,
    SPLIT,
    polygon_in,
    polygons_of_endpoints,
    polygons_with,
)
from hybridnav.search.mesh.kernels.polyanya import DONE, PAUSED, WORK_FULL
from hybridnav.search.mesh.kernels.views import has_target, see_from_point, touches

CHANGED, DEAD = 4, 8
"""Bits of a kind: the corner touches a closed cell, so that no path bends there; all cells at it
are closed or blocked, or two that meet there alone, so that no path passes it."""
KIND = 3
_MARGIN = 1e-6
"""Rounding of the point where a segment meets a row of cells, in cells."""


@guarded
@njit(cache=True, nogil=True)
def closure_of(flat, n_cols):
    """Sort closed cells into rows.

    `flat`: int64 (m,), flat cells that were free, sorted, each once; `n_cols`: columns of the map.
    Returns int64 (4,) first and last row, first and last column of the closed cells; int64 offsets
    of the cells of each of these rows; int64 their columns.
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
def is_any_closed(closure):
    """Return whether there is a closed cell."""
    return closure[0][0] <= closure[0][1]


@njit(cache=True, nogil=True)
def is_closed(closure, row, col):
    """Return whether a cell was free and is closed."""
    box, _, cols = closure
    if row < box[0] or row > box[1] or col < box[2] or col > box[3]:
        return False
    at, end = _first_from(closure, row, col)
    return at < end and cols[at] == col


@njit(cache=True, nogil=True)
def is_shut(closure, free, row, col):
    """Return whether a cell is closed or blocked; cells outside the map are blocked."""
    if not (0 <= row < free.shape[0] and 0 <= col < free.shape[1]):
        return True
    return not free[row, col] or is_closed(closure, row, col)


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
            if is_shut(closure, free, row + 2 * (k >> 1) - 1, col + 2 * (k & 1) - 1):
                return True
    is_across = min(ax, bx) < col + 1 and max(ax, bx) > col
    is_along = min(ay, by) < row + 1 and max(ay, by) > row
    if least < 0 < most:
        return is_across and is_along
    if ay == by and is_across and (ay == row or ay == row + 1):
        return is_shut(closure, free, row - 1 if ay == row else row + 1, col)
    if ax == bx and is_along and (ax == col or ax == col + 1):
        return is_shut(closure, free, row, col - 1 if ax == col else col + 1)
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
    low_y, high_y, low_x, high_x = box[0], box[1] + 1, box[2], box[3] + 1
    if max(ay, by) < low_y or min(ay, by) > high_y or max(ax, bx) < low_x or min(ax, bx) > high_x:
        return False
    # The line may pass all four corners of the box on one side.
    dx, dy = bx - ax, by - ay
    left = max(dx * (low_y - ay), dx * (high_y - ay)) - min(dy * (low_x - ax), dy * (high_x - ax))
    right = min(dx * (low_y - ay), dx * (high_y - ay)) - max(dy * (low_x - ax), dy * (high_x - ax))
    return left >= -_MARGIN and right <= _MARGIN


@njit(cache=True, nogil=True)
def crosses(closure, free, ax, ay, bx, by):
    """Return whether a segment that is legal in free space is illegal with cells closed.

    `closure`, `free`: see `closure_of`; `ax`, `ay`, `bx`, `by`: the segment. Its endpoints are not
    tested: a path that goes on in another direction must be tested there.
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
            if _meets_cell(closure, free, segment, row, cols[at]):
                return True
            at += 1
    return False


@guarded
@njit(cache=True, nogil=True)
def path_crosses(closure, free, path):
    """Return whether a shortest path of free space is, or may be, illegal with cells closed.

    An end at a corner of a closed cell counts, because the cell of the end decides.

    `closure`, `free`: see `closure_of`; `path`: float64 (n, 2), (row, col) in grid units: the
    start, the corners at which it turns, the goal.
    """
    for k in range(len(path)):
        y, x = path[k]
        if y == math.floor(y) and x == math.floor(x) and is_at_closed(closure, x, y):
            return True
        if k and crosses(closure, free, path[k - 1, 1], path[k - 1, 0], x, y):
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


# The corners of closed cells, and views past these cells.


@guarded
@njit(cache=True, nogil=True)
def corners_round(mesh, closure, closed, left, place):
    """Find the corners that closed cells have, and those at which paths bend no more.

    `mesh`: see `successors`; `closure`, `closed`: see `closure_of`; the flat cells; `left`: bool
    (rows, cols), free cells that are not closed; `place`: component of polygons, and the polygon of
    each cell. Result: x and y of all corners, new ones last; their kinds, with `CHANGED` and
    `DEAD`; bool (p,) whether each polygon has a new corner; int32 (2, m) these polygons, sorted,
    and which they have.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    box = closure[0]
    rows, cols = left.shape
    n, n_new = len(kinds), 0
    found = np.empty((64, 3), np.int64)
    # A corner of a closed cell whose other three cells are free, found from that cell alone.
    for cell in closed:
        row, col = cell // cols, cell % cols
        for k in range(4):
            down, side = row + 2 * (k >> 1) - 1, col + 2 * (k & 1) - 1
            if not (0 <= down < rows and 0 <= side < cols):
                continue
            if left[down, col] and left[row, side] and left[down, side]:
                if n_new == len(found):
                    found = grow_rows(found)
                # Seen from the corner, the cell lies on the other side than the corner from it.
                found[n_new, 0], found[n_new, 1] = col + (k & 1), row + (k >> 1)
                found[n_new, 2] = 3 - k
                n_new += 1
    # The corners of the map, and behind them the new ones.
    xs, ys = np.empty(n + n_new), np.empty(n + n_new)
    every = np.empty(n + n_new, np.uint8)
    xs[:n], ys[:n], every[:n] = cx, cy, kinds
    for k in range(n_new):
        xs[n + k], ys[n + k], every[n + k] = found[k, 0], found[k, 1], found[k, 2]
    # Corners that touch a closed cell have two cells or more that are not free.
    for corner in range(n):
        x, y = cx[corner], cy[corner]
        if y < box[0] or y > box[1] + 1 or x < box[2] or x > box[3] + 1 or kinds[corner] > KIND:
            continue
        row, col = int(y), int(x)
        a = row > 0 and col > 0 and left[row - 1, col - 1]
        b = row > 0 and col < cols and left[row - 1, col]
        c = row < rows and col > 0 and left[row, col - 1]
        d = row < rows and col < cols and left[row, col]
        n_free = int(a) + int(b) + int(c) + int(d)
        if n_free < 3:
            every[corner] |= CHANGED
        if n_free == 0 or (n_free == 2 and a == d):
            every[corner] |= DEAD
    # The polygons with each new corner: views are told of it there.
    room, listed = np.empty(len(place[0]), np.int32), np.empty((64, 2), np.int64)
    is_listed, n_listed = np.zeros(len(place[0]), np.bool_), 0
    for k in range(n_new):
        x, y = found[k, 0], found[k, 1]
        inner = polygon_in(mesh, place[0], place[1], y, x)
        for polygon in room[: polygons_with(mesh, inner, y, x, float(x), float(y), room)]:
            if n_listed == len(listed):
                listed = grow_rows(listed)
            listed[n_listed, 0], listed[n_listed, 1] = polygon, k
            is_listed[polygon] = True
            n_listed += 1
    # Sorted, so that a view finds those of its polygon by halving.
    order = np.argsort(listed[:n_listed, 0], kind="mergesort")
    return xs, ys, every, is_listed, np.ascontiguousarray(listed[order].T.astype(np.int32))


# Views round closed cells.


@njit(cache=True, nogil=True)
def _mark(new, polygon, x, y, rays):
    """Mark the new corners in a polygon that are seen from a point between two rays."""
    polygons, members, xs, ys, is_seen = new
    lx, ly, rx, ry = rays
    k = np.searchsorted(polygons, polygon)
    while k < len(polygons) and polygons[k] == polygon:
        one = members[k]
        if turn_of(x, y, rx, ry, xs[one], ys[one]) >= 0:
            is_seen[one] |= turn_of(x, y, lx, ly, xs[one], ys[one]) <= 0
        k += 1


@overload(has_target)
def _has_new_corners(target, polygon, x, y, rays):  # noqa: ARG001 - numba's rule
    """Return what stands for `has_target` for new corners, which are marked, and one point."""

    def mark(target, polygon, x, y, rays):
        # A view passes thousands of polygons, few with a new corner: only there the arrays of these
        # are unpacked, which takes longer than all the rest.
        if target[0][polygon]:
            _mark(target[1], polygon, x, y, rays)
        tx, ty, goals = target[2]
        lx, ly, rx, ry = rays
        for goal in goals:
            if goal == polygon and turn_of(x, y, rx, ry, tx, ty) >= 0:
                return turn_of(x, y, lx, ly, tx, ty) <= 0
        return False

    is_nested = len(target) == 3 and isinstance(target[1], types.BaseTuple)
    return mark if is_nested else None


@njit(cache=True, nogil=True)
def see_round(mesh, around, place, goal, room, found):
    """Find the corners seen from a point, past closed cells; see `see_from_point`.

    `mesh`: see `successors`, with the corners and kinds of `corners_round`; `around`: closure, free
    cells, polygons of new corners, and which; see `look_round`; `place`: x and y of the point, and
    int32 polygons that contain it; `goal`: x and y of another point, and int32 polygons that
    contain it; `room`, `found`: see `see_from_point`.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    x, y, starts = place
    closure, free, listed, members, n_old = around
    if not is_any_closed(closure):
        return see_from_point(mesh, x, y, starts, goal, room, found)
    seen = room[2]
    is_seen = np.zeros(len(cx) - n_old, np.bool_)
    for polygon in starts:
        k = np.searchsorted(listed[1], polygon)
        while k < len(members) and listed[1][k] == polygon:
            is_seen[members[k]] = True
            k += 1
    target = (listed[0], (listed[1], members, cx[n_old:], cy[n_old:], is_seen), goal)
    n, is_goal_seen = see_from_point(mesh, x, y, starts, target, room, found)
    if n < 0 or n + len(is_seen) > len(seen):
        return -1, False
    kept = found
    for k in range(found, n):
        corner = seen[k]
        if not crosses(closure, free, x, y, cx[corner], cy[corner]):
            seen[kept] = corner
            kept += 1
    for corner in range(n_old, len(cx)):
        if (
            is_seen[corner - n_old]
            and touches(kinds[corner], cx[corner] - x, cy[corner] - y)
            and not crosses(closure, free, x, y, cx[corner], cy[corner])
        ):
            seen[kept] = corner
            kept += 1
    return kept, is_goal_seen


@njit(cache=True, nogil=True)
def look_round(mesh, where, endpoints, rooms, bounds, around):
    """Find the corners that the endpoints of a query see, or the answer if that needs no corner.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    where
        Component of polygons, the polygon of each cell, and `cells`; see `polygons_of_endpoints`.
    rooms
        int32 room for the polygons of start and goal, room of `see_from_point`.
    bounds
        Receives the length and lower bound of the answer: infinite if the endpoints are not
        connected, their distance if they see each other.
    around
        The closure (see `closure_of`), the free cells before, the polygons of new corners and which
        these are (see `corners_round`), the number of corners before. No end is a corner of a
        closed cell.

    Returns
    -------
    tuple
        `DONE` with the answer, `WORK_FULL`, or `PAUSED`, when the room holds the corners that the
        goal sees and then those that the start sees; the indices at which both lists end.
    """
    sx, sy, tx, ty = endpoints
    component, polygon_at, cells = where
    starts, goals, room = rooms
    how, n_starts, n_goals = polygons_of_endpoints(
        mesh, component, polygon_at, cells, endpoints, starts, goals
    )
    if how == APART:
        bounds[:] = np.inf
        return DONE, 0, 0
    if how == SPLIT or is_any_closed(around[0]):
        nowhere = (0.0, 0.0, starts[:0])
        n, _ = see_round(mesh, around, (tx, ty, goals[:n_goals]), nowhere, room, 0)
        if n < 0:
            return WORK_FULL, 0, 0
        target = (tx, ty, goals[:n_goals] if how == SPLIT else starts[:0])
        n_all, is_seen = see_round(mesh, around, (sx, sy, starts[:n_starts]), target, room, n)
        if n_all < 0:
            return WORK_FULL, 0, 0
        is_hidden = how == SPLIT and not is_seen
        if is_hidden or crosses(around[0], around[1], sx, sy, tx, ty):
            return PAUSED, n, n_all
    bounds[:] = hypot(tx - sx, ty - sy)
    return DONE, 0, 0
