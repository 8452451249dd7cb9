"""Kernel that finds the parts of a graph behind passages."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit


@njit(cache=True, nogil=True)
def behind_passages(first, neighbour, is_passage, start, goal):
    """Return the nodes that the removal of some passage separates from start and goal; bool (n,).

    One depth-first search with low points (J. Hopcroft, R. E. Tarjan 1973) on the graph whose node
    n has the neighbours neighbour[first[n]:first[n + 1]], without parallel edges.
    """
    n_nodes = is_passage.size
    order = np.full(n_nodes, np.int64(-1), np.int64)
    low = np.empty(n_nodes, np.int64)
    parent = np.empty(n_nodes, np.int64)
    met = np.empty(n_nodes, np.int64)
    stack = np.empty(n_nodes, np.int64)
    following = first.copy()
    # By the order in which nodes are met a subtree is an interval: where one begins and ends.
    cuts = np.zeros(n_nodes + 1, np.int64)
    order[start] = low[start] = 0
    parent[start] = -1
    met[0] = stack[0] = start
    n_met = n_stack = 1
    while n_stack > 0:
        node = stack[n_stack - 1]
        if following[node] < first[node + 1]:
            other = neighbour[following[node]]
            following[node] += 1
            if order[other] < 0:
                order[other] = low[other] = n_met
                parent[other] = node
                met[n_met] = stack[n_stack] = other
                n_met += 1
                n_stack += 1
            elif other != parent[node]:
                low[node] = min(low[node], order[other])
            continue
        n_stack -= 1
        above = parent[node]
        if above < 0:
            continue
        low[above] = min(low[above], low[node])
        if is_passage[above] and low[node] >= order[above] and order[goal] < order[node]:
            cuts[order[node]] += 1
            cuts[n_met] -= 1
    behind = np.zeros(n_nodes, np.bool_)
    depth = 0
    for i in range(n_met):
        depth += cuts[i]
        behind[met[i]] = depth > 0
    return behind
