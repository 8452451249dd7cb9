"""Kernels that answer queries over portals: one, or many in a row."""

from __future__ import annotations

import numpy as np
from numba import njit

from hybridnav.route._first_way_kernels import first_way, side_costs, weigh_sides
from hybridnav.route._gate_search_kernels import improve, targets_of
from hybridnav.route._portal_kernels import cells_of_way, field_at
from hybridnav.search._costs import STRAIGHT
from hybridnav.search._kernels import octile_cost

STORED = 0
NARROW = 1
WIDE = 2
"""How far a first way is improved: not at all; over the gates of its fields; over all gates."""
SHORT = 256 * STRAIGHT
"""Up to this cost the choice of a few fields costs much, and a search of all gates little."""


@njit(cache=True)
def answer(portals, tables, cols, start, goal, upper, mode, epsilon, work):
    """Path over gates between two cells that may be entered, as flat cells, if it costs less than
    `upper`, the cost of the shortest path inside one field where start and goal share it, else FAR.

    Gives the lower cost of the two, the path (empty if it is not cheaper), a lower bound on the
    cost of any path, and the number of gates expanded. The fields of the first way are marked in
    `work.passed`.
    """
    work.generation[0] += 1
    stamp = work.generation[0]
    field, goal_field = field_at(portals, cols, start), field_at(portals, cols, goal)
    work.passed[field] = stamp
    path = np.empty(0, np.int64)
    low_start = side_costs(portals, cols, field, start)
    low_goal = side_costs(portals, cols, goal_field, goal)
    if low_start.size == 0 or low_goal.size == 0:
        return upper, path, upper, 0
    by_start, by_goal, over, first, last, landmark = weigh_sides(
        portals, tables, field, goal_field, low_start, low_goal
    )
    if first < 0:
        return upper, path, upper, 0
    if over < upper:
        cost, end = first_way(
            portals, tables, cols, start, goal, low_start, low_goal, first, last, work
        )
        if cost < upper:
            upper = cost
            path = cells_of_way(portals, tables.gate_field, cols, start, goal, end, work, upper)
    line = octile_cost(start // cols - goal // cols, start % cols - goal % cols)
    lower = min(max(by_start.min(), line), upper)
    expanded = 0
    if mode != STORED and lower * (1 + epsilon) < upper:
        source, low = targets_of(portals, cols, goal_field, goal, low_goal, by_goal, upper)
        cost, end, bound, expanded = improve(
            portals, tables, cols, start, goal, low_start, by_start, low_goal, landmark, source,
            low, upper, epsilon, mode == NARROW and upper >= SHORT, work,
        )  # fmt: skip
        lower = max(lower, bound)
        if end >= 0:
            upper = cost
            path = cells_of_way(portals, tables.gate_field, cols, start, goal, end, work, upper)
    return upper, path, min(lower, upper), expanded


@njit(cache=True)
def centres(cells, resolution, origin_x, origin_y, cosine, sine):
    """Centres of (row, col) in the map frame, as `Frame.points_of` has them."""
    points = np.empty((cells.shape[0], 2), np.float64)
    for i in range(cells.shape[0]):
        x, y = (cells[i, 1] + 0.5) * resolution, (cells[i, 0] + 0.5) * resolution
        points[i, 0] = origin_x + cosine * x - sine * y
        points[i, 1] = origin_y + sine * x + cosine * y
    return points


@njit(cache=True)
def unfold(path, cols, resolution, origin_x, origin_y, cosine, sine):
    """(row, col) of flat cells, and their centres in the map frame."""
    cells = np.empty((path.size, 2), np.int64)
    for i in range(path.size):
        cells[i, 0], cells[i, 1] = path[i] // cols, path[i] % cols
    return cells, centres(cells, resolution, origin_x, origin_y, cosine, sine)
