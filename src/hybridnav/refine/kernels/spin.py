"""Kernels of bodies that turn on the spot, exact except for the rounding of positions.

A convex polygon that turns about its base begins or ceases to overlap a cell only at a critical
heading: there one of its corners lies on the line of a side of the cell, or a corner of the cell on
the line of one of its sides. So one heading between each two consecutive critical ones decides for
all. Only the cells in the hull of two near headings are tested.
"""

import math

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.trig import acos, asin, atan2, cos, hypot, sin
from hybridnav.refine.kernels.sweep import (
    ROUNDING,
    STAYS,
    TURNS,
    WIDEST,
    body_fits,
    following,
    is_free,
    near,
    place,
    room,
    rows_seen,
)

_FULL = 2 * math.pi
_SHORT = 1.0
"""Most cells that a corner moves, and radians, in a part of a turn that is tested cell by cell."""


@njit(cache=True, nogil=True)
def _note(headings, count, angle, low, high):
    """Append an angle to `headings` if it lies between two others, less than a turn apart."""
    angle += _FULL * math.ceil((low - angle) / _FULL)
    if angle < high:
        headings[count] = angle
        count += 1
    return count


@njit(cache=True, nogil=True)
def _critical(part, square, low, high, headings):
    """Sort the critical headings of a polygon and a cell between two headings; return their number.

    `part` has the corners of the polygon in its own frame, `square` the lowest (row, col) of the
    cell, from the base.
    """
    count = 0
    i = part.shape[0] - 1
    for j in range(part.shape[0]):
        radius, angle = hypot(part[j, 0], part[j, 1]), atan2(part[j, 1], part[j, 0])
        for offset in range(2):
            row, col = square[0] + offset, square[1] + offset
            if abs(row) < radius:
                at = asin(row / radius)
                count = _note(headings, count, at - angle, low, high)
                count = _note(headings, count, math.pi - at - angle, low, high)
            if abs(col) < radius:
                at = acos(col / radius)
                count = _note(headings, count, at - angle, low, high)
                count = _note(headings, count, -at - angle, low, high)
        d_x, d_y = part[j, 0] - part[i, 0], part[j, 1] - part[i, 1]
        away = (d_y * part[j, 0] - d_x * part[j, 1]) / hypot(d_x, d_y)
        angle = atan2(-d_x, d_y)
        for corner in range(4):
            row, col = square[0] + corner // 2, square[1] + corner % 2
            radius = hypot(row, col)
            if abs(away) < radius:
                at, phi = acos(away / radius), atan2(row, col)
                count = _note(headings, count, phi - angle - at, low, high)
                count = _note(headings, count, phi - angle + at, low, high)
        i = j
    headings[:count].sort()
    return count


@njit(cache=True, nogil=True)
def _overlaps(part, square, heading):
    """Return whether a polygon goes deeper into a cell than the rounding of positions.

    It does not if the line of a side of one has the other on its far side.
    """
    cosine, sine = cos(heading), sin(heading)
    # The middle of the cell in the polygon's frame.
    centre_x = cosine * (square[1] + 0.5) + sine * (square[0] + 0.5)
    centre_y = cosine * (square[0] + 0.5) - sine * (square[1] + 0.5)
    low_row = low_col = np.inf
    high_row = high_col = -np.inf
    area = 0.0
    i = part.shape[0] - 1
    for j in range(part.shape[0]):
        row, col = sine * part[j, 0] + cosine * part[j, 1], cosine * part[j, 0] - sine * part[j, 1]
        low_row, high_row = min(low_row, row), max(high_row, row)
        low_col, high_col = min(low_col, col), max(high_col, col)
        area += part[i, 0] * part[j, 1] - part[i, 1] * part[j, 0]
        i = j
    if high_row <= square[0] + ROUNDING or low_row >= square[0] + 1 - ROUNDING:
        return False
    if high_col <= square[1] + ROUNDING or low_col >= square[1] + 1 - ROUNDING:
        return False
    hand = 1.0 if area > 0 else -1.0
    i = part.shape[0] - 1
    for j in range(part.shape[0]):
        d_x, d_y = part[j, 0] - part[i, 0], part[j, 1] - part[i, 1]
        length = hypot(d_x, d_y)
        off = hand * (d_y * (centre_x - part[i, 0]) - d_x * (centre_y - part[i, 1]))
        # Half the width of the cell across the side.
        across = 0.5 * (abs(cosine * d_y + sine * d_x) + abs(sine * d_y - cosine * d_x))
        if off - across >= -ROUNDING * length:
            return False
        i = j
    return True


