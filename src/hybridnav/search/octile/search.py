"""Shortest octile paths on a jump-point graph, exact."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import FAR
from hybridnav._base.threads import Pool
from hybridnav.search.octile.kernels import patch as _patch_kernels
from hybridnav.search.octile.kernels import queries as kernels
from hybridnav.search.octile.kernels.legs import COLUMN_BITS, KIND_BITS, arcs_of, legs_that_follow

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.search.octile.build import JumpGraph


# A jump-point graph that follows changed cells, until it is built anew.

_REACH = 2
"""Cells round a changed one whose joins read it, or whose corners it decides on."""
_MOST_DIRTY = 0.25
"""Share of all tiles that may be dirty; with more of them a graph is built anew."""


@copies_alike
@dataclass(frozen=True, eq=False)
class JumpPatch:
    """What changed since a jump-point graph was built, and which of its arcs still hold.

    Tiles that hold a changed cell are *dirty*: their cells, and the corner cells among them, are
    read here. Corner cells whose joins pass a dirty tile are *stale*: a search joins them again
    when it expands them. All other arcs of the graph hold.
    """

    first: IntArray
    """int32 (n + 1,), where the arcs of each corner cell of the graph begin, in the order of
    rows."""
    arcs: LongArray
    """int64 (m, 2), the arcs, not contracted; see `JumpGraph`."""
    tile_of: IntArray
    """int32, the number of each tile of the framed grid among the dirty ones, -1 for none."""
    codes: IntArray
    """int32 (t, cells of a tile), the number of each corner cell, below 0 for other cells."""
    hops: NDArray[np.int8]
    """int8 (t, cells of a tile, 4), how far a ray leads in its tile, along each side."""
    places: LongArray
    """int64 (n + k,), places of the corner cells of the graph, then those in dirty tiles."""
    is_stale: BoolArray
    """bool (n,), by corner cell of the graph."""

    @classmethod
    def of(cls, graph: JumpGraph) -> JumpPatch:
        """Return the patch of a graph without a change; contraction is undone."""
        width = graph.shape[1]
        places = np.sort(graph.places)
        order = np.arange(len(places), dtype=np.int32)
        rows, cols = places >> COLUMN_BITS + KIND_BITS, places >> KIND_BITS & (1 << COLUMN_BITS) - 1
        corners = (rows * width + cols).astype(np.int32)
        first, arcs = graph.first, graph.arcs
        if graph.is_contracted:
            first, arcs = arcs_of((graph.index, graph.ahead, order, width), corners, places)
        tiles = tuple(-(-side // _patch_kernels.SIDE) for side in graph.shape)
        none = (
            np.empty((0, _patch_kernels.SIDE**2), np.int32),
            np.empty((0, _patch_kernels.SIDE**2, 4), np.int8),
        )
        patch = first, arcs, np.full(tiles, -1, np.int32), *none, places
        return cls(*patch, np.zeros(len(places), np.bool_))

    def changed(self, graph: JumpGraph, free: BoolArray, cells: LongArray) -> JumpPatch | None:
        """Return the patch after some cells changed, None if the graph had better be built anew.

        Parameters
        ----------
        graph
            The graph of this patch.
        free
            bool (rows, cols), the free cells of the map now.
        cells
            int64 (m, 2), (row, col) of those that changed since this patch.
        """
        at = cells - np.array(graph.origin)
        if (at < 1).any() or (at >= np.array(graph.shape) - 1).any():
            return None
        is_near = np.zeros(self.tile_of.shape, np.bool_)
        for down in (-_REACH, _REACH):
            for across in (-_REACH, _REACH):
                corner = np.clip(at + np.array([down, across]), 0, np.array(graph.shape) - 1)
                is_near[tuple(corner.T // _patch_kernels.SIDE)] = True
        new = np.argwhere(is_near & (self.tile_of < 0))
        tile_of = self.tile_of.copy()
        tile_of[tuple(new.T)] = len(self.codes) + np.arange(len(new))
        dirty = np.argwhere(tile_of >= 0)
        if len(dirty) > _MOST_DIRTY * tile_of.size + 4:
            return None
        dirty = dirty[np.argsort(tile_of[tuple(dirty.T)], kind="stable")]
        n = len(self.is_stale)
        shape = graph.shape
        codes, more = _patch_kernels.codes_of_tiles(dirty, free, graph.origin, shape, n)
        is_stale = self.is_stale.copy()
        width = shape[1]
        tables = graph.index, graph.ahead, np.arange(n, dtype=np.int32), width
        _patch_kernels.stale_corners(tables, tile_of, new, shape, is_stale)
        places = np.concatenate([self.places[:n], more])
        arrays = tile_of, codes, _patch_kernels.hops_of_tiles(codes), places, is_stale
        for array in arrays:
            array.flags.writeable = False
        return JumpPatch(self.first, self.arcs, *arrays)


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
    patch
        What changed since the graph was built, see `renewed`; None for nothing.
    base
        The patch of the graph without a change; None to make it when it is needed.

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

    def __init__(
        self, graph: JumpGraph, patch: JumpPatch | None = None, *, base: JumpPatch | None = None
    ) -> None:
        self.graph = graph
        self.patch = patch
        self._base = base
        tables = graph.index, graph.ahead, graph.order, graph.shape[1]
        arcs = graph.first, graph.arcs
        self._arrays = tables, graph.places, graph.component, legs_that_follow(), arcs
        if patch is not None:
            rows = np.arange(graph.n_corners, dtype=np.int32)
            ordered = graph.index, graph.ahead, rows, graph.shape[1]
            dirty = patch.tile_of, patch.codes, patch.hops
            self._patched = ordered, dirty, patch.places, patch.is_stale, patch.first, patch.arcs
        self._works = Pool(partial(_Work, graph.n_corners, len(graph.arcs)))

    def renewed(self, free: BoolArray, cells: LongArray) -> JumpSearch | None:
        """Return the search of the map after some of its cells changed; this one stays as it is.

        Its arcs are those of the graph, except at corner cells that look into the neighbourhood of
        a change: a query that expands one of these looks again. Queries are as exact, but slower
        than on a contracted graph.

        Parameters
        ----------
        free
            bool (rows, cols), the free cells of the map now.
        cells
            int64 (m, 2), (row, col) of those that changed since this search was made.

        Returns
        -------
        JumpSearch | None
            None if the graph had better be built anew: cells outside the rectangle of all free
            cells became free, or changes lie in a quarter of the map.

        Examples
        --------
        >>> from hybridnav.search.octile import JumpSearch, build_jump_graph
        >>> free = np.ones((3, 5), dtype=bool)
        >>> search = JumpSearch(build_jump_graph(free))
        >>> free[:2, 2] = False
        >>> after = search.renewed(free, np.array([[0, 2], [1, 2]]))
        >>> search.path((0, 0), (0, 4)).length_cells, after.path((0, 0), (0, 4)).length_cells
        (4.0, 6.82842712474619)
        """
        before = self.patch or self._base or JumpPatch.of(self.graph)
        patch = before.changed(self.graph, free, cells)
        return None if patch is None else JumpSearch(self.graph, patch)

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
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
        n_parts = max(1, min(cores or 1, len(endpoints) // _LEAST))
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
        if self.patch is not None:
            # Most searches never see a change.
            from hybridnav.search.octile.kernels.queries import paths_patched  # noqa: PLC0415

            answer: tuple[Any, Any, Any] = paths_patched(
                self._patched, self.graph.origin, endpoints
            )
            return answer
        with self._works.lent() as work:
            found: tuple[Any, Any, Any] = kernels.paths(
                self._arrays, self.graph.middles, self.graph.origin, endpoints, work.arrays
            )
        return found
