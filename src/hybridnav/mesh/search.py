"""Shortest any-angle paths on a convex mesh, exact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.mesh import _query_kernels as kernels
from hybridnav.mesh._polyanya_kernels import NO_ROOM
from hybridnav.search.pool import Pool

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, IntArray
    from hybridnav.mesh.build import ConvexMesh

Cell = tuple[int, int]
Position = tuple[float, float]

_ROOM = 4096
"""Nodes that a query has room for at first."""
_FRACTION = float(1 << 24)
"""Positions are rounded to this part of a cell: then every side test is exact."""


@dataclass(frozen=True, eq=False)
class MeshPath:
    """A shortest path between two positions; None for its positions where there is none."""

    positions: FloatArray | None
    """float64 (n, 2), (row, col) in grid units: the start, the corners at which it turns, the
    goal."""
    length_cells: float
    """Its length, infinite for none."""
    expanded: int
    """Intervals that the search expanded."""


class _Work:
    """Work arrays of one query."""

    def __init__(self, mesh: ConvexMesh) -> None:
        self.starts = np.empty(mesh.n_polygons, dtype=np.int32)
        self.goals = np.empty(mesh.n_polygons, dtype=np.int32)
        self.is_open = np.zeros(len(mesh.block_head), dtype=np.bool_)
        self.marked = np.empty(len(mesh.block_head), dtype=np.int32)
        self.best = np.full(len(mesh.corners), np.inf)
        self.touched = np.empty(len(mesh.corners), dtype=np.int32)
        self.make_room(_ROOM)

    def make_room(self, size: int) -> None:
        """Make room for so many nodes."""
        self.whole = np.empty((size, 4), dtype=np.int32)
        self.real = np.empty((size, 5), dtype=np.float64)
        self.heap = np.empty(size, dtype=np.float64), np.empty(size, dtype=np.int32)

    @property
    def arrays(self) -> tuple[object, ...]:
        """The arrays in the order of `query`."""
        nodes = self.whole, self.real, *self.heap
        return self.starts, self.goals, self.is_open, self.marked, nodes, self.best, self.touched


class MeshSearch:
    """Exact shortest any-angle paths on a mesh; threads may share it.

    Parameters
    ----------
    mesh
        Of the map's free space.

    Notes
    -----
    M. L. Cui, D. D. Harabor, A. Grastien: Compromise-free pathfinding on a navigation mesh, 2017
    (Polyanya).
    """

    def __init__(self, mesh: ConvexMesh) -> None:
        self.mesh = mesh
        rows, cols = mesh.corners.T.astype(np.float64)
        arrays = mesh.kinds, mesh.first, mesh.begins, mesh.twins, mesh.polygon_of
        self._mesh = np.ascontiguousarray(cols), np.ascontiguousarray(rows), *arrays
        self._tree = mesh.block_head, mesh.block_up, mesh.component, mesh.depth
        self._works = Pool(partial(_Work, mesh))

    def path(self, cells: tuple[Cell, Cell], positions: tuple[Position, Position]) -> MeshPath:
        """Find a shortest path between two positions.

        Parameters
        ----------
        cells
            The free cells (row, col) that hold start and goal.
        positions
            Start and goal, (row, col) in grid units, in the closed squares of these cells.
        """
        start, goal = (_inside(*end) for end in zip(cells, positions, strict=True))
        ends = start[1], start[0], goal[1], goal[0]
        with self._works.lent() as work:
            length, node, expanded = self._query(cells, ends, work)
            corners = kernels.corners_passed(work.whole, node)
        if math.isinf(length):
            return MeshPath(None, math.inf, expanded)
        way = np.concatenate([[start], _bends(self.mesh.corners[corners]), [goal]])
        return MeshPath(way, float(np.hypot(*np.diff(way, axis=0).T).sum()), expanded)

    def _query(
        self, cells: tuple[Cell, Cell], ends: tuple[float, ...], work: _Work
    ) -> tuple[float, int, int]:
        """Return length, last node and expansions; room is doubled until it is enough."""
        where = *cells[0], *cells[1]
        while True:
            found: tuple[float, int, int] = kernels.query(
                self._mesh, self.mesh.block_of, self._tree, self.mesh.polygon_at, where, ends,
                work.arrays,
            )  # fmt: skip
            if found[0] != NO_ROOM:
                return found
            work.make_room(2 * len(work.real))


def _bends(corners: IntArray) -> IntArray:
    """Return the corners but for those on a straight line between their neighbours."""
    before, behind = corners[1:-1] - corners[:-2], corners[2:] - corners[1:-1]
    kept = np.ones(len(corners), dtype=np.bool_)
    kept[1:-1] = before[:, 0] * behind[:, 1] != before[:, 1] * behind[:, 0]
    return corners[kept]


def _inside(cell: Cell, position: Position) -> Position:
    """Round a position, and move it into the closed square of its cell."""
    row, col = (
        min(max(round(along * _FRACTION) / _FRACTION, low), low + 1.0)
        for along, low in zip(position, cell, strict=True)
    )
    return row, col
