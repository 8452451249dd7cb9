"""Kernels of searches among nodes: up the levels from a cell, over the top, and over cliques."""

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.arrays import pop, push
from hybridnav.search.overlay.kernels.costs import clique_place, least_cost, slot_of
from hybridnav.search.overlay.kernels.exits import reach_over_exits
from hybridnav.search.overlay.kernels.fields import with_room
from hybridnav.search.overlay.kernels.guides import ahead_of
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH
from hybridnav.search.overlay.kernels.paths import START


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
    clique = levels.clique[levels.clique_at[field] : levels.clique_at[field + 1]]
    own = distance[first : first + n]
    before = own.copy()
    for i in range(n):
        if not is_new[first + i]:
            continue
        is_new[first + i], is_old[first + i] = False, True
        value, row = own[i], clique_place(i, 0)
        for j in range(i):
            total = value + clique[row + j] if clique[row + j] < FAR else np.int64(NO_PATH)
            own[j] = min(own[j], total)
        place = clique_place(i + 1, i)
        for j in range(i + 1, n):
            total = value + clique[place] if clique[place] < FAR else np.int64(NO_PATH)
            own[j] = min(own[j], total)
            place += j + 1
    for i in range(n):
        is_old[first + i] |= own[i] < before[i]


@njit(cache=True, nogil=True)
def climb(levels, field, reach):
    """Compute the distances from a cell to the nodes of its field on each level, inside it.

    Parameters
    ----------
    levels
        See `Levels`.
    field
        The field of the cell on the finest level.
    reach
        int64 (levels, most nodes of a field), changed but for its first row, the distances inside
        that field. Where tables are stale, these are not below the distances before the changes.

    Returns
    -------
    ndarray
        int64 (n,), the distances to the nodes of the finest level, inside its field of the next
        one; those of its own field with one level.
    """
    first, last = levels.node_at[field], levels.node_at[field + 1]
    row = reach[0, : last - first]
    if len(reach) > 1:
        child, field = field, np.int64(levels.parent[field])
        row = _flood(levels, field, child, row)
        begin = levels.node_at[levels.inner_at[field]]
        first, last = levels.node_at[field], levels.node_at[field + 1]
        for i in range(last - first):
            reach[1, i] = row[levels.below[first + i] - begin]
    for level in range(2, len(reach)):
        reach_over_exits(levels, field, reach[level - 1], reach[level])
        field = np.int64(levels.parent[field])
    return row


@njit(cache=True, nogil=True)
def least_reach(levels, ground, cell, reach):
    """Return lower bounds on the distances from a cell to the nodes of its field of the last level,
    where that is stale and costs were not lowered.

    Distances over a clique of later costs bound none over exits of former ones: a path may leave
    the field elsewhere. There, distances without obstacles do.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    cell
        Flat cell.
    reach
        int64 (levels, n), as `climb` computed it.
    """
    last, field = len(reach) - 1, np.int64(ground.field_of[slot_of(ground, cell)])
    for _ in range(min(last, 1)):
        field = np.int64(levels.parent[field])
    if not levels.is_newer[field]:
        return reach[last]
    first, last_node = levels.node_at[field], levels.node_at[field + 1]
    row, above = np.empty_like(reach[0]), np.empty_like(reach[0])
    for node in range(first, last_node):
        row[node - first] = least_cost(cell, levels.cell_of[node], ground.cols, ground.least_units)
    for _ in range(2, len(reach)):
        reach_over_exits(levels, field, row, above)
        row, above = above, row
        field = np.int64(levels.parent[field])
    return row


@njit(cache=True, nogil=True)
def _active(levels, node):
    """Return the node on the same cell of the highest level whose field there is not stale."""
    field = levels.field_of[node]
    while levels.is_stale[field] and levels.below[node] >= 0:
        node = levels.below[node]
        field = levels.field_of[node]
    while (
        levels.parent[field] >= 0
        and not levels.is_stale[levels.parent[field]]
        and levels.above[node] >= 0
    ):
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

    # The start reaches the nodes of its field inside it. Here as below, what is not below the best
    # distance, at first the limit, is dropped.
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

    # The least key is a lower bound on every path not found yet; `epsilon` allows it to lie a
    # little below the best distance.
    while size > 0 and heap[0, 0] * (1.0 + epsilon) < best:
        key = heap[0, 0]
        node = pop(heap, size)
        size -= 1
        value = distance[node]

        # An entry whose node was reached at less since is out of date.
        if key != value + work.ahead[node]:
            continue
        expanded += 1
        field = levels.field_of[node]

        # From a node of the goal's field, the way inside it completes a path.
        if field == fields[1] and value + reaches[1][node - goals] < best:
            best, found = value + reaches[1][node - goals], node
        begin, end = levels.move_at[node], levels.move_at[node + 1]
        inside = levels.node_at[field]
        # A distance over a clique is never improved by the same clique.
        count = levels.node_at[field + 1] - inside if before[node] >= 0 else 0
        heap = with_room(heap, size, count + end - begin)

        # First the clique of the field, marked by the inverted node, then the moves out of it.
        for k in range(count + end - begin):
            if k < count:
                place = levels.clique_at[field] + clique_place(node - inside, k)
                other, cost, mark = inside + k, levels.clique[place], ~node
            else:
                move = begin + k - count
                other, cost, mark = np.int64(levels.move_to[move]), levels.move_cost[move], node

                # On the whole map, a cell counts as its highest node whose field is not stale.
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

    # Every node with a distance has a bound, hence a place in `seen`: this clears both.
    for i in range(work.counts[0]):
        distance[work.seen[i]], work.ahead[work.seen[i]] = NO_PATH, -1
    proved = min(best, heap[0, 0]) if size > 0 else best
    return best, proved, found, expanded
