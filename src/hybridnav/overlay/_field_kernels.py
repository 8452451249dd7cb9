"""Kernels of searches among the cells of one field of the finest level.

The work array `distance`, int32 (rows * cols,), is FAR everywhere before and after each query.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.overlay._cost_kernels import move_cost, slot_of
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
def spread(ground, start, goal, distance, touched):
    """Find the distance between two cells of a field inside it, by Dijkstra's algorithm.

    Moves that turn by 135 degrees or more are not tried: the cell before has a cheaper one.

    Parameters
    ----------
    ground
        See `CellCosts`.
    start, goal
        Flat cells of one field of the finest level.
    distance
        int32 (rows * cols,), changed: the costs.
    touched
        int64 (room,), the cells whose distance was changed; a new array if there was no room.

    Returns
    -------
    tuple
        `touched`, their number, and the number of cells expanded.
    """
    field_of, units, cols = ground.field_of, ground.units, ground.cols
    heap = np.empty((256, 2), np.int64)
    push(heap, 0, np.int64(0), start << 4 | 8)
    distance[start], touched[0] = 0, start
    size, n, expanded, field = 1, 1, 0, field_of[slot_of(ground, start)]
    while size > 0:
        key = heap[0, 0]
        entry = pop(heap, size)
        cell, towards = entry >> 4, entry & 15
        size -= 1
        if key != distance[cell]:
            continue
        expanded += 1
        if cell == goal:
            break
        heap = with_room(heap, size, 8)
        slot = slot_of(ground, cell)
        own, mask = units[slot], ground.moves[slot]
        for turn in range(-2, 3 if towards < 8 else 6):
            k = towards + turn & 7
            if not mask >> k & 1:
                continue
            other = cell + ROW_STEP[k] * cols + COL_STEP[k]
            slot = slot_of(ground, other)
            cost = key + move_cost(own + units[slot], k)
            if cost >= distance[other] or field_of[slot] != field:
                continue
            if distance[other] == FAR:
                if n == touched.size:
                    touched = grow(touched)
                touched[n] = other
                n += 1
            distance[other] = cost
            push(heap, size, cost, other << 4 | k)
            size += 1
    return touched, n, expanded


@njit(cache=True, nogil=True)
def rank(so_far, ahead):
    """Return the place in the order of expansion; a quarter saves most expansions."""
    return so_far + ahead + (ahead >> 2)


@njit(cache=True, nogil=True)
def forget(distance, touched, n):
    """Make a work array FAR again."""
    for i in range(n):
        distance[touched[i]] = FAR


@njit(cache=True, nogil=True)
def path_inside(ground, distance, goal):
    """Return the flat cells of the path to a cell that a search reached.

    Parameters
    ----------
    ground
        See `CellCosts`.
    distance
        int32 (rows * cols,), as the search left it: FAR where it has not been.
    goal
        Flat cell.
    """
    units, cols = ground.units, ground.cols
    cells, n, cell = np.empty(64, np.int64), 1, np.int64(goal)
    cells[0] = goal
    while distance[cell] > 0:
        slot, before = slot_of(ground, cell), cell
        for k in range(8):
            if ground.moves[slot] >> k & 1:
                other = cell + ROW_STEP[k] * cols + COL_STEP[k]
                if distance[other] < FAR:
                    cost = move_cost(units[slot] + units[slot_of(ground, other)], k)
                    if distance[other] + cost == distance[cell]:
                        cell = other
                        break
        if cell == before:
            break
        if n == cells.size:
            cells = grow(cells)
        cells[n] = cell
        n += 1
    return cells[:n][::-1].copy()
