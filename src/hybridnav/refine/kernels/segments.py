"""Kernels of many exact tests of segments; positions are those of `refine.kernels.taut`."""

import math

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.exact import is_legal
from hybridnav.refine.kernels.taut import FREE

_FIRST, _STEP = 0.01, 0.5
"""Distances from its corner at which a ray is tried first, and between those after, in cells."""
_SIDE = 8.0
"""Side of the squares by which positions are found, in cells."""


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


@njit(cache=True, nogil=True)
def reaches(marks, corners, steps, farthest):
    """Return how far rays run from lattice corners before they enter a blocked cell, in cells.

    Parameters
    ----------
    marks
        See `clear_segments`.
    corners, steps
        float64 (n, 2), where rays begin, and steps of length 1 along them, (row, col).
    farthest
        Distance at which rays end.
    """
    found = np.empty(len(corners))
    rows, cols = marks.shape[0], marks.shape[1]
    for i in range(len(corners)):
        along = _FIRST
        while along < farthest:
            row = math.floor(corners[i, 0] + along * steps[i, 0])
            col = math.floor(corners[i, 1] + along * steps[i, 1])
            if not (0 <= row < rows and 0 <= col < cols) or marks[row, col] & FREE == 0:
                break
            along += _STEP
        found[i] = along
    return found


@njit(cache=True, nogil=True)
def shared(marks, starts, goals, limits, positions):
    """Return which pairs see a common position over which the way is short enough, bool (n,).

    Parameters
    ----------
    marks
        See `clear_segments`.
    starts, goals
        float64 (n, 2).
    limits
        float64 (n,), lengths up to which a way is short enough, in cells.
    positions
        float64 (k, 2).
    """
    rows, cols = int(marks.shape[0] / _SIDE) + 2, int(marks.shape[1] / _SIDE) + 2
    first = np.full((rows, cols), -1, np.int32)
    following = np.empty(len(positions), np.int32)
    for k in range(len(positions)):
        row, col = int(positions[k, 0] / _SIDE), int(positions[k, 1] / _SIDE)
        following[k], first[row, col] = first[row, col], k
    found = np.zeros(len(starts), np.bool_)
    for i in range(len(starts)):
        row, col, down, across = starts[i, 0], starts[i, 1], goals[i, 0], goals[i, 1]
        # The ways of this length fill an ellipse, which lies in this square.
        half, mid_row, mid_col = limits[i] / 2, (row + down) / 2, (col + across) / 2
        low_row, high_row = max(mid_row - half, 0.0), min(mid_row + half, marks.shape[0])
        low_col, high_col = max(mid_col - half, 0.0), min(mid_col + half, marks.shape[1])
        for up in range(int(low_row / _SIDE), int(high_row / _SIDE) + 1):
            for right in range(int(low_col / _SIDE), int(high_col / _SIDE) + 1):
                k = -1 if found[i] else first[up, right]
                while k >= 0:
                    at_row, at_col = positions[k, 0], positions[k, 1]
                    way = math.hypot(at_row - row, at_col - col)
                    way += math.hypot(at_row - down, at_col - across)
                    if (
                        way <= limits[i]
                        and is_legal(marks, row, col, at_row, at_col, FREE, FREE)
                        and is_legal(marks, at_row, at_col, down, across, FREE, FREE)
                    ):
                        found[i] = True
                        break
                    k = following[k]
    return found
