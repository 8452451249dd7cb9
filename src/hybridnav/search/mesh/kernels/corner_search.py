"""Kernels of the search of the graph of corners: A* with landmarks, shortest any-angle paths.

A. V. Goldberg, C. Harrelson: Computing the shortest path: A* search meets graph theory, 2005
(landmarks). S. Oh, H. W. Leong: Edge N-level sparse visibility graphs, 2017 (taut edges).
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import turn_of
from hybridnav.search.mesh.kernels.polyanya import (
    BEGUN,
    DONE,
    EXPANDED,
    LAST,
    LOWER,
    MARKED,
    PAUSED,
    SIZE,
    TOUCHED,
    UPPER,
    WORK_FULL,
    pop,
    push,
    put_corner,
)
from hybridnav.search.mesh.kernels.views import distance, lobe_of, see_from_point

_SLACK = 1e-9
"""Rounding of distances in the graph, in cells."""


@guarded
@njit(cache=True, nogil=True)
def query_corners(mesh, graph, where, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    `mesh`, `endpoints`: see `successors`; `graph`: int64 (2 n + 1,) and int32 (m,) of `edges_of`,
    float64 (n, landmarks) of `landmarks_of`; `where`: see `look_from_endpoints`; `work`: arrays of
    one query: room for the polygons of the endpoints; room of `see_from_point`; cost of corners
    (infinite), estimate, corner before, length to the goal (infinite), corners touched; keys and
    values of the heap; float64 (2, landmarks) bounds of the goal; counts and bounds; `effort`: see
    `query`. Result: see `query`.
    """
    starts, goals, room, corners, heap, _, counts, bounds = work
    costs, _, _, to_goal, touched = corners
    upper, factor, limit = effort
    none = np.empty((0, 2))
    if not counts[BEGUN]:
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = upper, 0.0
        status, n, n_all = look_from_endpoints(
            mesh, where, endpoints, (starts, goals, room), bounds
        )
        if n_all - n > len(heap[0]):
            status = WORK_FULL
        if status == WORK_FULL:
            return WORK_FULL, none
        if status == DONE:
            return DONE, none if bounds[UPPER] == np.inf else _path_through(
                mesh, endpoints, corners[2], -1
            )
        _seed(mesh, graph, endpoints, (room[2][:n], room[2][n:n_all]), work)
        counts[BEGUN], counts[MARKED] = 1, n
    status = _advance(mesh, graph, endpoints, work, factor, limit) if limit >= 0 else DONE
    if status != DONE:
        return status, none
    for corner in room[2][: counts[MARKED]]:
        to_goal[corner] = np.inf
    for corner in touched[: counts[TOUCHED]]:
        costs[corner] = np.inf
    counts[BEGUN] = 0
    if counts[LAST] < 0:
        return DONE, none
    return DONE, _path_through(mesh, endpoints, corners[2], counts[LAST])


@njit(cache=True, nogil=True)
def _seed(mesh, graph, endpoints, seen, work):
    """Mark the corners that see the goal, and reach those that the start sees."""
    cx, cy = mesh[0], mesh[1]
    sx, sy, tx, ty = endpoints
    from_goal, from_start = seen
    table = graph[2]
    corners, goal_bounds, counts = work[3], work[5], work[6]
    to_goal = corners[3]
    # The distance of the goal from a landmark lies between these two, in the graph.
    goal_bounds[0] = np.inf
    goal_bounds[1] = -np.inf
    for corner in from_goal:
        to_goal[corner] = distance(cx[corner], cy[corner], tx, ty)
        for k in range(table.shape[1]):
            if table[corner, k] < np.inf:
                at_most, at_least = table[corner, k] + to_goal[corner], table[corner, k]
                goal_bounds[0, k] = min(goal_bounds[0, k], at_most - _SLACK)
                goal_bounds[1, k] = max(goal_bounds[1, k], at_least - to_goal[corner] + _SLACK)
    for k in range(table.shape[1]):
        if goal_bounds[0, k] == np.inf:
            goal_bounds[0, k], goal_bounds[1, k] = -np.inf, np.inf
    counts[SIZE] = 0
    _relax(mesh, table, endpoints, work, -1, (sx, sy, sx, sy, 0.0), 0.0, from_start)


