"""Kernels of the nodes of a path, from those of the highest level that it passes downwards."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._cost_kernels import clique_place, least_cost
from hybridnav.overlay._field_kernels import rank, with_room
from hybridnav.overlay._lane_kernels import FAR, NO_PATH
from hybridnav.overlay._node_kernels import START
from hybridnav.search.arrays import grow, pop, push


@njit(cache=True, nogil=True)
def append(nodes, n, node):
    """Append a node; return the array, a new one if there was no room."""
    if n == nodes.size:
        nodes = grow(nodes)
    nodes[n] = node
    return nodes


@njit(cache=True, nogil=True)
def _next(levels, span, row, node):
    """Return the node after one on a shortest path; see `_walk`."""
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
def _walk(levels, span, row, node, last, nodes, n):
    """Append the nodes of a shortest path to a node, from their distances to it.

    Parameters
    ----------
    levels
        See `Levels`.
    span
        The first node and the one after the last that the path may pass.
    row
        int32 (nodes of the span,), their distances to the last one.
    node, last
        Where the path begins and ends.
    nodes, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `nodes`, in a new array if there was no room, and their number, without the first node.
    """
    while node != last:
        node = _next(levels, span, row, node)
        nodes = append(nodes, n, node)
        n += 1
    return nodes, n


@njit(cache=True, nogil=True)
def over_top(levels, top, first, last):
    """Return the nodes of the last level on a shortest path between two of them; see `Top`."""
    span = (levels.node_at[levels.level_at[-2]], levels.node_at[levels.level_at[-1]])
    nodes = np.empty(64, np.int64)
    nodes[0] = first
    nodes, n = _walk(levels, span, top.distance[last - span[0]], first, last, nodes, 1)
    return nodes[:n]


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
def _inside(levels, field):
    """Return the nodes of the level below inside a field: the first, and the one after the last."""
    return (
        levels.node_at[levels.inner_at[field]],
        levels.node_at[levels.inner_at[field + 1]],
    )


@njit(cache=True, nogil=True)
def _row_of(levels, node):
    """Return the distances from a node to the nodes of the level below inside its field."""
    field = levels.field_of[node]
    span = _inside(levels, field)
    width = span[1] - span[0]
    at = levels.table_at[field] + (node - levels.node_at[field]) * width
    return levels.table[at : at + width]


@njit(cache=True, nogil=True)
def _entry(levels, node, child, below):
    """Return the node of a field of the level below over which a path from inside it led to a node.

    Parameters
    ----------
    levels
        See `Levels`.
    node
        Node of the upper level.
    child
        The field of the level below, inside the node's field.
    below
        int64 (n,), the distances to the nodes of `child`.
    """
    row = _row_of(levels, node)
    span = _inside(levels, levels.field_of[node])
    first, last = levels.node_at[child], levels.node_at[child + 1]
    best, found = np.int64(NO_PATH), first
    for inner in range(first, last):
        total = below[inner - first] + row[inner - span[0]]
        if row[inner - span[0]] < FAR and total < best:
            best, found = total, np.int64(inner)
    return found


@njit(cache=True, nogil=True)
def descend(levels, level, upper, children, reaches):
    """Return the nodes of a path with those of one level replaced by nodes of the level below.

    Parameters
    ----------
    levels
        See `Levels`.
    level
        The level, > 1.
    upper
        int64 (n,), n >= 1, nodes of this level and of levels below.
    children
        The fields of start and goal on the level below.
    reaches
        Two int64 (n,), the distances inside them, from the start and to the goal.
    """
    begin = levels.node_at[levels.level_at[level]]
    first, last = upper[0], upper[-1]
    nodes, n = np.empty(2 * upper.size + 64, np.int64), 1
    nodes[0] = first
    if first >= begin:
        nodes[0] = _entry(levels, first, children[0], reaches[0])
        span, row = _inside(levels, levels.field_of[first]), _row_of(levels, first)
        nodes, n = _walk(levels, span, row, nodes[0], np.int64(levels.below[first]), nodes, 1)
    for i in range(1, upper.size):
        before, node = upper[i - 1], upper[i]
        field = levels.field_of[node]
        if node >= begin and levels.field_of[before] == field:
            start, end = np.int64(levels.below[before]), np.int64(levels.below[node])
            span, row = _inside(levels, field), _row_of(levels, node)
            nodes, n = _walk(levels, span, row, start, end, nodes, n)
        else:
            nodes = append(nodes, n, levels.below[node] if node >= begin else node)
            n += 1
    if last >= begin:
        tail = np.empty(64, np.int64)
        tail[0] = _entry(levels, last, children[1], reaches[1])
        span, row = _inside(levels, levels.field_of[last]), _row_of(levels, last)
        tail, m = _walk(levels, span, row, tail[0], np.int64(levels.below[last]), tail, 1)
        for i in range(m - 2, -1, -1):
            nodes = append(nodes, n, tail[i])
            n += 1
    return nodes[:n]


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
    nodes[:n] = nodes[:n][::-1].copy()
    for node in upper:
        nodes = append(nodes, n, node)
        n += 1
    nodes, n = _walk_out(levels, upper[-1], children[1], reaches[1], rows[1], nodes, n)
    return nodes[:n]


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
        int64 (room,) and how many of them are filled.
    """
    if node < levels.node_at[levels.level_at[1]]:
        return append(nodes, n, node), n + 1
    span = _inside(levels, levels.field_of[node])
    first = levels.node_at[child]
    node = np.int64(levels.below[node])
    nodes = append(nodes, n, node)
    n += 1
    while levels.field_of[node] != child or row[node - span[0]] != below[node - first]:
        node = _next(levels, span, row, node)
        nodes = append(nodes, n, node)
        n += 1
    return nodes, n


