"""Kernels of the first way between two cells: the best by the table, its ends made shorter.

Costs are the integers of `search._costs`. Array fields of named tuples are read once, at the head
of each kernel: reading them in a loop costs more than the loop.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hybridnav.route._portal_kernels import FAR, cost_to_gate, field_at, position_of
from hybridnav.search._costs import DIAGONAL, STRAIGHT
from hybridnav.search._kernels import octile_cost

_ROUNDING = 2.0**-22
"""The table is rounded to float32; so much more of an entry is above what was rounded."""


@njit(cache=True)
def side_costs(portals, cols, field, cell):
    """Lower bounds on the costs from a cell to the gates that stand for its field's sides."""
    side_start = portals.side_start
    steps_start = portals.steps_start
    index = portals.position
    field_start = portals.field_start
    steps_shift = portals.steps_shift
    steps = portals.steps
    begin, end = side_start[field], side_start[field + 1]
    row = steps_start[field]
    row += (position_of(index, cols, cell) - field_start[field]) * (end - begin)
    low = np.empty(end - begin, np.int64)
    shift = steps_shift[field]
    for i in range(end - begin):
        low[i] = np.int64(steps[row + i]) << shift
    return low


@njit(cache=True)
def weigh_sides(portals, tables, field, goal_field, low_start, low_goal):
    """Ways by each pair of sides of two fields.

    Gives lower bounds on ways by each side of either field, the best way through gates that stand
    for sides, by its sides, and the goal's side that makes the best landmark, as it lies behind the
    goal seen from the start. Without a table of bounds all bounds are zero.
    """
    route, bound, reach = tables.route, tables.bound, tables.reach
    side_start = portals.side_start
    side_radius = portals.side_radius
    portal_source = portals.portal_source
    side_portal = portals.side_portal
    side_gate = portals.side_gate
    s0, t0 = side_start[field], side_start[goal_field]
    by_start = np.full(low_start.size, FAR, np.int64)
    by_goal = np.full(low_goal.size, FAR, np.int64)
    if bound.size == 0:
        by_start[:] = 0
        by_goal[:] = 0
    best, first, last = np.int64(FAR), -1, -1
    farthest, landmark = np.int64(-1), -1
    # The lift takes a side's own gate to the source, which lies in the lower field.
    for i in range(low_start.size):
        radius = side_radius[s0 + i]
        lift = reach[s0 + i] - radius
        source = portal_source[side_portal[s0 + i]]
        nearest = max(0, low_start[i] - radius) - reach[s0 + i]
        for j in range(low_goal.size):
            between = route[source, side_gate[t0 + j]]
            if between == np.inf:
                continue
            over = low_start[i] + lift + np.int64(between) + low_goal[j]
            if over < best:
                best, first, last = over, i, j
            if bound.size == 0:
                continue
            cost = np.int64(bound[source, side_gate[t0 + j]])
            lower = cost - side_radius[t0 + j]
            lower += max(0, low_goal[j] - side_radius[t0 + j]) + nearest
            by_start[i] = min(by_start[i], lower)
            by_goal[j] = min(by_goal[j], lower)
            behind = cost - low_start[i] - lift - low_goal[j]
            if behind > farthest:
                farthest, landmark = behind, j
    return by_start, by_goal, best, first, last, landmark


