"""Kernels of the paths between nodes of the level above the finest, inside their fields.

The nodes below that lie on such paths are marked when the costs of the field are computed, a bit
for each of them and each node at which paths end. A search that passes marked nodes alone is quick.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._cost_kernels import clique_place, least_cost
from hybridnav.overlay._field_kernels import rank, with_room
from hybridnav.overlay._lane_kernels import FAR, NO_PATH
from hybridnav.overlay._path_kernels import append, inside_of, next_node
from hybridnav.search.arrays import pop, push


@njit(cache=True, nogil=True)
def mark_paths(levels, field, table):
    """Mark a shortest path between every two nodes of a field of the level above the finest.

    Parameters
    ----------
    levels
        See `Levels`; its marks are changed.
    field
        The field.
    table
        int32 (n, m), the distances inside it from its nodes to those of the level below.
    """
    first, span = levels.node_at[field], inside_of(levels, field)
    marks = levels.marks[levels.marks_at[field] : levels.marks_at[field + 1]]
    marks[:] = 0
    n, width = table.shape
    for i in range(n):
        last, row = np.int64(levels.below[first + i]), table[i]
        for j in range(i):
            node = np.int64(levels.below[first + j])
            while node >= 0 and node != last and row[node - span[0]] < FAR:
                bit = i * width + node - span[0]
                if marks[bit >> 3] >> (bit & 7) & 1:
                    break
                marks[bit >> 3] |= np.uint8(1 << (bit & 7))
                node = next_node(levels, span, row, node)


@njit(cache=True, nogil=True)
def to_finest(levels, ground, upper):
    """Return the nodes of a path with those of the level above the finest replaced.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    upper
        int64 (n,), nodes of the two finest levels.

    Returns
    -------
    ndarray
        int64 (m,), empty if no path is as long as the costs state.
    """
    if len(levels.level_at) == 2:
        return upper
    begin = levels.node_at[levels.level_at[1]]
    nodes, n = np.empty(4 * upper.size + 64, np.int64), 0
    for i in range(upper.size):
        node = upper[i]
        field = levels.field_of[node]
        if i > 0 and node >= begin and levels.field_of[upper[i - 1]] == field:
            # Marks lead from the node of the smaller number to the other one.
            low, high = min(upper[i - 1], node), max(upper[i - 1], node)
            if low == high:
                continue
            filled = n
            nodes, n = _over_marked(levels, ground, low, high, nodes, n)
            if n < 0:
                return nodes[:0]
            if high == node:
                nodes[filled:n] = nodes[filled:n][::-1].copy()
            nodes = append(nodes, n, levels.below[node])
        else:
            nodes = append(nodes, n, levels.below[node] if node >= begin else node)
        n += 1
    return nodes[:n]


@njit(cache=True, nogil=True)
def _over_marked(levels, ground, low, high, nodes, n):
    """Append the nodes between two on a shortest path over marked ones, from the last to the first.

    A* expands nodes that a move reaches, over the clique to the moves beyond it. Its order need not
    prove the cost, which is known.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    low, high
        Two nodes of a field of the level above the finest, the smaller number first; neither is
        appended.
    nodes, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `nodes`, in a new array if there was no room, and their number, -1 if no path is as long as
        the costs state.
    """
    field = levels.field_of[high]
    span, first = inside_of(levels, field), levels.node_at[field]
    begin, width = np.int64(span[0]), np.int64(span[1] - span[0])
    marks = levels.marks[levels.marks_at[field] : levels.marks_at[field + 1]]
    row = (high - first) * width - begin
    limit = np.int64(
        levels.clique[levels.clique_at[field] + clique_place(high - first, low - first)]
    )
    start, goal = np.int64(levels.below[low]), np.int64(levels.below[high])
    distance, before = np.full(width, NO_PATH, np.int64), np.empty(width, np.int32)
    heap, size, goal_cell = np.empty((64, 2), np.int64), 1, levels.cell_of[goal]
    push(heap, 0, np.int64(0), start)
    distance[start - begin], before[start - begin] = 0, start
    while size > 0 and distance[goal - begin] > limit:
        entry = heap[0, 1]
        pop(heap, size)
        size -= 1
        value, own = distance[entry - begin], levels.field_of[entry]
        inside = levels.node_at[own]
        for node in range(inside, levels.node_at[own + 1]):
            bit = row + node
            if not marks[bit >> 3] >> (bit & 7) & 1 and node != goal:
                continue
            offered = value
            if node != entry:
                place = clique_place(entry - inside, node - inside)
                offered += levels.clique[levels.clique_at[own] + place]
                if offered > limit or offered >= distance[node - begin]:
                    continue
                distance[node - begin], before[node - begin] = offered, entry
            ahead = least_cost(levels.cell_of[node], goal_cell, ground.cols, ground.least_units)
            if offered + ahead > limit:
                continue
            moves = levels.move_at[node], levels.move_at[node + 1]
            heap = with_room(heap, size, moves[1] - moves[0])
            for at in range(moves[0], moves[1]):
                other = np.int64(levels.move_to[at])
                if not span[0] <= other < span[1]:
                    continue
                bit, total = row + other, offered + levels.move_cost[at]
                if not marks[bit >> 3] >> (bit & 7) & 1 and other != goal:
                    continue
                if total <= limit and total < distance[other - begin]:
                    distance[other - begin], before[other - begin] = total, node
                    push(heap, size, rank(total, ahead), other)
                    size += 1
    if distance[goal - begin] > limit:
        return nodes, -1
    node = np.int64(before[goal - begin])
    while node != start:
        nodes = append(nodes, n, node)
        n += 1
        node = np.int64(before[node - begin])
    return nodes, n
