"""Kernels of the search of the graph of corners: A* with landmarks, shortest any-angle paths.

A. V. Goldberg, C. Harrelson: Computing the shortest path: A* search meets graph theory, 2005
(landmarks). S. Oh, H. W. Leong: Edge N-level sparse visibility graphs, 2017 (taut edges).
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.mesh._endpoint_kernels import look_from_endpoints
from hybridnav.mesh._heap_kernels import pop, push
from hybridnav.mesh._polyanya_kernels import (
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
    put_corner,
)
from hybridnav.mesh._view_kernels import distance, lobe_of
from hybridnav.search.exact import turn_of

_SLACK = 1e-9
"""Rounding of distances in the graph, in cells."""


@guarded
@njit(cache=True, nogil=True)
def query_corners(mesh, graph, where, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    graph
        int64 (2 n + 1,) and int32 (m,) of `edges_of`, float64 (n, landmarks) of `landmarks_of`.
    where
        See `look_from_endpoints`.
    work
        Arrays of one query: room for the polygons of the endpoints; room of `see_from_point`; cost
        of corners (infinite), estimate, corner before, length to the goal (infinite), corners
        touched; keys and values of the heap; float64 (2, landmarks) bounds of the goal; counts and
        bounds.
    effort
        See `query`.

    Returns
    -------
    tuple
        See `query`.
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
