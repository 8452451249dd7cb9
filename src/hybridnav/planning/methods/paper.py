"""Method `paper`: from a route of places to a path of cells, our reading of the source paper.

That paper has arcs with a maximum attribute, and neither a planner nor a cost of routes. The
cheapest coarse route by the max-distance attribute of the arcs is found first. It comes down the
pyramid to small fields, in which grid A* finds the path; or its places are the corridor at once.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from hybridnav import route as routes
from hybridnav._base.clock import clock
from hybridnav._base.copies import Source, copies_alike
from hybridnav._base.moves import octile_distance_in_cells
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.typing import IntArray, LongArray
from hybridnav.planning.methods.grid import KnownMap, WholeMap, on_cells, round_closed
from hybridnav.planning.settings import PaperSettings
from hybridnav.route.route import Corridor, Route, route_of_places
from hybridnav.search.descent import Descent, DescentSettings
from hybridnav.search.found import Found, MapChange, Method, Metric, PlanStats, Query
from hybridnav.topology.map import is_version

if TYPE_CHECKING:
    from hybridnav.route import MaxDistanceSearch

MOST_ROUND = 1.1
"""Times as long as the path without closed cells that one round them may be, if no search of the
whole map finds the best one."""
SMALL_PART = 0.25
"""Most of the map that a search in the fields kept at a level above is worth: in a corridor, a cell
takes twice as long as on the whole map."""


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
        self._resolution_m = known.grid.resolution_m
        self._whole_map = WholeMap(known, settings)
        self._refiner, self._own = self._whole_map.refiners
        self._is_plain = self._own is None and known.costs is None
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
        settings = self._settings
        return Descent(
            self._topology.pyramid,
            self._topology.grid.enterable(allow_unexplored=settings.allow_unexplored),
            DescentSettings(
                settings.field_cells, settings.step, settings.ring, settings.horizon_cells
            ),
            units=self._units,
            corner_cutting=self._topology.grid.corner_cutting,
        )

    def changed(self, change: MapChange) -> MaxDistance | None:
        """Return the method of the next version of the map, with its levels repaired; None to make
        it anew. See `Method`."""
        grid, topology, costs, cells = change
        before, now = self._topology.source, None if topology is None else topology.source
        if not is_version(now) or not is_version(before):
            return None
        patch = now.patched(before, cells)
        if patch is None or not isinstance(self._search, Descent):
            return None
        made = MaxDistance(KnownMap(grid, topology, costs), self._settings)
        enterable = grid.enterable(allow_unexplored=self._settings.allow_unexplored)
        made._search = self._search.changed(patch, enterable, made._units)
        return made

    @property
    def _units(self) -> IntArray | None:
        """The factor of each cell, None for lengths."""
        return None if self._refiner.costs is None else self._refiner.costs.units

    def find(self, query: Query) -> Found:
        """Find a path along the route; see `Method`."""
        began, search = clock(), self.prepare()
        if not isinstance(search, Descent):
            found = self._along(search, query, began)
        elif self._is_plain and self._settings.horizon_cells:
            found = self._in_one(search, query, began)
        else:
            found = self._down(search, query, began)
        if isinstance(search, Descent) and (found is None or self._is_cut(found, query)):
            found = self._widened(search, query, found) or found
        if found is None:
            return self._over_whole_map(query, {"coarse": clock() - began})
        if query.closed is not None and found.has_path:
            found = round_closed(found, query, self._refiner)
        if found.optimum is None and found.has_path and found.lower_bound_m < found.cost_m:
            found = replace(found, optimum=partial(self._optimum_m, query, found.cells))
        return found

    def _in_one(self, descent: Descent, query: Query, began: float) -> Found | None:
        """Return the path that a descent finds down to the cells, None to search the whole map."""
        one_way = query.one_way
        found = descent.find(*query.cells, one_way=one_way)
        places, cells, expanded, fields, corridor_cells, length = found
        seconds = {"descent": clock() - began}
        stats = PlanStats(expanded, fields, 0, corridor_cells, seconds)
        if cells is None:
            # Fields of one class that meet by sides are joined by arcs: no route, no path. Below
            # the first level, a side with a direction may lie in a field.
            is_open = self._topology.grid.corner_cutting or (one_way and length < math.inf)
            return None if is_open else Found(None, stats=stats)
        per_cell = self._resolution_m
        return Found(
            cells,
            length * per_cell,
            octile_distance_in_cells(*query.cells) * per_cell,
            route_source=self._route_of(places),
            optimum=partial(self._optimum_m, query, cells),
            stats=stats,
        )

    def _route_of(self, places: IntArray) -> Callable[[], Route] | None:
        """Return how to name the route of some places, None for none."""
        return partial(route_of_places, self._topology, places) if len(places) else None

    def _down(self, descent: Descent, query: Query, began: float) -> Found | None:
        """Return the path in the last fields of a descent, None to search the whole map."""
        down, corridor = descent.corridor(*query.cells)
        route = self._route_of(down.places)
        return self._refined(query, began, corridor, route, down.expanded_fields)

    def _is_cut(self, found: Found, query: Query) -> bool:
        closed = query.closed
        return (
            closed is not None and found.has_path and closed.meets(found.cells, self._topology.grid)
        )

    def _widened(self, descent: Descent, query: Query, cut: Found | None) -> Found | None:
        """Return a path round closed cells that a descent finds, by windows that go round them or
        in the fields kept at a level above; None if these are cut, or the way round is long: then a
        search of the whole map finds the best.

        `cut`: the answer that meets closed cells, None where costs close cells.
        """
        closed = None if query.closed is None else query.closed.flat
        is_plain = self._is_plain and self._settings.horizon_cells > 0
        stats, began = PlanStats() if cut is None else cut.stats, clock()
        if is_plain:
            down = descent.find(*query.cells, closed=closed, one_way=query.one_way)
            cells, expanded, n_cells = down.cells, down.expanded, down.corridor_cells
        else:
            cells, expanded, n_cells = None, 0, 0
        for up in (1,) if is_plain or cut is None else (0, 1):
            corridor = None if cells is not None else descent.corridor(*query.cells, up=up)[1]
            if corridor is None:
                break
            if corridor.n_cells > SMALL_PART * descent.n_cells:
                return None
            path = self._refiner.search.search(
                *query.cells,
                field_of=corridor.field_of,
                in_corridor=corridor.places,
                blocked=closed,
                one_way=query.one_way,
            )
            cells, n_cells = path.cells, corridor.n_cells
            expanded += path.expanded
        if cells is None:
            return None
        seconds = {**stats.seconds, "around": clock() - began}
        effort = stats.expanded + expanded
        stats = replace(stats, expanded=effort, corridor_cells=n_cells, seconds=seconds)
        bound = octile_distance_in_cells(*query.cells)
        found = on_cells(self._refiner, cells, bound_cells=bound, stats=stats)
        return None if cut is not None and found.cost_m > MOST_ROUND * cut.cost_m else found

    def _optimum_m(self, query: Query, cells: LongArray) -> float:
        """Return the least cost of a path of cells, metres, by A* on the whole map."""
        search, cost = self._refiner.search.search, self._refiner.cost_in_cells
        closed, one_way = None if query.closed is None else query.closed.flat, query.one_way
        best, least = search(*query.cells, blocked=closed).cells, cost(cells)
        # A path that directions allow is the best with them too, and found in half the time.
        if one_way is not None and best is not None and cost(best) < least and one_way.meets(best):
            best = search(*query.cells, blocked=closed, one_way=one_way).cells
        return (least if best is None else min(least, cost(best))) * self._resolution_m

    def _along(self, search: MaxDistanceSearch, query: Query, began: float) -> Found | None:
        """Return the path in the fields of the places, None to search the whole map."""
        topology = self._topology
        found = search.search(*map(topology.place_at, query.cells))
        if found is None:
            return self._refined(query, began, None, None, 0)
        beside, enterable = self._settings.corridor, search.enterable
        corridor = routes.corridor_of(topology, found.places, beside=beside, enterable=enterable)
        places, arcs = topology.place_ids[found.places], topology.arc_ids[found.arcs]
        route = Route(tuple(places.tolist()), tuple(arcs.tolist()))
        return self._refined(query, began, corridor, route, found.expanded)

    def _refined(
        self,
        query: Query,
        began: float,
        corridor: Corridor | None,
        route: Source[Route] | None,
        expanded_places: int,
    ) -> Found | None:
        """Return the path in a corridor, None to search the whole map."""
        seconds = {"coarse": clock() - began}
        if corridor is None:
            is_whole = self._topology.grid.corner_cutting
            stats = PlanStats(expanded_places=expanded_places, seconds=seconds)
            return None if is_whole else Found(None, stats=stats)
        cells, expanded = (self._own or self._refiner).refine(*query.cells, corridor)
        seconds["refine"] = clock() - began - seconds["coarse"]
        if cells is None and self._refiner.costs is not None:  # cells that the layer closes
            return None
        stats = PlanStats(expanded, expanded_places, 0, corridor.n_cells, seconds)
        bound = octile_distance_in_cells(*query.cells)
        return replace(
            on_cells(self._refiner, cells, bound_cells=bound, stats=stats), route_source=route
        )

    def _over_whole_map(self, query: Query, seconds: dict[str, float]) -> Found:
        """Return the answer on the whole map, with the seconds spent before."""
        whole = self._whole_map.find(query)
        return replace(whole, stats=replace(whole.stats, seconds=seconds | whole.stats.seconds))
