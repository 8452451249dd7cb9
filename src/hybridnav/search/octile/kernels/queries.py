"""Kernels of queries on a jump-point graph: the search, and the cells of the path that it finds."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push
from hybridnav._base.moves import FAR, octile_cost
from hybridnav.search.contraction import corners_between
from hybridnav.search.octile.kernels.legs import FROM_GOAL, FROM_START, row_col_kind, shortest
from hybridnav.search.octile.kernels.patch import code_of, is_direct_patched, join_patched


@njit(cache=True, nogil=True)
def _step(rows, cols):
    """Return -1, 0 or 1 for each of two offsets."""
    return int(rows > 0) - int(rows < 0), int(cols > 0) - int(cols < 0)


@njit(cache=True, nogil=True)
def _walk(cells, n_cells, rows, cols, is_straight_first):
    """Append the cells of a leg, by its offsets from the cell before.

    Return their number and the moves of the leg along a side and along a diagonal.
    """
    diagonal = min(abs(rows), abs(cols))
    straight = max(abs(rows), abs(cols)) - diagonal
    row, col = cells[n_cells - 1, 0], cells[n_cells - 1, 1]
    for part in range(2):
        if (part == 0) == is_straight_first:
            is_tall = abs(rows) > abs(cols)
            row_step, col_step = _step(rows if is_tall else 0, 0 if is_tall else cols)
            count = straight
        else:
            row_step, col_step = _step(rows, cols)
            count = diagonal
        for _ in range(count):
            row += row_step
            col += col_step
            cells[n_cells, 0], cells[n_cells, 1] = row, col
            n_cells += 1
    return n_cells, straight, diagonal


@njit(cache=True, nogil=True)
def cells_of(graph, endpoints, meeting, nodes, origin, cells, n_cells):
    """Append the cells of a path to `cells`.

    Parameters
    ----------
    graph, endpoints, meeting
        See `shortest`.
    nodes
        int32 (m,), the corner cells on the path.
    origin
        As in `paths`.
    cells, n_cells
        int64 (room, 2) as (row, col), and how many of them are filled.

    Returns
    -------
    tuple
        The cells, in a new array if there was no room; their number; the moves of the path along
        sides and along diagonals.
    """
    (_, _, _, width), places = graph[:2]
    row, col = endpoints[0] // width, endpoints[0] % width
    cells = _with_room(cells, n_cells, 1 + _moves(places, width, endpoints, nodes))
    cells[n_cells, 0], cells[n_cells, 1] = row + origin[0], col + origin[1]
    n_cells += 1
    n_straight = n_diagonal = np.int64(0)
    for i in range(nodes.size + 1):
        to_row, to_col = endpoints[1] // width, endpoints[1] % width
        if i < nodes.size:
            to_row, to_col, _ = row_col_kind(places[nodes[i]])
        rows, cols = to_row - row, to_col - col
        # The last leg is free in the order of the goal.
        is_straight_first = i == nodes.size and meeting != FROM_START
        n_cells, straight, diagonal = _walk(cells, n_cells, rows, cols, is_straight_first)
        n_straight += straight
        n_diagonal += diagonal
        row, col = to_row, to_col
    return cells, n_cells, n_straight, n_diagonal


@njit(cache=True, nogil=True)
def _moves(places, width, endpoints, nodes):
    """Count the moves of a path."""
    row, col = endpoints[0] // width, endpoints[0] % width
    count = np.int64(0)
    for i in range(nodes.size + 1):
        to_row, to_col = endpoints[1] // width, endpoints[1] % width
        if i < nodes.size:
            to_row, to_col, _ = row_col_kind(places[nodes[i]])
        count += max(abs(to_row - row), abs(to_col - col))
        row, col = to_row, to_col
    return count


@njit(cache=True, nogil=True)
def _with_room(cells, n_cells, more):
    """Return an array of cells with room for `more`: the same one, or a copy."""
    if n_cells + more <= cells.shape[0]:
        return cells
    # The first path gets the room that it needs; after that the room doubles.
    larger = np.empty((2 * n_cells + more, 2), np.int64)
    larger[:n_cells] = cells[:n_cells]
    return larger


@guarded
@njit(cache=True, nogil=True)
def paths(graph, middles, origin, endpoints, work):
    """Find shortest paths between pairs of cells.

    Parameters
    ----------
    graph
        See `shortest`.
    middles
        int64 (m,), the corner cells that the arcs of a contracted graph lead past; empty for a
        graph that is not contracted.
    origin
        Row and column of the framed grid's first cell.
    endpoints
        int64 (k, 4), row and column of the start, then of the goal; free cells.
    work
        See `shortest`.

    Returns
    -------
    tuple
        int64 (k + 1,), where the cells of each path begin; int64 (c, 2), the cells (row, col);
        int64 (k, 3), moves along sides, moves along diagonals, -1 for both where there is no path,
        and corner cells expanded.
    """
    width, first = graph[0][3], graph[4][0]
    records, _, touched, _ = work
    n = endpoints.shape[0]
    begin = np.zeros(n + 1, np.int64)
    counts = np.full((n, 3), np.int64(-1))
    cells = np.empty((0, 2), np.int64)
    n_cells = np.int64(0)
    for i in range(n):
        pair = (
            (endpoints[i, 0] - origin[0]) * width + endpoints[i, 1] - origin[1],
            (endpoints[i, 2] - origin[0]) * width + endpoints[i, 3] - origin[1],
        )
        cost, meeting, counts[i, 2], n_touched = shortest(graph, pair, middles.size > 0, work)
        if cost < FAR:
            nodes = touched[:0]
            if meeting >= 0:
                nodes = corners_between((first, middles), meeting, records)
            cells, n_cells, counts[i, 0], counts[i, 1] = cells_of(
                graph, pair, meeting, nodes, origin, cells, n_cells
            )
        for k in range(n_touched):
            records[touched[k], 0] = records[touched[k], 1] = FAR
        begin[i + 1] = n_cells
    return begin, cells[:n_cells], counts


# Kernels of the search on a patched jump-point graph.


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

    # Two cells with a free leg between them need no corner cell, and no path is shorter.
    if is_direct_patched(tables, patch, start, goal):
        return octile_cost(rows, cols), np.int64(FROM_START), 0
    if is_direct_patched(tables, patch, goal, start):
        return octile_cost(rows, cols), np.int64(FROM_GOAL), 0

    # Each corner cell at the goal knows the cost of the last leg: expanded, it completes a path.
    n_goals = _joined_to(graph, goal, found)
    for k in range(n_goals):
        row, col, _ = row_col_kind(places[found[k]])
        records[found[k], 1] = octile_cost(row - goal_row, col - goal_col)

    # The start is expanded first, as node -1. From here on `found` holds the heads of the arcs from
    # the cell (row, col), reached at `cost`.
    best, last, expanded, size = FAR, np.int64(FROM_START), 0, 0
    node, cost, row, col = np.int64(-1), np.int64(0), start // width, start % width
    n_found = _joined_to(graph, start, found)
    while n_goals > 0:
        for k in range(n_found):
            other = np.int64(found[k])
            to_row, to_col, _ = row_col_kind(places[other])

            # An arc is a free leg, whose cost is the octile distance: arcs of new corner cells need
            # no stored one.
            further = cost + octile_cost(to_row - row, to_col - col)
            estimate = further + octile_cost(to_row - goal_row, to_col - goal_col)
            if further >= records[other, 0] or estimate >= best:
                continue
            records[other, 0], records[other, 2] = further, node
            if size == len(heap):
                heap = np.concatenate((heap, heap))
            push(heap, size, estimate, other)
            size += 1

        # The estimates are lower bounds: nothing that waits is part of a better path.
        if size == 0 or heap[0, 0] >= best:
            break
        estimate = heap[0, 0]
        node = np.int64(pop(heap, size))
        size -= 1
        row, col, _ = row_col_kind(places[node])
        cost, n_found = records[node, 0], 0

        # An entry that is out of date is dropped: without heads, the next turn takes another one.
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
