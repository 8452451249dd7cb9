"""Kernels of the graph of corners: its edges, and distances in it from landmarks."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.mesh._heap_kernels import pop, push
from hybridnav.mesh._view_kernels import distance, see_from_corner


@njit(cache=True, nogil=True)
def _doubled(array):
    """Return a copy with room for twice as many rows."""
    return np.concatenate((array, array))


@guarded
@njit(cache=True, nogil=True)
def edges_of(mesh, component, limit):
    """Find the edges of the graph.

    An edge joins two corners that see each other, and at both of which a path along the segment
    between them may bend.

    Parameters
    ----------
    mesh
        See `successors`.
    component
        int32 (p,), below 0 for polygons that were cut out.
    limit
        Most edges.

    Returns
    -------
    tuple
        int64 (2 n + 1,) first edge of each corner and quadrant, see `lobe_of`; int32 (m,) the
        corner at which each edge ends. Each edge occurs in both directions. If there are more edges
        than the limit, the last entry of the first array is -1.
    """
    kinds, begins, twins, polygon_of = mesh[2], mesh[4], mesh[6], mesh[7]
    n = len(kinds)
    wall = np.full(n, -1, np.int32)
    for slot in range(len(begins)):
        if twins[slot] < 0 and component[polygon_of[slot]] >= 0:
            wall[begins[slot]] = slot
    target = (0.0, 0.0, np.empty(0, np.int32))
    whole, real, seen = np.empty((1024, 2), np.int32), np.empty((1024, 4)), np.empty(1024, np.int32)
    first = np.zeros(2 * n + 1, np.int64)
    heads = np.empty(16 * n, np.int32)
    m = 0
    for corner in range(n):
        for lobe in range(2):
            found = 0
            while kinds[corner] < 4 and wall[corner] >= 0:
                room = (whole, real, seen)
                found = see_from_corner(mesh, corner, wall[corner], lobe, target, room, 0)
                if found >= 0:
                    break
                whole, real, seen = _doubled(whole), _doubled(real), _doubled(seen)
            if m + found > limit:
                first[2 * n] = -1
                return first, heads[:0].copy()
            while m + found > len(heads):
                heads = _doubled(heads)
            heads[m : m + found] = seen[:found]
            m += found
            first[2 * corner + lobe + 1] = m
    return first, heads[:m].copy()


@njit(cache=True, nogil=True)
def distances_from(points, graph, source, distances):
    """Compute the distances of all corners from one in the graph, infinite if not reached.

    Parameters
    ----------
    points
        float64 x and y of corners.
    graph
        The graph of `edges_of`.
    source
        The corner.
    distances
        float64 (n,), filled in.
    """
    cx, cy = points
    first, heads = graph
    heap = (np.empty(1024), np.empty(1024, np.int32))
    distances[:] = np.inf
    distances[source] = 0.0
    size = push(heap, 0, 0.0, source)
    while size:
        here, cost = heap[1][0], heap[0][0]
        size = pop(heap, size)
        if cost > distances[here]:
            continue
        low, high = first[2 * here], first[2 * here + 2]
        while size + high - low > len(heap[0]):
            heap = (_doubled(heap[0]), _doubled(heap[1]))
        for k in range(low, high):
            other = heads[k]
            reached = cost + distance(cx[here], cy[here], cx[other], cy[other])
            if reached < distances[other]:
                distances[other] = reached
                size = push(heap, size, reached, other)


@njit(cache=True, nogil=True)
def landmarks_of(points, graph, source, table):
    """Compute the distances of all corners from landmarks.

    The first landmark is a given corner, each other one the corner farthest from those before.

    Parameters
    ----------
    points, graph
        See `distances_from`.
    source
        The first landmark: the others are in the same part of the graph.
    table
        float64 (n, landmarks), filled in.
    """
    n, number = table.shape
    distances = np.empty(n)
    nearest = np.full(n, np.inf)
    landmark = source
    for k in range(number):
        distances_from(points, graph, landmark, distances)
        table[:, k] = distances
        far = 0.0
        for corner in range(n):
            nearest[corner] = min(nearest[corner], distances[corner])
            if far < nearest[corner] < np.inf:
                far, landmark = nearest[corner], corner
