"""Kernels of bodies in motion: the areas swept by convex polygons and points, against cells.

Positions are those of `taut`; angles are counter-clockwise from the axis of the columns to that of
the rows. A motion moves the base along a straight line while the heading turns evenly (`radius` 0),
or along an arc about a fixed centre, to the left where its signed `radius` in cells is positive.

Between two of its states a body lies in the hull of the two, plus a margin: a chord is nowhere
farther from its arc than radius * angle^2 / 8. So a motion is free if the hull with its margin is
free, and not free if its middle state collides. Otherwise it is halved, until margins are smaller
than the rounding of positions. Every state in between is covered.
"""

import math
from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.exact import GRAIN, is_legal
from hybridnav._base.trig import cos, hypot, sin

BLOCKED, OPEN, STAND = 0, 1, 2
"""Marks of cells in a query: not free, free but outside the corridor, free to stand on."""
STAYS, SHIFTS, TURNS = 0, 1, 2
"""Kinds of motion of a body between two of its states."""
ROUNDING = 1 / GRAIN
WIDEST = 1.0
"""Margin in cells above which a motion is halved at once."""
_HALF_DIAGONAL = 0.7075
"""Half the diagonal of a cell, with some slack for distances stored as float32."""
_FARTHEST = 255


class Body(NamedTuple):
    """A robot among occupied cells."""

    ahead: np.ndarray
    """Columns to the next occupied cell of each row."""
    clearance: np.ndarray
    """float32 (rows, cols), cells from each centre to the nearest occupied one."""
    corners: np.ndarray
    """float64 (n, 2), in cells along the heading and to its left."""
    offsets: np.ndarray
    """int64, of its convex parts among them; none for a disc."""
    radii: np.ndarray
    """float64 (2,), the inscribed and the circumscribed radius in cells."""


@njit(cache=True, nogil=True)
def rounded(value):
    """Round a coordinate so that tests on it are exact."""
    return np.rint(value * GRAIN) / GRAIN


@njit(cache=True, nogil=True)
def in_map(marks, row, col):
    """Return whether a position lies in the map, rim included; False for NaN."""
    return 0.0 <= row <= marks.shape[0] and 0.0 <= col <= marks.shape[1]


@njit(cache=True, nogil=True)
def stands(marks, row, col):
    """Return whether a position of the map lies in the closed square of a cell to stand on."""
    for r in range(max(math.ceil(row) - 1, 0), min(math.floor(row) + 1, marks.shape[0])):
        for c in range(max(math.ceil(col) - 1, 0), min(math.floor(col) + 1, marks.shape[1])):
            if marks[r, c] >= STAND:
                return True
    return False


@njit(cache=True, nogil=True)
def runs(marks, a_row, a_col, b_row, b_col):
    """Return whether a point may run straight between two positions; exact for rounded ones."""
    if not in_map(marks, a_row, a_col) or not in_map(marks, b_row, b_col):
        return False
    if a_row == b_row and a_col == b_col:
        return stands(marks, a_row, a_col)
    return is_legal(marks, a_row, a_col, b_row, b_col, STAND, OPEN)


@njit(cache=True, nogil=True)
def look_ahead(occupied):
    """Return the columns from each cell to the next occupied one of its row, within reach."""
    rows, cols = occupied.shape
    ahead = np.empty((rows, cols), np.uint8)
    for row in range(rows):
        count = _FARTHEST
        for col in range(cols - 1, -1, -1):
            count = 0 if occupied[row, col] else min(count + 1, _FARTHEST)
            ahead[row, col] = count
    return ahead


@njit(cache=True, nogil=True)
def moved(row, col, heading, d_row, d_col, turn, radius, share):
    """Return the base (row, col) and heading after a share of a motion.

    Parameters
    ----------
    row, col, heading, share
        Position and heading at the start, in radians; share in [0, 1].
    d_row, d_col, turn, radius
        The way along a straight line, in cells; the radians by which the heading turns; the signed
        radius of the arc in cells, 0 for a straight line.
    """
    now = heading + share * turn
    if radius == 0.0:
        return row + share * d_row, col + share * d_col, now
    row += radius * (cos(heading) - cos(now))
    col += radius * (sin(now) - sin(heading))
    return row, col, now


@njit(cache=True, nogil=True)
def following(part, level):
    """Return the part after a free one, as large as possible; level 0 if that was the last.

    A motion has 2^level parts on each level, and a part that is not free is halved.
    """
    part += 1
    while level > 0 and part & 1 == 0:
        part >>= 1
        level -= 1
    return part, level


@njit(cache=True, nogil=True)
def place(corners, row, col, heading, placed):
    """Return the rounded positions of the corners of a body."""
    cosine, sine = cos(heading), sin(heading)
    for i in range(corners.shape[0]):
        x, y = corners[i, 0], corners[i, 1]
        placed[i, 0] = rounded(row + sine * x + cosine * y)
        placed[i, 1] = rounded(col + cosine * x - sine * y)


