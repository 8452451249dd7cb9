"""Kernels of the corners of closed cells, and their edges to the graph of corners.

Corners of the graph keep their numbers; those of closed cells follow behind them.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.mesh._closure_kernels import crosses, is_at_closed, is_clear
from hybridnav.mesh._endpoint_kernels import polygons_with
from hybridnav.mesh._view_kernels import distance, lobe_of, see_from_point, touches
from hybridnav.search.exact import turn_of


@njit(cache=True, nogil=True)
def still_there(mesh, graph, closure, x, y, corner):
    """Return a corner seen from a point if paths may still bend round it with cells closed.

    Else return the next corner on the line behind it, -1 if there is none.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    first, heads = graph[0], graph[1]
    for _ in range(len(kinds)):
        if corner < 0 or not is_at_closed(closure, cx[corner], cy[corner]):
            break
        ux, uy = cx[corner], cy[corner]
        place = 2 * corner + lobe_of(kinds[corner], ux - x, uy - y)
        corner = -1
        for other in heads[first[place] : first[place + 1]]:
            if turn_of(x, y, ux, uy, cx[other], cy[other]) == 0:
                corner = other
    return corner


@njit(cache=True, nogil=True)
def is_in_sight(mesh, closure, polygon_at, polygon, segment):
    """Return whether a segment from a point in a polygon is legal with cells closed."""
    ax, ay, bx, by = segment
    cx, cy, _, first, begins, finishes, twins, polygon_of = mesh
    for _ in range(len(first)):
        leaves = -1
        for slot in range(first[polygon], first[polygon + 1]):
            u, w = begins[slot], finishes[slot]
            if turn_of(ax, ay, bx, by, cx[u], cy[u]) < 0 < turn_of(ax, ay, bx, by, cx[w], cy[w]):
                leaves = slot
        if leaves < 0:
            # Through a corner of the mesh, or along a side: the cells decide.
            return is_clear(closure, polygon_at, ax, ay, bx, by)
        u, w = begins[leaves], finishes[leaves]
        if turn_of(cx[u], cy[u], cx[w], cy[w], bx, by) >= 0:
            return not crosses(closure, polygon_at, ax, ay, bx, by)
        if twins[leaves] < 0:
            return False
        polygon = polygon_of[twins[leaves]]
    return False


@guarded
@njit(cache=True, nogil=True)
def edges_of_closure(mesh, polygon_at, graph, closure, made):
    """Find the edges of the corners of closed cells.

    Parameters
    ----------
    mesh
        See `successors`; the mesh of free space before the closure.
    polygon_at
        int32 (rows, cols), the polygon at the centre of each cell.
    graph
        int64 (2 n + 1,) and int32 (m,) of `edges_of`, float64 (n, landmarks) of `landmarks_of`.
    closure
        Result of `closure_of`.
    made
        Result of `corners_of_closure`.

    Returns
    -------
    tuple
        int64 (k + 1,) offsets of the edges of each corner; int32 the corners at which they end;
        then the reversed edges from corners of the graph: int32 these corners, sorted, and int32
        the new ones.
    """
    cx, cy = mesh[0], mesh[1]
    xs, ys, kinds_made, cells = made
    n = len(cx)
    nowhere = (0.0, 0.0, np.empty(0, np.int32))
    holding = np.empty(len(mesh[3]), np.int32)
    size = 1024
    room = (np.empty((size, 2), np.int32), np.empty((size, 4)), np.empty(size, np.int32))
    first = np.zeros(len(xs) + 1, np.int64)
    heads = np.empty(64 * len(xs), np.int32)
    m = 0
    for i in range(len(xs)):
        x, y, (row, col) = xs[i], ys[i], cells[i]
        held = polygons_with(mesh, polygon_at[row, col], row, col, x, y, holding)
        seen = -1
        while seen < 0:
            seen, _ = see_from_point(mesh, x, y, holding[:held], nowhere, room, 0)
            if seen < 0:
                size *= 2
                room = (
                    np.empty((size, 2), np.int32),
                    np.empty((size, 4)),
                    np.empty(size, np.int32),
                )
        while m + seen + len(xs) > len(heads):
            heads = np.concatenate((heads, heads))
        for corner in room[2][:seen]:
            if not touches(kinds_made[i], cx[corner] - x, cy[corner] - y):
                continue
            head = corner
            if is_at_closed(closure, cx[corner], cy[corner]):
                head = still_there(mesh, graph, closure, x, y, corner)
            if head >= 0 and not crosses(closure, polygon_at, x, y, cx[head], cy[head]):
                heads[m] = head
                m += 1
        for j in range(len(xs)):
            dx, dy = xs[j] - x, ys[j] - y
            if i == j or not touches(kinds_made[i], dx, dy) or not touches(kinds_made[j], dx, dy):
                continue
            if crosses(closure, polygon_at, x, y, xs[j], ys[j]):
                continue  # a quick test for corners of one area
            if is_clear(closure, polygon_at, x, y, xs[j], ys[j]):
                heads[m] = n + j
                m += 1
        first[i + 1] = m
    back_of, back_to = np.empty(m, np.int32), np.empty(m, np.int32)
    n_back = 0
    for i in range(len(xs)):
        for head in heads[first[i] : first[i + 1]]:
            if head < n:
                back_of[n_back], back_to[n_back] = head, n + i
                n_back += 1
    order = np.argsort(back_of[:n_back], kind="mergesort")
    return first, heads[:m].copy(), back_of[:n_back][order], back_to[:n_back][order]


