"""The portal planner: routes over portals of fields that are chosen for routing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.grid import CellClass
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.route.corridor import Corridor
from hybridnav.route.portal_table import PortalTable
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.octile import path_length_in_cells
from hybridnav.topology.portals import build_portals

if TYPE_CHECKING:
    from hybridnav._typing import IntArray, LongArray
    from hybridnav.pyramid import Level
    from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]

SPACING_CELLS = 8
LEAST_FIELDS = 16
"""With fewer fields of the size asked for, half the size is tried: a field is searched cell by cell
where start and goal share it."""


class PortalSearch:
    """Paths over portals: table look-ups, then stored directions.

    The fields are not the places: a level of its own, grown with the linkage "survivor" and twice
    the merge distance of the places, routes better and costs less.

    Parameters
    ----------
    topology
        The map; of it only the grid, the merge distance and the seed are used.
    allow_unexplored
        Whether unexplored cells may be entered.
    """

    def __init__(self, topology: TopologicalMap, *, allow_unexplored: bool = False) -> None:
        grid = topology.grid
        self._shape = grid.shape
        enterable = grid.enterable(allow_unexplored=allow_unexplored)
        self.level = _routing_level(topology)
        portals = build_portals(
            grid,
            self.level.field_of,
            spacing_cells=SPACING_CELLS,
            allow_unexplored=allow_unexplored,
        )
        self.table = PortalTable(portals, grid.shape[1])
        self._field_of: IntArray = portals.field_of.reshape(grid.shape)
        self._sizes = portals.field_sizes
        self._search = GridSearch(enterable, corner_cutting=grid.corner_cutting)

    def path(self, start: Cell, goal: Cell) -> tuple[LongArray | None, int]:
        """A short path between two cells, and the cells that were expanded for it.

        It is the shortest of those that cross fields at portals only. Between cells of one field
        it is the better one of the shortest inside the field and the best over portals.

        Parameters
        ----------
        start, goal
            Cells that may be entered.
        """
        cols = self._shape[1]
        route = self.table.route(start[0] * cols + start[1], goal[0] * cols + goal[1])
        cells = None if route is None else np.stack(divmod(route.cells, cols), axis=1)
        field = self._field_of[start]
        if field != self._field_of[goal]:
            return cells, 0
        inside = np.zeros(len(self._sizes), dtype=np.bool_)
        inside[field] = True
        found = self._search.search(start, goal, field_of=self._field_of, in_corridor=inside)
        if found.cells is None or (
            cells is not None and path_length_in_cells(cells) < path_length_in_cells(found.cells)
        ):
            return cells, found.expanded
        return found.cells, found.expanded

    def corridor(self, cells: LongArray) -> Corridor:
        """The fields that a path passes.

        Parameters
        ----------
        cells
            int64 (n, 2), of the path.
        """
        inside = np.zeros(len(self._sizes), dtype=np.bool_)
        inside[self._field_of[cells[:, 0], cells[:, 1]]] = True
        return Corridor(self._field_of, inside, int(self._sizes[inside].sum()))


def _routing_level(topology: TopologicalMap) -> Level:
    pyramid = topology.pyramid
    distance_m = 2 * pyramid.merge_distance_m
    if not np.isfinite(distance_m):
        distance_m = 2 * max(topology.grid.shape) * topology.grid.resolution_m
    while True:
        level = DualGraphPyramid.build(
            topology.grid, merge_distance_m=distance_m, linkage="survivor", seed=pyramid.seed
        )[-1]
        large = level.areas[level.classes == CellClass.FREE] > level.areas.max(initial=0) / 100
        if large.sum() >= LEAST_FIELDS or distance_m < 8 * topology.grid.resolution_m:
            return level
        distance_m /= 2
