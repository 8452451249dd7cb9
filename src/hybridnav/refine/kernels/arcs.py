"""Kernels that round the bends of a line by arcs, where free space and costs allow it.

Positions are those of `refine.kernels.taut`.
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import GRAIN, is_legal
from hybridnav._base.trig import atan2, cos, hypot, sin, tan
from hybridnav.maps.costs.integral import legal_cost, segment_cost

_FREE = 1
_PIECE = 0.25
"""Longest piece of an arc in cells: every cell that its bounding box meets must be free."""
_MARGIN = 1e-6
"""Cells added to a bounding box on each side, far more than positions are rounded by."""
_LARGEST = 4.0
"""Largest radius of an arc, in those asked for."""
_SMALLEST_TURN = 1e-9
"""Radians; also the rounding of lengths, relative."""
_LEAST_SPOT_TURN = 1e-6
"""Radians; a line that turns by less goes on."""
_ROUNDS = 6
"""Passes over a line that merge bends."""


@njit(cache=True, nogil=True)
def _on_grain(position):
    """Return a number rounded to 2^-24."""
    return np.rint(position * GRAIN) / GRAIN


@njit(cache=True, nogil=True)
def _box_is_free(free, low_row, low_col, high_row, high_col):
    """Return whether all cells that a box meets, a little enlarged, are free."""
    rows, cols = free.shape
    for row in range(math.floor(low_row - _MARGIN), math.floor(high_row + _MARGIN) + 1):
        for col in range(math.floor(low_col - _MARGIN), math.floor(high_col + _MARGIN) + 1):
            if row < 0 or col < 0 or row >= rows or col >= cols or free[row, col] < _FREE:
                return False
    return True


@njit(cache=True, nogil=True)
def arc_cost(free, factors, a, bend, c):
    """Return the cost of the arc tangent to a-bend in a and to bend-c in c; -1 if it is not legal.

    The arc is divided into pieces of at most a quarter of a cell. Each lies in the triangle of its
    chord and its tangents; all cells that the box round this triangle meets must be free. So no arc
    enters a blocked cell, and some that pass one closely are refused. Costs are those of the
    chords, times the length of the arc over theirs.

    `free`: uint8 (rows, cols), 1 where a cell may be entered; `factors`: float32 (rows, cols); `a`,
    `bend`, `c`: positions, float64 (2,); a and c are equally far from the bend.
    """
    in_row, in_col = bend[0] - a[0], bend[1] - a[1]
    out_row, out_col = c[0] - bend[0], c[1] - bend[1]
    ahead = hypot(in_row, in_col)
    turn = atan2(in_row * out_col - in_col * out_row, in_row * out_row + in_col * out_col)
    if turn == 0:  # of a bend that rounding has made straight
        return -1.0
    radius = ahead / tan(abs(turn) / 2)
    hand = 1.0 if turn > 0 else -1.0
    # Unit vectors ahead and towards the centre.
    u_row, u_col = in_row / ahead, in_col / ahead
    v_row, v_col = -hand * u_col, hand * u_row
    n = max(2, math.ceil(radius * abs(turn) / _PIECE))
    step = abs(turn) / n
    reach = radius * tan(step / 2)
    total, chords = 0.0, 0.0
    row, col = a[0], a[1]
    # Sines and cosines of the angle along the arc, and of a step.
    sine, cosine, step_sine, step_cosine = 0.0, 1.0, sin(step), cos(step)
    for k in range(1, n + 1):
        at_row, at_col = c[0], c[1]
        tip_row = row + reach * (cosine * u_row + sine * v_row)
        tip_col = col + reach * (cosine * u_col + sine * v_col)
        sine, cosine = (
            sine * step_cosine + cosine * step_sine, cosine * step_cosine - sine * step_sine
        )  # fmt: skip
        if k < n:
            along, beside = radius * sine, radius * (1 - cosine)
            at_row = _on_grain(a[0] + along * u_row + beside * v_row)
            at_col = _on_grain(a[1] + along * u_col + beside * v_col)
        low_row, high_row = min(row, at_row, tip_row), max(row, at_row, tip_row)
        low_col, high_col = min(col, at_col, tip_col), max(col, at_col, tip_col)
        if not _box_is_free(free, low_row, low_col, high_row, high_col):
            return -1.0
        total += segment_cost(factors, row, col, at_row, at_col)
        chords += hypot(at_row - row, at_col - col)
        row, col = at_row, at_col
    return total * (radius * abs(turn) / chords)


@njit(cache=True, nogil=True)
def _turn_at(line, i):
    """Return the angle by which a line turns at a point, in [0, pi]."""
    in_row, in_col = line[i, 0] - line[i - 1, 0], line[i, 1] - line[i - 1, 1]
    out_row, out_col = line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1]
    cross, dot = in_row * out_col - in_col * out_row, in_row * out_row + in_col * out_col
    return abs(atan2(cross, dot))


@njit(cache=True, nogil=True)
def _direction(line, i):
    """Return the direction of a segment of a line, float64 (2,) of length 1."""
    step = line[i + 1] - line[i]
    return step / hypot(step[0], step[1])


@njit(cache=True, nogil=True)
def _towards(first, last, distance):
    """Return the position at some distance from one towards another, rounded to 2^-24."""
    whole = hypot(last[0] - first[0], last[1] - first[1])
    share = distance / whole
    position = np.empty(2)
    for k in range(2):
        position[k] = _on_grain(first[k] + share * (last[k] - first[k]))
    return position


@njit(cache=True, nogil=True)
def _differ(a, c):
    """Return whether two positions differ."""
    return a[0] != c[0] or a[1] != c[1]


@njit(cache=True, nogil=True)
def _is_legal(free, a, c):
    """Return whether the straight line between two positions is legal, or none."""
    if not _differ(a, c):
        return True
    return is_legal(free, a[0], a[1], c[0], c[1], _FREE, _FREE)


@njit(cache=True, nogil=True)
def _cost_between(free, factors, a, c):
    """Return the cost of the straight line between two positions, infinite if it is not legal."""
    return legal_cost(free, factors, a[0], a[1], c[0], c[1], np.inf)


@njit(cache=True, nogil=True)
def _merged(free, factors, line, n, i, spare):
    """Merge two points of a line, i and i + 1, in place if that costs at most `spare` more.

    The cheapest of three places is taken: either point, or the middle between them. Return the
    added cost, infinite if nothing was done.
    """
    a, c = line[i - 1], line[i + 2]
    if not _differ(a, c):
        return np.inf
    before = 0.0
    for k in range(i - 1, i + 2):
        before += segment_cost(factors, line[k, 0], line[k, 1], line[k + 1, 0], line[k + 1, 1])
    best, least = np.empty(2), np.inf
    for share in (0.5, 0.0, 1.0):
        middle = line[i].copy()
        for k in range(2):
            middle[k] = _on_grain(line[i, k] + share * (line[i + 1, k] - line[i, k]))
        if not (_differ(a, middle) and _differ(middle, c)):  # where the line turns back
            continue
        cost = _cost_between(free, factors, a, middle)
        if cost < least:
            cost += _cost_between(free, factors, middle, c)
        if cost < least:
            least = cost
            best[:] = middle
    if least - before > spare:
        return np.inf
    line[i] = best
    for k in range(i + 1, n - 1):
        line[k] = line[k + 1]
    return least - before


@njit(cache=True, nogil=True)
def _thinned(free, factors, line, radius, spare):
    """Return a line with fewer points, where two bends are too close for arcs, and what is spare.

    `free`, `factors`, `line`, `radius`: see `round_bends`; `spare`: most that the new line may cost
    above the old one, in cells.
    """
    line, n = line.copy(), line.shape[0]
    for _ in range(_ROUNDS):
        before, i = n, 1
        while i < n - 2:
            length = hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1])
            need = tan(_turn_at(line, i) / 2) + tan(_turn_at(line, i + 1) / 2)
            if radius * need > length:
                added = _merged(free, factors, line, n, i, spare)
                if added < np.inf:
                    n, spare = n - 1, spare - added
                    continue
            i += 1
        if n == before:
            break
    return line[:n].copy(), spare


@guarded
@njit(cache=True, nogil=True)
def round_bends(free, factors, line, radius, spare):
    """Return the points of a line with rounded bends, the headings at each, cost and length.

    Headings are float64 (m,), radians from the direction of the columns to that of the rows.
    Between two points the path is straight if they have the same heading, else an arc; two equal
    points are a turn on the spot, where no arc of the radius fits. No point occurs twice with one
    direction. An arc has at least the radius, and at most four times that. Bends too close to each
    other for that are merged first.

    `free`: uint8 (rows, cols), 1 where a cell may be entered; `factors`: float32 (rows, cols);
    `line`: float64 (n, 2), n >= 2, positions, no two in a row equal, joined by legal segments;
    `radius`: least radius of an arc, in cells, > 0; `spare`: most that the result may cost above
    the line, in cells, >= 0.
    """
    line, spare = _thinned(free, factors, line, radius, spare)
    n = line.shape[0]
    points, directions = np.empty((2 * n, 2)), np.empty((2 * n, 2))
    points[0], directions[0] = line[0], _direction(line, 0)
    size, cost, length, last = 1, 0.0, 0.0, line[0].copy()
    for i in range(1, n - 1):
        bend, ahead = line[i].copy(), line[i + 1].copy()
        # An arc begins `most` before its bend and ends as far behind: its radius times `half`.
        turn = max(_turn_at(line, i), _SMALLEST_TURN)
        half = tan(turn / 2)
        most = hypot(ahead[0] - bend[0], ahead[1] - bend[1])
        # Leave the next bend room for its smallest arc, unless this one needs that for its own.
        if i < n - 2:
            kept = radius * tan(_turn_at(line, i + 1) / 2) + _MARGIN
            most = max(most - kept, min(most, radius * half))
        room = hypot(bend[0] - last[0], bend[1] - last[1])
        most = min(room, most, _LARGEST * radius * half)
        # The cheapest of arcs from the widest on, each half as wide as the one before, down to the
        # radius, until one is dearer than the last; else a turn on the spot.
        a, c, arc, least = bend, bend, 0.0, np.inf
        while most >= radius * half * (1 - _SMALLEST_TURN):
            # Rounding moves the ends off the segments, so what is left of these is tested again.
            begin, end = _towards(bend, last, most), _towards(bend, ahead, most)
            if _is_legal(free, last, begin) and _is_legal(free, end, ahead):
                now = arc_cost(free, factors, begin, bend, end)
                added = now - segment_cost(factors, begin[0], begin[1], bend[0], bend[1])
                added -= segment_cost(factors, bend[0], bend[1], end[0], end[1])
                if now >= 0 and added <= spare:
                    if added >= least:
                        break
                    a, c, arc, least = begin, end, now, added
            if most <= radius * half + 2 * _MARGIN:  # less would leave a line of no length
                break
            most = max(most / 2, radius * half)
        spare -= least if least < np.inf else 0.0
        cost += segment_cost(factors, last[0], last[1], a[0], a[1]) + arc
        length += hypot(a[0] - last[0], a[1] - last[1])
        length += hypot(c[0] - a[0], c[1] - a[1]) * (turn / 2) / sin(turn / 2)
        # An arc that begins where the one before ends has no line before it, and a line that goes
        # on at a bend has one point there.
        if turn > _LEAST_SPOT_TURN:
            if _differ(points[size - 1], a):
                points[size], directions[size] = a, directions[size - 1]
                size += 1
        elif not _differ(points[size - 1], c):
            size -= 1
        points[size], directions[size] = c, _direction(line, i)
        size, last = size + 1, c
    if _differ(points[size - 1], line[n - 1]):
        points[size], directions[size] = line[n - 1], directions[size - 1]
        size += 1
    cost += segment_cost(factors, last[0], last[1], line[n - 1, 0], line[n - 1, 1])
    length += hypot(line[n - 1, 0] - last[0], line[n - 1, 1] - last[1])
    headings = np.empty(size)
    for i in range(size):
        headings[i] = atan2(directions[i, 0], directions[i, 1])
    return points[:size].copy(), headings, cost, length
