"""Kernel of many queries on a mesh, one after the other."""

from __future__ import annotations

from numba import types
from numba.extending import overload

from hybridnav._jit import guarded, njit
from hybridnav.mesh._corner_search_kernels import query_corners
from hybridnav.mesh._hierarchy_search_kernels import query_hierarchy
from hybridnav.mesh._polyanya_kernels import DONE, LOWER, UPPER, WORK_FULL
from hybridnav.mesh._query_kernels import query

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
    """Answer one query by the kernel for its kind of graph, which the types of arrays tell."""


@overload(_answer)
def _answer_of_kind(mesh, graph, place, where, points, work, effort):  # noqa: ARG001 - numba's rule
    """Return what stands for `_answer`, as numba asks for it: a function with equal arguments."""

    def by_intervals(mesh, graph, place, where, points, work, effort):
        return query(mesh, graph[0], graph[1], place[1], where, points, work, effort)

    def by_corners(mesh, graph, place, where, points, work, effort):
        return query_corners(mesh, graph, (place[0], place[1], where), points, work, effort)

    def by_hierarchy(mesh, graph, place, where, points, work, effort):
        return query_hierarchy(mesh, graph, (place[0], place[1], where), points, work, effort)

    if isinstance(graph[1], types.BaseTuple):
        return by_intervals
    return by_corners if len(graph) == 3 else by_hierarchy
