"""Kernels of Polyanya: shortest any-angle paths by a search of intervals on a convex mesh.

M. L. Cui, D. D. Harabor, A. Grastien: Compromise-free pathfinding on a navigation mesh, 2017.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import turn_of
from hybridnav._base.trig import hypot
from hybridnav.search.mesh.kernels.blocks import open_blocks
from hybridnav.search.mesh.kernels.intervals import (
    APART,
    DIRECTED,
    ENDS,
    MET,
    PARENT,
    ROOT,
    SLOT,
    WHOLE_SIDE,
    G,
    along,
    estimate_of,
    place_round,
    polygons_of_endpoints,
    put,
    root_behind,
    successors,
    turns,
)
from hybridnav.search.mesh.kernels.state import (
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
)

_OPENED, _SEEDED = 1, 2
"""Stages of a query: its blocks are opened; its first nodes are written."""
_SAME = 1e-9
"""Difference of two costs of a root that counts as none, in cells."""


@guarded
@njit(cache=True, nogil=True)
def query_intervals(mesh, blocks, cells, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    `mesh`, `endpoints`: see `successors`; `blocks`: `MeshBlocks`; `cells`: see
    `polygons_of_endpoints`; `work`: an `IntervalWork`; `effort`: `factor` and `limit` of `advance`;
    a limit below zero ends the query. Returns `DONE`, `PAUSED` or `WORK_FULL`; when done the
    path, float64 (n, 2) as (row, col), without rows if there is none.
    """
    starts, goals, whole = work.starts, work.goals, work.whole
    counts, bounds = work.counts, work.bounds
    factor, limit = effort
    none = np.empty((0, 2))

    # Not begun. Endpoints in different components or in one polygon need no search, and leave
    # nothing to clean up.
    if not counts[BEGUN]:
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = np.inf, 0.0
        how, counts[STARTS], counts[GOALS] = polygons_of_endpoints(
            mesh, cells, endpoints, starts, goals
        )
        if how == APART:
            bounds[:] = np.inf
            return DONE, none
        if how == MET:
            bounds[:] = hypot(endpoints[2] - endpoints[0], endpoints[3] - endpoints[1])
            return DONE, path_to(mesh, endpoints, whole, -1)

        # A shortest path stays in the blocks between its endpoints (see `open_blocks`). An endpoint
        # on a side lies in several polygons: the blocks of all pairs are opened.
        n = 0
        for start in starts[: counts[STARTS]]:
            for goal in goals[: counts[GOALS]]:
                n = open_blocks(blocks, start, goal, work.is_open, work.marked, n)
        counts[MARKED] = n
        counts[BEGUN] = _OPENED
    entered = (blocks.block_of, work.is_open)
    status = DONE

    # Opened. Without room for the first nodes the stage stays, and the next call writes them anew.
    if counts[BEGUN] == _OPENED:
        status = seed(mesh, entered, endpoints, starts[: counts[STARTS]], work)
        if status == DONE:
            counts[BEGUN] = _SEEDED

    # Seeded. Each call resumes the search; the stage stays until the answer is good enough.
    if status == DONE and limit >= 0:
        status = advance(mesh, entered, endpoints, goals[: counts[GOALS]], work, factor, limit)
    if status != DONE:
        return status, none

    # Done. Only what the query touched is reset, so its cost does not depend on the size of the
    # mesh.
    for k in range(counts[TOUCHED]):
        work.best[work.touched[k]] = np.inf
    for k in range(counts[MARKED]):
        work.is_open[work.marked[k]] = False
    counts[BEGUN] = 0
    if counts[LAST] < 0:
        return DONE, none
    return DONE, path_to(mesh, endpoints, whole, counts[LAST])


@njit(cache=True, nogil=True)
def seed(mesh, blocks, endpoints, starts, work):
    """Write the first nodes of a search, the sides of the start's polygons.

    `mesh`, `blocks`, `endpoints`: see `successors`; `starts`: int32 polygons that contain the
    start; `work`: an `IntervalWork`. Result: `DONE` or `WORK_FULL`.
    """
    cx, cy, kinds, first = mesh.x, mesh.y, mesh.kinds, mesh.first
    begins, finishes, twins = mesh.begins, mesh.finishes, mesh.twins
    block_of, is_open = blocks
    sx, sy, _, _ = endpoints
    whole, real, heap, bounds = work.whole, work.real, work.heap, work.bounds
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
            root = root_behind(mesh, twins[slot], root)
            put((whole, real), n, twins[slot], root, -1, WHOLE_SIDE, g, wx, wy, ux, uy)
            key = g + estimate_of(mesh, endpoints, whole, real, n)
            if key < bounds[UPPER]:
                size = push(heap, size, key, n)
                n += 1
    work.counts[N], work.counts[SIZE] = n, size
    return DONE