@njit(cache=True)
def nearest(low, beside, cols, cell, row, col):
    """Lower bound on the cost to a gate at a cell; `low` is that to another one `beside` it."""
    return max(low - beside, octile_cost(cell // cols - row, cell % cols - col))


@njit(cache=True)
def first_gate(portals, table, cols, field, side, low, start, source):
    """Of a side's gates the one with the shortest way from the start over it to a source.

    `low` is the lower bound on the cost from the start to the side's own gate.
    """
    side_gate = portals.side_gate
    gate_start = portals.gate_start
    clique_start = portals.clique_start
    index = portals.position
    rows = portals.rows
    field_start = portals.field_start
    row_start = portals.row_start
    side_gates_start = portals.side_gates_start
    side_gates = portals.side_gates
    side_gates_cost = portals.side_gates_cost
    gate_cell = portals.gate_cell
    clique = portals.clique
    row, col = start // cols, start % cols
    chosen = np.int64(side_gate[side])
    begin = gate_start[field]
    beside = clique_start[field] - begin
    beside += (chosen - begin) * (gate_start[field + 1] - begin)
    best = np.int64(table[source, chosen]) + cost_to_gate(
        index, rows, field_start[field], row_start[chosen], cols, start
    )
    for q in range(side_gates_start[side], side_gates_start[side + 1]):
        gate = np.int64(side_gates[q])
        if side_gates_cost[q] > DIAGONAL:
            continue
        onward = np.int64(table[source, gate])
        cell = np.int64(gate_cell[gate])
        if onward + nearest(low, clique[beside + gate], cols, cell, row, col) >= best:
            continue
        cost = onward + cost_to_gate(index, rows, field_start[field], row_start[gate], cols, start)
        if cost < best:
            best, chosen = cost, gate
    return chosen


@njit(cache=True)
def descend(portals, table, gate_field, cols, start, goal, gate, source, goal_field, work):
    """Follow the table's row of a source from a gate of the start's field, to the goal.

    Leaves `at`, `parent` and `via` of the gates entered, and marks the fields passed. Gives the
    cost of the path and the last gate entered, -1 where there is none.
    """
    source_gate = portals.source_gate
    exit_start = portals.exit_start
    exit_gate = portals.exit_gate
    exit_cost = portals.exit_cost
    gate_start = portals.gate_start
    index = portals.position
    rows = portals.rows
    field_start = portals.field_start
    row_start = portals.row_start
    clique_start = portals.clique_start
    clique = portals.clique
    generation = work.generation
    passed = work.passed
    at = work.at
    parent = work.parent
    via = work.via
    seen = work.seen
    stamp = generation[0]
    field = gate_field[gate]
    passed[field] = stamp
    entered, end = np.int64(-1), np.int64(-1)
    cost, total = np.int64(0), np.int64(FAR)
    arrived = source_gate[source]
    while True:
        # Cross here if that is on a shortest path to the source, else go on inside the field.
        best = np.float64(np.inf)
        onward, step = np.int64(-1), np.int64(0)
        for e in range(exit_start[gate], exit_start[gate + 1]):
            x = exit_gate[e]
            over = np.float64(table[source, x]) + exit_cost[e]
            if gate == arrived and gate_field[x] == goal_field:
                over = 0.0
            if over < best:
                best, onward, step = over, np.int64(x), np.int64(exit_cost[e])
        begin, size = gate_start[field], gate_start[field + 1]
        size -= begin
        if best <= np.float64(table[source, gate]) * (1 + _ROUNDING):
            if seen[onward] == -stamp:  # the way has been there: what follows is a detour
                return total, end
            if entered < 0:
                cost = cost_to_gate(index, rows, field_start[field], row_start[gate], cols, start)
            else:
                row = clique_start[field] + (entered - begin) * size - begin
                cost += clique[row + gate]
            cost += step
            at[onward], parent[onward], via[onward] = cost, entered, gate
            seen[onward] = -stamp
            entered, done = onward, gate == arrived
            gate = onward
            field = gate_field[gate]
            passed[field] = stamp
            if field == goal_field:
                there = cost + cost_to_gate(
                    index, rows, field_start[field], row_start[gate], cols, goal
                )
                if there < total:
                    total, end = there, entered
            if done:
                return total, end
            continue
        if gate == arrived:
            return total, end
        row = clique_start[field] + (gate - begin) * size
        least = np.float32(np.inf)
        chosen = -1
        for w in range(size):
            over = table[source, begin + w] + np.float32(clique[row + w])
            if over < least and begin + w != gate:
                least, chosen = over, begin + w
        if chosen < 0 or table[source, chosen] >= table[source, gate]:
            return total, end
        gate = chosen


@njit(cache=True)
def last_gate(portals, gate_field, cols, start, goal, goal_field, side, low, end, total, work):
    """Cross into the goal's field anew, by any gate of the portal that the way came in by.

    `side` is the goal's, `low` the lower bound on the cost from its own gate to the goal. Gives the
    cost and the last gate entered.
    """
    side_portal = portals.side_portal
    portal_sides = portals.portal_sides
    side_gate = portals.side_gate
    gate_start = portals.gate_start
    clique_start = portals.clique_start
    side_gates_start = portals.side_gates_start
    side_gates = portals.side_gates
    side_gates_cost = portals.side_gates_cost
    gate_cell = portals.gate_cell
    clique = portals.clique
    exit_start = portals.exit_start
    exit_gate = portals.exit_gate
    exit_portal = portals.exit_portal
    exit_cost = portals.exit_cost
    index = portals.position
    rows = portals.rows
    field_start = portals.field_start
    row_start = portals.row_start
    parent = work.parent
    via = work.via
    at = work.at
    seen = work.seen
    stamp = work.generation[0]
    before = parent[end]
    field = gate_field[via[end]]
    p = side_portal[side]
    opposite = portal_sides[p, 0]
    if opposite == side:
        opposite = portal_sides[p, 1]
    if gate_field[side_gate[opposite]] != field:
        return total, end
    row, col = goal // cols, goal % cols
    begin = gate_start[goal_field]
    beside = clique_start[goal_field] - begin
    beside += (side_gate[side] - begin) * (gate_start[goal_field + 1] - begin)
    begin = gate_start[field]
    offset = clique_start[field] - begin
    if before >= 0:
        offset += (before - begin) * (gate_start[field + 1] - begin)
    for q in range(side_gates_start[opposite], side_gates_start[opposite + 1]):
        gate = np.int64(side_gates[q])
        if side_gates_cost[q] > STRAIGHT:
            continue
        cell = np.int64(gate_cell[gate])
        if before >= 0:
            here = at[before] + clique[offset + gate]
        else:
            here = octile_cost(cell // cols - start // cols, cell % cols - start % cols)
        is_exact = before >= 0
        for e in range(exit_start[gate], exit_start[gate + 1]):
            x = np.int64(exit_gate[e])
            if exit_portal[e] != p or seen[x] == -stamp:
                continue
            cell = np.int64(gate_cell[x])
            rest = exit_cost[e]
            rest += nearest(low, clique[beside + x], cols, cell, row, col)
            if here + rest >= total:
                continue
            if not is_exact:
                here, is_exact = (
                    cost_to_gate(index, rows, field_start[field], row_start[gate], cols, start),
                    True,
                )
                if here + rest >= total:
                    continue
            cost = here + exit_cost[e]
            over = cost + cost_to_gate(
                index, rows, field_start[goal_field], row_start[x], cols, goal
            )
            if over < total:
                total, end = over, x
                at[x], parent[x], via[x] = cost, before, gate
    return total, end


@njit(cache=True)
def first_way(portals, tables, cols, start, goal, low_start, low_goal, first, last, work):
    """The way by a pair of sides, from the table, its first and last crossing made shorter.

    Gives the cost of a path, FAR for none, and the last gate entered; `work` holds those before.
    """
    table, gate_field = tables.route, tables.gate_field
    field, goal_field = field_at(portals, cols, start), field_at(portals, cols, goal)
    side = portals.side_start[goal_field] + last
    source = np.int64(portals.portal_source[portals.side_portal[side]])
    own = portals.side_start[field] + first
    gate = first_gate(portals, table, cols, field, own, low_start[first], start, source)
    cost, end = descend(
        portals, table, gate_field, cols, start, goal, gate, source, goal_field, work
    )
    if end < 0:
        return cost, end
    return last_gate(
        portals, gate_field, cols, start, goal, goal_field, side, low_goal[last], end, cost, work
    )
