"""Kernels of the search of the graph of corners: A* with landmarks, shortest any-angle paths.

A. V. Goldberg, C. Harrelson: Computing the shortest path: A* search meets graph theory, 2005
(landmarks). S. Oh, H. W. Leong: Edge N-level sparse visibility graphs, 2017 (taut edges).
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import turn_of
from hybridnav.search.contraction import grow_rows
from hybridnav.search.mesh.kernels.closures import (
    DEAD,
    crosses,
    is_beside,
    look_round,
    see_round,
)
from hybridnav.search.mesh.kernels.intervals import polygon_in, polygons_with
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
from hybridnav.search.mesh.kernels.views import distance, lobe_of, touches, view_room

_SLACK = 1e-9
"""Rounding of distances in the graph, in cells."""
_TIE = 1e-10
"""Difference of two lengths that counts as none, in cells: of equal paths, one is chosen by their
directions, so that the graph with nothing closed and the one round closed cells choose alike."""


@guarded
@njit(cache=True, nogil=True)
def query_corners(mesh, graph, where, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    `mesh`, `endpoints`: see `successors`; `graph`: int64 (2 n + 1,) and int32 (m,) of `edges_of`;
    float64 (n, landmarks) of `landmarks_of`; both results of `link`, None if nothing is closed;
    what `look_round` needs; `where`: see `look_round`; `work`: arrays of one query: room for the
    polygons of the endpoints; room of `see_from_point`; cost of corners (infinite), estimate,
    corner before, length to the goal (infinite), corners touched; keys and values of the heap;
    float64 (2, landmarks) bounds of the goal; counts and bounds; `effort`: see `query`. Result: see
    `query`.
    """
    starts, goals, room, corners, heap, _, counts, bounds = work
    costs, _, _, to_goal, touched = corners
    upper, factor, limit = effort
    none = np.empty((0, 2))
    if not counts[BEGUN]:
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = upper, 0.0
        rooms, around = (starts, goals, room), graph[5]
        status, n, n_all = look_round(mesh, where, endpoints, rooms, bounds, around)
        if n_all - n > len(heap[0]):
            status = WORK_FULL
        if status == WORK_FULL:
            return WORK_FULL, none
        if status == DONE:
            return DONE, none if bounds[UPPER] == np.inf else _path_through(
                mesh, endpoints, corners[2], -1
            )
        seen = room[2][:n], room[2][n:n_all]
        _seed(mesh, graph[2], graph[4], endpoints, seen, work)
        counts[BEGUN], counts[MARKED] = 1, n
    status = DONE
    if limit >= 0:
        status = _advance(mesh, graph, graph[3], endpoints, work, factor, limit)
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
def _seed(mesh, table, new, endpoints, seen, work):
    """Mark the corners that see the goal, and reach those that the start sees."""
    cx, cy = mesh[0], mesh[1]
    sx, sy, tx, ty = endpoints
    from_goal, from_start = seen
    n_landmarks = table.shape[1]
    corners, goal_bounds, counts = work[3], work[5], work[6]
    to_goal = corners[3]
    # The distance of the goal from a landmark lies between these two, in the graph.
    goal_bounds[0] = np.inf
    goal_bounds[1] = -np.inf
    for corner in from_goal:
        to_goal[corner] = distance(cx[corner], cy[corner], tx, ty)
        for k in range(n_landmarks):
            at_least = at_most = np.inf
            if corner < len(table):
                at_least = at_most = table[corner, k]
            if new is not None:
                if corner >= len(table):
                    row = new[corner - len(table)]
                    at_least, at_most = row[0, k], row[1, k]
            if at_least < np.inf:
                goal_bounds[0, k] = min(goal_bounds[0, k], at_least + to_goal[corner] - _SLACK)
                goal_bounds[1, k] = max(goal_bounds[1, k], at_most - to_goal[corner] + _SLACK)
    for k in range(n_landmarks):
        if goal_bounds[0, k] == np.inf:
            goal_bounds[0, k], goal_bounds[1, k] = -np.inf, np.inf
    counts[SIZE] = 0
    bend = (sx, sy, sx, sy, 0.0)
    _relax(mesh, table, new, None, endpoints, work, -1, bend, 0.0, from_start)


