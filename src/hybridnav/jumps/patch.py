"""A jump-point graph that follows changed cells, until it is built anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.jumps import _patch_kernels as kernels
from hybridnav.jumps._join_kernels import arcs_of
from hybridnav.jumps._leg_kernels import COLUMN_BITS, KIND_BITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, IntArray, LongArray
    from hybridnav.jumps.build import JumpGraph

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
        tiles = tuple(-(-side // kernels.SIDE) for side in graph.shape)
        none = np.empty((0, kernels.SIDE**2), np.int32), np.empty((0, kernels.SIDE**2, 4), np.int8)
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
                is_near[tuple(corner.T // kernels.SIDE)] = True
        new = np.argwhere(is_near & (self.tile_of < 0))
        tile_of = self.tile_of.copy()
        tile_of[tuple(new.T)] = len(self.codes) + np.arange(len(new))
        dirty = np.argwhere(tile_of >= 0)
        if len(dirty) > _MOST_DIRTY * tile_of.size + 4:
            return None
        dirty = dirty[np.argsort(tile_of[tuple(dirty.T)], kind="stable")]
        n = len(self.is_stale)
        shape = graph.shape
        codes, more = kernels.codes_of_tiles(dirty, free, graph.origin, shape, n)
        is_stale = self.is_stale.copy()
        width = shape[1]
        tables = graph.index, graph.ahead, np.arange(n, dtype=np.int32), width
        kernels.stale_corners(tables, tile_of, new, shape, is_stale)
        places = np.concatenate([self.places[:n], more])
        arrays = tile_of, codes, kernels.hops_of_tiles(codes), places, is_stale
        for array in arrays:
            array.flags.writeable = False
        return JumpPatch(self.first, self.arcs, *arrays)
