"""Kernels of lower bounds on the distances from nodes to a goal, by which searches are guided."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._cost_kernels import least_cost
from hybridnav.overlay._lane_kernels import FAR, NO_PATH


@njit(cache=True, nogil=True)
def _over_table(top, at, first, tail):
    """Return the least sum of a stored distance and a bound beyond it."""
    least = np.int64(NO_PATH)
    for j in range(tail.size):
        stored = top.distance[at, first + j]
        total = stored + tail[j] if stored < FAR else np.int64(NO_PATH)
        least = min(least, total)
    return least


@njit(cache=True, nogil=True)
def aim(levels, ground, top, goal, field, reach):
    """Return what `ahead_of` needs of a goal.

    Parameters
    ----------
    levels, ground, top
        See `Levels`, `CellCosts` and `Top`.
    goal
        Flat cell.
    field
        Its field on the last level.
    reach
        int64 (n,), the distances from the nodes of that field as `climb` computed them.

    Returns
    -------
    tuple
        `goal`, `field`; int64 (n,), bounds on the distances from the nodes of the field to the
        goal; int64 (k,), those from the nodes `top.lowered`, over stored distances.

    Notes
    -----
    Stored distances bound every path over costs that were not lowered. A path over lowered costs
    enters a field with lowered costs at one of its nodes p and leaves the last one at a node q:
    what lies between costs at least the distance without obstacles.
    """
    cols, least_units = ground.cols, ground.least_units
    first, last = levels.node_at[field], levels.node_at[field + 1]
    tail = np.empty(last - first, np.int64)
    for node in range(first, last):
        tail[node - first] = reach[node - first]
        if levels.is_stale[field] and levels.is_lowered[field]:
            tail[node - first] = least_cost(levels.cell_of[node], goal, cols, least_units)
    beyond = np.full(top.lowered.size, NO_PATH, np.int64)
    if top.distance.size == 0:
        return goal, field, tail, beyond
    origin = levels.node_at[levels.level_at[len(levels.level_at) - 2]]
    direct = np.empty(top.lowered.size, np.int64)
    for j in range(top.lowered.size):
        direct[j] = _over_table(top, top.lowered[j] - origin, first - origin, tail)
    for i in range(top.lowered.size):
        for j in range(top.lowered.size):
            cells = levels.cell_of[top.lowered[i]], levels.cell_of[top.lowered[j]]
            total = direct[j] + least_cost(cells[0], cells[1], cols, least_units)
            beyond[i] = min(beyond[i], total)
    return goal, field, tail, beyond


@njit(cache=True, nogil=True)
def _note(node, bound, work):
    """Keep the bound of a node for the rest of the search, and return it."""
    work.ahead[node] = bound
    work.seen[work.counts[0]] = node
    work.counts[0] += 1
    return np.int64(bound)


@njit(cache=True, nogil=True)
def _from_last_level(levels, ground, top, target, node, work):
    """Return the bound of a node of the last level."""
    if work.ahead[node] >= 0:
        return work.ahead[node]
    goal, field, tail, beyond = target
    origin = levels.node_at[levels.level_at[len(levels.level_at) - 2]]
    bound = _over_table(top, node - origin, levels.node_at[field] - origin, tail)
    for j in range(beyond.size):
        stored = top.distance[node - origin, top.lowered[j] - origin]
        if stored < FAR:
            bound = min(bound, stored + beyond[j])
    without = least_cost(levels.cell_of[node], goal, ground.cols, ground.least_units)
    return _note(node, max(bound, without), work)


@njit(cache=True, nogil=True)
def _inside_stale(levels, ground, top, target, around, work):
    """Note the bounds of all nodes inside a stale field of the last level, by its former table.

    Parameters
    ----------
    levels, ground, top, target, work
        See `ahead_of`.
    around
        The field; its costs were not lowered.

    Notes
    -----
    A path leaves the field at one of its nodes, or the goal lies inside. Then the distance is not
    less than the difference of those from a node of the field, as for landmarks.
    """
    goal, field, tail, _ = target
    first, last = levels.node_at[around], levels.node_at[around + 1]
    begin = levels.node_at[levels.inner_at[around]]
    width = levels.node_at[levels.inner_at[around + 1]] - begin
    least, most = np.full(width, NO_PATH, np.int64), np.zeros(width, np.int64)
    for node in range(first, last):
        rest = _from_last_level(levels, ground, top, target, node, work)
        at = levels.table_at[around] + (node - first) * width
        row = levels.table[at : at + width]
        to_goal = tail[node - first] if around == field else np.int64(NO_PATH)
        for i in range(width):
            stored = np.int64(row[i])
            total = rest + stored if stored < FAR else np.int64(NO_PATH)
            apart = stored - to_goal if stored < FAR else np.int64(0)
            least[i] = min(least[i], total)
            most[i] = max(most[i], apart)
    for i in range(width):
        without = least_cost(levels.cell_of[begin + i], goal, ground.cols, ground.least_units)
        inside = max(most[i], without) if around == field else np.int64(NO_PATH)
        _note(begin + i, max(min(least[i], inside), without), work)


@njit(cache=True, nogil=True)
def ahead_of(levels, ground, top, target, is_guided, node, work):
    """Return a lower bound on the distance from a node to the goal; see `aim`.

    Parameters
    ----------
    levels, ground, top
        See `Levels`, `CellCosts` and `Top`.
    target
        What `aim` returned.
    is_guided
        Whether to look into stored distances.
    node
        Node of any level.
    work
        See `NodeWork`; its bounds are changed.
    """
    if work.ahead[node] >= 0:
        return work.ahead[node]
    if is_guided and top.distance.size > 0:
        around = levels.parent[levels.field_of[node]]
        if around < 0:
            return _from_last_level(levels, ground, top, target, node, work)
        if not levels.is_lowered[around] and levels.parent[around] < 0:
            _inside_stale(levels, ground, top, target, around, work)
            return work.ahead[node]
    cell = levels.cell_of[node]
    return _note(node, least_cost(cell, target[0], ground.cols, ground.least_units), work)
