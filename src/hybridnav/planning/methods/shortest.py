"""Method `shortest`: exact any-angle paths on the convex mesh."""

from __future__ import annotations

import math
import threading
import warnings
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.copies import copies_alike
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.threads import Pool, keep_last
from hybridnav._base.trig import dist
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.geometry import cells_of_line, line_between, polyline_length, polyline_lengths
from hybridnav.planning.methods.grid import KnownMap, enterable_of
from hybridnav.planning.settings import ShortestSettings
from hybridnav.refine import LineOfSight
from hybridnav.search.found import (
    ClosedCells,
    Found,
    FoundMany,
    MapChange,
    Method,
    Metric,
    PlanStats,
    Query,
    QueryMany,
)
from hybridnav.search.mesh import (
    CornerHierarchy,
    DetourSearch,
    MeshPath,
    MeshSearch,
    build_mesh,
    cells_across,
    renew_mesh,
    shortest_paths,
)
from hybridnav.search.mesh.build import count_corners

if TYPE_CHECKING:
    from hybridnav.search.distance_table import LabelSource


_MOST_REMOVED, _FEW = 0.5, 1000
"""Share and number of removed polygons that a mesh keeps: with more of them it is built anew."""
_KEPT = 8
"""Number of searches round closed cells that are kept for queries with equal closures."""
_LARGE, _S, _GB = 1_000_000, 5e-6, 3e-7
"""Corners from which a mesh is announced, and what each takes with 30 % of cells blocked at random:
of 2,000 x 2,000 cells 12 s and 0.7 GB, of 4,000 x 4,000 46 s and 2.5 GB. A path across the former
took 7 to 11 s and 0.6 GB more."""


def announce_mesh(free: BoolArray) -> None:
    """Warn before a mesh is built that takes many seconds; `free`: bool (rows, cols)."""
    if free.size >= _LARGE and (n_corners := count_corners(free)) >= _LARGE:
        warnings.warn(
            f"the map has {n_corners / 1e6:.1f} million corners: their mesh takes about "
            f"{n_corners * _S:.0f} s and {n_corners * _GB:.1f} GB, once, and a far path "
            "as much again; preset grid-astar needs neither",
            stacklevel=1,  # one place, so that it is shown once
        )


