"""Method `ompl`: from a coarse path to one in the robot's state space."""

from __future__ import annotations

import itertools
import math
import threading
import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.poses import Motion
from hybridnav._base.trig import directions
from hybridnav.maps.geometry import cells_of_line
from hybridnav.planner import Path, PlanStatus, Refinement
from hybridnav.refine import LineOfSight, MotionCheck
from hybridnav.refine.curves import driven, shortest_curve
from hybridnav.refine.ompl import Clearance, OmplQuery, Setup, Worker
from hybridnav.search.found import Query

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.planner import Metric
    from hybridnav.planner.methods.grid import KnownMap
    from hybridnav.planner.settings import OmplPlannerSettings
    from hybridnav.refine.ompl import Reply, Search
    from hybridnav.search.found import Method


@dataclass(frozen=True, eq=False)
class OmplPlan:
    """Result of a query."""

    status: PlanStatus
    metric: Metric
    path: Path | None
    weighted_cost: float | None
    lower_bound: float
    refinement: Refinement
    search: Search | None = None


def ompl_planner(known: KnownMap, method: Method, settings: OmplPlannerSettings) -> OmplPlanner:
    """Make a planner with OMPL along the paths of a method.

    Raises
    ------
    OmplError
        When OMPL is not installed, refuses the settings, or its process does not start.
    """
    grid, field_of = known.grid, None
    if settings.along != "grid-astar" and known.topology is not None:
        field_of = known.topology.level.field_of
    free = np.argwhere(grid.enterable(allow_unexplored=settings.allow_unexplored))[:1]
    if len(free):  # kernels loaded at the first query would use up its budget
        cell, (point,) = (int(free[0, 0]), int(free[0, 1])), grid.frame.points_of(free)
        _ = method.find(Query((cell, cell), (point, point))).cells
    return OmplPlanner(grid, settings, field_of)


