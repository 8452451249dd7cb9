"""Planner of the preset `octile`: exact cell paths on the jump-point graph of the map."""

from __future__ import annotations

import math
import threading
import time
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.progress import no_progress
from hybridnav.maps.centres import centres
from hybridnav.planner import PlanStats
from hybridnav.planner.cell_planner import CellPlan, CellPlans, enterable_of
from hybridnav.planner.cell_plans import WholeMap, round_closed
from hybridnav.search.octile import JumpPatch, JumpSearch, build_jump_graph, contract_graph

if TYPE_CHECKING:
    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import FloatArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.planner import Metric, PlannerSettings
    from hybridnav.planner.cell_planner import CellQueries, CellQuery
    from hybridnav.pyramid import Level
    from hybridnav.refine import GridRefiner


CONTRACTED_FROM = 2000
"""Least number of corner cells for contraction: in smaller graphs a direct search is as fast."""


@copies_alike
class OverJumps:
    """Shortest paths of cells; the graph is built when the first query needs it.

    It is contracted at once, so that a query always gets the same one of several shortest paths.

    If corners may be cut, the graph lacks some moves: then A* searches the whole map.

    Parameters
    ----------
    grid
        The map.
    refiner
        Search of paths round closed cells, and where corners may be cut.
    settings
        Whether unexplored cells may be entered.
    search
        Search of the graph of the same cells, if it is built already.
    """

    metric: Metric = "octile"

    def __init__(
        self,
        grid: OccupancyGrid,
        refiner: GridRefiner,
        settings: PlannerSettings,
        search: JumpSearch | None = None,
    ) -> None:
        self._grid = grid
        self._settings = settings
        self._allow_unexplored = settings.allow_unexplored
        self._refiner = refiner
        self._whole_map = WholeMap(refiner)
        self._search = search
        self._building = threading.RLock()  # a progress callback may plan
        self._frame = grid.frame.for_kernels

    @property
    def prepared(self) -> JumpSearch | None:
        """The search of the graph, None until it is built, and after a change of the map."""
        search = self._search
        return None if search is None or search.patch is not None else search

    def prepare(self, progress: Progress = no_progress) -> JumpSearch:
        """Build the graph, once, also anew after a change of the map; see `CellPlanner`."""
        if self.prepared is None:
            with self._building:
                if self.prepared is None:
                    free = self._grid.enterable(allow_unexplored=self._allow_unexplored)
                    graph = build_jump_graph(free)
                    base = JumpPatch.of(graph)
                    progress(1, 2)
                    if graph.n_corners >= CONTRACTED_FROM:
                        graph = contract_graph(graph)
                    self._search = JumpSearch(graph, base=base)
                    progress(2, 2)
        assert self._search is not None  # noqa: S101 - built above
        return self._search

    def followed(self, grid: OccupancyGrid, cells: LongArray) -> OverJumps:
        """Return the planner of the changed map, whose corners look anew; see `Following`."""
        allowed, search = self._allow_unexplored, self._search
        if search is not None:
            free = grid.enterable(allow_unexplored=allowed)
            was = enterable_of(self._grid, cells, allow_unexplored=allowed)
            changed = cells[was != free[tuple(cells.T)]]
            search = search.renewed(free, changed) if len(changed) else search
        return OverJumps(grid, self._refiner.on(grid), self._settings, search)

    def plan(self, query: CellQuery) -> CellPlan:
        """Find a shortest path between two cells; see `CellPlanner`."""
        if self._grid.corner_cutting:
            return self._whole_map.plan(query)
        began = time.perf_counter()
        seconds = {}
        if self._search is None:
            self.prepare()
            seconds["graph"] = time.perf_counter() - began
        now = time.perf_counter()
        found = (self._search or self.prepare()).path(*query.cells)
        seconds["jumps"] = time.perf_counter() - now
        plan = CellPlan(
            found.cells,
            points=None if found.cells is None else centres(found.cells, self._frame),
            length_cells=found.length_cells,
            bound_cells=found.length_cells,
            stats=PlanStats(expanded=found.expanded, seconds=seconds),
        )
        return round_closed(plan, query, self._refiner)

    def plan_many(self, queries: CellQueries) -> CellPlans | None:
        """Find a shortest path for each query, on all cores; see `CellPlanner`.

        If corners may be cut, no query is answered here.
        """
        if self._grid.corner_cutting:
            return None
        found = (self._search or self.prepare()).many(*queries.cells)
        cost_m = found.length_cells * self._grid.resolution_m
        done, points = np.ones(len(cost_m), dtype=np.bool_), centres(found.cells, self._frame)
        return CellPlans(done, cost_m, cost_m, found.path_start, points)

    def bound(self, plan: CellPlan, points: tuple[FloatArray, FloatArray]) -> float:  # noqa: ARG002
        """Return the straight distance; see `CellPlanner`."""
        return math.dist(*points)

    def fields(self, level: Level) -> None:
        """None, because the whole map is searched; see `CellPlanner`."""
