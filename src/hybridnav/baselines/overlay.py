"""Exact overlay: all boundary cells of the places, joined by exact distances inside them."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from hybridnav._copies import copies_alike
from hybridnav.baselines import _overlay_kernels as kernels
from hybridnav.baselines.protocol import MethodResult
from hybridnav.baselines.regions import array_bytes, free_fields, region_at
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.moves import legal_moves

if TYPE_CHECKING:
    from hybridnav._typing import AnyArray, BoolArray, IntArray, LongArray
    from hybridnav.baselines.protocol import Cell
    from hybridnav.topology import TopologicalMap

MAX_CLIQUE_BYTES = 1_500_000_000
"""Most bytes of the distances between boundary cells."""


@copies_alike
class ExactOverlay:
    """Customizable route planning on the places of a topological map: exact, one level.

    D. Delling, A. V. Goldberg, T. Pajor, R. F. Werneck: Customizable route planning in road
    networks, 2015. The nodes are all boundary cells, free cells with a legal move into another
    field; the edges are these moves (also between fields that meet only in a corner) and, inside
    each field, a clique of exact distances between its boundary cells. A query joins start and goal
    to the boundary cells of their fields, searches the overlay (A*, octile distances as the
    heuristic) and unpacks the cliques' edges by searches inside single fields. The path is as short
    as the shortest on the whole grid.

    Parameters
    ----------
    topology
        The map whose free places are planned on.

    Raises
    ------
    InvalidValueError
        When the cliques' distances would take more than 1.5 GB.
    """

    def __init__(self, topology: TopologicalMap) -> None:
        grid, level = topology.grid, topology.level
        free = grid.classes == CellClass.FREE
        self.name = "exact-overlay"
        self.region_of: IntArray = free_fields(topology)
        self._labels = self.region_of.ravel()
        self._cols = grid.shape[1]
        self._moves = legal_moves(free, grid.corner_cutting).ravel()
        self._boxes = kernels.field_boxes(self._labels, self._cols, level.n_vertices)
        cells = kernels.boundary_cells(self._labels, self._moves, self._cols)
        order = np.argsort(self._labels[cells], kind="stable")
        self._node_cell = cells[order].astype(np.int32)
        self._node_field = self._labels[self._node_cell]
        self._node_first = np.searchsorted(self._node_field, np.arange(level.n_vertices + 1))
        self._cross_first, self._cross_head, self._cross_cost = kernels.cross_edges(
            self._labels, self._moves, self._cols, self._node_cell
        )
        sizes = np.diff(self._node_first)
        self._clique_first = np.concatenate([[0], np.cumsum(sizes**2)])
        self._clique = self._distances_inside()
        self._component_of = self._components()
        self._arcs = np.unique(self._pair_keys(*level.arcs.T.astype(np.int64)))
        self._search = GridSearch(free, corner_cutting=grid.corner_cutting)
        self.n_nodes = len(self._node_cell)
        self.n_edges = int((sizes * (sizes - 1) // 2).sum()) + len(self._cross_head) // 2
        self.memory_bytes = array_bytes(self) + self._search.memory_bytes

    def _distances_inside(self) -> AnyArray:
        """Return the matrices of all cliques in a row, of 32 bits if they suffice."""
        for dtype in (np.dtype(np.int32), np.dtype(np.int64)):
            n_entries = int(self._clique_first[-1])
            n_bytes = n_entries * dtype.itemsize
            if n_bytes > MAX_CLIQUE_BYTES:
                raise InvalidValueError(
                    f"an exact overlay may hold {MAX_CLIQUE_BYTES / 1e9:.1f} GB of distances, this "
                    f"map's {len(self._node_cell)} boundary cells need {n_bytes / 1e9:.1f} GB"
                )
            clique: AnyArray = np.empty(n_entries, dtype=dtype)
            if kernels.fill_cliques(
                self._labels,
                self._moves,
                self._cols,
                self._boxes,
                self._node_cell,
                self._node_first,
                self._clique_first,
                clique,
            ):
                break
        return clique

    def _components(self) -> IntArray:
        """Return the label of the set of fields connected with each field by legal moves."""
        tail = np.repeat(self._node_field, np.diff(self._cross_first))
        head = self._node_field[self._cross_head]
        shape = (len(self._boxes), len(self._boxes))
        joined = sparse.coo_array((np.ones(len(head)), (tail, head)), shape=shape)
        labels: IntArray = csgraph.connected_components(joined, directed=False)[1]
        return labels

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Find a shortest path between two free cells; the bound is 1.

        The nodes are dense indices of the places on the path, None if it passes a corner between
        two places that no arc joins.

        Raises
        ------
        InvalidValueError
            When a cell lies outside the map or is not free.
        """
        first, last = region_at(self.region_of, start), region_at(self.region_of, goal)
        if self._component_of[first] != self._component_of[last]:
            return MethodResult(None)
        began = time.perf_counter()
        flat_goal = goal[0] * self._cols + goal[1]
        flat_start = start[0] * self._cols + start[1]
        from_start, direct, reached = self._to_boundary(flat_start, flat_goal)
        to_goal, _, reached_too = self._to_boundary(flat_goal, flat_start)
        _, nodes, by_cross, expanded_nodes = kernels.overlay_search(
            self._node_field,
            self._node_cell,
            self._cols,
            self._node_first,
            self._clique_first,
            self._clique,
            self._cross_first,
            self._cross_head,
            self._cross_cost,
            first,
            from_start,
            last,
            to_goal,
            flat_goal,
            direct,
        )
        searched = time.perf_counter()
        cells, expanded = self._unpacked(start, goal, nodes, by_cross)
        return MethodResult(
            cells,
            nodes=self._passed(cells),
            plan_steps=len(nodes) + 1,
            bound=1.0,
            expanded=expanded + reached + reached_too,
            expanded_nodes=expanded_nodes,
            seconds={"coarse": searched - began, "refine": time.perf_counter() - searched},
        )

    def _pair_keys(self, fields: LongArray, others: LongArray) -> LongArray:
        """Return one number for each unordered pair of fields."""
        keys: LongArray = np.minimum(fields, others) * len(self._boxes) + np.maximum(fields, others)
        return keys

    def _to_boundary(self, cell: int, other: int) -> tuple[LongArray, int, int]:
        distances, direct, reached = kernels.distances_to_nodes(
            self._labels,
            self._moves,
            self._cols,
            self._boxes,
            self._node_cell,
            self._node_first,
            cell,
            other,
        )
        return distances, int(direct), int(reached)

    def _unpacked(
        self, start: Cell, goal: Cell, nodes: LongArray, by_cross: BoolArray
    ) -> tuple[LongArray, int]:
        """Return the cells of a path through some nodes, and the number of cells expanded inside
        fields."""
        rows, cols = np.divmod(self._node_cell[nodes], self._cols)
        passed = [start, *zip(rows.tolist(), cols.tolist(), strict=True), goal]
        crossed = [*by_cross.tolist(), False]
        segments, expanded = [np.array([start], dtype=np.int64)], 0
        in_field = np.zeros(len(self._boxes), dtype=np.bool_)
        for here, there, across in zip(passed[:-1], passed[1:], crossed, strict=True):
            if across:
                segments.append(np.array([there], dtype=np.int64))
                continue
            field = self.region_of[here]
            in_field[field] = True
            leg = self._search.search(here, there, field_of=self.region_of, in_corridor=in_field)
            in_field[field] = False
            expanded += leg.expanded
            if leg.cells is not None:
                segments.append(leg.cells[1:])
        return np.concatenate(segments), expanded

    def _passed(self, cells: LongArray) -> tuple[int, ...] | None:
        fields = self.region_of[*cells.T].astype(np.int64)
        fields = fields[np.concatenate([[True], fields[1:] != fields[:-1]])]
        joined = np.isin(self._pair_keys(fields[:-1], fields[1:]), self._arcs)
        return tuple(fields.tolist()) if joined.all() else None
