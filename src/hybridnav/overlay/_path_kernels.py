"""Kernels of the nodes of a path, from those of the highest level that it passes downwards."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._cost_kernels import clique_place
from hybridnav.search.arrays import grow

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
