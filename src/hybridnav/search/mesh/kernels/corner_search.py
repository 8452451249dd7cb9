"""Kernels of the search of the graph of corners: A* with landmarks, shortest any-angle paths.

A. V. Goldberg, C. Harrelson: Computing the shortest path: A* search meets graph theory, 2005
(landmarks). S. Oh, H. W. Leong: Edge N-level sparse visibility graphs, 2017 (taut edges).
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import turn_of
from hybridnav.search.mesh.kernels.polyanya import pop, push, put_corner
from hybridnav.search.mesh.kernels.state import (
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
    CornerBend,
)
from hybridnav.search.mesh.kernels.views import distance, lobe_of, look

_SLACK = 1e-9
"""Rounding of distances in the graph, in cells."""
_TIE = 1e-10
"""Difference of two lengths that counts as none, in cells: of equal paths, one is chosen by their
directions."""


@guarded
@njit(cache=True, nogil=True)
def query_corners(mesh, graph, cells, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    `mesh`, `endpoints`: see `successors`; `graph`: `Corners`; `cells`: see `polygons_of_endpoints`;
    `work`: a `CornerWork`; `effort`: see `answer`. Result: see `query_intervals`.
    """
    seen, counts, bounds = work.room.seen, work.counts, work.bounds
    factor, limit = effort
    none = np.empty((0, 2))
    if not counts[BEGUN]:
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = np.inf, 0.0
        status, n, n_all = look(mesh, cells, endpoints, work)
        if n_all - n > len(work.heap.keys):
            status = WORK_FULL
        if status == WORK_FULL:
            return WORK_FULL, none
        if status == DONE:
            return DONE, none if bounds[UPPER] == np.inf else _path_through(
                mesh, endpoints, work.came, -1
            )
        _seed(mesh, graph.landmark_distances, endpoints, (seen[:n], seen[n:n_all]), work)
        counts[BEGUN], counts[MARKED] = 1, n
    status = DONE
    if limit >= 0:
        status = _advance(mesh, graph, endpoints, work, factor, limit)
    if status != DONE:
        return status, none
    for corner in seen[: counts[MARKED]]:
        work.to_goal[corner] = np.inf
    for corner in work.touched[: counts[TOUCHED]]:
        work.costs[corner] = np.inf
    counts[BEGUN] = 0
    if counts[LAST] < 0:
        return DONE, none
    return DONE, _path_through(mesh, endpoints, work.came, counts[LAST])


@njit(cache=True, nogil=True)
def _seed(mesh, table, endpoints, seen, work):
    """Mark the corners that see the goal, and reach those that the start sees."""
    sx, sy, tx, ty = endpoints
    from_goal, from_start = seen
    n_landmarks = table.shape[1]
    to_goal, goal_bounds = work.to_goal, work.goal_bounds
    # The distance of the goal from a landmark lies between these two, in the graph.
    goal_bounds[0] = np.inf
    goal_bounds[1] = -np.inf
    for corner in from_goal:
        to_goal[corner] = distance(mesh.x[corner], mesh.y[corner], tx, ty)
        for k in range(n_landmarks):
            reached = table[corner, k]
            if reached < np.inf:
                goal_bounds[0, k] = min(goal_bounds[0, k], reached + to_goal[corner] - _SLACK)
                goal_bounds[1, k] = max(goal_bounds[1, k], reached - to_goal[corner] + _SLACK)
    for k in range(n_landmarks):
        if goal_bounds[0, k] == np.inf:
            goal_bounds[0, k], goal_bounds[1, k] = -np.inf, np.inf
    work.counts[SIZE] = 0
    _relax(mesh, table, endpoints, work, -1, CornerBend(sx, sy, sx, sy, 0.0), 0.0, from_start)


