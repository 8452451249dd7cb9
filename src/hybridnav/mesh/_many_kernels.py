"""Kernel of many queries on a mesh, one after the other."""

from __future__ import annotations

from hybridnav._jit import guarded, njit
from hybridnav.mesh._corner_search_kernels import query_corners
from hybridnav.mesh._hierarchy_search_kernels import query_hierarchy
from hybridnav.mesh._polyanya_kernels import DONE, LOWER, NO_ROOM, UPPER
from hybridnav.mesh._query_kernels import query

FULL = 3
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
        The query to resume, positions written, and `DONE`, `NO_ROOM` or `FULL`.
    """
    for k in range(begin, len(asked[0])):
        where, points = _query_of(asked, k)
        status, way = query(mesh, blocks[0], blocks[1], place[1], where, points, work, effort)
        if status == NO_ROOM or not _kept(answers, k, n, way, bounds):
            return k, n, NO_ROOM if status == NO_ROOM else FULL  # and found once more
        n += len(way)
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
        status, way = query_corners(mesh, graph, found, points, work, effort)
        if status == NO_ROOM or not _kept(answers, k, n, way, bounds):
            return k, n, NO_ROOM if status == NO_ROOM else FULL  # and found once more
        n += len(way)
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
        status, way = query_hierarchy(mesh, hierarchy, found, points, work, effort)
        if status == NO_ROOM or not _kept(answers, k, n, way, bounds):
            return k, n, NO_ROOM if status == NO_ROOM else FULL  # and found once more
        n += len(way)
    return len(asked[0]), n, DONE


@njit(cache=True, nogil=True)
def _query_of(asked, k):
    """Return the cells and the ends of one query, four numbers each, from those of all."""
    cells, ends = asked
    where = cells[k, 0], cells[k, 1], cells[k, 2], cells[k, 3]
    return where, (ends[k, 0], ends[k, 1], ends[k, 2], ends[k, 3])


@njit(cache=True, nogil=True)
def _kept(answers, k, n, way, bounds):
    """Write an answer if there is room for its path, and return whether there was.

    `answers` are float64 (q,) lengths, float64 (q,) bounds, int64 (q + 1,) offsets of the positions
    of each path, float64 (room, 2) positions.
    """
    lengths, least, starts, positions = answers
    if n + len(way) > len(positions):
        return False
    lengths[k], least[k] = bounds[UPPER], bounds[LOWER]
    positions[n : n + len(way)] = way
    starts[k], starts[k + 1] = n, n + len(way)
    return True
