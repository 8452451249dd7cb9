"""Kernels of A* from gate to gate, guided and bounded by the table.

Costs are the integers of `search._costs`; the table is rounded down, so what is made of it bounds
costs from below.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hybridnav.route._first_way_kernels import nearest
from hybridnav.route._portal_kernels import (
    FAR,
    cost_to_gate,
    costs_to_gates,
    field_at,
    pop,
    push,
)
from hybridnav.search._kernels import grow, octile_cost


@njit(cache=True)
def targets_of(portals, cols, goal_field, goal, low_goal, by_goal, limit):
    """Sources beside the gates by which a way cheaper than `limit` may enter the goal's field.

    For each a lower bound on what a way has left at the source; it may be negative, as ways pass
    beside the source.
    """
    side_start = portals.side_start
    gate_start = portals.gate_start
    clique_start = portals.clique_start
    side_gate = portals.side_gate
    side_gates_start = portals.side_gates_start
    side_gates = portals.side_gates
    side_gates_source = portals.side_gates_source
    gate_cell = portals.gate_cell
    clique = portals.clique
    side_gates_cost = portals.side_gates_cost
    row, col = goal // cols, goal % cols
    source = np.empty(16, np.int64)
    left = np.empty(16, np.int64)
    count = 0
    for j in range(by_goal.size):
        if by_goal[j] >= limit:
            continue
        first = count
        side = side_start[goal_field] + j
        begin = gate_start[goal_field]
        beside = clique_start[goal_field] - begin
        beside += (side_gate[side] - begin) * (gate_start[goal_field + 1] - begin)
        for q in range(side_gates_start[side], side_gates_start[side + 1]):
            gate = np.int64(side_gates[q])
            s = np.int64(side_gates_source[q])
            k = first
            while k < count and source[k] != s:
                k += 1
            if k == count:
                if count == source.size:
                    source, left = grow(source), grow(left)
                source[k], left[k] = s, FAR
                count += 1
            cell = np.int64(gate_cell[gate])
            rest = nearest(low_goal[j], clique[beside + gate], cols, cell, row, col)
            left[k] = min(left[k], rest - side_gates_cost[q])
    return source[:count], left[:count]


@njit(cache=True)
def left_from(table, source, low, gate):
    """Lower bound on the cost from a gate to the goal over the targets."""
    least = np.int64(FAR)
    for k in range(source.size):
        between = table[source[k], gate]
        if between < np.inf:
            least = min(least, np.int64(between) + low[k])
    return least


@njit(cache=True)
def _look_ahead(
    table, gate_cell, cols, goal, source, low, behind, behind_cost, gate, stamp, seen, at, ahead
):
    """Set the lower bound on the cost from a gate to the goal, once a search."""
    seen[gate] = stamp
    at[gate] = FAR
    rest = left_from(table, source, low, gate)
    if behind >= 0:
        rest = max(rest, np.int64(table[behind, gate]) - behind_cost)
    cell = np.int64(gate_cell[gate])
    ahead[gate] = max(rest, octile_cost(cell // cols - goal // cols, cell % cols - goal % cols))


@njit(cache=True)
def improve(
    portals, tables, cols, start, goal, low_start, by_start, low_goal, landmark, source, low, upper,
    epsilon, narrow, work,
):  # fmt: skip
    """A* over the gates for a path cheaper than `upper`, until none can be cheaper than
    upper / (1 + epsilon).

    `narrow`: only through fields that are marked as passed. `landmark` is a side of the goal's
    field, -1 for none. Gives the cost, the last gate entered
    (-1 if nothing cheaper was found), a lower bound on the cost of any path, and expansions.
    """
    side_start = portals.side_start
    index = portals.position
    rows = portals.rows
    field_start = portals.field_start
    row_start = portals.row_start
    gate_start = portals.gate_start
    side_gate = portals.side_gate
    clique_start = portals.clique_start
    side_portal = portals.side_portal
    side_radius = portals.side_radius
    clique = portals.clique
    side_gates_start = portals.side_gates_start
    side_gates = portals.side_gates
    gate_cell = portals.gate_cell
    exit_start = portals.exit_start
    exit_gate = portals.exit_gate
    exit_cost = portals.exit_cost
    exit_portal = portals.exit_portal
    generation = work.generation
    at = work.at
    ahead = work.ahead
    passed = work.passed
    side_seen = work.side_seen
    side_ahead = work.side_ahead
    seen = work.seen
    parent = work.parent
    via = work.via
    table, reach, gate_field = tables.bound, tables.reach, tables.gate_field
    n_gates = gate_field.size
    stamp = generation[0]
    field, goal_field = field_at(portals, cols, start), field_at(portals, cols, goal)
    s0 = side_start[field]
    behind, behind_cost = np.int64(-1), np.int64(0)
    if landmark >= 0:
        side = side_start[goal_field] + landmark
        behind = np.int64(portals.portal_source[side_portal[side]])
        behind_cost = low_goal[landmark] + (1 << portals.steps_shift[goal_field])
        behind_cost += reach[side] - side_radius[side]
    keys = np.empty(256, np.int64)
    items = np.empty(256, np.int64)
    near = np.empty(64, np.int64)
    costs = np.empty(64, np.int64)
    count = 0
    for i in range(low_start.size):
        if by_start[i] < upper:
            if count == keys.size:
                keys, items = grow(keys), grow(items)
            count = push(keys, items, count, by_start[i], n_gates + i)
    end = np.int64(-1)
    expanded = 0
    lowest = np.int64(FAR)
    while count > 0:
        key, item = keys[0], items[0]
        if key * (1 + epsilon) >= upper:
            lowest = min(lowest, key)
            break
        count = pop(keys, items, count)
        from_gate = item < n_gates
        if from_gate:
            here, f = at[item], gate_field[item]
            if key > here + ahead[item]:
                continue
            if narrow and passed[f] != stamp:
                lowest = min(lowest, key)
                continue
            expanded += 1
            if f == goal_field:
                total = here + cost_to_gate(
                    index, rows, field_start[f], row_start[item], cols, goal
                )
                if total < upper:
                    upper, end = total, item
            first_side, last_side = side_start[f], side_start[f + 1]
        else:
            here, f = np.int64(0), field
            first_side = s0 + item - n_gates
            last_side = first_side + 1
        begin = gate_start[f]
        size = gate_start[f + 1] - begin
        middle = item if from_gate else np.int64(side_gate[first_side])
        row = clique_start[f] + (middle - begin) * size - begin
        for side in range(first_side, last_side):
            p = side_portal[side]
            if from_gate:
                # Can any gate of this side lead to a path that is cheap enough?
                own = side_gate[side]
                if side_seen[side] != stamp:
                    side_seen[side] = stamp
                    rest = left_from(table, source, low, own)
                    side_ahead[side] = rest - 2 * side_radius[side]
                if here + clique[row + own] + side_ahead[side] >= upper:
                    continue
            n_near = 0
            for q in range(side_gates_start[side], side_gates_start[side + 1]):
                gate = np.int64(side_gates[q])
                if seen[gate] != stamp:
                    _look_ahead(
                        table,
                        gate_cell,
                        cols,
                        goal,
                        source,
                        low,
                        behind,
                        behind_cost,
                        gate,
                        stamp,
                        seen,
                        at,
                        ahead,
                    )
                if from_gate:
                    low_cost = here + clique[row + gate]
                else:
                    low_cost = low_start[item - n_gates] - clique[row + gate]
                if low_cost + ahead[gate] < upper:
                    if n_near == near.size:
                        near, costs = grow(near), grow(costs)
                    near[n_near], costs[n_near] = gate, low_cost
                    n_near += 1
            if not from_gate:
                costs_to_gates(
                    index, rows, row_start, field_start[f], cols, near, n_near, start, costs
                )
            for q in range(n_near):
                gate = near[q]
                for e in range(exit_start[gate], exit_start[gate + 1]):
                    x = np.int64(exit_gate[e])
                    new = costs[q] + exit_cost[e]
                    if exit_portal[e] != p:
                        continue
                    if seen[x] != stamp:
                        _look_ahead(
                            table,
                            gate_cell,
                            cols,
                            goal,
                            source,
                            low,
                            behind,
                            behind_cost,
                            x,
                            stamp,
                            seen,
                            at,
                            ahead,
                        )
                    if new >= at[x] or new + ahead[x] >= upper:
                        continue
                    at[x] = new
                    parent[x] = item if from_gate else np.int64(-1)
                    via[x] = gate
                    if count == keys.size:
                        keys, items = grow(keys), grow(items)
                    count = push(keys, items, count, new + ahead[x], x)
    return upper, end, min(lowest, upper), expanded
