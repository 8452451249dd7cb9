"""Plans for the page: planners by preset, and answers as plain values in grid units."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any

import shapely

from hybridnav.errors import InvalidValueError
from hybridnav.ext.page.graph import in_grid, in_metres
from hybridnav.planner import Blocked, load_preset, plan_alternatives, plan_tour, preset_names

if TYPE_CHECKING:
    from hybridnav.ext.fleet import BuildingPlan
    from hybridnav.ext.page.requests import (
        AlternativesQuery,
        FloorClosed,
        PartQuery,
        PathQuery,
        PlanQuery,
    )
    from hybridnav.maps.costs import CostLayer
    from hybridnav.planner import HybridPlanner, PlanResult, Preset, Tour
    from hybridnav.planner.saved import Model
    from hybridnav.topology import TopologicalMap

GRID = "grid-astar"
"""The preset of the optimum on the grid."""


class PagePlanning:
    """The planners of one topological map, made when a preset is first asked for.

    Parameters
    ----------
    model
        The map or model.
    topology
        Its topological map with rooms.
    settings
        The preset that the page begins with; its section `pyramid` holds for all.
    costs
        Costs given beside the presets, None for none.
    """

    def __init__(
        self,
        model: Model,
        topology: TopologicalMap,
        settings: Preset,
        costs: CostLayer | None = None,
    ) -> None:
        self.topology = topology
        self.grid = topology.grid
        self._model, self._settings, self._costs = model, settings, costs
        self._planners: dict[str, HybridPlanner] = {}
        self._making = threading.Lock()

    @property
    def presets(self) -> list[str]:
        """The names to choose from, the one of the start first."""
        first = self._settings.name
        return [first, *(name for name in preset_names() if name != first)]

    def adopt(self, planner: HybridPlanner) -> None:
        """Take a planner over that is there already, with what it has prepared, unless the rooms
        have changed."""
        if planner.topology is self.topology:
            self._planners[planner.preset.name] = planner

    def planner(self, name: str) -> HybridPlanner:
        """Return the planner of a preset.

        Raises
        ------
        HybridNavError
            When there is no such preset, or it cannot plan on this map.
        """
        with self._making:
            if name not in self._planners:
                self._planners[name] = self._made(name)
            return self._planners[name]

    def _made(self, name: str) -> HybridPlanner:
        preset = self._settings
        if name != preset.name:
            if name not in self.presets:
                raise InvalidValueError(f"no preset is called {name!r:.80}")
            preset = load_preset(name).model_copy(update={"pyramid": self._settings.pyramid})
        return self._model.planner(preset, topology=self.topology, costs=self._costs)

    def plan(self, query: PlanQuery) -> dict[str, Any]:
        """Return a plan with its certificate; unless it is brief, with rooms, doors and words."""
        planner, points = self.planner(query.preset), self._points(query)
        closed = self._closed(query)
        if query.brief:
            return self._facts(planner.plan(*points, blocked=closed))
        tour = plan_tour(planner, points, blocked=closed)
        return self._facts(tour.results[0]) | self._itinerary(tour)

    def on_floor(self, query: PartQuery) -> PlanResult:
        """Return the plan itself, to be written."""
        points, closed = self._points(query), self._closed(query)
        return self.planner(query.preset).plan(*points, blocked=closed)

    def kept(self) -> HybridPlanner:
        """Return what a model of the map holds."""
        return self.planner(self.presets[0])

    @property
    def links(self) -> list[dict[str, Any]]:
        """The links that join a map with others: none."""
        return []

    def alternatives(self, query: AlternativesQuery) -> dict[str, Any]:
        """Return some routes that differ for people."""
        start, goal = self._points(query)
        found = plan_alternatives(
            self.planner(query.preset),
            start,
            goal,
            query.count,
            by=query.by,
            blocked=self._closed(query),
        )
        routes = [
            self._facts(each.result)
            | self._itinerary(each.tour)
            | {"overlap": round(each.overlap, 3)}
            for each in found
        ]
        return {"routes": routes, "complete": found.complete, "note": found.note}

    def _points(self, query: PathQuery) -> tuple[tuple[float, ...], tuple[float, ...]]:
        start, goal = (in_metres(end.point, self.grid) for end in (query.start, query.goal))
        if not self.planner(query.preset).needs_headings:
            return start, goal
        yaw = math.atan2(goal[1] - start[1], goal[0] - start[0])
        return (*start, yaw), (*goal, yaw)

    def _closed(self, query: PathQuery) -> Blocked | None:
        if query.closed.links:
            raise InvalidValueError(f"one map has no links, got {query.closed.links[0]!r:.80}")
        return next(map(self.blocked, query.closed.floors), None)

    def blocked(self, closed: FloorClosed) -> Blocked | None:
        """Return what is closed, in metres; None for nothing.

        Raises
        ------
        InvalidValueError
            When the corners of an area make no polygon.
        """
        if not closed:
            return None
        areas: list[list[tuple[float, float]]] = [
            [in_metres(p, self.grid) for p in ring] for ring in closed.polygons
        ]
        for ring in areas:
            if not shapely.Polygon(ring).is_valid:
                raise InvalidValueError(
                    "the drawn area crosses itself: draw its corners in one turn round it"
                )
        return Blocked(doors=closed.doors, rooms=closed.rooms, polygons=areas)

    def _facts(self, result: PlanResult) -> dict[str, Any]:
        """Return the figures and the line of a plan."""
        path = result.path
        lines = [] if path is None else [in_grid(path.points, self.grid)]
        parts = [{"floor": 0, "line": line} for line in lines]
        length_m = None if path is None else path.length_m
        return facts_of(result, parts) | {"length_m": finite(length_m)}

    def _itinerary(self, tour: Tour) -> dict[str, Any]:
        """Return rooms, doors and words of a plan, and the places that it passes."""
        route = tour.results[0].route
        return {
            "legs": [
                {
                    "room": leg.room or f"the {leg.shape}",
                    "door": leg.door.number if leg.door else None,
                }
                for leg in tour.legs
            ],
            "words": tour.words(),
            "places": list(route.places) if route is not None else [],
        }


def facts_of(plan: PlanResult | BuildingPlan, parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of a plan, and its lines floor by floor; None stands for what is not
    finite."""
    return {
        "status": str(plan.status),
        "solved": plan.solved,
        "metric": plan.metric,
        "parts": parts,
        "seconds": round(sum(plan.stats.seconds.values()), 6),
    } | {name: finite(getattr(plan, name)) for name in ("cost", "lower_bound", "gap")}


def finite(value: float | None) -> float | None:
    """Return a number, None for what JSON cannot hold."""
    return value if value is not None and math.isfinite(value) else None
