"""Shortest any-angle paths between many pairs of points on a mesh, on all cores."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.threads import SHARES, cores
from hybridnav.search.mesh.kernels.queries import ANSWERS_FULL, many
from hybridnav.search.mesh.kernels.state import WORK_FULL
from hybridnav.search.mesh.search import NO_LIMIT, SURE, MeshSearch, doubled, rounded_into

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray, LongArray


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
    effort, asked = (1.0 + epsilon, NO_LIMIT), (where, endpoints)
    graph, works = search.engine
    at = n = 0
    work, places = works.take()
    while at < count:
        found = (length, bound, starts, positions), at, n
        at, n, short = many(
            search.arrays, search.mesh.polygon_at, graph, asked, work, effort, *found
        )
        if short == WORK_FULL:
            work, places = doubled(work), None
        elif short == ANSWERS_FULL:
            positions = np.concatenate([positions, np.empty_like(positions)])
    works.give((work, places))
    bound = np.where(bound >= length, length, bound * SURE)
    return MeshPaths(length, bound, starts, positions[:n])