@njit(cache=True, nogil=True)
def cover(columns, first, end, a_row, a_col, b_row, b_col, margin):
    """Widen the columns that each row sees by those of an edge.

    Parameters
    ----------
    columns, first, end
        float64 (n, 2), lowest and highest column of the rows from `first` to `end`; changed.
    a_row, a_col, b_row, b_col, margin
        Positions of the edge's ends, and cells added all round.
    """
    if b_row < a_row:
        a_row, a_col, b_row, b_col = b_row, b_col, a_row, a_col
    slope = (b_col - a_col) / (b_row - a_row) if b_row > a_row else 0.0
    for row in range(max(math.floor(a_row - margin), first), min(math.ceil(b_row + margin), end)):
        left, right = a_col, b_col
        if row - margin > a_row:
            left = a_col + (row - margin - a_row) * slope
        if row + 1 + margin < b_row:
            right = a_col + (row + 1 + margin - a_row) * slope
        if left > right:
            left, right = right, left
        k = row - first
        columns[k, 0] = min(columns[k, 0], left)
        columns[k, 1] = max(columns[k, 1], right)


@njit(cache=True, nogil=True)
def _turns_right(points, size, row, col):
    """Return whether a path over the last two points to another one turns right or goes
    straight."""
    a_row, a_col = points[size - 2]
    b_row, b_col = points[size - 1]
    return (b_col - a_col) * (row - b_row) - (b_row - a_row) * (col - b_col) <= 0.0


@njit(cache=True, nogil=True)
def _hull(before, after, first, last):
    """Return the corners of the convex hull of a polygon in two places, closed by the first one.

    A. M. Andrew: Another efficient algorithm for convex hulls in two dimensions, 1979.
    """
    n = 2 * (last - first)
    ordered, points = np.empty((n, 2)), np.empty((2 * n + 1, 2))
    for i in range(n):
        at = first + i // 2
        col, row = before[at, 1], before[at, 0]
        if i % 2 == 1:
            col, row = after[at, 1], after[at, 0]
        j = i
        while j > 0 and (
            ordered[j - 1, 1] > col or (ordered[j - 1, 1] == col and ordered[j - 1, 0] > row)
        ):
            ordered[j, 0], ordered[j, 1] = ordered[j - 1, 0], ordered[j - 1, 1]
            j -= 1
        ordered[j, 0], ordered[j, 1] = row, col
    size = 0
    for k in range(n):
        row, col = ordered[k]
        while size >= 2 and _turns_right(points, size, row, col):
            size -= 1
        points[size, 0], points[size, 1] = row, col
        size += 1
    lower = size + 1
    for k in range(n - 2, -1, -1):
        row, col = ordered[k]
        while size >= lower and _turns_right(points, size, row, col):
            size -= 1
        points[size, 0], points[size, 1] = row, col
        size += 1
    return points[:size]


@njit(cache=True, nogil=True)
def rows_seen(rows, before, after, first, last, margin, moves, columns):
    """Fill in the columns of the hull of a convex polygon in two places; return its rows.

    Each row of cells sees one run of columns of the hull. If the polygon does not turn, the
    endpoints of a run are those of its edges and of the lines that its corners move on; if it
    turns, an edge of the hull may join two different corners.

    Parameters
    ----------
    rows, margin
        Number of rows of the map, and cells added all round.
    before, after, first, last
        float64 (n, 2), positions in the two places; the polygon's corners are first to last - 1.
    moves, columns
        `STAYS`, `SHIFTS` or `TURNS`; float64 (n, 2), from `room`, filled in.
    """
    low, high = np.inf, -np.inf
    for i in range(first, last):
        low = min(low, before[i, 0], after[i, 0])
        high = max(high, before[i, 0], after[i, 0])
    low_row, end_row = max(math.floor(low - margin), 0), min(math.ceil(high + margin), rows)
    for k in range(end_row - low_row):
        columns[k, 0], columns[k, 1] = np.inf, -np.inf
    if moves == TURNS:
        hull = _hull(before, after, first, last)
        for j in range(1, hull.shape[0]):
            i_row, i_col = hull[j - 1]
            j_row, j_col = hull[j]
            cover(columns, low_row, end_row, i_row, i_col, j_row, j_col, margin)
        last = first
    i = last - 1
    for j in range(first, last):
        i_row, i_col, j_row, j_col = before[i, 0], before[i, 1], before[j, 0], before[j, 1]
        cover(columns, low_row, end_row, i_row, i_col, j_row, j_col, margin)
        if moves == SHIFTS:
            i_row, i_col = after[j, 0], after[j, 1]
            cover(columns, low_row, end_row, i_row, i_col, j_row, j_col, margin)
            j_row, j_col = after[i, 0], after[i, 1]
            cover(columns, low_row, end_row, i_row, i_col, j_row, j_col, margin)
        i = j
    return low_row, end_row


