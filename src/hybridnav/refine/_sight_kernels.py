"""Kernels of many exact tests of segments."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import njit
from hybridnav.refine._segment_kernels import is_legal
from hybridnav.refine._taut_kernels import FREE


@njit(cache=True, nogil=True)
def clear_segments(marks, tails, heads):
    """Return which segments stay in free space, bool (n,); a point alone does."""
    clear = np.empty(len(tails), np.bool_)
    for i in range(len(tails)):
        row, col, down, across = tails[i, 0], tails[i, 1], heads[i, 0], heads[i, 1]
        is_point = row == down and col == across
        clear[i] = is_point or is_legal(marks, row, col, down, across, FREE, FREE)
    return clear


@njit(cache=True, nogil=True)
def apart(marks, candidates, n_taken, spacing, most):
    """Choose candidates one by one that see no chosen one within a distance, bool (n,).

    Parameters
    ----------
    marks
        See `clear_segments`.
    candidates
        float64 (n, 2), positions (row, col), those that are tried first first.
    n_taken
        The first so many are chosen in any case.
    spacing
        The distance, in cells.
    most
        Number of chosen ones, with those in any case, at which to stop.
    """
    side = max(spacing, 1.0)
    rows, cols = int(marks.shape[0] / side) + 3, int(marks.shape[1] / side) + 3
    first = np.full((rows, cols), -1, np.int32)
    following = np.empty(len(candidates), np.int32)
    is_chosen = np.zeros(len(candidates), np.bool_)
    count = 0
    for k in range(len(candidates)):
        if count >= most and k >= n_taken:
            break
        row, col = candidates[k, 0], candidates[k, 1]
        # One more square on each hand, so that none lies beyond the rim.
        up, right = int(row / side) + 1, int(col / side) + 1
        is_seen = False
        for around in range(9 * int(k >= n_taken)):
            other = first[up + around // 3 - 1, right + around % 3 - 1]
            while other >= 0 and not is_seen:
                to_row, to_col = candidates[other, 0], candidates[other, 1]
                if math.hypot(to_row - row, to_col - col) <= spacing:
                    is_seen = (row == to_row and col == to_col) or is_legal(
                        marks, row, col, to_row, to_col, FREE, FREE
                    )
                other = following[other]
        if not is_seen:
            is_chosen[k] = True
            following[k], first[up, right] = first[up, right], k
            count += 1
    return is_chosen
