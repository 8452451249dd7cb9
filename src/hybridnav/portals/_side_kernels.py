"""Kernels of the endpoints of a path: by which side it leaves its first field, and enters its last
one.

Costs are the integers of `search.moves`. Array fields of named tuples are read once, at the head
of each kernel: reading them in a loop costs more than the loop.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.portals._distance_kernels import distances
from hybridnav.portals._path_kernels import UNREACHED, position_of, stored_costs
from hybridnav.search.moves import FAR, octile_cost


@njit(cache=True, nogil=True)
def side_costs(portals, cols, field, cell):
    """Return the costs from a cell to the nearest gate of each of its field's sides, rounded
    down."""
    side_start = portals.side_start
    side_cost_start = portals.side_cost_start
    index = portals.position
    field_start = portals.field_start
    side_cost_shift = portals.side_cost_shift
    side_cost = portals.side_cost
    begin, end = side_start[field], side_start[field + 1]
    row = side_cost_start[field]
    row += (position_of(index, cols, cell) - field_start[field]) * (end - begin)
    low = np.empty(end - begin, np.int64)
    shift = side_cost_shift[field]
    for i in range(end - begin):
        low[i] = np.int64(side_cost[row + i]) << shift
    return low


@njit(cache=True, nogil=True)
def bounds_by_sides(between, shift, first, last, low_start, low_goal):
    """Return lower bounds on the paths by each pair of sides of two fields, int64; FAR for none.

    `first` and `last` are the first sides of the two.
    """
    low = np.empty((low_start.size, low_goal.size), np.int64)
    for i in range(low_start.size):
        for j in range(low_goal.size):
            over = between[first + i, last + j]
            if over == UNREACHED:
                low[i, j] = FAR
            else:
                low[i, j] = low_start[i] + (np.int64(over) << shift) + low_goal[j]
    return low


@njit(cache=True, nogil=True)
def _weigh_gates(portals, cols, cell, begin, end, low, known, costs):
    """Fill in lower bounds on the costs from a cell to a side's gates, or costs that are known.

    Parameters
    ----------
    portals, cols, cell, begin, end, known
        See `_walk`.
    low
        Lower bound on all costs.
    costs
        int64 (end - begin,), filled in.
    """
    side_gates = portals.side_gates
    gate_cell = portals.gate_cell
    row, col = cell // cols, cell % cols
    for q in range(begin, end):
        at = np.int64(gate_cell[side_gates[q]])
        costs[q - begin] = known[q - begin]
        if known[q - begin] < 0:
            line = octile_cost(at // cols - row, at % cols - col)
            costs[q - begin] = max(low, line)


@njit(cache=True, nogil=True)
def _walk(portals, cols, cell, field, begin, end, is_wanted, known):
    """Find the costs from a cell to those gates of a side that are needed; return their number.

    Parameters
    ----------
    portals, cols, field, cell
        See `stored_costs`.
    begin, end
        Where the gates of the side begin and end in `portals.side_gates`.
    is_wanted
        bool (end - begin,), the gates whose costs are needed.
    known
        int64 (end - begin,), integer costs, -1 for unknown ones; changed.
    """
    side_gates = portals.side_gates
    gates = np.empty(end - begin, np.int64)
    costs = np.empty(end - begin, np.int64)
    count = 0
    for q in range(begin, end):
        if is_wanted[q - begin] and known[q - begin] < 0:
            gates[count] = side_gates[q]
            count += 1
    stored_costs(portals, field, cols, gates, count, cell, costs)
    walked = count
    count = 0
    for q in range(begin, end):
        if is_wanted[q - begin] and known[q - begin] < 0:
            known[q - begin] = costs[count]
            count += 1
    return walked


@guarded
@njit(cache=True, nogil=True)
def entries_of(portals, source_at, begin, end):
    """Return the crossings by which paths enter a field over the gates `side_gates[begin:end]`.

    For each the gate's place, a source, and the cost of the move from the source, 0 where the gate
    has a source itself.
    """
    exit_start = portals.exit_start
    exit_gate = portals.exit_gate
    exit_cost = portals.exit_cost
    side_gates = portals.side_gates
    place = np.empty(8 * (end - begin), np.int64)
    source = np.empty(8 * (end - begin), np.int64)
    step = np.empty(8 * (end - begin), np.int64)
    count = 0
    for q in range(begin, end):
        gate = side_gates[q]
        if source_at[gate] >= 0:
            place[count], source[count], step[count] = q - begin, source_at[gate], 0
            count += 1
            continue
        for e in range(exit_start[gate], exit_start[gate + 1]):
            place[count], source[count] = q - begin, source_at[exit_gate[e]]
            step[count] = exit_cost[e]
            count += 1
    return place[:count], source[:count], step[:count]


@njit(cache=True, nogil=True)
def best_gates(
    portals, tables, cols, endpoints, fields, sides, lows, known_start, known_goal, limit
):
    """Find the gates of two sides on the shortest path, if it costs less than `limit`.

    Parameters
    ----------
    portals, tables
        `Portals` and `Tables`.
    cols
        Columns of the grid.
    endpoints, fields, sides, lows
        For start and goal each: flat cell, field, side of the field, lower bound on the costs to
        the side's gates.
    known_start, known_goal
        int64, integer costs to the gates of these sides, -1 for unknown ones; changed.
    limit
        Integer cost.

    Returns
    -------
    tuple
        The cost, `limit` or more for no path; the gate by which it leaves the start's field; the
        source; the gate across from the source, -1 if the source is in the goal's field; how many
        stored paths were walked.
    """
    side_gates = portals.side_gates
    side_gates_start = portals.side_gates_start
    a0, a1 = side_gates_start[sides[0]], side_gates_start[sides[0] + 1]
    b0, b1 = side_gates_start[sides[1]], side_gates_start[sides[1] + 1]
    near = np.empty(a1 - a0, np.int64)
    far = np.empty(b1 - b0, np.int64)
    _weigh_gates(portals, cols, endpoints[0], a0, a1, lows[0], known_start, near)
    _weigh_gates(portals, cols, endpoints[1], b0, b1, lows[1], known_goal, far)
    place, source, step = entries_of(portals, tables.source_at, b0, b1)
    own_gates = side_gates[a0:a1]
    between = np.empty(near.size, np.int64)
    wants_start = np.zeros(near.size, np.bool_)
    wants_goal = np.zeros(far.size, np.bool_)
    for e in range(place.size):
        rest = far[place[e]] + step[e]
        distances(tables, source[e], own_gates, between)
        for i in range(near.size):
            if near[i] + between[i] + rest < limit and between[i] < FAR:
                wants_start[i] = True
                wants_goal[place[e]] = True
    walked = _walk(portals, cols, endpoints[0], fields[0], a0, a1, wants_start, known_start)
    walked += _walk(portals, cols, endpoints[1], fields[1], b0, b1, wants_goal, known_goal)
    best, gate, entry = limit, np.int64(-1), np.int64(-1)
    for e in range(place.size):
        if not wants_goal[place[e]]:
            continue
        rest = known_goal[place[e]] + step[e]
        distances(tables, source[e], own_gates, between)
        for i in range(near.size):
            if not wants_start[i] or between[i] >= FAR:
                continue
            over = known_start[i] + between[i] + rest
            if over < best:
                best, gate, entry = over, np.int64(side_gates[a0 + i]), np.int64(e)
    across = np.int64(-1)
    if entry >= 0:
        if step[entry] > 0:
            across = np.int64(side_gates[b0 + place[entry]])
        entry = source[entry]
    return best, gate, entry, across, walked
