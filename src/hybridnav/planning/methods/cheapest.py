"""Method `cheapest`: cheapest paths at any angle, on a lattice laid over the cells."""

from __future__ import annotations

import threading
from functools import partial

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.copies import copies_alike
from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.threads import keep_last
from hybridnav._base.typing import AnyArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.cells import Box
from hybridnav.maps.costs import CostLayer, cost_along
from hybridnav.maps.geometry import cells_of_line
from hybridnav.planning.methods.grid import KnownMap
from hybridnav.planning.settings import CheapestSettings
from hybridnav.refine import CostLine
from hybridnav.refine.one_way import obeys, shorten
from hybridnav.search.directed import DirectedSides
from hybridnav.search.found import ClosedCells, Found, MapChange, Method, Metric, PlanStats, Query
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.lattice import LatticeSearch, build_lattice

_FEWER = 8
"""Landmarks of a lattice that was renewed, which is to be ready soon."""
_KEPT = 8
"""Number of lattices round closed cells that are kept for queries with equal closures."""


@copies_alike
class OverLattice(Method):
    """Cheapest paths at any angle: a line over the lattice, moved to where it costs least.

    The lattice is built for the first query, in some 0.1 us a cell. It is not kept with a model: it
    belongs to costs, and these may change. Equal queries have equal answers, bit for bit, whatever
    was asked before.

    `known`: the map, without corner cutting, and its costs; without costs a metre costs a metre;
    `settings`: whether unexplored cells may be entered. Raises `InvalidValueError` when the map
    allows corner cutting.
    """

    def __init__(self, known: KnownMap, settings: CheapestSettings) -> None:
        grid = known.grid
        if grid.corner_cutting:
            raise InvalidValueError(
                "cheapest any-angle paths do not pass between two blocked cells that meet at a "
                "corner, and this map allows that (corner_cutting): load it without, or take "
                "preset grid-astar"
            )
        self._grid, self._settings = grid, settings
        self._take(known.costs)
        self._search: LatticeSearch | None = None
        self._around: dict[ClosedCells, tuple[LatticeSearch, CostLine]] = {}
        self._building = threading.RLock()  # a progress callback may plan

    def _take(self, costs: CostLayer | None) -> None:
        self.metric: Metric = "any-angle" if costs is None else "any-angle-weighted"
        self._layer = CostLayer(np.ones(self._grid.shape, np.float32)) if costs is None else costs
        allowed = self._settings.allow_unexplored
        self._line = CostLine(self._grid, self._layer, allow_unexplored=allowed)
        self._cells: GridSearch | None = None

    def may_enter(self, query: Query) -> bool:
        """Return whether the cells of start and goal may be entered."""
        free = self._line.free
        return bool(free[query.cells[0]] and free[query.cells[1]])

    def prepare(self, progress: Progress = no_progress) -> LatticeSearch:
        """Build the lattice, once; see `Method`."""
        if self._search is None:
            with self._building:
                if self._search is None:
                    lattice = build_lattice(self._line.free, self._line.factors)
                    self._search = LatticeSearch(lattice)
        progress(1, 1)
        return self._search

    def changed(self, change: MapChange) -> OverLattice:
        """Return the method of the changed map; blocks of cells that differ are laid anew. See
        `Method`."""
        other = OverLattice(KnownMap(*change[:3]), self._settings)
        other._search = self._renewed(self._search, other._line)
        return other

    def take_costs(self, costs: CostLayer, box: Box) -> bool:  # noqa: ARG002 - all cells are compared
        """Plan by other costs from now on; see `Method`."""
        self._take(costs)
        self._around.clear()
        self._search = self._renewed(self._search, self._line)
        return True

    @staticmethod
    def _renewed(search: LatticeSearch | None, line: CostLine) -> LatticeSearch | None:
        """Return the search of a lattice after cells changed, None for none."""
        if search is None:
            return None
        was = search.lattice
        differs = np.flatnonzero((was.free != line.free) | (was.factors != line.factors))
        return LatticeSearch(was.renewed(line.free, line.factors, differs).with_landmarks(_FEWER))

    def find(self, query: Query) -> Found:
        """Find a cheapest path between two points; see `Method`. Its cells are found when somebody
        reads them. The bound is the distance of the two: see `PlanResult.lower_bound` for a better
        one."""
        began = clock()
        seconds = {}
        if self._search is None:
            self.prepare()
            seconds["lattice"] = clock() - began
        now = clock()
        search, line = self.prepare(), self._line
        if query.closed is not None and len(query.closed.flat):
            search, line = self._round(query.closed)
        first, last = (
            self._position_in(cell, point)
            for cell, point in zip(query.cells, query.points, strict=True)
        )
        found = search.line(first, last, query.cells)
        seconds["search"] = clock() - now
        stats = PlanStats(expanded=found.expanded, seconds=seconds)
        if found.positions is None:
            return Found(None, stats=stats)
        now = clock()
        positions = line.settle(found.positions)
        seconds["settle"] = clock() - now
        points = line.in_metres(positions, *query.points)
        query = _held_to_cells(query, line.free, (first, last))
        if not obeys(line, query, points):
            cells = self._cells_of_line(query)
            if cells is None:
                return Found(None, stats=stats)
            points = shorten(self._line, query.closed, cells, query.points)
        points = points if query.straight_m > 0 else points[:1]
        if query.kept is not None and len(points) > 1:
            most_m = (1 + query.kept.within) * self._cost_m(query, points)
            rest = line.rest_of(query.kept.points, query.points[0], most_m)
            points = points if rest is None or not obeys(line, query, rest) else rest
        passed = partial(cells_passed, query, line, points)
        cost = partial(self._cost_m, query, points)
        return Found(passed, cost, query.straight_m, points, stats=stats)

    def _cells_of_line(self, query: Query) -> LongArray | None:
        """Return the cheapest path of cells, None for none: along it a line is led that obeys
        directions and begins and ends in its cells, where that over the lattice does not."""
        if self._cells is None:
            free = self._line.free.view(np.bool_)
            self._cells = GridSearch(free, units=self._layer.units)
        closed = query.closed
        assert closed is not None  # noqa: S101 - directions ride with what is closed
        return self._cells.search(*query.cells, blocked=closed.flat, one_way=closed.one_way).cells

    def _cost_m(self, query: Query, points: FloatArray) -> float:
        """Return the cost of a line in metres, which rounding takes below no distance."""
        return max(cost_along(self._grid, self._layer, points), query.straight_m)

    def _position_in(self, cell: tuple[int, int], point: FloatArray) -> tuple[float, float]:
        """Return the position of a point in a cell, on the grain of exact tests."""
        position = self._grid.frame.position_of(*point.tolist())
        row, col = (
            min(max(round(at * GRAIN) / GRAIN, float(low)), low + 1.0)
            for at, low in zip(position, cell, strict=True)
        )
        return row, col

    def _round(self, closed: ClosedCells) -> tuple[LatticeSearch, CostLine]:
        """Return the search and the finisher round closed cells, which are cached."""
        # By identity: `Planning.closed` returns the same object for equal closures.
        found = self._around.get(closed)
        if found is None:
            line = self._line.closing(closed.flat)
            shut = closed.flat[self._line.free.flat[closed.flat] != 0]
            lattice = self.prepare().lattice.renewed(line.free, line.factors, shut)
            found = keep_last(self._around, closed, (LatticeSearch(lattice), line), _KEPT)
        return found


