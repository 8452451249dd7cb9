"""Planner of the preset `octile`: exact cell paths on the jump-point graph of the map."""

from __future__ import annotations

import math
import threading
import time
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav._progress import no_progress
from hybridnav.grid.centres import centres
from hybridnav.jumps import JumpSearch, build_jump_graph, contract_graph
from hybridnav.planner.cell_planner import CellPlan, CellPlans
from hybridnav.planner.cell_plans import WholeMap, round_closed
from hybridnav.result import PlanStats

if TYPE_CHECKING:
    from hybridnav._progress import Progress
    from hybridnav._typing import FloatArray
    from hybridnav.config import PlannerSettings
    from hybridnav.grid import OccupancyGrid
    from hybridnav.planner.cell_planner import CellQueries, CellQuery
    from hybridnav.pyramid import Level
    from hybridnav.refine import GridRefiner
    from hybridnav.result import Metric

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
        self._allow_unexplored = settings.allow_unexplored
        self._refiner = refiner
        self._whole_map = WholeMap(refiner)
        self._search = search
        self._building = threading.Lock()
        self._frame = grid.frame.for_kernels

    @property
    def prepared(self) -> JumpSearch | None:
        """The search of the graph, None until it is built."""
        return self._search

    def prepare(self, progress: Progress = no_progress) -> JumpSearch:
        """Build the graph, once; see `CellPlanner`."""
        if self._search is None:
            with self._building:
                if self._search is None:
                    free = self._grid.enterable(allow_unexplored=self._allow_unexplored)
                    graph = build_jump_graph(free)
                    progress(1, 2)
                    if graph.n_corners >= CONTRACTED_FROM:
                        graph = contract_graph(graph)
                    self._search = JumpSearch(graph)
                    progress(2, 2)
        return self._search

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
        found = self.prepare().path(*query.cells)
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
        found = self.prepare().many(*queries.cells)
        cost_m = found.length_cells * self._grid.resolution_m
        done, points = np.ones(len(cost_m), dtype=np.bool_), centres(found.cells, self._frame)
        return CellPlans(done, cost_m, cost_m, found.path_start, points)

    def bound(self, plan: CellPlan, points: tuple[FloatArray, FloatArray]) -> float:  # noqa: ARG002
        """Return the straight distance; see `CellPlanner`."""
        return math.dist(*points)

    def fields(self, level: Level) -> None:
        """None, because the whole map is searched; see `CellPlanner`."""
