"""Two discs about the base of a robot, between which its footprint lies: what each one proves."""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.typing import BoolArray, LongArray
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.costs import CostLayer, cost_along
from hybridnav.planning import Path
from hybridnav.planning.endpoints import refusal
from hybridnav.planning.finishes import CostFinish
from hybridnav.planning.methods.cheapest import OverLattice
from hybridnav.planning.methods.grid import KnownMap
from hybridnav.planning.methods.shortest import OverMesh
from hybridnav.planning.settings import CheapestSettings, ShortestSettings
from hybridnav.search.found import ClosedCells, Found, Query

if TYPE_CHECKING:
    from hybridnav.refine.footprint import Footprint

    Disc = OverMesh | OverLattice
    """Finds paths of a disc."""

_ROUNDING_CELLS = 1e-6
"""More than rounding moves a body: the discs are smaller, and larger, by this."""
_BESIDE = 1.5
"""Radius in cells of a cell with the eight around it."""


@copies_alike
class Discs:
    """Best paths of the largest disc inside a footprint, and of the smallest one round it: the
    shortest, or with costs the cheapest, counted along the path of the base.

    A cell is blocked for the inscribed disc if that meets an obstacle wherever in the cell its
    centre is: without a path of it the robot has none, and no path of the robot is shorter. A cell
    is free for the circumscribed disc if that meets none anywhere: its path is valid with every
    heading. Both keep the rules of the map for the base.

    `grid`: the map, without corner cutting, inflated by no more than the inscribed radius;
    `allow_unexplored`: whether unexplored cells may be entered; `costs`: costs of the cells; None
    for lengths.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        footprint: Footprint,
        *,
        allow_unexplored: bool = False,
        costs: CostLayer | None = None,
    ) -> None:
        self._grid, self._footprint, self._costs = grid, footprint, costs
        self._allow_unexplored = allow_unexplored
        self._grown: dict[ClosedCells, ClosedCells] = {}

    @cached_property
    def inscribed(self) -> Disc | None:
        """Finds paths of the inscribed disc; None if the map is that of the disc already."""
        grid = self._inscribed_grid
        return None if grid is self._grid else self._method(grid)

    @cached_property
    def _inscribed_grid(self) -> OccupancyGrid:
        """The map of the inscribed disc, the given one if no more cells are blocked."""
        radius = self._footprint.inscribed_radius_m / self._grid.resolution_m - _ROUNDING_CELLS
        if radius < 0:
            return self._grid
        blocked = within_radius(self._obstacles, radius_cells=radius)
        blocked &= self._grid.classes != CellClass.OCCUPIED
        return self._blocking(blocked) if blocked.any() else self._grid

    @cached_property
    def circumscribed(self) -> Disc:
        """Finds paths of the circumscribed disc."""
        return self._method(self._blocking(self._near(self._obstacles)))

    def below(self, query: Query) -> Found | None:
        """Return a best path of the inscribed disc, or that it has none; None if its map is the one
        that is given."""
        disc = self.inscribed
        return disc.find(query) if disc is not None and disc.may_enter(query) else None

    def above(self, query: Query) -> Found | None:
        """Return a best path of the circumscribed disc; None without one."""
        disc, closed = self.circumscribed, query.closed
        if closed is not None and closed.solid is not None:
            closed = self._around(closed, closed.solid)
        is_shut = closed is not None and refusal(closed, query.cells, self._grid.shape)
        if is_shut or not disc.may_enter(query):
            return None
        found = disc.find(query._replace(closed=closed))
        return found if found.has_path else None

    @property
    def _obstacles(self) -> BoolArray:
        return self._grid.measured == CellClass.OCCUPIED

    def _near(self, obstacles: BoolArray) -> BoolArray:
        """Return the cells with a point that is nearer to an obstacle than the large radius."""
        # From the side of a cell to that of another it is as far as from a centre to the nearest
        # one of the other cell and those around it.
        wide = within_radius(obstacles, radius_cells=_BESIDE)
        radius = self._footprint.circumscribed_radius_m / self._grid.resolution_m
        return within_radius(wide, radius_cells=radius + _ROUNDING_CELLS)

    def _around(self, closed: ClosedCells, solid: LongArray) -> ClosedCells:
        """Return closed cells with those that the large disc does not enter beside solid ones."""
        found = self._grown.get(closed)
        if found is None:
            obstacles = np.zeros(self._grid.shape, dtype=np.bool_)
            obstacles.flat[solid] = True
            flat = np.union1d(closed.flat, np.flatnonzero(self._near(obstacles)))
            self._grown.clear()
            found = self._grown[closed] = ClosedCells(flat, one_way=closed.one_way)
        return found

    def _blocking(self, blocked: BoolArray) -> OccupancyGrid:
        """Return the map with more blocked cells."""
        values = {one.name: getattr(self._grid, one.name) for one in fields(self._grid)}
        values["classes"] = np.where(blocked, np.uint8(CellClass.OCCUPIED), self._grid.classes)
        return OccupancyGrid.restored(**values)

    def _method(self, grid: OccupancyGrid) -> Disc:
        """Return the method of a map, prepared."""
        known, allowed = KnownMap(grid, None, self._costs), self._allow_unexplored
        if self._costs is None:
            method: Disc = OverMesh(known, ShortestSettings(allow_unexplored=allowed))
        else:
            settings = CheapestSettings(allow_unexplored=allowed)
            method = OverLattice(known, settings)
        method.prepare()
        return method

    def cost_m(self, path: Path) -> float:
        """Return what a path costs, in metres; its length without costs."""
        if self._costs is None:
            return path.length_m
        return max(cost_along(self._grid, self._costs, path.points), path.length_m)

    def bound_m(self, query: Query, cost_m: float) -> float:
        """Return a lower bound on the cost of all paths of the inscribed disc, at most `cost_m`."""
        return self._finish.bound(query, cost_m)

    @cached_property
    def _finish(self) -> CostFinish:
        """Finds bounds on the costs of paths of the inscribed disc."""
        assert self._costs is not None  # noqa: S101 - the plan is by costs
        settings = CheapestSettings(allow_unexplored=self._allow_unexplored)
        return CostFinish(self._inscribed_grid, self._costs, settings)
