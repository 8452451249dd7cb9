"""Kernels of the search of the hierarchy of corners: shortest any-angle paths.

R. Geisberger, P. Sanders, D. Schultes, D. Delling: Contraction hierarchies, 2008. A* runs from both
ends, up to corners contracted later. A corner that both directions reach completes a path, and
entries that are not better by their straight distance are pruned.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push
from hybridnav._base.moves import FAR
from hybridnav.search.contraction import NO_ARC, corners_between
from hybridnav.search.mesh.kernels.polyanya import path_through
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
)
from hybridnav.search.mesh.kernels.views import UNITS, class_of, cost_of, distance, look


@guarded
@njit(cache=True, nogil=True)
def query_hierarchy(mesh, hierarchy, cells, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    `mesh`, `endpoints`: see `successors`; `hierarchy`: a `Hierarchy`; `cells`: see
    `polygons_of_endpoints`; `work`: a `HierarchyWork`; `effort`: see `answer`. Result: see
    `query_intervals`.
    """
    seen, counts, bounds = work.room.seen, work.counts, work.bounds
    factor, limit = effort
    path = np.empty((0, 2))
    if not counts[BEGUN]:  # a query that was paused goes on
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = np.inf, 0.0
        status, n, n_all = look(mesh, cells, endpoints, work)
        if n_all > len(work.from_start):
            status = WORK_FULL
        if status == WORK_FULL:
            return WORK_FULL, path
        if status == DONE:
            return DONE, path if bounds[UPPER] == np.inf else path_through(
                mesh, endpoints, work.touched[:0]
            )
        counts[SIZE] = _seed(mesh, endpoints, seen[n:n_all], 0, work)
        counts[MARKED] = _seed(mesh, endpoints, seen[:n], 1, work)
        counts[BEGUN] = 1
    # Both sides climb until no queued corner can be part of a shorter path.
    if limit >= 0:
        status = _advance(mesh, hierarchy, endpoints, work, factor, limit)
        if status != DONE:
            return status, path
    # The path, and its length from its points, which the sums of a search only come near.
    if counts[LAST] >= 0:
        arcs = hierarchy.first, hierarchy.middles
        nodes = corners_between(arcs, counts[LAST], work.records)
        path = path_through(mesh, endpoints, nodes)
        is_proved = bounds[LOWER] >= bounds[UPPER]
        bounds[UPPER] = 0.0
        for k in range(len(path) - 1):
            bounds[UPPER] += distance(path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1])
        if is_proved:  # no other path is shorter
            bounds[LOWER] = bounds[UPPER]
    for corner in work.touched[: counts[TOUCHED]]:
        work.records[corner, 0] = work.records[corner, 1] = FAR
    counts[BEGUN] = 0  # the next query begins anew
    return DONE, path


@njit(cache=True, nogil=True)
def _seed(mesh, endpoints, seen, direction, work):
    """Reach the corners that an end sees, on its side, and return the number queued."""
    cx, cy, records, touched = mesh.x, mesh.y, work.records, work.touched
    counts, heap = work.counts, work.from_goal if direction else work.from_start
    sx, sy, tx, ty = endpoints
    x, y, to_x, to_y = (tx, ty, sx, sy) if direction else (sx, sy, tx, ty)
    size = 0
    for corner in seen:
        if records[corner, direction] < FAR:
            continue
        if records[corner, 1 - direction] == FAR:
            touched[counts[TOUCHED]] = corner
            counts[TOUCHED] += 1
        cost = cost_of(x, y, cx[corner], cy[corner])
        records[corner, direction], records[corner, 2 + direction] = cost, NO_ARC
        left = cost_of(cx[corner], cy[corner], to_x, to_y)
        push(heap, size, cost + left, np.int64(corner))
        size += 1
    return size


@njit(cache=True, nogil=True)
def _advance(mesh, hierarchy, endpoints, work, factor, limit):
    """Search until the answer is good enough or enough corners are expanded; see `advance`."""
    # Arrays that loops use have names of their own: numba counts references to each field read.
    cx, cy, kinds, records = mesh.x, mesh.y, mesh.kinds, work.records
    first, arcs, follow = hierarchy.first, hierarchy.arcs, hierarchy.follow
    counts, bounds, touched = work.counts, work.bounds, work.touched
    heaps = work.from_start, work.from_goal
    sx, sy, tx, ty = endpoints
    to_start, to_goal, n_touched = counts[SIZE], counts[MARKED], counts[TOUCHED]

    # The cost to beat, in units: of the best path so far.
    best = np.int64(FAR)
    if counts[LAST] >= 0:
        best = records[counts[LAST], 0] + records[counts[LAST], 1]
    status = DONE
    while True:
        # A better path passes a waiting corner, at an estimate that is no higher than its cost.
        low_start = heaps[0][0, 0] if to_start > 0 else FAR
        low_goal = heaps[1][0, 0] if to_goal > 0 else FAR
        least = min(low_start, low_goal)
        if least == FAR or least * factor >= best:
            break

        # Only look at the entry: a run that ends here leaves it in the heap for the next run.
        direction = 0 if low_start <= low_goal else 1
        heap, size = heaps[direction], (to_goal if direction else to_start)
        node = heap[0, 1]
        low, high = np.int64(first[node]), np.int64(first[node + 1])
        if size + high - low > len(heap):
            status = WORK_FULL
            break
        if counts[EXPANDED] >= limit:
            status = PAUSED
            break
        pop(heap, size)
        size -= 1
        x, y, cost = cx[node], cy[node], records[node, direction]
        from_x, from_y, to_x, to_y = (tx, ty, sx, sy) if direction else (sx, sy, tx, ty)

        # An entry unlike its corner's record is out of date: a better one waits or was expanded.
        if least == cost + cost_of(x, y, to_x, to_y):
            counts[EXPANDED] += 1

            # A corner reached from both ends completes a path; `FAR` from one of them is none.
            if cost + records[node, 1 - direction] < best:
                best = cost + records[node, 1 - direction]
                counts[LAST] = node

            # Leave out arcs that bend away from the blocked cell. An arc of arrival states its
            # class here; an end on the corner rules nothing out.
            by, may_follow = records[node, 2 + direction], np.int64(-1)
            if by != NO_ARC:
                may_follow = follow[kinds[node] & 3, arcs[by & 0xFFFFFFFF, 1] & 63]
            elif from_x != x or from_y != y:
                may_follow = follow[kinds[node] & 3, class_of(kinds[node], from_x - x, from_y - y)]
            for arc in range(low, high):
                packed, further = arcs[arc, 1], cost + arcs[arc, 0]
                other = packed >> 12
                known = records[other, direction]
                if may_follow >> (packed >> 6 & 63) & 1 == 0 or known <= further:
                    continue
                estimate = further + cost_of(cx[other], cy[other], to_x, to_y)
                if estimate >= best:
                    continue

                # Noted once, by whichever direction comes first: the clean-up resets both.
                if known == FAR and records[other, 1 - direction] == FAR:
                    touched[n_touched] = other
                    n_touched += 1
                records[other, direction], records[other, 2 + direction] = further, node << 32 | arc
                push(heap, size, estimate, other)
                size += 1
        to_start, to_goal = (to_start, size) if direction else (size, to_goal)
    counts[SIZE], counts[MARKED], counts[TOUCHED] = to_start, to_goal, n_touched
    # A path that is not found yet passes a corner in one of the heaps.
    if counts[LAST] >= 0:
        bounds[UPPER] = best / UNITS
    bounds[LOWER] = max(bounds[LOWER], least / UNITS if least < best else bounds[UPPER])
    return status
