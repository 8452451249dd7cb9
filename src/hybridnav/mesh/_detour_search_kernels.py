"""Kernels of the search round closed cells: A* over the graph of corners.

Edges that meet a closed cell are refused, and the corners of closed cells are added.
"""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.mesh._closure_kernels import crosses, is_at_closed, is_at_shut, is_beside
from hybridnav.mesh._detour_bound_kernels import bounds_of_goal, estimate, left_behind
from hybridnav.mesh._detour_kernels import is_in_sight, still_there
from hybridnav.mesh._endpoint_kernels import APART, polygons_of_endpoints
from hybridnav.mesh._heap_kernels import pop, push
from hybridnav.mesh._polyanya_kernels import (
    BEGUN,
    DONE,
    EXPANDED,
    GOALS,
    LAST,
    LOWER,
    MARKED,
    PAUSED,
    SIZE,
    STARTS,
    TOUCHED,
    UPPER,
    WORK_FULL,
    N,
    put_corner,
)
from hybridnav.mesh._view_kernels import distance, lobe_of, see_from_point, touches
from hybridnav.search.exact import turn_of

UNSURE = 3
"""Status of a query whose start or goal lies at a corner of a cell that is not free."""
_LOOKS = N
"""Index in counts of the number of expansions at which the search next tests for a cut-off goal."""
_LISTED, _BEGUN = 1, 2
"""Stages of a query: the corners that its start sees are listed; they are reached."""
_FLOOD = 64
"""Corners that a search expands before it first tests whether the goal is cut off."""


@guarded
@njit(cache=True, nogil=True)
def query_round(mesh, graph, detour, where, endpoints, work, effort):
    """Find a shortest path between two points round closed cells, or resume the search.

    Parameters
    ----------
    mesh, graph, where, endpoints, work, effort
        See `query_corners`; the arrays of corners have room for those of closed cells.
    detour
        Results of `closure_of`, `corners_of_closure`, `edges_of_closure`, `groups_of_closure`.

    Returns
    -------
    tuple
        See `query`, and `UNSURE`.
    """
    _, _, room, corners, _, _, counts, bounds = work
    costs, _, came, to_goal, touched = corners
    upper, factor, limit = effort
    sx, sy, tx, ty = endpoints
    n, made = len(mesh[0]), detour[1]
    none = np.empty((0, 2))
    if not counts[BEGUN]:
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = upper, 0.0
        closure, polygon_at = detour[0], where[1]
        if is_at_shut(closure, polygon_at, sx, sy) or is_at_shut(closure, polygon_at, tx, ty):
            return UNSURE, none
        status = _begin(mesh, graph, detour, where, endpoints, work)
        if status == DONE and bounds[UPPER] < np.inf:
            return DONE, _path_through((mesh[0], mesh[1], made), endpoints, came, -1)
        if status != PAUSED:
            return status, none
    status = DONE
    if limit >= 0:
        status = _advance(mesh, graph, detour, where[1], endpoints, work, (factor, limit))
    if status != DONE:
        return status, none
    for corner in room[2][: counts[MARKED]]:
        to_goal[corner] = np.inf
    to_goal[n : n + len(made[0])] = np.inf
    for corner in touched[: counts[TOUCHED]]:
        costs[corner] = np.inf
    counts[BEGUN] = 0
    if counts[LAST] < 0:
        return DONE, none
    return DONE, _path_through((mesh[0], mesh[1], made), endpoints, came, counts[LAST])


