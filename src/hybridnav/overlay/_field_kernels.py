"""Kernels of searches among the cells of one field of the finest level.

The work array `distance`, int32 (rows * cols,), is FAR everywhere before and after each query.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.overlay._cost_kernels import least_cost, move_cost
from hybridnav.overlay._lane_kernels import FAR
from hybridnav.search.arrays import grow, pop, push
from hybridnav.search.moves import COL_STEP, ROW_STEP


@njit(cache=True, nogil=True)
def with_room(heap, size, more):
    """Return a heap that has room for more entries."""
    while size + more > len(heap):
        larger = np.empty((2 * len(heap), 2), np.int64)
        larger[:size] = heap[:size]
        heap = larger
    return heap


@guarded
@njit(cache=True, nogil=True)
def spread(ground, start, goal, limit, distance, touched):
    """Find the distances from a cell inside its field, by A* to a goal, or without one by Dijkstra.

    Parameters
    ----------
    ground
        See `CellCosts`.
    start, goal
        Flat cells of one field; -1 as the goal for all cells of the field.
    limit
        Paths that cost more are not followed.
    distance
        int32 (rows * cols,), changed: the costs; those not on the way to the goal may be too large.
    touched
        int64 (room,), the cells whose distance was changed; a new array if there was no room.

    Returns
    -------
    tuple
        `touched`, their number, and the number of cells expanded.
    """
    moves, field_of, units, cols, least_units = ground
    heap = np.empty((256, 2), np.int64)
    key = np.int64(0) if goal < 0 else least_cost(start, goal, cols, least_units)
    push(heap, 0, key, start)
    distance[start], touched[0] = 0, start
    size, n, expanded = 1, 1, 0
    while size > 0:
        key = heap[0, 0]
        cell = pop(heap, size)
        size -= 1
        so_far = np.int64(distance[cell])
        ahead = np.int64(0) if goal < 0 else least_cost(cell, goal, cols, least_units)
        if key != so_far + ahead:
            continue
        expanded += 1
        if cell == goal:
            break
        heap = with_room(heap, size, 8)
        for k in range(8):
            if not moves[cell] >> k & 1:
                continue
            other = cell + ROW_STEP[k] * cols + COL_STEP[k]
            if field_of[other] != field_of[start]:
                continue
            cost = so_far + move_cost(units[cell] + units[other], k)
            if cost >= distance[other]:
                continue
            key = cost if goal < 0 else cost + least_cost(other, goal, cols, least_units)
            if key > limit:
                continue
            if distance[other] == FAR:
                if n == touched.size:
                    touched = grow(touched)
                touched[n] = other
                n += 1
            distance[other] = cost
            push(heap, size, key, other)
            size += 1
    return touched, n, expanded


@njit(cache=True, nogil=True)
def forget(distance, touched, n):
    """Make a work array FAR again."""
    for i in range(n):
        distance[touched[i]] = FAR


@njit(cache=True, nogil=True)
def append_back(ground, distance, last, cells, n):
    """Append the path from a cell back to the start of a `spread`, without the start.

    Parameters
    ----------
    ground
        See `CellCosts`.
    distance
        int32 (rows * cols,), as `spread` left it.
    last
        Flat cell that was reached.
    cells, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `cells`, in a new array if there was no room, and their number; the last cell appended has a
        move from the start.
    """
    moves, field_of, units, cols, _ = ground
    cell = np.int64(last)
    while distance[cell] > 0:
        if n == cells.size:
            cells = grow(cells)
        cells[n] = cell
        n += 1
        before = cell
        for k in range(8):
            if moves[cell] >> k & 1:
                other = cell + ROW_STEP[k] * cols + COL_STEP[k]
                if field_of[other] == field_of[last] and distance[other] < FAR:
                    cost = move_cost(units[cell] + units[other], k)
                    if distance[other] + cost == distance[cell]:
                        before = other
                        break
        cell = before
    return cells, n
