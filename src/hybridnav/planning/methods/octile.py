"""Method `octile`: exact cell paths on the jump-point graph of the map."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.copies import copies_alike
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.threads import behind, keep_last
from hybridnav._base.typing import BoolArray
from hybridnav.planning import PlannerSettings
from hybridnav.planning.methods.grid import KnownMap, WholeMap, enterable_of, round_closed
from hybridnav.search.found import (
    ClosedCells,
    Found,
    FoundMany,
    MapChange,
    Method,
    Metric,
    PlanStats,
    Query,
    QueryMany,
)
from hybridnav.search.octile import JumpGraph, JumpSearch, build_jump_graph, contract_graph

if TYPE_CHECKING:
    from hybridnav.search.distance_table import LabelSource


CONTRACTED_FROM = 2000
"""Least number of corner cells for contraction: in smaller graphs a direct search is as fast."""
MANY_CELLS = 1 << 22
"""Least number of cells of a map for which queries do not wait: A* answers them while a thread
builds the graph, in seconds."""
_KEPT = 4
"""Number of graphs with directions that are kept for queries with equal closures."""


def _search_of(graph: JumpGraph) -> JumpSearch:
    return JumpSearch(contract_graph(graph) if graph.n_corners >= CONTRACTED_FROM else graph)


@copies_alike
class OverJumps(Method):
    """Shortest paths of cells; the graph is built when the first query needs it.

    It is contracted at once, so that a query gets the same one of several shortest paths: always on
    a map of fewer than `MANY_CELLS`, on a larger one as soon as the graph is there.

    If corners may be cut, the graph lacks some moves: then A* searches the whole map.

    `known`: the map, and the search of its graph, if it is built already; `settings`: whether
    unexplored cells may be entered.
    """

    metric: Metric = "octile"

    def __init__(self, known: KnownMap, settings: PlannerSettings) -> None:
        self._grid, self._settings = known.grid, settings
        self._allow_unexplored = settings.allow_unexplored
        self._known = known._replace(prepared=None)
        self._whole_map = WholeMap(known, settings)
        self._search = known.prepared if isinstance(known.prepared, JumpSearch) else None
        self._directed: dict[ClosedCells, JumpSearch] = {}
        self._building = threading.RLock()  # a progress callback may plan
        self._begun = threading.Lock()
        self._frame = known.grid.frame.for_kernels

    @property
    def prepared(self) -> JumpSearch | None:
        """The search of the graph, None until it is built."""
        return self._search

    def prepare(self, progress: Progress = no_progress) -> JumpSearch:
        """Build the graph, once; see `Method`."""
        if self._search is None:
            with self._building:
                if self._search is None:
                    graph = build_jump_graph(self._free())
                    progress(1, 2)
                    self._search = _search_of(graph)
                    # Without the search of the first answers, 5 bytes a cell.
                    self._whole_map = WholeMap(self._known, self._settings)
                    progress(2, 2)
        return self._search

    def _free(self) -> BoolArray:
        return self._grid.enterable(allow_unexplored=self._allow_unexplored)

    def changed(self, change: MapChange) -> OverJumps:
        """Return the method of the changed map, whose graph the next query builds; see `Method`."""
        allowed, search, (grid, *_, cells) = self._allow_unexplored, self._search, change
        was, now = (
            enterable_of(each, cells, allow_unexplored=allowed) for each in (self._grid, grid)
        )
        search = search if (was == now).all() else None
        return OverJumps(KnownMap(grid, change.topology, prepared=search), self._settings)

    def find(self, query: Query) -> Found:
        """Find a shortest path between two cells; see `Method`."""
        if self._grid.corner_cutting:
            return self._whole_map.find(query)
        began = clock()
        seconds = {}
        search = self._search
        if search is None:
            if not self._is_small:
                behind(self._begun, self.prepare)
                return self._whole_map.find(query)
            search = self.prepare()
            seconds["graph"] = clock() - began
        now = clock()
        path = search.path(*query.cells)
        directed = query.closed if query.one_way is not None and self._is_small else None
        if directed and path.cells is not None and directed.meets(path.cells, self._grid):
            again = self._with(directed).path(*query.cells)
            path = again._replace(expanded=path.expanded + again.expanded)
        seconds["jumps"] = clock() - now
        stats = PlanStats(path.expanded, seconds=seconds)
        if path.cells is None:
            return Found(None, stats=stats)
        length_m = path.length_cells * self._grid.resolution_m
        found = Found(path.cells, length_m, length_m, stats=stats)
        return found if directed else round_closed(found, query, self._whole_map.refiners[0])

    @property
    def _is_small(self) -> bool:
        """Whether queries wait for a graph."""
        return self._grid.classes.size < MANY_CELLS

    def _with(self, closed: ClosedCells) -> JumpSearch:
        """Return the search of the graph with closed cells and directions; the last ones are
        kept."""
        search = self._directed.pop(closed, None)
        if search is None:
            free = self._free().copy()
            free.ravel()[closed.flat] = False
            search = _search_of(build_jump_graph(free, closed.one_way))
        return keep_last(self._directed, closed, search, _KEPT)

    def labels(self, closed: ClosedCells | None = None) -> LabelSource | None:
        """Return labels in the contracted graph, of the map with closed cells; see `Method`."""
        if self._grid.corner_cutting or closed is not None:
            return self._whole_map.labels(closed)
        from hybridnav.search.octile.labels import JumpLabels  # noqa: PLC0415 - for tables alone

        search = self.prepare()
        return JumpLabels(search) if search.graph.is_contracted else self._whole_map.labels()

    def find_many(self, queries: QueryMany) -> FoundMany | None:
        """Find a shortest path for each query, on all cores; see `Method`.

        If corners may be cut, no query is answered here.
        """
        if self._grid.corner_cutting:
            return None
        found = (self._search or self.prepare()).many(*queries.cells, self._frame)
        cost_m = found.length_cells * self._grid.resolution_m
        done = np.ones(len(cost_m), dtype=np.bool_)
        return FoundMany(done, cost_m, cost_m, found.path_start, found.cells)