@njit(cache=True, nogil=True)
def _part_is_free(ahead, before, after, first, last, margin, moves, columns):
    """Return whether the hull of a convex polygon in two places meets no occupied cell.

    Parameters
    ----------
    ahead
        uint8 (rows, cols), columns to the next occupied cell, as in a body.
    before, after, first, last, margin, moves, columns
        See `rows_seen`.
    """
    rows, cols = ahead.shape
    low_row, end_row = rows_seen(rows, before, after, first, last, margin, moves, columns)
    for row in range(low_row, end_row):
        k = row - low_row
        col = max(math.floor(columns[k, 0] - margin), 0)
        end = min(math.ceil(columns[k, 1] + margin), cols)
        while col < end:
            step = int(ahead[row, col])
            if step == 0:
                return False
            col += step
    return True


@njit(cache=True, nogil=True)
def is_free(ahead, offsets, before, after, margin, moves, columns):
    """Return whether the hulls of all convex parts of a body meet no occupied cell.

    Parameters
    ----------
    ahead, offsets
        Those of a body; see the module.
    before, after, margin, moves, columns
        See `rows_seen`.
    """
    for k in range(offsets.size - 1):
        first, last = offsets[k], offsets[k + 1]
        if not _part_is_free(ahead, before, after, first, last, margin, moves, columns):
            return False
    return True


@njit(cache=True, nogil=True)
def room(rows, reach, length):
    """Return room in which `rows_seen` notes the columns of a body that moves by `length` cells."""
    return np.empty((int(min(float(rows), 2 * reach + length)) + 6, 2))


@njit(cache=True, nogil=True)
def near(clearance, row, col):
    """Return bounds on the distances from a position to the nearest occupied square and its
    centre."""
    r = min(max(math.floor(row), 0), clearance.shape[0] - 1)
    c = min(max(math.floor(col), 0), clearance.shape[1] - 1)
    offset = hypot(row - r - 0.5, col - c - 0.5)
    return clearance[r, c] - offset - _HALF_DIAGONAL, clearance[r, c] + offset


@njit(cache=True, nogil=True)
def body_fits(body, row, col, heading):
    """Return whether a body meets no occupied cell with its base at a position of the map."""
    ahead, corners, offsets, radii = body.ahead, body.corners, body.offsets, body.radii
    if offsets.size == 1:
        return True
    at_least, at_most = near(body.clearance, row, col)
    if at_least >= radii[1]:
        return True
    if at_most < radii[0]:
        return False
    placed = np.empty(corners.shape)
    place(corners, row, col, heading, placed)
    columns = room(ahead.shape[0], radii[1], 0.0)
    return is_free(ahead, offsets, placed, placed, 0.0, STAYS, columns)


@njit(cache=True, nogil=True)
def body_sweeps(body, row, col, heading, d_row, d_col, turn, radius):
    """Return whether a body meets no occupied cell on a motion whose base stays in the map.

    Parameters
    ----------
    body
        See the module.
    row, col, heading, d_row, d_col, turn, radius
        See `moved`.
    """
    ahead, clearance, corners = body.ahead, body.clearance, body.corners
    offsets, radii = body.offsets, body.radii
    if offsets.size == 1:
        return True
    reach = radii[1]
    length = abs(radius * turn) if radius != 0.0 else hypot(d_row, d_col)
    before, after, middle = np.empty(corners.shape), np.empty(corners.shape), corners.copy()
    columns = room(ahead.shape[0], reach, length)
    moves = SHIFTS if turn == 0.0 else TURNS

    # Parts form a binary tree, searched depth first: this is part number `part` of 2^level.
    part, level = 0, 0
    while True:
        share = 1.0 / (1 << level)
        angle = turn * share
        mid_row, mid_col, mid_heading = moved(
            row, col, heading, d_row, d_col, turn, radius, (part + 0.5) * share
        )
        at_least, at_most = near(clearance, mid_row, mid_col)
        # The base stays within half the length of the part from its middle, and the body within the
        # circumscribed radius of the base: so much clearance needs no corners.
        free = at_least >= reach + 0.5 * length * share
        # A point of the body leaves the chord of its way by no more; halving divides this by four.
        margin = (abs(radius) + reach) * angle * angle / 8
        if not free and margin <= WIDEST:
            at_row, at_col, at = moved(row, col, heading, d_row, d_col, turn, radius, part * share)
            place(corners, at_row, at_col, at, before)
            at_row, at_col, at = moved(
                row, col, heading, d_row, d_col, turn, radius, (part + 1) * share
            )
            place(corners, at_row, at_col, at, after)
            # Below the rounding of positions the test without a margin decides, or halving
            # would not end.
            last = margin <= ROUNDING
            free = is_free(ahead, offsets, before, after, 0.0 if last else margin, moves, columns)
            if not free and last:
                return False
        if free:
            part, level = following(part, level)
            if level == 0:
                return True
            continue
        # One state that collides settles it; the inscribed disc may show that without corners.
        if at_most < radii[0]:
            return False
        # In between, only the corners can decide on the middle.
        if at_least < reach:
            place(corners, mid_row, mid_col, mid_heading, middle)
            if not is_free(ahead, offsets, middle, middle, 0.0, STAYS, columns):
                return False
        # Undecided: its first half is next.
        part <<= 1
        level += 1
