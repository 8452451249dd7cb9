"""Free space as the builder of route graphs sees it: cells, sight, exact shortest paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.mesh import MeshSearch, build_mesh, shortest_paths
from hybridnav.mesh.search import rounded_into
from hybridnav.refine import Sight

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.mesh import MeshPaths

_BESIDE = np.array([[0, 0], [0, -1], [-1, 0], [-1, -1]])
"""From a lattice corner to the four cells round it."""


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """The cells that the robot may enter, with exact tests and searches."""

    grid: OccupancyGrid
    free: BoolArray
    """bool (rows, cols)."""
    component_of: IntArray
    """int32 (rows, cols), the connected part of each free cell, -1 elsewhere."""
    sight: Sight
    search: MeshSearch

    @classmethod
    def of(cls, grid: OccupancyGrid) -> FreeSpace:
        """Prepare the free space of a map.

        Raises
        ------
        InvalidValueError
            When the map allows corner cutting.
        """
        if grid.corner_cutting:
            raise InvalidValueError(
                "edges of a route graph do not pass between two blocked cells that meet at a "
                "corner, and this map allows that (corner_cutting): load it without"
            )
        free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
        mesh = build_mesh(free)
        component_of = np.full(free.shape, -1, dtype=np.int32)
        component_of[free] = mesh.component[mesh.polygon_at[free]]
        return cls(grid, free, component_of, Sight(free), MeshSearch(mesh))

    def cells_at(self, positions: FloatArray) -> LongArray:
        """Return a free cell whose closed square contains each position, int64 (n, 2)."""
        return free_cells_at(self.free, positions)

    def moved_off(self, bends: FloatArray, away_cells: float) -> FloatArray:
        """Move positions off the blocked cell that paths bend round there, where there is room.

        Parameters
        ----------
        bends
            float64 (n, 2), lattice corners with one blocked cell of four.
        away_cells
            How far along rows, and along columns; a multiple of 0.5.

        Returns
        -------
        FloatArray
            float64 (n, 2).
        """
        row, col = bends.astype(np.int64).T
        below = ~(self.free[row - 1, col - 1] & self.free[row - 1, col])
        left = ~(self.free[row - 1, col - 1] & self.free[row, col - 1])
        off = np.stack([np.where(below, 1.0, -1.0), np.where(left, 1.0, -1.0)], axis=1)
        moved = np.clip(bends + away_cells * off, 0.0, self.free.shape)
        fits = self.sight.clear(bends, moved) & ~self._is_pinched(moved)
        return np.where(fits[:, None], moved, bends)

    def _is_pinched(self, positions: FloatArray) -> BoolArray:
        """Return which positions are lattice corners at which two blocked cells meet: no path leads
        through, though free cells on both sides see them."""
        row, col = positions.astype(np.int64).T
        padded = np.pad(self.free, 1)
        low, right = padded[row, col], padded[row, col + 1]
        left, high = padded[row + 1, col], padded[row + 1, col + 1]
        is_corner = (positions % 1 == 0).all(axis=1)
        found: BoolArray = is_corner & (low == high) & (left == right) & (low != left)
        return found

    def components_at(self, positions: FloatArray) -> IntArray:
        """Return the connected part of free space that each position lies in, int32 (n,)."""
        found: IntArray = self.component_of[tuple(self.cells_at(positions).T)]
        return found

    def paths(self, starts: FloatArray, goals: FloatArray) -> MeshPaths:
        """Return the shortest paths of many pairs of positions."""
        cells = self.cells_at(starts), self.cells_at(goals)
        return shortest_paths(self.search, cells, (starts, goals))

    def random_pairs(
        self, count: int, rng: np.random.Generator, least_cells: int
    ) -> tuple[FloatArray, FloatArray]:
        """Draw pairs of centres of free cells with a path between them.

        Parameters
        ----------
        count
            Number of pairs.
        rng
            Source of random numbers.
        least_cells
            Parts of free space with fewer cells are left out.

        Returns
        -------
        tuple
            float64 (count, 2) starts and goals; empty where no part has two cells.
        """
        cells = np.argwhere(self.free)
        component = self.component_of[self.free]
        size = np.bincount(component, minlength=1)
        large = size[component] >= max(least_cells, 2)
        cells, component = cells[large], component[large]
        order = np.argsort(component, kind="stable")
        cells, component = cells[order], component[order]
        if not len(cells):
            return np.empty((0, 2)), np.empty((0, 2))
        first = rng.integers(len(cells), size=count)
        # The other end is one of the other cells of the same part.
        low = np.searchsorted(component, component[first])
        others = size[component[first]] - 1
        other = low + (first - low + 1 + rng.integers(others)) % (others + 1)
        centres = np.asarray(cells + 0.5, dtype=np.float64)
        return centres[first], centres[other]


def free_cells_at(free: BoolArray, positions: FloatArray) -> LongArray:
    """Return a cell whose closed square contains each position.

    Parameters
    ----------
    free
        bool (rows, cols).
    positions
        float64 (n, 2), (row, col) in grid units.

    Returns
    -------
    LongArray
        int64 (n, 2), a free cell if one contains the position; else it may lie outside the map.
    """
    cells = np.floor(positions).astype(np.int64)
    found = cells.copy()
    missing = np.ones(len(cells), dtype=np.bool_)
    for beside in _BESIDE:
        tried = cells + np.where(positions == cells, beside, 0)
        inside = (tried >= 0).all(axis=1) & (tried < free.shape).all(axis=1)
        fits = missing & inside
        fits[fits] = free[tuple(tried[fits].T)]
        found[fits] = tried[fits]
        missing &= ~fits
    return found


def checked_position(space: FreeSpace, point: tuple[float, float]) -> FloatArray | None:
    """Return the position of a point in metres in grid units, None where it is not free."""
    cell = np.array(space.grid.frame.cell_of(*point))
    rows, cols = space.free.shape
    if not (0 <= cell[0] < rows and 0 <= cell[1] < cols and space.free[tuple(cell)]):
        return None
    at = np.array([space.grid.frame.position_of(*point)])
    found: FloatArray = rounded_into(cell[None], at)[0]
    return found
