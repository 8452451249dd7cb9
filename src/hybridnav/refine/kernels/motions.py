"""Kernels of the motion check: states and motions of a robot, one call each.

Points are metres and headings radians in the map frame. `place` describes the pose of the grid: its
origin (x, y), then the length of a metre along x and y in rows and in columns, its yaw, and cells
in a metre. `marks` is uint8 (rows, cols), one of `BLOCKED`, `OPEN` and `STAND`. `body` is a
`Body`.
"""

import math

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.trig import atan2, cos, sin
from hybridnav.refine.kernels.curves import LARGEST_HEADING, shortest_word
from hybridnav.refine.kernels.spin import body_spins, free_turn
from hybridnav.refine.kernels.sweep import (
    OPEN,
    ROUNDING,
    STAND,
    WIDEST,
    body_fits,
    body_sweeps,
    cover,
    following,
    in_map,
    moved,
    rounded,
    runs,
    stands,
)

_LONGEST_TURN = 2 * math.pi + 1e-6


@njit(cache=True, nogil=True)
def _position(place, x, y):
    """Return the position (row, col) of a point, rounded."""
    x -= place[0]
    y -= place[1]
    return rounded(place[2] * x + place[3] * y), rounded(place[4] * x + place[5] * y)


@njit(cache=True, nogil=True)
def point_stands(marks, place, x, y):
    """Return whether a point may be stood on."""
    row, col = _position(place, x, y)
    return in_map(marks, row, col) and stands(marks, row, col)


@njit(cache=True, nogil=True)
def point_runs(marks, place, x0, y0, x1, y1):
    """Return whether a point may run straight from one place to another."""
    a_row, a_col = _position(place, x0, y0)
    b_row, b_col = _position(place, x1, y1)
    return runs(marks, a_row, a_col, b_row, b_col)


@njit(cache=True, nogil=True)
def _legal_bend(marks, positions, i):
    """Return whether a polyline with a bend at a corner of the lattice stays on one side there.

    No line, straight or bent, runs between two cells whose corner may not be passed.
    """
    row, col = positions[i]
    rows, cols = marks.shape
    if row != math.floor(row) or col != math.floor(col):
        return True
    r, c = int(row), int(col)
    if r == 0 or c == 0 or r == rows or c == cols:
        return True
    south_west, south_east = marks[r - 1, c - 1] >= OPEN, marks[r - 1, c] >= OPEN
    if south_west == south_east or south_west != (marks[r, c] >= OPEN):
        return True
    if south_east != (marks[r, c - 1] >= OPEN):
        return True
    hand = 1.0 if south_west else -1.0
    came = positions[i - 1, 0] - row + hand * (positions[i - 1, 1] - col)
    goes = positions[i + 1, 0] - row + hand * (positions[i + 1, 1] - col)
    return (came > 0) == (goes > 0)


@njit(cache=True, nogil=True)
def polyline_runs(marks, place, points):
    """Return whether a point may run along a polyline of one or more points, bends included."""
    positions = np.empty((points.shape[0], 2))
    n = 0
    for i in range(points.shape[0]):
        row, col = _position(place, points[i, 0], points[i, 1])
        # Repeated points would hide a bend.
        if n == 0 or positions[n - 1, 0] != row or positions[n - 1, 1] != col:
            positions[n, 0], positions[n, 1] = row, col
            n += 1
    if n == 1:
        return in_map(marks, positions[0, 0], positions[0, 1]) and stands(
            marks, positions[0, 0], positions[0, 1]
        )
    for i in range(n - 1):
        a_row, a_col = positions[i]
        b_row, b_col = positions[i + 1]
        if not runs(marks, a_row, a_col, b_row, b_col):
            return False
        if i > 0 and not _legal_bend(marks, positions, i):
            return False
    return True


@njit(cache=True, nogil=True)
def body_stands(marks, place, body, x, y, yaw):
    """Return whether a body may be at a point with a heading."""
    row, col = _position(place, x, y)
    if not in_map(marks, row, col) or not stands(marks, row, col):
        return False
    if not abs(yaw) <= LARGEST_HEADING:
        return False
    return body_fits(body, row, col, yaw - place[6])