def _held_to_cells(query: Query, free: AnyArray, ends: tuple[tuple[float, float], ...]) -> Query:
    """Return a query whose line has to begin and end in its cells, as if sides had directions.

    A corner at which two blocked cells meet lies in two cells that do not lead to each other there,
    and the lattice sees out of both. `free`: (rows, cols); `ends`: (row, col), on the grain.
    """
    for (row, col), end in zip(query.cells, ends, strict=True):
        is_corner = row and col and end == (row, col) and query.one_way is None
        if is_corner and free[row - 1, col - 1] and not free[row - 1, col] | free[row, col - 1]:
            none = ClosedCells(np.empty(0, np.int64), None, DirectedSides.of([], free.shape))
            return query._replace(closed=none if query.closed is None else query.closed | none)
    return query


def cells_passed(query: Query, line: CostLine, points: FloatArray) -> LongArray:
    """Return the cells that a line passes, from start to goal."""
    free, positions = line.free.view(np.bool_), line.on_grain(points)
    passed = cells_of_line(free, positions, query.cells)
    if query.one_way is None or not query.one_way.bars(passed, free):
        return passed
    from hybridnav.search.mesh import cells_across  # noqa: PLC0415 - the lattice needs no mesh

    # Along a side, or at a corner, the cell on the other hand may be listed.
    return cells_across(free, query.one_way, positions, query.cells)
