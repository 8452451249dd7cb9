"""Kernel of the any-angle finish: from a cell path to a short string.

Positions are those of `_taut_kernels`.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.refine._detour_kernels import improve
from hybridnav.refine._taut_kernels import FREE, grown, tighten

_STEPS, _STEPS_PER_CELL = 2000, 1
"""Steps of the walks round obstacles. On twenty small maps, strings that are only taut are 0.33 %
longer than the optimum, with these steps 0.13 %, with 3000 and 4 a cell 0.09 % (in 1.5 times the
time), without a limit 0.04 % (in five times the time)."""


@njit(cache=True, nogil=True)
def _finish(marks, string, n, budget, points, size):
    """Shorten a legal string and append its points to others, without repeated ones."""
    string[:n, 2] = 1.0
    string, n = tighten(marks, string, n)
    string, n = improve(marks, string, n, budget)
    if size + n > points.shape[0]:
        points = grown(points, size + n)
    for i in range(n):
        row, col = string[i, 0], string[i, 1]
        if size == 0 or points[size - 1, 0] != row or points[size - 1, 1] != col:
            points[size, 0], points[size, 1] = row, col
            size += 1
    return points, size


@njit(cache=True, nogil=True)
def shorten(marks, cells, metres, origin, per_metre, corner_cutting):
    """Return the any-angle path between two points, positions (m, 2), from a legal path of cells.

    `per_metre` holds, for rows and columns, the length of a metre along x and y in grid units.
    Return no positions if a point lies outside its cell; the same position twice if two different
    points round to the same one.

    A move across a corner with a blocked cell beside it is led through that corner. Between two
    blocked cells the string is cut there, and its parts are shortened one by one.
    """
    n = cells.shape[0]
    points, string, endpoints = np.empty((64, 2)), np.empty((64, 3)), np.empty((2, 2))
    for end in range(2):
        x, y = metres[end, 0] - origin[0], metres[end, 1] - origin[1]
        for k in range(2):
            low = cells[end * (n - 1), k]
            position = per_metre[k, 0] * x + per_metre[k, 1] * y
            if not low - 1e-6 <= position <= low + 1 + 1e-6:
                return points[:0]
            # Few enough digits for exact tests; a point outside the cell by rounding moves to its
            # rim.
            endpoints[end, k] = min(max(np.rint(position * 2.0**24) / 2.0**24, low), low + 1)
    string[0, :2] = endpoints[0]
    found, size = 0, 1
    for i in range(1, n):
        row, col = cells[i, 0], cells[i, 1]
        d_row, d_col = row - cells[i - 1, 0], col - cells[i - 1, 1]
        if size + 3 > string.shape[0]:
            string = grown(string, size + 3)
        if corner_cutting and d_row * d_col != 0:
            beside = int(marks[row - d_row, col] >= FREE) + int(marks[row, col - d_col] >= FREE)
            if beside < 2:
                string[size, 0], string[size, 1] = max(row, row - d_row), max(col, col - d_col)
                size += 1
            if beside == 0:
                points, found = _finish(marks, string, size, _STEPS, points, found)
                string = np.empty((64, 3))
                string[0, :2] = points[found - 1]
                size = 1
        # Centres on a straight run between two others hold no string.
        bends = i == 1 or i == n - 2
        if i < n - 1 and not bends:
            bends = cells[i + 1, 0] - row != d_row or cells[i + 1, 1] - col != d_col
        if i < n - 1 and bends:
            string[size, 0], string[size, 1] = row + 0.5, col + 0.5
            size += 1
    string[size, :2] = endpoints[1]
    budget = _STEPS + _STEPS_PER_CELL * n
    points, found = _finish(marks, string, size + 1, budget, points, found)
    if found == 1 and (metres[0, 0] != metres[1, 0] or metres[0, 1] != metres[1, 1]):
        points[1] = points[0]
        found = 2
    return points[:found].copy()
