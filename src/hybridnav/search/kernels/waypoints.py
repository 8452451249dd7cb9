"""Kernel of the cheapest waypoints: a spread from one set of cells to another."""

import heapq

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT


@guarded
@njit(cache=True, nogil=True)
def spread(moves, units, cols, sources, costs, is_target, all_targets):
    """Run Dijkstra's algorithm from cells with costs of their own.

    Return the cost of each cell, -1 if it was not settled, and its source (an index into
    `sources`). The search ends at the first settled target, or at the last one with `all_targets`.

    Parameters
    ----------
    moves, cols
        uint8 (n_cells,), the legal moves of each flat cell, and the columns of the grid.
    units
        int32 (n_cells,), the factor of each cell in units, or None: then costs are lengths (the
        kernel is compiled for both).
    sources, costs
        int64 (n,) each, flat cells and what they cost.
    is_target, all_targets
        bool (n_cells,), and whether all of these are to be settled.
    """
    cost = np.full(moves.size, np.int64(-1), np.int64)
    came = np.full(moves.size, np.int32(-1), np.int32)
    best = np.full(moves.size, np.int64(1) << 62, np.int64)
    heap = [(np.int64(0), np.int64(0)) for _ in range(0)]
    left = 0
    for cell in range(moves.size):
        left += is_target[cell]
    for i in range(sources.size):
        if costs[i] < best[sources[i]]:
            best[sources[i]] = costs[i]
            came[sources[i]] = i
    for i in range(sources.size):
        if came[sources[i]] == i:
            heapq.heappush(heap, (np.int64(costs[i]), np.int64(sources[i])))
    while len(heap) > 0:
        at, cell = heapq.heappop(heap)
        if cost[cell] >= 0:
            continue
        cost[cell] = at
        if is_target[cell]:
            left -= 1
            if left == 0 or not all_targets:
                break
        for k in range(8):
            if moves[cell] >> k & 1 == 0:
                continue
            to = cell + ROW_STEP[k] * cols + COL_STEP[k]
            step = DIAGONAL if k & 1 else STRAIGHT
            if units is not None:
                step *= np.int64(units[cell]) + units[to]
            further = at + step
            if cost[to] < 0 and further < best[to]:
                best[to] = further
                came[to] = came[cell]
                heapq.heappush(heap, (further, to))
    return cost, came
