"""Kernels of the search on a graph of corner cells, contracted or not."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.jumps._join_kernels import is_direct, join
from hybridnav.jumps._leg_kernels import class_of, row_col_kind
from hybridnav.jumps._table_kernels import corner_at, is_corner
from hybridnav.search.arrays import pop, push
from hybridnav.search.contraction import NO_ARC
from hybridnav.search.moves import FAR, octile_cost

FROM_START, FROM_GOAL = -2, -3
"""Returned by `shortest` as the corner cell when the path is one leg: free with the diagonal first
from the start, or with the diagonal first from the goal."""


@njit(cache=True, nogil=True)
def _begin(graph, endpoints, direction, work, is_queued):
    """Queue the corner cells that an end is joined to, with their costs from this end.

    Return the number of queued corner cells, the number that got their first cost, and their
    component, -1 where the end is joined to none.
    """
    tables, places, component, _, _ = graph
    index, _, order, width = tables
    records, heaps, touched, found = work
    cell, aim = endpoints[direction], endpoints[1 - direction]
    n_found = 1
    if is_corner(index, cell):
        found[0] = order[corner_at(index, cell)]
    else:
        n_found = join(tables, cell, found)
    row, col = cell // width, cell % width
    aim_row, aim_col = aim // width, aim % width
    n_touched = 0
    for i in range(n_found):
        node = np.int64(found[i])
        to_row, to_col, _ = row_col_kind(places[node])
        if records[node, 0] == FAR and records[node, 1] == FAR:
            touched[n_touched] = node
            n_touched += 1
        cost = octile_cost(to_row - row, to_col - col)
        records[node, direction], records[node, 2 + direction] = cost, NO_ARC
        if is_queued:
            push(heaps[direction], i, cost + octile_cost(to_row - aim_row, to_col - aim_col), node)
    part = component[found[0]] if n_found > 0 else -1
    return (n_found if is_queued else 0), n_touched, part


@njit(cache=True, nogil=True)
def shortest(graph, endpoints, is_contracted, work):
    """Search for a shortest path between two cells.

    A* runs from the start; in a hierarchy from both endpoints, up to corner cells contracted later.
    A corner cell that both directions reach completes a path, and entries that are not better are
    pruned.

    Parameters
    ----------
    graph
        Tables (see `join`), int64 (n,) places, int32 (n,) components, the legs that may follow (see
        `legs_that_follow`), and arcs: where those of each corner cell begin, int64 (m, 2) cost and
        head (see `arcs_of` and `contract`).
    endpoints
        Flat cells of start and goal.
    is_contracted
        Whether the arcs are those of a hierarchy.
    work
        Records, int64 (n, 4), the first two columns `FAR`: costs from the start and from the goal,
        and the tail and arc by which each was reached; two heaps with room for n and m entries;
        room for n corner cells, int64; the same, int32.

    Returns
    -------
    tuple
        Cost, `FAR` where there is no path; the corner cell where both directions meet, `FROM_START`
        or `FROM_GOAL`; corner cells expanded; number of records to clear.
    """
    tables, places, _, follow, (first, arcs) = graph
    records, heaps, touched, found = work
    width = tables[3]
    rows, cols = (
        endpoints[1] // width - endpoints[0] // width,
        endpoints[1] % width - endpoints[0] % width,
    )
    if is_direct(tables, endpoints[0], endpoints[1]):
        return octile_cost(rows, cols), FROM_START, 0, 0
    if is_direct(tables, endpoints[1], endpoints[0]):
        return octile_cost(rows, cols), FROM_GOAL, 0, 0
    to_goal, n_touched, goal_part = _begin(graph, endpoints, 1, work, is_contracted)
    rest = records, heaps, touched[n_touched:], found
    to_start, n_more, start_part = _begin(graph, endpoints, 0, rest, True)
    n_touched += n_more
    if start_part != goal_part or goal_part < 0:
        return FAR, FROM_START, 0, n_touched
    best, meeting, expanded = FAR, np.int64(FROM_START), 0
    while True:
        if to_start > 0 and heaps[0][0, 0] >= best:
            to_start = 0
        if to_goal > 0 and heaps[1][0, 0] >= best:
            to_goal = 0
        if to_start == 0 and to_goal == 0:
            break
        direction = 0 if to_start > 0 and (to_goal == 0 or heaps[0][0, 0] <= heaps[1][0, 0]) else 1
        heap, size, aim = (
            heaps[direction],
            (to_goal if direction else to_start),
            endpoints[1 - direction],
        )
        aim_row, aim_col = aim // width, aim % width
        estimate = heap[0, 0]
        node = pop(heap, size)
        size -= 1
        row, col, kind = row_col_kind(places[node])
        cost = records[node, direction]
        if estimate == cost + octile_cost(row - aim_row, col - aim_col):
            expanded += 1
            if cost + records[node, 1 - direction] < best:
                best, meeting = cost + records[node, 1 - direction], node
            by = records[node, 2 + direction]
            if by != NO_ARC:
                may_follow = follow[kind, arcs[by & 0xFFFFFFFF, 1] & 63]
            elif row * width + col == endpoints[direction]:
                may_follow = np.int64(-1)
            else:
                leg = class_of(
                    endpoints[direction] // width - row, endpoints[direction] % width - col
                )
                may_follow = follow[kind, leg]
            for arc in range(first[node], first[node + 1]):
                packed, further = arcs[arc, 1], cost + arcs[arc, 0]
                other = packed >> 12
                known = records[other, direction]
                if may_follow >> (packed >> 6 & 63) & 1 == 0 or known <= further:
                    continue
                row, col, _ = row_col_kind(places[other])
                estimate = further + octile_cost(row - aim_row, col - aim_col)
                if estimate >= best:
                    continue
                if known == FAR and records[other, 1 - direction] == FAR:
                    touched[n_touched] = other
                    n_touched += 1
                records[other, direction], records[other, 2 + direction] = further, node << 32 | arc
                push(heap, size, estimate, other)
                size += 1
        if direction:
            to_goal = size
        else:
            to_start = size
    return best, meeting, expanded, n_touched
