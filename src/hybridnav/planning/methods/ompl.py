"""Method `ompl`: from a coarse path to one in the robot's state space."""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.clock import clock
from hybridnav._base.copies import copies_alike
from hybridnav._base.poses import Motion
from hybridnav._base.trig import directions, dist
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.geometry import cells_of_line, polyline_length
from hybridnav.planning import Metric
from hybridnav.planning.costs import PlannerCosts
from hybridnav.planning.finishes import Answer, Finished, Refinement
from hybridnav.planning.methods.discs import Discs
from hybridnav.planning.methods.grid import KnownMap
from hybridnav.planning.path import Path
from hybridnav.planning.settings import OmplPlannerSettings
from hybridnav.refine import LineOfSight, MotionCheck
from hybridnav.refine.curves import Curve, Pose, driven, shortest_curve
from hybridnav.refine.ompl import Corridors, OmplQuery, Reply, Search, Setup, Worker
from hybridnav.refine.one_way import led, obeys, shorten
from hybridnav.search.found import ClosedCells, Found, Method, PlanStatus, Query

NEAR_BOUND = 1.05
"""A path of the circumscribed disc that is at most this times the bound is the answer at once;
OMPL, which may find a way through a narrow door, tries to beat a longer one in its time."""
_DRIVEN = ("cheapest path of the inscribed disc: driven",)


@dataclass(frozen=True, eq=False)
class OmplPlan:
    """Result of a query."""

    status: PlanStatus
    metric: Metric
    refinement: Refinement
    path: Path | None = None
    weighted_cost: float | None = None
    lower_bound: float | Callable[[], float] = math.inf
    """The bound, or how to find it."""
    search: Search | None = None


class _Between(NamedTuple):
    """What the discs leave for OMPL."""

    cells: LongArray
    endpoints: tuple[FloatArray, FloatArray]
    closed: ClosedCells | None
    least_m: float
    """A proved bound."""
    disc: Path | None = None
    """The path of the circumscribed disc; None without one."""
    steps: tuple[str, ...] = ()


def ompl_planner(known: KnownMap, method: Method, settings: OmplPlannerSettings) -> OmplPlanner:
    """Make a planner with OMPL along the paths of a method.

    Raises `OmplError` when OMPL is not installed, refuses the settings, or its process does not
    start.
    """
    grid, field_of = known.grid, None
    if settings.along != "grid-astar" and known.topology is not None:
        field_of = known.topology.level.field_of
    free = np.argwhere(grid.enterable(allow_unexplored=settings.allow_unexplored))[:1]
    if len(free):  # kernels loaded at the first query would use up its budget
        cell, (point,) = (int(free[0, 0]), int(free[0, 1])), grid.frame.points_of(free)
        _ = method.find(Query((cell, cell), (point, point))).cells
    return OmplPlanner(grid, settings, field_of, known.costs)


@copies_alike
class Sampled:
    """Paths along those of a method, in the robot's space; a finish of paths.

    `costs`: what they close for all queries; `metric`: that of the method.
    """

    def __init__(self, ompl: OmplPlanner, costs: PlannerCosts, metric: Metric) -> None:
        self._ompl, self._costs, self._is_any_angle = ompl, costs, metric == "any-angle"

    def finished(self, query: Query, found: Found) -> Finished:
        """Return the path refined by OMPL, with the bound of the method too; see `Finish`."""
        now = clock()
        first, last = (np.array([*pose, 0.0][:3]) for pose in query.poses)
        end = self._ompl.plan(
            found.cells,
            (first, last),
            self._costs.closing(query.closed),
            spent_s=now - query.began,
            least_m=found.lower_bound_m if self._is_any_angle else query.straight_m,
            along=found,
        )
        found.stats.seconds["ompl"] = clock() - now
        path = end.path
        if path is not None and path.headings_rad is None and end.status is PlanStatus.SOLVED:
            path = path.turned_at_ends(*query.poses)
        cost, status, how = end.weighted_cost, end.status, end.refinement
        return Finished(end.metric, path, end.lower_bound, cost, status=status, refinement=how)


