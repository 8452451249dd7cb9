"""Kernels of the nodes of a path, from those of the highest level that it passes downwards."""

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.arrays import grow, pop, push
from hybridnav.search.overlay.kernels.costs import clique_place, least_cost
from hybridnav.search.overlay.kernels.fields import rank, with_room
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH

START = -(1 << 30)
"""Mark of the nodes at which a search began."""


@njit(cache=True, nogil=True)
def append(nodes, n, node):
    """Append a node; return the array, a new one if there was no room."""
    if n == nodes.size:
        nodes = grow(nodes)
    nodes[n] = node
    return nodes


@njit(cache=True, nogil=True)
def next_node(levels, span, row, node):
    """Return the node after one on a shortest path to another one of the same level.

    Parameters
    ----------
    levels
        See `Levels`.
    span
        The first node and the one after the last that the path may pass.
    row
        int (nodes of the span,), their distances to the last one.
    node
        The node.

    Returns
    -------
    int
        -1 if no node leads on.
    """
    first, rest = span[0], row[node - span[0]]
    for at in range(levels.move_at[node], levels.move_at[node + 1]):
        other = levels.move_to[at]
        if span[0] <= other < span[1]:
            if levels.move_cost[at] + row[other - first] == rest:
                return np.int64(other)
    field = levels.field_of[node]
    begin, end = levels.node_at[field], levels.node_at[field + 1]
    at = levels.clique_at[field]
    for other in range(begin, end):
        cost = levels.clique[at + clique_place(node - begin, other - begin)]
        if other != node and cost + row[other - first] == rest:
            return np.int64(other)
    return np.int64(-1)


@njit(cache=True, nogil=True)
def back_over_cliques(before, last):
    """Return the nodes that led to the last one; see `over_cliques`."""
    nodes, n, node = np.empty(64, np.int64), 0, np.int64(last)
    while node != START:
        nodes = append(nodes, n, node)
        n += 1
        mark = np.int64(before[node])
        node = mark if mark >= 0 or mark == START else ~mark
    return nodes[:n][::-1].copy()


@njit(cache=True, nogil=True)
def inside_of(levels, field):
    """Return the nodes of the level below inside a field: the first, and the one after the last."""
    return (
        levels.node_at[levels.inner_at[field]],
        levels.node_at[levels.inner_at[field + 1]],
    )


@njit(cache=True, nogil=True)
def join_ends(levels, upper, children, reaches, rows):
    """Return the nodes of a path, joined with those of the finest level that lead to its ends.

    Some follow each other on the same cell.

    Parameters
    ----------
    levels
        See `Levels`.
    upper
        int64 (n,), n >= 1, nodes of the two finest levels.
    children
        The fields of start and goal on the finest level.
    reaches
        Two int64 (n,), the distances inside them, from the start and to the goal.
    rows
        What `climb` returned for start and goal.
    """
    nodes = np.empty(2 * upper.size + 64, np.int64)
    nodes, n = _walk_out(levels, upper[0], children[0], reaches[0], rows[0], nodes, 0)
    if n < 0:
        return nodes[:0]
    nodes[:n] = nodes[:n][::-1].copy()
    for node in upper:
        nodes = append(nodes, n, node)
        n += 1
    nodes, n = _walk_out(levels, upper[-1], children[1], reaches[1], rows[1], nodes, n)
    return nodes[: max(n, 0)]


@njit(cache=True, nogil=True)
def _walk_out(levels, node, child, below, row, nodes, n):
    """Append the nodes of the finest level from a node back to one that a cell reaches directly.

    Parameters
    ----------
    levels
        See `Levels`.
    node
        Node of the finest level, which is appended alone, or of the next one.
    child
        The field of the finest level around the cell.
    below
        int64 (n,), the distances from the cell to the nodes of `child`.
    row
        int64 (n,), those to all nodes of the finest level inside the node's field.
    nodes, n
        int64 (room,) and how many of them are filled; -1 is returned if no path is as long as the
        distances state.
    """
    if node < levels.node_at[levels.level_at[1]]:
        return append(nodes, n, node), n + 1
    span = inside_of(levels, levels.field_of[node])
    first = levels.node_at[child]
    node = np.int64(levels.below[node])
    nodes = append(nodes, n, node)
    n += 1
    for _ in range(row.size):
        if levels.field_of[node] == child and row[node - span[0]] == below[node - first]:
            return nodes, n
        node = next_node(levels, span, row, node)
        if node < 0:
            break
        nodes = append(nodes, n, node)
        n += 1
    return nodes, -1


# Kernels of the paths between nodes of the level above the finest, inside their fields.
#
# The nodes below that lie on such paths are marked when the costs of the field are computed, a bit
# for each of them and each node at which paths end. A search that passes marked nodes alone is
# quick.


