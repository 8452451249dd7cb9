"""Kernels of searches among nodes: up the levels from a cell, over the top, and over cliques."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._cost_kernels import clique_place
from hybridnav.overlay._field_kernels import with_room
from hybridnav.overlay._guide_kernels import ahead_of
from hybridnav.overlay._lane_kernels import FAR, NO_PATH
from hybridnav.search.arrays import pop, push

START = -(1 << 30)
"""Mark of the nodes at which a search began."""


@njit(cache=True, nogil=True)
def _flood(levels, field, child, below):
    """Compute the distances from a cell to all nodes of the finest level inside a field.

    Parameters
    ----------
    levels
        See `Levels`.
    field
        A field of the level above the finest.
    child
        The field of the finest level around the cell, inside it.
    below
        int64 (n,), the distances to the nodes of `child`, inside that.
    """
    fields = levels.inner_at[field], levels.inner_at[field + 1]
    begin = levels.node_at[fields[0]]
    span = begin, levels.node_at[fields[1]]
    distance = np.full(span[1] - begin, NO_PATH, np.int64)
    is_new, is_old = np.zeros(distance.size, np.bool_), np.zeros(distance.size, np.bool_)
    nearest = np.full(fields[1] - fields[0], NO_PATH, np.int64)
    first = levels.node_at[child] - begin
    for i in range(below.size):
        distance[first + i] = below[i]
        is_old[first + i] = below[i] < NO_PATH
    current = np.int64(child)
    while current >= 0:
        _leave(levels, current, (fields[0], span[1]), distance, is_new, is_old, nearest)
        at = np.argmin(nearest)
        current = np.int64(-1) if nearest[at] == NO_PATH else fields[0] + at
        nearest[at] = NO_PATH
        if current >= 0:
            _cross(levels, current, begin, distance, is_new, is_old)
    return distance


@njit(cache=True, nogil=True)
def _leave(levels, field, span, distance, is_new, is_old, nearest):
    """Lower the distances at the far ends of moves from a field, of nodes that were improved.

    Parameters
    ----------
    levels
        See `Levels`.
    field
        A field of the finest level.
    span
        The first field, whose first node has place 0, and the node after the last.
    distance
        int64 (n,), changed.
    is_new, is_old
        bool (n,), changed: nodes that a move improved, and nodes whose moves are to be looked at.
    nearest
        int64 (fields,), changed: the least distance of a new node in each field inside.
    """
    first, end = span
    begin = levels.node_at[first]
    for node in range(levels.node_at[field], levels.node_at[field + 1]):
        if not is_old[node - begin]:
            continue
        is_old[node - begin] = False
        for at in range(levels.move_at[node], levels.move_at[node + 1]):
            other = levels.move_to[at]
            offered = distance[node - begin] + levels.move_cost[at]
            if begin <= other < end and levels.move_cost[at] < FAR:
                if offered < distance[other - begin]:
                    distance[other - begin] = offered
                    is_new[other - begin] = True
                    inside = levels.field_of[other] - first
                    nearest[inside] = min(nearest[inside], offered)


@njit(cache=True, nogil=True)
def _cross(levels, field, begin, distance, is_new, is_old):
    """Lower the distances of the nodes of a field to those of its new ones plus the clique's."""
    first, n = levels.node_at[field] - begin, levels.node_at[field + 1] - levels.node_at[field]
    at = levels.clique_at[field]
    own = distance[first : first + n]
    for i in range(n):
        if not is_new[first + i]:
            continue
        is_new[first + i], is_old[first + i] = False, True
        value = own[i]
        for j in range(n):
            cost = levels.clique[at + clique_place(i, j)]
            if cost < FAR and value + cost < own[j]:
                own[j] = value + cost
                is_old[first + j] = True


@njit(cache=True, nogil=True)
def climb(levels, field, distance, reach):
    """Compute the distances from a cell to the nodes of its field on each level, inside it.

    Parameters
    ----------
    levels
        See `Levels`.
    field
        The field of the cell on the finest level.
    distance
        int32 (rows * cols,), distances inside that field.
    reach
        int64 (levels, most nodes of a field), changed; where tables are stale, these are the
        distances before the changes.

    Returns
    -------
    ndarray
        int64 (n,), the distances to the nodes of the finest level, inside its field of the next
        one; those of its own field with one level.
    """
    first, last = levels.node_at[field], levels.node_at[field + 1]
    for node in range(first, last):
        value = np.int64(distance[levels.cell_of[node]])
        reach[0, node - first] = value if value < FAR else NO_PATH
    row = reach[0, : last - first]
    if len(reach) > 1:
        child, field = field, levels.parent[field]
        row = _flood(levels, field, child, row)
        first, last = levels.node_at[field], levels.node_at[field + 1]
        begin = levels.node_at[levels.inner_at[field]]
        for i in range(last - first):
            reach[1, i] = row[levels.below[first + i] - begin]
    for level in range(2, len(reach)):
        inner, count = first, last - first
        field = levels.parent[field]
        first, last = levels.node_at[field], levels.node_at[field + 1]
        begin = levels.node_at[levels.inner_at[field]]
        width = levels.node_at[levels.inner_at[field + 1]] - begin
        below = reach[level - 1, :count]
        for i in range(last - first):
            at = levels.table_at[field] + i * width + inner - begin
            stored = levels.table[at : at + count]
            least = np.int64(NO_PATH)
            for j in range(count):
                total = below[j] + stored[j] if stored[j] < FAR else np.int64(NO_PATH)
                least = min(least, total)
            reach[level, i] = least
    return row