@njit(cache=True, nogil=True)
def advance(mesh, blocks, endpoints, goals, work, factor, limit):
    """Search until the answer is good enough or enough nodes are expanded, and return `DONE`,
    `PAUSED` or `WORK_FULL`.

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
        An `IntervalWork`.
    factor
        The answer is good enough when it is at most this factor times the lower bound; >= 1.
    limit
        Expansions, counted from the start, at which to pause.
    """
    first, polygon_of = mesh.first, mesh.polygon_of
    whole, real, best, heap = work.whole, work.real, work.best, work.heap
    keys, values = heap.keys, heap.values
    counts, bounds = work.counts, work.bounds
    size, status = counts[SIZE], DONE
    while size and status == DONE:
        top, key = np.int64(values[0]), keys[0]
        root = whole[top, ROOT]
        if root >= 0 and real[top, G] > best[root] + _SAME:
            size = pop(heap, size)
            continue
        # No path is shorter than the least key.
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
            # The goal may lie on a side of several polygons.
            is_goal = False
            for goal in goals:
                is_goal = is_goal or goal == polygon
            made = counts[N]
            n = successors(mesh, blocks, endpoints, is_goal, (whole, real), top, made)
            counts[EXPANDED] += 1
            top = _keep(mesh, work, made, n)
            if top >= 0:
                continue
            # Several: they wait for their turn, by their estimates.
            for new in range(made, counts[N]):
                if whole[new, SLOT] >= 0:
                    estimated = real[new, G] + estimate_of(mesh, endpoints, whole, real, new)
                    if estimated < bounds[UPPER]:
                        size = push(heap, size, max(key, estimated), new)
    # What the next run goes on with.
    counts[SIZE] = size
    least = min(keys[0], bounds[UPPER]) if size else bounds[UPPER]
    bounds[LOWER] = max(bounds[LOWER], least)
    return status


@njit(cache=True, nogil=True)
def _keep(mesh, work, made, n):
    """Keep the new nodes that no cheaper path to their root rules out, and the goal if its path is
    best.

    Return the only node to expand, -1 for none or several.
    """
    kinds, whole, real, best = mesh.kinds, work.whole, work.real, work.best
    touched, counts, bounds = work.touched, work.counts, work.bounds
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
            at = -1
            if root >= 0 and kinds[root] >= DIRECTED:  # calls with a mesh are not cheap
                root = whole[new, ROOT] = root_behind(mesh, whole[new, SLOT], root)
                at = place_round(mesh, whole[new, SLOT], root)
            if root >= 0:
                if g > best[root] + _SAME or (at >= 0 and g >= best[at]):
                    continue
                for place in (at, np.int64(root)):
                    if place >= 0 and g < best[place]:
                        if best[place] == np.inf:
                            touched[counts[TOUCHED]] = place
                            counts[TOUCHED] += 1
                        best[place] = g
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

    `mesh`, `endpoints`: see `successors`; `whole`: nodes of an `IntervalWork`; `node`: the last one
    of the path, -1 if the path is one segment.
    """
    cx, cy = mesh.x, mesh.y
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
        # Round the end of directed sides a path may turn back.
        is_ahead = (bx - x) * (cx - bx) + (by - y) * (cy - by) >= 0.0
        if is_ahead and turn_of(x, y, bx, by, cx, cy) == 0:
            n += 1
    path[n - 1, 0], path[n - 1, 1] = y, x
    return n - 1


@njit(cache=True, nogil=True)
def path_through(mesh, endpoints, nodes):
    """Return the path through some corners, see `path_to`."""
    sx, sy, tx, ty = endpoints
    n = len(nodes) + 1
    path = np.empty((n + 1, 2))
    path[n, 0], path[n, 1] = ty, tx
    for k in range(len(nodes) - 1, -1, -1):
        n = put_corner(path, n, mesh.x[nodes[k]], mesh.y[nodes[k]])
    n = put_corner(path, n, sx, sy)
    return path[n:].copy()


# Kernels of a binary heap of keys and values.


@njit(cache=True, nogil=True)
def push(heap, size, key, value):
    """Put an entry into a binary heap; return the new size."""
    keys, values = heap.keys, heap.values
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
    keys, values = heap.keys, heap.values
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
