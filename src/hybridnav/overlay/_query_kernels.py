"""Kernel of a query on a multilevel overlay: up the levels, across, and down."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.overlay._cell_kernels import cells_of_path, reach_nodes
from hybridnav.overlay._cost_kernels import slot_of, sums_along
from hybridnav.overlay._exit_kernels import descend
from hybridnav.overlay._field_kernels import forget, path_inside, spread
from hybridnav.overlay._guide_kernels import aim
from hybridnav.overlay._inner_kernels import to_finest
from hybridnav.overlay._lane_kernels import FAR, NO_PATH
from hybridnav.overlay._near_kernels import search_near
from hybridnav.overlay._node_kernels import climb, least_reach, over_cliques
from hybridnav.overlay._path_kernels import back_over_cliques, join_ends
from hybridnav.overlay._top_kernels import join

TORN = -1
"""Cost of a path whose parts do not meet."""


@njit(cache=True, nogil=True)
def _fields(levels, field, n_levels):
    """Return the fields around a cell, one of each level."""
    around = np.empty(n_levels, np.int64)
    for level in range(n_levels):
        around[level] = field
        field = levels.parent[field]
    return around


@njit(cache=True, nogil=True)
def _highest(levels, around):
    """Return the highest level on which the table of the field around a cell is not stale."""
    level = 0
    while level + 1 < len(around) and not levels.is_stale[around[level + 1]]:
        level += 1
    return level


@njit(cache=True, nogil=True)
def _across(levels, top, ground, around, reaches, goal, best, epsilon, work):
    """Find the least distance over nodes of any level.

    Parameters
    ----------
    levels, top, ground
        See `find_path`.
    around
        Two int64 (levels,), the fields of start and goal on each level.
    reaches
        Two int64 (levels, n), see `climb`.
    goal
        Flat cell of the goal.
    best
        Only less is looked for.
    epsilon
        See `over_cliques`.
    work
        See `NodeWork`.

    Returns
    -------
    tuple
        The distance and a lower bound on it; the highest level of the nodes, -1 if no distance is
        less; int64 (n,) nodes; the number of nodes expanded.
    """
    last = len(around[0]) - 1
    nodes, level_of, expanded = np.empty(0, np.int64), -1, 0
    bound = np.int64(NO_PATH)
    highest = (_highest(levels, around[0]), _highest(levels, around[1]))
    if top.is_current:
        fields = (around[0][last], around[1][last])
        total, over = join(levels, top, fields, (reaches[0][last], reaches[1][last]), best)
        if total < best:
            best, level_of, nodes = total, last, over
    to_goal = least_reach(levels, ground, goal, reaches[1]), reaches[1][last]
    target = aim(levels, ground, top, goal, around[1][last], to_goal)
    for level in range(min(highest[0], highest[1])):
        if around[0][level + 1] != around[1][level + 1]:
            continue
        inner = levels.inner_at[around[0][level + 1]], levels.inner_at[around[0][level + 1] + 1]
        span = (np.int64(levels.node_at[inner[0]]), np.int64(levels.node_at[inner[1]]))
        fields = (around[0][level], around[1][level])
        both = (reaches[0][level], reaches[1][level])
        total, proved, end, count = over_cliques(
            levels, ground, top, span, fields, both, target, best, epsilon, work
        )
        expanded += count
        bound = min(bound, proved)
        if total < best:
            best, level_of = total, level
            nodes = back_over_cliques(work.before, end)
    if not top.is_current:
        span = (np.int64(0), np.int64(-1))
        fields = (around[0][highest[0]], around[1][highest[1]])
        both = (reaches[0][highest[0]], reaches[1][highest[1]])
        total, proved, end, count = over_cliques(
            levels, ground, top, span, fields, both, target, best, epsilon, work
        )
        expanded += count
        bound = min(bound, proved)
        if total < best:
            best, level_of = total, last
            nodes = back_over_cliques(work.before, end)
    return best, min(bound, best), level_of, nodes, expanded


@njit(cache=True, nogil=True)
def _inside(ground, endpoints, distance):
    """Return the distance between two cells of a field inside it, NO_PATH for none, the flat cells
    of the path, and the number of cells expanded; see `find_path`."""
    touched, n, expanded = spread(
        ground, endpoints[0], endpoints[1], distance, np.empty(256, np.int64)
    )
    least, cells = np.int64(NO_PATH), np.empty(0, np.int64)
    if distance[endpoints[1]] < FAR:
        least = np.int64(distance[endpoints[1]])
        cells = path_inside(ground, distance, endpoints[1])
    forget(distance, touched, n)
    return least, cells, expanded


@njit(cache=True, nogil=True)
def _find_flat(ground, levels, top, endpoints, epsilon, near_cells, cell_work, node_work):
    """Find a path of least cost between two cells that may be entered.

    Parameters
    ----------
    ground, levels, top, endpoints, epsilon, near_cells, cell_work, node_work
        See `find_path`.

    Returns
    -------
    tuple
        The cost, and a lower bound on it; int64 (n,) flat cells of the path; the numbers of cells
        and of nodes expanded.
    """
    start, goal = endpoints
    inside, cells, is_proved, expanded = search_near(ground, start, goal, near_cells, cell_work)
    if is_proved:
        return inside, inside, cells, expanded, 0
    n_levels = len(levels.level_at) - 1
    around = (
        _fields(levels, ground.field_of[slot_of(ground, start)], n_levels),
        _fields(levels, ground.field_of[slot_of(ground, goal)], n_levels),
    )
    most = 1
    for level in range(n_levels):
        for every in around:
            most = max(most, levels.node_at[every[level] + 1] - levels.node_at[every[level]])
    reaches = (np.empty((n_levels, most), np.int64), np.empty((n_levels, most), np.int64))
    reach_nodes(levels, ground, endpoints[0], reaches[0][0])
    reach_nodes(levels, ground, endpoints[1], reaches[1][0])
    rows = climb(levels, around[0][0], reaches[0]), climb(levels, around[1][0], reaches[1])
    if around[0][0] == around[1][0]:
        least, passed, count = _inside(ground, endpoints, cell_work)
        expanded += count
        if least < inside:
            inside, cells = least, passed
    cost, bound, level, nodes, n_expanded = _across(
        levels, top, ground, around, reaches, endpoints[1], inside, epsilon, node_work
    )
    if level < 0:
        return cost, bound, cells, expanded, n_expanded
    while level > 1 and nodes.size > 0:
        children = (around[0][level - 1], around[1][level - 1])
        both = (reaches[0][level - 1], reaches[1][level - 1])
        nodes = descend(levels, level, nodes, children, both)
        level -= 1
    if nodes.size > 0:
        nodes = join_ends(
            levels, nodes, (around[0][0], around[1][0]), (reaches[0][0], reaches[1][0]), rows
        )
    nodes = to_finest(levels, ground, nodes)
    # Without nodes the costs contradict each other.
    cells = cells_of_path(levels, ground, endpoints, nodes) if nodes.size > 0 else nodes
    return cost, bound, cells, expanded, n_expanded


@guarded
@njit(cache=True, nogil=True)
def find_path(ground, levels, top, endpoints, epsilon, near_cells, cell_work, node_work):
    """Find a path of least cost between two cells.

    Parameters
    ----------
    ground, levels, top
        See `CellCosts`, `Levels` and `Top`.
    endpoints
        Two flat cells; there is no path from or to a closed one.
    epsilon
        The search ends once no path can be cheaper by more than this part.
    near_cells
        Cells that the search among cells, which comes first, expands at most.
    cell_work
        int32 (rows * cols,), FAR before and after.
    node_work
        See `NodeWork`.

    Returns
    -------
    tuple
        The cost, NO_PATH for no path, `TORN` if stored costs and steps contradict each other, and a
        lower bound on it; int64 (n, 2), (row, col) of the cells of the path, and the sums of
        `sums_along`; the numbers of cells and of nodes expanded.
    """
    for end in endpoints:
        slot = slot_of(ground, end)
        if ground.field_of[slot] < 0 or ground.units[slot] <= 0:
            return np.int64(NO_PATH), np.int64(NO_PATH), np.empty((0, 2), np.int64), (0, 0), 0, 0
    cost, bound, flat, expanded, n_expanded = _find_flat(
        ground, levels, top, endpoints, epsilon, near_cells, cell_work, node_work
    )
    cells, gap = np.empty((flat.size, 2), np.int64), np.int64(0)
    row_before, col_before = endpoints[0] // ground.cols, endpoints[0] % ground.cols
    for i in range(flat.size):
        row = np.int64(np.uint32(flat[i]) // np.uint32(ground.cols))
        col = flat[i] - row * ground.cols
        cells[i, 0], cells[i, 1] = row, col
        gap = max(gap, abs(row - row_before), abs(col - col_before))
        row_before, col_before = row, col
    if cost < NO_PATH and (flat.size == 0 or gap > 1 or flat[-1] != endpoints[1]):
        cost = np.int64(TORN)
        return cost, cost, cells, (cost, cost), expanded, n_expanded
    return cost, bound, cells, sums_along(ground, cells), expanded, n_expanded
