"""Kernels of the searches: A* on cells, distances inside fields, arcs of a graph."""

from __future__ import annotations

import heapq

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.search._move_kernels import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT, octile_cost

# A record of A*: generation, cost modulo 2^19, direction of arrival (see `astar`).
_DIRECTION_BITS = 3
_COST_BITS = 19
_GENERATION_SHIFT = _DIRECTION_BITS + _COST_BITS
_COST_MASK = (1 << _COST_BITS) - 1
_SAME_GENERATION = 1 << _GENERATION_SHIFT
GENERATIONS = (1 << (32 - _GENERATION_SHIFT)) - 1
"""Number of searches after which the array of records must be filled with zeros again."""

BUCKET_FULL = -2
"""Returned by `astar` when a bucket of its open list is full."""

# Width of a bucket of the open list, 0.41 of a straight step; a quarter and an eighth of that are
# equal within noise. A move raises f by less than 2 * DIAGONAL, 7 buckets: 8 take turns.
_BUCKET_SHIFT = 15
BUCKETS = 8


@guarded
@njit(cache=True, nogil=True)
def forbid(moves, cols, blocked, corner_cutting):
    """Remove all moves into, out of and past the corners of some flat cells from the masks.

    Return the flat cells whose masks may have changed, and their former masks.
    """
    rows = moves.size // cols
    touched = np.empty(9 * blocked.size, np.int64)
    n_touched = 0
    for cell in blocked:
        row, col = cell // cols, cell % cols
        for to_row in range(max(row - 1, 0), min(row + 2, rows)):
            for to_col in range(max(col - 1, 0), min(col + 2, cols)):
                touched[n_touched] = to_row * cols + to_col
                n_touched += 1
    touched = touched[:n_touched]
    masks = moves[touched]
    for cell in blocked:
        moves[cell] = 0
        row, col = cell // cols, cell % cols
        for k in range(8):
            to_row, to_col = row + ROW_STEP[k], col + COL_STEP[k]
            if to_row < 0 or to_row >= rows or to_col < 0 or to_col >= cols:
                continue
            gone = 1 << (k + 4 & 7)
            if not (k & 1 or corner_cutting):
                gone |= 1 << (k + 3 & 7) | 1 << (k + 5 & 7)
            moves[to_row * cols + to_col] &= 255 - gone
    return touched, masks


