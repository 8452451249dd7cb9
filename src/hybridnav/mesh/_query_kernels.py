"""Kernels of one query on a mesh: the polygons of its endpoints, the search, and its clean-up."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.mesh._block_kernels import open_blocks
from hybridnav.mesh._endpoint_kernels import APART, MET, polygons_of_endpoints
from hybridnav.mesh._polyanya_kernels import (
    BEGUN,
    DONE,
    GOALS,
    LAST,
    LOWER,
    MARKED,
    STARTS,
    TOUCHED,
    UPPER,
    advance,
    path_to,
    seed,
)

_OPENED, _SEEDED = 1, 2
"""Stages of a query: its blocks are opened; its first nodes are written."""


@guarded
@njit(cache=True, nogil=True)
def query(mesh, blocks, tree, polygon_at, cells, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    blocks
        int32 (s,), the block of each slot.
    tree
        Head and depth of blocks, component of polygons; see `blocks_of`.
    polygon_at
        int32 (rows, cols), the polygon at the centre of each cell.
    cells
        Row and column of the start's cell, then of the goal's; free ones.
    work
        Arrays of one query: room for the polygons of the endpoints, blocks that may be entered,
        those marked, and the work of `seed`.
    effort
        Length of the best path known before, and `factor` and `limit` of `advance`; a limit below
        zero ends the query.

    Returns
    -------
    tuple
        `DONE`, `PAUSED` or `WORK_FULL`; when done the path, float64 (n, 2) as (row, col), without
        rows if the search found no path better than its initial bound.
    """
    block_head, block_up, component, depth = tree
    starts, goals, is_open, marked, nodes = work
    counts, bounds = nodes[6], nodes[7]
    upper, factor, limit = effort
    none = np.empty((0, 2))
    if not counts[BEGUN]:
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = upper, 0.0
        how, counts[STARTS], counts[GOALS] = polygons_of_endpoints(
            mesh, component, polygon_at, cells, endpoints, starts, goals
        )
        if how == APART:
            bounds[:] = np.inf
            return DONE, none
        if how == MET:
            bounds[:] = math.hypot(endpoints[2] - endpoints[0], endpoints[3] - endpoints[1])
            return DONE, path_to(mesh, endpoints, nodes[0], -1)
        n = 0
        for start in starts[: counts[STARTS]]:
            for goal in goals[: counts[GOALS]]:
                n = open_blocks(block_head, block_up, depth, start, goal, is_open, marked, n)
        counts[MARKED] = n
        counts[BEGUN] = _OPENED
    entered = (blocks, is_open)
    status = DONE
    if counts[BEGUN] == _OPENED:
        status = seed(mesh, entered, endpoints, starts[: counts[STARTS]], nodes)
        if status == DONE:
            counts[BEGUN] = _SEEDED
    if status == DONE and limit >= 0:
        status = advance(mesh, entered, endpoints, goals[: counts[GOALS]], nodes, factor, limit)
    if status != DONE:
        return status, none
    best, touched = nodes[4], nodes[5]
    for k in range(counts[TOUCHED]):
        best[touched[k]] = np.inf
    for k in range(counts[MARKED]):
        is_open[marked[k]] = False
    counts[BEGUN] = 0
    if counts[LAST] < 0:
        return DONE, none
    return DONE, path_to(mesh, endpoints, nodes[0], counts[LAST])
