"""The two calls that read the distances between gates.

Nothing else knows the layout of distances in `Tables`: another exact method replaces this file, the
kernels that fill the tables (`_table_kernels.py`), and their caller (`distances.py`).
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.portals._path_kernels import UNREACHED
from hybridnav.search.moves import FAR


@njit(cache=True, nogil=True)
def distances(tables, source, gates, out):
    """Fill `out`, int64 (n,), with the costs of shortest paths from a source to n gates.

    They are rounded down by `tables.shift` bits, FAR for no path. One call serves many gates,
    because reading the arrays of a named tuple costs more than a look-up.
    """
    table, shift = tables.distance, tables.shift
    for i in range(gates.size):
        cost = table[source, gates[i]]
        out[i] = FAR if cost == UNREACHED else np.int64(cost) << shift


@njit(cache=True, nogil=True)
def next_gate(portals, tables, source, gate):
    """Return the gate that follows another one on a shortest path to a source, and the cost of the
    move there.

    The cost is 0 where the path goes on inside the field. The gate is -1 where the distances,
    rounded as they are for the longest paths, lead nowhere. `gate` is not the source itself.
    """
    table, shift = tables.distance, tables.shift
    exit_start = portals.exit_start
    exit_gate = portals.exit_gate
    exit_cost = portals.exit_cost
    gate_start = portals.gate_start
    clique_start = portals.clique_start
    clique = portals.clique
    slack = (np.int64(1) << shift) - 1
    here = np.int64(table[source, gate]) << shift
    least, onward, step = here, np.int64(-1), np.int64(0)
    for e in range(exit_start[gate], exit_start[gate + 1]):
        there = np.int64(table[source, exit_gate[e]]) << shift
        if there + exit_cost[e] <= here + slack and there < least:
            least, onward, step = there, np.int64(exit_gate[e]), np.int64(exit_cost[e])
    if onward >= 0:
        return onward, step
    field = tables.gate_field[gate]
    begin, end = gate_start[field], gate_start[field + 1]
    row = clique_start[field] + (gate - begin) * (end - begin) - begin
    for w in range(begin, end):
        there = np.int64(table[source, w]) << shift
        if there + clique[row + w] <= here + slack and there < least:
            least, onward = there, np.int64(w)
    return onward, step
