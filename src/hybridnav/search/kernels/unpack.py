"""Kernels that unpack a path from the records of a search of a contracted graph."""

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.arrays import grow, grow_rows

NO_ARC = -1
"""Arc of the corners that a search began with."""


@njit(cache=True, nogil=True)
def _unpack(arcs, entry, nodes, count):
    """Append the corners on an arc to those of a path, except its tail.

    `entry` holds the corner where the arc is entered, the corner where it is left, and the number
    of the arc, or -1 minus that number if it is passed backwards. Return the corners, a new array
    if there was no room, and their number.
    """
    first, middles = arcs
    stack = np.empty((64, 3), np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2] = entry
    depth = 1
    while depth > 0:
        depth -= 1
        tail, head, arc = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        past = middles[max(arc, -1 - arc)] if middles.size else np.int64(NO_ARC)
        if past < 0:
            if count == nodes.size:
                nodes = grow(nodes)
            nodes[count] = head
            count += 1
            continue
        if depth + 2 > stack.shape[0]:
            stack = grow_rows(stack)
        middle = past >> 32
        back, on = first[middle] + (past >> 16 & 0xFFFF), first[middle] + (past & 0xFFFF)
        if arc < 0:
            back, on = on, back
        stack[depth, 0], stack[depth, 1], stack[depth, 2] = middle, head, on
        depth += 1
        stack[depth, 0], stack[depth, 1], stack[depth, 2] = tail, middle, -1 - back
        depth += 1
    return nodes, count


@njit(cache=True, nogil=True)
def corners_between(arcs, meeting, records):
    """Return the corners that a path passes, from the start to the goal.

    `arcs`: offsets of the arcs of each corner, and their middles, from `contract`; no middles in a
    graph that is not contracted. `meeting`: the corner where the searches from both endpoints meet;
    `records`: int64 (n, 4): columns 2 and 3 hold the tail (in the high half) and arc by which each
    corner was reached from the start and from the goal, or `NO_ARC`. Returns int64 (k,).
    """
    chain = np.empty(64, np.int64)
    n_chain = 0
    node = np.int64(meeting)
    while records[node, 2] != NO_ARC:
        if n_chain == chain.size:
            chain = grow(chain)
        chain[n_chain] = node
        n_chain += 1
        node = records[node, 2] >> 32
    nodes = np.empty(64, np.int64)
    nodes[0] = node
    count = 1
    for i in range(n_chain - 1, -1, -1):
        by = records[chain[i], 2]
        nodes, count = _unpack(arcs, (by >> 32, chain[i], by & 0xFFFFFFFF), nodes, count)
    node = np.int64(meeting)
    while records[node, 3] != NO_ARC:
        by = records[node, 3]
        nodes, count = _unpack(arcs, (node, by >> 32, -1 - (by & 0xFFFFFFFF)), nodes, count)
        node = by >> 32
    return nodes[:count]
