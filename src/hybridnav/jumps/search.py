"""Shortest octile paths on a jump-point graph, exact."""

from __future__ import annotations

import math
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.jumps import _query_kernels as kernels
from hybridnav.jumps._leg_kernels import FAR, legs_that_follow
from hybridnav.jumps.build import contract_graph
from hybridnav.search.pool import Pool

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._typing import FloatArray, IntArray, LongArray
    from hybridnav.jumps.build import JumpGraph, JumpHierarchy

Cell = tuple[int, int]

CONTRACTED_AFTER = 64
"""Expansions for each corner cell after which the graph is contracted: they take about as long."""
_BLOCK = 64
"""Pairs that are asked at once while the graph is not contracted, and that are worth a thread."""


@dataclass(frozen=True, eq=False)
class JumpPath:
    """A shortest path between two cells; None for its cells where there is none."""

    cells: LongArray | None
    """int64 (n, 2), (row, col) of the cells passed."""
    length_cells: float
    """Its length, a + b sqrt 2 of its moves; infinite for none."""
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
        # A corner cell is expanded once at most, so that each arc is queued once at most.
        heaps = tuple(np.empty((n_corners + n_arcs + 1, 2), dtype=np.int64) for _ in range(2))
        touched, found = np.empty(n_corners, np.int64), np.empty(n_corners, np.int32)
        self.arrays = (records, heaps, touched, found), np.empty((n_corners + 2, 3), np.int64)


@copies_alike
class _Searched:
    """The graph as the kernel takes it, contracted or not, and work arrays of its size."""

    def __init__(self, graph: JumpGraph, hierarchy: JumpHierarchy | None) -> None:
        used = hierarchy or graph
        tables = graph.number, graph.ahead, graph.width, graph.n_corners
        arcs = used.first, used.arcs
        self.graph = tables, graph.places, graph.component, legs_that_follow(), arcs
        self.middles: IntArray = np.empty(0, np.int32)
        if hierarchy is not None:
            self.middles = hierarchy.middles
        self.works = Pool(partial(_Work, graph.n_corners, len(used.arcs)))


@copies_alike
class JumpSearch:
    """Exact shortest octile paths over the free cells of a graph; threads may share it.

    Moves go to the 8 neighbours; a diagonal needs both side cells free (no corner cutting). The
    graph is contracted once queries have taken about as long as that takes. From then on they are
    faster by far where many corner cells lie between start and goal; where there are several
    shortest paths it may be another one that they find.

    Parameters
    ----------
    graph
        Of the map's free cells.

    Notes
    -----
    D. Harabor, T. Uras, P. Stuckey, S. Koenig: Regarding jump point search and subgoal graphs,
    2019.
    """

    def __init__(self, graph: JumpGraph) -> None:
        self.graph = graph
        self.hierarchy: JumpHierarchy | None = None
        self._searched = _Searched(graph, None)
        self._left = CONTRACTED_AFTER * graph.n_corners
        self._contracting = threading.Lock()

    def contract(self) -> None:
        """Contract the graph now, rather than when it has paid off."""
        with self._contracting:
            if self.hierarchy is None:
                hierarchy = contract_graph(self.graph)
                self._searched = _Searched(self.graph, hierarchy)
                self.hierarchy = hierarchy

    def path(self, start: Cell, goal: Cell) -> JumpPath:
        """Find a shortest path between two free cells."""
        _, cells, counts = self._paths(np.array([[*start, *goal]], dtype=np.int64))
        straight, diagonal, expanded = counts[0].tolist()
        if straight < 0:
            return JumpPath(None, math.inf, expanded)
        return JumpPath(cells, straight + diagonal * math.sqrt(2.0), expanded)

    def many(self, starts: LongArray, goals: LongArray) -> JumpPaths:
        """Find shortest paths between many pairs of free cells, int64 (n, 2) each, on all cores."""
        ends = np.ascontiguousarray(np.hstack([starts, goals]).reshape(-1, 4), dtype=np.int64)
        found = list(self._blocks(ends))
        counts = np.concatenate([block[2] for block in found])
        length = counts[:, 0] + counts[:, 1] * math.sqrt(2.0)
        length[counts[:, 0] < 0] = np.inf
        sizes = np.concatenate([np.diff(block[0]) for block in found])
        path_start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        cells = np.concatenate([block[1] for block in found])
        return JumpPaths(length, path_start, cells, counts[:, 2])

    def _blocks(self, ends: LongArray) -> Iterator[tuple[LongArray, LongArray, LongArray]]:
        """Answer pairs in blocks as long as the graph is not contracted, then a part a core."""
        at = 0
        while self.hierarchy is None and (at == 0 or at < len(ends)):
            yield self._paths(ends[at : at + _BLOCK])
            at += _BLOCK
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
        n_parts = min(cores or 1, (len(ends) - at) // _BLOCK)
        if n_parts > 1:
            with ThreadPoolExecutor(n_parts) as pool:
                yield from pool.map(self._paths, np.array_split(ends[at:], n_parts))
        elif at == 0 or at < len(ends):
            yield self._paths(ends[at:])

    def _paths(self, ends: LongArray) -> tuple[Any, Any, Any]:
        """Return where the cells of each path begin, these, and moves and expansions of each."""
        searched = self._searched
        with searched.works.lent() as work:
            found: tuple[Any, Any, Any] = kernels.paths(
                searched.graph, searched.middles, self.graph.origin, ends, work.arrays
            )
        if self.hierarchy is None:
            self._left -= int(found[2][:, 2].sum())
            # Another thread that contracts it is not waited for.
            if self._left <= 0 and not self._contracting.locked():
                self.contract()
        return found
