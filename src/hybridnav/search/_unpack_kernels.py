"""Kernels that read a path off what a search of a contracted graph left behind."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit

NO_ARC = -1
"""By what a search reached the corners that it began with."""


@njit(cache=True, nogil=True)
def _arc_between(arcs, tail, head):
    """Return the arc of a hierarchy from a corner to one contracted later."""
    first, table, _ = arcs
    for arc in range(first[tail], first[tail + 1]):
        if table[arc, 1] >> 12 == head:
            return arc
    return NO_ARC


@njit(cache=True, nogil=True)
def _unpack(arcs, way, nodes, count):
    """Append the corners on the way of an arc to those of a path, but for its tail.

    `way` is its tail, its head, and itself or its reverse. Returns the corners, another array where
    there was no room, and their number.
    """
    middles = arcs[2]
    stack = np.empty((64, 3), np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2] = way
    depth = 1
    while depth > 0:
        depth -= 1
        tail, head, arc = stack[depth, 0], stack[depth, 1], stack[depth, 2]
        middle = np.int64(middles[arc]) if middles.size > 0 else np.int64(-1)
        if middle < 0:
            if count == nodes.size:
                nodes = np.concatenate((nodes, nodes))
            nodes[count] = head
            count += 1
            continue
        if depth + 2 > stack.shape[0]:
            stack = np.concatenate((stack, stack))
        after, before = _arc_between(arcs, middle, head), _arc_between(arcs, middle, tail)
        stack[depth, 0], stack[depth, 1], stack[depth, 2] = middle, head, after
        depth += 1
        stack[depth, 0], stack[depth, 1], stack[depth, 2] = tail, middle, before
        depth += 1
    return nodes, count


@njit(cache=True, nogil=True)
def corners_between(arcs, meeting, records):
    """Return the corners that a path passes, from the start to the goal.

    Parameters
    ----------
    arcs
        Where the arcs of each corner begin, the arcs, their middles: of `contract`; without middles
        in a graph that is not contracted.
    meeting
        The corner where the searches from both ends meet.
    records
        int64 (n, 4): columns 2 and 3 hold by what tail (in the high half) and arc each corner was
        reached from the start and from the goal, or `NO_ARC`.

    Returns
    -------
    numpy.ndarray
        int64 (k,).
    """
    chain = np.empty(64, np.int64)
    n_chain = 0
    node = np.int64(meeting)
    while records[node, 2] != NO_ARC:
        if n_chain == chain.size:
            chain = np.concatenate((chain, chain))
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
        nodes, count = _unpack(arcs, (node, by >> 32, by & 0xFFFFFFFF), nodes, count)
        node = by >> 32
    return nodes[:count]