@njit(cache=True, nogil=True)
def _meets_cell(part, square, low, high, headings):
    """Return whether a polygon overlaps a cell at some heading between two."""
    count = _critical(part, square, low, high, headings)
    before = low
    for k in range(count + 1):
        after = headings[k] if k < count else high
        if _overlaps(part, square, 0.5 * (before + after)):
            return True
        before = after
    return False


@njit(cache=True, nogil=True)
def _meets(body, base, low, high, places, columns):
    """Return whether a body that turns from one heading to another overlaps an occupied cell.

    `places` are its corners at both headings, not far apart.
    """
    ahead, corners, offsets = body.ahead, body.corners, body.offsets
    before, after = places
    rows, cols = ahead.shape
    margin = body.radii[1] * (high - low) ** 2 / 8
    headings = np.empty(16 * corners.shape[0])
    for k in range(offsets.size - 1):
        first, last = offsets[k], offsets[k + 1]
        low_row, end_row = rows_seen(rows, before, after, first, last, margin, TURNS, columns)
        for row in range(low_row, end_row):
            col = max(math.floor(columns[row - low_row, 0] - margin), 0)
            end = min(math.ceil(columns[row - low_row, 1] + margin), cols)
            while col < end:
                step = int(ahead[row, col])
                if step == 0:
                    square = (row - base[0], col - base[1])
                    if _meets_cell(corners[first:last], square, low, high, headings):
                        return True
                    step = 1
                col += step
    return False


@njit(cache=True, nogil=True)
def body_spins(body, row, col, heading, turn):
    """Return whether a body with its base in the map meets no occupied cell while it turns
    there."""
    ahead, corners, offsets = body.ahead, body.corners, body.offsets
    if offsets.size == 1:
        return True
    reach = body.radii[1]
    if near(body.clearance, row, col)[0] >= reach:
        return True
    if not body_fits(body, row, col, heading) or not body_fits(body, row, col, heading + turn):
        return False
    before, after = np.empty(corners.shape), np.empty(corners.shape)
    columns = room(ahead.shape[0], reach, 0.0)
    part, level = 0, 0
    while True:
        share = turn / (1 << level)
        first, last = heading + part * share, heading + (part + 1) * share
        margin = reach * share * share / 8
        free = False
        if margin <= WIDEST:
            place(corners, row, col, first, before)
            place(corners, row, col, last, after)
            free = is_free(ahead, offsets, before, after, margin, TURNS, columns)
            if not free and abs(share) <= _SHORT and reach * abs(share) <= _SHORT:
                low, high = min(first, last), max(first, last)
                if _meets(body, (row, col), low, high, (before, after), columns):
                    return False
                free = True
        if free:
            part, level = following(part, level)
            if level == 0:
                return True
            continue
        place(corners, row, col, 0.5 * (first + last), after)
        if not is_free(ahead, offsets, after, after, 0.0, STAYS, columns):
            return False
        part <<= 1
        level += 1


@njit(cache=True, nogil=True)
def free_turn(body, row, col, heading, turn):
    """Return a free turn on the spot to a heading: the short way, else the other; nan for neither.

    `turn` is the short way, in radians.
    """
    if body_spins(body, row, col, heading, turn):
        return turn
    other = turn - _FULL if turn > 0.0 else turn + _FULL
    return other if turn != 0.0 and body_spins(body, row, col, heading, other) else np.nan
