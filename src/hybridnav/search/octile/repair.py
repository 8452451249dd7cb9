"""A jump-point graph that follows changed cells in place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.search.octile.jumps import JumpGraph
from hybridnav.search.octile.kernels.legs import components
from hybridnav.search.octile.kernels.repair import WORD, follow_cells, link_again, move_rows

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, LongArray


_ROOM, _LEAST_ROOM = 1 / 32, 512
"""Room for rows of distances of freed cells: as a part of all, and words at least."""


class FollowingGraph:
    """A jump-point graph whose tables are repaired in place.

    Corner cells and arcs are numbered as in a graph that is built of the same cells, so that
    searches find the same one of several shortest paths. A search of a graph before is not to be
    asked any more.

    `graph`: a graph without directions, not contracted; unchanged.
    """

    def __init__(self, graph: JumpGraph) -> None:
        n_free = len(graph.ahead)
        room = n_free + max(int(n_free * _ROOM), _LEAST_ROOM * WORD)
        self._index, self._ahead = graph.index.copy(), np.empty((room, 8), graph.ahead.dtype)
        self._ahead[:n_free] = graph.ahead
        # Words behind the last free cell begin with the row after its.
        self._fill = np.array([n_free + 1, n_free + 1], np.int64)
        self.graph = graph

    def follow(self, cells: LongArray, is_free: BoolArray) -> bool:
        """Follow changed cells, int64 (m, 2), (row, col), in the order of rows, which are free or
        not; False, and nothing has changed, if the graph had better be built anew: a cell is free
        beyond its rectangle, or there is no room for more freed cells."""
        graph, width = self.graph, self.graph.shape[1]
        at = cells - np.array(graph.origin)
        inside = ((at > 0) & (at < np.array(graph.shape) - 1)).all(axis=1)
        if (is_free & ~inside).any():
            return False
        flat = at[inside] @ np.array([width, 1])
        differ = move_rows(self._index, self._ahead, self._fill, flat, is_free[inside])
        if differ is None:
            return False
        marked, n_corners = follow_cells(self._index, self._ahead, width, differ)
        index, ahead, order = self._index[:], self._ahead[:], np.arange(n_corners, dtype=np.int32)
        tables = index, ahead, order, width
        places, first, arcs = link_again(tables, graph.places, graph.first, graph.arcs, marked)
        arrays = index, ahead, order, places, first, arcs, graph.middles, components(first, arcs)
        for array in arrays:
            array.flags.writeable = False
        self.graph = JumpGraph(graph.origin, graph.shape, *arrays)
        return True
