"""Kernels of tables of distances: labels of many ends, and where they meet.

The label of an end holds each corner that a search from it reaches upwards in a hierarchy, with its
cost. A shortest path between two ends passes a corner of both labels, or none at all. With buckets
of one side's labels by corner, a row of the table costs one look at each entry of its own label.

S. Knopp, P. Sanders, D. Schultes, F. Schulz, D. Wagner: Computing many-to-many shortest paths using
highway hierarchies, 2007.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, pop, push
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


@njit(cache=True, nogil=True)
def grow_rows(rows):
    """Return a copy of an array of rows with room for twice as many."""
    larger = np.empty((2 * len(rows), rows.shape[1]), rows.dtype)
    larger[: len(rows)] = rows
    return larger


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


# Hub labels of all corners of a graph. The label of a corner holds hubs, corners that many shortest
# paths pass, with the distances to them: any two corners that a path joins have a hub of a shortest
# one in both labels.
#
# T. Akiba, Y. Iwata, Y. Yoshida: Fast exact shortest-path distance queries on large networks by
# pruned landmark labeling, 2013.

_SAME = 1e-12
"""Difference of two distances that counts as none, in cells: rounding alone causes it."""


def reach_next(graph, edges, here, work, size, n_touched):
    """Reach the corners to which a shortest path may go on from a corner.

    A search overloads it for its kind of graph, as numba tells them apart.

    `graph`: a tuple of arrays, the first of them with an element for each corner; `edges`: where
    those of each corner begin, and their heads; `work`: cost of corners (infinite), corner before,
    corners touched; float64 heap of costs and corners; `size`, `n_touched`: sizes of the heap and
    of the list of corners touched; returned.
    """
    raise NotImplementedError


@njit(cache=True, nogil=True)
def _room_for(n, n_edges):
    """Return work arrays for `reach_next`; every edge is queued once at most."""
    heap = np.empty((n_edges + 1, 2))
    return np.full(n, np.inf), np.empty(n, np.int32), np.empty(n, np.int32), heap


@njit(cache=True, nogil=True)
def uses_of_corners(graph, edges, sources):
    """Count the shortest paths from some corners to all others that each corner is on, float64."""
    n = len(graph[0])
    work = _room_for(n, len(edges[1]))
    costs, before, touched, heap = work
    uses, below, order = np.zeros(n), np.zeros(n), np.empty(n, np.int32)
    for source in sources:
        costs[source], before[source], touched[0] = 0.0, -1, source
        size, n_touched, n_settled = 1, 1, 0
        heap[0, 0], heap[0, 1] = 0.0, float(source)
        while size:
            cost, here = heap[0, 0], np.int32(pop(heap, size))
            size -= 1
            if cost == costs[here]:
                order[n_settled], below[here] = here, 1.0
                n_settled += 1
                size, n_touched = reach_next(graph, edges, here, work, size, n_touched)
        for k in range(n_settled - 1, 0, -1):
            here = order[k]
            uses[here] += below[here]
            below[before[here]] += below[here]
        for corner in touched[:n_touched]:
            costs[corner] = np.inf
    return uses


@guarded
@njit(cache=True, nogil=True)
def labels_of_corners(graph, edges, ranked, most):
    """Label corners with hubs: search from each, and stop where labels so far say as much.

    `graph`, `edges`: see `reach_next`; `ranked`: int32, the corners at which paths bend, those on
    most paths first. Returns int64 (n + 1,) offsets; int32 ranks of hubs, float64 distances, int32
    the next corner on the path to the hub, without the corner itself as its own hub; whether there
    was room for all.
    """
    n = len(graph[0])
    work = _room_for(n, len(edges[1]))
    costs, before, touched, heap = work
    to_hub = np.full(len(ranked), np.inf)
    ranks = np.full(n, np.int64(len(ranked)))
    # Each corner has a run of entries in a common pool, and moves to a longer one when it is full.
    begin, count, room = np.zeros(n, np.int64), np.zeros(n, np.int32), np.zeros(n, np.int32)
    hubs, lengths, onward = np.empty(4096, np.int32), np.empty(4096), np.empty(4096, np.int32)
    used = total = 0
    for rank in range(len(ranked)):
        root = ranked[rank]
        ranks[root] = rank
        # The labels of the root by hub, for the tests below.
        for k in range(begin[root], begin[root] + count[root]):
            to_hub[hubs[k]] = lengths[k]
        # Dijkstra from the root, which looks no further where labels say as much.
        costs[root], before[root], touched[0] = 0.0, -1, root
        size, n_touched = 1, 1
        heap[0, 0], heap[0, 1] = 0.0, float(root)
        while size:
            cost, here = heap[0, 0], np.int32(pop(heap, size))
            size -= 1
            if cost > costs[here]:
                continue
            # A hub of before, which may be the corner itself, lies on a path that is as short.
            if ranks[here] < rank and to_hub[ranks[here]] <= cost + _SAME:
                continue
            at, stop = begin[here], begin[here] + count[here]
            while at < stop and to_hub[hubs[at]] + lengths[at] > cost + _SAME:
                at += 1
            if at < stop:
                continue
            # Write the entry, and move the run where it is full.
            if here != root:
                if count[here] == room[here]:
                    room[here] = max(8, 2 * room[here])
                    while used + room[here] > len(hubs):
                        hubs, lengths, onward = grow(hubs), grow(lengths), grow(onward)
                    for k in range(count[here]):
                        old, new = begin[here] + k, used + k
                        hubs[new], lengths[new], onward[new] = hubs[old], lengths[old], onward[old]
                    begin[here] = used
                    used += room[here]
                at = begin[here] + count[here]
                hubs[at], lengths[at], onward[at] = rank, cost, before[here]
                count[here] += 1
                total += 1
            size, n_touched = reach_next(graph, edges, here, work, size, n_touched)
        # Only what was touched is reset.
        for corner in touched[:n_touched]:
            costs[corner] = np.inf
        for k in range(begin[root], begin[root] + count[root]):
            to_hub[hubs[k]] = np.inf
        if total > most:
            return begin, hubs[:0], lengths[:0], onward[:0], False
    # The runs one behind the other, in the order of the corners.
    offset = np.zeros(n + 1, np.int64)
    for corner in range(n):
        offset[corner + 1] = offset[corner] + count[corner]
    kept = np.empty(total, np.int64)
    for corner in range(n):
        for k in range(count[corner]):
            kept[offset[corner] + k] = begin[corner] + k
    return offset, hubs[kept], lengths[kept], onward[kept], True
