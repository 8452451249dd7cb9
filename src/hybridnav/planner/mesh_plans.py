"""How the preset `shortest` plans: exact any-angle paths on the convex mesh of free space."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.errors import InvalidValueError
from hybridnav.grid.lines import cells_of_line, polyline_lengths
from hybridnav.mesh import MeshSearch, build_mesh, cut_mesh, shortest_paths
from hybridnav.planner.cell_plans import CellPlan, CellPlans

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.mesh import MeshPath
    from hybridnav.planner.closed import ClosedCells

Cell = tuple[int, int]

_KEPT = 4
"""Meshes with something closed that are kept for the next queries which close the same."""


@copies_alike
class OverMesh:
    """Shortest any-angle paths; the mesh is built when the first query needs it.

    Parameters
    ----------
    grid
        The map, without corner cutting.
    allow_unexplored
        Whether unexplored cells may be entered.

    Raises
    ------
    InvalidValueError
        When the map allows corner cutting.
    """

    def __init__(self, grid: OccupancyGrid, *, allow_unexplored: bool) -> None:
        if grid.corner_cutting:
            raise InvalidValueError(
                "shortest any-angle paths do not pass between two blocked cells that meet at a "
                "corner, and this map allows that (corner_cutting): load it without, or take "
                "preset grid-astar"
            )
        self._frame = grid.frame
        self._free = np.ascontiguousarray(grid.enterable(allow_unexplored=allow_unexplored))
        self._search: MeshSearch | None = None
        self._cut: OrderedDict[bytes, MeshSearch] = OrderedDict()
        self._building = threading.Lock()

    def prepare(self) -> MeshSearch:
        """Build the mesh, once."""
        if self._search is None:
            with self._building:
                if self._search is None:
                    self._search = MeshSearch(build_mesh(self._free))
        return self._search

    def plan(self, start: Cell, goal: Cell) -> CellPlan:
        """Find a shortest path between the centres of two cells; see `CellPlanner`."""
        points = self._frame.points_of([start, goal])
        return self.between((start, goal), (points[0], points[1]), None)

    def between(
        self,
        cells: tuple[Cell, Cell],
        ends: tuple[FloatArray, FloatArray],
        closed: ClosedCells | None,
    ) -> CellPlan:
        """Find a shortest path between two points.

        Parameters
        ----------
        cells
            Those that hold them; they may be entered.
        ends
            `(x, y)` in metres, map frame.
        closed
            What is closed for this query, the ends not; None for nothing.
        """
        began = time.perf_counter()
        seconds = {}
        if self._search is None:
            self.prepare()
            seconds["mesh"] = time.perf_counter() - began
        search = self.prepare()
        places = [self._frame.position_of(float(end[0]), float(end[1])) for end in ends]
        positions = places[0], places[1]
        now = time.perf_counter()
        found, free = search.path(cells, positions), self._free
        expanded = found.expanded
        passed = self._passed(free, cells, found)
        if closed is not None and passed is not None and closed.are_near(passed, free.shape):
            search, free = self._without(search, closed)
            found = search.path(cells, positions)
            expanded += found.expanded
            passed = self._passed(free, cells, found)
        seconds["shortest"] = time.perf_counter() - now
        if found.positions is None:
            return CellPlan(None, metric="any-angle", expanded=expanded, seconds=seconds)
        points = self._frame.points_of_grid(found.positions)
        points[0], points[-1] = ends
        return CellPlan(
            passed,
            metric="any-angle",
            points=points,
            length_cells=found.length_cells,
            bound_cells=found.lower_bound_cells,
            expanded=expanded,
            seconds=seconds,
        )

    def plan_many(
        self, cells: tuple[LongArray, LongArray], points: tuple[FloatArray, FloatArray]
    ) -> CellPlans:
        """Find a shortest path for each of many pairs of points, on all cores.

        Parameters
        ----------
        cells
            int64 (n, 2), those that hold the starts, and the goals; they may be entered.
        points
            float64 (n, 2), starts and goals, `(x, y)` in metres, map frame.
        """
        positions = self._frame.positions_of(points[0]), self._frame.positions_of(points[1])
        found = shortest_paths(self.prepare(), cells, positions)
        along = self._frame.points_of_grid(found.positions)
        solved = np.isfinite(found.length_cells)
        along[found.path_start[:-1][solved]] = points[0][solved]
        along[found.path_start[1:][solved] - 1] = points[1][solved]
        cost_m = polyline_lengths(along, found.path_start)
        return CellPlans(
            np.ones(len(cost_m), dtype=np.bool_), "any-angle", cost_m, cost_m,
            found.path_start, along,
        )  # fmt: skip

    def _passed(
        self, free: BoolArray, cells: tuple[Cell, Cell], found: MeshPath
    ) -> LongArray | None:
        """Cells that a path passes, from the start's to the goal's; None without a path."""
        if found.positions is None:
            return None
        passed = cells_of_line(free, found.positions)
        # An end on a side may be named after the cell behind it.
        ends = [np.array([cell]) for cell in cells]
        before = ends[0] if (passed[0] != cells[0]).any() else passed[:0]
        behind = ends[1] if (passed[-1] != cells[1]).any() else passed[:0]
        return np.concatenate([before, passed, behind])

    def _without(self, whole: MeshSearch, closed: ClosedCells) -> tuple[MeshSearch, BoolArray]:
        """The mesh without closed cells, and what is free of them."""
        free = self._free.copy()
        free.ravel()[closed.flat] = False
        key = closed.flat.tobytes()
        with self._building:
            search = self._cut.pop(key, None)
            if search is None:
                search = MeshSearch(cut_mesh(whole.mesh, free, closed.flat))
            self._cut[key] = search
            if len(self._cut) > _KEPT:
                self._cut.popitem(last=False)
        return search, free
