"""Planning on regions: a coarse search on their graph, then the best path inside them.

Also shared by other baselines: the regions of a topological map, checks of cells, counts of bytes.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.baselines.protocol import MethodResult
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.search.grid_search import GridSearch

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, IntArray, LongArray
    from hybridnav.baselines.protocol import Cell
    from hybridnav.search.arc_search import ArcSearch
    from hybridnav.topology import TopologicalMap


@copies_alike
class RegionPlanner:
    """A coarse search on a graph of regions, then grid A* on the cells of the route's regions.

    Parameters
    ----------
    region_of
        int32 (rows, cols), the region of each free cell, -1 elsewhere.
    graph
        The graph of the regions.
    corner_cutting
        Whether diagonals may cut corners.
    """

    def __init__(
        self, region_of: IntArray, graph: ArcSearch, *, corner_cutting: bool = False
    ) -> None:
        self._region_of = region_of
        self._graph = graph
        self._grid_search = GridSearch(region_of >= 0, corner_cutting=corner_cutting)
        self.memory_bytes = array_bytes(self, graph) + self._grid_search.memory_bytes

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells.

        Raises
        ------
        InvalidValueError
            When a cell lies outside the map or is not free.
        """
        first = region_at(self._region_of, start)
        last = region_at(self._region_of, goal)
        began = time.perf_counter()
        plan = self._graph.search(first, last)
        seconds = {"coarse": time.perf_counter() - began}
        if plan.vertices is None:
            return MethodResult(None, expanded_nodes=plan.expanded, seconds=seconds)
        began = time.perf_counter()
        in_corridor = np.zeros(self._graph.n_vertices, dtype=np.bool_)
        in_corridor[plan.vertices] = True
        found = self._grid_search.search(
            start, goal, field_of=self._region_of, in_corridor=in_corridor
        )
        seconds["refine"] = time.perf_counter() - began
        return MethodResult(
            found.cells,
            nodes=tuple(plan.vertices.tolist()),
            expanded=found.expanded,
            expanded_nodes=plan.expanded,
            seconds=seconds,
        )


def array_bytes(*holders: object) -> int:
    """Return the bytes of arrays in attributes of objects; an array and its views count once."""
    held = (value for holder in holders for value in vars(holder).values())
    arrays = (value for value in held if isinstance(value, np.ndarray))
    return sum({array.ctypes.data: array.nbytes for array in arrays}.values())


def free_fields(topology: TopologicalMap) -> IntArray:
    """Return the dense index of each free cell's place, int32 (rows, cols), -1 elsewhere;
    read-only."""
    free = topology.grid.classes == CellClass.FREE
    region_of: IntArray = np.where(free, topology.level.field_of, np.int32(-1))
    region_of.flags.writeable = False
    return region_of


def region_at(region_of: IntArray, cell: Cell) -> int:
    """Return the region of a free cell.

    Raises
    ------
    InvalidValueError
        When the cell lies outside the map or is not free.
    """
    rows, cols = region_of.shape
    row, col = cell
    region = int(region_of[row, col]) if 0 <= row < rows and 0 <= col < cols else -1
    if region < 0:
        raise InvalidValueError(
            f"expected a free cell (row, col) of a map of {rows} x {cols} cells, got ({row}, {col})"
        )
    return region


def joined_regions(
    region_of: IntArray, *, corner_cutting: bool = False
) -> tuple[LongArray, FloatArray]:
    """Return the pairs of regions with a legal move from one to the other.

    Parameters
    ----------
    region_of
        int32 (rows, cols), the region of each free cell, -1 elsewhere.
    corner_cutting
        Whether diagonals may cut corners.

    Returns
    -------
    tuple of LongArray and FloatArray
        int64 (n_pairs, 2), the lower label first, sorted; float64 (n_pairs, 2), the mean of the
        middles of the moves between the two, (row, col) with cells at whole numbers.
    """
    n_regions = int(region_of.max(initial=-1)) + 1
    free = region_of >= 0
    rising, falling = free[:-1, :-1] & free[1:, 1:], free[:-1, 1:] & free[1:, :-1]
    if not corner_cutting:
        rising = falling = rising & falling
    keys, rows, cols = [], [], []
    for tail, head, legal, offset in (
        (np.s_[:, :-1], np.s_[:, 1:], free[:, :-1] & free[:, 1:], (0.0, 0.5)),
        (np.s_[:-1, :], np.s_[1:, :], free[:-1] & free[1:], (0.5, 0.0)),
        (np.s_[:-1, :-1], np.s_[1:, 1:], rising, (0.5, 0.5)),
        (np.s_[:-1, 1:], np.s_[1:, :-1], falling, (0.5, 0.5)),
    ):
        row, col = np.nonzero(legal & (region_of[tail] != region_of[head]))
        endpoints = np.stack([region_of[tail][row, col], region_of[head][row, col]]).astype(
            np.int64
        )
        keys.append(endpoints.min(axis=0) * n_regions + endpoints.max(axis=0))
        rows.append(row + offset[0])
        cols.append(col + offset[1])
    found, pair_of, count = np.unique(np.concatenate(keys), return_inverse=True, return_counts=True)
    sums = [
        np.bincount(pair_of, weights=np.concatenate(w), minlength=len(found)) for w in (rows, cols)
    ]
    pairs = np.stack(np.divmod(found, max(n_regions, 1)), axis=1)
    return pairs, np.stack(sums, axis=1) / count[:, None]
