"""Kernels that follow the portal table from gate to gate.

Array fields of named tuples are read once, at the head of each kernel: reading them in a loop costs
more than the loop.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.portals._path_kernels import FAR, costs_to_gates
from hybridnav.search._kernels import grow


@njit(cache=True, nogil=True)
def descend(portals, table, shift, gate_field, gate, source, last):
    """Follow a source's row of the table from a gate to the source, and cross to gate `last`.

    `last` is -1 to end at the source. Gives the gates by which the way leaves fields, those by
    which it enters the next, and the costs between inside the fields: leg 0 to the first gate left,
    then from each gate entered to the next one left, and if there is no `last` to the source. The
    last result is the cost of all crossings, FAR where the table, rounded as it is for the longest
    paths, leads nowhere.
    """
    source_gate = portals.source_gate
    exit_start = portals.exit_start
    exit_gate = portals.exit_gate
    exit_cost = portals.exit_cost
    gate_start = portals.gate_start
    clique_start = portals.clique_start
    clique = portals.clique
    slack = (np.int64(1) << shift) - 1
    out = np.empty(16, np.int64)
    into = np.empty(16, np.int64)
    legs = np.zeros(17, np.int64)
    n, over = 0, np.int64(0)
    goal = np.int64(source_gate[source])
    here = np.int64(table[source, gate]) << shift
    entered = gate
    while gate != goal or last >= 0:
        # Cross here if that is on a shortest path to the source, else go on inside the field.
        least, onward, step = here, np.int64(-1), np.int64(0)
        for e in range(exit_start[gate], exit_start[gate + 1]):
            x = np.int64(exit_gate[e])
            if gate == goal:
                if x == last:
                    onward, step = x, np.int64(exit_cost[e])
                continue
            there = np.int64(table[source, x]) << shift
            if there + exit_cost[e] <= here + slack and there < least:
                least, onward, step = there, x, np.int64(exit_cost[e])
        if onward >= 0:
            if n + 1 == out.size:
                out, into, legs = grow(out), grow(into), grow(legs)
            out[n], into[n] = gate, onward
            n += 1
            legs[n] = 0
            over += step
            if gate == goal:
                break
            gate = entered = onward
            here = least
            continue
        field = gate_field[gate]
        begin, end = gate_start[field], gate_start[field + 1]
        row = clique_start[field] + (gate - begin) * (end - begin) - begin
        for w in range(begin, end):
            there = np.int64(table[source, w]) << shift
            if there + clique[row + w] <= here + slack and there < least:
                least, onward = there, np.int64(w)
        if onward < 0:
            over = np.int64(FAR)
            break
        gate, here = onward, least
        legs[n] = clique[clique_start[field] + (entered - begin) * (end - begin) + gate - begin]
    return out[:n], into[:n], legs[: n + 1], over


@njit(cache=True, nogil=True)
def with_ends(portals, gate_field, cols, start, goal, out, into, legs, over):
    """Cost of the whole way from start to goal, which lie in the fields of its ends; sets the first
    and the last leg."""
    index = portals.position
    rows = portals.rows
    field_start = portals.field_start
    row_start = portals.row_start
    gate_cell = portals.gate_cell
    n = out.size
    if n == 0 or over >= FAR:
        return np.int64(FAR)
    for cell, gates, leg in ((start, out[:1], legs[:1]), (goal, into[n - 1 :], legs[n:])):
        first = field_start[gate_field[gates[0]]]
        costs_to_gates(index, rows, row_start, gate_cell, first, cols, gates, 1, cell, leg)
    return legs.sum() + over
