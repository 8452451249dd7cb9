"""Kernels that read corners and walls off free cells.

Points are (row, col) in grid units: cell (r, c) spans [r, r + 1] x [c, c + 1], corners are whole
numbers.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit

NO_CORNER = 6
MANY = 4
"""Kind of a corner that no path bends round: the number of blocked cells of four is not one."""


@njit(cache=True, nogil=True)
def kinds_of(free):
    """Return the kind of each lattice point, uint8 (rows + 1, cols + 1).

    0 to 3 if one cell of four is blocked: bit 1 for the upper row, bit 0 for the upper column;
    `MANY` if three are, or two that meet there alone; else `NO_CORNER`. Cells outside the map are
    blocked.
    """
    rows, cols = free.shape
    kinds = np.empty((rows + 1, cols + 1), np.uint8)
    for row in range(rows + 1):
        below, above = row > 0, row < rows
        a = c = False
        for col in range(cols + 1):
            b = below and col < cols and free[row - 1, col]
            d = above and col < cols and free[row, col]
            n = int(a) + int(b) + int(c) + int(d)
            kind = NO_CORNER
            if n == 3:
                kind = 0 if not a else 1 if not b else 2 if not c else 3
            elif n == 1 or (n == 2 and a == d):
                kind = MANY
            kinds[row, col] = kind
            a, c = b, d
    return kinds


@guarded
@njit(cache=True, nogil=True)
def walls_of(free, kinds, n_corners):
    """Return the corners, and the walls between them.

    A wall is a straight run of sides between free and blocked cells, from a corner to the next.

    Parameters
    ----------
    free
        bool (rows, cols).
    kinds
        Kinds of `kinds_of`.
    n_corners
        Number of corners among them.

    Returns
    -------
    tuple
        int32 (n, 2) corners (row, col) in the order of rows; int32 (m, 2) walls, as their indices.
    """
    rows, cols = free.shape
    corners = np.empty((n_corners, 2), np.int32)
    walls = np.empty((2 * n_corners, 2), np.int32)
    below = np.empty(cols + 1, np.int32)
    count = n_walls = 0
    for row in range(rows + 1):
        before = -1
        for col in range(cols + 1):
            if kinds[row, col] == NO_CORNER:
                continue
            corners[count, 0], corners[count, 1] = row, col
            # A side between two classes that starts at a corner leads to another corner.
            if col > 0:
                down = row > 0 and free[row - 1, col - 1]
                up = row < rows and free[row, col - 1]
                if down != up:
                    walls[n_walls, 0], walls[n_walls, 1] = before, count
                    n_walls += 1
            if row > 0:
                left = col > 0 and free[row - 1, col - 1]
                right = col < cols and free[row - 1, col]
                if left != right:
                    walls[n_walls, 0], walls[n_walls, 1] = below[col], count
                    n_walls += 1
            before, below[col] = count, count
            count += 1
    return corners, walls[:n_walls]
