"""The hybrid planner: coarse on the topological map, fine inside the fields it chose."""

from __future__ import annotations

import math
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.config import Preset, load_preset
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.refine import GridRefiner, path_of
from hybridnav.result import PlanResult, PlanStats, PlanStatus, Route
from hybridnav.route import MaxDistanceSearch, PortalSearch, Walks, corridor_of
from hybridnav.search.octile import octile_distance_in_cells

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import LongArray, PathLike
    from hybridnav.refine import Refiner
    from hybridnav.route import CoarseRoute, Corridor
    from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]

_BAD_START = {
    CellClass.OCCUPIED: PlanStatus.START_OCCUPIED,
    CellClass.UNEXPLORED: PlanStatus.START_UNEXPLORED,
}
_BAD_GOAL = {
    CellClass.OCCUPIED: PlanStatus.GOAL_OCCUPIED,
    CellClass.UNEXPLORED: PlanStatus.GOAL_UNEXPLORED,
}


class HybridPlanner:
    """Plans paths between points of one map by a preset.

    Parameters
    ----------
    topology
        The topological map, and through it the grid. It may have been built otherwise than the
        preset's `pyramid` section says: results record how it was.
    preset
        Name of a preset, path to a preset file, or a `Preset`.

    Raises
    ------
    PresetError
        When the preset does not exist or is not valid.
    """

    def __init__(self, topology: TopologicalMap, *, preset: PathLike | Preset = "paper") -> None:
        self.topology = topology
        self.preset = load_preset(preset)
        settings = self.preset.planner
        self._coarse: MaxDistanceSearch | None = None
        if settings.coarse == "max-distance":
            self._coarse = MaxDistanceSearch(topology, allow_unexplored=settings.allow_unexplored)
        self._portals: PortalSearch | None = None
        if settings.coarse == "portals":
            self._portals = PortalSearch(topology, allow_unexplored=settings.allow_unexplored)
            self._walks = Walks(topology)
        self._refiner: Refiner = GridRefiner(
            topology.grid, allow_unexplored=settings.allow_unexplored
        )

    def plan(self, start: ArrayLike, goal: ArrayLike) -> PlanResult:
        """Plan a path between two points.

        Parameters
        ----------
        start, goal
            `(x, y)` in metres, map frame. The path runs between the centres of the cells that hold
            them; nothing is snapped to free space.

        Returns
        -------
        PlanResult
            Solved, or with a status that names what is wrong.

        Raises
        ------
        InvalidValueError
            When a point is not two finite numbers.
        """
        first, last = self._cell_of("start", start), self._cell_of("goal", goal)
        if first is None:
            return self._answer(PlanStatus.START_OUTSIDE)
        if last is None:
            return self._answer(PlanStatus.GOAL_OUTSIDE)
        status = self._refusal(first, last)
        if status is not None:
            return self._answer(status)
        if self._portals is not None:
            return self._plan_over_portals(self._portals, first, last)
        return self._plan_cells(first, last)

    def _plan_over_portals(self, search: PortalSearch, first: Cell, last: Cell) -> PlanResult:
        began = time.perf_counter()
        cells, expanded = search.path(first, last)
        seconds = {"coarse": time.perf_counter() - began}
        if cells is None:
            return self._answer(PlanStatus.NO_PATH, stats=PlanStats(expanded, seconds=seconds))
        n_cells = 0
        if self.preset.planner.refine == "grid-astar":
            corridor = search.corridor(cells)
            n_cells = corridor.n_cells
            path, refined = self._refiner.refine(first, last, corridor)
            seconds["refine"] = time.perf_counter() - began - seconds["coarse"]
            expanded += refined
        else:
            path = path_of(self.topology.grid, cells)
        if path is None:
            return self._answer(PlanStatus.NO_PATH, stats=PlanStats(expanded, seconds=seconds))
        walked = partial(self._walked, path.cells)
        bound = octile_distance_in_cells(first, last) * self.topology.grid.resolution_m
        return self._answer(
            PlanStatus.SOLVED,
            path=path,
            route_source=walked,
            lower_bound=min(bound, path.length_m),
            stats=PlanStats(expanded, corridor_cells=n_cells, seconds=seconds),
        )

    def _plan_cells(self, first: Cell, last: Cell) -> PlanResult:
        began = time.perf_counter()
        route, corridor, solvable = self._choose_corridor(first, last)
        chosen = time.perf_counter()
        seconds = {"coarse": chosen - began}
        expanded_places = route.expanded if route is not None else 0
        if not solvable:
            stats = PlanStats(expanded_places=expanded_places, seconds=seconds)
            return self._answer(PlanStatus.NO_PATH, stats=stats)
        path, expanded = self._refiner.refine(first, last, corridor)
        seconds["refine"] = time.perf_counter() - chosen
        stats = PlanStats(
            expanded=expanded,
            expanded_places=expanded_places,
            corridor_cells=corridor.n_cells if corridor is not None else 0,
            seconds=seconds,
        )
        if path is None:
            return self._answer(PlanStatus.NO_PATH, stats=stats)
        bound = path.length_m
        if corridor is not None:
            bound = octile_distance_in_cells(first, last) * self.topology.grid.resolution_m
        return self._answer(
            PlanStatus.SOLVED,
            path=path,
            route_source=None if route is None else partial(self._route, route),
            lower_bound=min(bound, path.length_m),
            stats=stats,
        )

    def _choose_corridor(
        self, start: Cell, goal: Cell
    ) -> tuple[CoarseRoute | None, Corridor | None, bool]:
        """The coarse route, its corridor (None: the whole map), and whether there may be a path."""
        if self._coarse is None:
            return None, None, True
        topology = self.topology
        route = self._coarse.search(topology.place_at(start), topology.place_at(goal))
        if route is None:
            return None, None, False
        beside = self._coarse.enterable if self.preset.planner.corridor == "neighbours" else None
        return route, corridor_of(topology, route.places, neighbours=beside), True

    def _route(self, coarse: CoarseRoute) -> Route:
        places, arcs = self.topology.place_ids, self.topology.arc_ids
        return Route(tuple(places[coarse.places].tolist()), tuple(arcs[coarse.arcs].tolist()))

    def _walked(self, cells: LongArray) -> Route:
        """The places and arcs that a path passes."""
        places, arcs = self._walks.of(cells)
        ids = self.topology.place_ids, self.topology.arc_ids
        return Route(tuple(ids[0][places].tolist()), tuple(ids[1][arcs].tolist()))

    def _refusal(self, start: Cell, goal: Cell) -> PlanStatus | None:
        """Status of a query that cannot be planned for where its ends lie."""
        for cell, bad in ((start, _BAD_START), (goal, _BAD_GOAL)):
            of_class = CellClass(self.topology.grid.classes[cell])
            if of_class is CellClass.UNEXPLORED and self.preset.planner.allow_unexplored:
                continue
            if of_class in bad:
                return bad[of_class]
        return None

    def _cell_of(self, name: str, point: ArrayLike) -> Cell | None:
        """The cell that holds a point, None where it lies outside the map."""
        try:
            xy = np.asarray(point, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            xy = np.empty(0)
        if xy.shape != (2,) or not all(map(math.isfinite, xy)):
            raise InvalidValueError(
                f"{name} must be two finite coordinates (x, y) in metres, got {point!r:.80}"
            )
        row, col = self.topology.grid.frame.cells_of(xy).tolist()
        rows, cols = self.topology.grid.shape
        return (row, col) if 0 <= row < rows and 0 <= col < cols else None

    def _answer(self, status: PlanStatus, **outcome: Any) -> PlanResult:
        """A result that records the preset and how the pyramid was built."""
        pyramid = self.topology.pyramid
        settings = {
            "preset": self.preset.name,
            "planner": self.preset.planner.model_dump(),
            "pyramid": {
                "merge_distance_m": pyramid.merge_distance_m,
                "linkage": pyramid.linkage,
                "seed": pyramid.seed,
                "robot_radius_m": pyramid.grid.robot_radius_m,
            },
        }
        return PlanResult(status, settings=settings, **outcome)
