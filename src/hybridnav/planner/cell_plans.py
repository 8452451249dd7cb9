"""How the presets find cell paths: over the whole map, by max-distance arcs, over portals."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hybridnav.result import Route
from hybridnav.route import MaxDistanceSearch, PortalSearch, corridor_of
from hybridnav.search.octile import octile_distance_in_cells, path_length_in_cells

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.config import PlannerSettings
    from hybridnav.refine import GridRefiner
    from hybridnav.result import Metric
    from hybridnav.route import Effort
    from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]


@dataclass(frozen=True, eq=False)
class CellPlan:
    """A path between two cells, None for its cells where there is none."""

    cells: LongArray | None
    metric: Metric = "octile"
    points: FloatArray | None = None
    """Centres of the cells, where they are known already, or the points of an any-angle path."""
    length_cells: float | None = None
    """Length of the path, where it is known already."""
    bound_cells: float = 0.0
    """No path is shorter; in cells."""
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
    """bool (n,), whether the answer is that of `plan`; False where that is yet to be asked."""
    metric: Metric
    cost_m: FloatArray
    """float64 (n,), lengths in metres, infinite where there is no path."""
    lower_bound_m: FloatArray
    path_start: LongArray
    """int64 (n + 1,), where the points of each path begin."""
    points: FloatArray
    """float64 (m, 2), (x, y) in metres, map frame."""


class CellPlanner(Protocol):
    """Plans between two cells that may be entered."""

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find a path, as good as the preset asks for."""
        ...


class WholeMap:
    """Grid A* on the whole map: optimal."""

    def __init__(self, refiner: GridRefiner) -> None:
        self._refiner = refiner

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find a shortest path; see `CellPlanner`."""
        began = time.perf_counter()
        cells, expanded = self._refiner.refine(start, goal, None)
        bound = np.inf if cells is None else path_length_in_cells(cells)
        seconds = {"refine": time.perf_counter() - began}
        return CellPlan(cells, bound_cells=bound, expanded=expanded, seconds=seconds)


class MaxDistance:
    """The cheapest coarse route by max-distance arcs, and grid A* in its corridor.

    Where corners may be cut a path can pass between fields that no arc joins, so that a missing
    route proves nothing: the whole map is searched then.
    """

    def __init__(
        self, topology: TopologicalMap, refiner: GridRefiner, settings: PlannerSettings
    ) -> None:
        self._topology = topology
        self._refiner = refiner
        self._search = MaxDistanceSearch(topology, allow_unexplored=settings.allow_unexplored)
        self._beside = self._search.enterable if settings.corridor == "neighbours" else None
        self._corner_cutting = topology.grid.corner_cutting

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find the shortest path in the corridor; see `CellPlanner`."""
        began = time.perf_counter()
        topology = self._topology
        route = self._search.search(topology.place_at(start), topology.place_at(goal))
        seconds = {"coarse": time.perf_counter() - began}
        if route is None and self._corner_cutting:
            whole = WholeMap(self._refiner).plan(start, goal)
            return replace(whole, seconds=seconds | whole.seconds)
        if route is None:
            return CellPlan(None, seconds=seconds)
        corridor = corridor_of(topology, route.places, neighbours=self._beside)
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


class OverPortals:
    """The way by the portal table, improved as far as the preset asks for."""

    def __init__(
        self, topology: TopologicalMap, refiner: GridRefiner, settings: PlannerSettings
    ) -> None:
        self.search = PortalSearch(
            topology,
            refiner.search,
            all_gates=settings.refine == "gates",
            allow_unexplored=settings.allow_unexplored,
        )
        self._resolution_m = topology.grid.resolution_m
        self._epsilon = settings.epsilon
        self._effort: Effort = "exact" if settings.refine == "gates" else "stored"

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find a path over portals; see `CellPlanner`."""
        began = time.perf_counter()
        found = self.search.path(start, goal, effort=self._effort, epsilon=self._epsilon or 0.0)
        return CellPlan(
            found.cells,
            points=found.points,
            length_cells=found.length_cells,
            bound_cells=found.lower_bound_cells,
            expanded=found.expanded,
            expanded_gates=found.expanded_gates,
            seconds={"portals": time.perf_counter() - began},
        )

    def plan_many(self, starts: LongArray, goals: LongArray) -> CellPlans:
        """The same for many pairs of cells, int64 (n, 2) each, as far as look-ups answer them."""
        found = self.search.many(starts, goals, effort=self._effort, epsilon=self._epsilon or 0.0)
        per_cell = self._resolution_m
        return CellPlans(
            found.is_done,
            "octile",
            found.length_cells * per_cell,
            found.lower_bound_cells * per_cell,
            found.path_start,
            found.points,
        )
