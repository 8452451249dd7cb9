"""Planner of the preset `shortest`: exact any-angle paths on the convex mesh."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.maps.lines import cells_of_line, polyline_length, polyline_lengths
from hybridnav.planner import PlanStats
from hybridnav.planner.cell_planner import CellPlan, CellPlans, enterable_of
from hybridnav.refine import LineOfSight
from hybridnav.search.mesh import (
    DetourSearch,
    MeshPath,
    MeshSearch,
    build_mesh,
    renew_mesh,
    shortest_paths,
)

if TYPE_CHECKING:
    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.planner import Metric, PlannerSettings
    from hybridnav.planner.cell_planner import CellQueries, CellQuery
    from hybridnav.planner.closed import ClosedCells
    from hybridnav.pyramid import Level
    from hybridnav.refine import GridRefiner

Position = tuple[float, float]


_MOST_REMOVED, _FEW = 0.5, 1000
"""Share and number of removed polygons that a mesh keeps: with more of them it is built anew."""
_KEPT = 8
"""Number of searches round closed cells that are kept for queries with equal closures."""


class FoundPath(NamedTuple):
    """A path on the mesh, before the cells that it passes are known."""

    query: CellQuery
    """What was asked for."""
    path: MeshPath
    """What the search has found."""
    points: FloatArray | None
    """float64 (n, 2), `(x, y)` in metres; None where no path was found."""
    stats: PlanStats
    """Its effort."""

    @property
    def length_m(self) -> float:
        """Length of the path in metres, infinite for none."""
        return math.inf if self.points is None else polyline_length(self.points)


@copies_alike
class OverMesh:
    """Shortest any-angle paths; the mesh is built when the first query needs it.

    Parameters
    ----------
    grid
        The map, without corner cutting.
    refiner
        Search of cell paths, for queries whose time is up before the search of the mesh has a path.
    settings
        Whether unexplored cells may be entered, and the accepted distance from the optimum.
    search
        Search of the mesh of the same cells, if it is built already.

    Raises
    ------
    InvalidValueError
        When the map allows corner cutting.
    """

    metric: Metric = "any-angle"

    def __init__(
        self,
        grid: OccupancyGrid,
        refiner: GridRefiner,
        settings: PlannerSettings,
        search: MeshSearch | None = None,
    ) -> None:
        if grid.corner_cutting:
            raise InvalidValueError(
                "shortest any-angle paths do not pass between two blocked cells that meet at a "
                "corner, and this map allows that (corner_cutting): load it without, or take "
                "preset grid-astar"
            )
        self._grid, self._frame = grid, grid.frame
        self._refiner = refiner
        self._settings = settings
        self._allow_unexplored = settings.allow_unexplored
        self._epsilon, self._budget_s = settings.epsilon or 0.0, settings.budget_s
        self._free = np.ascontiguousarray(grid.enterable(allow_unexplored=self._allow_unexplored))
        self._search = search
        self._is_renewed = False
        self._across = np.array([grid.shape[1], 1])
        self._detours: dict[ClosedCells, DetourSearch] = {}
        self._building = threading.RLock()  # a progress callback may plan

    @property
    def prepared(self) -> MeshSearch | None:
        """The search of the mesh, None until it is built, and after a change of the map."""
        return None if self._is_renewed else self._search

    def followed(self, grid: OccupancyGrid, cells: LongArray) -> OverMesh:
        """Return the planner of the changed map; polygons beside changed cells are cut anew, and
        the graph of corners is stale until it is prepared again. See `Following`."""
        made = OverMesh(grid, self._refiner.on(grid), self._settings)
        search = self._search
        if search is not None:
            was = enterable_of(self._grid, cells, allow_unexplored=self._allow_unexplored)
            changed = cells[was != made._free[tuple(cells.T)]]
            mesh = renew_mesh(search.mesh, made._free, changed @ self._across)
            if mesh is search.mesh:
                made._search, made._is_renewed = search, self._is_renewed
            elif (mesh.component < 0).sum() <= _MOST_REMOVED * mesh.n_polygons + _FEW:
                made._search, made._is_renewed = MeshSearch(mesh), True
        return made

    def prepare(self, progress: Progress = no_progress) -> MeshSearch:
        """Build the mesh and the graph of its corners, once; see `CellPlanner`."""
        search = self._on_mesh()
        if not search.is_prepared:
            progress(1, 3)
            search.prepare(lambda done, total: progress(done + 1, total + 1))
        return search

    def _on_mesh(self) -> MeshSearch:
        """Return the search of the mesh, which is built once."""
        if self._search is None:
            with self._building:
                if self._search is None:
                    self._search = MeshSearch(build_mesh(self._free))
        return self._search

    def plan(self, query: CellQuery) -> CellPlan:
        """Find a shortest path between two points; see `CellPlanner`.

        When the preset's time is up, or if it has a time limit and the mesh is not built yet, the
        answer is a cell path shortened by line of sight, with the proved bound.
        """
        return self.completed(self.found(query))

    def found(self, query: CellQuery) -> FoundPath:
        """Find the points of a shortest path between two points, not yet the cells that it
        passes."""
        began = time.perf_counter()
        seconds = {}
        if self._search is None and self._budget_s is None:
            self._on_mesh()
            seconds["mesh"] = time.perf_counter() - began
        start, goal = query.points
        row, col = self._frame.position_of(float(start[0]), float(start[1]))
        positions = (row, col), self._frame.position_of(float(goal[0]), float(goal[1]))
        now = time.perf_counter()
        found, expanded = self._on_graph(query, positions)
        points = None
        if found.positions is not None:
            points = self._frame.points_of_grid(found.positions)
            points[0], points[-1] = query.points
        seconds["shortest"] = time.perf_counter() - now
        return FoundPath(
            query, found, points, PlanStats(expanded_intervals=expanded, seconds=seconds)
        )

    def completed(self, path: FoundPath) -> CellPlan:
        """Return the plan of a path that was found, with the cells that it passes."""
        query, found, points, stats = path
        now = time.perf_counter()
        passed = self._passed(query, found)
        stats.seconds["shortest"] += time.perf_counter() - now
        plan = CellPlan(
            passed,
            points=points,
            length_cells=found.length_cells,
            bound_cells=found.lower_bound_cells,
            stats=stats,
        )
        if points is not None or math.isinf(found.lower_bound_cells):
            return plan  # a path, or the proof of none
        return self._in_sight(query, plan)

    def _on_graph(
        self, query: CellQuery, positions: tuple[Position, Position]
    ) -> tuple[MeshPath, int]:
        """Return the path of the search of the mesh, and the nodes expanded."""
        search = self._search
        if search is None:
            bound = math.dist(*positions)
            return MeshPath(None, math.inf, bound, 0), 0
        began = time.perf_counter()
        found = search.path(query.cells, positions, epsilon=self._epsilon, budget_s=self._budget_s)
        closed, expanded = query.closed, found.expanded
        is_cut_off = found.positions is None and math.isinf(found.lower_bound_cells)
        if closed is None or is_cut_off:
            return found, expanded
        detours = self._round(search, closed)
        if found.positions is None or detours.is_met_by(found):
            bound = found.lower_bound_cells
            left_s = self._budget_s
            if left_s is not None:
                left_s = max(left_s - (time.perf_counter() - began), 0.0)
            found = detours.path(query.cells, positions, epsilon=self._epsilon, budget_s=left_s)
            expanded += found.expanded
            # Closed cells make no path shorter.
            bound = max(min(bound, found.length_cells), found.lower_bound_cells)
            found = replace(found, lower_bound_cells=bound)
        return found, expanded

    def _in_sight(self, query: CellQuery, plan: CellPlan) -> CellPlan:
        """Return the shortest path of cells, shortened by line of sight, with a plan's bound."""
        began = time.perf_counter()
        flat = None if query.closed is None else query.closed.flat
        found = self._refiner.search.search(*query.cells, blocked=flat)
        points = None
        if found.cells is not None:
            sight = self._open_sight if flat is None else self._sight(flat)
            points = sight.shorten(found.cells, *query.points)
        seconds = {**plan.stats.seconds, "line-of-sight": time.perf_counter() - began}
        expanded = plan.stats.expanded_intervals + found.expanded
        stats = PlanStats(expanded_intervals=expanded, seconds=seconds)
        if points is None:
            return CellPlan(None, stats=stats)
        length = polyline_length(points) / self._frame.resolution_m
        bound = min(plan.bound_cells, length)
        return CellPlan(found.cells, points, length_cells=length, bound_cells=bound, stats=stats)

    @cached_property
    def _open_sight(self) -> LineOfSight:
        return self._sight(None)

    def _sight(self, closed: LongArray | None) -> LineOfSight:
        """Return the shortener of cell paths, with some flat cells closed."""
        return LineOfSight(self._grid, allow_unexplored=self._allow_unexplored, closed=closed)

    def plan_many(self, queries: CellQueries) -> CellPlans | None:
        """Find a shortest path for each query, on all cores; see `CellPlanner`.

        Queries whose paths meet closed cells stay undone, and with a time limit all of them.
        """
        if self._budget_s is not None:
            return None
        cells, points, closed = queries
        positions = self._frame.positions_of(points[0]), self._frame.positions_of(points[1])
        search = self._on_mesh()
        found = shortest_paths(search, cells, positions, epsilon=self._epsilon)
        is_done = np.ones(len(cells[0]), dtype=np.bool_)
        if closed is not None:
            is_done = ~self._round(search, closed).are_met_by(found)
        along = self._frame.points_of_grid(found.positions)
        solved = np.isfinite(found.length_cells)
        along[found.path_start[:-1][solved]] = points[0][solved]
        along[found.path_start[1:][solved] - 1] = points[1][solved]
        cost_m = polyline_lengths(along, found.path_start)
        share = np.ones(len(cost_m))
        moves = solved & (found.length_cells > 0)
        np.divide(found.lower_bound_cells, found.length_cells, out=share, where=moves)
        return CellPlans(
            is_done=is_done,
            cost_m=cost_m,
            lower_bound_m=cost_m * share,
            path_start=found.path_start,
            points=along,
        )

    def bound(self, plan: CellPlan, points: tuple[FloatArray, FloatArray]) -> float:  # noqa: ARG002
        """Return the bound of the plan, which is any-angle; see `CellPlanner`."""
        return plan.bound_cells * self._frame.resolution_m

    def fields(self, level: Level) -> IntArray:
        """Return the fields of the places, as the mesh has none; see `CellPlanner`."""
        return level.field_of

    def _passed(self, query: CellQuery, found: MeshPath) -> LongArray | None:
        """Return the cells that a path passes, from start to goal; None without a path."""
        if found.positions is None:
            return None
        passed = cells_of_line(self._free, found.positions)
        if query.closed is not None and query.closed.holds(passed @ self._across).any():
            passed = self._passed_beside(query.closed, found.positions)
        # For an end on a side, the cell behind the side may be listed.
        cells = query.cells
        parts = [passed]
        if tuple(passed[0].tolist()) != cells[0]:
            parts.insert(0, np.array([cells[0]]))
        if tuple(passed[-1].tolist()) != cells[1]:
            parts.append(np.array([cells[1]]))
        return passed if len(parts) == 1 else np.concatenate(parts)

    def _passed_beside(self, closed: ClosedCells, positions: FloatArray) -> LongArray:
        """Return the cells that a path along sides of closed cells passes, without these."""
        low = np.maximum(positions.min(axis=0).astype(np.int64) - 1, 0)
        high = positions.max(axis=0).astype(np.int64) + 2
        free = self._free[low[0] : high[0], low[1] : high[1]].copy()
        at = np.stack(np.divmod(closed.flat, self._free.shape[1]), axis=1) - low
        free[tuple(at[((at >= 0) & (at < free.shape)).all(axis=1)].T)] = False
        passed: LongArray = cells_of_line(free, positions - low) + low
        return passed

    def _round(self, search: MeshSearch, closed: ClosedCells) -> DetourSearch:
        """Return the search round closed cells, which is cached."""
        # By identity: `Closures` returns the same object for equal closures.
        found = self._detours.get(closed)
        if found is None:
            found = self._detours[closed] = DetourSearch(search.mesh, self._free, closed.flat)
            for old in list(self._detours)[:-_KEPT]:
                self._detours.pop(old, None)
        return found
