"""Method `paper`: from a route of places to a path of cells, our reading of the source paper.

That paper has arcs with a maximum attribute, and neither a planner nor a cost of routes. The
cheapest coarse route by the max-distance attribute of the arcs is found first. It comes down the
pyramid to small fields, in which grid A* finds the path; or its places are the corridor at once.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from hybridnav import route as routes
from hybridnav._base.clock import clock
from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import octile_distance_in_cells, path_length_in_cells
from hybridnav._base.progress import Progress, no_progress
from hybridnav.planner.methods.grid import KnownMap, WholeMap, on_cells, round_closed
from hybridnav.route.route import Route, RouteOfPlaces
from hybridnav.search.descent import Descent, DescentSettings
from hybridnav.search.found import Found, Method, PlanStats

if TYPE_CHECKING:
    from hybridnav._base.typing import LongArray
    from hybridnav.planner.settings import PaperSettings
    from hybridnav.route import MaxDistanceSearch
    from hybridnav.search.found import Metric, Query


@copies_alike
class MaxDistance(Method):
    """The cheapest coarse route by max-distance arcs, and a path of cells along it.

    If corners may be cut, a path can pass between fields that no arc joins, so that a missing route
    proves nothing; nor does a missing path where costs close cells. Then the whole map is searched.

    `known`: the map with its places, and its costs; `settings`: whether unexplored cells may be
    entered, how the route becomes a corridor, and the refiner.
    """

    def __init__(self, known: KnownMap, settings: PaperSettings) -> None:
        assert known.topology is not None  # noqa: S101 - no method of places is made without
        self.metric: Metric = "octile" if known.costs is None else "weighted"
        self._topology, self._settings = known.topology, settings
        self._whole_map = WholeMap(known, settings)
        self._refiner, self._own = self._whole_map.refiners
        self._search: MaxDistanceSearch | Descent | None = None
        self._building = threading.RLock()  # a progress callback may plan

    def prepare(self, progress: Progress = no_progress) -> MaxDistanceSearch | Descent:
        """Pack the levels, or compute the attributes of the arcs; see `Method`."""
        if self._search is None:
            with self._building:
                if self._search is None:
                    by_places = self._settings.levels == "places"
                    self._search = self._over_places() if by_places else self._descent()
                    progress(1, 1)
        return self._search

    def _over_places(self) -> MaxDistanceSearch:
        allowed = self._settings.allow_unexplored
        return routes.MaxDistanceSearch(self._topology, allow_unexplored=allowed)

    def _descent(self) -> Descent:
        settings, costs = self._settings, self._refiner.costs
        return Descent(
            self._topology.pyramid,
            self._topology.grid.enterable(allow_unexplored=settings.allow_unexplored),
            DescentSettings(
                settings.field_cells, settings.step, settings.ring, settings.horizon_cells
            ),
            units=None if costs is None else costs.units,
            corner_cutting=self._topology.grid.corner_cutting,
        )

    def find(self, query: Query) -> Found:
        """Find a path along the route; see `Method`."""
        began, search = clock(), self.prepare()
        found = (
            self._down(search, query, began)
            if isinstance(search, Descent)
            else self._along(search, query, began)
        )
        if found is None:
            return self._over_whole_map(query, {"coarse": clock() - began})
        if not found.has_path:
            return found
        return round_closed(found, query, self._refiner)

    def _down(self, descent: Descent, query: Query, began: float) -> Found | None:
        """Return the path that a descent leads to, None to search the whole map."""
        is_plain = self._own is None and self._refiner.costs is None
        if is_plain and self._settings.horizon_cells:
            down, corridor = descent.find(*query.cells), None
            cells, expanded = down.cells, down.expanded
            seconds = {"descent": clock() - began}
        else:
            down, corridor = descent.corridor(*query.cells)
            seconds = {"coarse": clock() - began}
            cells, expanded = None, 0
        if corridor is not None:
            cells, expanded = (self._own or self._refiner).refine(*query.cells, corridor)
            seconds["refine"] = clock() - began - seconds["coarse"]
        is_whole = self._topology.grid.corner_cutting
        stats = PlanStats(
            expanded=expanded,
            expanded_places=down.expanded_fields,
            corridor_cells=down.corridor_cells,
            seconds=seconds,
        )
        if corridor is None and cells is None:
            # Fields of one class that meet by sides are joined by arcs: no route, no path.
            return None if is_whole else Found(None, stats=stats)
        if cells is None and self._refiner.costs is not None:  # cells that the layer closes
            return None
        bound = octile_distance_in_cells(*query.cells)
        found = on_cells(self._refiner, cells, bound_cells=bound, stats=stats)
        route = RouteOfPlaces(self._topology, down.places) if len(down.places) else None
        if is_plain and cells is not None:
            return replace(found, route=route, optimum=partial(self._optimum_m, query, cells))
        return replace(found, route=route)

    def _optimum_m(self, query: Query, cells: LongArray) -> float:
        """Return the length of a shortest path of cells, metres, by A* on the whole map."""
        search = self._refiner.search.search
        closed = None if query.closed is None else query.closed.flat
        best = search(*query.cells, blocked=closed)
        lengths = [path_length_in_cells(each) for each in (cells, best.cells) if each is not None]
        return min(lengths) * self._topology.grid.resolution_m

    def _along(self, search: MaxDistanceSearch, query: Query, began: float) -> Found | None:
        """Return the path in the fields of the places, None to search the whole map."""
        topology = self._topology
        route = search.search(*map(topology.place_at, query.cells))
        seconds = {"coarse": clock() - began}
        if route is None and topology.grid.corner_cutting:
            return None
        if route is None:
            return Found(None, stats=PlanStats(seconds=seconds))
        beside, enterable = self._settings.corridor, search.enterable
        corridor = routes.corridor_of(topology, route.places, beside=beside, enterable=enterable)
        seconds["coarse"] = clock() - began
        cells, expanded = (self._own or self._refiner).refine(*query.cells, corridor)
        seconds["refine"] = clock() - began - seconds["coarse"]
        if cells is None and self._refiner.costs is not None:  # cells that the layer closes
            return None
        places, arcs = topology.place_ids[route.places], topology.arc_ids[route.arcs]
        stats = PlanStats(
            expanded=expanded,
            expanded_places=route.expanded,
            corridor_cells=corridor.n_cells,
            seconds=seconds,
        )
        bound = octile_distance_in_cells(*query.cells)
        found = on_cells(self._refiner, cells, bound_cells=bound, stats=stats)
        return replace(found, route=Route(tuple(places.tolist()), tuple(arcs.tolist())))

    def _over_whole_map(self, query: Query, seconds: dict[str, float]) -> Found:
        """Return the answer on the whole map, with the seconds spent before."""
        whole = self._whole_map.find(query)
        return replace(whole, stats=replace(whole.stats, seconds=seconds | whole.stats.seconds))
