"""Kernels of the graph of corners: its edges, and distances in it from landmarks."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow
from hybridnav.search.mesh.kernels.polyanya import pop, push
from hybridnav.search.mesh.kernels.state import Heap, Target, Targets
from hybridnav.search.mesh.kernels.views import distance, see_quadrant, view_room, walls_at


@guarded
@njit(cache=True, nogil=True)
def edges_of(mesh, limit):
    """Find the edges of the graph.

    An edge joins two corners that see each other, and at both of which a path along the segment
    between them may bend.

    `mesh`: a `Mesh`; `limit`: most edges. Returns int64 (2 n + 1,) first edge of each corner and
    quadrant, see `lobe_of`; int32 (m,) the corner at which each edge ends. Each edge occurs in both
    directions. If there are more edges than the limit, the last entry of the first array is -1.
    """
    kinds = mesh.kinds
    n = len(kinds)
    wall = walls_at(mesh)
    room = view_room(1024)
    nowhere = Target(0.0, 0.0, np.empty(0, np.int32))
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
            heads[m : m + found] = room.seen[:found]
            m += found
            first[2 * corner + lobe + 1] = m
    return first, heads[:m].copy()


@guarded
@njit(cache=True, nogil=True)
def landmarks_of(mesh, graph, source, table):
    """Compute the distances of all corners from landmarks, in free space.

    Those in the graph are longer where a shortest path leaves the landmark, or arrives, in the
    quadrant opposite to the blocked cell.

    `mesh`: a `Mesh`; `graph`: that of `edges_of`; `source`: the first landmark: the others are in
    the same part of the graph, each the corner farthest from those before; `table`: float64 (n,
    landmarks), filled in.
    """
    cx, cy, kinds, first = mesh.x, mesh.y, mesh.kinds, mesh.first
    (offsets, heads), (n, number) = graph, table.shape
    wall = walls_at(mesh)
    room = view_room(1024)
    heap = Heap(np.empty(n), np.empty(n, np.int32))
    arrived, nearest = np.empty((number, n)), np.full(n, np.inf)
    points = np.stack((cy, cx), axis=1)
    landmark = source
    for k in range(number):
        # One row for each landmark while they are found.
        distances = arrived[k]
        distances[:] = np.inf
        # The first segment may leave in the third quadrant, for any corner that is seen there.
        is_seen = np.zeros(n, np.bool_)
        sight = Targets(first, mesh.begins, points, is_seen)
        _, room = see_quadrant(mesh, landmark, wall[landmark], 2, sight, room)
        # Corners of a polygon round the landmark are seen because it is convex, itself too.
        slot = wall[landmark]
        while slot >= 0:
            polygon = mesh.polygon_of[slot]
            low, high = first[polygon], first[polygon + 1]
            is_seen[mesh.begins[low:high]] = True
            slot = mesh.twins[slot - 1 if slot > low else high - 1]
        size = 0
        for other in range(n):
            if is_seen[other] and kinds[other] < 4:
                distances[other] = distance(cx[landmark], cy[landmark], cx[other], cy[other])
                size = push(heap, size, distances[other], other)
        # Farther corners are reached along the edges, from the nearest one on.
        while size:
            here, cost = heap.values[0], heap.keys[0]
            size = pop(heap, size)
            if cost > distances[here]:
                continue
            low, high = offsets[2 * here], offsets[2 * here + 2]
            while size + high - low > len(heap.keys):
                heap = Heap(grow(heap.keys), grow(heap.values))
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
    nowhere = Target(0.0, 0.0, np.empty(0, np.int32))
    for corner in range(n):
        if kinds[corner] >= 4 or wall[corner] < 0:
            continue
        found, room = see_quadrant(mesh, corner, wall[corner], 2, nowhere, room)
        for other in room.seen[:found]:
            further = distance(cx[corner], cy[corner], cx[other], cy[other])
            for k in range(number):
                table[corner, k] = min(table[corner, k], before[other, k] + further)
