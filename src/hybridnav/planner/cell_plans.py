"""Planners of cell paths: over the whole map, by max-distance arcs, over portals."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hybridnav import portals
from hybridnav import route as routes
from hybridnav._copies import copies_alike
from hybridnav._progress import no_progress
from hybridnav.result import Route
from hybridnav.search.moves import octile_distance_in_cells, path_length_in_cells

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._progress import Progress
    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.config import PlannerSettings
    from hybridnav.jumps import JumpSearch
    from hybridnav.mesh import MeshSearch
    from hybridnav.portals import BuiltPortals, PortalSearch
    from hybridnav.refine import GridRefiner
    from hybridnav.result import Metric
    from hybridnav.route import MaxDistanceSearch
    from hybridnav.topology import TopologicalMap

    Prepared = MeshSearch | JumpSearch | BuiltPortals
    """What planners of cell paths build of a map."""

Cell = tuple[int, int]


@dataclass(frozen=True, eq=False)
class CellPlan:
    """A path between two cells; its cells are None if there is none."""

    cells: LongArray | None
    metric: Metric = "octile"
    points: FloatArray | None = None
    """Centres of the cells, if known already, or the points of an any-angle path."""
    length_cells: float | None = None
    """Length of the path, if known already."""
    bound_cells: float = 0.0
    """Lower bound on the length of all paths, in cells."""
    route_source: Callable[[], Route] | None = None
    expanded: int = 0
    expanded_places: int = 0
    expanded_gates: int = 0
    corridor_cells: int = 0
    seconds: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class CellPlans:
    """Paths of many queries, arrays of n."""

    is_done: BoolArray
    """bool (n,), whether the answer is that of `plan`; False if `plan` must still be called."""
    metric: Metric
    cost_m: FloatArray
    """float64 (n,), lengths in metres, infinite if there is no path."""
    lower_bound_m: FloatArray
    path_start: LongArray
    """int64 (n + 1,), offsets of the points of each path."""
    points: FloatArray
    """float64 (m, 2), (x, y) in metres, map frame."""


class CellPlanner(Protocol):
    """Planner between two cells that may be entered."""

    @property
    def prepared(self) -> Prepared | None:
        """The structure for queries that is worth keeping, None until it is built."""
        ...

    def prepare(self, progress: Progress = no_progress) -> object:
        """Build the structures for queries, once, and report each step; else the first query does
        it."""
        ...

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find a path of the quality that the preset requires."""
        ...


class WholeMap:
    """Grid A* on the whole map: optimal."""

    def __init__(self, refiner: GridRefiner) -> None:
        self._refiner = refiner

    @property
    def prepared(self) -> None:
        """None, because the legal moves of cells are quick to find; see `CellPlanner`."""
        return

    def prepare(self, progress: Progress = no_progress) -> object:
        """Build the search of cells; see `CellPlanner`."""
        search = self._refiner.search
        progress(1, 1)
        return search

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find a shortest path; see `CellPlanner`."""
        began = time.perf_counter()
        cells, expanded = self._refiner.refine(start, goal, None)
        bound = np.inf if cells is None else path_length_in_cells(cells)
        seconds = {"refine": time.perf_counter() - began}
        return CellPlan(cells, bound_cells=bound, expanded=expanded, seconds=seconds)


@copies_alike
class MaxDistance:
    """The cheapest coarse route by max-distance arcs, and grid A* in its corridor.

    If corners may be cut, a path can pass between fields that no arc joins, so that a missing route
    proves nothing: then the whole map is searched.
    """

    def __init__(
        self, topology: TopologicalMap, refiner: GridRefiner, settings: PlannerSettings
    ) -> None:
        self._topology = topology
        self._refiner = refiner
        self._settings = settings
        self._search: MaxDistanceSearch | None = None
        self._building = threading.Lock()

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

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find the shortest path in the corridor; see `CellPlanner`."""
        began = time.perf_counter()
        topology, search = self._topology, self.prepare()
        route = search.search(topology.place_at(start), topology.place_at(goal))
        seconds = {"coarse": time.perf_counter() - began}
        if route is None and topology.grid.corner_cutting:
            whole = WholeMap(self._refiner).plan(start, goal)
            return replace(whole, seconds=seconds | whole.seconds)
        if route is None:
            return CellPlan(None, seconds=seconds)
        beside = search.enterable if self._settings.corridor == "neighbours" else None
        corridor = routes.corridor_of(topology, route.places, neighbours=beside)
        seconds["coarse"] = time.perf_counter() - began
        cells, expanded = self._refiner.refine(start, goal, corridor)
        seconds["refine"] = time.perf_counter() - began - seconds["coarse"]
        ids = topology.place_ids, topology.arc_ids
        return CellPlan(
            cells,
            bound_cells=octile_distance_in_cells(start, goal),
            route_source=partial(_route, *ids, route.places, route.arcs),
            expanded=expanded,
            expanded_places=route.expanded,
            corridor_cells=corridor.n_cells,
            seconds=seconds,
        )


def _route(place_ids: LongArray, arc_ids: LongArray, places: LongArray, arcs: LongArray) -> Route:
    return Route(tuple(place_ids[places].tolist()), tuple(arc_ids[arcs].tolist()))


@copies_alike
class OverPortals:
    """The shortest path by the portal table, which is built when the first query needs it."""

    def __init__(
        self,
        topology: TopologicalMap,
        refiner: GridRefiner,
        settings: PlannerSettings,
        built: BuiltPortals | None = None,
    ) -> None:
        self._topology = topology
        self._refiner = refiner
        self._settings = settings
        self._built = built
        self._search: PortalSearch | None = None
        self._building = threading.Lock()

    @property
    def prepared(self) -> BuiltPortals | None:
        """Portals and tables, None until they are built."""
        return self._built

    def prepare(self, progress: Progress = no_progress) -> PortalSearch:
        """Build portals and table, once; see `CellPlanner`."""
        if self._search is None:
            with self._building:
                if self._search is None:
                    if self._built is None:
                        self._built = portals.prepare_portals(
                            self._topology,
                            allow_unexplored=self._settings.allow_unexplored,
                            progress=progress,
                        )
                    frame = self._topology.grid.frame
                    self._search = portals.PortalSearch(self._built, self._refiner.search, frame)
        return self._search

    @property
    def search(self) -> PortalSearch:
        """The search over portals, built on first use."""
        return self.prepare()

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find a path over portals; see `CellPlanner`."""
        began, seconds = time.perf_counter(), {}
        if self._search is None:
            self.prepare()
            seconds["table"] = time.perf_counter() - began
        now, epsilon = time.perf_counter(), self._settings.epsilon or 0.0
        found = self.search.path(start, goal, epsilon=epsilon)
        seconds["portals"] = time.perf_counter() - now
        return CellPlan(
            found.cells,
            points=found.points,
            length_cells=found.length_cells,
            bound_cells=found.lower_bound_cells,
            expanded=found.expanded,
            expanded_gates=found.expanded_gates,
            seconds=seconds,
        )

    def plan_many(self, starts: LongArray, goals: LongArray) -> CellPlans:
        """Plan many pairs of cells, int64 (n, 2) each, as far as look-ups answer them."""
        epsilon = self._settings.epsilon or 0.0
        found = self.search.many(starts, goals, epsilon=epsilon)
        per_cell = self._topology.grid.resolution_m
        return CellPlans(
            found.is_done,
            "octile",
            found.length_cells * per_cell,
            found.lower_bound_cells * per_cell,
            found.path_start,
            found.points,
        )
