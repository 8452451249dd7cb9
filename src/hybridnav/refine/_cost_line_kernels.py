"""Kernels that shorten a line of positions without raising its cost.

Positions are those of `_taut_kernels`.
"""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import njit
from hybridnav.costs.integral import segment_cost
from hybridnav.refine._segment_kernels import is_legal

_STEPS = np.array([2, 3, 4, 6, 8, 12, 16, 24], np.int64)
"""Points that one segment may leave behind: a few, for time grows with their number."""
_ROUNDS = 6
_FREE = 1
_SLACK = 1e-13
"""Rounding of a sum of costs, relative: of equal costs, the longer segment is taken."""


@njit(cache=True, nogil=True)
def _chain(free, factors, line):
    """Return the cheapest of the lines that leave out points of a line, by dynamic programming.

    A segment replaces 2 to 24 of the line, if it is legal; the cost cannot rise.
    """
    n = line.shape[0]
    cost, before = np.zeros(n), np.zeros(n, np.int64)
    for j in range(1, n):
        row, col = line[j, 0], line[j, 1]
        least = cost[j - 1] + segment_cost(factors, line[j - 1, 0], line[j - 1, 1], row, col)
        before[j] = j - 1
        for step in _STEPS:
            i = j - step
            if i < 0:
                break
            from_row, from_col = line[i, 0], line[i, 1]
            if from_row == row and from_col == col:
                continue
            # No factor is below 1.
            if cost[i] + math.hypot(row - from_row, col - from_col) > least * (1 + _SLACK):
                continue
            whole = cost[i] + segment_cost(factors, from_row, from_col, row, col)
            if whole <= least * (1 + _SLACK):
                if is_legal(free, from_row, from_col, row, col, _FREE, _FREE):
                    least, before[j] = min(whole, least), i
        cost[j] = least
    kept = 1
    j = n - 1
    while j > 0:
        kept += 1
        j = before[j]
    chain = np.empty((kept, 2))
    j = n - 1
    for at in range(kept - 1, -1, -1):
        chain[at] = line[j]
        j = before[j]
    return chain


@njit(cache=True, nogil=True)
def shorten(free, factors, line):
    """Return a line through some of the points of a legal line, float64 (n, 2), no dearer.

    Its segments are legal, or are segments of the given line.

    Parameters
    ----------
    free
        uint8 (rows, cols), 1 where a cell may be entered.
    factors
        float32 (rows, cols).
    line
        float64 (n, 2), n >= 1, positions, no two in a row equal.
    """
    for _ in range(_ROUNDS):
        shorter = _chain(free, factors, line)
        if shorter.shape[0] == line.shape[0]:
            break
        line = shorter
    return line
