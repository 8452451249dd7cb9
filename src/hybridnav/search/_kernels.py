"""Kernels of the searches: legal moves, A* on cells, distances inside fields, arcs of a graph.

Costs on the octile grid are integers: STRAIGHT for a step along a side, DIAGONAL for one along a
diagonal. DIAGONAL / STRAIGHT = 114243 / 80782 is a convergent of sqrt 2: no fraction with a smaller
denominator lies between the two, so integer costs order any two paths exactly as a + b sqrt 2 does,
as long as their numbers of diagonal steps differ by less than 80782.
"""

from __future__ import annotations

import heapq

import numpy as np
from numba import njit

from hybridnav.search._costs import DIAGONAL, STRAIGHT

_COST_BITS = 44
_COST_MASK = (1 << _COST_BITS) - 1
GENERATIONS = 1 << (62 - _COST_BITS)
"""Searches that one `best` array serves before it must be filled anew."""

# Directions in the order east, north-east, north, ... counter-clockwise, row step and column step.
_ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1], np.int64)
_COL_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1], np.int64)

# Width of a bucket of the open list. Measured on a map of 0.8 M cells: an eighth to a half of a
# straight step are equal within noise, a full step expands 20 % more.
_BUCKET = STRAIGHT // 4


@njit(cache=True)
def octile_cost(rows, cols):
    """Cost of the shortest path between cells without obstacles, from their offsets."""
    rows, cols = abs(rows), abs(cols)
    if rows < cols:
        rows, cols = cols, rows
    return STRAIGHT * (rows - cols) + DIAGONAL * cols


@njit(cache=True)
def legal_moves(enterable, corner_cutting):
    """Byte mask of the legal moves of each cell, bit k for direction k.

    A diagonal needs both side cells enterable, unless corners may be cut. Moves are judged on the
    whole grid, once.
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


@njit(cache=True)
def grow(array):
    """A copy of an array with twice the room."""
    larger = np.empty(2 * array.size, array.dtype)
    larger[: array.size] = array
    return larger


@njit(cache=True)
def astar(moves, cols, start, goal, field_of, in_corridor, best, came, generation):
    """Cost of the optimal path between two flat cells over the cells of a corridor, -1 for none.

    `field_of` None makes the whole map the corridor (the kernel is compiled for both). The open
    list is an array of buckets of f, each a stack: the newest entry of a bucket comes first, which
    breaks ties in favour of the deeper cell. A cell can be expanded again within a bucket; the
    search ends when no entry below the goal's cost is left, so the cost is optimal.

    `best` holds, for each cell, a code that falls with every generation, so nothing has to be
    cleared between searches; `came` the direction by which each cell was reached. Also returned
    is the number of expansions.
    """
    stamp = np.int64(GENERATIONS - 1 - generation) << _COST_BITS
    goal_row, goal_col = goal // cols, goal % cols
    origin = octile_cost(start // cols - goal_row, start % cols - goal_col)
    heads = np.full(1024, np.int32(-1), np.int32)
    entry_cell = np.empty(4096, np.int32)
    entry_cost = np.empty(4096, np.int64)
    entry_next = np.empty(4096, np.int32)
    entry_cell[0], entry_cost[0], entry_next[0] = start, 0, -1
    heads[0] = 0
    n_entries = 1
    best[start] = stamp
    bucket = last_bucket = 0
    goal_cost = np.int64(0) if start == goal else np.int64(_COST_MASK)
    expanded = 0
    while bucket <= last_bucket:
        entry = heads[bucket]
        if entry < 0:
            bucket += 1
            if origin + bucket * _BUCKET >= goal_cost:
                break
            continue
        heads[bucket] = entry_next[entry]
        cell, cost = np.int64(entry_cell[entry]), entry_cost[entry]
        if best[cell] != stamp | cost:
            continue
        row, col = cell // cols, cell % cols
        if cost + octile_cost(row - goal_row, col - goal_col) >= goal_cost:
            continue
        expanded += 1
        mask = moves[cell]
        for k in range(8):
            if not mask >> k & 1:
                continue
            row_step, col_step = _ROW_STEP[k], _COL_STEP[k]
            following = cell + row_step * cols + col_step
            if field_of is not None and not in_corridor[field_of[following]]:
                continue
            new_cost = cost + (DIAGONAL if k & 1 else STRAIGHT)
            if stamp | new_cost >= best[following]:
                continue
            estimate = new_cost + octile_cost(row + row_step - goal_row, col + col_step - goal_col)
            if estimate >= goal_cost:
                continue
            best[following] = stamp | new_cost
            came[following] = k
            if following == goal:
                goal_cost = new_cost
                continue
            into = (estimate - origin) // _BUCKET
            if into > last_bucket:
                last_bucket = into
                while into >= heads.size:
                    size = heads.size
                    heads = grow(heads)
                    heads[size:] = -1
            if n_entries == entry_cell.size:
                entry_cell, entry_cost = grow(entry_cell), grow(entry_cost)
                entry_next = grow(entry_next)
            entry_cell[n_entries] = following
            entry_cost[n_entries] = new_cost
            entry_next[n_entries] = heads[into]
            heads[into] = n_entries
            n_entries += 1
    return (-1 if goal_cost == _COST_MASK else goal_cost), expanded


@njit(cache=True)
def trace(came, cols, start, goal):
    """Flat cells of the path that a search left behind, from start to goal."""
    count = 1
    cell = goal
    while cell != start:
        k = came[cell]
        cell -= _ROW_STEP[k] * cols + _COL_STEP[k]
        count += 1
    path = np.empty(count, np.int64)
    cell = goal
    for i in range(count - 1, 0, -1):
        path[i] = cell
        k = came[cell]
        cell -= _ROW_STEP[k] * cols + _COL_STEP[k]
    path[0] = start
    return path


@njit(cache=True)
def field_distances(classes, field_of, sources):
    """Cost of the shortest path inside each field from its source cell to every cell of it, -1
    where a cell belongs to no field.

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
                    to_row, to_col = row + _ROW_STEP[k], col + _COL_STEP[k]
                    if to_row < 0 or to_row >= rows or to_col < 0 or to_col >= cols:
                        continue
                    to = to_row * cols + to_col
                    if field_of[to] != v:
                        continue
                    if k & 1:
                        side, other_side = classes[row, to_col], classes[to_row, col]
                        if side == 0 or other_side == 0:
                            continue
                        if free_only and (side != 1 or other_side != 1):
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