@guarded
@njit(cache=True, nogil=True)
def groups_of_closure(points, table, made, edges, most):
    """Put the corners of closed cells into groups of near ones.

    Parameters
    ----------
    points
        float64 x and y of the corners of the graph.
    table
        float64 (n, landmarks) of `landmarks_of`.
    made, edges
        Results of `corners_of_closure` and `edges_of_closure`.
    most
        Most groups.

    Returns
    -------
    tuple
        int64 (k,) the group of each corner; float64 (g, 3) x, y and radius of a circle round each
        group; float64 (2, k, landmarks) and float64 (2, g, landmarks): the least length of a path
        from a landmark to a corner, and the greatest difference between the distance of the
        landmark and the path to the corner from the last but one corner of such a path.
    """
    cx, cy = points
    xs, ys = made[0], made[1]
    n, k = len(cx), len(xs)
    reach = np.empty((2, k, table.shape[1]))
    reach[0], reach[1] = np.inf, -np.inf
    for i in range(k):
        for head in edges[1][edges[0][i] : edges[0][i + 1]]:
            if head >= n:
                continue
            leg = distance(xs[i], ys[i], cx[head], cy[head])
            for mark in range(table.shape[1]):
                if table[head, mark] < np.inf:
                    reach[0, i, mark] = min(reach[0, i, mark], table[head, mark] + leg)
                    reach[1, i, mark] = max(reach[1, i, mark], table[head, mark] - leg)
    count = min(k, most)
    group = np.zeros(k, np.int64)
    circles = np.zeros((count, 3))
    around = np.empty((2, count, table.shape[1]))
    around[0], around[1] = np.inf, -np.inf
    near = np.full(k, np.inf)
    middle = 0
    for g in range(count):
        # Each middle is the corner farthest from those before.
        circles[g, 0], circles[g, 1] = xs[middle], ys[middle]
        far = -1.0
        here = middle
        for i in range(k):
            away = distance(xs[i], ys[i], xs[here], ys[here])
            if away < near[i]:
                near[i], group[i] = away, g
            if near[i] > far:
                far, middle = near[i], i
    for i in range(k):
        g = group[i]
        circles[g, 2] = max(circles[g, 2], near[i])
        for mark in range(table.shape[1]):
            around[0, g, mark] = min(around[0, g, mark], reach[0, i, mark])
            around[1, g, mark] = max(around[1, g, mark], reach[1, i, mark])
    return group, circles, reach, around
