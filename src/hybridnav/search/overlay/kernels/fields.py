"""Kernels of searches among the cells of one field of the finest level.

The work array `distance`, int32 (rows * cols,), is FAR everywhere before and after each query.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, pop, push
from hybridnav._base.moves import COL_STEP, ROW_STEP
from hybridnav.search.overlay.kernels.costs import least_cost, move_cost, octile_units, slot_of
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH


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


# Kernels of a short search among cells, which settles pairs of cells that are close together.

_BUCKETS = 512
_TURNS = np.array([-2, 2, -1, 1, 0, 3, 4, -3])
"""Turns from the direction of arrival, the last one of five straight on: it is expanded first."""


@njit(cache=True, nogil=True)
def _expand(ground, at, goal, bound, buckets, entries, n, distance):
    """Put the cells into the open list that a cell reaches for less than before.

    Parameters
    ----------
    ground
        See `CellCosts`.
    at
        The place of the cell in `entries`.
    goal
        Flat cell, its row and its column.
    bound
        Only paths that can cost less are kept.
    buckets
        int32 (_BUCKETS,), changed, the last entry of each; the least estimate of the first one, and
        the exponent of their width.
    entries, n
        int32 (room, 4), changed: cell, cost, direction of arrival, the entry before in its
        bucket; and how many of them are filled.
    distance
        int32 (rows * cols,), changed.

    Returns
    -------
    tuple
        The number of entries; the least cost to the goal, `bound` for none below that; whether a
        cell was left out because its estimate is beyond the last bucket.
    """
    units, cols, least_units = ground.units, ground.cols, ground.least_units
    last_of, least, shift = buckets
    cell, cost, towards = np.int64(entries[at, 0]), np.int64(entries[at, 1]), entries[at, 2]
    row = np.int64(np.uint32(cell) // np.uint32(cols))
    rows, across = row - goal[1], cell - row * cols - goal[2]
    slot = np.uint64(slot_of(ground, cell))
    own, mask, is_beyond = np.int64(units[slot]), np.int64(ground.moves[slot]), False
    for turn in _TURNS[: 5 if towards < 8 else 8]:
        k = towards + turn & 7
        if not mask >> k & 1:
            continue
        other = np.uint64(cell + ROW_STEP[k] * cols + COL_STEP[k])
        slot = np.uint64(slot_of(ground, np.int64(other)))
        offered = cost + move_cost(own + units[slot], k)
        if offered >= distance[other]:
            continue
        apart = abs(rows + ROW_STEP[k]), abs(across + COL_STEP[k])
        estimate = offered + octile_units(apart[0], apart[1], least_units)
        bucket = np.uint64(estimate - least >> shift)
        if estimate >= bound or bucket >= _BUCKETS:
            is_beyond |= estimate < bound
            continue
        entries[n, 0], entries[n, 1], entries[n, 2] = other, offered, k
        entries[n, 3] = last_of[bucket]
        distance[other], last_of[bucket] = offered, n
        n += 1
        if other == np.uint64(goal[0]):
            bound = offered
    return n, bound, is_beyond


@njit(cache=True, nogil=True)
def search_near(ground, start, goal, most, distance):
    """Find a path of least cost between two cells with few expansions, by A* on buckets.

    It does not begin where a path without obstacles has more than half as many cells.

    Moves that turn by 135 degrees or more are not tried: the cell before has a cheaper one.

    Parameters
    ----------
    ground
        See `CellCosts`.
    start, goal
        Two flat cells.
    most
        Number of cells after which it ends.
    distance
        int32 (rows * cols,), FAR before and after.

    Returns
    -------
    tuple
        The cost, NO_PATH for no path or one that is not proved; the flat cells of the path; whether
        no path costs less; the number of cells expanded.
    """
    least, shift = least_cost(start, goal, ground.cols, ground.least_units), 0
    while 2 << shift <= ground.least_units:
        shift += 1
    is_far = least > most * ground.least_units
    if is_far or least + (np.int64(_BUCKETS) << shift) >= FAR:
        return np.int64(NO_PATH), np.empty(0, np.int64), False, 0
    # A cell has at most five moves ahead and to the sides, the first one eight.
    last_of, entries = np.full(_BUCKETS, -1, np.int32), np.empty((5 * most + 8, 4), np.int32)
    entries[0, 0], entries[0, 1], entries[0, 2], entries[0, 3] = start, 0, 8, -1
    last_of[0], distance[start], n, expanded, is_beyond = 0, 0, 1, 0, False
    bound, at = np.int64(0 if start == goal else NO_PATH), 0
    buckets = last_of, least, shift
    end = np.int64(goal), np.int64(goal // ground.cols), np.int64(goal % ground.cols)
    while at < _BUCKETS and expanded < most and least + (at << shift) < bound:
        entry = last_of[at]
        if entry < 0:
            at += 1
            continue
        last_of[at] = entries[entry, 3]
        if entries[entry, 1] != distance[entries[entry, 0]]:
            continue
        expanded += 1
        n, bound, is_left = _expand(ground, entry, end, bound, buckets, entries, n, distance)
        is_beyond |= is_left
    is_proved = least + (at << shift) >= bound or (at == _BUCKETS and not is_beyond)
    cells = np.empty(0, np.int64)
    if not is_proved:
        # The distance of a cell on the way may have fallen since the goal was reached.
        bound = np.int64(NO_PATH)
    elif bound < NO_PATH:
        cells = path_inside(ground, distance, goal)
    for i in range(n):
        distance[entries[i, 0]] = FAR
    return bound, cells, is_proved, expanded
