"""Kernels of the motion check: states and motions of a robot, one call each.

Points are metres in the map frame; `place` says where the grid lies there: its origin (x, y), then
what a metre along x and y is in rows and in columns. Positions are those of `_taut_kernels`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hybridnav.refine._segment_kernels import is_legal

BLOCKED, OPEN, STAND = 0, 1, 2
"""What a cell is to a query: not free, free but outside the corridor, or one to stand on."""
_DIGITS = 2.0**24


@njit(cache=True)
def _position(place, x, y):
    """Position (row, col) of a point, rounded so that tests on it are exact."""
    x -= place[0]
    y -= place[1]
    row = np.rint((place[2] * x + place[3] * y) * _DIGITS) / _DIGITS
    col = np.rint((place[4] * x + place[5] * y) * _DIGITS) / _DIGITS
    return row, col


@njit(cache=True)
def _in_map(marks, row, col):
    """Whether a position lies in the map, rim included; what is not a number does not."""
    return 0.0 <= row <= marks.shape[0] and 0.0 <= col <= marks.shape[1]


@njit(cache=True)
def _stands(marks, row, col):
    """Whether a position of the map lies in the closed square of a cell that may be stood on."""
    for r in range(max(math.ceil(row) - 1, 0), min(math.floor(row) + 1, marks.shape[0])):
        for c in range(max(math.ceil(col) - 1, 0), min(math.floor(col) + 1, marks.shape[1])):
            if marks[r, c] >= STAND:
                return True
    return False


@njit(cache=True)
def _runs(marks, a_row, a_col, b_row, b_col):
    """Whether the straight line between two positions of the map may be driven by a point."""
    if a_row == b_row and a_col == b_col:
        return _stands(marks, a_row, a_col)
    return is_legal(marks, a_row, a_col, b_row, b_col, STAND, OPEN)


@njit(cache=True)
def point_stands(marks, place, x, y):
    """Whether a point may be stood on."""
    row, col = _position(place, x, y)
    return _in_map(marks, row, col) and _stands(marks, row, col)


@njit(cache=True)
def point_runs(marks, place, x0, y0, x1, y1):
    """Whether a point may run straight from one place to another."""
    a_row, a_col = _position(place, x0, y0)
    b_row, b_col = _position(place, x1, y1)
    if not _in_map(marks, a_row, a_col) or not _in_map(marks, b_row, b_col):
        return False
    return _runs(marks, a_row, a_col, b_row, b_col)
