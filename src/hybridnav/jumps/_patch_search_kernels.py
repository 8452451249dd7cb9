"""Kernels of the search on a patched jump-point graph."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.jumps._leg_kernels import row_col_kind
from hybridnav.jumps._patch_kernels import code_of, is_direct_patched, join_patched
from hybridnav.jumps._query_kernels import cells_of
from hybridnav.jumps._search_kernels import FROM_GOAL, FROM_START
from hybridnav.search.arrays import pop, push
from hybridnav.search.moves import FAR, octile_cost


@njit(cache=True, nogil=True)
def _joined_to(graph, cell, found):
    """Find the corner cells that an end of a path is joined to: itself, if it is one."""
    tables, patch = graph[:2]
    code = code_of(tables, patch, cell)
    if code < 0:
        return join_patched(tables, patch, cell, found)
    found[0] = code
    return 1


@njit(cache=True, nogil=True)
def _heads(graph, node, found):
    """Find the corner cells that arcs lead to from one: by its stored arcs, or from its cell."""
    tables, patch, places, is_stale, first, arcs = graph
    if node < is_stale.size and not is_stale[node]:
        n_found = first[node + 1] - first[node]
        for k in range(n_found):
            found[k] = arcs[first[node] + k, 1] >> 12
        return n_found
    row, col, _ = row_col_kind(places[node])
    return join_patched(tables, patch, row * tables[3] + col, found)


@njit(cache=True, nogil=True)
def shortest_patched(graph, endpoints, work):
    """Search for a shortest path between two cells by A* from the start.

    Parameters
    ----------
    graph
        Tables (see `join`), patch (see `code_of`), int64 (n,) places of all corner cells, bool (m,)
        those of the tables whose arcs are stale, and the stored arcs: where those of each corner
        cell begin, int64 (a, 2) cost and head (see `arcs_of`).
    endpoints
        Flat cells of start and goal.
    work
        Records, int64 (n, 3), filled with `FAR`: cost from the start, cost to the goal, and the
        corner cell before, -1 for none; room for n corner cells, int32; a heap, int64 (h, 2).

    Returns
    -------
    tuple
        Cost, `FAR` where there is no path; the last corner cell, `FROM_START` or `FROM_GOAL`;
        corner cells expanded.
    """
    tables, patch, places = graph[:3]
    records, found, heap = work
    width = tables[3]
    start, goal = endpoints
    goal_row, goal_col = goal // width, goal % width
    rows, cols = goal_row - start // width, goal_col - start % width
    if is_direct_patched(tables, patch, start, goal):
        return octile_cost(rows, cols), np.int64(FROM_START), 0
    if is_direct_patched(tables, patch, goal, start):
        return octile_cost(rows, cols), np.int64(FROM_GOAL), 0
    n_goals = _joined_to(graph, goal, found)
    for k in range(n_goals):
        row, col, _ = row_col_kind(places[found[k]])
        records[found[k], 1] = octile_cost(row - goal_row, col - goal_col)
    best, last, expanded, size = FAR, np.int64(FROM_START), 0, 0
    node, cost, row, col = np.int64(-1), np.int64(0), start // width, start % width
    n_found = _joined_to(graph, start, found)
    while n_goals > 0:
        for k in range(n_found):
            other = np.int64(found[k])
            to_row, to_col, _ = row_col_kind(places[other])
            further = cost + octile_cost(to_row - row, to_col - col)
            estimate = further + octile_cost(to_row - goal_row, to_col - goal_col)
            if further >= records[other, 0] or estimate >= best:
                continue
            records[other, 0], records[other, 2] = further, node
            if size == len(heap):
                heap = np.concatenate((heap, heap))
            push(heap, size, estimate, other)
            size += 1
        if size == 0 or heap[0, 0] >= best:
            break
        estimate = heap[0, 0]
        node = np.int64(pop(heap, size))
        size -= 1
        row, col, _ = row_col_kind(places[node])
        cost, n_found = records[node, 0], 0
        if estimate != cost + octile_cost(row - goal_row, col - goal_col):
            continue
        expanded += 1
        if records[node, 1] != FAR and cost + records[node, 1] < best:
            best, last = cost + records[node, 1], node
        n_found = _heads(graph, node, found)
    return best, last, expanded


@guarded
@njit(cache=True, nogil=True)
def paths_patched(graph, origin, endpoints):
    """Find shortest paths between pairs of cells; see `paths`, and `shortest_patched` for the
    graph."""
    width, places = graph[0][3], graph[2]
    n = endpoints.shape[0]
    begin = np.zeros(n + 1, np.int64)
    counts = np.full((n, 3), np.int64(-1))
    cells = np.empty((0, 2), np.int64)
    n_cells = np.int64(0)
    records, found = np.empty((places.size, 3), np.int64), np.empty(places.size + 1, np.int32)
    heap, nodes = np.empty((1024, 2), np.int64), np.empty(places.size, np.int32)
    for i in range(n):
        pair = (
            (endpoints[i, 0] - origin[0]) * width + endpoints[i, 1] - origin[1],
            (endpoints[i, 2] - origin[0]) * width + endpoints[i, 3] - origin[1],
        )
        records[:] = FAR
        cost, last, counts[i, 2] = shortest_patched(graph, pair, (records, found, heap))
        if cost < FAR:
            low, at = places.size, last
            while at >= 0:
                low -= 1
                nodes[low] = at
                at = records[at, 2]
            if low < places.size and last >= 0:
                last = np.int64(0)
            cells, n_cells, counts[i, 0], counts[i, 1] = cells_of(
                (graph[0], places), pair, last, nodes[low:], origin, cells, n_cells
            )
        begin[i + 1] = n_cells
    return begin, cells[:n_cells], counts
