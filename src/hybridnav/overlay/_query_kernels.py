"""Kernel of a query on a multilevel overlay: up the levels, across, and down."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.overlay._cell_kernels import append_cells
from hybridnav.overlay._field_kernels import append_back, forget, spread
from hybridnav.overlay._guide_kernels import aim
from hybridnav.overlay._lane_kernels import FAR, NO_PATH
from hybridnav.overlay._node_kernels import climb, join, over_cliques
from hybridnav.overlay._path_kernels import (
    append,
    back_over_cliques,
    descend,
    join_ends,
    over_top,
    to_finest,
)


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
        total, first, end = join(levels, top, fields, (reaches[0][last], reaches[1][last]), best)
        if total < best:
            best, level_of = total, last
            nodes = over_top(levels, top, first, end)
    target = aim(levels, ground, top, goal, around[1][last], reaches[1][last])
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


@guarded
@njit(cache=True, nogil=True)
def find_path(ground, levels, top, endpoints, epsilon, cell_work, node_work):
    """Find a path of least cost between two cells.

    Parameters
    ----------
    ground, levels, top
        See `CellCosts`, `Levels` and `Top`.
    endpoints
        Two flat cells of fields.
    epsilon
        The search ends once no path can be cheaper by more than this part.
    cell_work
        int32 (2, rows * cols), FAR before and after.
    node_work
        See `NodeWork`.

    Returns
    -------
    tuple
        The cost, NO_PATH for no path, and a lower bound on it; int64 (n,) flat cells of the path;
        the numbers of cells and of nodes expanded.
    """
    start, goal = endpoints
    n_levels = len(levels.level_at) - 1
    from_start, to_goal = cell_work[0], cell_work[1]
    fields = np.int64(ground.field_of[start]), np.int64(ground.field_of[goal])
    spans = (fields[0], fields[0] + 1), (fields[1], fields[1] + 1)
    touched, n_touched, expanded = spread(
        ground, spans[0], start, np.int64(-1), np.int64(FAR), from_start, np.empty(256, np.int64)
    )
    others, n_others, more = spread(
        ground, spans[1], goal, np.int64(-1), np.int64(FAR), to_goal, np.empty(256, np.int64)
    )
    expanded += more
    around = (
        _fields(levels, fields[0], n_levels),
        _fields(levels, fields[1], n_levels),
    )
    most = 1
    for level in range(n_levels):
        for every in around:
            most = max(most, levels.node_at[every[level] + 1] - levels.node_at[every[level]])
    reaches = (np.empty((n_levels, most), np.int64), np.empty((n_levels, most), np.int64))
    rows = (
        climb(levels, around[0][0], from_start, reaches[0]),
        climb(levels, around[1][0], to_goal, reaches[1]),
    )
    inside = np.int64(NO_PATH)
    if around[0][0] == around[1][0] and from_start[goal] < FAR:
        inside = np.int64(from_start[goal])
    cost, bound, level, nodes, n_expanded = _across(
        levels, top, ground, around, reaches, goal, inside, epsilon, node_work
    )
    cells, n = np.empty(512, np.int64), 0
    if level < 0:
        forget(to_goal, others, n_others)
        if inside < NO_PATH:
            cells, n = append_back(ground, spans[0], from_start, goal, cells, n)
        cells = append(cells, n, start)
        cells[: n + 1] = cells[: n + 1][::-1].copy()
        forget(from_start, touched, n_touched)
        return cost, bound, cells[: n + 1], expanded, n_expanded
    while level > 1:
        children = (around[0][level - 1], around[1][level - 1])
        both = (reaches[0][level - 1], reaches[1][level - 1])
        nodes = descend(levels, level, nodes, children, both)
        level -= 1
    nodes = join_ends(
        levels, nodes, (around[0][0], around[1][0]), (reaches[0][0], reaches[1][0]), rows
    )
    nodes = to_finest(levels, ground, nodes)
    first, last = levels.cell_of[nodes[0]], levels.cell_of[nodes[-1]]
    cells, n = append_back(ground, spans[0], from_start, first, cells, n)
    cells = append(cells, n, start)
    n += 1
    cells[:n] = cells[:n][::-1].copy()
    forget(from_start, touched, n_touched)
    cells, touched, n, more = append_cells(ground, levels, nodes, from_start, touched, cells, n)
    tail, m = append_back(ground, spans[1], to_goal, last, np.empty(64, np.int64), 0)
    forget(to_goal, others, n_others)
    if m > 0:
        for i in range(1, m):
            cells = append(cells, n, tail[i])
            n += 1
        cells = append(cells, n, goal)
        n += 1
    return cost, bound, cells[:n], expanded + more, n_expanded