@njit(cache=True, nogil=True)
def join(levels, top, fields, reaches, limit):
    """Return the least distance over the top, its two nodes, -1 when none is below the limit.

    Parameters
    ----------
    levels, top
        See `Levels` and `Top`.
    fields
        The fields of start and goal on the last level.
    reaches
        Two int64 (n,), the distances inside them, from the start and to the goal.
    limit
        Only less is looked for.
    """
    origin = levels.node_at[levels.level_at[len(levels.level_at) - 2]]
    starts, goals = levels.node_at[fields[0]], levels.node_at[fields[1]]
    n_starts = levels.node_at[fields[0] + 1] - starts
    n_goals = levels.node_at[fields[1] + 1] - goals
    best, ends = np.int64(limit), (np.int64(-1), np.int64(-1))
    from_start, to_goal = reaches
    for i in range(n_starts):
        if from_start[i] >= best:
            continue
        row = top.distance[starts + i - origin, goals - origin : goals - origin + n_goals]
        least = np.int64(NO_PATH)
        for j in range(n_goals):
            beyond = row[j] + to_goal[j] if row[j] < FAR else np.int64(NO_PATH)
            least = min(least, beyond)
        if from_start[i] + least < best:
            best = from_start[i] + least
            for j in range(n_goals):
                if row[j] < FAR and row[j] + to_goal[j] == least:
                    ends = (starts + i, goals + j)
                    break
    return best, ends[0], ends[1]


@njit(cache=True, nogil=True)
def _active(levels, node):
    """Return the node on the same cell of the highest level whose field there is not stale."""
    field = levels.field_of[node]
    while levels.is_stale[field]:
        node = levels.below[node]
        field = levels.field_of[node]
    while levels.parent[field] >= 0 and not levels.is_stale[levels.parent[field]]:
        node = levels.above[node]
        field = levels.field_of[node]
    return node


@njit(cache=True, nogil=True)
def over_cliques(levels, ground, top, span, fields, reaches, target, limit, epsilon, work):
    """Find the shortest path over nodes, by A*.

    Parameters
    ----------
    levels, ground, top
        See `Levels`, `CellCosts` and `Top`.
    span
        The first node and the one after the last: those of one level inside one field of the level
        above. `(0, -1)` for the whole map: then each cell counts to the field of the highest level
        whose table is not stale.
    fields
        The fields of start and goal.
    reaches
        Two int64 (n,), the distances inside them, from the start and to the goal.
    target
        See `ahead_of`.
    limit
        Only less is looked for.
    epsilon
        The search ends once no path can be shorter by more than this part.
    work
        See `NodeWork`.

    Returns
    -------
    tuple
        The distance; a lower bound on it, not above the distance; the last node, -1 when there is
        none; the number of nodes expanded.
    """
    is_whole = span[1] < 0
    distance, before = work.distance, work.before
    heap = np.empty((256, 2), np.int64)
    size, expanded = 0, 0
    best, found = np.int64(limit), np.int64(-1)
    work.counts[:] = 0
    first, goals = levels.node_at[fields[0]], levels.node_at[fields[1]]
    for node in range(first, levels.node_at[fields[0] + 1]):
        value = reaches[0][node - first]
        if value >= best:
            continue
        key = value + ahead_of(levels, ground, top, target, is_whole, node, work)
        if key < best:
            heap = with_room(heap, size, 1)
            push(heap, size, key, node)
            size += 1
            distance[node], before[node] = value, START
    while size > 0 and heap[0, 0] * (1.0 + epsilon) < best:
        key = heap[0, 0]
        node = pop(heap, size)
        size -= 1
        value = distance[node]
        if key != value + work.ahead[node]:
            continue
        expanded += 1
        field = levels.field_of[node]
        if field == fields[1] and value + reaches[1][node - goals] < best:
            best, found = value + reaches[1][node - goals], node
        begin, end = levels.move_at[node], levels.move_at[node + 1]
        inside = levels.node_at[field]
        # A distance over a clique is never improved by the same clique.
        count = levels.node_at[field + 1] - inside if before[node] >= 0 else 0
        heap = with_room(heap, size, count + end - begin)
        for k in range(count + end - begin):
            if k < count:
                place = levels.clique_at[field] + clique_place(node - inside, k)
                other, cost, mark = inside + k, levels.clique[place], ~node
            else:
                move = begin + k - count
                other, cost, mark = np.int64(levels.move_to[move]), levels.move_cost[move], node
                if is_whole:
                    other = np.int64(_active(levels, other))
                elif other < span[0] or other >= span[1]:
                    continue
            offered = value + cost
            if cost >= FAR or offered >= distance[other]:
                continue
            # A call that passes all these arrays costs as much as the rest of the turn.
            ahead = work.ahead[other]
            if ahead < 0:
                ahead = ahead_of(levels, ground, top, target, is_whole, other, work)
            key = offered + ahead
            if key >= best:
                continue
            distance[other], before[other] = offered, mark
            push(heap, size, key, other)
            size += 1
    for i in range(work.counts[0]):
        distance[work.seen[i]], work.ahead[work.seen[i]] = NO_PATH, -1
    proved = min(best, heap[0, 0]) if size > 0 else best
    return best, proved, found, expanded
