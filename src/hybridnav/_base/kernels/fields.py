"""Kernels of the searches: distances inside fields, arcs of a graph."""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT


@njit(cache=True, nogil=True)
def field_distances(classes, field_of, sources):
    """Return the cost of the shortest path inside each field from its source to each cell.

    It is -1 for cells without a field.

    A diagonal is judged on the whole grid: in a free field both side cells must be free, in an
    unexplored one free or unexplored. Buckets as wide as a straight step make the search
    label-setting (Dinic 1978): no cell can be improved from its own bucket, and three buckets that
    take turns hold all open cells.
    """
    rows, cols = classes.shape
    distance = np.full(rows * cols, np.int64(-1), np.int64)
    open_cells = np.empty((3, 1024), np.int32)
    count = np.zeros(3, np.int64)
    for v in range(sources.size):
        distance[sources[v]] = 0
        free_only = classes[sources[v] // cols, sources[v] % cols] == 1
        open_cells[0, 0] = sources[v]
        count[0] = 1
        turn = 0
        while count[0] + count[1] + count[2] > 0:
            slot = turn % 3
            while count[slot] > 0:
                count[slot] -= 1
                cell = np.int64(open_cells[slot, count[slot]])
                cost = distance[cell]
                if cost // STRAIGHT != turn:
                    continue
                row, col = cell // cols, cell % cols
                for k in range(8):
                    to_row, to_col = row + ROW_STEP[k], col + COL_STEP[k]
                    if to_row < 0 or to_row >= rows or to_col < 0 or to_col >= cols:
                        continue
                    to = to_row * cols + to_col
                    if field_of[to] != v:
                        continue
                    if k & 1:
                        side_cell, other_side_cell = classes[row, to_col], classes[to_row, col]
                        if side_cell == 0 or other_side_cell == 0:
                            continue
                        if free_only and (side_cell != 1 or other_side_cell != 1):
                            continue
                    new_cost = cost + (DIAGONAL if k & 1 else STRAIGHT)
                    if distance[to] >= 0 and distance[to] <= new_cost:
                        continue
                    distance[to] = new_cost
                    into = new_cost // STRAIGHT % 3
                    if count[into] == open_cells.shape[1]:
                        larger = np.empty((3, 2 * open_cells.shape[1]), np.int32)
                        larger[:, : open_cells.shape[1]] = open_cells
                        open_cells = larger
                    open_cells[into, count[into]] = to
                    count[into] += 1
            turn += 1
    return distance
