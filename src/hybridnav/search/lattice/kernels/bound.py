"""The kernel of a lower bound on the cost of all paths between two positions.

Positions are (row, col) in grid units. A *corner* is a lattice point where four cells meet.
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push

_UNITS = 2.0**20
"""Units of a cell in costs, which are rounded down."""
_FAR = 1 << 62
_DOWN = np.array([0, 0, -1, 1, -1, -1, 1, 1], np.int64)
_ACROSS = np.array([-1, 1, 0, 0, -1, 1, -1, 1], np.int64)
_STRAIGHT = 4
"""The first so many moves run along the side of two cells, the others through one cell."""


@njit(cache=True, nogil=True)
def _factor_of_move(free, factors, row, col, move):
    """Return the factor of a move from a corner, infinite where it meets no free cell.

    Along a side the cheaper of its two cells counts.
    """
    rows, cols = free.shape
    down, across = _DOWN[move], _ACROSS[move]
    factor = np.inf
    for k in range(2 if move < _STRAIGHT else 1):
        # The cell below and right of a corner has its row and column.
        cell_row = row - (k if down == 0 else down < 0)
        cell_col = col - (k if across == 0 else across < 0)
        if 0 <= cell_row < rows and 0 <= cell_col < cols and free[cell_row, cell_col] != 0:
            factor = min(factor, factors[cell_row, cell_col] + 0.0)
    return factor


@guarded
@njit(cache=True, nogil=True)
def least_over_corners(free, factors, start, goal, most):
    """Return the least cost of paths over corners between two of them, in cells, rounded down.

    A* with the octile distance. Infinite if there is no such path; `most` if all cost more.

    Parameters
    ----------
    free
        uint8 (rows, cols), 1 where a cell may be entered.
    factors
        float32 (rows, cols), >= 1.
    start, goal
        int64 (2,), (row, col) of the corners.
    most
        Cost from which on nothing is searched, in cells.
    """
    cols = free.shape[1] + 1
    straight, diagonal = np.int64(_UNITS), np.int64(_UNITS * math.sqrt(2.0))
    cost = np.full((free.shape[0] + 1) * cols, _FAR, np.int64)
    heap, size = np.empty((1024, 2), np.int64), 1
    at, goal_at = start[0] * cols + start[1], goal[0] * cols + goal[1]
    cost[at] = 0
    heap[0, 0], heap[0, 1] = 0, at
    limit = np.int64(min(most, 2.0**40) * _UNITS)
    while size > 0:
        key = heap[0, 0]
        at = pop(heap, size)
        size -= 1
        row, col = at // cols, at % cols
        down, across = abs(row - goal[0]), abs(col - goal[1])
        left = abs(down - across) * straight + min(down, across) * diagonal
        if key > cost[at] + left:  # reached more cheaply since
            continue
        if key > limit:
            return most
        if at == goal_at:
            return cost[at] / _UNITS
        if size + _DOWN.size > heap.shape[0]:
            larger = np.empty((2 * heap.shape[0], 2), np.int64)
            larger[:size] = heap[:size]
            heap = larger
        for move in range(_DOWN.size):
            factor = _factor_of_move(free, factors, row, col, move)
            if factor == np.inf:
                continue
            length = 1.0 if move < _STRAIGHT else math.sqrt(2.0)
            whole = cost[at] + np.int64(factor * length * _UNITS)
            to_row, to_col = row + _DOWN[move], col + _ACROSS[move]
            to = to_row * cols + to_col
            if whole < cost[to]:
                cost[to] = whole
                down, across = abs(to_row - goal[0]), abs(to_col - goal[1])
                left = abs(down - across) * straight + min(down, across) * diagonal
                push(heap, size, whole + left, to)
                size += 1
    return np.inf
