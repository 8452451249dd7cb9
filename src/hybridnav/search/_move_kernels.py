"""Kernels of the moves between cells: directions, costs, legal moves, recorded paths.

Costs on the octile grid are integers: STRAIGHT for a step along a side, DIAGONAL for one along a
diagonal. DIAGONAL / STRAIGHT = 114243 / 80782 is a convergent of sqrt 2: no fraction with a smaller
denominator lies between the two, so integer costs order any two paths exactly as a + b sqrt 2 does,
as long as their numbers of diagonal steps differ by less than 80782.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit

STRAIGHT = 80782
DIAGONAL = 114243
FAR = 1 << 60
"""More than any path costs; two of them add up without an overflow."""

# Directions in the order east, north-east, north, ... counter-clockwise; odd ones are diagonal.
ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1], np.int64)
COL_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1], np.int64)


@njit(cache=True, nogil=True)
def octile_cost(rows, cols):
    """Return the cost of the shortest path between cells without obstacles, from their offsets."""
    rows, cols = abs(rows), abs(cols)
    if rows < cols:
        rows, cols = cols, rows
    return STRAIGHT * (rows - cols) + DIAGONAL * cols


@njit(cache=True, nogil=True)
def legal_moves(enterable, corner_cutting):
    """Return the byte mask of the legal moves of each cell, bit k for direction k.

    A diagonal needs both side cells enterable, unless corners may be cut. Moves are judged once, on
    the whole grid.
    """
    rows, cols = enterable.shape
    moves = np.zeros((rows, cols), np.uint8)
    for row in range(rows):
        for col in range(cols):
            if not enterable[row, col]:
                continue
            to_east, to_west = col + 1 < cols, col > 0
            to_north, to_south = row + 1 < rows, row > 0
            east = to_east and enterable[row, col + 1]
            west = to_west and enterable[row, col - 1]
            north = to_north and enterable[row + 1, col]
            south = to_south and enterable[row - 1, col]
            mask = east | north << 2 | west << 4 | south << 6
            if to_north and to_east and (corner_cutting or (north and east)):
                mask |= enterable[row + 1, col + 1] << 1
            if to_north and to_west and (corner_cutting or (north and west)):
                mask |= enterable[row + 1, col - 1] << 3
            if to_south and to_west and (corner_cutting or (south and west)):
                mask |= enterable[row - 1, col - 1] << 5
            if to_south and to_east and (corner_cutting or (south and east)):
                mask |= enterable[row - 1, col + 1] << 7
            moves[row, col] = mask
    return moves


@njit(cache=True, nogil=True)
def trace(came, cols, start, goal):
    """Return the flat cells of the path that a search recorded, from start to goal.

    The lowest three bits of `came` are the direction from which each cell was reached.
    """
    count = 1
    cell = goal
    while cell != start:
        k = came[cell] & 7
        cell -= ROW_STEP[k] * cols + COL_STEP[k]
        count += 1
    path = np.empty(count, np.int64)
    cell = goal
    for i in range(count - 1, 0, -1):
        path[i] = cell
        k = came[cell] & 7
        cell -= ROW_STEP[k] * cols + COL_STEP[k]
    path[0] = start
    return path


@njit(cache=True, nogil=True)
def trace_cells(came, cols, start, goal):
    """Return the path of `trace` as (row, col), shape (n, 2)."""
    flat = trace(came, cols, start, goal)
    cells = np.empty((flat.size, 2), np.int64)
    for i in range(flat.size):
        row = flat[i] // cols
        cells[i, 0], cells[i, 1] = row, flat[i] - row * cols
    return cells
