"""Kernels of one query on a mesh: the polygons of its ends, the search, what it leaves behind."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.mesh._block_kernels import open_blocks
from hybridnav.mesh._polyanya_kernels import shortest
from hybridnav.search._exact_kernels import turn_of


@njit(cache=True, nogil=True)
def polygons_with(mesh, inner, row, col, x, y, found):
    """Polygons that hold a point of a free cell, also on their sides, and are reached inside it.

    Parameters
    ----------
    mesh
        See `shortest`.
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
    cx, cy, _, first, begins, twins, polygon_of = mesh
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
            w = begins[low if slot + 1 == high else slot + 1]
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
            w = begins[low if slot + 1 == high else slot + 1]
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
def query(mesh, blocks, tree, polygon_at, cells, ends, work):
    """Find a shortest path between two points.

    Parameters
    ----------
    mesh, ends
        See `shortest`.
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
        nodes (see `shortest`), best costs of corners, corners touched.

    Returns
    -------
    tuple
        Length, infinite where there is no path, `NO_ROOM` when there are too few nodes; the last
        node, -1 where the path is one segment; nodes expanded.
    """
    block_head, block_up, component, depth = tree
    starts, goals, is_open, marked, nodes, best, touched = work
    sx, sy, tx, ty = ends
    from_row, from_col, to_row, to_col = cells
    inner, last = polygon_at[from_row, from_col], polygon_at[to_row, to_col]
    if component[inner] != component[last]:
        return np.inf, -1, 0
    n_starts = polygons_with(mesh, inner, from_row, from_col, sx, sy, starts)
    n_goals = polygons_with(mesh, last, to_row, to_col, tx, ty, goals)
    for k in range(n_starts):
        for m in range(n_goals):
            if starts[k] == goals[m]:
                return math.hypot(tx - sx, ty - sy), -1, 0
    n_marked = 0
    for k in range(n_starts):
        for m in range(n_goals):
            n_marked = open_blocks(
                block_head, block_up, depth, starts[k], goals[m], is_open, marked, n_marked
            )
    length, node, expanded, n_touched = shortest(
        mesh, (blocks, is_open), ends, (starts[:n_starts], goals[:n_goals]), (*nodes, best, touched)
    )
    for k in range(n_touched):
        best[touched[k]] = np.inf
    for k in range(n_marked):
        is_open[marked[k]] = False
    return length, node, expanded


@njit(cache=True, nogil=True)
def corners_passed(whole, node):
    """Return the corners at which a path turns, from the start to the goal.

    Parameters
    ----------
    whole
        int32 (n, 4), nodes of `shortest`.
    node
        The last node of the path, -1 for none.
    """
    size = 0
    for is_counted in (True, False):
        if not is_counted:
            corners = np.empty(size, np.int32)
        last, at = -1, node
        while at >= 0:
            root, ends = whole[at, 1], whole[at, 3]
            if root >= 0 and root != last:
                size += 1 if is_counted else -1
                if not is_counted:
                    corners[size] = root
            if ends < 0 and root != whole[whole[at, 2], 1]:
                size += 1 if is_counted else -1
                if not is_counted:
                    corners[size] = -1 - ends
                root = -1 - ends
            last, at = root, whole[at, 2]
    return corners
