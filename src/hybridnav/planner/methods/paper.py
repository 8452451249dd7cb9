"""Method `paper`: from a route of places to a path of cells, our reading of the source paper.

That paper has arcs with a maximum attribute, and neither a planner nor a cost of routes. The
cheapest coarse route by the max-distance attribute of the arcs chooses receptive fields, and
grid A* finds the path inside them.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING

from hybridnav import route as routes
from hybridnav._base.clock import clock
from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import octile_distance_in_cells
from hybridnav._base.progress import no_progress
from hybridnav.planner.methods.grid import WholeMap, on_cells, round_closed
from hybridnav.route import Route
from hybridnav.search.found import Found, Method, PlanStats

if TYPE_CHECKING:
    from hybridnav._base.progress import Progress
    from hybridnav.planner.methods.grid import KnownMap
    from hybridnav.planner.settings import PaperSettings
    from hybridnav.route import MaxDistanceSearch
    from hybridnav.search.found import Metric, Query


@copies_alike
class MaxDistance(Method):
    """The cheapest coarse route by max-distance arcs, and a refiner in its corridor.

    If corners may be cut, a path can pass between fields that no arc joins, so that a missing route
    proves nothing: then the whole map is searched.

    `known`: the map with its places, and its costs; `settings`: whether unexplored cells may be
    entered, the corridor, and the refiner.
    """

    def __init__(self, known: KnownMap, settings: PaperSettings) -> None:
        assert known.topology is not None  # noqa: S101 - no method of places is made without
        self.metric: Metric = "octile" if known.costs is None else "weighted"
        self._topology, self._settings = known.topology, settings
        self._whole_map = WholeMap(known, settings)
        self._refiner, self._own = self._whole_map.refiners
        self._search: MaxDistanceSearch | None = None
        self._building = threading.RLock()  # a progress callback may plan

    def prepare(self, progress: Progress = no_progress) -> MaxDistanceSearch:
        """Compute the attributes of the arcs; see `Method`."""
        if self._search is None:
            allowed = self._settings.allow_unexplored
            with self._building:
                if self._search is None:
                    self._search = routes.MaxDistanceSearch(
                        self._topology, allow_unexplored=allowed
                    )
                    progress(1, 1)
        return self._search

    def find(self, query: Query) -> Found:
        """Find the shortest path in the corridor; see `Method`."""
        began = clock()
        topology, search = self._topology, self.prepare()
        route = search.search(*map(topology.place_at, query.cells))
        seconds = {"coarse": clock() - began}
        if route is None and topology.grid.corner_cutting:
            return self._over_whole_map(query, seconds)
        if route is None:
            return Found(None, stats=PlanStats(seconds=seconds))
        beside, enterable = self._settings.corridor, search.enterable
        corridor = routes.corridor_of(topology, route.places, beside=beside, enterable=enterable)
        seconds["coarse"] = clock() - began
        cells, expanded = (self._own or self._refiner).refine(*query.cells, corridor)
        seconds["refine"] = clock() - began - seconds["coarse"]
        if cells is None and self._refiner.costs is not None:  # cells that the layer closes
            return self._over_whole_map(query, seconds)
        places, arcs = topology.place_ids[route.places], topology.arc_ids[route.arcs]
        stats = PlanStats(
            expanded=expanded,
            expanded_places=route.expanded,
            corridor_cells=corridor.n_cells,
            seconds=seconds,
        )
        bound = octile_distance_in_cells(*query.cells)
        found = on_cells(self._refiner, cells, bound_cells=bound, stats=stats)
        chosen = Route(tuple(places.tolist()), tuple(arcs.tolist()))
        return round_closed(replace(found, route=chosen), query, self._refiner)

    def _over_whole_map(self, query: Query, seconds: dict[str, float]) -> Found:
        """Return the answer on the whole map, with the seconds spent before."""
        whole = self._whole_map.find(query)
        return replace(whole, stats=replace(whole.stats, seconds=seconds | whole.stats.seconds))
