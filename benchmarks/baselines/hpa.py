"""HPA*: a graph of transitions between square clusters, refined and smoothed."""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from benchmarks.baselines.kernels import hpa as _hpa_kernels
from benchmarks.baselines.kernels.hpa import AbstractGraph
from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import STRAIGHT, legal_moves
from hybridnav._base.threads import Pool
from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines.regions import CUT_CORNERS, Cell, MethodResult, array_bytes
from hybridnav.maps import CellClass, OccupancyGrid


@copies_alike
class HpaStar:
    """HPA* with one abstract level.

    A. Botea, M. Mueller, J. Schaeffer: Near optimal hierarchical path-finding, 2004. Clusters are
    squares; a maximal run of facing free cells along a common side of two clusters is an entrance,
    with one transition in its middle if it is shorter than 6 cells, else one at either end. The
    cells of the transitions are the nodes of the abstract graph, joined across the side and, inside
    a cluster, by shortest paths that stay in it. A query joins start and goal to the nodes of their
    clusters, searches, refines each edge inside its cluster and replaces parts of the path by
    straight lines, no longer than the side of a cluster, as the authors' program does.

    Regions are the connected components of the clusters. The path before smoothing stays inside the
    regions of `MethodResult.nodes`, in that order; **the smoothed path may leave them**. Its length
    has no proved bound. `n_nodes` and `n_edges` are those of the abstract graph.

    Transitions lie between facing cells only. On a grid that allows cutting corners, paths that
    pass from cluster to cluster only between two occupied cells are therefore not found: there the
    method gives up and does not claim that no path exists.

    `grid`: the map; free cells are entered, all others not; `cluster_cells`: side of a cluster in
    cells, >= 2; `smooth`: whether paths are smoothed; `line_cells`: moves in the longest straight
    line that smoothing tries, >= 1; None for the side of a cluster. Long lines make paths three to
    five times nearer to the shortest. Raises `InvalidValueError` when the side of the clusters is
    less than 2, or lines are shorter than 1.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        cluster_cells: int = 10,
        smooth: bool = True,
        line_cells: int | None = None,
    ) -> None:
        if cluster_cells < 2:
            raise InvalidValueError(f"clusters must be at least 2 cells wide, got {cluster_cells}")
        if line_cells is not None and line_cells < 1:
            raise InvalidValueError(f"lines must be at least 1 move long, got {line_cells}")
        self.name = _name(smooth=smooth, line_cells=line_cells)
        self._smooth = smooth
        self._cluster_cells = min(cluster_cells, max(2, *grid.shape))
        self._reach = cluster_cells if line_cells is None else line_cells
        enterable = grid.classes == CellClass.FREE
        self._corner_cutting = grid.corner_cutting
        self._moves: ByteArray = legal_moves(enterable, grid.corner_cutting)
        self.region_of: IntArray = _hpa_kernels.label_regions(
            enterable, self._moves, self._cluster_cells
        )
        self._graph = _abstract_graph(enterable, self._moves, self._cluster_cells)
        self.n_nodes = len(self._graph.cells)
        self.n_edges = len(self._graph.endpoints) // 2
        self._works = Pool(partial(_Work, self.n_nodes, enterable.size if smooth else 0))
        with self._works.lent() as work:
            own = sum(array.nbytes for array in (self.region_of, self._moves, *self._graph))
            self.memory_bytes = own + array_bytes(work)

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        with self._works.lent() as work:
            return self._solve(work, start, goal)

    def _solve(self, work: _Work, start: Cell, goal: Cell) -> MethodResult:
        began = time.perf_counter()
        work.turn += 1
        cols = self._moves.shape[1]
        passed, expanded_nodes, expanded = _hpa_kernels.abstract_search(
            self._moves,
            self._cluster_cells,
            self._graph,
            start[0] * cols + start[1],
            goal[0] * cols + goal[1],
            work.cost_of,
            work.previous,
            work.mark,
            work.turn,
        )
        seconds = {"coarse": time.perf_counter() - began, "refine": 0.0}
        if passed.size == 0:
            return MethodResult(
                None,
                expanded=int(expanded),
                expanded_nodes=int(expanded_nodes),
                seconds=seconds,
                gave_up=CUT_CORNERS if self._corner_cutting else "",
            )
        began = time.perf_counter()
        path, refined = _hpa_kernels.refine(self._moves, self._cluster_cells, passed)
        nodes = self._regions_along(path)
        if self._smooth:
            path = _hpa_kernels.smooth(self._moves, path, self._reach, work.position)
        cells = np.stack(divmod(path, cols), axis=1)
        seconds["refine"] = time.perf_counter() - began
        return MethodResult(
            cells,
            nodes,
            plan_steps=passed.size - 1,
            expanded=int(expanded + refined),
            expanded_nodes=int(expanded_nodes),
            seconds=seconds,
        )

    def _regions_along(self, path: LongArray) -> tuple[int, ...]:
        """Return the regions that a path of flat cells passes, in order."""
        regions = self.region_of.ravel()[path]
        entered = np.concatenate([[True], regions[1:] != regions[:-1]])
        return tuple(regions[entered].tolist())


class _Work:
    """Work arrays of one search."""

    def __init__(self, n_nodes: int, n_cells: int) -> None:
        self.cost_of = np.zeros(n_nodes, dtype=np.int64)
        self.previous = np.zeros(n_nodes, dtype=np.int32)
        self.mark = np.zeros(n_nodes, dtype=np.int64)
        self.position = np.full(n_cells, -1, dtype=np.int32)
        self.turn = 0


def _name(*, smooth: bool, line_cells: int | None) -> str:
    if not smooth:
        return "hpa-star-raw"
    return "hpa-star" if line_cells is None else f"hpa-star-lines-{line_cells}"


def _abstract_graph(enterable: BoolArray, moves: ByteArray, cluster_cells: int) -> AbstractGraph:
    rows, cols = enterable.shape
    pairs = _hpa_kernels.transitions(enterable, cluster_cells)
    cells = np.unique(pairs)
    order = np.argsort(_hpa_kernels.cluster_at(cols, cluster_cells, cells), kind="stable")
    node_at = np.empty(len(cells), dtype=np.int32)
    node_at[order] = np.arange(len(cells), dtype=np.int32)
    inter = node_at[np.searchsorted(cells, pairs)]
    cells = cells[order]
    n_clusters = -(-rows // cluster_cells) * -(-cols // cluster_cells)
    clusters = _hpa_kernels.cluster_at(cols, cluster_cells, cells)
    cluster_first = np.searchsorted(clusters, np.arange(n_clusters + 1))
    tails, heads, costs = _hpa_kernels.intra_edges(moves, cluster_cells, cells, cluster_first)
    tails = np.concatenate([tails, inter[:, 0], inter[:, 1]])
    heads = np.concatenate([heads, inter[:, 1], inter[:, 0]])
    costs = np.concatenate([costs, np.full(2 * len(inter), STRAIGHT, dtype=np.int64)])
    by_tail = np.argsort(tails, kind="stable")
    first = np.searchsorted(tails[by_tail], np.arange(len(cells) + 1))
    return AbstractGraph(cells, cluster_first, first, heads[by_tail], costs[by_tail])
