"""Shortest any-angle paths on a convex mesh, exact, with a bound at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.mesh import _polyanya_kernels as polyanya
from hybridnav.mesh import _query_kernels as kernels
from hybridnav.search.pool import Pool

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, LongArray
    from hybridnav.mesh.build import ConvexMesh

Cell = tuple[int, int]
Position = tuple[float, float]

_ROOM = 4096
"""Nodes that a query has room for at first."""
_FRACTION = float(1 << 24)
"""Positions are rounded to this part of a cell: then every side test is exact."""
_SLICE = 256
"""Nodes that a query with a budget expands before it looks at the clock, some 0.2 ms."""
NO_LIMIT = 1 << 62
"""Of nodes that a query expands."""


@dataclass(frozen=True, eq=False)
class MeshPath:
    """The shortest path found between two positions; None for its positions where none was."""

    positions: FloatArray | None
    """float64 (n, 2), (row, col) in grid units: the start, the corners at which it turns, the
    goal."""
    length_cells: float
    """Its length, infinite for none."""
    lower_bound_cells: float
    """No path is shorter: its length where it is proved the shortest, infinite where it is proved
    that there is none."""
    expanded: int
    """Intervals that the search expanded."""


class _Work:
    """Work arrays of one query."""

    def __init__(self, mesh: ConvexMesh) -> None:
        self.ends = np.empty(mesh.n_polygons, np.int32), np.empty(mesh.n_polygons, np.int32)
        n_blocks = len(mesh.block_head)
        self.opened = np.zeros(n_blocks, np.bool_), np.empty(n_blocks, np.int32)
        n_corners = len(mesh.corners)
        self.corners = np.full(n_corners, np.inf), np.empty(n_corners, np.int32)
        self.counts = np.zeros(polyanya.N_COUNTS, dtype=np.int64)
        self.bounds = np.zeros(2)
        self.nodes = np.empty((_ROOM, 4), np.int32), np.empty((_ROOM, 5))
        self.heap = np.empty(_ROOM), np.empty(_ROOM, np.int32)

    def make_room(self) -> None:
        """Make room for twice as many nodes."""
        whole, real = self.nodes
        self.nodes = np.concatenate([whole, whole]), np.concatenate([real, real])
        keys, values = self.heap
        self.heap = np.concatenate([keys, keys]), np.concatenate([values, values])

    @property
    def arrays(self) -> tuple[object, ...]:
        """The arrays in the order of `query`."""
        nodes = *self.nodes, *self.heap, *self.corners, self.counts, self.bounds
        return *self.ends, *self.opened, nodes


@copies_alike
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
        rows, cols = np.ascontiguousarray(mesh.corners.T, dtype=np.float64)
        stops = np.roll(mesh.begins, -1)
        stops[mesh.first[1:] - 1] = mesh.begins[mesh.first[:-1]]
        sides = mesh.begins, stops, mesh.twins, mesh.polygon_of
        tree = mesh.block_head, mesh.block_up, mesh.component, mesh.depth
        arrays = cols, rows, mesh.kinds, mesh.first, *sides
        self.fixed = arrays, mesh.block_of, tree, mesh.polygon_at
        self.works = Pool(partial(_Work, mesh))

    def path(
        self,
        cells: tuple[Cell, Cell],
        positions: tuple[Position, Position],
        *,
        epsilon: float = 0.0,
        budget_s: float | None = None,
        known: FloatArray | None = None,
    ) -> MeshPath:
        """Find a shortest path between two positions.

        Parameters
        ----------
        cells
            The free cells (row, col) that hold start and goal.
        positions
            Start and goal, (row, col) in grid units, in the closed squares of these cells.
        epsilon
            The search may end as soon as its path is at most 1 + epsilon times as long as the lower
            bound.
        budget_s
            Seconds after which the search ends with the best path so far, None for no end.
        known
            float64 (n, 2), a path from start to goal that is in free space: the answer until the
            search finds a shorter one, and a bound that saves work.

        Returns
        -------
        MeshPath
            A shortest path, but for epsilon and budget.
        """
        until = math.inf if budget_s is None else perf_counter() + budget_s
        ends = tuple(_inside(*end) for end in zip(cells, positions, strict=True))
        upper = math.inf
        if known is not None:
            known = np.concatenate([ends[:1], known[1:-1], ends[1:]])
            upper = float(np.hypot(*np.diff(known, axis=0).T).sum())
        where = *cells[0], *cells[1]
        points = ends[0][1], ends[0][0], ends[1][1], ends[1][0]
        limit = NO_LIMIT if budget_s is None else _SLICE
        with self.works.lent() as work:
            while True:
                status, way = kernels.query(
                    *self.fixed, where, points, work.arrays, (upper, 1.0 + epsilon, limit)
                )
                if status == polyanya.DONE:
                    break
                if status == polyanya.NO_ROOM:
                    work.make_room()
                elif perf_counter() >= until:
                    limit = -1
                else:
                    limit += _SLICE
            length, bound = work.bounds.tolist()
            bound = min(bound, length)
            expanded = int(work.counts[polyanya.EXPANDED])
        positions_ = way if len(way) else known
        return MeshPath(positions_, length, bound, expanded)


def _inside(cell: Cell, position: Position) -> Position:
    """Round a position, and move it into the closed square of its cell."""
    row, col = (
        min(max(round(along * _FRACTION) / _FRACTION, low), low + 1.0)
        for along, low in zip(position, cell, strict=True)
    )
    return row, col


def rounded_into(cells: LongArray, positions: FloatArray) -> FloatArray:
    """Round positions, and move each into the closed square of its cell; float64 (n, 2)."""
    rounded = np.round(positions * _FRACTION) / _FRACTION
    inside: FloatArray = np.clip(rounded, cells, cells + 1.0)
    return inside
