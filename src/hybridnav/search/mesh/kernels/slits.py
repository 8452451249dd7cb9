"""Kernels of directed sides: whether a path of free space crosses one the wrong way.

Points are x = column, y = row in grid units. Straight lines of sides are looked at one by one.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import turn_of

UP, DOWN = 1, 2
"""Bits of a side: it may be crossed to the cell with the higher row or column, to the lower one."""


@njit(cache=True, nogil=True)
def _cells_towards(dx, dy):
    """Return the first and the last cell round a point, see `Slits`, that a direction touches."""
    if dy == 0.0:
        return (0, 3) if dx > 0.0 else (1, 2)
    if dx == 0.0:
        return (0, 1) if dy > 0.0 else (2, 3)
    at = (0 if dx > 0.0 else 1) if dy > 0.0 else (3 if dx > 0.0 else 2)
    return at, at


@njit(cache=True, nogil=True)
def _leads_round(slits, point, before, after):
    """Return whether a path may go round a point at which slits end, from one point to another,
    (row, col); its segments lie along none."""
    (y, x), (from_y, from_x), (to_y, to_x) = point, before, after
    low, high = 0, len(slits.points)
    flat = int(y) * slits.wide + int(x)
    while low + 1 < high:
        middle = (low + high) >> 1
        if slits.points[middle] <= flat:
            low = middle
        else:
            high = middle
    reach = slits.reach[low]
    for one in _cells_towards(from_x - x, from_y - y):
        for two in _cells_towards(to_x - x, to_y - y):
            if reach[one, two]:
                return True
    return False


@njit(cache=True, nogil=True)
def _holds(ax, ay, bx, by, x, y):
    """Return whether a point on the line of a segment lies on it."""
    return (x - ax) * (x - bx) <= 0.0 and (y - ay) * (y - by) <= 0.0


@guarded
@njit(cache=True, nogil=True)
def path_is_barred(slits, path):
    """Return whether a shortest path of free space crosses a slit the wrong way, or may do so: if
    it runs along one, or has an end there.

    `slits`: `Slits`; `path`: float64 (n, 2), (row, col) in grid units: the start, the corners at
    which it turns, the goal.
    """
    last = len(path) - 1
    for k in range(last):
        (ay, ax), (by, bx) = path[k], path[k + 1]
        for line in range(len(slits.lines)):
            px, py, qx, qy = slits.lines[line]
            if max(ax, bx) < px or min(ax, bx) > qx or max(ay, by) < py or min(ay, by) > qy:
                continue
            begin, end = turn_of(px, py, qx, qy, ax, ay), turn_of(px, py, qx, qy, bx, by)
            if begin * end > 0:
                continue
            if k == 0 and begin == 0 and _holds(px, py, qx, qy, ax, ay):
                return True
            if k == last - 1 and end == 0 and _holds(px, py, qx, qy, bx, by):
                return True
            if begin == 0 and end == 0:
                if max(min(ax, bx), px) < min(max(ax, bx), qx):
                    return True
                if max(min(ay, by), py) < min(max(ay, by), qy):
                    return True
            first, other = turn_of(ax, ay, bx, by, px, py), turn_of(ax, ay, bx, by, qx, qy)
            if first * other > 0:
                continue
            if first * other < 0:
                # The left hand of a line along a row is the upper one, along a column the lower.
                way = UP if (begin > 0) == (px == qx) else DOWN
                if begin == 0 or end == 0 or not slits.ways[line] & way:
                    return True
                continue
            for side in range(2):
                x, y = (px, py) if side == 0 else (qx, qy)
                if (first if side == 0 else other) != 0 or not _holds(ax, ay, bx, by, x, y):
                    continue
                if x == ax and y == ay:  # seen at the end of the segment before
                    continue
                after = path[k + 2] if x == bx and y == by else path[k + 1]
                if not _leads_round(slits, (y, x), (ay, ax), (after[0], after[1])):
                    return True
    return False


@guarded
@njit(cache=True, nogil=True)
def paths_are_barred(slits, positions, starts):
    """Return which of many paths cross slits, see `path_is_barred`; path k is
    `positions[starts[k]:starts[k + 1]]`."""
    found = np.empty(len(starts) - 1, np.bool_)
    for k in range(len(found)):
        found[k] = path_is_barred(slits, positions[starts[k] : starts[k + 1]])
    return found