@njit(cache=True, nogil=True)
def _advance(mesh, graph, endpoints, work, factor, limit):
    """Search until the answer is good enough or enough corners are expanded; see `advance`."""
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    first, heads, table = graph
    _, _, _, corners, heap, _, counts, bounds = work
    costs, estimates, came, _, _ = corners
    sx, sy, _, _ = endpoints
    keys, values = heap
    status = DONE
    while counts[SIZE]:
        here, key = values[0], keys[0]
        if key > costs[here] + estimates[here]:
            counts[SIZE] = pop(heap, counts[SIZE])
            continue
        if key * factor >= bounds[UPPER]:
            break
        x, y, kind, before = cx[here], cy[here], kinds[here], came[here]
        px, py = (sx, sy) if before < 0 else (cx[before], cy[before])
        dx, dy = x - px, y - py
        place = 2 * here + lobe_of(kind, dx, dy)
        low, high = first[place], first[place + 1]
        if counts[SIZE] + high - low > len(keys):
            status = WORK_FULL
            break
        if counts[EXPANDED] >= limit:
            status = PAUSED
            break
        counts[SIZE] = pop(heap, counts[SIZE])
        counts[EXPANDED] += 1
        # The blocked cell lies on the left of the path here, or on the right.
        hand = dx * (1.0 if kind & 2 else -1.0) - dy * (1.0 if kind & 1 else -1.0)
        _relax(
            mesh, table, endpoints, work, here, (px, py, x, y, hand), costs[here], heads[low:high]
        )
    least = min(keys[0], bounds[UPPER]) if counts[SIZE] else bounds[UPPER]
    bounds[LOWER] = max(bounds[LOWER], least)
    return status


@njit(cache=True, nogil=True)
def _relax(mesh, table, endpoints, work, before, bend, cost_before, heads):
    """Reach corners from a corner, or from the start, if that is cheaper than before.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    table
        float64 (n, landmarks), from `landmarks_of`.
    work
        Arrays of the query; see `query_corners`.
    before, cost_before
        Number of the corner, and its cost in cells.
    bend
        x and y of the point before, x and y of the corner, and the hand to which a path bends
        there: 1 for the left, 0 for either.
    heads
        int32, the corners to reach.
    """
    cx, cy = mesh[0], mesh[1]
    px, py, x, y, hand = bend
    _, _, tx, ty = endpoints
    _, _, _, corners, heap, goal_bounds, counts, bounds = work
    costs, estimates, came, to_goal, touched = corners
    size, n_touched, upper = counts[SIZE], counts[TOUCHED], bounds[UPPER]
    for corner in heads:
        wx, wy = cx[corner], cy[corner]
        cost = cost_before + distance(x, y, wx, wy)
        if cost >= costs[corner] or turn_of(px, py, x, y, wx, wy) * hand < 0.0:
            continue
        is_new = costs[corner] == np.inf
        if is_new:
            left = distance(wx, wy, tx, ty)
            for k in range(table.shape[1]):
                reached = table[corner, k]
                if reached < np.inf:
                    left = max(left, goal_bounds[0, k] - reached, reached - goal_bounds[1, k])
        else:
            left = estimates[corner]
        through = cost + to_goal[corner]
        if through < upper:
            upper = through
            counts[LAST] = corner
        elif cost + left >= upper:
            continue
        if is_new:
            estimates[corner] = left
            touched[n_touched] = corner
            n_touched += 1
        costs[corner], came[corner] = cost, before
        if cost + left < upper:
            size = push(heap, size, cost + left, corner)
    counts[SIZE], counts[TOUCHED], bounds[UPPER] = size, n_touched, upper


@njit(cache=True, nogil=True)
def _path_through(mesh, endpoints, came, corner):
    """Return the path through a corner, see `path_to`; -1 for a path of one segment."""
    sx, sy, tx, ty = endpoints
    at, room = corner, 2
    while at >= 0:
        at, room = came[at], room + 1
    path = np.empty((room, 2))
    n = room - 1
    path[n, 0], path[n, 1] = ty, tx
    at = corner
    while at >= 0:
        n = put_corner(path, n, mesh[0][at], mesh[1][at])
        at = came[at]
    n = put_corner(path, n, sx, sy)
    return path[n:].copy()


# Kernels of the endpoints of a query: the polygons that contain them, the corners that they see.

APART, MET, SPLIT = -1, 1, 0
"""Positions of the endpoints of a query: not connected, in one polygon, in several."""


@njit(cache=True, nogil=True)
def look_from_endpoints(mesh, where, endpoints, rooms, bounds):
    """Find the corners that the endpoints of a query see, or the answer if that needs no corner.

    `mesh`, `endpoints`: see `successors`; `where`: component of polygons, the polygon of each cell,
    and `cells`; see `polygons_of_endpoints`; `rooms`: int32 room for the polygons of start and
    goal, room of `see_from_point`; `bounds`: receives the length and lower bound of the answer:
    infinite if the endpoints are not connected, their distance if they see each other. Result:
    `DONE` with the answer, `WORK_FULL`, or `PAUSED`, when the room holds the corners that the goal
    sees and then those that the start sees; the indices at which both lists end.
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
    inner = polygon_in(mesh, component, polygon_at, from_row, from_col)
    last = polygon_in(mesh, component, polygon_at, to_row, to_col)
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
def polygon_in(mesh, component, polygon_at, row, col):
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
