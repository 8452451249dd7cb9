"""Plans of one map by one method: a query in, a path found, refined, and a result out."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.clock import clock
from hybridnav._base.copies import Source, copies_alike
from hybridnav._base.threads import keep_last
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError, MapWarning
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.planning import Path, PlanBatch, PlanResult, Preset
from hybridnav.planning.costs import PlannerCosts
from hybridnav.planning.endpoints import Ends, check_at, places_of_endpoints, read_ends, refusal
from hybridnav.planning.finishes import Finish, Finished, checked_smooth, make_finish
from hybridnav.planning.nearest import check_within, nearest_reachable, way_out
from hybridnav.planning.result import PlannedOn, Walk, plan_many
from hybridnav.planning.settings import Smooth
from hybridnav.route.route import Route, RouteFinder, route_of_cells
from hybridnav.search.found import Cell, ClosedCells, KeptLine, Method, PlanStats, PlanStatus, Query
from hybridnav.topology import TopologicalMap
from hybridnav.topology.map import no_places

if TYPE_CHECKING:
    from hybridnav.closures.blocked import Blocked, Closable
    from hybridnav.planning.methods.ompl import OmplPlanner
    from hybridnav.planning.named import At
    from hybridnav.refine import CostLine
    from hybridnav.search.directed import DirectedSides

_KEEPING = ("cheapest", "shortest", "octile")
"""Methods whose paths may stay on earlier ones."""
_KEEP_WITHIN = 0.02
"""Share by which a kept path may be longer than a shortest one; `keep_within` of `cheapest`."""
_KEPT = 16
"""Number of closures whose cells are kept: a door of a large room takes some 10 ms."""


@copies_alike
@dataclass(frozen=True, eq=False)
class Planning:
    """How a planner plans, by the map and the costs of now.

    It knows no locks: the caller sees to it that costs do not change during a query.
    """

    preset: Preset
    grid: OccupancyGrid
    built: TopologicalMap | None
    """The places that were built last, of this grid or of one before; None for a grid alone."""
    method: Method
    """Finds paths."""
    costs: PlannerCosts
    """The costs that the method plans by."""
    ompl: OmplPlanner | None = None
    """Refines the paths in the robot's space; None for those of the method."""
    closures: dict[object, ClosedCells] = field(default_factory=dict)
    """The cells of the last closures, by their keys."""
    smooth: Smooth | None = None
    """What is done with the paths that the method finds; None as in the preset."""

    @property
    def topology(self) -> TopologicalMap | None:
        """The places of the map; None if it changed since they were built."""
        built = self.built
        return built if built is not None and built.grid is self.grid else None

    # Reading: names to points, closures to cells.

    def read(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        blocked: Closable | ClosedCells | None,
        at: At = "anywhere",
        keep: PlanResult | None = None,
    ) -> Query:
        """Read a query; see `HybridPlanner.plan`."""
        began, name = clock(), None
        if at != "anywhere":
            check_at(at)
        if isinstance(start, str) or isinstance(goal, str):
            name = goal if isinstance(goal, str) else None
            start, goal = self.points_of([start, goal], at, blocked)
        closed = self.closed(blocked)
        ends = read_ends(start, goal, needs_heading=self.needs_headings)
        kept = None if keep is None else self._kept(keep, ends[0][1])
        return self._query(ends, closed, kept, name, began)

    def _query(
        self,
        ends: Ends,
        closed: ClosedCells | None,
        kept: KeptLine | None = None,
        name: str | None = None,
        began: float = 0.0,
    ) -> Query:
        """Return the query between two points, which may be refused."""
        points, poses = ends
        allowed = self.preset.planner.allow_unexplored
        cells, positions, refused = places_of_endpoints(self.grid, poses, allow_unexplored=allowed)
        if refused is None and not (closed is None and self.costs.closed is None):
            refused = self._shut(closed, cells)
        return Query(cells, points, closed, kept, positions, refused, poses, name, began)

    def _shut(self, closed: ClosedCells | None, cells: tuple[Cell, Cell]) -> PlanStatus | None:
        """Return the status of a query whose start or goal is closed, None if neither is."""
        shut = self.costs.closing(closed)
        return None if shut is None else refusal(shut, cells, self.grid.shape)

    def _kept(self, keep: PlanResult, goal: FloatArray) -> KeptLine | None:
        """Return the line of a result, None if it ends elsewhere or there is none."""
        planner, name = self.preset.planner, self.preset.name
        if self.ompl is not None or planner.method not in _KEEPING:
            known = ", ".join(_KEEPING)
            raise InvalidValueError(
                f"keep goes with presets of methods {known} without OMPL, and {name} is none: "
                "take one of these, or leave it out"
            )
        points, path = checked_type("keep", keep, PlanResult).line, keep.path
        within = getattr(planner, "keep_within", _KEEP_WITHIN)
        if planner.method == "octile":
            cells = None if path is None else path.cells
            if cells is None or tuple(cells[-1].tolist()) != self.grid.frame.cell_of(*goal):
                return None
            return KeptLine(self.grid.frame.points_of(cells), within, cells)
        if points is None and path is not None and not path.is_curved:
            points = path.points
        if points is None or len(points) == 1 or not np.array_equal(points[-1], goal):
            return None
        return KeptLine(points, within)

    @property
    def needs_headings(self) -> bool:
        """Whether endpoints must be `(x, y, yaw)`, as with OMPL in a space with headings."""
        return self.ompl is not None and self.ompl.ompl.has_heading

    def points_of(
        self, waypoints: Sequence[ArrayLike | str], at: At, blocked: Closable | ClosedCells | None
    ) -> list[ArrayLike]:
        """Return a point for each waypoint, so that the path through all of them is cheapest."""
        check_at(at)
        if not any(isinstance(waypoint, str) for waypoint in waypoints):
            return list(waypoints)
        if self.topology is None:
            no_places()
        # Loads modules that plans between points do not need.
        from hybridnav.planning.named import check_names, points_of_waypoints  # noqa: PLC0415

        check_names(self.topology, waypoints)
        closed, costs = self.costs.closing(self.closed(blocked)), self.costs.layer
        return points_of_waypoints(
            self.topology, self.preset.planner, waypoints, at=at, closed=closed, costs=costs
        )

    def closed(self, blocked: Closable | ClosedCells | None) -> ClosedCells | None:
        """Return what a closure closes, with the directions of the rooms; None for nothing. The
        last ones are kept."""
        always = self._directed
        if blocked is None:
            return always
        if isinstance(blocked, ClosedCells) and (always is None or blocked.one_way is not None):
            return blocked
        known = self.closures
        with suppress(TypeError):  # a mapping has to be read; areas and doors are found as given
            if (kept := known.pop(blocked, None)) is not None:
                return keep_last(known, blocked, kept, _KEPT)
        # Loads shapely, which most queries do not need.
        from hybridnav.closures.blocked import as_blocked  # noqa: PLC0415

        given = blocked if isinstance(blocked, ClosedCells) else as_blocked(blocked)
        key: object = given if isinstance(given, ClosedCells) else given.key
        # Without a lock: two threads may compute the same cells.
        found = known.pop(key, None)
        if found is None:
            found = given if isinstance(given, ClosedCells) else self._closed_by(given)
            found = found if always is None else found | always
        with suppress(TypeError):
            known[blocked] = found
        return keep_last(known, key, found, _KEPT)

    def _closed_by(self, closure: Blocked) -> ClosedCells:
        is_solid = self.ompl is not None and self.ompl.body is not None
        solid = closure.solid_on(self.grid) if is_solid else None
        one_way = closure.directions
        directed = None if one_way is None else one_way.on(self.grid, self.topology)
        self._report_lost(directed)
        return ClosedCells(closure.cells_on(self.grid, self.topology), solid, directed)

    @cached_property
    def _directed(self) -> ClosedCells | None:
        """The directions of the rooms, for all queries; None without any."""
        built = self.built
        if built is None or (rooms := built.room_labels) is None or not rooms.one_way:
            return None
        from hybridnav.closures.one_way import directions_on  # noqa: PLC0415 - loads shapely

        found = directions_on(built)
        self._report_lost(found, " of the rooms")
        return ClosedCells(np.empty(0, np.int64), None, found)

    def _report_lost(self, directed: DirectedSides | None, of: str = "") -> None:
        """Warn of lines and doors without an effect, as after an update."""
        able = self.grid.enterable(allow_unexplored=self.preset.planner.allow_unexplored)
        for name in () if directed is None else directed.lost(able):
            text = f"one-way {name}{of} lies nowhere in free space, and has no effect"
            warnings.warn(f"{text}: look at the map", MapWarning, stacklevel=2)

    @cached_property
    def smoothing(self) -> Smooth:
        """What is smoothed of the paths that the method finds."""
        chosen = self.preset.planner.finish if self.smooth is None else self.smooth
        has_arcs = self.costs.layer is not None and self.ompl is None
        return checked_smooth(chosen, has_arcs=has_arcs)

    @cached_property
    def finish(self) -> Finish:
        """What is done with the paths that the method finds."""
        if self.ompl is not None:
            from hybridnav.planning.methods.ompl import Sampled  # noqa: PLC0415 - loaded by now

            return Sampled(self.ompl, self.costs, self.method.metric)
        settings, layer = self.preset.planner, self.costs.layer
        return make_finish(self.grid, settings, layer, self.method.metric, self.smoothing)

    def finishing(self, smooth: Smooth | None) -> Planning:
        """Return how to plan with another finish of paths; None for that of the preset."""
        if smooth is None or smooth == self.smoothing:
            return self
        for other in self._others:
            if other.smooth == smooth:
                return other
        other = replace(self, smooth=smooth)
        _ = other.smoothing  # refuses what is none
        self._others.append(other)
        return other

    @cached_property
    def _others(self) -> list[Planning]:
        return []

    @cached_property
    def is_plain(self) -> bool:
        """Whether the cost of a plan is that of the path that the method finds."""
        is_kept = self.smoothing == "none" or self.method.metric == "any-angle"
        return is_kept and self.ompl is None

    # Planning: a path found by the method, then refined.

    def plan(self, query: Query) -> PlanResult:
        """Plan a path."""
        if query.refused is not None:
            refused = Finished("octile", None, math.inf, status=query.refused)
            return self._answer(query, refused, PlanStats())
        found = self.method.find(query)
        if found.cells_source is None:
            how, status = None if self.ompl is None else self.ompl.no_path, PlanStatus.NO_PATH
            metric, bound = self.method.metric, found.lower_bound_m
            none = Finished(metric, None, bound, status=status, refinement=how)
            return self._answer(query, none, found.stats)
        if query.kept is not None and self.preset.planner.method != "cheapest":
            from hybridnav.planning.keeping import staying  # noqa: PLC0415 - loads the lattice

            line = self._open if query.closed is None else self._open.closing(query.closed.flat)
            found = staying(self.grid, line, query, found)
        end = self.finish.finished(query, found)
        return self._answer(query, end, found.stats, found.route_source)

    @cached_property
    def _open(self) -> CostLine:
        """The cells that may be entered, for paths by lengths that stay on earlier ones."""
        from hybridnav.maps.costs import CostLayer  # noqa: PLC0415 - most queries keep nothing
        from hybridnav.refine import CostLine  # noqa: PLC0415

        layer = CostLayer(np.ones(self.grid.shape, np.float32))
        allowed = self.preset.planner.allow_unexplored
        return CostLine(self.grid, layer, allow_unexplored=allowed)

    def leaving(
        self, query: Query, within_m: float | None
    ) -> tuple[Query, float | None, list[int]]:
        """Return a query whose closed start may leave the closed cells, how long the way out is,
        and the cells of it that the costs close. The query is as it was, and the length None, where
        nothing closes the start alone, or no way leads out.
        """
        if self.ompl is not None or within_m is not None:
            given = (
                "within_m" if self.ompl is None else f"OMPL, which preset {self.preset.name} has"
            )
            raise InvalidValueError(f"leave_zone does not go with {given}: leave one out")
        stays, closed, always = (query, None, list[int]()), query.closed, self.costs.closed
        cells = self.grid.frame.cells_of(np.stack(query.points))
        if not ((cells >= 0) & (cells < self.grid.shape)).all():
            return stays
        ends = cells @ np.array([self.grid.shape[1], 1])
        may_enter = self.grid.enterable(allow_unexplored=self.preset.planner.allow_unexplored)
        zone: ClosedCells | None = None
        for each in filter(None, (closed, always)):
            if each.holds(ends[:1])[0] and not each.holds(ends[1:])[0]:
                zone = each if zone is None else zone | each
            else:
                may_enter.ravel()[each.flat] = False
        if zone is None or not may_enter.ravel()[ends].all():
            return stays
        cutting, one_way = self.grid.corner_cutting, None if closed is None else closed.one_way
        start = int(ends[0])
        way = way_out(may_enter, zone, start, corner_cutting=cutting, one_way=one_way)
        if way is None:
            return stays
        if closed is not None:
            closed = replace(closed, flat=np.setdiff1d(closed.flat, way[0]))
        # With the way open both ends may be entered: nothing else closes the start.
        query = query._replace(closed=closed, refused=None)
        opened = [] if always is None or not always.holds(ends[:1])[0] else way[0]
        return query, way[1] * self.grid.resolution_m, opened

    def near(self, query: Query, result: PlanResult, within_m: float) -> PlanResult:
        """Return a result, or where its goal cannot be reached one to the nearest point that can
        be; see `HybridPlanner.plan`."""
        check_within(within_m)
        if self.ompl is not None:
            raise InvalidValueError(
                f"within_m goes with presets without OMPL, and {self.preset.name} has it: take "
                "another preset, or leave it out"
            )
        if result.path is not None or result.status.value.startswith("start"):
            return result
        shut = self.costs.closing(query.closed)
        is_open = self.grid.enterable(allow_unexplored=self.preset.planner.allow_unexplored)
        if shut is not None:
            is_open.ravel()[shut.flat] = False
        start, goal = query.poses
        one_way = None if shut is None else shut.one_way
        point = nearest_reachable(self.grid, is_open, query.poses, within_m, one_way)
        if point is None:
            return result
        ends = (query.points[0], np.array(point)), (start, (*point, *goal[2:]))
        found = self.plan(self._query(ends, query.closed))
        return replace(found, status=PlanStatus.NEAR_GOAL, goal=goal)

    # Results: with their routes, and the settings that they were planned by.

    def _answer(
        self,
        query: Query,
        end: Finished,
        stats: PlanStats,
        route: Source[Route | None] = None,
    ) -> PlanResult:
        """Return a result, which records endpoints, preset and settings of the pyramid."""
        metric, path, bound, cost, grid_bound, line, status, how = end
        (start, goal), topology = query.poses, self.topology
        words: Source[tuple[Any, ...]] = ()
        if path is not None:
            if self.ompl is None and len(start) + len(goal) > 4:  # noqa: PLR2004 - two points
                path = path.turned_at_ends(start, goal)
            finder = self._route_finder
            is_derived = route is None or self.ompl is not None
            if is_derived and topology is not None and finder is not None:
                route = partial(_route_along, topology, finder, path)
            if status is PlanStatus.SOLVED:
                if not callable(bound):
                    bound = min(bound, path.length_m if cost is None else cost)
                if topology is not None and topology.has_rooms:
                    words = Walk(path, topology, query.goal_name or query.points[1], start)
        return PlanResult(
            status=status,
            metric=metric,
            path=path,
            route_source=route,
            lower_bound_source=bound,
            stats=stats,
            settings_source=partial(deepcopy, self._settings),
            weighted_cost=cost,
            refinement=how,
            start=start,
            goal=goal,
            grid_bound=grid_bound,
            line=line,
            instructions_source=words,
            ground=PlannedOn(self.grid, self.costs, query.closed, topology),
        )

    @cached_property
    def _route_finder(self) -> RouteFinder | None:
        return None if self.topology is None else RouteFinder(self.topology)

    @cached_property
    def _settings(self) -> dict[str, Any]:
        built, layer = None if self.built is None else self.built.source, self.costs.layer
        names = () if built is None else ("merge_distance_m", "linkage", "seed")
        costs = {} if layer is None else {"costs": layer.source}
        limits = self.preset.limits
        return {
            "preset": self.preset.name,
            "planner": self.preset.planner.model_dump(),
            "pyramid": {
                **{name: getattr(built, name) for name in names},
                "robot_radius_m": self.grid.robot_radius_m,
            },
            **({} if limits is None else {"limits": limits.model_dump()}),
            **costs,
        }

    def plan_many(
        self,
        pairs: tuple[FloatArray, FloatArray],
        smooth: Smooth | None,
        blocked: Closable | ClosedCells | None,
    ) -> PlanBatch:
        """Plan paths between many pairs of points; see `HybridPlanner.plan_many`."""
        now, closed = self.finishing(smooth), self.closed(blocked)

        def alone(start: FloatArray, goal: FloatArray) -> PlanResult:
            return now.plan(now.read(start, goal, closed))

        return plan_many(now.grid, now.method if now.is_plain else None, pairs, closed, alone)


def _route_along(topology: TopologicalMap, finder: RouteFinder, path: Path) -> Route:
    return route_of_cells(topology, finder, path.cells)
