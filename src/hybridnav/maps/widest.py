"""Widest paths: the largest robot that can go from one cell to another, and where it is tight.
Public: `Bottleneck`.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.typing import BoolArray
from hybridnav.maps.cells import CellClass
from hybridnav.maps.clearance import clearance_cells
from hybridnav.maps.kernels import joined_in_order
from hybridnav.maps.occupancy import OccupancyGrid

Cell = tuple[int, int]


class Bottleneck(NamedTuple):
    """Where the widest path between two cells is tightest.

    Examples
    --------
    >>> hn.maps.WidestPaths(hn.example_map("figure1")).between((0, 0), (29, 27))
    Bottleneck(radius_m=0.0, cell=None)
    """

    radius_m: float
    """A disc of every smaller radius has a path, one of this radius none; infinite without an
    occupied cell, 0 if not even a point has a path."""
    cell: Cell | None
    """The cell (row, col) nearest to an obstacle on the widest path; None if there is none."""


class WidestPaths:
    """The widest paths between all cells of a map, by one pass over its cells.

    Cells join in order of their clearance, the widest first, to a tree of sets (Kruskal's spanning
    tree of greatest weight, by union by size without compression). The step at which two cells come
    into one set is the bottleneck between them, and a look-up climbs at most log2 of the number of
    cells.

    Parameters
    ----------
    grid
        The map; its own radius does not matter. Moves are those of its planners: a diagonal needs
        both cells beside it, unless corners may be cut.
    closed
        bool (rows, cols), cells that no robot enters; None for none.
    allow_unexplored
        Whether unexplored cells may be entered.

    Examples
    --------
    >>> grid = hn.example_map("figure1")
    >>> hn.maps.WidestPaths(grid).between((5, 5), (24, 20))
    Bottleneck(radius_m=0.4, cell=(17, 4))
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        closed: BoolArray | None = None,
        allow_unexplored: bool = False,
    ) -> None:
        enterable = grid.measured == CellClass.FREE
        if allow_unexplored:
            enterable |= grid.measured == CellClass.UNEXPLORED
        if closed is not None:
            enterable &= ~closed
        clearance = clearance_cells(grid.measured == CellClass.OCCUPIED).ravel()
        cells = np.flatnonzero(enterable)
        self._order = cells[np.argsort(-clearance[cells], kind="stable")]
        self._radius_m = clearance[self._order] * grid.resolution_m
        self._cols = grid.shape[1]
        self._parent, self._time = joined_in_order(self._order, grid.shape, grid.corner_cutting)

    def between(self, start: Cell, goal: Cell) -> Bottleneck:
        """Return the bottleneck between two cells, (row, col) on the map."""
        one, other = (row * self._cols + col for row, col in (start, goal))
        parent, time = self._parent, self._time
        if parent[one] < 0 or parent[other] < 0:
            return Bottleneck(0.0, None)
        at = int(np.flatnonzero(self._order == one)[0]) if one == other else -1
        while one != other:
            if time[one] > time[other]:
                one, other = other, one
            at = int(time[one])
            if at == len(self._order):
                return Bottleneck(0.0, None)
            one = int(parent[one])
        radius_m = float(self._radius_m[at])
        row, col = divmod(int(self._order[at]), self._cols)
        return Bottleneck(radius_m, (row, col))
