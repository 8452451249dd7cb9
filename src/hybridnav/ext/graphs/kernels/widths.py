"""Kernels of what lies along edges: free distances to the left and right, clearance."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.maps.geometry import passed_cells

_STEP_CELLS = 0.5
"""Distance between the points of an edge at which its width is measured."""


@njit(cache=True, nogil=True)
def _free_distance(occupied, row, col, down, across, reach):
    """Return how far a ray runs before it enters an occupied cell, at most `reach`, in cells."""
    rows, cols = occupied.shape
    here_row, here_col = math.floor(row), math.floor(col)
    step_row, step_col = (1 if down > 0 else -1), (1 if across > 0 else -1)
    to_row = (here_row + (step_row > 0) - row) / down if down != 0.0 else math.inf
    to_col = (here_col + (step_col > 0) - col) / across if across != 0.0 else math.inf
    along = 0.0
    while along < reach:
        if not (0 <= here_row < rows and 0 <= here_col < cols):
            return reach
        if occupied[here_row, here_col]:
            return along
        if to_row < to_col:
            along = to_row
            to_row += 1.0 / abs(down)
            here_row += step_row
        else:
            along = to_col
            to_col += 1.0 / abs(across)
            here_col += step_col
    return reach


@njit(cache=True, nogil=True)
def least_widths(occupied, tails, heads, reach):
    """Return the least free distance to the left and right of edges, and the least width.

    Parameters
    ----------
    occupied
        bool (rows, cols).
    tails, heads
        float64 (m, 2), (row, col) in grid units.
    reach
        Distance up to which is measured, in cells.

    Returns
    -------
    array
        float64 (m, 3), left, right, and the least sum of both, in cells.
    """
    found = np.full((len(tails), 3), np.inf)
    for edge in range(len(tails)):
        row, col = tails[edge, 0], tails[edge, 1]
        down, across = heads[edge, 0] - row, heads[edge, 1] - col
        length = math.hypot(down, across)
        count = max(1, math.ceil(length / _STEP_CELLS))
        for k in range(count + 1):
            at_row, at_col = row + k / count * down, col + k / count * across
            # Rows run upwards: the left of (down, across) is (across, -down).
            unit_row, unit_col = across / length, -down / length
            left = _free_distance(occupied, at_row, at_col, unit_row, unit_col, reach)
            right = _free_distance(occupied, at_row, at_col, -unit_row, -unit_col, reach)
            found[edge, 0] = min(found[edge, 0], left)
            found[edge, 1] = min(found[edge, 1], right)
            found[edge, 2] = min(found[edge, 2], left + right)
    return found


@guarded
@njit(cache=True, nogil=True)
def least_along(free, values, positions, edges):
    """Return the least value of the cells that each edge passes, and the cell in its middle.

    Parameters
    ----------
    free
        bool (rows, cols).
    values
        float (rows, cols).
    positions
        float64 (n, 2), the nodes, (row, col) in grid units.
    edges
        int64 (m, 2), tail and head of each edge.

    Returns
    -------
    tuple
        float64 (m,), and int64 (m, 2), (row, col).
    """
    least, middles = np.full(len(edges), np.inf), np.empty((len(edges), 2), np.int64)
    line = np.empty((2, 2))
    for edge in range(len(edges)):
        line[0], line[1] = positions[edges[edge, 0]], positions[edges[edge, 1]]
        cells = passed_cells(free, line)
        for k in range(len(cells)):
            least[edge] = min(least[edge], values[cells[k, 0], cells[k, 1]])
        middles[edge] = cells[len(cells) // 2]
    return least, middles
