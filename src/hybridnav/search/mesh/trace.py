"""The intervals of a search of the mesh, to draw and count; and paths of many queries."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.threads import SHARES, cores
from hybridnav.search.mesh.kernels.intervals import G
from hybridnav.search.mesh.kernels.polyanya import WORK_FULL, N
from hybridnav.search.mesh.kernels.queries import ANSWERS_FULL, many
from hybridnav.search.mesh.search import (
    NO_LIMIT,
    SURE,
    Cell,
    MeshPath,
    MeshSearch,
    Position,
    round_into,
    rounded_into,
)

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.search.mesh.build import ConvexMesh


_LEFT, _RIGHT = 1, 2
"""Bits of a node: its interval reaches the left, the right corner of its side."""


@dataclass(frozen=True, eq=False)
class SearchTrace:
    """The intervals that a search of the mesh made, in order.

    An interval is a part of a side that is visible as a whole from one point, its root.
    """

    mesh: ConvexMesh
    path: MeshPath
    endpoints: FloatArray
    """float64 (2, 2), (row, col) of start and goal in grid units."""
    intervals: FloatArray
    """float64 (n, 2, 2), (row, col) of the left and the right end of each interval, as seen from
    its root."""
    roots: FloatArray
    """float64 (n, 2), (row, col) of each interval's root: the start, or the corner at which the
    path to the interval turns last."""
    costs_cells: FloatArray
    """float64 (n,), length of the path from the start to each root."""
    parents: IntArray
    """int32 (n,), the interval behind which each was found, -1 for the first ones."""


def trace_search(
    mesh: ConvexMesh, cells: tuple[Cell, Cell], positions: tuple[Position, Position]
) -> SearchTrace:
    """Search a shortest path as `MeshSearch.path` does, and keep the intervals.

    Parameters
    ----------
    mesh
        The mesh of the map's free space.
    cells
        The free cells (row, col) of start and goal.
    positions
        Start and goal, (row, col) in grid units, in the closed squares of these cells.

    Returns
    -------
    SearchTrace
        Without intervals if start and goal lie in one polygon or apart.

    Examples
    --------
    >>> from hybridnav.search.mesh import build_mesh, trace_search
    >>> free = np.array([[True, False, True], [True, True, True]])
    >>> trace = trace_search(build_mesh(free), ((0, 0), (0, 2)), ((0.5, 0.5), (0.5, 2.5)))
    >>> len(trace.intervals), round(trace.path.length_cells, 3)
    (2, 2.414)
    """
    endpoints = np.array([round_into(*end) for end in zip(cells, positions, strict=True)])
    path, whole, real = _nodes(mesh, cells, positions)
    slots, roots, parents, marks = whole.T
    # Nodes for the goal itself have no side.
    kept = slots >= 0
    number = np.append(np.cumsum(kept) - 1, -1)
    sides = _sides(mesh, slots[kept])
    at = mesh.corners[roots[kept]].astype(np.float64)
    at[roots[kept] < 0] = endpoints[0]
    return SearchTrace(
        mesh,
        path,
        endpoints,
        _seen(sides, at, marks[kept], real[kept]),
        at,
        real[kept, G],
        number[parents[kept]].astype(np.int32),
    )


def _nodes(
    mesh: ConvexMesh, cells: tuple[Cell, Cell], positions: tuple[Position, Position]
) -> tuple[MeshPath, IntArray, FloatArray]:
    """Return the path of a search, and its nodes; see the columns in `_interval_kernels`."""
    search = MeshSearch(mesh)
    path = search.path(cells, positions)
    # No other code has this search: it lends the arrays that the query has just returned.
    with search.works.lent() as work:
        n = work.counts[N]
        whole, real = work.nodes
        return path, whole[:n].copy(), real[:n].copy()


def _sides(mesh: ConvexMesh, slots: IntArray) -> FloatArray:
    """Return the corners of sides, float64 (n, 2, 2), the left one in the direction of passage
    first."""
    endpoints = np.stack([mesh.begins, mesh.finishes], axis=1)[slots]
    return mesh.corners[endpoints].astype(np.float64)


def _seen(sides: FloatArray, roots: FloatArray, marks: IntArray, real: FloatArray) -> FloatArray:
    """Return the parts of sides that are seen between two rays, (n, 2, 2)."""
    intervals = sides.copy()
    along = sides[:, 1] - sides[:, 0]
    off = sides[:, 0] - roots
    at_side = (sides == roots[:, None]).all(axis=2).any(axis=1)
    for end, bit, ray in ((0, _LEFT, real[:, 2:0:-1]), (1, _RIGHT, real[:, 4:2:-1])):
        cut = (marks >= 0) & (marks & bit == 0) & ~at_side
        direction = (ray - roots)[cut]
        side, start = along[cut], off[cut]
        share = _cross(start, direction) / _cross(direction, side)
        intervals[cut, end] = sides[cut, 0] + share.clip(0, 1)[:, None] * side
    return intervals


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


# Shortest any-angle paths between many pairs, on all cores.

_ROOM = 16
"""Initial room for positions, per path."""
_LEAST = 64
"""Least number of queries that justifies a thread."""
_MANY = 1000
"""Least number of queries that justifies the graph of corners."""


@dataclass(frozen=True, eq=False)
class MeshPaths:
    """The shortest paths of many queries, arrays of n."""

    length_cells: FloatArray
    """float64 (n,), infinite where there is no path."""
    lower_bound_cells: FloatArray
    """float64 (n,)."""
    path_start: LongArray
    """int64 (n + 1,), offsets of the positions of each path."""
    positions: FloatArray
    """float64 (m, 2), (row, col) in grid units, of all paths."""


def shortest_paths(
    search: MeshSearch,
    cells: tuple[LongArray, LongArray],
    positions: tuple[FloatArray, FloatArray],
    *,
    epsilon: float = 0.0,
) -> MeshPaths:
    """Find a shortest path for each of many pairs, as `MeshSearch.path` does.

    Parameters
    ----------
    search
        The search of the map.
    cells
        int64 (n, 2), the free cells (row, col) of the starts, and of the goals.
    positions
        float64 (n, 2), starts and goals, (row, col) in grid units, in the closed squares of these
        cells.
    epsilon
        As for `MeshSearch.path`.

    Returns
    -------
    MeshPaths
        The paths in the order of the pairs.

    Examples
    --------
    >>> from hybridnav.search.mesh import MeshSearch, build_mesh, shortest_paths
    >>> search = MeshSearch(build_mesh(np.ones((3, 4), dtype=bool)))
    >>> starts, goals = np.array([[0, 0], [0, 0]]), np.array([[0, 3], [2, 0]])
    >>> shortest_paths(search, (starts, goals), (starts + 0.5, goals + 0.5)).length_cells
    array([3., 2.])
    """
    where = np.concatenate(cells, axis=1)
    endpoints = np.concatenate(
        [rounded_into(*of) for of in zip(cells, positions, strict=True)], axis=1
    )
    endpoints = np.ascontiguousarray(endpoints[:, [1, 0, 3, 2]])
    n_parts = max(1, min(SHARES * cores(), len(where) // _LEAST))
    parts = np.array_split(np.arange(len(where)), n_parts)

    def answer(part: LongArray) -> MeshPaths:
        return _one_by_one(search, where[part], endpoints[part], epsilon)

    if len(where) >= _MANY:
        search.prepare()
    if n_parts == 1:
        return answer(parts[0])
    with ThreadPoolExecutor(cores()) as pool:
        found = list(pool.map(answer, parts))
    before = np.cumsum([0, *(len(of.positions) for of in found)])
    starts = [of.path_start[:-1] + base for of, base in zip(found, before, strict=False)]
    return MeshPaths(
        np.concatenate([of.length_cells for of in found]),
        np.concatenate([of.lower_bound_cells for of in found]),
        np.concatenate([*starts, before[-1:]]),
        np.concatenate([of.positions for of in found]),
    )


def _one_by_one(
    search: MeshSearch, where: LongArray, endpoints: FloatArray, epsilon: float
) -> MeshPaths:
    """Return the answers of one thread; arrays are doubled until they are large enough."""
    count = len(where)
    length, bound = np.empty(count), np.empty(count)
    starts = np.zeros(count + 1, dtype=np.int64)
    positions = np.empty((_ROOM * max(count, 4), 2))
    effort = math.inf, 1.0 + epsilon, NO_LIMIT
    graph, works = search.engine()
    place, asked = search.place, (where, endpoints)
    arrays: Any = search.blocks if graph is None else graph.arrays
    at = n = 0
    with works.lent() as work:
        while at < count:
            rest = place, asked, work.arrays, work.bounds, effort
            found = (length, bound, starts, positions), at, n
            at, n, short = many(search.arrays, arrays, *rest, *found)
            if short == WORK_FULL:
                work.make_room()
            elif short == ANSWERS_FULL:
                positions = np.concatenate([positions, np.empty_like(positions)])
    bound = np.where(bound >= length, length, bound * SURE)
    return MeshPaths(length, bound, starts, positions[:n])
