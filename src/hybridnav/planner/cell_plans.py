"""Planners of cell paths: over the whole map, by max-distance arcs."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from hybridnav import route as routes
from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import octile_distance_in_cells
from hybridnav._base.progress import no_progress
from hybridnav.planner import PlanStats
from hybridnav.planner.cell_planner import CellPlan
from hybridnav.route import Route

if TYPE_CHECKING:
    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import FloatArray, IntArray
    from hybridnav.planner import Metric, PlannerSettings
    from hybridnav.planner.cell_planner import CellQueries, CellQuery
    from hybridnav.pyramid import Level
    from hybridnav.refine import GridRefiner, Refiner
    from hybridnav.route import MaxDistanceSearch
    from hybridnav.topology import TopologicalMap


def round_closed(plan: CellPlan, query: CellQuery, refiner: GridRefiner) -> CellPlan:
    """Return the plan itself if it meets no closed cell, else the best path round all of them.

    Closed cells make no path shorter, so a bound stays valid.
    """
    closed = query.closed
    if closed is None or plan.cells is None or not closed.meets(plan.cells, refiner.grid):
        return plan
    began = time.perf_counter()
    found = refiner.search.search(*query.cells, blocked=closed.flat)
    seconds = {**plan.stats.seconds, "around": time.perf_counter() - began}
    expanded = plan.stats.expanded + found.expanded
    if found.cells is None:
        return CellPlan(None, stats=PlanStats(expanded=expanded, seconds=seconds))
    stats = replace(plan.stats, expanded=expanded, seconds=seconds)
    return CellPlan(found.cells, bound_cells=refiner.cost_in_cells(found.cells), stats=stats)


class WholeMap:
    """Grid A* on the whole map: optimal; or a refiner of the user's own, with the octile bound.

    Parameters
    ----------
    refiner
        The search of cells, with its costs.
    own
        A refiner to use in its place where nothing is closed; None for none.
    """

    def __init__(self, refiner: GridRefiner, own: Refiner | None = None) -> None:
        self.metric: Metric = "octile" if refiner.costs is None else "weighted"
        self._refiner = refiner
        self._own = own

    @property
    def prepared(self) -> None:
        """None, because the legal moves of cells are quick to find; see `CellPlanner`."""
        return

    def prepare(self, progress: Progress = no_progress) -> object:
        """Build the search of cells; see `CellPlanner`."""
        search = self._refiner.search
        progress(1, 1)
        return search

    def plan(self, query: CellQuery) -> CellPlan:
        """Find a shortest path; see `CellPlanner`."""
        began = time.perf_counter()
        cells, expanded = (self._own or self._refiner).refine(*query.cells, None)
        bound = self._refiner.cost_in_cells(cells)
        if self._own is not None:  # it proves nothing
            bound = octile_distance_in_cells(*query.cells)
        seconds = {"refine": time.perf_counter() - began}
        stats = PlanStats(expanded=expanded, seconds=seconds)
        return round_closed(CellPlan(cells, bound_cells=bound, stats=stats), query, self._refiner)

    def plan_many(self, queries: CellQueries) -> None:
        """None, because each query has a search of its own; see `CellPlanner`."""

    def bound(self, plan: CellPlan, points: tuple[FloatArray, FloatArray]) -> float:  # noqa: ARG002
        """Return the straight distance; see `CellPlanner`."""
        return math.dist(*points)

    def fields(self, level: Level) -> None:
        """None, because the whole map is searched; see `CellPlanner`."""


@copies_alike
class MaxDistance:
    """The cheapest coarse route by max-distance arcs, and a refiner in its corridor.

    If corners may be cut, a path can pass between fields that no arc joins, so that a missing route
    proves nothing: then the whole map is searched.

    Parameters
    ----------
    topology
        The map.
    refiner
        The search of cells, with its costs.
    settings
        Whether unexplored cells may be entered, and the corridor.
    own
        A refiner to use in its place where nothing is closed; None for none.
    """

    def __init__(
        self,
        topology: TopologicalMap,
        refiner: GridRefiner,
        settings: PlannerSettings,
        own: Refiner | None = None,
    ) -> None:
        self.metric: Metric = "octile" if refiner.costs is None else "weighted"
        self._topology = topology
        self._refiner = refiner
        self._own = own
        self._settings = settings
        self._search: MaxDistanceSearch | None = None
        self._building = threading.RLock()  # a progress callback may plan

    @property
    def prepared(self) -> None:
        """None, because the searched graph belongs to the topological map; see `CellPlanner`."""
        return

    def prepare(self, progress: Progress = no_progress) -> MaxDistanceSearch:
        """Compute the attributes of the arcs; see `CellPlanner`."""
        if self._search is None:
            allowed = self._settings.allow_unexplored
            with self._building:
                if self._search is None:
                    self._search = routes.MaxDistanceSearch(
                        self._topology, allow_unexplored=allowed
                    )
                    progress(1, 1)
        return self._search

    def plan(self, query: CellQuery) -> CellPlan:
        """Find the shortest path in the corridor; see `CellPlanner`."""
        began = time.perf_counter()
        topology, search = self._topology, self.prepare()
        route = search.search(*map(topology.place_at, query.cells))
        seconds = {"coarse": time.perf_counter() - began}
        if route is None and topology.grid.corner_cutting:
            return self._over_whole_map(query, seconds)
        if route is None:
            return CellPlan(None, stats=PlanStats(seconds=seconds))
        beside = search.enterable if self._settings.corridor == "neighbours" else None
        corridor = routes.corridor_of(topology, route.places, neighbours=beside)
        seconds["coarse"] = time.perf_counter() - began
        cells, expanded = (self._own or self._refiner).refine(*query.cells, corridor)
        seconds["refine"] = time.perf_counter() - began - seconds["coarse"]
        if cells is None and self._refiner.costs is not None:  # cells that the layer closes
            return self._over_whole_map(query, seconds)
        places, arcs = topology.place_ids[route.places], topology.arc_ids[route.arcs]
        stats = PlanStats(
            expanded=expanded,
            expanded_places=route.expanded,
            corridor_cells=corridor.n_cells,
            seconds=seconds,
        )
        plan = CellPlan(
            cells,
            bound_cells=octile_distance_in_cells(*query.cells),
            route=Route(tuple(places.tolist()), tuple(arcs.tolist())),
            stats=stats,
        )
        return round_closed(plan, query, self._refiner)

    def _over_whole_map(self, query: CellQuery, seconds: dict[str, float]) -> CellPlan:
        """Return the plan on the whole map, with the seconds spent before."""
        whole = WholeMap(self._refiner, self._own).plan(query)
        return replace(whole, stats=replace(whole.stats, seconds=seconds | whole.stats.seconds))

    def plan_many(self, queries: CellQueries) -> None:
        """None, because each query has a search of its own; see `CellPlanner`."""

    def bound(self, plan: CellPlan, points: tuple[FloatArray, FloatArray]) -> float:  # noqa: ARG002
        """Return the straight distance; see `CellPlanner`."""
        return math.dist(*points)

    def fields(self, level: Level) -> IntArray:
        """Return the fields of the places; see `CellPlanner`."""
        return level.field_of
