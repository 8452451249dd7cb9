"""Kernel of the portal table: exact costs from portals to all gates, many portals at once."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.portals._path_kernels import UNREACHED
from hybridnav.search.moves import FAR

LANES = 16
"""Portals that are searched from together."""


@njit(cache=True, nogil=True)
def costs_to_gates(
    sources, field_of, gate_start, clique_start, clique, exit_start, exit_gate, exit_cost, shift,
    table,
):  # fmt: skip
    """Fill in the costs of shortest paths from some gates to all gates; return the greatest cost.

    Label correction, field by field: improved costs at a field's gates go on to all its other gates
    at once, because the costs between them are those of whole paths. The field with the cheapest
    improvement comes first. The search ends when no gate has improved.

    Parameters
    ----------
    sources
        Gates.
    field_of
        int32 (G,), the field of each gate.
    gate_start, clique_start, clique, exit_start, exit_gate, exit_cost
        See `Portals`.
    shift
        Bits that the table lacks.
    table
        uint32 (sources, G), receives the costs, `UNREACHED` for no path.
    """
    n_gates = field_of.size
    n_fields = gate_start.size - 1
    width = np.uint64(LANES)
    costs = np.empty(n_gates * LANES, np.int64)
    row = np.empty(LANES, np.int64)
    is_news = np.zeros(n_gates, np.bool_)
    is_changed = np.zeros(n_gates, np.bool_)
    greatest = np.int64(0)
    urgency = np.empty(n_fields, np.int64)
    waiting = np.empty(n_fields, np.int64)
    for first in range(0, sources.size, LANES):
        lanes = min(LANES, sources.size - first)
        costs[:] = FAR
        urgency[:] = FAR
        n_waiting = 0
        for lane in range(lanes):
            gate = sources[first + lane]
            costs[gate * LANES + lane] = 0
            is_news[gate] = True
            if urgency[field_of[gate]] == FAR:
                waiting[n_waiting] = field_of[gate]
                n_waiting += 1
            urgency[field_of[gate]] = 0
        while n_waiting > 0:
            best = 0
            for i in range(n_waiting):
                if urgency[waiting[i]] < urgency[waiting[best]]:
                    best = i
            f = waiting[best]
            n_waiting -= 1
            waiting[best] = waiting[n_waiting]
            urgency[f] = FAR
            begin, end = gate_start[f], gate_start[f + 1]
            for v in range(begin, end):
                if not is_news[v]:
                    continue
                is_news[v] = False
                is_changed[v] = True
                at = clique_start[f] + (v - begin) * (end - begin) - begin
                here = np.uint64(v) * width
                for w in range(begin, end):
                    leg = np.int64(clique[at + w])
                    there = np.uint64(w) * width
                    difference = np.int64(0)
                    for k in range(width):
                        row[k] = min(costs[there + k], costs[here + k] + leg)
                        difference |= row[k] ^ costs[there + k]
                    if difference != 0:
                        for k in range(width):
                            costs[there + k] = row[k]
                        is_changed[w] = True
            for v in range(begin, end):
                if not is_changed[v]:
                    continue
                is_changed[v] = False
                here = np.uint64(v) * width
                for i in range(exit_start[v], exit_start[v + 1]):
                    there = np.uint64(exit_gate[i]) * width
                    step = np.int64(exit_cost[i])
                    difference = np.int64(0)
                    for k in range(width):
                        row[k] = min(costs[there + k], costs[here + k] + step)
                        difference |= row[k] ^ costs[there + k]
                    if difference == 0:
                        continue
                    least = np.int64(FAR)
                    for k in range(width):
                        if row[k] < costs[there + k]:
                            least = min(least, row[k])
                            costs[there + k] = row[k]
                    is_news[exit_gate[i]] = True
                    other = field_of[exit_gate[i]]
                    if urgency[other] == FAR:
                        waiting[n_waiting] = other
                        n_waiting += 1
                    urgency[other] = min(urgency[other], least)
        for lane in range(lanes):
            for v in range(n_gates):
                cost = costs[v * LANES + lane]
                if cost >= FAR:
                    table[first + lane, v] = UNREACHED
                else:
                    table[first + lane, v] = cost >> shift
                    greatest = max(greatest, cost)
    return greatest
