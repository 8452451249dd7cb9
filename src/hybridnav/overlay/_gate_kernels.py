"""Kernels of gates: nodes of the last level between which distances are kept.

Each move between fields of the last level leads from or to a gate. They are mostly the nodes of one
side of each border: half of them, with a quarter of the distances.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.overlay._lane_kernels import FAR, NO_PATH


@guarded
@njit(cache=True, nogil=True)
def gates_among(move_at, move_to, first, last):
    """Return nodes such that one end of each move between nodes is among them, ascending.

    The other end of a node that has one move left is taken; where there is none, the node with
    the most moves.

    Parameters
    ----------
    move_at, move_to
        See `Levels`.
    first, last
        The first of the nodes, and the one after the last.
    """
    n = last - first
    is_gate, left = np.zeros(n, np.bool_), np.zeros(n, np.int64)
    single, size = np.empty(move_at[last] - move_at[first] + n, np.int64), 0
    for i in range(n):
        left[i] = move_at[first + i + 1] - move_at[first + i]
        if left[i] == 1:
            single[size] = i
            size += 1
    while True:
        taken = -1
        if size > 0:
            size -= 1
            i = single[size]
            if left[i] != 1 or is_gate[i]:
                continue
            for at in range(move_at[first + i], move_at[first + i + 1]):
                if not is_gate[move_to[at] - first]:
                    taken = move_to[at] - first
        else:
            taken = np.argmax(left) if n > 0 else -1
            if taken < 0 or left[taken] == 0:
                break
        is_gate[taken], left[taken] = True, 0
        for at in range(move_at[first + taken], move_at[first + taken + 1]):
            other = move_to[at] - first
            left[other] -= 0 if is_gate[other] else 1
            if left[other] == 1 and not is_gate[other]:
                single[size] = other
                size += 1
    return (first + np.flatnonzero(is_gate)).astype(np.int32)


@njit(cache=True, nogil=True)
def gates_near(levels, top, field, reach):
    """Return the gates in a field, and beside its other nodes, with the distances to them.

    Parameters
    ----------
    levels, top
        See `Levels` and `Top`.
    field
        One of the last level.
    reach
        int64 (n,), the distances to its nodes.

    Returns
    -------
    tuple
        int64 (k,) each: places of gates in `Top.gates`, the least distances, and the nodes of the
        field over which they lead.
    """
    origin = levels.node_at[levels.level_at[len(levels.level_at) - 2]]
    first, last = levels.node_at[field], levels.node_at[field + 1]
    room = last - first + levels.move_at[last] - levels.move_at[first]
    gates, costs, over = (
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
    )
    place, n = np.full(top.gates.size, -1, np.int32), 0
    for node in range(first, last):
        value = reach[node - first]
        if value >= NO_PATH:
            continue
        own = top.gate_of[node - origin]
        moves = (levels.move_at[node], levels.move_at[node + 1]) if own < 0 else (-1, 0)
        for at in range(moves[0], moves[1]):
            gate, total = own, value
            if at >= 0:
                if levels.move_cost[at] >= FAR:
                    continue
                gate, total = top.gate_of[levels.move_to[at] - origin], value + levels.move_cost[at]
            if place[gate] < 0:
                place[gate], gates[n], costs[n] = n, gate, NO_PATH
                n += 1
            if total < costs[place[gate]]:
                costs[place[gate]], over[place[gate]] = total, node
    return gates[:n], costs[:n], over[:n]


@guarded
@njit(cache=True, nogil=True)
def gates_of(levels, top, fields):
    """Return the places of the gates in and beside some fields of the last level, ascending."""
    is_near = np.zeros(top.gates.size, np.bool_)
    for field in fields:
        zero = np.zeros(levels.node_at[field + 1] - levels.node_at[field], np.int64)
        is_near[gates_near(levels, top, np.int64(field), zero)[0]] = True
    return np.flatnonzero(is_near).astype(np.int32)
