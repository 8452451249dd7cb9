"""Kernels of legs: the moves between two cells without an obstacle in between.

A leg has moves along one diagonal and along one side next to it, in any order. Its *class* is
2 * k where all its moves go in direction k, 2 * k + 1 where they go in k and in k + 1.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit

COLUMN_BITS = 24
KIND_BITS = 4


@njit(cache=True, nogil=True)
def class_of(rows, cols):
    """Return the class of a leg by its offsets, at least one of which is not 0."""
    if rows == 0:
        return 0 if cols > 0 else 8
    if cols == 0:
        return 4 if rows > 0 else 12
    turn = 0
    if abs(rows) != abs(cols):
        turn = 1 if (abs(rows) > abs(cols)) == ((rows > 0) == (cols > 0)) else -1
    if rows > 0:
        return (2 if cols > 0 else 6) + turn
    return (14 if cols > 0 else 10) + turn


@njit(cache=True, nogil=True)
def reverse(leg):
    """Return the class of a leg when it is walked backwards."""
    return leg + 8 & 15


@njit(cache=True, nogil=True)
def legs_that_follow():
    """Return the legs that may follow each leg at a corner cell on a shortest path.

    Any move of the one leg may come right before any of the other. Two moves that turn by 45
    degrees or less are as short as possible; so are two along sides that turn by 90 degrees if the
    cell between them is blocked. All others are longer than a path past the corner cell, whose
    moves are legal because theirs are. So an excluded pair is never on a shortest path, even where
    there are several.

    Returns
    -------
    numpy.ndarray
        int64 (16, 16), by the blocked corners of the cell (see `number_cells`) and the class of the
        leg that ends there, walked backwards: bit c is set where a leg of class c may follow.
    """
    table = np.zeros((16, 16), np.int64)
    for kind in range(16):
        follow = np.zeros(8, np.int64)
        for k in range(8):
            follow[k] = 1 << k | 1 << (k + 1 & 7) | 1 << (k + 7 & 7)
            if k & 1 == 0:
                # The cell between a move and the next one to its left lies to the left and behind.
                follow[k] |= (kind >> (k // 2 + 1 & 3) & 1) << (k + 2 & 7)
                follow[k] |= (kind >> (k // 2 + 2 & 3) & 1) << (k + 6 & 7)
        for leg in range(16):
            may = follow[leg // 2] & (follow[leg // 2 + 1 & 7] if leg & 1 else 255)
            for other in range(16):
                moves = 1 << other // 2 | (1 << (other // 2 + 1 & 7) if other & 1 else 0)
                if may & moves == moves:
                    table[kind, reverse(leg)] |= 1 << other
    return table


@njit(cache=True, nogil=True)
def row_col_kind(place):
    """Return the parts of a corner cell's place: row, column, blocked corners."""
    return (
        place >> COLUMN_BITS + KIND_BITS,
        place >> KIND_BITS & (1 << COLUMN_BITS) - 1,
        place & (1 << KIND_BITS) - 1,
    )
