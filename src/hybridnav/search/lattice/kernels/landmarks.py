"""Kernels of landmarks: nodes from which the cost of reaching every other node is known.

By the triangle inequality, the costs from a landmark to two nodes differ by at most the cost from
one node to the other: a lower bound that a search reads from a table.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push

_UNITS = 2.0**16
"""Units of a cell in keys of the open list."""


@guarded
@njit(cache=True, nogil=True)
def costs_from(edges_of, to, costs, source):
    """Find the least cost from a node to each other one, by Dijkstra's algorithm; float32 (nodes,),
    infinite where there is no path.

    Parameters
    ----------
    edges_of, to, costs
        See `build.lay_edges`.
    source
        The node.
    """
    reached = np.full(edges_of.shape[0], np.inf)
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
    return reached.astype(np.float32)


@njit(cache=True, nogil=True)
def _largest_part(edges_of, to, order):
    """Return the nodes of the largest connected part; of equal ones, that of the first node."""
    is_seen = np.zeros(edges_of.shape[0], np.bool_)
    reached, size, best, first_of_best = np.empty(order.size, np.int64), 0, 0, 0
    for node in order:
        if is_seen[node]:
            continue
        begin, at = size, size
        is_seen[node], reached[size] = True, node
        size += 1
        while at < size:
            first, count = edges_of[reached[at]]
            at += 1
            for edge in range(first, first + count):
                if not is_seen[to[edge]]:
                    is_seen[to[edge]], reached[size] = True, to[edge]
                    size += 1
        if size - begin > best:
            best, first_of_best = size - begin, begin
    return reached[first_of_best : first_of_best + best]


@guarded
@njit(cache=True, nogil=True)
def choose_landmarks(edges_of, to, cells, cols, order, n):
    """Choose nodes far from each other, int64 (k,), k <= n: as the crow flies, so that each is
    chosen without a search.

    They lie in the largest connected part of the map. The first one is the farthest from the
    middle of its nodes, each next one the farthest from those chosen.

    Parameters
    ----------
    edges_of, to
        See `build.lay_edges`.
    cells
        int32 (nodes,), flat cells.
    cols
        Columns of the map.
    order
        int64 (m,), the nodes that blocks have, in the order of their cells.
    n
        Most landmarks.
    """
    part = _largest_part(edges_of, to, order)
    n = min(n, part.size)
    row, col = cells[part] // cols + 0.0, cells[part] % cols + 0.0
    from_row, from_col = row.mean(), col.mean()
    nearest = np.full(part.size, np.inf)
    chosen = np.empty(n, np.int64)
    for k in range(n):
        most, farthest = -1.0, 0
        for i in range(part.size):
            away = (row[i] - from_row) ** 2 + (col[i] - from_col) ** 2
            nearest[i] = away if k < 2 else min(nearest[i], away)
            if nearest[i] > most:
                most, farthest = nearest[i], i
        chosen[k] = part[farthest]
        from_row, from_col = row[farthest], col[farthest]
    return chosen
