"""Kernels of portals: distances inside fields, queries on the table, paths by stored directions.

Directions are those of `search._kernels`: 0 to 7, east and on counter-clockwise; 8 is the source.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hybridnav.search._costs import DIAGONAL, STRAIGHT

_ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1], np.int64)
_COL_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1], np.int64)
SOURCE = 8
UNREACHED = 9
STEPS_PER_CELL = 32
FARTHEST = 65535


@njit(cache=True)
def fill_field(moves, cols, label, place_of, source, cost, came, ring):
    """Costs from a cell to all cells of its field, by position in the field, and the direction in
    which each cell's shortest path to the source begins.

    Dijkstra's algorithm with buckets one straight step wide: no step is shorter, so a bucket is
    final when its turn comes, and three buckets in turn are enough. `ring` is scratch, (3, size).
    """
    for i in range(cost.size):
        cost[i] = np.iinfo(np.int32).max
        came[i] = UNREACHED
    field = label[source]
    count = np.zeros(3, np.int64)
    cost[place_of[source]] = 0
    came[place_of[source]] = SOURCE
    ring[0, 0] = source
    count[0] = 1
    turn = 0
    left = 1
    while left > 0:
        at = turn % 3
        # Entries come to this bucket from earlier ones only; stale ones have a lower cost by now.
        for i in range(count[at]):
            cell = np.int64(ring[at, i])
            here = cost[place_of[cell]]
            if here // STRAIGHT != turn:
                continue
            mask = moves[cell]
            for k in range(8):
                if not mask >> k & 1:
                    continue
                following = cell + _ROW_STEP[k] * cols + _COL_STEP[k]
                if label[following] != field:
                    continue
                new_cost = here + (DIAGONAL if k & 1 else STRAIGHT)
                place = place_of[following]
                if new_cost >= cost[place]:  # what does not fit is as good as unreached
                    continue
                cost[place] = new_cost
                came[place] = (k + 4) & 7
                into = new_cost // STRAIGHT % 3
                ring[into, count[into]] = following
                count[into] += 1
                left += 1
        left -= count[at]
        count[at] = 0
        turn += 1


@njit(cache=True)
def fill_sides(moves, cols, label, place_of, sizes, side_field, side_cell, offset, steps, towards):
    """Fill `steps` and `towards` of all sides of portals, which are sorted by field.

    Returned are the exact costs between the sides of each field: those of side j are
    `between[begin[j]:begin[j + 1]]`.
    """
    n_sides = side_field.size
    begin = np.zeros(n_sides + 1, np.int64)
    first = 0
    while first < n_sides:
        last = first
        while last < n_sides and side_field[last] == side_field[first]:
            last += 1
        for j in range(first, last):
            begin[j + 1] = begin[j] + last - first
        first = last
    between = np.empty(begin[n_sides], np.int32)
    largest = sizes.max() if sizes.size > 0 else 0
    cost = np.empty(largest, np.int32)
    ring = np.empty((3, 8 * largest + 8), np.int32)
    first = 0
    for j in range(n_sides):
        if side_field[j] != side_field[first]:
            first = j
        size = sizes[side_field[j]]
        view = towards[offset[j] : offset[j] + size]
        fill_field(moves, cols, label, place_of, side_cell[j], cost[:size], view, ring)
        for i in range(size):
            step = (np.int64(cost[i]) * STEPS_PER_CELL + STRAIGHT // 2) // STRAIGHT
            steps[offset[j] + i] = min(step, FARTHEST)
        for i in range(begin[j + 1] - begin[j]):
            between[begin[j] + i] = cost[place_of[side_cell[first + i]]]
    return begin, between


@njit(cache=True)
def best_portals(start_sides, start_steps, goal_sides, goal_steps, table):
    """Of all ways over a portal of the start's field and one of the goal's the shortest.

    Steps are those to the lower side of each portal. Returned are the positions of the two in the
    lists, -1 where no way joins the cells, and the length of the way in steps.
    """
    best = np.float32(np.inf)
    first = last = -1
    for i in range(start_sides.size):
        if start_steps[i] >= best:
            continue
        for j in range(goal_sides.size):
            length = start_steps[i] + table[start_sides[i], goal_sides[j]] + goal_steps[j]
            if length < best:
                best = length
                first, last = i, j
    return first, last, best


@njit(cache=True)
def follow(towards, offset, place_of, cols, cell, path, count):
    """Append the cells from one to the source of a side's field; gives the new count."""
    while True:
        path[count] = cell
        count += 1
        k = towards[offset + place_of[cell]]
        if k == SOURCE:
            return count
        cell += _ROW_STEP[k] * cols + _COL_STEP[k]


@njit(cache=True)
def steps_to_source(towards, offset, place_of, cols, cell):
    """Distance to the source of a side's field, summed along the path, in steps."""
    cost = 0
    while True:
        k = towards[offset + place_of[cell]]
        if k == SOURCE:
            return cost * (STEPS_PER_CELL / STRAIGHT)
        cost += DIAGONAL if k & 1 else STRAIGHT
        cell += _ROW_STEP[k] * cols + _COL_STEP[k]


@njit(cache=True)
def field_between(p, q, label, sides, cells, across, side_start, between, between_start):
    """The field through which the shortest way leads from a portal to the next on its way."""
    best = np.int64(np.iinfo(np.int64).max)
    through = -1
    for one in range(2):
        field = label[cells[p, one]]
        for other in range(2):
            if label[cells[q, other]] != field:
                continue
            leg = between[between_start[sides[p, one]] + sides[q, other] - side_start[field]]
            if leg == np.iinfo(np.int32).max:
                continue
            cost = leg + across[sides[p, one]] + across[sides[q, other]]
            if cost < best:
                best = cost
                through = field
    return through


@njit(cache=True)
def way(
    start,
    goal,
    cols,
    label,
    place_of,
    passed,
    sides,
    cells,
    offset,
    towards,
    path,
    across,
    side_start,
    between,
    between_start,
):
    """Cells from start to goal over some portals; gives their number. `sides` and `cells` are
    those of each portal, lower and higher, (n, 2); `path` has room for them."""
    count = 0
    cell = start
    field = label[start]
    for i in range(passed.size):
        p = passed[i]
        side = 0 if label[cells[p, 0]] == field else 1
        count = follow(towards, offset[sides[p, side]], place_of, cols, cell, path, count)
        cell = cells[p, side]
        if i + 1 < passed.size:
            via = field_between(
                p, passed[i + 1], label, sides, cells, across, side_start, between, between_start
            )
        else:
            via = label[goal]
        if via == field:
            count -= 1  # on from the same cell
        else:
            cell = cells[p, 1 - side]
            field = via
    # In the goal's field backwards, from the goal to where the way enters or turns.
    last = passed[passed.size - 1]
    side = 0 if label[cells[last, 0]] == field else 1
    begin = count
    count = follow(towards, offset[sides[last, side]], place_of, cols, goal, path, count)
    path[begin:count] = path[begin:count][::-1].copy()
    return count
