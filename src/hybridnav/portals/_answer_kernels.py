"""Kernel that answers queries over portals."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.portals._descent_kernels import descend, with_endpoints
from hybridnav.portals._path_kernels import cells_of_path, field_at
from hybridnav.portals._side_kernels import best_gates, bounds_by_sides, side_costs
from hybridnav.search.moves import FAR


@guarded
@njit(cache=True, nogil=True)
def answer(portals, tables, cols, start, goal, inside, epsilon, frame):
    """Find the cheapest path over gates between two cells that may be entered.

    Pairs of sides, one of the start's field and one of the goal's, are examined in the order of the
    lower bounds on their paths, until no other pair can be better by more than `epsilon`.

    Parameters
    ----------
    portals, tables
        `Portals` and `Tables`.
    cols
        Columns of the grid.
    start, goal
        Flat cells.
    inside
        Integer cost of the shortest path inside the field that both share, else `FAR`.
    epsilon
        Share by which the answer may exceed the optimum, >= 0.
    frame
        See `cells_of_path`.

    Returns
    -------
    tuple
        The lower cost of the path over gates and `inside`; a lower bound on both; the number of
        stored paths that were walked to find the endpoints; the path's cells and points, which are
        empty if it does not cost less than `inside`.
    """
    cells, points = np.empty((0, 2), np.int64), np.empty((0, 2), np.float64)
    side_start = portals.side_start
    side_gates_start = portals.side_gates_start
    gate_field = tables.gate_field
    endpoints = np.int64(start), np.int64(goal)
    fields = field_at(portals, cols, start), field_at(portals, cols, goal)
    low_start = side_costs(portals, cols, fields[0], start)
    low_goal = side_costs(portals, cols, fields[1], goal)
    s0, t0 = side_start[fields[0]], side_start[fields[1]]
    low = bounds_by_sides(tables.between, tables.shift, s0, t0, low_start, low_goal)
    first_q, last_q = side_gates_start[s0], side_gates_start[t0]
    known_start = np.full(side_gates_start[side_start[fields[0] + 1]] - first_q, -1, np.int64)
    known_goal = np.full(side_gates_start[side_start[fields[1] + 1]] - last_q, -1, np.int64)
    upper = np.int64(inside)
    gate, source, across, walked = np.int64(-1), np.int64(-1), np.int64(-1), 0
    while True:
        least, best_i, best_j = np.int64(FAR), 0, 0
        for i in range(low_start.size):
            for j in range(low_goal.size):
                if low[i, j] < least:
                    least, best_i, best_j = low[i, j], i, j
        if least * (1 + epsilon) >= upper:
            break
        low[best_i, best_j] = FAR
        sides = s0 + best_i, t0 + best_j
        over, x, s, w, more = best_gates(
            portals, tables, cols, endpoints, fields, sides, (low_start[best_i], low_goal[best_j]),
            known_start[side_gates_start[sides[0]] - first_q :],
            known_goal[side_gates_start[sides[1]] - last_q :], upper,
        )  # fmt: skip
        walked += more
        if over < upper:
            upper, gate, source, across = over, x, s, w
    lower = min(least, upper)
    if gate < 0:
        return inside, lower, walked, cells, points
    out, into, legs, crossings = descend(portals, tables, gate, source, across)
    cost = with_endpoints(portals, gate_field, cols, start, goal, out, into, legs, crossings)
    if cost >= inside:
        return inside, lower, walked, cells, points
    cells, points = cells_of_path(portals, gate_field, cols, start, goal, out, into, legs, frame)
    return cost, lower, walked, cells, points


@guarded
@njit(cache=True, nogil=True)
def answers(portals, tables, cols, starts, goals, epsilon, frame):
    """Answer many pairs of cells, as if no two shared a field.

    Parameters
    ----------
    portals, tables, cols, epsilon, frame
        See `answer`.
    starts, goals
        int64 (n,), flat cells.

    Returns
    -------
    tuple
        Costs and lower bounds, int64 (n,); where the points of each path begin, int64 (n + 1,); the
        points of all paths, float64 (m, 2).
    """
    n = starts.size
    costs = np.empty(n, np.int64)
    lower = np.empty(n, np.int64)
    begin = np.zeros(n + 1, np.int64)
    points = np.empty((1024, 2), np.float64)
    for i in range(n):
        costs[i], lower[i], _, _, path = answer(
            portals, tables, cols, starts[i], goals[i], FAR, epsilon, frame
        )
        begin[i + 1] = begin[i] + path.shape[0]
        if begin[i + 1] > points.shape[0]:
            larger = np.empty((2 * begin[i + 1], 2), np.float64)
            larger[: begin[i]] = points[: begin[i]]
            points = larger
        points[begin[i] : begin[i + 1]] = path
    return costs, lower, begin, points[: begin[n]]