@njit(cache=True)
def cheapest_arcs(first, neighbour, arc, costs, ties, allowed, start, goal):
    """Dijkstra over the arcs of a multigraph: arcs of the cheapest walk, ties by a second cost.

    The arcs out of vertex v are positions first[v] .. first[v + 1] of `neighbour` and `arc`.
    Returns the arcs from start to goal, whether there is such a walk, and the expansions.
    """
    n_vertices = first.size - 1
    cost = np.full(n_vertices, np.inf)
    tie = np.full(n_vertices, np.inf)
    by_arc = np.full(n_vertices, -1, np.int64)
    previous = np.full(n_vertices, -1, np.int64)
    closed = np.zeros(n_vertices, np.bool_)
    cost[start] = tie[start] = 0.0
    heap = [(0.0, 0.0, np.int64(start))]
    expanded = 0
    while len(heap) > 0:
        _, _, v = heapq.heappop(heap)
        if closed[v]:
            continue
        closed[v] = True
        if v == goal:
            break
        expanded += 1
        for i in range(first[v], first[v + 1]):
            w = neighbour[i]
            if closed[w] or not allowed[w]:
                continue
            new_cost, new_tie = cost[v] + costs[arc[i]], tie[v] + ties[arc[i]]
            if new_cost < cost[w] or (new_cost == cost[w] and new_tie < tie[w]):
                cost[w], tie[w] = new_cost, new_tie
                by_arc[w], previous[w] = arc[i], v
                heapq.heappush(heap, (new_cost, new_tie, np.int64(w)))
    count = 0
    v = goal
    while v != start and previous[v] >= 0:
        count += 1
        v = previous[v]
    arcs = np.empty(count, np.int64)
    v = goal
    for i in range(count - 1, -1, -1):
        arcs[i] = by_arc[v]
        v = previous[v]
    return arcs, closed[goal], expanded