@njit(cache=True, nogil=True)
def _short_turn(yaw0, yaw1):
    """Return the radians from heading to heading the short way, [-pi, pi]."""
    turn = yaw1 - yaw0
    return turn - 2 * math.pi * np.rint(turn / (2 * math.pi))


@njit(cache=True, nogil=True)
def body_turns(marks, place, body, x0, y0, yaw0, x1, y1, yaw1):
    """Return whether a body may go straight from one place to another while it turns the short
    way.

    Parameters
    ----------
    marks, place, body
        See the module.
    x0, y0, yaw0, x1, y1, yaw1
        The two poses: metres and radians, map frame.
    """
    row, col = _position(place, x0, y0)
    b_row, b_col = _position(place, x1, y1)
    if not runs(marks, row, col, b_row, b_col):
        return False
    if not (abs(yaw0) <= LARGEST_HEADING and abs(yaw1) <= LARGEST_HEADING):
        return False
    turn = _short_turn(yaw0, yaw1)
    if row == b_row and col == b_col:
        return body_spins(body, row, col, yaw0 - place[6], turn)
    return body_sweeps(body, row, col, yaw0 - place[6], b_row - row, b_col - col, turn, 0.0)


@njit(cache=True, nogil=True)
def turn_on_the_spot(marks, place, body, x, y, yaw0, yaw1):
    """Return the radians by which a body may turn on the spot from heading to heading; nan for
    none.

    Parameters
    ----------
    marks, place, body
        See the module.
    x, y
        Point in metres, map frame.
    yaw0, yaw1
        Headings in radians.
    """
    row, col = _position(place, x, y)
    if not in_map(marks, row, col) or not stands(marks, row, col):
        return np.nan
    if not (abs(yaw0) <= LARGEST_HEADING and abs(yaw1) <= LARGEST_HEADING):
        return np.nan
    return free_turn(body, row, col, yaw0 - place[6], _short_turn(yaw0, yaw1))


@njit(cache=True, nogil=True)
def body_drives_straight(marks, place, body, x0, y0, yaw0, x1, y1, yaw1, backwards):
    """Return whether a body may turn to the direction of travel, drive straight, and turn again.

    Between equal points it only turns. Turns go either way round.

    Parameters
    ----------
    marks, place, body, x0, y0, yaw0, x1, y1, yaw1
        See `body_turns`.
    backwards
        Whether the body travels backwards.
    """
    row, col = _position(place, x0, y0)
    b_row, b_col = _position(place, x1, y1)
    if not (abs(yaw0) <= LARGEST_HEADING and abs(yaw1) <= LARGEST_HEADING):
        return False
    if not runs(marks, row, col, b_row, b_col):
        return False
    heading, last = yaw0 - place[6], yaw1 - place[6]
    if x0 == x1 and y0 == y1:
        return not math.isnan(free_turn(body, row, col, heading, _short_turn(heading, last)))
    travel = atan2(y1 - y0, x1 - x0) - place[6]
    if backwards:
        travel += math.pi
    if not body_sweeps(body, row, col, travel, b_row - row, b_col - col, 0.0, 0.0):
        return False
    if math.isnan(free_turn(body, row, col, heading, _short_turn(heading, travel))):
        return False
    return not math.isnan(free_turn(body, b_row, b_col, travel, _short_turn(travel, last)))


@njit(cache=True, nogil=True)
def _sliver_stands(marks, a_row, a_col, b_row, b_col, margin):
    """Return whether all cells nearer to a segment than a margin may be stood on."""
    rows, cols = marks.shape
    low, high = min(a_row, b_row) - margin, max(a_row, b_row) + margin
    if low < 0 or high > rows:
        return False
    if min(a_col, b_col) < margin or max(a_col, b_col) > cols - margin:
        return False
    column = np.empty((1, 2))
    for row in range(math.floor(low), math.ceil(high)):
        column[0, 0], column[0, 1] = np.inf, -np.inf
        cover(column, row, row + 1, a_row, a_col, b_row, b_col, margin)
        for col in range(math.floor(column[0, 0] - margin), math.ceil(column[0, 1] + margin)):
            if marks[row, col] < STAND:
                return False
    return True


