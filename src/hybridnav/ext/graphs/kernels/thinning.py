"""Kernels of skeletons: thinning in the order of clearance, and distances from lines."""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import guarded, njit

_DOWN = (0, -1, -1, -1, 0, 1, 1, 1)
_ACROSS = (1, 1, 0, -1, -1, -1, 0, 1)
"""The eight neighbours of a cell, counter-clockwise; those at even places share a side with it."""


@njit(cache=True, nogil=True)
def _is_simple(inside, row, col):
    """Return whether a cell can go without parting or joining anything: its 4-connectivity number
    is 1 (S. Yokoi, J. Toriwaki, T. Fukumura, 1975)."""
    number = 0
    for k in range(0, 8, 2):
        if inside[row + _DOWN[k], col + _ACROSS[k]]:
            one = inside[row + _DOWN[k + 1], col + _ACROSS[k + 1]]
            other = inside[row + _DOWN[(k + 2) % 8], col + _ACROSS[(k + 2) % 8]]
            number += 0 if one and other else 1
    return number == 1


@guarded
@njit(cache=True, nogil=True)
def thinned(inside, clearance, order, anchors):
    """Thin a set of cells to 4-connected lines, the cells nearest to obstacles first.

    Parameters
    ----------
    inside
        bool (rows, cols), changed in place; false along its rim.
    clearance
        float64 (rows, cols).
    order
        int64 (k,), the flat cells of the set by clearance.
    anchors
        bool (rows, cols), cells that stay.

    Notes
    -----
    C. Pudney: Distance-ordered homotopic thinning, 1998. A cell that had to stay is tried again as
    soon as a neighbour goes: so ends without an anchor shrink away.
    """
    cols = inside.shape[1]
    waiting = np.empty(8 * len(order) + 8, np.int64)
    for k in range(len(order)):
        level = clearance[order[k] // cols, order[k] % cols]
        waiting[0], first, last = order[k], 0, 1
        while first < last:
            row, col = waiting[first] // cols, waiting[first] % cols
            first += 1
            if not inside[row, col] or anchors[row, col] or not _is_simple(inside, row, col):
                continue
            inside[row, col] = False
            if first == last:
                first, last = 0, 0
            for side in range(8):
                other_row, other_col = row + _DOWN[side], col + _ACROSS[side]
                if inside[other_row, other_col] and clearance[other_row, other_col] <= level:
                    waiting[last] = other_row * cols + other_col
                    last += 1


@guarded
@njit(cache=True, nogil=True)
def spread(free, sources):
    """Return how many steps each cell lies from the nearest of some cells, int32, -1 out of reach.

    Parameters
    ----------
    free
        bool (rows, cols), false along its rim.
    sources
        int64 (k,), flat cells.

    Notes
    -----
    Steps go to 4 and 8 neighbours in turn, so that the cells within a distance make an octagon: it
    is Euclidean within a tenth, where steps are scaled by 1.2.
    """
    cols = free.shape[1]
    steps = np.full(free.shape, -1, np.int32)
    queue = np.empty(free.size, np.int64)
    last = 0
    for k in range(len(sources)):
        row, col = sources[k] // cols, sources[k] % cols
        if steps[row, col] < 0:
            steps[row, col] = 0
            queue[last] = sources[k]
            last += 1
    first = 0
    while first < last:
        row, col = queue[first] // cols, queue[first] % cols
        first += 1
        here = steps[row, col]
        for side in range(0, 8, 1 + (here % 2 == 0)):
            other_row, other_col = row + _DOWN[side], col + _ACROSS[side]
            if not free[other_row, other_col] or steps[other_row, other_col] >= 0:
                continue
            if side % 2 and not (free[row, other_col] and free[other_row, col]):
                continue
            steps[other_row, other_col] = here + 1
            queue[last] = other_row * cols + other_col
            last += 1
    return steps
