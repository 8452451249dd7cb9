"""Kernels of queries on a jump-point graph: the search, and the cells of the path that it finds."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.jumps._leg_kernels import FAR, row_col_kind
from hybridnav.jumps._search_kernels import FROM_START, NO_ARC, shortest


@njit(cache=True, nogil=True)
def _arc_between(arcs, tail, head):
    """Return the arc of a hierarchy from a corner cell to one contracted later."""
    first, table, _ = arcs
    for arc in range(first[tail], first[tail + 1]):
        if table[arc, 1] >> 8 == head:
            return arc
    return NO_ARC


@njit(cache=True, nogil=True)
def _unpack(arcs, tail, head, arc, stack, nodes, count):
    """Append what follows its tail on the way of an arc to the corner cells of a path.

    Returns the corner cells, another array where there was no room, and their number.
    """
    middles = arcs[2]
    stack[0, 0], stack[0, 1], stack[0, 2] = tail, head, arc
    depth = 1
    while depth > 0:
        depth -= 1
        tail, head, arc = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        middle = np.int64(middles[arc]) if middles.size > 0 else np.int64(-1)
        if middle < 0:
            if count == nodes.size:
                larger = np.empty(2 * count, np.int64)
                larger[:count] = nodes
                nodes = larger
            nodes[count] = head
            count += 1
            continue
        after, before = _arc_between(arcs, middle, head), _arc_between(arcs, middle, tail)
        stack[depth, 0], stack[depth, 1], stack[depth, 2] = middle, head, after
        depth += 1
        stack[depth, 0], stack[depth, 1], stack[depth, 2] = tail, middle, before
        depth += 1
    return nodes, count


@njit(cache=True, nogil=True)
def _corner_cells(arcs, meeting, records, chain, stack):
    """Return the corner cells that a path passes, from the start to the goal.

    Parameters
    ----------
    arcs
        Where the arcs of each corner cell begin, the arcs, their middles, none in a graph that is
        not contracted.
    meeting, records
        What the search left behind.
    chain
        Room for as many as there are corner cells.
    stack
        int64 (n + 2, 3), room for arcs to unpack.
    """
    n_chain = 0
    node = meeting
    while records[node, 2] != NO_ARC:
        chain[n_chain] = node
        n_chain += 1
        node = records[node, 2] >> 32
    nodes = np.empty(64, np.int64)
    nodes[0] = node
    count = 1
    for i in range(n_chain - 1, -1, -1):
        head = np.int64(chain[i])
        by = records[head, 2]
        nodes, count = _unpack(arcs, by >> 32, head, by & 0xFFFFFFFF, stack, nodes, count)
    node = meeting
    while records[node, 3] != NO_ARC:
        by = records[node, 3]
        nodes, count = _unpack(arcs, node, by >> 32, by & 0xFFFFFFFF, stack, nodes, count)
        node = by >> 32
    return nodes[:count]


@njit(cache=True, nogil=True)
def _step(rows, cols):
    """Return -1, 0 or 1 for each of two offsets."""
    return int(rows > 0) - int(rows < 0), int(cols > 0) - int(cols < 0)


@njit(cache=True, nogil=True)
def _walk(cells, n_cells, rows, cols, is_side_first):
    """Append the cells of a leg, by its offsets from the cell before; return their number and the
    leg's moves along a side and along a diagonal."""
    diagonal = min(abs(rows), abs(cols))
    straight = max(abs(rows), abs(cols)) - diagonal
    row, col = cells[n_cells - 1, 0], cells[n_cells - 1, 1]
    for part in range(2):
        if (part == 0) == is_side_first:
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
def _cells_of(graph, ends, meeting, nodes, origin, cells, n_cells):
    """Append the cells of a path to `cells`; return these, another array where there was no room,
    their number, and the path's moves along sides and along diagonals."""
    (_, _, width, _), places = graph[:2]
    row, col = ends[0] // width, ends[0] % width
    cells = _with_room(cells, n_cells, 1)
    cells[n_cells, 0], cells[n_cells, 1] = row + origin[0], col + origin[1]
    n_cells += 1
    n_straight = n_diagonal = np.int64(0)
    for i in range(nodes.size + 1):
        to_row, to_col = ends[1] // width, ends[1] % width
        if i < nodes.size:
            to_row, to_col, _ = row_col_kind(places[nodes[i]])
        rows, cols = to_row - row, to_col - col
        cells = _with_room(cells, n_cells, max(abs(rows), abs(cols)))
        # The last leg is free in the order of the goal.
        is_side_first = i == nodes.size and meeting != FROM_START
        n_cells, straight, diagonal = _walk(cells, n_cells, rows, cols, is_side_first)
        n_straight += straight
        n_diagonal += diagonal
        row, col = to_row, to_col
    return cells, n_cells, n_straight, n_diagonal


@njit(cache=True, nogil=True)
def _with_room(cells, n_cells, more):
    """Return cells with room for some more, a copy where they have none."""
    if n_cells + more <= cells.shape[0]:
        return cells
    larger = np.empty((2 * (n_cells + more), 2), np.int64)
    larger[:n_cells] = cells[:n_cells]
    return larger


@guarded
@njit(cache=True, nogil=True)
def paths(graph, middles, origin, ends, work):
    """Find shortest paths between pairs of cells.

    Parameters
    ----------
    graph
        See `shortest`.
    middles
        int32 (m,), what the arcs of a hierarchy lead past; empty for a graph that is not
        contracted.
    origin
        Row and column of the framed grid's first cell.
    ends
        int64 (k, 4), row and column of the start, then of the goal; free cells.
    work
        See `shortest`, and a stack of int64 (n + 2, 3).

    Returns
    -------
    tuple
        int64 (k + 1,), where the cells of each path begin; int64 (c, 2), the cells (row, col);
        int64 (k, 3), moves along sides, moves along diagonals, -1 for both where there is no path,
        and corner cells expanded.
    """
    width, (first, table) = graph[0][2], graph[4]
    work_of_search, stack = work
    records, _, touched, found = work_of_search
    n = ends.shape[0]
    begin = np.zeros(n + 1, np.int64)
    counts = np.full((n, 3), np.int64(-1))
    cells = np.empty((256, 2), np.int64)
    n_cells = np.int64(0)
    for i in range(n):
        pair = (
            (ends[i, 0] - origin[0]) * width + ends[i, 1] - origin[1],
            (ends[i, 2] - origin[0]) * width + ends[i, 3] - origin[1],
        )
        cost, meeting, counts[i, 2], n_touched = shortest(
            graph, pair, middles.size > 0, work_of_search
        )
        if cost < FAR:
            nodes = touched[:0]
            if meeting >= 0:
                nodes = _corner_cells((first, table, middles), meeting, records, found, stack)
            cells, n_cells, counts[i, 0], counts[i, 1] = _cells_of(
                graph, pair, meeting, nodes, origin, cells, n_cells
            )
        for k in range(n_touched):
            records[touched[k], 0] = records[touched[k], 1] = FAR
        begin[i + 1] = n_cells
    return begin, cells[:n_cells], counts