@njit(cache=True, nogil=True)
def _begin(mesh, graph, detour, where, endpoints, work):
    """Mark the corners that see the goal, and list those that the start sees.

    Return `PAUSED` if a search is needed.
    """
    closure, (xs, ys, kinds, _) = detour[0], detour[1]
    starts, goals, room, corners, heap, _, counts, bounds = work
    component, polygon_at, cells = where
    sx, sy, tx, ty = endpoints
    cx, cy, n, to_goal = mesh[0], mesh[1], len(mesh[0]), corners[3]
    how, n_starts, n_goals = polygons_of_endpoints(
        mesh, component, polygon_at, cells, endpoints, starts, goals
    )
    if how == APART:
        bounds[:] = np.inf
        return DONE
    first, last = starts[0], goals[0]
    if is_in_sight(mesh, closure, polygon_at, first, (sx, sy, tx, ty)):
        bounds[:] = math.hypot(tx - sx, ty - sy)
        return DONE
    nowhere = (0.0, 0.0, starts[:0])
    seen = room[2]
    n_seen, _ = see_from_point(mesh, tx, ty, goals[:n_goals], nowhere, room, 0)
    if n_seen < 0:
        return WORK_FULL
    n_all, _ = see_from_point(mesh, sx, sy, starts[:n_starts], nowhere, room, n_seen)
    if n_all < 0 or n_all + len(xs) > min(len(seen), len(heap[0])):
        return WORK_FULL
    n_marked = 0
    for corner in seen[:n_seen]:
        head = corner
        if is_beside(closure[0], tx, ty, cx[corner], cy[corner]):
            if is_at_closed(closure, cx[corner], cy[corner]):
                head = still_there(mesh, graph, closure, tx, ty, corner)
            if head < 0 or crosses(closure, polygon_at, tx, ty, cx[head], cy[head]):
                continue
        to_goal[head] = distance(tx, ty, cx[head], cy[head])
        seen[n_marked] = head
        n_marked += 1
    for at in range(len(xs)):
        x, y = xs[at], ys[at]
        if touches(kinds[at], x - tx, y - ty):
            if is_in_sight(mesh, closure, polygon_at, last, (tx, ty, x, y)):
                to_goal[n + at] = distance(x, y, tx, ty)
        if touches(kinds[at], x - sx, y - sy):
            if is_in_sight(mesh, closure, polygon_at, first, (sx, sy, x, y)):
                seen[n_all] = n + at
                n_all += 1
    # The start's corners are listed behind the goal's.
    counts[MARKED], counts[STARTS], counts[GOALS] = n_marked, n_seen, n_all
    counts[BEGUN], counts[_LOOKS] = _LISTED, _FLOOD
    bounds_of_goal(graph[2], seen[:n_marked], to_goal, work[5])
    return PAUSED


@njit(cache=True, nogil=True)
def _advance(mesh, graph, detour, polygon_at, endpoints, work, effort):
    """Search until the answer is good enough or enough corners are expanded; see `advance`.

    All is in one function, because a call with all arrays takes as long as an expansion.

    Parameters
    ----------
    mesh, graph, detour, endpoints, work, effort
        See `query_round`.
    polygon_at
        int32 (rows, cols), from `where`.
    """
    cx, cy, kinds, n = mesh[0], mesh[1], mesh[2], len(mesh[0])
    first, heads, table = graph
    closure, made, (first_made, heads_made, back_of, back_to), groups = detour
    xs, ys, kinds_made, _ = made
    costs, estimates, came, to_goal, touched = work[3]
    heap, counts, bounds = work[4], work[6], work[7]
    keys, values = heap
    factor, limit = effort
    sx, sy, tx, ty = endpoints
    box, seen = closure[0], work[2][2]
    left = left_behind(made, groups, to_goal[: n + len(xs)], work[5], tx, ty)
    marks = (table, work[5], groups[1], groups[3], left)
    size, n_touched, upper = counts[SIZE], counts[TOUCHED], bounds[UPPER]
    status = DONE
    while size or counts[BEGUN] == _LISTED:
        here, lobe, hand, cost_before = -1, -1, 0.0, 0.0
        px, py, x, y = sx, sy, sx, sy
        near, far = seen[counts[STARTS] : counts[GOALS]], seen[:0]
        if counts[BEGUN] != _LISTED:
            here, key = values[0], keys[0]
            cost_before = costs[here]
            if key > cost_before + estimates[here]:
                size = pop(heap, size)
                continue
            if key * factor >= upper:
                break
            before = came[here]
            if before >= n:
                px, py = xs[before - n], ys[before - n]
            elif before >= 0:
                px, py = cx[before], cy[before]
            if here < n:
                x, y, kind = cx[here], cy[here], kinds[here]
                lobe = lobe_of(kind, x - px, y - py)
                near = heads[first[2 * here + lobe] : first[2 * here + lobe + 1]]
                low = _place_of(back_of, here)
                if low < len(back_of) and back_of[low] == here:
                    far = back_to[low : _place_of(back_of, here + 1)]
            else:
                x, y, kind = xs[here - n], ys[here - n], kinds_made[here - n]
                lobe = lobe_of(kind, x - px, y - py)
                near, far = far, heads_made[first_made[here - n] : first_made[here - n + 1]]
            if size + len(near) + len(far) > len(keys):
                status = WORK_FULL
                break
            if counts[EXPANDED] >= limit:
                status = PAUSED
                break
            # The blocked cell lies on the left of the path here, or on the right.
            hand = (x - px) * (1.0 if kind & 2 else -1.0) - (y - py) * (1.0 if kind & 1 else -1.0)
            size = pop(heap, size)
            counts[EXPANDED] += 1
        counts[BEGUN] = _BEGUN
        for k in range(len(near) + len(far)):
            head = near[k] if k < len(near) else far[k - len(near)]
            is_near = False
            if head < n:
                wx, wy = cx[head], cy[head]
                is_near = here < n and is_beside(box, x, y, wx, wy)
                if is_near and is_at_closed(closure, wx, wy):
                    head = still_there(mesh, graph, closure, x, y, head)
                    if head < 0:
                        continue
                    wx, wy = cx[head], cy[head]
            else:
                wx, wy = xs[head - n], ys[head - n]
            cost = cost_before + distance(x, y, wx, wy)
            if cost >= costs[head] or turn_of(px, py, x, y, wx, wy) * hand < 0.0:
                continue
            if (here >= n or head >= n) and lobe >= 0 and lobe_of(kind, wx - x, wy - y) != lobe:
                continue
            is_new = costs[head] == np.inf
            ahead = estimates[head]
            if is_new:
                ahead = estimate(marks, head if head < n else -1, wx, wy, tx, ty)
            through = cost + to_goal[head]
            if through >= upper and cost + ahead >= upper:
                continue
            if is_near and crosses(closure, polygon_at, x, y, wx, wy):
                continue
            if through < upper:
                upper = through
                counts[LAST] = head
            if is_new:
                estimates[head] = ahead
                touched[n_touched] = head
                n_touched += 1
            costs[head], came[head] = cost, here
            if cost + ahead < upper:
                size = push(heap, size, cost + ahead, head)
        if counts[EXPANDED] == counts[_LOOKS] and upper == np.inf:
            counts[_LOOKS] *= _flood(mesh, graph, detour, polygon_at, work, 2 * counts[EXPANDED])
            if counts[_LOOKS] < 0:
                size = 0
    counts[SIZE], counts[TOUCHED], bounds[UPPER] = size, n_touched, upper
    least = min(keys[0], upper) if size else upper
    bounds[LOWER] = max(bounds[LOWER], least)
    return status