@njit(cache=True, nogil=True)
def _arc_runs(marks, row, col, heading, turn, radius):
    """Return whether a point may run along an arc."""
    part, level = 0, 0
    while True:
        share = 1.0 / (1 << level)
        angle = turn * share
        a_row, a_col, _ = moved(row, col, heading, 0.0, 0.0, turn, radius, part * share)
        b_row, b_col, _ = moved(row, col, heading, 0.0, 0.0, turn, radius, (part + 1) * share)
        margin = abs(radius) * angle * angle / 8
        if margin <= ROUNDING:
            if not runs(marks, rounded(a_row), rounded(a_col), rounded(b_row), rounded(b_col)):
                return False
            free = True
        else:
            free = margin <= WIDEST and _sliver_stands(marks, a_row, a_col, b_row, b_col, margin)
        if free:
            part, level = following(part, level)
            if level == 0:
                return True
            continue
        mid_row, mid_col, _ = moved(row, col, heading, 0.0, 0.0, turn, radius, (part + 0.5) * share)
        mid_row, mid_col = rounded(mid_row), rounded(mid_col)
        if not in_map(marks, mid_row, mid_col) or not stands(marks, mid_row, mid_col):
            return False
        part <<= 1
        level += 1


@njit(cache=True, nogil=True)
def body_drives(marks, place, body, x0, y0, yaw0, kinds, lengths, radius):
    """Return whether a body may drive a curve of tangent arcs and straight lines.

    Parameters
    ----------
    marks, place, body
        See the module.
    x0, y0, yaw0
        Pose at the start: metres and radians, map frame.
    kinds
        int64 (n,), 1 for an arc to the left, 0 for straight on, -1 to the right. No arc may be
        longer than a full turn.
    lengths
        float64 (n,), metres, negative backwards.
    radius
        Turning radius in metres.
    """
    row, col = _position(place, x0, y0)
    heading = yaw0 - place[6]
    if not abs(yaw0) <= LARGEST_HEADING or not 0.0 < radius < np.inf:
        return False
    if not in_map(marks, row, col) or not stands(marks, row, col):
        return False
    for k in range(kinds.size):
        length = lengths[k] * place[7]
        if kinds[k] == 0:
            d_row, d_col, turn, signed = (length * sin(heading), length * cos(heading), 0.0, 0.0)
            if not runs(
                marks, rounded(row), rounded(col), rounded(row + d_row), rounded(col + d_col)
            ):
                return False
        else:
            signed = radius * place[7] if kinds[k] > 0 else -radius * place[7]
            turn = length / signed
            d_row = d_col = 0.0
            if not abs(turn) <= _LONGEST_TURN or not _arc_runs(
                marks, row, col, heading, turn, signed
            ):
                return False
        if not body_sweeps(body, row, col, heading, d_row, d_col, turn, signed):
            return False
        row, col, heading = moved(row, col, heading, d_row, d_col, turn, signed, 1.0)
    return True


@njit(cache=True, nogil=True)
def body_steers(marks, place, body, x0, y0, yaw0, x1, y1, yaw1, radius, reverses):
    """Return whether a body may drive the shortest curve of a turning radius between two poses.

    Parameters
    ----------
    marks, place, body, x0, y0, yaw0, x1, y1, yaw1
        See `body_turns`.
    radius
        Turning radius in metres.
    reverses
        Whether backward segments are allowed.
    """
    kinds, lengths = np.empty(5, np.int64), np.empty(5)
    n = shortest_word(x0, y0, yaw0, x1, y1, yaw1, radius, reverses, kinds, lengths)
    if n == 0:
        return False
    return body_drives(marks, place, body, x0, y0, yaw0, kinds[:n], lengths[:n], radius)
