"""The cost of a segment and the test whether it is legal, in one walk over its cells.

Positions are those of `_taut_kernels`.
"""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import njit
from hybridnav.costs.integral import segment_cost
from hybridnav.refine._segment_kernels import is_legal
from hybridnav.search.exact import compare_products

_FREE = 1
_SLACK = 1e-12
"""Rounding of a sum of costs, relative."""


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
    limit = most / length * (1 + _SLACK)
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
