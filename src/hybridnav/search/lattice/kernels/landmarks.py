"""Kernels of landmarks: nodes from which the cost of reaching every other node is known.

By the triangle inequality, the costs from a landmark to two nodes differ by at most the cost from
one node to the other: a lower bound that a search reads from a table.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push

_UNITS = 2.0**16
"""Units of a cell in keys of the open list."""
_MOST_PARTS = 32
"""Connected parts of a map of which the largest is taken."""


@njit(cache=True, nogil=True)
def _reach(edges_of, to, costs, source, reached):
    """Find the least cost from a node to each other one, infinite where there is no path, by
    Dijkstra's algorithm; see `costs_from_landmarks`."""
    reached[:] = np.inf
    reached[source] = 0.0
    heap, size = np.empty((max(to.size, 1), 2), np.int64), 1
    heap[0, 0], heap[0, 1] = 0, source
    while size > 0:
        key = heap[0, 0]
        node = pop(heap, size)
        size -= 1
        here = reached[node]
        if key > np.int64(here * _UNITS):  # reached more cheaply since
            continue
        first, count = edges_of[node]
        for edge in range(first, first + count):
            whole = here + abs(costs[edge])
            if whole < reached[to[edge]]:
                reached[to[edge]] = whole
                if size == heap.shape[0]:
                    larger = np.empty((2 * size, 2), np.int64)
                    larger[:size] = heap
                    heap = larger
                push(heap, size, np.int64(whole * _UNITS), to[edge])
                size += 1


@guarded
@njit(cache=True, nogil=True)
def costs_from_landmarks(edges_of, to, costs, order, n):
    """Choose landmarks far from each other; return the costs from each to all nodes, float32
    (nodes, n), infinite where there is no path.

    They lie in the largest connected part of the map. The first one is the farthest from its first
    node, each next one the farthest from those chosen.

    Parameters
    ----------
    edges_of, to, costs
        See `build.lay_edges`.
    order
        int64 (m,), the nodes that blocks have, in the order of their cells.
    n
        Number of landmarks.
    """
    table = np.full((edges_of.shape[0], n), np.inf, np.float32)
    reached, is_seen = np.empty(edges_of.shape[0]), np.zeros(edges_of.shape[0], np.bool_)
    # The largest connected part of the map, and the node in it that is farthest from its first.
    source, size, tried = -1, 0, 0
    for first in order:
        if is_seen[first] or tried == _MOST_PARTS:
            continue
        tried += 1
        _reach(edges_of, to, costs, first, reached)
        count, farthest, most = 0, first, 0.0
        for node in order:
            if reached[node] < np.inf:
                is_seen[node] = True
                count += 1
                if reached[node] > most:
                    farthest, most = node, reached[node]
        if count > size:
            source, size = farthest, count
        if 2 * size >= order.size:
            break
    nearest = np.full(edges_of.shape[0], np.inf)
    for k in range(n if size > 0 else 0):
        _reach(edges_of, to, costs, source, reached)
        most = 0.0
        for node in order:
            table[node, k] = reached[node]
            nearest[node] = min(nearest[node], reached[node])
            if most < nearest[node] < np.inf:
                source, most = node, nearest[node]
    return table
