"""Kernels of one query on a mesh: the polygons of its ends, the search, what it leaves behind."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.mesh._block_kernels import open_blocks
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
    seed,
    way_to,
)
from hybridnav.search._exact_kernels import turn_of

_OPENED, _SEEDED = 1, 2
"""How far a query is: its blocks are opened; its first nodes are written."""


@njit(cache=True, nogil=True)
def polygons_with(mesh, inner, row, col, x, y, found):
    """Polygons that hold a point of a free cell, also on their sides, and are reached inside it.

    Parameters
    ----------
    mesh
        See `successors`.
    inner
        The polygon at the centre of the cell.
    row, col
        The cell.
    x, y
        The point, in the cell's closed square: where two free cells meet at a corner alone, it
        belongs to the one cell.
    found
        int32, room for the polygons, as many as the mesh has.

    Returns
    -------
    int
        How many were found.
    """
    cx, cy, _, first, begins, stops, twins, polygon_of = mesh
    found[0] = inner
    n = 1
    at = 0
    while at < n:
        polygon = found[at]
        at += 1
        low, high = first[polygon], first[polygon + 1]
        for slot in range(low, high):
            if twins[slot] < 0:
                continue
            u = begins[slot]
            w = stops[slot]
            # The segment from the centre to the point meets no wall: its polygons hang together.
            if not _touch(cx[u], cy[u], cx[w], cy[w], col + 0.5, row + 0.5, x, y):
                continue
            other = polygon_of[twins[slot]]
            is_known = False
            for k in range(n):
                is_known = is_known or found[k] == other
            if not is_known:
                found[n] = other
                n += 1
    kept = 0
    for k in range(n):
        polygon = found[k]
        low, high = first[polygon], first[polygon + 1]
        holds = True
        for slot in range(low, high):
            u = begins[slot]
            w = stops[slot]
            holds = holds and turn_of(cx[u], cy[u], cx[w], cy[w], x, y) >= 0
        if holds:
            found[kept] = polygon
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def _touch(ax, ay, bx, by, px, py, qx, qy):
    """Whether two segments have a point in common."""
    if max(ax, bx) < min(px, qx) or max(px, qx) < min(ax, bx):
        return False
    if max(ay, by) < min(py, qy) or max(py, qy) < min(ay, by):
        return False
    return (
        turn_of(ax, ay, bx, by, px, py) * turn_of(ax, ay, bx, by, qx, qy) <= 0
        and turn_of(px, py, qx, qy, ax, ay) * turn_of(px, py, qx, qy, bx, by) <= 0
    )


@guarded
@njit(cache=True, nogil=True)
def query(mesh, blocks, tree, polygon_at, cells, ends, work, effort):
    """Find a shortest path between two points, or go on with it.

    Parameters
    ----------
    mesh, ends
        See `successors`.
    blocks
        int32 (s,), the block of each slot.
    tree
        Head and depth of blocks, component of polygons: of `blocks_of`.
    polygon_at
        int32 (rows, cols), the polygon at the centre of each cell.
    cells
        Row and column of the start's cell, then of the goal's; free ones.
    work
        Of one query: room for the polygons of the ends, blocks that may be entered, those marked,
        and what `seed` describes.
    effort
        Length of the best path known before, and `factor` and `limit` of `advance`; a limit below
        zero ends the query.

    Returns
    -------
    tuple
        `DONE`, `PAUSED` or `NO_ROOM`; when done the path, float64 (n, 2) as (row, col), without a
        row where the search found none better than the bound that it began with.
    """
    starts, goals, is_open, marked, nodes = work
    counts, bounds = nodes[6], nodes[7]
    upper, factor, limit = effort
    none = np.empty((0, 2))
    if not counts[BEGUN]:
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = upper, 0.0
        common = _begin(mesh, tree, polygon_at, cells, ends, work)
        if common < 0:
            bounds[:] = np.inf
            return DONE, none
        if common > 0:
            bounds[:] = math.hypot(ends[2] - ends[0], ends[3] - ends[1])
            return DONE, way_to(mesh, ends, nodes[0], -1)
    entered = (blocks, is_open)
    status = DONE
    if counts[BEGUN] == _OPENED:
        status = seed(mesh, entered, ends, starts[: counts[STARTS]], nodes)
        if status == DONE:
            counts[BEGUN] = _SEEDED
    if status == DONE and limit >= 0:
        status = advance(mesh, entered, ends, goals[: counts[GOALS]], nodes, factor, limit)
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
    return DONE, way_to(mesh, ends, nodes[0], counts[LAST])


@njit(cache=True, nogil=True)
def _polygon_in(mesh, component, polygon_at, row, col):
    """A polygon that holds the centre of a free cell; where a mesh was cut, one of the last."""
    cx, cy, _, first, begins, stops, _, _ = mesh
    polygon = polygon_at[row, col]
    if component[polygon] >= 0:
        return polygon
    for other in range(len(first) - 2, -1, -1):
        holds = component[other] >= 0
        for slot in range(first[other], first[other + 1]):
            u, w = begins[slot], stops[slot]
            holds = holds and turn_of(cx[u], cy[u], cx[w], cy[w], col + 0.5, row + 0.5) >= 0
        if holds:
            return other
    return polygon


@njit(cache=True, nogil=True)
def _begin(mesh, tree, polygon_at, cells, ends, work):
    """Find the polygons of both ends, and open the blocks between them; returns 1 where the ends
    have a polygon in common, -1 where they are not connected."""
    block_head, block_up, component, depth = tree
    starts, goals, is_open, marked, nodes = work
    counts = nodes[6]
    sx, sy, tx, ty = ends
    from_row, from_col, to_row, to_col = cells
    inner = _polygon_in(mesh, component, polygon_at, from_row, from_col)
    last = _polygon_in(mesh, component, polygon_at, to_row, to_col)
    if component[inner] != component[last]:
        return -1
    n_starts = polygons_with(mesh, inner, from_row, from_col, sx, sy, starts)
    n_goals = polygons_with(mesh, last, to_row, to_col, tx, ty, goals)
    for k in range(n_starts):
        for m in range(n_goals):
            if starts[k] == goals[m]:
                return 1
    n = 0
    for k in range(n_starts):
        for m in range(n_goals):
            n = open_blocks(block_head, block_up, depth, starts[k], goals[m], is_open, marked, n)
    counts[STARTS], counts[GOALS], counts[MARKED] = n_starts, n_goals, n
    counts[BEGUN] = _OPENED
    return 0