@njit(cache=True, nogil=True)
def _place_of(numbers, number):
    """Return how many of sorted whole numbers are less than a given one."""
    low, high = 0, len(numbers)
    while low < high:
        middle = (low + high) >> 1
        if numbers[middle] < number:
            low = middle + 1
        else:
            high = middle
    return low


@njit(cache=True, nogil=True)
def _flood(mesh, graph, detour, polygon_at, work, most):
    """Follow all edges back from the goal, over at most `most` corners.

    Return -1 if no corner found was reached by the search, so that there is no path, 0 if one was,
    and 4 if it remains unknown.
    """
    closure, (xs, _, _, _), (first_made, heads_made, back_of, back_to), _ = detour
    first, heads, _ = graph
    box = closure[0]
    costs, _, _, to_goal, _ = work[3]
    cx, cy, n = mesh[0], mesh[1], len(mesh[0])
    is_seen = np.zeros(n + len(xs), np.bool_)
    waiting = np.empty(len(is_seen), np.int32)
    size = 0
    for corner in work[2][2][: work[6][MARKED]]:
        size = _wait(is_seen, waiting, size, corner)
    for corner in range(n, n + len(xs)):
        if to_goal[corner] < np.inf:
            size = _wait(is_seen, waiting, size, corner)
    for at in range(most):
        if at == size:
            return -1
        here = waiting[at]
        if costs[here] < np.inf:
            return 0
        if here >= n:
            for head in heads_made[first_made[here - n] : first_made[here - n + 1]]:
                size = _wait(is_seen, waiting, size, head)
            continue
        x, y = cx[here], cy[here]
        for k in range(first[2 * here], first[2 * here + 2]):
            head = heads[k]
            if is_seen[head]:
                continue
            if is_beside(box, x, y, cx[head], cy[head]):
                if is_at_closed(closure, cx[head], cy[head]):
                    head = still_there(mesh, graph, closure, x, y, head)
                if head < 0 or crosses(closure, polygon_at, x, y, cx[head], cy[head]):
                    continue
            size = _wait(is_seen, waiting, size, head)
        for k in range(_place_of(back_of, here), _place_of(back_of, here + 1)):
            size = _wait(is_seen, waiting, size, back_to[k])
    return 4


@njit(cache=True, nogil=True)
def _wait(is_seen, waiting, size, corner):
    """Append a corner to others, once, and return their number."""
    if is_seen[corner]:
        return size
    is_seen[corner] = True
    waiting[size] = corner
    return size + 1


@njit(cache=True, nogil=True)
def _path_through(points, endpoints, came, corner):
    """Return the path through a corner, see `path_to`; -1 for a path of one segment."""
    cx, cy, (xs, ys, _, _) = points
    at, room = corner, 2
    while at >= 0:
        at, room = came[at], room + 1
    path = np.empty((room, 2))
    n = room - 1
    path[n, 0], path[n, 1] = endpoints[3], endpoints[2]
    at = corner
    while at >= 0:
        new = at - len(cx)
        x, y = (cx[at], cy[at]) if new < 0 else (xs[new], ys[new])
        n = put_corner(path, n, x, y)
        at = came[at]
    n = put_corner(path, n, endpoints[0], endpoints[1])
    return path[n:].copy()
