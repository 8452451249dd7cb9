"""Kernel of many queries on a mesh, one after the other."""

from __future__ import annotations

from hybridnav._jit import guarded, njit
from hybridnav.mesh._corner_search_kernels import query_corners
from hybridnav.mesh._hierarchy_search_kernels import query_hierarchy
from hybridnav.mesh._polyanya_kernels import DONE, LOWER, UPPER, WORK_FULL
from hybridnav.mesh._query_kernels import query

ANSWERS_FULL = 3
"""Status of a run that ends because there are more positions than room."""


@guarded
@njit(cache=True, nogil=True)
def many_by_intervals(mesh, blocks, place, asked, work, bounds, effort, answers, begin, n):
    """Answer queries from `begin` on by `query`, until all are answered or there is no room.

    Parameters
    ----------
    mesh
        See `successors`.
    blocks
        Block of each slot, and the tree; see `query`.
    place
        Component of polygons, and the polygon of each cell.
    asked
        int64 (q, 4) cells and float64 (q, 4) ends of all queries, as in `query`.
    work, effort
        See `query`.
    bounds
        The last array of `work`.
    answers
        See `_kept`.
    begin
        The first query, or the one to resume.
    n
        Positions written.

    Returns
    -------
    tuple
        The query to resume, positions written, and `DONE`, `WORK_FULL` or `ANSWERS_FULL`.
    """
    for k in range(begin, len(asked[0])):
        where, points = _query_of(asked, k)
        status, path = query(mesh, blocks[0], blocks[1], place[1], where, points, work, effort)
        if status == WORK_FULL or not _kept(answers, k, n, path, bounds):
            return k, n, WORK_FULL if status == WORK_FULL else ANSWERS_FULL  # and found once more
        n += len(path)
    return len(asked[0]), n, DONE


@guarded
@njit(cache=True, nogil=True)
def many_by_corners(mesh, graph, place, asked, work, bounds, effort, answers, begin, n):
    """Answer queries from `begin` on by `query_corners`; return as `many_by_intervals` does.

    Parameters
    ----------
    mesh, place, asked, work, bounds, effort, answers, begin, n
        See `many_by_intervals`.
    graph
        See `query_corners`.
    """
    for k in range(begin, len(asked[0])):
        where, points = _query_of(asked, k)
        found = (place[0], place[1], where)
        status, path = query_corners(mesh, graph, found, points, work, effort)
        if status == WORK_FULL or not _kept(answers, k, n, path, bounds):
            return k, n, WORK_FULL if status == WORK_FULL else ANSWERS_FULL  # and found once more
        n += len(path)
    return len(asked[0]), n, DONE


@guarded
@njit(cache=True, nogil=True)
def many_by_hierarchy(mesh, hierarchy, place, asked, work, bounds, effort, answers, begin, n):
    """Answer queries from `begin` on by `query_hierarchy`; return as `many_by_intervals` does.

    Parameters
    ----------
    mesh, place, asked, work, bounds, effort, answers, begin, n
        See `many_by_intervals`.
    hierarchy
        See `query_hierarchy`.
    """
    for k in range(begin, len(asked[0])):
        where, points = _query_of(asked, k)
        found = (place[0], place[1], where)
        status, path = query_hierarchy(mesh, hierarchy, found, points, work, effort)
        if status == WORK_FULL or not _kept(answers, k, n, path, bounds):
            return k, n, WORK_FULL if status == WORK_FULL else ANSWERS_FULL  # and found once more
        n += len(path)
    return len(asked[0]), n, DONE


@njit(cache=True, nogil=True)
def _query_of(asked, k):
    """Return the cells and the endpoints of one query, four numbers each, from those of all."""
    cells, endpoints = asked
    where = cells[k, 0], cells[k, 1], cells[k, 2], cells[k, 3]
    return where, (endpoints[k, 0], endpoints[k, 1], endpoints[k, 2], endpoints[k, 3])


@njit(cache=True, nogil=True)
def _kept(answers, k, n, path, bounds):
    """Write an answer if there is room for its path, and return whether there was.

    `answers` are float64 (q,) lengths, float64 (q,) bounds, int64 (q + 1,) offsets of the positions
    of each path, float64 (room, 2) positions.
    """
    lengths, least, starts, positions = answers
    if n + len(path) > len(positions):
        return False
    lengths[k], least[k] = bounds[UPPER], bounds[LOWER]
    positions[n : n + len(path)] = path
    starts[k], starts[k + 1] = n, n + len(path)
    return True
