"""Kernels of line integrals over cells.

Positions are (row, col) in grid units, rounded to 2^-24 of a cell, so that tests of corners are
exact.
"""

import math

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.exact import compare_products, is_legal, turn_of

_FREE = 1
_LEGAL_SLACK = 1e-12
"""Rounding of a sum of costs, relative."""


@njit(cache=True, nogil=True)
def _along_line(factors, lies, fixed, low, high):
    """Return the integral along a row or a column of positions.

    On the line between two cells the larger of their factors counts.

    `factors`: float32 (rows, cols); `lies`: whether the segment lies in a row: `fixed` is its row,
    else its column; `fixed`, `low`, `high`: the position that does not change, and the range of the
    other one.
    """
    rows, cols = factors.shape
    line = math.floor(fixed)
    has_first, has_second = line < (rows if lies else cols), fixed == line and line > 0
    total = 0.0
    for k in range(math.floor(low), math.ceil(high)):
        factor = np.float32(0.0)
        if has_first:
            factor = factors[line, k] if lies else factors[k, line]
        if has_second:
            factor = max(factor, factors[line - 1, k] if lies else factors[k, line - 1])
        total += factor * (min(high, k + 1.0) - max(low, k + 0.0))
    return total


@njit(cache=True, nogil=True)
def segment_cost(factors, a_row, a_col, b_row, b_col):
    """Return the integral of the factors along a segment inside the map, in cells.

    The walk visits the cells that the segment enters (J. Amanatides, A. Woo: A fast voxel traversal
    algorithm for ray tracing, 1987). Which side of a cell the segment leaves by is decided exactly;
    through a corner it passes to the cell behind.

    `factors`: float32 (rows, cols); `a_row`, `a_col`, `b_row`, `b_col`: the endpoints. Exchanged,
    they have the same integral, bit for bit.
    """
    if a_row == b_row:
        return _along_line(factors, True, a_row, min(a_col, b_col), max(a_col, b_col))
    if a_col == b_col:
        return _along_line(factors, False, a_col, min(a_row, b_row), max(a_row, b_row))
    if b_col < a_col:
        a_row, a_col, b_row, b_col = b_row, b_col, a_row, a_col
    up = b_row > a_row
    turn = 1 if up else -1
    row, col = math.floor(a_row) if up else math.ceil(a_row) - 1, math.floor(a_col)
    last_row, last_col = math.ceil(b_row) - 1 if up else math.floor(b_row), math.ceil(b_col) - 1
    rows, cols = b_row - a_row, b_col - a_col
    share, total = 0.0, 0.0
    while row != last_row or col != last_col:
        # The side of the segment on which the corner ahead lies.
        hand = turn * turn_of(a_row, a_col, b_row, b_col, row + 0.0 + up, col + 1.0)
        until = (row + up - a_row) / rows if hand >= 0 else (col + 1.0 - a_col) / cols
        total += factors[row, col] * (until - share)
        share = until
        row += turn * (hand >= 0)
        col += hand <= 0
    total += factors[row, col] * (1.0 - share)
    return total * math.sqrt(rows * rows + cols * cols)


@njit(cache=True, nogil=True)
def line_cost(factors, positions):
    """Return the integral of the factors along a polyline, float64 (n, 2) positions, in cells."""
    total = 0.0
    for i in range(1, positions.shape[0]):
        total += segment_cost(
            factors, positions[i - 1, 0], positions[i - 1, 1], positions[i, 0], positions[i, 1]
        )
    return total


# The cost of a segment and the test whether it is legal, in one walk over its cells.


@njit(cache=True, nogil=True)
def legal_cost(free, factors, a_row, a_col, b_row, b_col, most):
    """Return the integral of the factors along a segment, in cells, if it is legal; else infinity.

    The walk is that of `segment_cost` and `is_legal`. It ends, and returns infinity, where the
    rest makes the segment dearer than `most`, because no factor is below 1.

    Parameters
    ----------
    free
        uint8 (rows, cols), 1 where a cell may be entered.
    factors
        float32 (rows, cols), >= 1.
    a_row, a_col, b_row, b_col
        The endpoints, inside the map; if they are equal, the cost is 0.
    most
        The largest cost that is of use; a little more may be returned.
    """
    if a_row == b_row or a_col == b_col:
        if a_row == b_row and a_col == b_col:
            return 0.0
        if not is_legal(free, a_row, a_col, b_row, b_col, _FREE, _FREE):
            return np.inf
        return segment_cost(factors, a_row, a_col, b_row, b_col)

    # The walk runs towards higher columns, so that only rows have two directions.
    if b_col < a_col:
        a_row, a_col, b_row, b_col = b_row, b_col, a_row, a_col
    up = b_row > a_row
    turn = 1 if up else -1
    row, col = math.floor(a_row) if up else math.ceil(a_row) - 1, math.floor(a_col)
    last_row, last_col = math.ceil(b_row) - 1 if up else math.floor(b_row), math.ceil(b_col) - 1
    rows, cols = abs(b_row - a_row), b_col - a_col
    per_row, per_col = 1.0 / rows, 1.0 / cols
    # How far the next line between rows, and between columns, is from the first endpoint.
    to_row, to_col = row + 1.0 - a_row if up else a_row - row, col + 1.0 - a_col
    length = math.sqrt(rows * rows + cols * cols)
    limit = most / length * (1 + _LEGAL_SLACK)

    # `share` of the segment is behind, at a cost of `total` if the whole had length 1.
    share, total = 0.0, 0.0
    while free[row, col] >= _FREE:
        if row == last_row and col == last_col:
            return (total + factors[row, col] * (1.0 - share)) * length
        left, right = to_row * cols, to_col * rows
        # Rounding preserves order: only equal products need their errors.
        hand = compare_products(to_row, cols, to_col, rows) if left == right else 0
        if left < right or hand < 0:
            until = to_row * per_row
            total += factors[row, col] * (until - share)
            row += turn
            to_row += 1.0
        else:
            until = to_col * per_col
            total += factors[row, col] * (until - share)
            if left == right and hand == 0:  # through a corner
                if free[row, col + 1] < _FREE and free[row + turn, col] < _FREE:
                    break
                row += turn
                to_row += 1.0
            col += 1
            to_col += 1.0
        share = until
        if total + (1.0 - share) > limit:
            break
    return np.inf
