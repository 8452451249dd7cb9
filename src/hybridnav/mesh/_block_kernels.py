"""Kernels of blocks: parts of a mesh that no single polygon disconnects.

A shortest path passes no convex polygon twice, so it stays in the blocks between its endpoints: a
part of the map behind a single polygon is entered only towards an end.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit


@guarded
@njit(cache=True, nogil=True)
def blocks_of(first, twins, polygon_of):
    """Return the blocks (biconnected components) of the graph of polygons, and their tree.

    J. Hopcroft, R. Tarjan: Algorithm 447, efficient algorithms for graph manipulation, 1973.

    Returns
    -------
    tuple
        int32 (s,) block of each slot, -1 for walls; int32 (b,) the polygon of each block that is
        nearest to the root; int32 (p,) the block through which a polygon is reached from the root,
        -1 for a root; int32 (p,) the component of each polygon; int32 (p,) steps from the root in
        the tree of blocks.
    """
    n = len(first) - 1
    block_of = np.full(len(twins), -1, np.int32)
    head_of = np.empty(n, np.int32)
    up = np.full(n, -1, np.int32)
    component = np.full(n, -1, np.int32)
    depth = np.zeros(n, np.int32)
    number = np.full(n, -1, np.int32)
    low = np.zeros(n, np.int32)
    at = first[:-1].copy()
    came_by = np.full(n, -1, np.int32)
    path = np.empty(n, np.int32)
    waiting = np.empty(len(twins) // 2 + 1, np.int32)  # slots of seen sides, one of each pair
    n_waiting = n_blocks = n_components = clock = 0
    for root in range(n):
        if number[root] >= 0:
            continue
        path[0] = root
        size = 1
        number[root] = low[root] = clock
        clock += 1
        component[root] = n_components
        while size:
            here = path[size - 1]
            if at[here] < first[here + 1]:
                slot = at[here]
                at[here] += 1
                twin = twins[slot]
                if twin < 0 or twin == came_by[here]:
                    continue
                other = polygon_of[twin]
                if number[other] < 0:
                    waiting[n_waiting] = slot
                    n_waiting += 1
                    came_by[other] = slot
                    number[other] = low[other] = clock
                    clock += 1
                    component[other] = n_components
                    path[size] = other
                    size += 1
                elif number[other] < number[here]:
                    waiting[n_waiting] = slot
                    n_waiting += 1
                    low[here] = min(low[here], number[other])
                continue
            size -= 1
            if size == 0:
                break
            parent = path[size - 1]
            low[parent] = min(low[parent], low[here])
            if low[here] >= number[parent]:
                while True:
                    n_waiting -= 1
                    slot = waiting[n_waiting]
                    block_of[slot] = block_of[twins[slot]] = n_blocks
                    for polygon in (polygon_of[slot], polygon_of[twins[slot]]):
                        if polygon != parent:
                            up[polygon] = n_blocks
                    if slot == came_by[here]:
                        break
                head_of[n_blocks] = parent
                n_blocks += 1
        n_components += 1
    # Parents come earlier in the order of visits.
    order = np.empty(n, np.int32)
    for polygon in range(n):
        order[number[polygon]] = polygon
    for polygon in order:
        if up[polygon] >= 0:
            depth[polygon] = depth[head_of[up[polygon]]] + 1
    return block_of, head_of[:n_blocks].copy(), up, component, depth


@njit(cache=True, nogil=True)
def open_blocks(block_head, block_up, depth, start, goal, is_open, marked, n):
    """Open the blocks between two polygons of one component; return the index behind the last one.

    Parameters
    ----------
    block_head, block_up, depth
        int32 (b,), (p,) and (p,), from `blocks_of`.
    start, goal
        Polygons.
    is_open
        bool (b,), changed.
    marked, n
        int32, receives newly opened blocks from index n on.
    """
    while start != goal:
        if depth[start] < depth[goal]:
            start, goal = goal, start
        block = block_up[start]
        if not is_open[block]:
            is_open[block] = True
            marked[n] = block
            n += 1
        if depth[goal] == depth[start] and block_up[goal] == block:
            break
        start = block_head[block]
    return n