@copies_alike
class OmplPlanner:
    """OMPL restricted to the fields that a coarse path passes.

    If OMPL finds no path there, the neighbouring fields are added; if it still finds none, the
    grid's own path is shortened by line of sight. A copied or unpickled planner starts its own
    process at its first query.

    Parameters
    ----------
    grid
        The map.
    settings
        Settings with a section `ompl`.
    field_of
        int16 or int32 (rows, cols), the field of each cell; None where the whole map is the
        corridor.

    Raises
    ------
    OmplError
        When OMPL is not installed, refuses the settings, or its process does not start.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        settings: OmplPlannerSettings,
        field_of: NDArray[np.int16 | np.int32] | None,
    ) -> None:
        self._grid = grid
        self._settings = settings
        self.ompl = settings.ompl
        self._field_of = field_of
        self._one_at_a_time = threading.Lock()
        self._worker = Worker(Setup(grid, field_of, self.ompl, settings.allow_unexplored))
        self._warm_up()

    def plan(
        self,
        cells: LongArray,
        endpoints: tuple[FloatArray, FloatArray],
        closed: LongArray | None,
        *,
        spent_s: float = 0.0,
        tells_search: bool = False,
    ) -> OmplPlan:
        """Find a path of the state space along a path of cells.

        Parameters
        ----------
        cells
            int64 (n, 2), a legal path from the cell of the start to that of the goal.
        endpoints
            Start and goal, float64 (3,): metres and radians, map frame.
        closed
            int64 (m,), flat cells that may not be entered; None for none.
        spent_s
            Seconds of the budget that are spent already.
        tells_search
            Whether to return the states and trees of the search too.
        """
        refused = self._refused(endpoints)
        if refused is not None:
            nothing = Refinement((), by_grid=False, trace=(), iterations=0)
            return OmplPlan(refused, self._metric, None, None, math.inf, nothing)
        with self._one_at_a_time:
            self._worker.ensure()
            query = OmplQuery(
                start=endpoints[0],
                goal=endpoints[1],
                cells=cells,
                deadline_s=time.monotonic() + max(self.ompl.budget_s - spent_s, 0.0),
                corridors=self._corridors(cells),
                closed=closed,
                tells_search=tells_search,
            )
            self._worker.send(query)
            # Made while the worker plans, so that a path exists when its time is up.
            is_late = self._worker.is_late()
            by_line = self._by_line_of_sight(cells, endpoints, closed) if is_late else None
            reply = self._worker.reply()
        steps, by_grid = list(reply.steps), False
        path = self._path(cells, reply) if len(reply.points) else None
        status = PlanStatus(reply.outcome)
        if status is not PlanStatus.SOLVED:
            if not is_late:
                by_line = self._by_line_of_sight(cells, endpoints, closed)
            steps.append(f"grid path by line of sight: {'no' if by_line is None else 'solved'}")
            if by_line is not None:
                path, status, by_grid = by_line, PlanStatus.SOLVED, True
        return OmplPlan(
            status,
            self._metric,
            path,
            self._weighted_cost(path) if status is PlanStatus.SOLVED else None,
            self._bound(reply, path, endpoints),
            Refinement(tuple(steps), by_grid, reply.trace, reply.iterations),
            reply.search,
        )

    def close(self) -> None:
        """End the process once no query waits for it; the next query starts another one."""
        with self._one_at_a_time:
            self._worker.close()

    def _refused(self, endpoints: tuple[FloatArray, FloatArray]) -> PlanStatus | None:
        """Return the status of a query if the footprint does not fit at one of its endpoints."""
        if self.ompl.footprint is None:
            return None
        for pose, status in zip(
            endpoints, (PlanStatus.START_OCCUPIED, PlanStatus.GOAL_OCCUPIED), strict=True
        ):
            if not self._check.state_valid(*pose.tolist()):
                return status
        return None

    def _warm_up(self) -> None:
        """Build all shared objects, so that no query's time includes them."""
        if self._field_of is not None:
            _ = self._beside
        free = np.argwhere(self._grid.enterable())[:1]
        if len(free):
            centre = self._grid.frame.points_of(free[0])
            pose = np.append(centre, 0.0)
            path = self._by_line_of_sight(free, (pose, pose), None)
            self._weighted_cost(path)
            self._refused((pose, pose))
            if self.ompl.has_heading:
                self._check.turn_valid(*pose, *pose)
            if self.ompl.space == "differential":
                self._check.drive_valid(*pose, *pose)

    @property
    def _metric(self) -> Metric:
        if self.ompl.objective == "clearance":
            return "clearance-weighted"
        if self.ompl.space == "dubins":
            return "dubins"
        return "reeds-shepp" if self.ompl.space == "reeds-shepp" else "any-angle"

    def _bound(
        self, reply: Reply, path: Path | None, endpoints: tuple[FloatArray, FloatArray]
    ) -> float:
        """Return a lower bound on the cost of all paths: the path without obstacles."""
        straight = float(np.hypot(*(endpoints[1] - endpoints[0])[:2]))
        bound = max(straight, reply.bound_m)
        return bound if path is None else min(bound, path.length_m)

    def _corridors(self, cells: LongArray) -> tuple[tuple[str, BoolArray | None], ...]:
        if self._field_of is None:
            return (("whole map", None),)
        passed = np.zeros(self._n_fields, dtype=np.bool_)
        passed[self._field_of[cells[:, 0], cells[:, 1]]] = True
        tails, heads = self._beside
        wider = passed.copy()
        wider[heads[passed[tails]]] = True
        wider[tails[passed[heads]]] = True
        widened = ("widened corridor", wider)
        if self._settings.corridor == "neighbours":
            return (widened,)
        return (("corridor", passed), widened)

    @cached_property
    def _n_fields(self) -> int:
        assert self._field_of is not None  # noqa: S101 - only called if it is set
        return int(self._field_of.max(initial=-1)) + 1

    @cached_property
    def _beside(self) -> tuple[LongArray, LongArray]:
        """Return the pairs of neighbouring fields, each pair once."""
        assert self._field_of is not None  # noqa: S101
        fields = self._field_of
        keys = []
        for one, other in ((fields[:, :-1], fields[:, 1:]), (fields[:-1], fields[1:])):
            differ = (one != other) & (one >= 0) & (other >= 0)
            low, high = (
                np.minimum(one[differ], other[differ]),
                np.maximum(one[differ], other[differ]),
            )
            keys.append(low.astype(np.int64) * self._n_fields + high)
        pairs = np.unique(np.concatenate(keys))
        return pairs // max(self._n_fields, 1), pairs % max(self._n_fields, 1)

    def _path(self, cells: LongArray, reply: Reply) -> Path:
        """Return the path of a reply; along curves its poses are one cell apart."""
        states, radius_m = reply.points, self.ompl.turning_radius_m
        if radius_m is not None:
            reverses = self.ompl.space == "reeds-shepp"
            segments = [states[:1]]
            for first, second in itertools.pairwise(states.tolist()):
                curve = shortest_curve(first, second, radius_m=radius_m, reverses=reverses)
                step_m = min(self._grid.resolution_m, radius_m)  # so that no arc is half a circle
                segments.append(curve.poses(step_m)[1:])
            states = np.concatenate(segments)
        headings = states[:, 2].copy() if self.ompl.has_heading else None
        points, is_curved = states[:, :2].copy(), radius_m is not None
        return self._path_through(points, headings, cells, reply.length_m, is_curved=is_curved)

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
        self, cells: LongArray, endpoints: tuple[FloatArray, FloatArray], closed: LongArray | None
    ) -> Path | None:
        """Return the shortened path of the grid; None if the robot cannot drive it."""
        if self.ompl.turning_radius_m is not None:
            return None
        sight = self._sight
        if closed is not None:
            allowed = self._settings.allow_unexplored
            sight = LineOfSight(self._grid, allow_unexplored=allowed, closed=closed)
        points = sight.shorten(cells, endpoints[0][:2], endpoints[1][:2])
        steps = np.diff(points, axis=0)
        length_m = math.fsum(np.hypot(steps[:, 0], steps[:, 1]).tolist())
        if not self.ompl.has_heading:
            return self._path_through(points, None, cells, length_m)
        poses = self._poses_along(points, endpoints, closed)
        if not len(poses):
            return None
        points, headings = poses[:, :2].copy(), poses[:, 2].copy()
        return self._path_through(points, headings, cells, length_m)

    def _poses_along(
        self, points: FloatArray, endpoints: tuple[FloatArray, FloatArray], closed: LongArray | None
    ) -> FloatArray:
        """Return the poses of a robot along a polyline, float64 (n, 3).

        The robot turns on the spot at every bend and drives ahead in between; without rows if it
        cannot.
        """
        check = self._check.confined(closed=closed)
        steps = np.diff(points, axis=0)
        ahead = directions(steps[:, 1], steps[:, 0])
        if self.ompl.space == "differential":
            poses = np.column_stack([points, [endpoints[0][2], *ahead]])
            return driven(check, np.vstack([poses, endpoints[1]]), reverses=self.ompl.reverses)
        headings = np.concatenate([[endpoints[0][2]], np.repeat(ahead, 2), [endpoints[1][2]]])
        poses = np.column_stack([np.repeat(points, 2, axis=0), headings])
        return poses if check.path_valid(poses) else np.empty((0, 3))

    def _weighted_cost(self, path: Path | None) -> float | None:
        if path is None or self._clearance is None:
            return None
        return self._clearance.cost_of(path.points)

    @cached_property
    def _clearance(self) -> Clearance | None:
        if self.ompl.objective != "clearance":
            return None
        allowed = self._settings.allow_unexplored
        return Clearance(self._grid, self.ompl, allow_unexplored=allowed)

    @cached_property
    def _free(self) -> BoolArray:
        return self._grid.enterable(allow_unexplored=self._settings.allow_unexplored)

    @cached_property
    def _check(self) -> MotionCheck:
        allowed = self._settings.allow_unexplored
        return MotionCheck(self._grid, footprint=self.ompl.footprint, allow_unexplored=allowed)

    @cached_property
    def _sight(self) -> LineOfSight:
        return LineOfSight(self._grid, allow_unexplored=self._settings.allow_unexplored)
