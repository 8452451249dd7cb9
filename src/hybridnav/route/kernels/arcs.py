"""Kernels on the arcs of a graph: cheapest walks, and what lies beside a walk."""

import heapq

import numpy as np

from hybridnav._base.jit import guarded, njit


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


@njit(cache=True, nogil=True)
def joined_to(arcs, weight, least):
    """Return the vertices that enough arcs join to those of a walk, bool (n_vertices,).

    `arcs`: int32 or int64 (n_arcs, 2); `weight`: int8 (n_vertices,): 2 at the ends of the walk, 1
    at its other vertices, else 0: for how many arcs an arc to the vertex counts; `least`: how many
    arcs a vertex needs.
    """
    joined = np.zeros(weight.size, np.int64)
    for i in range(len(arcs)):
        u, v = arcs[i, 0], arcs[i, 1]
        joined[u] += weight[v]
        joined[v] += weight[u]
    return joined >= least