def _query_of(
    cells: LongArray, endpoints: tuple[FloatArray, FloatArray], closed: ClosedCells | None
) -> Query:
    first, last = cells[[0, -1]].tolist()
    points = endpoints[0][:2], endpoints[1][:2]
    return Query(((first[0], first[1]), (last[0], last[1])), points, closed)


@copies_alike
class OmplPlanner:
    """OMPL restricted to the fields that a coarse path passes.

    A footprint lies between two discs, which answer first; see `Discs`. OMPL gets what they leave.
    If it finds no path in these fields, their neighbours are added; if it still finds none, the
    path of the larger disc counts, or the grid's own path, shortened by line of sight. A copied or
    unpickled planner starts its own process at its first query.

    `settings`: settings with a section `ompl`; `field_of`: int16 or int32 (rows, cols), the field
    of each cell; None where the whole map is the corridor; `costs`: costs of the cells, for a
    footprint that can follow a disc; None for lengths. Raises `OmplError` when OMPL is not
    installed, refuses the settings, or its process does not start.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        settings: OmplPlannerSettings,
        field_of: NDArray[np.int16 | np.int32] | None,
        costs: CostLayer | None = None,
    ) -> None:
        self._grid, self._costs = grid, costs
        self._settings = settings
        self.ompl, self.body = settings.ompl, settings.ompl.body
        self.discs: Discs | None = None
        if self.body is not None and not grid.corner_cutting:
            allowed = settings.allow_unexplored
            self.discs = Discs(grid, self.body, allow_unexplored=allowed, costs=costs)
        self._corridors = Corridors(field_of, widened=settings.corridor == "neighbours")
        self._one_at_a_time = threading.Lock()
        self._confined: dict[ClosedCells, MotionCheck] = {}
        self._worker = Worker(Setup(grid, field_of, self.ompl, settings.allow_unexplored))
        self._warm_up()

    def plan(  # noqa: PLR0913 - one query, and what is known of it
        self,
        cells: LongArray,
        endpoints: tuple[FloatArray, FloatArray],
        closed: ClosedCells | None,
        *,
        spent_s: float = 0.0,
        least_m: float = 0.0,
        along: Found | None = None,
        tells_search: bool = False,
    ) -> OmplPlan:
        """Find a path of the state space along a path of cells.

        `cells`: int64 (n, 2), a legal path from the cell of the start to that of the goal;
        `endpoints`: start and goal, float64 (3,): metres and radians, map frame; `closed`: cells
        that may not be entered; None for none; `spent_s`: seconds of the budget that are spent
        already; `least_m`: a proved bound on the length of all paths; `along`: the answer of the
        method, whose path the cells are; None if it has no line; `tells_search`: whether to return
        the states and trees of the search too.
        """
        began = time.monotonic() - spent_s
        refused = self.refused(endpoints, closed)
        if refused is not None:
            return OmplPlan(refused, self._metric, Refinement((), "OMPL"))
        between = _Between(cells, endpoints, closed, least_m)
        if self.discs is not None and not tells_search:
            found = self._by_discs(self.discs, between, along)
            if isinstance(found, OmplPlan):
                return found
            between = found
        left_s = max(self.ompl.budget_s - (time.monotonic() - began), 0.0)
        return self._sampled(between, left_s, tells_search=tells_search)

    def _by_discs(self, discs: Discs, asked: _Between, along: Found | None) -> OmplPlan | _Between:
        """Return the answer of one of the discs, or what they leave for OMPL."""
        cells, endpoints, closed, least_m, *_ = asked
        query = _query_of(cells, endpoints, closed)
        below = discs.below(query)
        if below is not None:
            if not below.has_path:
                return OmplPlan(PlanStatus.NO_PATH, self._metric, self.no_path)
            least_m = max(least_m, below.lower_bound_m)
            cells = below.cells if self._settings.along == "shortest" else cells
            along = below
        if self._costs is not None and along is not None:
            # The robot often can drive a path of that disc, which by costs keeps its distance.
            assert along.points is not None  # noqa: S101 - any-angle methods state them
            own = self._turning(along.points, along.cells, endpoints, closed)
            if own is not None:
                return self._solved(own, query, least_m, Refinement(_DRIVEN, "inscribed disc"))
        near_m = NEAR_BOUND * (least_m if self._costs is None or along is None else along.cost_m)
        disc, steps = self._along_disc(discs, query, endpoints, near_m)
        if disc is not None and discs.cost_m(disc) <= near_m:
            return self._solved(disc, query, least_m, Refinement(steps, "circumscribed disc"))
        return _Between(cells, endpoints, closed, least_m, disc, steps)

    def _solved(self, path: Path, query: Query, least_m: float, how: Refinement) -> OmplPlan:
        """Return the answer with a path and a bound, which by costs is found when it is read."""
        cost = self._weighted_cost(path)
        bound: float | Callable[[], float] = min(least_m, path.length_m if cost is None else cost)
        if self._costs is not None and self.discs is not None and cost is not None:
            bound = partial(self.discs.bound_m, query, cost)
        return OmplPlan(PlanStatus.SOLVED, self._metric, how, path, cost, bound)

    def _sampled(self, asked: _Between, left_s: float, *, tells_search: bool) -> OmplPlan:
        """Return the answer of OMPL, or the path that is known where it finds no shorter one."""
        cells, endpoints, closed, least_m, disc, known = asked
        shut = led(closed, cells)
        flat, solid = (None, None) if shut is None else (shut.flat, shut.solid)
        with self._one_at_a_time:
            self._worker.ensure()
            corridors, deadline_s = self._corridors.of(cells), time.monotonic() + left_s
            query = OmplQuery(*endpoints, cells, deadline_s, corridors, flat, solid, tells_search)
            self._worker.send(query)
            # Made while the worker plans, so that a path exists when its time is up.
            is_late = disc is None and self._worker.is_late()
            by_line = self._by_line_of_sight(cells, endpoints, closed) if is_late else None
            reply = self._worker.reply()
        by: Answer = "OMPL"
        steps = [*known, *reply.steps]
        path = self._path(cells, reply) if len(reply.points) else None
        status = PlanStatus(reply.outcome)
        if path is not None and not self._obeys(path, cells, endpoints, closed):
            path, status = None, PlanStatus.TIMEOUT  # a loop through one-way doors
        is_solved = status is PlanStatus.SOLVED
        if disc is not None:
            if path is None or not is_solved or self._cost_m(path) >= self._cost_m(disc):
                path, status, by = disc, PlanStatus.SOLVED, "circumscribed disc"
                steps.append("circumscribed disc: shorter than OMPL's path")
        elif not is_solved:
            if not is_late:
                by_line = self._by_line_of_sight(cells, endpoints, closed)
            steps.append(f"grid path by line of sight: {'no' if by_line is None else 'solved'}")
            if by_line is not None:
                path, status, by = by_line, PlanStatus.SOLVED, "grid"
        cost, bound = None, max(self._straight_m(endpoints), least_m)
        how = Refinement(tuple(steps), by, reply.trace, reply.iterations)
        if path is not None and status is PlanStatus.SOLVED:
            if self._costs is not None:
                return self._solved(path, _query_of(cells, endpoints, closed), bound, how)
            cost = self._weighted_cost(path)
            bound = min(bound, path.length_m if cost is None else cost)
        return OmplPlan(status, self._metric, how, path, cost, bound, reply.search)

    def _along_disc(
        self, discs: Discs, query: Query, endpoints: tuple[FloatArray, FloatArray], near_m: float
    ) -> tuple[Path | None, tuple[str, ...]]:
        """Return the path of the circumscribed disc with turns on the spot, and how it went."""
        if not self.ompl.follows_discs:
            return None, ()
        found, step = discs.above(query), "circumscribed disc"
        points = None if found is None else found.points
        if found is None or points is None:
            return None, (f"{step}: no path",)
        path = self._turning(points, found.cells, endpoints, query.closed)
        if path is None:
            return None, (f"{step}: no",)
        cost_m = self._cost_m(path)
        if cost_m <= near_m:
            return path, (f"{step}: solved",)
        return path, (f"{step}: {100 * (cost_m * NEAR_BOUND / near_m - 1):.0f} % over the bound",)

    def close(self) -> None:
        """End the process once no query waits for it; the next query starts another one."""
        with self._one_at_a_time:
            self._worker.close()

    no_path = Refinement(("inscribed disc: no path",), "inscribed disc")
    """How a query ends where the largest disc in the robot has no path: nothing else is asked."""

    def refused(
        self, endpoints: tuple[FloatArray, FloatArray], closed: ClosedCells | None
    ) -> PlanStatus | None:
        """Return the status of a query if the footprint does not fit at one of its endpoints."""
        if self.body is None:
            return None
        occupied = PlanStatus.START_OCCUPIED, PlanStatus.GOAL_OCCUPIED
        blocked = PlanStatus.START_BLOCKED, PlanStatus.GOAL_BLOCKED
        for check, refused in ((self._check, occupied), (self._check_of(closed), blocked)):
            for pose, status in zip(endpoints, refused, strict=True):
                if not check.state_valid(*pose.tolist()):
                    return status
        return None

    def _check_of(self, closed: ClosedCells | None) -> MotionCheck:
        """Return the check of motions with what is closed; the last one is kept."""
        if closed is None:
            return self._check
        check = self._confined.get(closed)
        if check is None:
            check = self._check.confined(closed=closed.flat, solid=closed.solid)
            self._confined = {closed: check}
        return check

    def _warm_up(self) -> None:
        """Build all shared objects, so that no query's time includes them."""
        free = np.argwhere(self._grid.enterable())[:1]
        if len(free):
            (centre,) = self._grid.frame.points_of(free)
            pose = np.append(centre, 0.0)
            path = self._by_line_of_sight(free, (pose, pose), None)
            self._weighted_cost(path)
            self.refused((pose, pose), None)
            if self.discs is not None:
                cell = (int(free[0, 0]), int(free[0, 1]))
                query = Query((cell, cell), (centre, centre))
                self.discs.below(query)
                self._along_disc(self.discs, query, (pose, pose), 0.0)
            if self.ompl.has_heading:
                self._check.turn_valid(*pose, *pose)
            if self.ompl.space == "differential":
                self._check.drive_valid(*pose, *pose)

    @property
    def _metric(self) -> Metric:
        if self._costs is not None:
            return "any-angle-weighted"
        if self.ompl.space == "dubins":
            return "dubins"
        return "reeds-shepp" if self.ompl.space == "reeds-shepp" else "any-angle"

    def _path(self, cells: LongArray, reply: Reply) -> Path:
        """Return the path of a reply; along curves its poses are one cell apart."""
        states, is_curved = reply.points, self.ompl.turning_radius_m is not None
        length_m = polyline_length(states[:, :2].copy())
        if is_curved:
            curves = [self._curve(*pair) for pair in itertools.pairwise(states.tolist())]
            length_m = math.fsum(curve.length_m for curve in curves)
            segments = [
                curve.poses(min(self._grid.resolution_m, curve.radius_m)) for curve in curves
            ]
            states = np.concatenate([states[:1], *(poses[1:] for poses in segments)])
        headings = states[:, 2].copy() if self.ompl.has_heading else None
        points = states[:, :2].copy()
        return self._path_through(points, headings, cells, length_m, is_curved=is_curved)

    def _curve(self, first: Pose, second: Pose) -> Curve:
        radius_m, reverses = self.ompl.turning_radius_m, self.ompl.space == "reeds-shepp"
        assert radius_m is not None  # noqa: S101 - the space has curves
        return shortest_curve(first, second, radius_m=radius_m, reverses=reverses)

    def _straight_m(self, endpoints: tuple[FloatArray, FloatArray]) -> float:
        """Return the length of the shortest path without obstacles, a bound; never by OMPL, whose
        Reeds-Shepp distance is too long for some straight drives."""
        first, last = endpoints
        straight_m = dist(first[:2], last[:2])
        if self.ompl.turning_radius_m is None:
            return straight_m
        return max(self._curve(tuple(first.tolist()), tuple(last.tolist())).length_m, straight_m)

    def _path_through(
        self,
        points: FloatArray,
        headings: FloatArray | None,
        cells: LongArray,
        length_m: float,
        *,
        is_curved: bool = False,
    ) -> Path:
        """Return the path through some poses, each once."""
        left = Motion(points, headings, is_curved).is_left
        points, headings = points[left], None if headings is None else headings[left]
        return Path(self._passed(points, cells), points, length_m, headings, is_curved)

    def _passed(self, points: FloatArray, cells: LongArray) -> LongArray:
        """Return the cells that a path passes.

        If its points, which follow a curve from chord to chord, touch a cell that may not be
        entered, the cells of the coarse path are returned.
        """
        free = self._free
        positions = np.array([self._grid.frame.position_of(*point) for point in points.tolist()])
        passed = cells_of_line(free, positions)
        inside = ((passed >= 0) & (passed < free.shape)).all()
        return passed if inside and free[tuple(passed.T)].all() else cells

    def _by_line_of_sight(
        self, cells: LongArray, endpoints: tuple[FloatArray, FloatArray], closed: ClosedCells | None
    ) -> Path | None:
        """Return the shortened path of the grid; None if the robot cannot drive it."""
        if self.ompl.turning_radius_m is not None:
            return None
        points = shorten(self._sight, closed, cells, (endpoints[0][:2], endpoints[1][:2]))
        if not self.ompl.has_heading:
            return self._path_through(points, None, cells, polyline_length(points))
        return self._turning(points, cells, endpoints, closed)

    def _obeys(
        self,
        path: Path,
        cells: LongArray,
        endpoints: tuple[FloatArray, FloatArray],
        closed: ClosedCells | None,
    ) -> bool:
        """Return whether a path crosses no side the wrong way."""
        if closed is None or closed.one_way is None:
            return True
        return obeys(self._sight, _query_of(cells, endpoints, closed), path.points)

    def _turning(
        self,
        points: FloatArray,
        cells: LongArray,
        endpoints: tuple[FloatArray, FloatArray],
        closed: ClosedCells | None,
    ) -> Path | None:
        """Return the path of a robot that turns on the spot at every bend of a polyline and drives
        ahead in between; None if it cannot."""
        check = self._check_of(closed)
        steps = np.diff(points, axis=0)
        ahead = directions(steps[:, 1], steps[:, 0])
        if self.ompl.space == "differential":
            poses = np.column_stack([points, [endpoints[0][2], *ahead]])
            poses = driven(check, np.vstack([poses, endpoints[1]]), reverses=self.ompl.reverses)
        else:
            headings = np.concatenate([[endpoints[0][2]], np.repeat(ahead, 2), [endpoints[1][2]]])
            poses = np.column_stack([np.repeat(points, 2, axis=0), headings])
            poses = poses if check.path_valid(poses) else poses[:0]
        if not len(poses):
            return None
        headings = poses[:, 2].copy()
        return self._path_through(poses[:, :2].copy(), headings, cells, polyline_length(points))

    def _weighted_cost(self, path: Path | None) -> float | None:
        if path is None or self._costs is None:
            return None
        return self._cost_m(path)

    def _cost_m(self, path: Path) -> float:
        """Return what a path costs in the metric of the results."""
        return path.length_m if self.discs is None else self.discs.cost_m(path)

    @cached_property
    def _free(self) -> BoolArray:
        return self._grid.enterable(allow_unexplored=self._settings.allow_unexplored)

    @cached_property
    def _check(self) -> MotionCheck:
        allowed = self._settings.allow_unexplored
        return MotionCheck(self._grid, footprint=self.body, allow_unexplored=allowed)

    @cached_property
    def _sight(self) -> LineOfSight:
        return LineOfSight(self._grid, allow_unexplored=self._settings.allow_unexplored)
