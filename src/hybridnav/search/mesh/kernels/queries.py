"""Kernels of one query on a mesh: the polygons of its endpoints, the search, and its clean-up."""

import numpy as np
from numba import types
from numba.extending import overload

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push
from hybridnav._base.moves import FAR
from hybridnav._base.trig import hypot
from hybridnav.search.contraction import NO_ARC, corners_between
from hybridnav.search.mesh.kernels.blocks import open_blocks
from hybridnav.search.mesh.kernels.corner_search import look, query_corners
from hybridnav.search.mesh.kernels.intervals import APART, MET, polygons_of_endpoints
from hybridnav.search.mesh.kernels.polyanya import (
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
    advance,
    into_cell,
    path_through,
    path_to,
    seed,
)
from hybridnav.search.mesh.kernels.views import UNITS, class_of, cost_of, distance

_OPENED, _SEEDED = 1, 2
"""Stages of a query: its blocks are opened; its first nodes are written."""


@guarded
@njit(cache=True, nogil=True)
def query(mesh, blocks, tree, polygon_at, cells, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    Parameters
    ----------
    mesh, endpoints
        See `successors`.
    blocks
        int32 (s,), the block of each slot.
    tree
        Head and depth of blocks, component of polygons; see `blocks_of`.
    polygon_at
        int32 (rows, cols), the polygon at the centre of each cell.
    cells
        Row and column of the start's cell, then of the goal's; free ones.
    work
        Arrays of one query: room for the polygons of the endpoints, blocks that may be entered,
        those marked, and the work of `seed`.
    effort
        Length of the best path known before, and `factor` and `limit` of `advance`; a limit below
        zero ends the query.

    Returns
    -------
    tuple
        `DONE`, `PAUSED` or `WORK_FULL`; when done the path, float64 (n, 2) as (row, col), without
        rows if the search found no path better than its initial bound.
    """
    block_head, block_up, component, depth = tree
    starts, goals, is_open, marked, nodes = work
    counts, bounds = nodes[6], nodes[7]
    upper, factor, limit = effort
    none = np.empty((0, 2))

    # Not begun. Endpoints in different components or in one polygon need no search, and leave
    # nothing to clean up.
    if not counts[BEGUN]:
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = upper, 0.0
        how, counts[STARTS], counts[GOALS] = polygons_of_endpoints(
            mesh, component, polygon_at, cells, endpoints, starts, goals
        )
        if how == APART:
            bounds[:] = np.inf
            return DONE, none
        if how == MET:
            bounds[:] = hypot(endpoints[2] - endpoints[0], endpoints[3] - endpoints[1])
            return DONE, path_to(mesh, endpoints, nodes[0], -1)

        # A shortest path stays in the blocks between its endpoints (see `open_blocks`). An endpoint
        # on a side lies in several polygons: the blocks of all pairs are opened.
        n = 0
        for start in starts[: counts[STARTS]]:
            for goal in goals[: counts[GOALS]]:
                n = open_blocks(block_head, block_up, depth, start, goal, is_open, marked, n)
        counts[MARKED] = n
        counts[BEGUN] = _OPENED
    entered = (blocks, is_open)
    status = DONE

    # Opened. Without room for the first nodes the stage stays, and the next call writes them anew.
    if counts[BEGUN] == _OPENED:
        status = seed(mesh, entered, endpoints, starts[: counts[STARTS]], nodes)
        if status == DONE:
            counts[BEGUN] = _SEEDED

    # Seeded. Each call resumes the search; the stage stays until the answer is good enough.
    if status == DONE and limit >= 0:
        status = advance(mesh, entered, endpoints, goals[: counts[GOALS]], nodes, factor, limit)
    if status != DONE:
        return status, none

    # Done. Only what the query touched is reset, so its cost does not depend on the size of the
    # mesh.
    best, touched = nodes[4], nodes[5]
    for k in range(counts[TOUCHED]):
        best[touched[k]] = np.inf
    for k in range(counts[MARKED]):
        is_open[marked[k]] = False
    counts[BEGUN] = 0
    if counts[LAST] < 0:
        return DONE, none
    return DONE, path_to(mesh, endpoints, nodes[0], counts[LAST])


@guarded
@njit(cache=True, nogil=True)
def answer(mesh, graph, place, ends, work, effort):
    """Answer one query on any graph, or resume the search.

    `mesh`, `graph`, `place`: see `many`; `ends`: row and column of the cells of start and goal, and
    x and y of both, which are rounded and moved into the closed squares of these cells; `work`:
    arrays of one query, see the kernel of one query on such a graph; its counts and bounds;
    `effort`: see `query`. Result: status and path of `query`, the length and the lower bound, and
    what was expanded.
    """
    (row, col, to_row, to_col), (x, y, to_x, to_y) = ends
    points = into_cell(col, x), into_cell(row, y), into_cell(to_col, to_x), into_cell(to_row, to_y)
    arrays, (counts, bounds) = work
    status, path = _answer(mesh, graph, place, ends[0], points, arrays, effort)
    return status, path, bounds[UPPER], bounds[LOWER], counts[EXPANDED]


# Kernel of many queries on a mesh, one after the other.

ANSWERS_FULL = 3
"""Status of a run that ends because there are more positions than room."""


@guarded
@njit(cache=True, nogil=True)
def many(mesh, graph, place, asked, work, bounds, effort, answers, begin, n):
    """Answer queries from `begin` on, until all are answered or there is no room.

    Parameters
    ----------
    mesh
        See `successors`.
    graph
        Arrays of a `CornerGraph` or a `CornerHierarchy`; for a search of intervals the block of
        each slot, and the tree of `query`.
    place
        Component of polygons, and the polygon of each cell.
    asked
        int64 (q, 4) cells and float64 (q, 4) ends of all queries, as in `query`.
    work, effort
        See the kernel of one query on such a graph.
    bounds
        The last array of `work`.
    answers
        float64 (q,) lengths, float64 (q,) bounds, int64 (q + 1,) offsets of the positions of each
        path, float64 (room, 2) positions.
    begin
        The first query, or the one to resume.
    n
        Positions written.

    Returns
    -------
    tuple
        The query to resume, positions written, and `DONE`, `WORK_FULL` or `ANSWERS_FULL`.
    """
    cells, endpoints = asked
    lengths, least, starts, positions = answers
    for k in range(begin, len(cells)):
        where = cells[k, 0], cells[k, 1], cells[k, 2], cells[k, 3]
        points = endpoints[k, 0], endpoints[k, 1], endpoints[k, 2], endpoints[k, 3]
        status, path = _answer(mesh, graph, place, where, points, work, effort)
        if status == WORK_FULL:
            return k, n, WORK_FULL
        end = n + len(path)
        if end > len(positions):
            return k, n, ANSWERS_FULL  # and found once more
        lengths[k], least[k] = bounds[UPPER], bounds[LOWER]
        positions[n:end] = path
        starts[k], starts[k + 1] = n, end
        n = end
    return len(cells), n, DONE


def _answer(mesh, graph, place, where, points, work, effort):
    """Answer one query by the kernel for its kind of graph, as Python does without the compiler."""
    if isinstance(graph[1], tuple):
        return query(mesh, graph[0], graph[1], place[1], where, points, work, effort)
    kernel = query_corners if len(graph) == 3 else query_hierarchy
    return kernel(mesh, graph, (place[0], place[1], where), points, work, effort)


@overload(_answer)
def _answer_of_kind(mesh, graph, place, where, points, work, effort):  # noqa: ARG001 - numba's rule
    """Return what is compiled for `_answer`, as numba asks for it: by the types of the arrays."""

    def by_intervals(mesh, graph, place, where, points, work, effort):
        return query(mesh, graph[0], graph[1], place[1], where, points, work, effort)

    def by_corners(mesh, graph, place, where, points, work, effort):
        return query_corners(mesh, graph, (place[0], place[1], where), points, work, effort)

    def by_hierarchy(mesh, graph, place, where, points, work, effort):
        return query_hierarchy(mesh, graph, (place[0], place[1], where), points, work, effort)

    if isinstance(graph[1], types.BaseTuple):
        return by_intervals
    return by_corners if len(graph) == 3 else by_hierarchy


# Kernels of the search of the hierarchy of corners: shortest any-angle paths.
#
# R. Geisberger, P. Sanders, D. Schultes, D. Delling: Contraction hierarchies, 2008. A* runs from
# both ends, up to corners contracted later. A corner that both directions reach completes a path,
# and entries that are not better by their straight distance are pruned.


@guarded
@njit(cache=True, nogil=True)
def query_hierarchy(mesh, hierarchy, where, endpoints, work, effort):
    """Find a shortest path between two points, or resume the search.

    `mesh`, `endpoints`: see `successors`; `hierarchy`: results of `contract` and
    `classes_that_follow`; `where`: see `look`; `work`: arrays of one query: room for the polygons
    of the endpoints; room of `see_from_point`; records of corners, int64 (n, 4), costs from the
    start and from the goal (`FAR`), and the tail and arc by which each was reached; corners
    touched; two heaps; counts and bounds; `effort`: see `query`. Result: see `query`.
    """
    starts, goals, room, records, touched, heaps, counts, bounds = work
    upper, factor, limit = effort
    path = np.empty((0, 2))
    if not counts[BEGUN]:  # a query that was paused goes on
        counts[:] = 0
        counts[LAST] = -1
        bounds[UPPER], bounds[LOWER] = upper, 0.0
        status, n, n_all = look(mesh, where, endpoints, (starts, goals, room), bounds)
        if n_all > len(heaps[0]):
            status = WORK_FULL
        if status == WORK_FULL:
            return WORK_FULL, path
        if status == DONE:
            return DONE, path if bounds[UPPER] == np.inf else path_through(
                mesh, endpoints, touched[:0]
            )
        counts[SIZE] = _seed(mesh, endpoints, room[2][n:n_all], 0, work)
        counts[MARKED] = _seed(mesh, endpoints, room[2][:n], 1, work)
        counts[BEGUN] = 1
    # Both sides climb until no queued corner can be part of a shorter path.
    if limit >= 0:
        status = _advance(mesh, hierarchy, endpoints, work, factor, limit)
        if status != DONE:
            return status, path
    # The path, and its length from its points, which the sums of a search only come near.
    if counts[LAST] >= 0:
        nodes = corners_between((hierarchy[0], hierarchy[2]), counts[LAST], records)
        path = path_through(mesh, endpoints, nodes)
        is_proved = bounds[LOWER] >= bounds[UPPER]
        bounds[UPPER] = 0.0
        for k in range(len(path) - 1):
            bounds[UPPER] += distance(path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1])
        if is_proved:  # no other path is shorter
            bounds[LOWER] = bounds[UPPER]
    for corner in touched[: counts[TOUCHED]]:
        records[corner, 0] = records[corner, 1] = FAR
    counts[BEGUN] = 0  # the next query begins anew
    return DONE, path


@njit(cache=True, nogil=True)
def _seed(mesh, endpoints, seen, direction, work):
    """Reach the corners that an end sees, on its side, and return the number queued."""
    cx, cy = mesh[0], mesh[1]
    _, _, _, records, touched, heaps, counts, _ = work
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
        push(heaps[direction], size, cost + left, np.int64(corner))
        size += 1
    return size


@njit(cache=True, nogil=True)
def _advance(mesh, hierarchy, endpoints, work, factor, limit):
    """Search until the answer is good enough or enough corners are expanded; see `advance`."""
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    first, arcs, _, follow = hierarchy
    _, _, _, records, touched, heaps, counts, bounds = work
    sx, sy, tx, ty = endpoints
    to_start, to_goal, n_touched = counts[SIZE], counts[MARKED], counts[TOUCHED]

    # The cost to beat, in units: of the best path so far, or of the one known before the search.
    best = FAR if bounds[UPPER] * UNITS >= FAR else np.int64(bounds[UPPER] * UNITS)
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
