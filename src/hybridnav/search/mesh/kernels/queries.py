"""Kernels of queries on a mesh, one or many: by intervals, or by a graph of its corners."""

import numpy as np

from hybridnav._base.jit import guarded, njit, overload
from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.kernels.places import fixed, fixed_rows, room, room_rows
from hybridnav.search.mesh.kernels.corner_search import query_corners
from hybridnav.search.mesh.kernels.hierarchy_search import query_hierarchy
from hybridnav.search.mesh.kernels.polyanya import query_intervals
from hybridnav.search.mesh.kernels.state import (
    DONE,
    LOWER,
    UPPER,
    WORK_FULL,
    Corners,
    Ends,
    Hierarchy,
    HierarchyWork,
    Mesh,
    MeshBlocks,
    ViewRoom,
)

_QUERIES = {MeshBlocks: query_intervals, Corners: query_corners, Hierarchy: query_hierarchy}
"""The kernel of one query on each kind of graph."""


def query(mesh, graph, cells, endpoints, work, effort):
    """Answer one query, or resume the search; see `query_intervals`."""
    return _QUERIES[type(graph)](mesh, graph, cells, endpoints, work, effort)


@overload(query)
def _query_of_class(mesh, graph, cells, endpoints, work, effort):  # noqa: ARG001 - numba's rule
    kernel = _QUERIES[graph.instance_class]

    def by_class(mesh, graph, cells, endpoints, work, effort):
        return kernel(mesh, graph, cells, endpoints, work, effort)

    return by_class


@njit(cache=True, nogil=True)
def into_cell(low, at):
    """Round a coordinate to the grain of exact tests, and move it into a cell."""
    return min(max(np.rint(at * GRAIN) / GRAIN, float(low)), low + 1.0)


@guarded
@njit(cache=True, nogil=True)
def answer(mesh, polygon_at, graph, cells, positions, work, effort):
    """Answer one query on any graph, or resume the search.

    Returns status and path as `query_intervals`, the length and the lower bound.

    Parameters
    ----------
    mesh
        A `Mesh`.
    polygon_at
        See `ConvexMesh.polygon_at`.
    graph, work
        One of `_QUERIES`, and its work.
    cells
        (row, col) of the cells of start and goal.
    positions
        Start and goal, (row, col), which are rounded and moved into the closed squares of these
        cells.
    effort
        The answer is good enough when it is at most this factor times the lower bound; the
        expansions at which to pause, below zero to end.
    """
    (row, col), (to_row, to_col) = cells
    (y, x), (to_y, to_x) = positions
    ends = polygon_at[row, col], polygon_at[to_row, to_col]
    where = Ends(row, col, to_row, to_col, ends[0], ends[1])
    points = into_cell(col, x), into_cell(row, y), into_cell(to_col, to_x), into_cell(to_row, to_y)
    status, path = query(mesh, graph, where, points, work, effort)
    return status, path, work.bounds[UPPER], work.bounds[LOWER]


@guarded
@njit(cache=True, nogil=True)
def answer_climbing(places, cells, positions, effort):
    """Answer one query on a hierarchy, or resume the search; see `answer`.

    `places`: `places_of` of a `Mesh`, `polygon_at`, a `Hierarchy` and its work.
    """
    mesh = Mesh(
        room(places, 0, np.float64),
        room(places, 1, np.float64),
        fixed(places, 2, np.uint8),
        fixed(places, 3, np.int32),
        fixed(places, 4, np.int32),
        room(places, 5, np.int32),
        fixed(places, 6, np.int32),
        fixed(places, 7, np.int32),
        fixed(places, 8, np.int32),
        fixed(places, 9, np.int32),
    )
    graph = Hierarchy(
        fixed(places, 11, np.int32),
        fixed_rows(places, 12, np.int64),
        fixed(places, 13, np.int64),
        fixed_rows(places, 14, np.int64),
    )
    views = ViewRoom(
        room_rows(places, 19, np.int32),
        room_rows(places, 20, np.float64),
        room(places, 21, np.int32),
    )
    work = HierarchyWork(
        room(places, 15, np.int32),
        room(places, 16, np.int32),
        room(places, 17, np.int64),
        room(places, 18, np.float64),
        views,
        room_rows(places, 22, np.int64),
        room(places, 23, np.int32),
        room_rows(places, 24, np.int64),
        room_rows(places, 25, np.int64),
    )
    polygon_at = fixed_rows(places, 10, np.int32)
    return answer(mesh, polygon_at, graph, cells, positions, work, effort)


ANSWERS_FULL = 3
"""Status of a run that ends because there are more positions than room."""


@guarded
@njit(cache=True, nogil=True)
def many(mesh, polygon_at, graph, asked, work, effort, answers, begin, n):
    """Answer queries from `begin` on, until all are answered or there is no room.

    Returns the query to resume, positions written, and `DONE`, `WORK_FULL` or `ANSWERS_FULL`.

    Parameters
    ----------
    mesh, polygon_at, graph, work, effort
        See `answer`.
    asked
        int64 (q, 4) cells and float64 (q, 4) ends of all queries, as in `query_intervals`.
    answers
        float64 (q,) lengths, float64 (q,) bounds, int64 (q + 1,) offsets of the positions of each
        path, float64 (room, 2) positions.
    begin
        The first query, or the one to resume.
    n
        Positions written.
    """
    cells, endpoints = asked
    lengths, least, starts, positions = answers
    for k in range(begin, len(cells)):
        row, col, to_row, to_col = cells[k]
        ends = polygon_at[row, col], polygon_at[to_row, to_col]
        where = Ends(row, col, to_row, to_col, ends[0], ends[1])
        points = endpoints[k, 0], endpoints[k, 1], endpoints[k, 2], endpoints[k, 3]
        status, path = query(mesh, graph, where, points, work, effort)
        if status == WORK_FULL:
            return k, n, WORK_FULL
        end = n + len(path)
        if end > len(positions):
            return k, n, ANSWERS_FULL  # and found once more
        lengths[k], least[k] = work.bounds[UPPER], work.bounds[LOWER]
        positions[n:end] = path
        starts[k], starts[k + 1] = n, end
        n = end
    return len(cells), n, DONE
