"""Kernels of the searches: distances inside fields, arcs of a graph."""

from __future__ import annotations

import heapq

import numpy as np

from hybridnav._base.jit import guarded, njit
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
