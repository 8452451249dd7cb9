"""Kernels of tables of distances: labels of many ends, and where they meet.

The label of an end holds each corner that a search from it reaches upwards in a hierarchy, with its
cost. A shortest path between two ends passes a corner of both labels, or none at all. With buckets
of one side's labels by corner, a row of the table costs one look at each entry of its own label.

S. Knopp, P. Sanders, D. Schultes, F. Schulz, D. Wagner: Computing many-to-many shortest paths using
highway hierarchies, 2007.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, grow_rows, pop, push
from hybridnav._base.kernels.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT
from hybridnav._base.moves import FAR


@njit(cache=True, nogil=True)
def climb(hierarchy, seeds, work, nodes, costs, n):
    """Append the label of an end: search upwards from its corners until nothing is left.

    `hierarchy`: uint8 kinds of corners, offsets of their arcs, the arcs, and the classes that may
    follow; see `contract`; `seeds`: int32 corners that the end sees, each once or more; int64 costs
    to them; int64 classes of arcs that may follow there, as bits; `work`: int64 (n_corners, 2),
    costs (`FAR`) and classes that may follow; int64 heap; `nodes`, `costs`, `n`: int32 and int64,
    the labels so far, and how many entries they have. Returns the labels, in larger arrays if there
    was no room; how many entries they have; the heap.
    """
    kinds, first, arcs, follow = hierarchy
    seen, at_cost, may_follow = seeds
    records, heap = work
    size = 0
    for k in range(len(seen)):
        corner = seen[k]
        if at_cost[k] < records[corner, 0]:
            records[corner, 0], records[corner, 1] = at_cost[k], may_follow[k]
            if size == len(heap):
                heap = grow_rows(heap)
            push(heap, size, at_cost[k], np.int64(corner))
            size += 1
    begin = n
    while size > 0:
        cost, node = heap[0, 0], heap[0, 1]
        pop(heap, size)
        size -= 1
        if cost != records[node, 0]:
            continue  # reached at less since it was queued
        if n == len(nodes):
            nodes, costs = grow(nodes), grow(costs)
        nodes[n], costs[n] = node, cost
        n += 1

        # Arcs that bend away from the blocked cell are on no shortest path.
        for arc in range(first[node], first[node + 1]):
            packed, further = arcs[arc, 1], cost + arcs[arc, 0]
            other = packed >> 12
            if records[node, 1] >> (packed >> 6 & 63) & 1 == 0 or records[other, 0] <= further:
                continue
            records[other, 0] = further
            records[other, 1] = follow[kinds[other], packed & 63]
            if size == len(heap):
                heap = grow_rows(heap)
            push(heap, size, further, other)
            size += 1

    # What an entry was reached by at equal cost is listed twice at most; clean up by the entries.
    for k in range(begin, n):
        records[nodes[k], 0] = FAR
    return nodes, costs, n, heap


@guarded
@njit(cache=True, nogil=True)
def costs_to_cells(grid, start, goals, left, best):
    """Find the least costs of cells from one cell, by Dijkstra's algorithm.

    `grid`: uint8 (n_cells,), the legal moves of each flat cell; int32 (n_cells,), the factors of
    the cells in units; and the columns of the grid; `goals`, `left`: bool (n_cells,), and how many
    of them are to be settled; `best`: int64 (n_cells,), filled with the costs; `FAR` where there is
    no path, and no less than the least cost of cells that are no goals.
    """
    moves, units, cols = grid
    heap, size = np.empty((4096, 2), np.int64), 1
    best[:] = FAR
    best[start] = 0
    heap[0] = 0, start
    while size > 0:
        cost, cell = heap[0, 0], heap[0, 1]
        pop(heap, size)
        size -= 1
        if cost != best[cell]:
            continue  # reached at less since it was queued
        if goals[cell]:
            left -= 1
            if left == 0:
                break
        if size + 8 > len(heap):
            heap = grow_rows(heap)
        for k in range(8):
            if moves[cell] >> k & 1 == 0:
                continue
            to = cell + ROW_STEP[k] * cols + COL_STEP[k]
            step = DIAGONAL if k & 1 else STRAIGHT
            further = cost + step * (np.int64(units[cell]) + units[to])
            if further < best[to]:
                best[to] = further
                push(heap, size, further, to)
                size += 1


@guarded
@njit(cache=True, nogil=True)
def meet(labels, buckets, table):
    """Lower the entries of a table to the least cost by which two labels meet.

    `labels`: int64 (n + 1,) offsets of the labels of the starts, int32 corners, int64 costs;
    `buckets`: the same of the goals, by corner: int64 (n_corners + 1,) offsets, int32 goals, int64
    costs; `table`: int64 (n, m); changed.
    """
    offset, nodes, costs = labels
    begin, goals, further = buckets
    for start in range(len(offset) - 1):
        row = table[start]
        for k in range(offset[start], offset[start + 1]):
            cost = costs[k]
            if cost == FAR:
                continue
            for at in range(begin[nodes[k]], begin[nodes[k] + 1]):
                through = cost + further[at]
                if through < row[goals[at]]:
                    row[goals[at]] = through
