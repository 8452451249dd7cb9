"""Kernels of many ends at once on a mesh: their labels in the hierarchy, and who sees whom."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, grow_rows, pop, push
from hybridnav._base.kernels.exact import turn_of
from hybridnav.search.kernels.labels import climb
from hybridnav.search.mesh.kernels.intervals import polygon_in, polygons_with
from hybridnav.search.mesh.kernels.state import Target, Targets
from hybridnav.search.mesh.kernels.views import (
    class_of,
    cost_of,
    lobe_of,
    see_from_point,
    view_room,
)

_ROOM = 4096
"""Initial room of views."""


@guarded
@njit(cache=True, nogil=True)
def polygons_of_points(mesh, polygon_at, ends):
    """Return the polygons that contain each point: int64 (n + 1,) offsets and int32.

    `mesh`: a `Mesh`; `polygon_at`: see `ConvexMesh`; `ends`: int64 (n, 2) free cells, float64 (n,
    2) points in their closed squares, (row, col).
    """
    cells, points = ends
    inside = np.empty(len(mesh.component), np.int32)
    offset = np.zeros(len(cells) + 1, np.int64)
    listed = np.empty(4 * len(cells), np.int32)
    n = 0
    for k in range(len(cells)):
        row, col, y, x = cells[k, 0], cells[k, 1], points[k, 0], points[k, 1]
        inner = polygon_in(mesh, polygon_at[row, col], row, col)
        n_inside = polygons_with(mesh, inner, row, col, x, y, inside)
        while n + n_inside > len(listed):
            listed = grow(listed)
        listed[n : n + n_inside] = inside[:n_inside]
        n += n_inside
        offset[k + 1] = n
    return offset, listed[:n]


@njit(cache=True, nogil=True)
def _seen(mesh, ends, k, target, room):
    """Return the corners, int32, that a point of `ends` sees, and the room, grown if too small."""
    points, offset, listed = ends
    y, x, inside = points[k, 0], points[k, 1], listed[offset[k] : offset[k + 1]]
    found, _ = see_from_point(mesh, x, y, inside, target, room, 0)
    while found < 0:
        room = view_room(2 * len(room.seen))
        found, _ = see_from_point(mesh, x, y, inside, target, room, 0)
    return room.seen[:found], room


@guarded
@njit(cache=True, nogil=True)
def views_of_points(mesh, ends):
    """Return the corners that points see, with the costs to them, as labels.

    `mesh`: a `Mesh`; `ends`: float64 (n, 2) points, (row, col); the polygons that contain them, see
    `polygons_of_points`. Returns int64 (n + 1,) offsets; int32 corners, int64 costs in `UNITS`.
    """
    cx, cy = mesh.x, mesh.y
    points, _, listed = ends
    room = view_room(_ROOM)
    offset = np.zeros(len(points) + 1, np.int64)
    nodes, costs, n = np.empty(4096, np.int32), np.empty(4096, np.int64), 0
    for k in range(len(points)):
        y, x = points[k, 0], points[k, 1]
        seen, room = _seen(mesh, ends, k, Target(0.0, 0.0, listed[:0]), room)
        while n + len(seen) > len(nodes):
            nodes, costs = grow(nodes), grow(costs)
        for corner in seen:
            nodes[n], costs[n] = corner, cost_of(x, y, cx[corner], cy[corner])
            n += 1
        offset[k + 1] = n
    return offset, nodes[:n], costs[:n]


@guarded
@njit(cache=True, nogil=True)
def labels_of_points(mesh, hierarchy, ends, work):
    """Return the labels of points, as `views_of_points` returns views.

    `mesh`, `ends`: see `views_of_points`; `hierarchy`, `work`: see `climb`.
    """
    cx, cy, kinds = mesh.x, mesh.y, mesh.kinds
    points, _, listed = ends
    records, heap = work
    follow, room = hierarchy[3], view_room(_ROOM)
    offset = np.zeros(len(points) + 1, np.int64)
    nodes, costs, n = np.empty(4096, np.int32), np.empty(4096, np.int64), 0
    for k in range(len(points)):
        y, x = points[k, 0], points[k, 1]
        seen, room = _seen(mesh, ends, k, Target(0.0, 0.0, listed[:0]), room)
        to_seen, may_follow = np.empty(len(seen), np.int64), np.empty(len(seen), np.int64)
        for i in range(len(seen)):
            corner = seen[i]
            dx, dy, kind = x - cx[corner], y - cy[corner], kinds[corner]
            to_seen[i] = cost_of(x, y, cx[corner], cy[corner])
            # An end on the corner rules nothing out.
            is_on = dx == 0.0 and dy == 0.0
            may_follow[i] = np.int64(-1) if is_on else follow[kind, class_of(kind, dx, dy)]
        seeds = seen, to_seen, may_follow
        nodes, costs, n, heap = climb(hierarchy, seeds, (records, heap), nodes, costs, n)
        offset[k + 1] = n
    return offset, nodes[:n], costs[:n]


@guarded
@njit(cache=True, nogil=True)
def straight_costs(mesh, starts, goals, table):
    """Set the entries of a table whose ends see each other to the costs of straight lines.

    `mesh`, `starts`: see `views_of_points`; `goals`: float64 (m, 2) points; int64 (p + 1,)
    and int32, the goals in each polygon; `table`: int64 (n, m) costs in `UNITS`; changed.
    """
    points, offset, listed = starts
    to_points, begin, members = goals
    is_seen, room = np.zeros(len(to_points), np.bool_), view_room(_ROOM)
    target = Targets(begin, members, to_points, is_seen)
    for k in range(len(points)):
        y, x = points[k, 0], points[k, 1]
        _, room = _seen(mesh, starts, k, target, room)
        for polygon in listed[offset[k] : offset[k + 1]]:
            is_seen[members[begin[polygon] : begin[polygon + 1]]] = True
        for goal in np.flatnonzero(is_seen):
            table[k, goal] = cost_of(x, y, to_points[goal, 1], to_points[goal, 0])
        is_seen[:] = False


@guarded
@njit(cache=True, nogil=True)
def costs_to_corners(mesh, edges, point, view, work):
    """Search all corners from a point, on a graph that is not contracted; return the heap.

    `mesh`: a `Mesh`; `edges`: int64 (2 n + 1,) and int32 (m,) of `edges_of`; `point`:
    float64 (2,), (row, col); `view`: int32 corners that the point sees, int64 costs to them;
    `work`: int64 (n,) costs (`FAR`), filled in; int32 (n,) corners before; int64 heap.
    """
    cx, cy, kinds = mesh.x, mesh.y, mesh.kinds
    first, heads = edges
    costs, came, heap = work
    size = 0
    for k in range(len(view[0])):
        corner = view[0][k]
        if view[1][k] < costs[corner]:
            costs[corner], came[corner] = view[1][k], -1
            if size == len(heap):
                heap = grow_rows(heap)
            push(heap, size, costs[corner], np.int64(corner))
            size += 1
    while size > 0:
        cost, here = heap[0, 0], heap[0, 1]
        pop(heap, size)
        size -= 1
        if cost != costs[here]:
            continue
        x, y, kind, before = cx[here], cy[here], kinds[here], came[here]
        px, py = (point[1], point[0]) if before < 0 else (cx[before], cy[before])
        dx, dy = x - px, y - py
        # The blocked cell lies on the left of the path here, or on the right; a point on the corner
        # rules nothing out.
        is_on = dx == 0.0 and dy == 0.0
        hand = dx * (1.0 if kind & 2 else -1.0) - dy * (1.0 if kind & 1 else -1.0)
        at = 2 * here + (0 if is_on else lobe_of(kind, dx, dy))
        for other in heads[first[at] : first[at + (2 if is_on else 1)]]:
            if turn_of(px, py, x, y, cx[other], cy[other]) * hand < 0.0:
                continue
            further = cost + cost_of(x, y, cx[other], cy[other])
            if further < costs[other]:
                costs[other], came[other] = further, here
                if size == len(heap):
                    heap = grow_rows(heap)
                push(heap, size, further, np.int64(other))
                size += 1
    return heap