@njit(cache=True, nogil=True)
def to_finest(levels, ground, upper):
    """Return the nodes of a path with those of the level above the finest replaced.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    upper
        int64 (n,), nodes of the two finest levels.
    """
    if len(levels.level_at) == 2:
        return upper
    begin = levels.node_at[levels.level_at[1]]
    nodes, n = np.empty(4 * upper.size + 64, np.int64), 0
    for i in range(upper.size):
        node = upper[i]
        field = levels.field_of[node]
        if i > 0 and node >= begin and levels.field_of[upper[i - 1]] == field:
            first = levels.node_at[field]
            place = clique_place(upper[i - 1] - first, node - first)
            endpoints = np.int64(levels.below[upper[i - 1]]), np.int64(levels.below[node])
            limit = np.int64(levels.clique[levels.clique_at[field] + place])
            nodes, n = _over_inner(levels, ground, field, endpoints, limit, nodes, n)
        else:
            nodes = append(nodes, n, levels.below[node] if node >= begin else node)
            n += 1
    return nodes[:n]


@njit(cache=True, nogil=True)
def _over_inner(levels, ground, field, endpoints, limit, nodes, n):
    """Append the nodes of a shortest path inside a field over those of the level below, by A*.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    field
        A field above the finest level.
    endpoints
        The first node, which is not appended, and the last one.
    limit
        Its cost.
    nodes, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `nodes`, in a new array if there was no room, and their number.
    """
    span = _inside(levels, field)
    begin = np.int64(span[0])
    distance = np.full(span[1] - begin, NO_PATH, np.int64)
    before = np.empty(span[1] - begin, np.int32)
    bound = np.full(span[1] - begin, -1, np.int64)
    heap, size = np.empty((256, 2), np.int64), 1
    goal_cell, cols = levels.cell_of[endpoints[1]], ground.cols
    push(heap, 0, np.int64(0), endpoints[0])
    distance[endpoints[0] - begin], before[endpoints[0] - begin], bound[endpoints[0] - begin] = (
        0,
        endpoints[0],
        0,
    )
    while size > 0 and distance[endpoints[1] - begin] > limit:
        key = heap[0, 0]
        node = pop(heap, size)
        size -= 1
        value, own = distance[node - begin], levels.field_of[node]
        if key != rank(value, bound[node - begin]):
            continue
        inside, moves = levels.node_at[own], levels.move_at[node]
        mark = np.int64(before[node - begin])
        # After a distance over a clique comes a move.
        count = levels.node_at[own + 1] - inside if mark >= 0 else 0
        heap = with_room(heap, size, count + levels.move_at[node + 1] - moves)
        for k in range(count + levels.move_at[node + 1] - moves):
            if k < count:
                place = levels.clique_at[own] + clique_place(node - inside, k)
                other, cost, mark = inside + k, np.int64(levels.clique[place]), ~node
            else:
                other = np.int64(levels.move_to[moves + k - count])
                cost, mark = np.int64(levels.move_cost[moves + k - count]), node
                if not span[0] <= other < span[1]:
                    continue
            offered = value + cost
            if offered > limit or offered >= distance[other - begin]:
                continue
            ahead = bound[other - begin]
            if ahead < 0:
                ahead = least_cost(levels.cell_of[other], goal_cell, cols, ground.least_units)
                bound[other - begin] = ahead
            if offered + ahead <= limit:
                distance[other - begin], before[other - begin] = offered, mark
                push(heap, size, rank(offered, ahead), other)
                size += 1
    first, node = n, endpoints[1]
    while node != endpoints[0]:
        nodes = append(nodes, n, node)
        n += 1
        mark = np.int64(before[node - begin])
        node = mark if mark >= 0 else ~mark
    nodes[first:n] = nodes[first:n][::-1].copy()
    return nodes, n