@njit(cache=True, nogil=True)
def mark_paths(levels, field, table):
    """Mark a shortest path between every two nodes of a field of the level above the finest.

    Parameters
    ----------
    levels
        See `Levels`; its marks are changed.
    field
        The field.
    table
        int32 (n, m), the distances inside it from its nodes to those of the level below.
    """
    first, span = levels.node_at[field], inside_of(levels, field)
    marks = levels.marks[levels.marks_at[field] : levels.marks_at[field + 1]]
    marks[:] = 0
    n, width = table.shape
    for i in range(n):
        last, row = np.int64(levels.below[first + i]), table[i]
        for j in range(i):
            node = np.int64(levels.below[first + j])
            while node >= 0 and node != last and row[node - span[0]] < FAR:
                bit = i * width + node - span[0]
                if marks[bit >> 3] >> (bit & 7) & 1:
                    break
                marks[bit >> 3] |= np.uint8(1 << (bit & 7))
                node = next_node(levels, span, row, node)


@njit(cache=True, nogil=True)
def to_finest(levels, ground, upper):
    """Return the nodes of a path with those of the level above the finest replaced.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    upper
        int64 (n,), nodes of the two finest levels.

    Returns
    -------
    ndarray
        int64 (m,), empty if no path is as long as the costs state.
    """
    if len(levels.level_at) == 2:
        return upper
    begin = levels.node_at[levels.level_at[1]]
    nodes, n = np.empty(4 * upper.size + 64, np.int64), 0
    for i in range(upper.size):
        node = upper[i]
        field = levels.field_of[node]
        if i > 0 and node >= begin and levels.field_of[upper[i - 1]] == field:
            # Marks lead from the node of the smaller number to the other one.
            low, high = min(upper[i - 1], node), max(upper[i - 1], node)
            if low == high:
                continue
            filled = n
            nodes, n = _over_marked(levels, ground, low, high, nodes, n)
            if n < 0:
                return nodes[:0]
            if high == node:
                nodes[filled:n] = nodes[filled:n][::-1].copy()
            nodes = append(nodes, n, levels.below[node])
        else:
            nodes = append(nodes, n, levels.below[node] if node >= begin else node)
        n += 1
    return nodes[:n]


@njit(cache=True, nogil=True)
def _over_marked(levels, ground, low, high, nodes, n):
    """Append the nodes between two on a shortest path over marked ones, from the last to the first.

    A* expands nodes that a move reaches, over the clique to the moves beyond it. Its order need not
    prove the cost, which is known.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    low, high
        Two nodes of a field of the level above the finest, the smaller number first; neither is
        appended.
    nodes, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `nodes`, in a new array if there was no room, and their number, -1 if no path is as long as
        the costs state.
    """
    # The mark of a node is bit `row + node`: a row of bits for each node at which paths end.
    field = levels.field_of[high]
    span, first = inside_of(levels, field), levels.node_at[field]
    begin, width = np.int64(span[0]), np.int64(span[1] - span[0])
    marks = levels.marks[levels.marks_at[field] : levels.marks_at[field + 1]]
    row = (high - first) * width - begin

    # The stored distance is what the path costs: all that costs more is dropped.
    limit = np.int64(
        levels.clique[levels.clique_at[field] + clique_place(high - first, low - first)]
    )
    start, goal = np.int64(levels.below[low]), np.int64(levels.below[high])
    distance, before = np.full(width, NO_PATH, np.int64), np.empty(width, np.int32)
    heap, size, goal_cell = np.empty((64, 2), np.int64), 1, levels.cell_of[goal]
    push(heap, 0, np.int64(0), start)
    distance[start - begin], before[start - begin] = 0, start

    # Only nodes that a move reaches wait: after a step over a clique comes a move, or the goal.
    while size > 0 and distance[goal - begin] > limit:
        entry = heap[0, 1]
        pop(heap, size)
        size -= 1
        value, own = distance[entry - begin], levels.field_of[entry]
        inside = levels.node_at[own]
        for node in range(inside, levels.node_at[own + 1]):
            bit = row + node

            # The goal itself has no mark: paths are marked up to it.
            if not marks[bit >> 3] >> (bit & 7) & 1 and node != goal:
                continue
            offered = value
            if node != entry:
                place = clique_place(entry - inside, node - inside)
                offered += levels.clique[levels.clique_at[own] + place]
                if offered > limit or offered >= distance[node - begin]:
                    continue
                distance[node - begin], before[node - begin] = offered, entry

            # The bound from here also ranks the far ends of the moves, as their order need not be
            # exact.
            ahead = least_cost(levels.cell_of[node], goal_cell, ground.cols, ground.least_units)
            if offered + ahead > limit:
                continue
            moves = levels.move_at[node], levels.move_at[node + 1]
            heap = with_room(heap, size, moves[1] - moves[0])
            for at in range(moves[0], moves[1]):
                other = np.int64(levels.move_to[at])
                if not span[0] <= other < span[1]:
                    continue
                bit, total = row + other, offered + levels.move_cost[at]
                if not marks[bit >> 3] >> (bit & 7) & 1 and other != goal:
                    continue
                if total <= limit and total < distance[other - begin]:
                    distance[other - begin], before[other - begin] = total, node
                    push(heap, size, rank(total, ahead), other)
                    size += 1

    # No path has the stored distance: the caller returns no nodes rather than wrong ones.
    if distance[goal - begin] > limit:
        return nodes, -1

    # Back from the goal, without either end: the caller appends these.
    node = np.int64(before[goal - begin])
    while node != start:
        nodes = append(nodes, n, node)
        n += 1
        node = np.int64(before[node - begin])
    return nodes, n
