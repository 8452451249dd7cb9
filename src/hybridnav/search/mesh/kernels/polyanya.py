"""Kernels of Polyanya: shortest any-angle paths by a search of intervals on a convex mesh.

M. L. Cui, D. D. Harabor, A. Grastien: Compromise-free pathfinding on a navigation mesh, 2017.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow
from hybridnav._base.kernels.exact import GRAIN, turn_of
from hybridnav._base.trig import hypot
from hybridnav.search.mesh.kernels.intervals import (
    ENDS,
    PARENT,
    ROOT,
    SLOT,
    WHOLE_SIDE,
    G,
    along,
    estimate_of,
    put,
    successors,
    turns,
)
from hybridnav.search.mesh.kernels.views import distance, see_quadrant, view_room, walls_at

DONE, PAUSED, WORK_FULL = 0, 1, 2
"""Status of a run of the search: the answer is good enough; the limit of expansions is reached;
there are more nodes than room."""

# Whole numbers that a search keeps between runs: nodes written, entries of the heap, corners
# touched, nodes expanded, the last node of the best path (-1 if the search did not find it); and
# for a query: its stage, polygons of start and goal, blocks or corners marked.
N, SIZE, TOUCHED, EXPANDED, LAST, BEGUN, STARTS, GOALS, MARKED = range(9)
N_COUNTS = 9
# Reals: the length of the best path known, a lower bound on every path.
UPPER, LOWER = 0, 1

_SAME = 1e-9
"""Difference of two costs of a root that counts as none, in cells."""


@njit(cache=True, nogil=True)
def seed(mesh, blocks, endpoints, starts, work):
    """Write the first nodes of a search, the sides of the start's polygons.

    `mesh`, `blocks`, `endpoints`: see `successors`; `starts`: int32 polygons that contain the
    start; `work`: nodes as int32 (n, 4) and float64 (n, 5), keys and values of the heap, best cost
    of each corner (infinite), int32 corners touched, counts and bounds. Result: `DONE` or
    `WORK_FULL`.
    """
    cx, cy, kinds, first, begins, finishes, twins, _ = mesh
    block_of, is_open = blocks
    sx, sy, _, _ = endpoints
    whole, real, keys, values, _, _, counts, bounds = work
    n = size = 0
    for polygon in starts:
        if n + first[polygon + 1] - first[polygon] > len(whole):
            return WORK_FULL
        for slot in range(first[polygon], first[polygon + 1]):
            if twins[slot] < 0 or not is_open[block_of[slot]]:
                continue
            u, w = begins[slot], finishes[slot]
            ux, uy, wx, wy = cx[u], cy[u], cx[w], cy[w]
            root, g = -1, 0.0
            if turn_of(sx, sy, ux, uy, wx, wy) == 0:
                # The start lies on the side, or on its line.
                if (ux - sx) * (wx - sx) <= 0.0 and (uy - sy) * (wy - sy) <= 0.0:
                    continue
                root, hand = along(mesh, sx, sy, u, w)
                x, y = cx[root], cy[root]
                if not turns(kinds[root], x - sx, y - sy, hand):
                    continue
                g = hypot(x - sx, y - sy)
            put((whole, real), n, twins[slot], root, -1, WHOLE_SIDE, g, wx, wy, ux, uy)
            key = g + estimate_of(mesh, endpoints, whole, real, n)
            if key < bounds[UPPER]:
                size = push((keys, values), size, key, n)
                n += 1
    counts[N], counts[SIZE] = n, size
    return DONE


@njit(cache=True, nogil=True)
def advance(mesh, blocks, endpoints, goals, work, factor, limit):
    """Search until the answer is good enough or enough nodes are expanded.

    Nodes persist in `work`: the next call resumes a search that was paused or had no room. At the
    end of each run `bounds` holds the length of the best path so far and a lower bound on every
    path, which never falls.

    Parameters
    ----------
    mesh, blocks, endpoints
        See `successors`.
    goals
        int32 polygons that contain the goal.
    work
        See `seed`.
    factor
        The answer is good enough when it is at most this factor times the lower bound; >= 1.
    limit
        Expansions, counted from the start, at which to pause.

    Returns
    -------
    int
        `DONE`, `PAUSED` or `WORK_FULL`.
    """
    first, polygon_of = mesh[3], mesh[7]
    whole, real, keys, values, best, _, counts, bounds = work
    heap = (keys, values)
    size, status = counts[SIZE], DONE
    while size and status == DONE:
        top, key = np.int64(values[0]), keys[0]
        root = whole[top, ROOT]
        if root >= 0 and real[top, G] > best[root] + _SAME:
            size = pop(heap, size)
            continue
        if key * factor >= bounds[UPPER]:
            break
        if counts[EXPANDED] >= limit:
            status = PAUSED
            break
        size = pop(heap, size)
        # A node with one successor is followed at once.
        while top >= 0:
            polygon = polygon_of[whole[top, SLOT]]
            # At most three successors for each side, and the goal.
            if counts[N] + 3 * (first[polygon + 1] - first[polygon]) + 1 > len(whole):
                size = push(heap, size, key, top)
                status = WORK_FULL
                break
            is_goal = False
            for goal in goals:
                is_goal = is_goal or goal == polygon
            made = counts[N]
            n = successors(mesh, blocks, endpoints, is_goal, (whole, real), top, made)
            counts[EXPANDED] += 1
            top = _keep(work, made, n)
            if top >= 0:
                continue
            for new in range(made, counts[N]):
                if whole[new, SLOT] >= 0:
                    estimated = real[new, G] + estimate_of(mesh, endpoints, whole, real, new)
                    if estimated < bounds[UPPER]:
                        size = push(heap, size, max(key, estimated), new)
    counts[SIZE] = size
    least = min(keys[0], bounds[UPPER]) if size else bounds[UPPER]
    bounds[LOWER] = max(bounds[LOWER], least)
    return status


@njit(cache=True, nogil=True)
def _keep(work, made, n):
    """Keep the new nodes that no cheaper path to their root rules out, and the goal if its path is
    best.

    Return the only node to expand, -1 for none or several.
    """
    whole, real, _, _, best, touched, counts, bounds = work
    kept = made
    n_open = 0
    only = -1
    for new in range(made, n):
        root, g = whole[new, ROOT], real[new, G]
        if whole[new, SLOT] < 0:
            if g >= bounds[UPPER]:
                continue
            bounds[UPPER] = g
            counts[LAST] = kept
        else:
            if root >= 0:
                if g > best[root] + _SAME:
                    continue
                if g < best[root]:
                    if best[root] == np.inf:
                        touched[counts[TOUCHED]] = root
                        counts[TOUCHED] += 1
                    best[root] = g
            only = kept
            n_open += 1
        if kept < new:
            for k in range(4):
                whole[kept, k] = whole[new, k]
            for k in range(5):
                real[kept, k] = real[new, k]
        kept += 1
    counts[N] = kept
    return only if n_open == 1 else -1


@njit(cache=True, nogil=True)
def path_to(mesh, endpoints, whole, node):
    """Return the path to a node, float64 (n, 2) as (row, col).

    It holds the start, the corners at which it turns, and the goal.

    `mesh`, `endpoints`: see `successors`; `whole`: nodes, see `seed`; `node`: the last node of the
    path, -1 if the path is one segment.
    """
    cx, cy = mesh[0], mesh[1]
    sx, sy, tx, ty = endpoints
    at, room = node, 2
    while at >= 0:
        at, room = whole[at, PARENT], room + 2
    path = np.empty((room, 2))
    n = room - 1
    path[n, 0], path[n, 1] = ty, tx
    at, last = node, -1
    while at >= 0:
        root, marks, parent = whole[at, ROOT], whole[at, ENDS], whole[at, PARENT]
        if root >= 0 and root != last:
            n = put_corner(path, n, cx[root], cy[root])
        if marks < 0 and root != whole[parent, ROOT]:
            root = -1 - marks
            n = put_corner(path, n, cx[root], cy[root])
        at, last = parent, root
    n = put_corner(path, n, sx, sy)
    return path[n:].copy()


@njit(cache=True, nogil=True)
def put_corner(path, n, x, y):
    """Write a point of a path before index n, and return its index.

    It replaces the next point if the path does not turn there.
    """
    if n + 1 < len(path):
        (by, bx), (cy, cx) = path[n], path[n + 1]
        if turn_of(x, y, bx, by, cx, cy) == 0:
            n += 1
    path[n - 1, 0], path[n - 1, 1] = y, x
    return n - 1


# Kernels of a binary heap of keys and values.


@njit(cache=True, nogil=True)
def push(heap, size, key, value):
    """Put an entry into a binary heap; return the new size."""
    keys, values = heap
    at = size
    while at > 0:
        above = (at - 1) >> 1
        if keys[above] <= key:
            break
        keys[at], values[at] = keys[above], values[above]
        at = above
    keys[at], values[at] = key, value
    return size + 1


@njit(cache=True, nogil=True)
def pop(heap, size):
    """Take the least entry out of a binary heap; return the new size."""
    keys, values = heap
    size -= 1
    key, value = keys[size], values[size]
    at = 0
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        if below + 1 < size and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[at], values[at] = keys[below], values[below]
        at = below
    keys[at], values[at] = key, value
    return size


# Kernels of the graph of corners: its edges, and distances in it from landmarks.


@guarded
@njit(cache=True, nogil=True)
def edges_of(mesh, component, limit):
    """Find the edges of the graph.

    An edge joins two corners that see each other, and at both of which a path along the segment
    between them may bend.

    `mesh`: see `successors`; `component`: int32 (p,), below 0 for polygons that were cut out;
    `limit`: most edges. Returns int64 (2 n + 1,) first edge of each corner and quadrant, see
    `lobe_of`; int32 (m,) the corner at which each edge ends. Each edge occurs in both directions.
    If there are more edges than the limit, the last entry of the first array is -1.
    """
    kinds = mesh[2]
    n = len(kinds)
    wall = walls_at(mesh, component)
    room = view_room(1024)
    nowhere = 0.0, 0.0, np.empty(0, np.int32)
    first = np.zeros(2 * n + 1, np.int64)
    heads = np.empty(16 * n, np.int32)
    m = 0
    for corner in range(n):
        for lobe in range(2):
            found = 0
            if kinds[corner] < 4 and wall[corner] >= 0:
                found, room = see_quadrant(mesh, corner, wall[corner], lobe, nowhere, room)
            if m + found > limit:
                first[2 * n] = -1
                return first, heads[:0].copy()
            while m + found > len(heads):
                heads = grow(heads)
            heads[m : m + found] = room[2][:found]
            m += found
            first[2 * corner + lobe + 1] = m
    return first, heads[:m].copy()


@guarded
@njit(cache=True, nogil=True)
def landmarks_of(mesh, graph, component, source, table):
    """Compute the distances of all corners from landmarks, in free space.

    Those in the graph are longer where a shortest path leaves the landmark, or arrives, in the
    quadrant opposite to the blocked cell.

    Parameters
    ----------
    mesh
        See `successors`.
    graph
        The graph of `edges_of`.
    component
        See `edges_of`.
    source
        The first landmark: the others are in the same part of the graph. Each is the corner
        farthest from those before.
    table
        float64 (n, landmarks), filled in.
    """
    cx, cy, kinds, first, begins, _, twins, polygon_of = mesh
    (offsets, heads), (n, number) = graph, table.shape
    wall = walls_at(mesh, component)
    room = view_room(1024)
    heap = np.empty(n), np.empty(n, np.int32)
    arrived, nearest = np.empty((number, n)), np.full(n, np.inf)
    points = np.stack((cy, cx), axis=1)
    landmark = source
    for k in range(number):
        # One row for each landmark while they are found.
        distances = arrived[k]
        distances[:] = np.inf
        # The first segment may leave in the third quadrant, for any corner that is seen there.
        is_seen = np.zeros(n, np.bool_)
        sight = first, begins, points, is_seen
        _, room = see_quadrant(mesh, landmark, wall[landmark], 2, sight, room)
        # Corners of a polygon round the landmark are seen because it is convex, itself too.
        slot = wall[landmark]
        while slot >= 0:
            low, high = first[polygon_of[slot]], first[polygon_of[slot] + 1]
            is_seen[begins[low:high]] = True
            slot = twins[slot - 1 if slot > low else high - 1]
        size = 0
        for other in range(n):
            if is_seen[other] and kinds[other] < 4:
                distances[other] = distance(cx[landmark], cy[landmark], cx[other], cy[other])
                size = push(heap, size, distances[other], other)
        # Farther corners are reached along the edges, from the nearest one on.
        while size:
            here, cost = heap[1][0], heap[0][0]
            size = pop(heap, size)
            if cost > distances[here]:
                continue
            low, high = offsets[2 * here], offsets[2 * here + 2]
            while size + high - low > len(heap[0]):
                heap = (grow(heap[0]), grow(heap[1]))
            for other in heads[low:high]:
                reached = cost + distance(cx[here], cy[here], cx[other], cy[other])
                if reached < distances[other]:
                    distances[other] = reached
                    size = push(heap, size, reached, other)
        # The next landmark is far from all so far.
        nearest = np.minimum(nearest, distances)
        landmark = np.argmax(np.where(nearest < np.inf, nearest, -1.0))
    # The last one may arrive in the third quadrant.
    before = np.ascontiguousarray(arrived.T)
    table[:] = before
    nowhere = 0.0, 0.0, np.empty(0, np.int32)
    for corner in range(n):
        if kinds[corner] >= 4 or wall[corner] < 0:
            continue
        found, room = see_quadrant(mesh, corner, wall[corner], 2, nowhere, room)
        for other in room[2][:found]:
            further = distance(cx[corner], cy[corner], cx[other], cy[other])
            for k in range(number):
                table[corner, k] = min(table[corner, k], before[other, k] + further)


@njit(cache=True, nogil=True)
def path_through(mesh, endpoints, nodes):
    """Return the path through some corners, see `path_to`."""
    sx, sy, tx, ty = endpoints
    n = len(nodes) + 1
    path = np.empty((n + 1, 2))
    path[n, 0], path[n, 1] = ty, tx
    for k in range(len(nodes) - 1, -1, -1):
        n = put_corner(path, n, mesh[0][nodes[k]], mesh[1][nodes[k]])
    n = put_corner(path, n, sx, sy)
    return path[n:].copy()


@njit(cache=True, nogil=True)
def into_cell(low, at):
    """Round a coordinate to the grain of exact tests, and move it into a cell."""
    return min(max(np.rint(at * GRAIN) / GRAIN, float(low)), low + 1.0)
