"""Kernels of searches among the cells of one field of the finest level.

The work array `distance`, int32 (rows * cols,), is FAR everywhere before and after each query.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.overlay._cost_kernels import ROOT, move_cost
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
def spread(ground, span, start, goal, limit, distance, touched):
    """Find the distances from a cell inside its field, by A* to a goal, or without one by Dijkstra.

    Moves that turn by 135 degrees or more are not tried: the cell before has a cheaper one. With a
    goal the limit is its distance, so the order of expansion need not prove it: cells nearer to the
    goal come first, and a cell whose distance is lowered is expanded again.

    Parameters
    ----------
    ground
        See `CellCosts`.
    span
        The fields of the finest level that paths pass: the first, and the one after the last.
    start, goal
        Flat cells of these fields; -1 as the goal for all cells.
    limit
        Paths that cost more are not followed; with a goal its distance.
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
    straight = np.int64(2 * least_units) if goal >= 0 else np.int64(0)
    bend = (straight * ROOT >> 20) - straight
    goal_row, goal_col = goal // cols, goal % cols
    heap = np.empty((256, 2), np.int64)
    ahead = _octile(start // cols - goal_row, start % cols - goal_col, straight, bend)
    push(heap, 0, rank(np.int64(0), ahead), start << 4 | 8)
    distance[start], touched[0] = 0, start
    size, n, expanded = 1, 1, 0
    is_found = start == goal
    while size > 0 and not is_found:
        key = heap[0, 0]
        entry = pop(heap, size)
        cell, towards = np.uint64(entry >> 4), entry & 15
        size -= 1
        so_far = np.int64(distance[cell])
        row = np.int64(cell) // cols - goal_row
        col = np.int64(cell) % cols - goal_col
        if key != rank(so_far, _octile(row, col, straight, bend)):
            continue
        expanded += 1
        heap = with_room(heap, size, 8)
        own, mask = units[cell], moves[cell]
        for turn in range(-2, 3 if towards < 8 else 6):
            k = towards + turn & 7
            if not mask >> k & 1:
                continue
            other = np.uint64(np.int64(cell) + ROW_STEP[k] * cols + COL_STEP[k])
            cost = so_far + move_cost(own + units[other], k)
            if cost >= distance[other] or not span[0] <= field_of[other] < span[1]:
                continue
            ahead = _octile(row + ROW_STEP[k], col + COL_STEP[k], straight, bend)
            if cost + ahead > limit:
                continue
            if distance[other] == FAR:
                if n == touched.size:
                    touched = grow(touched)
                touched[n] = other
                n += 1
            distance[other] = cost
            if np.int64(other) == goal and cost == limit:
                is_found = True
                break
            push(heap, size, rank(cost, ahead), np.int64(other) << 4 | k)
            size += 1
    return touched, n, expanded


@njit(cache=True, nogil=True)
def _octile(rows, cols, straight, bend):
    """Return the cost of a straight path, by that of a straight move and what a diagonal adds."""
    rows, cols = abs(rows), abs(cols)
    return straight * max(rows, cols) + bend * min(rows, cols)


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
def append_back(ground, span, distance, last, cells, n):
    """Append the path from a cell back to the start of a `spread`, without the start.

    Parameters
    ----------
    ground
        See `CellCosts`.
    span, distance
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
                if span[0] <= field_of[other] < span[1] and distance[other] < FAR:
                    cost = move_cost(units[cell] + units[other], k)
                    if distance[other] + cost == distance[cell]:
                        before = other
                        break
        cell = before
    return cells, n
