"""Shortest octile paths on a jump-point graph, exact."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import FAR
from hybridnav._base.threads import Pool, cores
from hybridnav.search.octile.kernels import queries as kernels
from hybridnav.search.octile.kernels.legs import legs_that_follow

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray, LongArray
    from hybridnav.search.octile.build import JumpGraph

KERNEL = kernels.paths
"""The kernel whose compiled form shows that a search was run before."""

Cell = tuple[int, int]

_LEAST = 64
"""Least number of queries that justifies a thread."""


@dataclass(frozen=True, eq=False)
class JumpPath:
    """A shortest path between two cells; its cells are None if there is none."""

    cells: LongArray | None
    """int64 (n, 2), (row, col) of the cells passed."""
    length_cells: float
    """Length of the path, a + b sqrt 2 of its moves; infinite for none."""
    expanded: int
    """Corner cells that the search expanded."""


@dataclass(frozen=True, eq=False)
class JumpPaths:
    """Shortest paths between many pairs of cells, arrays of n."""

    length_cells: FloatArray
    """float64 (n,), infinite where there is no path."""
    path_start: LongArray
    """int64 (n + 1,), where the cells of each path begin."""
    cells: LongArray
    """int64 (c, 2), (row, col) of the cells passed."""
    expanded: LongArray
    """int64 (n,), corner cells that each search expanded."""


class _Work:
    """Work arrays of one query."""

    def __init__(self, n_corners: int, n_arcs: int) -> None:
        records = np.full((n_corners, 4), FAR, dtype=np.int64)
        # A corner cell is expanded at most once, so each arc is queued at most once.
        heaps = tuple(np.empty((n_corners + n_arcs + 1, 2), dtype=np.int64) for _ in range(2))
        touched, found = np.empty(n_corners, np.int64), np.empty(n_corners, np.int32)
        self.arrays = records, heaps, touched, found


@copies_alike
class JumpSearch:
    """Exact shortest octile paths over the free cells of a graph; threads may share it.

    Moves go to the 8 neighbours; a diagonal needs both side cells free (no corner cutting).

    Parameters
    ----------
    graph
        The graph of the map's free cells, contracted or not.

    Notes
    -----
    D. Harabor, T. Uras, P. Stuckey, S. Koenig: Regarding jump point search and subgoal graphs,
    2019.

    Examples
    --------
    >>> from hybridnav.search.octile import JumpSearch, build_jump_graph
    >>> search = JumpSearch(build_jump_graph(np.ones((3, 4), dtype=bool)))
    >>> search.path((0, 0), (2, 3)).length_cells
    3.8284271247461903
    """

    def __init__(self, graph: JumpGraph) -> None:
        self.graph = graph
        tables = graph.index, graph.ahead, graph.order, graph.shape[1]
        arcs = graph.first, graph.arcs
        self._arrays = tables, graph.places, graph.component, legs_that_follow(), arcs
        self._works = Pool(partial(_Work, graph.n_corners, len(graph.arcs)))

    def path(self, start: Cell, goal: Cell) -> JumpPath:
        """Find a shortest path between two free cells."""
        _, cells, counts = self._paths(np.array([[*start, *goal]], dtype=np.int64))
        straight, diagonal, expanded = counts[0].tolist()
        if straight < 0:
            return JumpPath(None, math.inf, expanded)
        return JumpPath(cells, straight + diagonal * math.sqrt(2.0), expanded)

    def many(self, starts: LongArray, goals: LongArray) -> JumpPaths:
        """Find shortest paths between many pairs of free cells, int64 (n, 2) each, on all cores."""
        endpoints = np.ascontiguousarray(np.hstack([starts, goals]).reshape(-1, 4), dtype=np.int64)
        n_parts = max(1, min(cores(), len(endpoints) // _LEAST))
        if n_parts == 1:
            found = [self._paths(endpoints)]
        else:
            with ThreadPoolExecutor(n_parts) as pool:
                found = list(pool.map(self._paths, np.array_split(endpoints, n_parts)))
        counts = np.concatenate([part[2] for part in found])
        length = counts[:, 0] + counts[:, 1] * math.sqrt(2.0)
        length[counts[:, 0] < 0] = np.inf
        sizes = np.concatenate([np.diff(part[0]) for part in found])
        path_start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        cells = np.concatenate([part[1] for part in found])
        return JumpPaths(length, path_start, cells, counts[:, 2])

    def _paths(self, endpoints: LongArray) -> tuple[Any, Any, Any]:
        """Return the offsets of the paths, their cells, and the moves and expansions of each."""
        with self._works.lent() as work:
            found: tuple[Any, Any, Any] = kernels.paths(
                self._arrays, self.graph.middles, self.graph.origin, endpoints, work.arrays
            )
        return found