@guarded
@njit(cache=True, nogil=True)
def astar(
    moves,
    cols,
    endpoints,
    limit,
    successors,
    detours,
    field_of,
    in_corridor,
    records,
    generation,
    waiting,
):
    """Return the cost of the optimal path between two flat cells in a corridor, and the expansions.

    The cost is -1 if there is no path below `limit`, `BUCKET_FULL` if a bucket is full.

    The open list is a ring of buckets of f, each a stack of cells: the newest comes first, which
    breaks ties in favour of the deeper cell. A successor in the current bucket is expanded next
    without a stay in its bucket, as the newest one would be. A cell can be expanded again within a
    bucket; the search ends when no entry below the goal's cost is left, so the cost is optimal.

    A record holds the generation of the search that wrote it, so that nothing has to be cleared
    between searches, the direction of arrival, and the cost modulo 2^19. That is enough, W being
    the width of a bucket: (1) A cell p is expanded within W of its least cost g*(p), for its f lies
    in the first bucket that is not empty, and some cell of an optimal path to p waits there or
    later at its least cost. (2) So p offers its neighbour q less than g*(p) + W + DIAGONAL, which
    is less than W + 2 * DIAGONAL above the record of q. (3) The record of q had an f of less than W
    + 2 * DIAGONAL above the start of the bucket from which it was written, and no later offer has
    an f below that start: the offer is less than W + 2 * DIAGONAL below the record. As W + 2 *
    DIAGONAL < 2^18, the difference modulo 2^19 has the sign of the difference. Likewise the bucket
    of a waiting cell determines its full cost, and an entry whose cell has been improved since is
    found outside its bucket, or is as good as the newer one.

    No array grows here: with arrays that may be replaced in the loop, numba's code took 50 %
    longer. Indices are unsigned because a test for negative ones took 15 % of the time.

    Parameters
    ----------
    moves, cols
        uint8 (n_cells,), the legal moves of each flat cell, and the columns of the grid.
    endpoints, limit
        Flat cells of start and goal, and the integer cost that a path must stay below.
    successors, detours
        Those of `grid_search.move_tables`.
    field_of
        int16 or int32 (n_cells,), a label for each cell; None makes the whole map the corridor (the
        kernel is compiled for both).
    in_corridor
        bool by label, whether such a cell may be stood on.
    records, waiting
        uint32 (n_cells,), and the open list.
    generation
        Number of this search, below `GENERATIONS`.
    """
    start, goal = endpoints
    stamp = np.int64(generation) << _GENERATION_SHIFT
    goal_row, goal_col = goal // cols, goal % cols
    per_col = 1.0 / cols
    room = waiting.size // BUCKETS
    count = np.zeros(BUCKETS, np.int64)
    n_waiting = 0
    bucket = slot = np.int64(0)
    cell, cost, k = np.int64(start), np.int64(0), np.int64(8)
    row, col = cell // cols, cell % cols
    origin = octile_cost(row - goal_row, col - goal_col)
    records[start] = stamp
    bound = np.int64(limit)
    if start == goal:
        bound = np.int64(0)
    expanded = 0
    while True:
        expanded += 1
        index = k << 8 | np.int64(moves[np.uint64(cell)])
        todo = np.int64(successors[np.uint64(index)])
        if field_of is not None:
            spared = np.int64(detours[np.uint64(index)])
            while spared != 0:
                pruned = spared & 7
                spared >>= 4
                via = pruned + (1 if pruned - k & 7 < 4 else -1) & 7
                if not in_corridor[field_of[cell + ROW_STEP[via] * cols + COL_STEP[via]]]:
                    todo = todo << 4 | 8 | pruned
        following = np.int64(-1)
        following_row = following_col = following_cost = following_k = np.int64(0)
        while todo != 0:
            k = todo & 7
            todo >>= 4
            row_step, col_step = ROW_STEP[np.uint64(k)], COL_STEP[np.uint64(k)]
            to = cell + row_step * cols + col_step
            if field_of is not None and not in_corridor[field_of[to]]:
                continue
            new_cost = cost + STRAIGHT + (k & 1) * (DIAGONAL - STRAIGHT)
            known = np.int64(records[np.uint64(to)]) ^ stamp
            if known < _SAME_GENERATION:
                gain = (known >> _DIRECTION_BITS) - new_cost & _COST_MASK
                if gain == 0 or gain > _COST_MASK >> 1:
                    continue
            to_row, to_col = row + row_step, col + col_step
            estimate = new_cost + octile_cost(to_row - goal_row, to_col - goal_col)
            if estimate >= bound:
                continue
            records[np.uint64(to)] = stamp | (new_cost & _COST_MASK) << _DIRECTION_BITS | k
            if to == goal:
                bound = new_cost
                continue
            into = estimate - origin >> _BUCKET_SHIFT
            entry = to
            if into == bucket:
                entry = following
                following, following_cost, following_k = to, new_cost, k
                following_row, following_col = to_row, to_col
                if entry < 0:
                    continue
            into &= BUCKETS - 1
            if count[np.uint64(into)] == room:
                return BUCKET_FULL, expanded
            waiting[np.uint64(into * room + count[np.uint64(into)])] = entry
            count[np.uint64(into)] += 1
            n_waiting += 1
        if following >= 0:
            cell, cost, k = following, following_cost, following_k
            row, col = following_row, following_col
            continue
        found = False
        while n_waiting > 0:
            if count[np.uint64(slot)] == 0:
                bucket += 1
                slot = bucket & BUCKETS - 1
                if origin + (bucket << _BUCKET_SHIFT) >= bound:
                    break
                continue
            count[np.uint64(slot)] -= 1
            n_waiting -= 1
            cell = np.int64(waiting[np.uint64(slot * room + count[np.uint64(slot)])])
            # Exact: half a cell off any multiple, and far fewer than 2^50 cells.
            row = np.int64((cell + 0.5) * per_col)
            col = cell - row * cols
            estimate = octile_cost(row - goal_row, col - goal_col)
            least = origin + (bucket << _BUCKET_SHIFT) - estimate
            record = np.int64(records[np.uint64(cell)])
            cost = least + ((record >> _DIRECTION_BITS) - least & _COST_MASK)
            if cost - least >> _BUCKET_SHIFT != 0 or cost + estimate >= bound:
                continue
            k = record & 7
            found = True
            break
        if not found:
            break
    return (bound if bound < limit else -1), expanded


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


@guarded
@njit(cache=True, nogil=True)
def cheapest_arcs(first, neighbour, arc, costs, ties, allowed, start, goal):
    """Find the cheapest walk over the arcs of a multigraph (Dijkstra), ties by a second cost.

    Parameters
    ----------
    first, neighbour, arc
        int32 or int64: the arcs out of vertex v are positions first[v] .. first[v + 1] of the other
        two.
    costs, ties
        float64 (n_arcs,), >= 0.
    allowed
        bool (n_vertices,).
    start, goal
        Vertices.

    Returns
    -------
    tuple
        The arcs from start to goal, whether there is such a walk, and the expansions.
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