@njit(cache=True, nogil=True)
def _advance(mesh, graph, links, endpoints, work, factor, limit):
    """Search until the answer is good enough or enough corners are expanded; see `advance`.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    graph, work
        See `query_corners`.
    links
        The edges to corners of closed cells, see `link`; None if nothing is closed.
    factor, limit
        See `advance`.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    first, heads, table, _, new, around = graph
    n_links = 0
    if links is not None:
        n_links = links.shape[1]
    _, _, _, corners, heap, _, counts, bounds = work
    costs, estimates, came, _, _ = corners
    sx, sy, _, _ = endpoints
    keys, values = heap
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
        low = high = np.int64(0)
        if here < len(table):
            place = 2 * here + lobe_of(kind, dx, dy)
            low, high = first[place], first[place + 1]
        # Without room or time for them the corner stays in the heap.
        if counts[SIZE] + high - low + n_links > len(keys):
            status = WORK_FULL
            break
        if counts[EXPANDED] >= limit:
            status = PAUSED
            break
        counts[SIZE] = pop(heap, counts[SIZE])
        counts[EXPANDED] += 1
        # The blocked cell lies on the left of the path here, or on the right.
        hand = dx * (1.0 if kind & 2 else -1.0) - dy * (1.0 if kind & 1 else -1.0)
        bend, cost = (px, py, x, y, hand), costs[here]
        # Round closed cells also the edges to their corners, which meet no closed cell.
        if links is None:
            _relax(mesh, table, None, None, endpoints, work, here, bend, cost, heads[low:high])
        else:
            _relax(mesh, table, new, around, endpoints, work, here, bend, cost, heads[low:high])
            low = high = np.searchsorted(links[0], here)
            while high < n_links and links[0, high] == here:
                high += 1
            if low == high:
                continue
            _relax(mesh, table, new, None, endpoints, work, here, bend, cost, links[1, low:high])
    least = min(keys[0], bounds[UPPER]) if counts[SIZE] else bounds[UPPER]
    bounds[LOWER] = max(bounds[LOWER], least)
    return status


@njit(cache=True, nogil=True)
def _relax(mesh, table, new, around, endpoints, work, before, bend, cost_before, heads):
    """Reach corners from a corner, or from the start, if that is cheaper than before.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    table, new, around
        Parts of the graph; the last is None if no edge meets a closed cell.
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
    # An edge that stays away from the box of the closed cells meets none.
    if around is not None:
        box = around[0][0]
    for corner in heads:
        wx, wy = cx[corner], cy[corner]
        # Only if that is cheaper, or as cheap and first in the order of directions.
        cost = cost_before + distance(x, y, wx, wy)
        known = costs[corner]
        if cost > known + _TIE or turn_of(px, py, x, y, wx, wy) * hand < 0.0:
            continue
        is_new, is_tied = known == np.inf, cost >= known - _TIE
        if is_tied and not _is_first(_point(mesh, endpoints, came[corner]), (x, y), (wx, wy)):
            continue
        # What is left is at least the distance, and what landmarks tell.
        if is_new:
            left = distance(wx, wy, tx, ty)
            for k in range(table.shape[1] if corner < len(table) else 0):
                reached = table[corner, k]
                if reached < np.inf:
                    left = max(left, goal_bounds[0, k] - reached, reached - goal_bounds[1, k])
            if new is not None:
                left = max(left, _left_of_new(new, goal_bounds, corner - len(table)))
        else:
            left = estimates[corner]
        through = cost + to_goal[corner]
        if min(through, cost + left) > upper + _TIE:
            continue
        # Few edges get here, fewer pass closed cells: they are tested as they are met.
        if around is not None:
            is_near = is_beside(box, x, y, wx, wy)
            if mesh[2][corner] & DEAD or (is_near and crosses(around[0], around[1], x, y, wx, wy)):
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
    return mesh[0][corner], mesh[1][corner]


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
def _left_of_new(new, goal_bounds, row):
    """Return a bound of the length from a corner of closed cells to the goal, by landmarks."""
    left = 0.0
    for k in range(goal_bounds.shape[1] if row >= 0 else 0):
        if new[row, 1, k] < np.inf:
            left = max(left, goal_bounds[0, k] - new[row, 1, k], new[row, 0, k] - goal_bounds[1, k])
    return left


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


# The graph round closed cells: new corners.


@njit(cache=True, nogil=True)
def see_from_new(mesh, around, place, point, room, polygons):
    """Return the number of corners that a new corner sees, and the room, which may grow."""
    x, y = point
    row, col = int(y), int(x)
    inner = polygon_in(mesh, place[0], place[1], row, col)
    starts = polygons[: polygons_with(mesh, inner, row, col, x, y, polygons)]
    nowhere = (0.0, 0.0, starts[:0])
    n, _ = see_round(mesh, around, (x, y, starts), nowhere, room, 0)
    while n < 0:
        room = view_room(2 * len(room[2]))
        n, _ = see_round(mesh, around, (x, y, starts), nowhere, room, 0)
    return n, room


@guarded
@njit(cache=True, nogil=True)
def link(mesh, around, place, table):
    """Find the edges between the corners of closed cells, and to those that they see.

    Parameters
    ----------
    mesh
        See `successors`, with the corners and kinds of `corners_round`.
    around
        See `look_round`.
    place
        Component of polygons, and the polygon of each cell.
    table
        Result of `landmarks_of`.

    Returns
    -------
    tuple
        int32 (2, m), the corners at which the edges begin, sorted, and those at which they end;
        float64 (new, 2, landmarks) least and greatest distance of each new corner from landmarks.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    n_old, n_all = around[4], len(cx)
    view = view_room(1024)
    polygons = np.empty(len(place[0]), np.int32)
    bounds = np.empty((n_all - n_old, 2, table.shape[1]))
    bounds[:, 0], bounds[:, 1] = -np.inf, np.inf
    ends, m = np.empty((1024, 2), np.int32), 0
    for corner in range(n_old, n_all):
        x, y, kind = cx[corner], cy[corner], kinds[corner]
        n, view = see_from_new(mesh, around, place, (x, y), view, polygons)
        for other in view[2][:n]:
            dx, dy = cx[other] - x, cy[other] - y
            if other < n_old:
                apart = distance(x, y, cx[other], cy[other])
                row = bounds[corner - n_old]
                for k in range(table.shape[1]):
                    row[0, k] = max(row[0, k], table[other, k] - apart)
                    row[1, k] = min(row[1, k], table[other, k] + apart)
            # Only segments along which a path may bend round it, each once.
            if n_old <= other <= corner or not touches(kind, dx, dy):
                continue
            while m + 2 > len(ends):
                ends = grow_rows(ends)
            ends[m, 0], ends[m, 1], ends[m + 1, 0], ends[m + 1, 1] = corner, other, other, corner
            m += 2
    # Sorted, so that a search finds those of a corner by halving.
    order = np.argsort(ends[:m, 0], kind="mergesort")
    return np.ascontiguousarray(ends[order].T), bounds
