"""Kernels of the endpoints of a query: the polygons that contain them, the corners that they
see."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import njit
from hybridnav.mesh._polyanya_kernels import DONE, PAUSED, WORK_FULL
from hybridnav.mesh._view_kernels import see_from_point
from hybridnav.search.exact import turn_of

APART, MET, SPLIT = -1, 1, 0
"""Positions of the endpoints of a query: not connected, in one polygon, in several."""


@njit(cache=True, nogil=True)
def look_from_endpoints(mesh, where, endpoints, rooms, bounds):
    """Find the corners that the endpoints of a query see, or the answer if that needs no corner.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    where
        Component of polygons, the polygon of each cell, and `cells`; see `polygons_of_endpoints`.
    rooms
        int32 room for the polygons of start and goal, room of `see_from_point`.
    bounds
        Receives the length and lower bound of the answer: infinite if the endpoints are not
        connected, their distance if they see each other.

    Returns
    -------
    tuple
        `DONE` with the answer, `WORK_FULL`, or `PAUSED`, when the room holds the corners that the
        goal sees and then those that the start sees; the indices at which both lists end.
    """
    sx, sy, tx, ty = endpoints
    component, polygon_at, cells = where
    starts, goals, room = rooms
    how, n_starts, n_goals = polygons_of_endpoints(
        mesh, component, polygon_at, cells, endpoints, starts, goals
    )
    if how == APART:
        bounds[:] = np.inf
        return DONE, 0, 0
    if how == SPLIT:
        nowhere = (0.0, 0.0, starts[:0])
        n, _ = see_from_point(mesh, tx, ty, goals[:n_goals], nowhere, room, 0)
        if n < 0:
            return WORK_FULL, 0, 0
        target = (tx, ty, goals[:n_goals])
        n_all, is_seen = see_from_point(mesh, sx, sy, starts[:n_starts], target, room, n)
        if n_all < 0:
            return WORK_FULL, 0, 0
        if not is_seen:
            return PAUSED, n, n_all
    bounds[:] = math.hypot(tx - sx, ty - sy)
    return DONE, 0, 0


@njit(cache=True, nogil=True)
def polygons_of_endpoints(mesh, component, polygon_at, cells, endpoints, starts, goals):
    """Find the polygons that contain the endpoints of a query.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    component
        int32 (p,) of `blocks_of`.
    polygon_at
        int32 (rows, cols), the polygon at the centre of each cell.
    cells
        Row and column of the start's cell, then of the goal's; free ones.
    starts, goals
        int32, room for as many polygons as the mesh has.

    Returns
    -------
    tuple
        `APART`, `MET` or `SPLIT`; the numbers of polygons that contain the start and the goal.
    """
    sx, sy, tx, ty = endpoints
    from_row, from_col, to_row, to_col = cells
    inner = _polygon_in(mesh, component, polygon_at, from_row, from_col)
    last = _polygon_in(mesh, component, polygon_at, to_row, to_col)
    if component[inner] != component[last]:
        return APART, 0, 0
    n_starts = polygons_with(mesh, inner, from_row, from_col, sx, sy, starts)
    n_goals = polygons_with(mesh, last, to_row, to_col, tx, ty, goals)
    for k in range(n_starts):
        for m in range(n_goals):
            if starts[k] == goals[m]:
                return MET, n_starts, n_goals
    return SPLIT, n_starts, n_goals


@njit(cache=True, nogil=True)
def _polygon_in(mesh, component, polygon_at, row, col):
    """Return a polygon with the centre of a free cell; in a renewed mesh, one of the last."""
    cx, cy, _, first, begins, finishes, _, _ = mesh
    polygon = polygon_at[row, col]
    if polygon >= 0 and component[polygon] >= 0:
        return polygon
    for other in range(len(first) - 2, -1, -1):
        holds = component[other] >= 0
        for slot in range(first[other], first[other + 1]):
            u, w = begins[slot], finishes[slot]
            holds = holds and turn_of(cx[u], cy[u], cx[w], cy[w], col + 0.5, row + 0.5) >= 0
        if holds:
            return other
    return polygon


@njit(cache=True, nogil=True)
def polygons_with(mesh, inner, row, col, x, y, found):
    """Find the polygons with a point of a free cell, also on their sides, reached inside the cell.

    Parameters
    ----------
    mesh
        See `successors`.
    inner
        The polygon at the centre of the cell.
    row, col
        The cell.
    x, y
        The point, in the closed square of the cell: where two free cells meet only at a corner, it
        belongs to this cell.
    found
        int32, room for the polygons, as many as the mesh has.

    Returns
    -------
    int
        Number of polygons found.
    """
    cx, cy, _, first, begins, finishes, twins, polygon_of = mesh
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
            w = finishes[slot]
            # The segment from the centre to the point meets no wall: its polygons are connected.
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
            w = finishes[slot]
            holds = holds and turn_of(cx[u], cy[u], cx[w], cy[w], x, y) >= 0
        if holds:
            found[kept] = polygon
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def _touch(ax, ay, bx, by, px, py, qx, qy):
    """Return whether two segments have a point in common.

    Parameters
    ----------
    ax, ay, bx, by
        Ends of one segment, in cells.
    px, py, qx, qy
        Ends of the other.
    """
    if max(ax, bx) < min(px, qx) or max(px, qx) < min(ax, bx):
        return False
    if max(ay, by) < min(py, qy) or max(py, qy) < min(ay, by):
        return False
    return (
        turn_of(ax, ay, bx, by, px, py) * turn_of(ax, ay, bx, by, qx, qy) <= 0
        and turn_of(px, py, qx, qy, ax, ay) * turn_of(px, py, qx, qy, bx, by) <= 0
    )