@copies_alike
class OverMesh(Method):
    """Shortest any-angle paths; the mesh is built when the first query needs it.

    `known`: the map, without corner cutting, and the search of its mesh, if it is built already;
    `settings`: whether unexplored cells may be entered, the accepted distance from the optimum, and
    the time of a query. Raises `InvalidValueError` when the map allows corner cutting.
    """

    metric: Metric = "any-angle"

    def __init__(self, known: KnownMap, settings: ShortestSettings) -> None:
        grid, search = known.grid, known.prepared
        if grid.corner_cutting:
            raise InvalidValueError(
                "shortest any-angle paths do not pass between two blocked cells that meet at a "
                "corner, and this map allows that (corner_cutting): load it without, or take "
                "preset grid-astar"
            )
        self._grid, self._frame = grid, grid.frame
        self._placing = grid.frame.for_kernels
        self._refiner = known.refiner(settings)
        self._settings = settings
        self._allow_unexplored = settings.allow_unexplored
        self._epsilon, self._budget_s = settings.epsilon or 0.0, settings.budget_s
        self._free = np.ascontiguousarray(grid.enterable(allow_unexplored=self._allow_unexplored))
        self._search = search if isinstance(search, MeshSearch) else None
        self._is_renewed = False
        self._across = np.array([grid.shape[1], 1])
        self._detours: dict[ClosedCells, DetourSearch] = {}
        self._scratch = Pool(partial(np.copy, self._free))
        self._building = threading.RLock()  # a progress callback may plan

    @property
    def prepared(self) -> MeshSearch | None:
        """The search of the mesh, None until it is built, and after a change of the map."""
        return None if self._is_renewed else self._search

    def changed(self, change: MapChange) -> OverMesh:
        """Return the method of the changed map; polygons beside changed cells are cut anew, and
        the graph of corners is stale until it is prepared again. See `Method`."""
        made, cells = OverMesh(KnownMap(change.grid, change.topology), self._settings), change.cells
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
        """Build the mesh and the graph of its corners, once; see `Method`."""
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
                    announce_mesh(self._free)
                    self._search = MeshSearch(build_mesh(self._free))
        return self._search

    def may_enter(self, query: Query) -> bool:
        """Return whether the cells of start and goal may be entered."""
        return bool(self._free[query.cells[0]] and self._free[query.cells[1]])

    def find(self, query: Query) -> Found:
        """Find a shortest path between two points; see `Method`. Its cells are found when somebody
        reads them.

        When the preset's time is up, or if it has a time limit and the mesh is not built yet, the
        answer is a cell path shortened by line of sight, with the proved bound; not where
        directions bar the undirected path, which take the time that they need.
        """
        began, seconds = clock(), {}
        if self._search is None and (self._budget_s is None or query.one_way is not None):
            self._on_mesh()
            seconds["mesh"] = clock() - began
            began = clock()
        path = self._path_round(query)
        if path.positions is not None:
            start, goal = query.points
            ends = (*start.tolist(), *goal.tolist())
            points, length_m = line_between(path.positions, ends, self._placing)
            seconds["shortest"] = clock() - began
            cells = partial(self._passed, query, path, seconds)
            stats = PlanStats(expanded_intervals=path.expanded, seconds=seconds)
            return _along((points, length_m), path, cells, stats)
        seconds["shortest"] = clock() - began
        stats = PlanStats(expanded_intervals=path.expanded, seconds=seconds)
        if math.isinf(path.lower_bound_cells):
            return Found(None, stats=stats)
        return self._in_sight(query, path.lower_bound_cells, stats)

    def _path_round(self, query: Query) -> MeshPath:
        positions, search, left_s = query.positions, self._search, self._budget_s
        if positions is None:
            first, last = (self._frame.position_of(*point.tolist()) for point in query.points)
            positions = first, last
        if search is None:
            return MeshPath(None, math.inf, dist(*positions), 0)
        began = 0.0 if left_s is None else clock()
        path = search.path(query.cells, positions, epsilon=self._epsilon, budget_s=left_s)
        closed = query.closed
        if closed is None or path.lower_bound_cells == math.inf:
            return path
        detours = self._round(search, closed)
        if path.positions is not None and not detours.is_met_by(path):
            return path
        if detours.is_directed:
            left_s = None  # a path of cells in its place could be shortened across a side
        if left_s is not None:
            left_s = max(left_s - (clock() - began), 0.0)
        around = detours.search.path(query.cells, positions, epsilon=self._epsilon, budget_s=left_s)
        # Closed cells make no path shorter.
        bound = max(min(path.lower_bound_cells, around.length_cells), around.lower_bound_cells)
        expanded = path.expanded + around.expanded
        return around._replace(lower_bound_cells=bound, expanded=expanded)

    def _in_sight(self, query: Query, bound_cells: float, spent: PlanStats) -> Found:
        began = clock()
        flat = None if query.closed is None else query.closed.flat
        found = self._refiner.search.search(*query.cells, blocked=flat)
        points = None
        if found.cells is not None:
            sight = self._open_sight if flat is None else self._sight(flat)
            points = sight.shorten(found.cells, *query.points)
        seconds = {**spent.seconds, "line-of-sight": clock() - began}
        expanded = spent.expanded_intervals + found.expanded
        stats = PlanStats(expanded_intervals=expanded, seconds=seconds)
        if points is None or found.cells is None:
            return Found(None, stats=stats)
        length_m = polyline_length(points)
        length = length_m / self._frame.resolution_m
        path = MeshPath(None, length, min(bound_cells, length), 0)
        return _along((points, length_m), path, found.cells, stats)

    @cached_property
    def _open_sight(self) -> LineOfSight:
        return self._sight(None)

    def _sight(self, closed: LongArray | None) -> LineOfSight:
        """Return the shortener of cell paths, with some flat cells closed."""
        return LineOfSight(self._grid, allow_unexplored=self._allow_unexplored, closed=closed)

    def labels(self, closed: ClosedCells | None = None) -> LabelSource | None:
        """Return labels in the hierarchy of corners, or on the graph where it is not contracted;
        with closed cells of a mesh without them; None where directions count. See `Method`."""
        # Loads kernels for tables alone.
        from hybridnav.search.mesh.labels import MeshLabels, ViewLabels  # noqa: PLC0415

        search = self._on_mesh()
        if closed is not None:
            # Not the search that plans ask: with its graph it might find another of equal paths.
            detours = self._round(search, closed)
            if detours.is_directed:
                return None
            search = MeshSearch(detours.search.mesh)
        search.prepare()
        if isinstance(search.graph, CornerHierarchy):
            return MeshLabels(search, search.graph)
        return None if search.edges is None else ViewLabels(search, search.edges)

    def find_many(self, queries: QueryMany) -> FoundMany | None:
        """Find a shortest path for each query, on all cores; see `Method`.

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
        return FoundMany(
            is_done=is_done,
            cost_m=cost_m,
            lower_bound_m=cost_m * share,
            path_start=found.path_start,
            points=along,
        )

    def _passed(self, query: Query, path: MeshPath, seconds: dict[str, float]) -> LongArray:
        """Return the cells that a path passes, from start to goal, and add the time to its
        stage."""
        now = clock()
        passed = self._cells_along(query, path)
        seconds["shortest"] += clock() - now
        return passed

    def _cells_along(self, query: Query, path: MeshPath) -> LongArray:
        """Return the cells that a path passes, from start to goal."""
        assert path.positions is not None  # noqa: S101 - only paths are asked for their cells
        passed = cells_of_line(self._free, path.positions, query.cells)
        if query.closed is not None and query.closed.holds(passed @ self._across).any():
            passed = self._passed_beside(query.closed, path.positions, query.cells)
        if query.closed is None or query.one_way is None:
            return passed
        # Along a side, or at a corner, the cell on the other hand may be listed.
        with self._round(self._on_mesh(), query.closed).open_cells() as free:
            if not query.one_way.bars(passed, free):
                return passed
            return cells_across(free, query.one_way, path.positions, query.cells)

    def _passed_beside(
        self, closed: ClosedCells, positions: FloatArray, ends: Sequence[tuple[int, int]]
    ) -> LongArray:
        """Return the cells that a path along sides of closed cells passes, without these."""
        low = np.maximum(positions.min(axis=0).astype(np.int64) - 1, 0)
        high = positions.max(axis=0).astype(np.int64) + 2
        free = self._free[low[0] : high[0], low[1] : high[1]].copy()
        at = np.stack(np.divmod(closed.flat, self._free.shape[1]), axis=1) - low
        free[tuple(at[((at >= 0) & (at < free.shape)).all(axis=1)].T)] = False
        return cells_of_line(free, positions - low, (np.array(ends) - low).tolist()) + low

    def _round(self, search: MeshSearch, closed: ClosedCells) -> DetourSearch:
        # By identity: `Closures` returns the same object for equal closures.
        found = self._detours.get(closed)
        if found is None:
            sides = None if closed.one_way is None else closed.one_way.sides
            known = search, self._free, closed.flat, self._scratch, sides
            found = keep_last(self._detours, closed, DetourSearch(*known), _KEPT)
        return found


def _along(
    line: tuple[FloatArray, float],
    path: MeshPath,
    cells: LongArray | Callable[[], LongArray],
    stats: PlanStats,
) -> Found:
    """Return the answer of a path through points, of a length in metres.

    The bound is a share of the length in metres, so that a proved optimum has no gap by rounding.
    """
    (points, length_m), (_, length, bound, _) = line, path
    bound_m = min(length_m * (bound / length), length_m) if length else 0.0
    return Found(cells, length_m, bound_m, points, stats=stats, measured_m=length_m)