@njit(cache=True, nogil=True)
def _advance(mesh, graph, endpoints, work, factor, limit):
    """Search until the answer is good enough or enough corners are expanded.

    `mesh`, `endpoints`: see `successors`; `graph`, `work`: see `query_corners`; `factor`, `limit`:
    see `advance`.
    """
    cx, cy, kinds = mesh.x, mesh.y, mesh.kinds
    # Arrays that loops use have names of their own: numba counts references to each field read.
    first, heads, table, heap = graph.first, graph.heads, graph.landmark_distances, work.heap
    costs, estimates, came = work.costs, work.estimates, work.came
    counts, bounds = work.counts, work.bounds
    sx, sy, _, _ = endpoints
    keys, values = heap.keys, heap.values
    status = DONE
    while counts[SIZE]:
        # The corner with the least estimate, unless it was reached by a cheaper path since.
        here, key = values[0], keys[0]
        if key > costs[here] + estimates[here]:
            counts[SIZE] = pop(heap, counts[SIZE])
            continue
        # Paths of equal length are all found: one of them is chosen.
        if key * factor > bounds[UPPER] + _TIE:
            break
        # Its edges in the quadrant into which a path may go on.
        x, y, kind, before = cx[here], cy[here], kinds[here], came[here]
        px, py = (sx, sy) if before < 0 else (cx[before], cy[before])
        dx, dy = x - px, y - py
        place = 2 * here + lobe_of(kind, dx, dy)
        low, high = first[place], first[place + 1]
        # Without room or time for them the corner stays in the heap.
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
        bend = CornerBend(px, py, x, y, hand)
        _relax(mesh, table, endpoints, work, here, bend, costs[here], heads[low:high])
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
        Result of `landmarks_of`.
    work
        A `CornerWork`.
    before, cost_before
        Number of the corner, and its cost in cells.
    bend
        A `CornerBend` there.
    heads
        int32, the corners to reach.
    """
    cx, cy, costs, came = mesh.x, mesh.y, work.costs, work.came
    estimates, to_goal, touched = work.estimates, work.to_goal, work.touched
    goal_bounds, heap = work.goal_bounds, work.heap
    px, py, x, y = bend.px, bend.py, bend.x, bend.y
    _, _, tx, ty = endpoints
    counts, bounds = work.counts, work.bounds
    size, n_touched, upper = counts[SIZE], counts[TOUCHED], bounds[UPPER]
    for corner in heads:
        wx, wy = cx[corner], cy[corner]
        # Only if that is cheaper, or as cheap and first in the order of directions.
        cost = cost_before + distance(x, y, wx, wy)
        known = costs[corner]
        if cost > known + _TIE or turn_of(px, py, x, y, wx, wy) * bend.hand < 0.0:
            continue
        is_new, is_tied = known == np.inf, cost >= known - _TIE
        if is_tied and not _is_first(_point(mesh, endpoints, came[corner]), (x, y), (wx, wy)):
            continue
        # What is left is at least the distance, and what landmarks tell.
        if is_new:
            left = distance(wx, wy, tx, ty)
            for k in range(table.shape[1]):
                reached = table[corner, k]
                if reached < np.inf:
                    left = max(left, goal_bounds[0, k] - reached, reached - goal_bounds[1, k])
        else:
            left = estimates[corner]
        # A corner over which no path is as short as the best one stays as it is.
        through = cost + to_goal[corner]
        if min(through, cost + left) > upper + _TIE:
            continue
        came[corner] = before
        if is_tied:
            continue
        # The best path so far, or one as short that arrives in another direction.
        last = counts[LAST]
        if through < upper - _TIE:
            upper, counts[LAST] = through, corner
        elif through <= upper + _TIE and last >= 0:
            is_next = _is_first((cx[last], cy[last]), (wx, wy), (tx, ty))
            counts[LAST] = corner if is_next else last
        # A corner that is reached first is noted, so that its cost is reset afterwards.
        if is_new:
            estimates[corner] = left
            touched[n_touched] = corner
            n_touched += 1
        costs[corner] = cost
        if cost + left <= upper + _TIE:
            size = push(heap, size, cost + left, corner)
    counts[SIZE], counts[TOUCHED], bounds[UPPER] = size, n_touched, upper


@njit(cache=True, nogil=True)
def _point(mesh, endpoints, corner):
    """Return a corner, or the start for -1."""
    if corner < 0:
        return endpoints[0], endpoints[1]
    return mesh.x[corner], mesh.y[corner]


@njit(cache=True, nogil=True)
def _is_first(one, other, to):
    """Return whether, of two equally long paths to a point, that by the other point is taken.

    Directions of arrival are in a fixed order, so that it does not matter which path came first; of
    two points on a line, the nearer one is taken.
    """
    (ax, ay), (bx, by), (x, y) = one, other, to
    is_up = y > ay or (y == ay and x > ax)
    if is_up != (y > by or (y == by and x > bx)):
        return is_up
    hand = turn_of(ax, ay, x, y, bx, by)
    return hand > 0 or (hand == 0 and abs(x - bx) + abs(y - by) < abs(x - ax) + abs(y - ay))


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
        n = put_corner(path, n, mesh.x[at], mesh.y[at])
        at = came[at]
    n = put_corner(path, n, sx, sy)
    return path[n:].copy()
