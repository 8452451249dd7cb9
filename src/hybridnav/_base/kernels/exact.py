"""Kernels of predicates that rounding cannot change.

Positions are (row, col) in grid units, rounded to 2^-24 of a cell.
"""

import math

from hybridnav._base.jit import njit

GRAIN = 2.0**24
"""Parts of a cell to whose multiples positions are rounded."""


@njit(cache=True, nogil=True)
def _rounding_error(first, second, product):
    """Return the rounding error of a product (T. J. Dekker: A floating-point technique, 1971)."""
    scaled = 134217729.0 * first
    first_high = scaled - (scaled - first)
    first_low = first - first_high
    scaled = 134217729.0 * second
    second_high = scaled - (scaled - second)
    second_low = second - second_high
    error = product - first_high * second_high - first_low * second_high
    return first_low * second_low - (error - first_high * second_low)


@njit(cache=True, nogil=True)
def compare_products(first, second, third, fourth):
    """Return the sign of first * second - third * fourth: 1, -1 or 0, exact."""
    left, right = first * second, third * fourth
    # Rounding preserves order: only equal rounded products need their errors.
    if left == right and left != 0.0:
        left = _rounding_error(first, second, left)
        right = _rounding_error(third, fourth, right)
    return int(left > right) - int(left < right)


@njit(cache=True, nogil=True)
def turn_of(a_row, a_col, b_row, b_col, c_row, c_col):
    """Return the side of the line from a to b on which c lies: 1, -1 or 0, exact.

    1 is the right side for points given as (row, col), the left one for (x, y). Differences of
    coordinates must be exact in float64, as those of multiples of 2^-24 below 2^28 are.
    """
    return compare_products(b_row - a_row, c_col - a_col, b_col - a_col, c_row - a_row)


@njit(cache=True, nogil=True)
def is_legal(marks, a_row, a_col, b_row, b_col, stand, pass_by):
    """Return whether a segment stays in the closed cells that it may stand on; exact.

    The walk visits the cells that the segment enters (J. Amanatides, A. Woo: A fast voxel traversal
    algorithm for ray tracing, 1987); a segment along a line between cells needs one of the two at
    each step.

    Parameters
    ----------
    marks
        uint8 (rows, cols), mark of each cell.
    a_row, a_col, b_row, b_col
        Different positions in the map, the endpoints of the segment.
    stand
        The least mark of a cell that may be stood on.
    pass_by
        The least mark of a cell whose corners lines may pass, <= `stand`: no line runs between two
        cells below it.
    """
    rows, cols = marks.shape
    if a_row == b_row or a_col == b_col:
        lies = a_row == b_row
        low, high = (
            (min(a_col, b_col), max(a_col, b_col))
            if lies
            else (min(a_row, b_row), max(a_row, b_row))
        )
        fixed = a_row if lies else a_col
        line = math.floor(fixed)
        has_first, has_second = line < (rows if lies else cols), fixed == line and line > 0
        past_first = past_second = True
        for k in range(math.floor(low), math.ceil(high)):
            first = second = -1
            if has_first:
                first = int(marks[line, k] if lies else marks[k, line])
            if has_second:
                second = int(marks[line - 1, k] if lies else marks[k, line - 1])
            if first < stand and second < stand:
                return False
            # A line may not cross from one cell to the other through their common corner.
            if not (first >= pass_by and past_first) and not (second >= pass_by and past_second):
                return False
            past_first, past_second = first >= pass_by, second >= pass_by
        return True
    if b_col < a_col:
        a_row, a_col, b_row, b_col = b_row, b_col, a_row, a_col
    up = b_row > a_row
    turn = 1 if up else -1
    row, col = math.floor(a_row) if up else math.ceil(a_row) - 1, math.floor(a_col)
    last_row, last_col = math.ceil(b_row) - 1 if up else math.floor(b_row), math.ceil(b_col) - 1
    while marks[row, col] >= stand:
        if row == last_row and col == last_col:
            return True
        # The side of the segment on which the corner ahead lies.
        hand = turn * turn_of(a_row, a_col, b_row, b_col, row + 0.0 + up, col + 1.0)
        if hand == 0 and marks[row, col + 1] < pass_by and marks[row + turn, col] < pass_by:
            return False
        row += turn * (hand >= 0)
        col += hand <= 0
    return False
