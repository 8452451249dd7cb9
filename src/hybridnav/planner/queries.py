"""Queries between two points of one map: read, planned on its cells, and finished as results."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, cast

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav.maps import CellClass
from hybridnav.planner import PlanBatch, PlanStatus
from hybridnav.planner.cell_planner import CellQueries, CellQuery
from hybridnav.planner.closed import ClosedCells, Closures
from hybridnav.planner.drafts import PlanDraft, draft_on_mesh
from hybridnav.planner.endpoints import cells_of_endpoints, check_at, read_end
from hybridnav.planner.finish import Finish, Smooth
from hybridnav.planner.follow import Outcomes, is_stale

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.costs import CostLayer
    from hybridnav.planner import PlanResult, Preset
    from hybridnav.planner.blocked import Closable
    from hybridnav.planner.cell_planner import CellPlan, CellPlanner, CellPlans
    from hybridnav.planner.guide.itinerary import Guide
    from hybridnav.planner.mesh_plans import OverMesh
    from hybridnav.planner.named import At
    from hybridnav.planner.ompl_plans import OmplPlanner
    from hybridnav.topology import TopologicalMap


@copies_alike
class Queries:
    """Plans of one map between two points, or rooms, by the costs of now.

    It knows no locks: the caller sees to it that costs do not change during a query.

    Parameters
    ----------
    topology
        The topological map with its grid.
    preset
        The preset.
    cells
        The planner of cell paths.
    costs
        Costs of the cells; None makes costs lengths.
    ompl
        The planner with OMPL, for presets with `refine: ompl`.
    """

    def __init__(
        self,
        topology: TopologicalMap,
        preset: Preset,
        cells: CellPlanner,
        costs: CostLayer | None,
        ompl: OmplPlanner | None,
    ) -> None:
        self._topology, self._preset, self._ompl = topology, preset, ompl
        self._closures = Closures(topology)
        self.take(cells, costs)

    def take(self, cells: CellPlanner, costs: CostLayer | None) -> None:
        """Plan by other costs from now on."""
        self._cells, self._costs = cells, costs
        self._outcomes = Outcomes(self._topology, self._preset, costs)
        self._finish = Finish(
            self._topology.grid, cells, self._outcomes, self._preset.planner, costs=costs
        )

    @cached_property
    def guide(self) -> Guide | None:
        """The source of descriptions for a person; None on a map without rooms."""
        if is_stale(self._topology) or self._topology.pyramid.rooms is None:
            return None
        # Loads modules that plans without rooms do not need.
        from hybridnav.planner.guide.itinerary import Guide  # noqa: PLC0415

        return Guide(self._topology.rooms)

    @property
    def needs_headings(self) -> bool:
        """Whether endpoints must be `(x, y, yaw)`, as with OMPL in a space with headings."""
        return self._ompl is not None and self._ompl.ompl.has_heading

    def closed(self, blocked: Closable | ClosedCells | None) -> ClosedCells | None:
        """Return the cells of a closure, None for no closure."""
        if blocked is None or isinstance(blocked, ClosedCells):
            return blocked
        return self._closures.of(blocked)

    def closed_for_all(self, closed: ClosedCells | None) -> ClosedCells | None:
        """Return the closed cells of a query with those that the costs close for all queries."""
        return self._finish.with_closed(closed)

    def plan(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        smooth: Smooth | None,
        blocked: Closable | ClosedCells | None,
        at: At,
    ) -> PlanResult:
        """Plan a path; see `HybridPlanner.plan`."""
        began = time.perf_counter()
        check_at(at)
        waypoint = goal
        if isinstance(start, str) or isinstance(goal, str):
            from hybridnav.planner.named import check_names, points_of_waypoints  # noqa: PLC0415 - on demand

            check_names(self._topology, [start, goal])
            blocked = self.closed(blocked)
            start, goal = points_of_waypoints(
                self._topology,
                self._preset.planner,
                [start, goal],
                at=at,
                closed=self.closed_for_all(blocked),
                costs=self._costs,
            )
        read = partial(read_end, needs_heading=self.needs_headings)
        poses = read("start", start), read("goal", goal)
        finish = self._finish.checked(smooth, self._preset.planner.smooth)
        result = self._between(poses, finish, self.closed(blocked), began)
        return self._described(result, poses, waypoint)

    def draft(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        blocked: Closable | ClosedCells | None,
        at: At,
    ) -> PlanDraft:
        """Plan a path, and make its result only if it is wanted; see `HybridPlanner.draft`."""
        check_at(at)
        named = isinstance(start, str) or isinstance(goal, str)
        if named or self._ompl is not None or self._preset.planner.coarse != "mesh":
            return PlanDraft.of(self.plan(start, goal, None, blocked, at))
        read = partial(read_end, needs_heading=False)
        poses = read("start", start), read("goal", goal)
        closed = self.closed(blocked)
        query = self._query_of(poses, closed)
        if isinstance(query, PlanStatus):
            return PlanDraft.of(self._outcomes.answer(query, poses))
        finish, outcomes, metric = self._finish, self._outcomes, self._cells.metric

        def result_of(plan: CellPlan) -> PlanResult:
            if plan.cells is None:
                return outcomes.no_path(plan, poses, metric)
            return self._described(finish.result(plan, poses, "none", closed), poses, goal)

        return draft_on_mesh(cast("OverMesh", self._cells), query, result_of)

    def plan_many(
        self,
        pairs: tuple[FloatArray, FloatArray],
        smooth: Smooth | None,
        blocked: Closable | ClosedCells | None,
    ) -> PlanBatch:
        """Plan paths between many pairs of points; see `HybridPlanner.plan_many`."""
        finish = self._finish.checked(smooth, self._preset.planner.smooth)
        closed = self.closed(blocked)
        is_kept = finish == "none" or self._cells.metric == "any-angle"
        at_once = self._cells if self._ompl is None and is_kept else None

        def alone(start: FloatArray, goal: FloatArray) -> PlanResult:
            return self.plan(start, goal, finish, closed, "anywhere")

        return plan_many(self._topology.grid, at_once, pairs, closed, alone)

    def _described(
        self, result: PlanResult, poses: tuple[FloatArray, FloatArray], waypoint: ArrayLike | str
    ) -> PlanResult:
        """Return a result with what its instructions are found from."""
        if result.path is None or not result.solved or self.guide is None:
            return result
        source = self.guide.of(result.path, waypoint, poses[0].tolist())
        return replace(result, instruction_source=source)

    def _between(
        self,
        poses: tuple[FloatArray, FloatArray],
        finish: Smooth,
        closed: ClosedCells | None,
        began: float,
    ) -> PlanResult:
        """Plan between two points, or poses."""
        query = self._query_of(poses, closed)
        if isinstance(query, PlanStatus):
            return self._outcomes.answer(query, poses)
        endpoints, plan = query.points, self._cells.plan(query)
        if plan.cells is None:
            return self._outcomes.no_path(plan, poses, self._cells.metric)
        if self._ompl is not None:
            now, flat = time.perf_counter(), None if closed is None else closed.flat
            first, last = (pose if len(pose) > 2 else np.append(pose, 0.0) for pose in poses)  # noqa: PLR2004
            found = self._ompl.plan(plan.cells, (first, last), flat, spent_s=now - began)
            plan.stats.seconds["ompl"] = time.perf_counter() - now
            bound = self._cells.bound(plan, endpoints)
            return self._outcomes.by_ompl(found, plan, poses, bound)
        return self._finish.result(plan, poses, finish, closed)

    def _query_of(
        self, poses: tuple[FloatArray, FloatArray], closed: ClosedCells | None
    ) -> CellQuery | PlanStatus:
        """Return the query between two points, or the status that refuses one of them."""
        endpoints = poses[0][:2], poses[1][:2]
        grid, allowed = self._topology.grid, self._preset.planner.allow_unexplored
        cells = cells_of_endpoints(grid, endpoints, allow_unexplored=allowed)
        if isinstance(cells, PlanStatus):
            return cells
        shut = self.closed_for_all(closed)
        if shut is not None and (refused := shut.refusal(cells, grid.shape)):
            return refused
        return CellQuery(cells, endpoints, closed)


# Many queries at once: those that look-ups answer in one kernel, the others one by one.


def plan_many(
    grid: OccupancyGrid,
    at_once: CellPlanner | None,
    endpoints: tuple[FloatArray, FloatArray],
    closed: ClosedCells | None,
    alone: Callable[[FloatArray, FloatArray], PlanResult],
) -> PlanBatch:
    """Return the answers to pairs of points, in arrays.

    Parameters
    ----------
    grid
        The map.
    at_once
        Planner for many queries at once; None leaves all to `alone`.
    endpoints
        Starts and goals, float64 (n, 2) each, or poses (n, 3).
    closed
        Closed cells; None for none.
    alone
        Plans one of the remaining queries, between two of the `endpoints`.
    """
    starts, goals = endpoints
    n = len(starts)
    status = np.full(n, str(PlanStatus.SOLVED), dtype=f"U{max(map(len, PlanStatus))}")
    cost, bound = np.full(n, np.inf), np.full(n, np.inf)
    paths: list[FloatArray] = [np.empty((0, 2))] * n
    headings = [np.empty(0)] * n
    left = np.ones(n, dtype=np.bool_)
    first, last = grid.frame.cells_of(starts[:, :2]), grid.frame.cells_of(goals[:, :2])
    asked = np.flatnonzero(_are_free(grid, first) & _are_free(grid, last))
    found = None
    if len(asked) and at_once is not None:
        cells = first[asked], last[asked]
        found = at_once.plan_many(CellQueries(cells, (starts[asked], goals[asked]), closed))
    if at_once is not None and found is not None:
        kept = found.is_done
        if closed is not None:
            on_cells = found if at_once.metric == "octile" else None
            kept = kept & ~_met(closed, cells, grid, on_cells)
        done = asked[kept]
        left[done] = False
        cost[done] = found.cost_m[kept]
        bound[done] = np.minimum(found.lower_bound_m[kept], cost[done])
        status[done[np.isinf(cost[done])]] = str(PlanStatus.NO_PATH)
        for i, k in zip(done.tolist(), np.flatnonzero(kept).tolist(), strict=True):
            points = found.points[found.path_start[k] : found.path_start[k + 1]]
            paths[i] = points if cost[i] > 0 else points[:1]
    for i in np.flatnonzero(left).tolist():
        result = alone(starts[i], goals[i])
        status[i], cost[i], bound[i] = str(result.status), result.cost, result.lower_bound
        if result.path is not None:
            paths[i] = result.path.points
            if result.path.headings_rad is not None:
                headings[i] = result.path.headings_rad
    has_yaw = starts.shape[1] > 2  # noqa: PLR2004
    turns = frozen(np.concatenate([np.empty(0), *headings])) if has_yaw else None
    return PlanBatch(
        status=frozen(status),
        cost=frozen(cost),
        lower_bound=frozen(bound),
        path_start=frozen(
            np.concatenate([[0], np.cumsum([len(p) for p in paths])]).astype(np.int64)
        ),
        points=frozen(np.concatenate([np.empty((0, 2)), *paths])),
        headings_rad=turns,
    )


def _met(
    closed: ClosedCells,
    endpoints: tuple[LongArray, LongArray],
    grid: OccupancyGrid,
    found: CellPlans | None,
) -> BoolArray:
    """Return which queries meet closed cells with an endpoint, or with their paths, bool (n,).

    Only paths of cells are given; None for others.
    """
    across = np.array([grid.shape[1], 1])
    met: BoolArray = closed.holds(endpoints[0] @ across) | closed.holds(endpoints[1] @ across)
    if found is None:
        return met
    for k in np.flatnonzero(found.is_done & ~met).tolist():
        points = found.points[found.path_start[k] : found.path_start[k + 1]]
        met[k] = len(points) and closed.meets(grid.frame.cells_of(points), grid)
    return met


def _are_free(grid: OccupancyGrid, cells: LongArray) -> BoolArray:
    """Return whether cells (n, 2) lie on the map and are free."""
    classes = grid.classes
    inside = ((cells >= 0) & (cells < classes.shape)).all(axis=1)
    free = np.zeros(len(cells), dtype=np.bool_)
    free[inside] = classes[tuple(cells[inside].T)] == CellClass.FREE
    return free
