"""Kernels that follow shortest paths from gate to gate.

Array fields of named tuples are read once, at the head of each kernel: reading them in a loop costs
more than the loop.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.portals._distance_kernels import next_gate
from hybridnav.portals._path_kernels import stored_costs
from hybridnav.search.arrays import grow
from hybridnav.search.moves import FAR


@njit(cache=True, nogil=True)
def descend(portals, tables, gate, source, last):
    """Follow shortest paths from a gate to a source, and cross from there to gate `last`.

    `last` is -1 to end at the source. Return the gates by which the path leaves fields, those by
    which it enters the next, and the costs inside the fields: leg 0 to the first gate, then from
    each gate entered to the next one left, and without `last` to the source. The last result is the
    cost of all crossings, FAR if rounded distances lead nowhere.
    """
    gate_field = tables.gate_field
    gate_start = portals.gate_start
    clique_start = portals.clique_start
    clique = portals.clique
    out = np.empty(16, np.int64)
    into = np.empty(16, np.int64)
    legs = np.zeros(17, np.int64)
    n, over = 0, np.int64(0)
    goal = np.int64(portals.source_gate[source])
    entered = gate
    while gate != goal or last >= 0:
        if gate == goal:
            onward, step = last, _cost_of_exit(portals, gate, last)
        else:
            onward, step = next_gate(portals, tables, source, gate)
        if onward < 0 or step >= FAR:
            over = np.int64(FAR)
            break
        if step == 0:
            gate = onward
            field = gate_field[gate]
            begin, end = gate_start[field], gate_start[field + 1]
            legs[n] = clique[clique_start[field] + (entered - begin) * (end - begin) + gate - begin]
            continue
        if n + 1 == out.size:
            out, into, legs = grow(out), grow(into), grow(legs)
        out[n], into[n] = gate, onward
        n += 1
        legs[n] = 0
        over += step
        if gate == goal:
            break
        gate = entered = onward
    return out[:n], into[:n], legs[: n + 1], over


@njit(cache=True, nogil=True)
def _cost_of_exit(portals, gate, head):
    """Return the cost of the move from a gate to one in another field, FAR where there is none."""
    exit_gate = portals.exit_gate
    cost = np.int64(FAR)
    for e in range(portals.exit_start[gate], portals.exit_start[gate + 1]):
        if exit_gate[e] == head:
            cost = np.int64(portals.exit_cost[e])
    return cost


@njit(cache=True, nogil=True)
def with_endpoints(portals, gate_field, cols, start, goal, out, into, legs, over):
    """Return the cost of the whole path from start to goal; set the first and the last leg.

    Parameters
    ----------
    portals, gate_field, cols, start, goal, out, into
        See `cells_of_path`; start and goal lie in the fields of the path's ends.
    legs
        int64, receives the costs of the two legs.
    over
        Integer cost of the path between its first and last gate, `FAR` for none.
    """
    n = out.size
    if n == 0 or over >= FAR:
        return np.int64(FAR)
    for cell, gates, leg in ((start, out[:1], legs[:1]), (goal, into[n - 1 :], legs[n:])):
        stored_costs(portals, gate_field[gates[0]], cols, gates, 1, cell, leg)
    return legs.sum() + over
