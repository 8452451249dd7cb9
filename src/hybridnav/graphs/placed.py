"""A waypoint graph on a map: where its nodes lie, and which edges a robot can follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.graphs.attach import Network

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.graphs.waypoint_graph import WaypointGraph
    from hybridnav.grid import OccupancyGrid
    from hybridnav.refine import Sight

_FRACTION = 2.0**24
"""Parts of a cell to which positions are rounded, as exact tests of segments need it."""


@dataclass(frozen=True, eq=False)
class PlacedGraph:
    """The nodes of a graph in grid units, and the cells that they lie in."""

    edges: LongArray
    """int64 (m, 2), tail and head of each edge."""
    positions: FloatArray
    """float64 (n, 2), (row, col), rounded."""
    cells: LongArray
    """int64 (n, 2), the cell that the node lies in, -1 for nodes outside the map."""
    is_inside: BoolArray
    """bool (n,), nodes on the map."""
    is_free: BoolArray
    """bool (n,), nodes in cells that may be entered."""
    lines: dict[int, FloatArray]
    """float64 (k, 2), positions of the edges that are not straight."""
    free: BoolArray
    """bool (rows, cols), the cells that may be entered."""

    @classmethod
    def of(
        cls,
        graph: WaypointGraph,
        grid: OccupancyGrid,
        free: BoolArray,
        *,
        along_lines: bool = False,
    ) -> PlacedGraph:
        """Place a graph on a map.

        Parameters
        ----------
        graph
            The graph.
        grid
            The map.
        free
            bool (rows, cols), the cells that may be entered.
        along_lines
            Whether edges run along their lines, instead of straight.
        """
        positions, cells, is_free = placed_points(graph.points, grid, free)
        lines = graph.lines if along_lines else {}
        along = {edge: _rounded(grid, line) for edge, line in lines.items()}
        return cls(graph.edges, positions, cells, cells[:, 0] >= 0, is_free, along, free)

    def clear_edges(self, sight: Sight) -> BoolArray:
        """Return which edges stay in free space, bool (m,), by exact tests.

        Parameters
        ----------
        sight
            Tests of segments of the same free cells.
        """
        clear = np.asarray(self.is_free[self.edges].all(axis=1), dtype=np.bool_)
        tails, heads = (self.positions[self.edges[clear, end]] for end in (0, 1))
        clear[clear] = sight.clear(tails, heads)
        for edge, line in self.lines.items():
            clear[edge] = self.is_free[self.edges[edge]].all() and self._is_clear(line, sight)
        return clear

    def line_of(self, edge: int) -> FloatArray:
        """Return the positions that an edge passes, float64 (k, 2)."""
        if edge in self.lines:
            return self.lines[edge]
        straight: FloatArray = self.positions[self.edges[edge]]
        return straight

    def _is_clear(self, line: FloatArray, sight: Sight) -> bool:
        """Return whether a polyline stays in free space."""
        if not ((line >= 0) & (line < self.free.shape)).all():
            return False
        is_free = self.free[tuple(line.astype(np.int64).T)].all()
        return bool(is_free and sight.clear(line[:-1], line[1:]).all())

    def network(self, sight: Sight, edges: LongArray) -> Network:
        """Return the graph with some of its edges, ready for routes.

        Parameters
        ----------
        sight
            Tests of segments of the same free cells.
        edges
            int64 (k, 2), the edges to use.
        """
        return Network.of(sight, self.positions, edges, np.flatnonzero(self.is_free))


def placed_points(
    points: FloatArray, grid: OccupancyGrid, free: BoolArray
) -> tuple[FloatArray, LongArray, BoolArray]:
    """Place points on a map.

    Parameters
    ----------
    points
        float64 (n, 2), `(x, y)` in metres.
    grid
        The map.
    free
        bool (rows, cols), the cells that may be entered.

    Returns
    -------
    tuple
        float64 (n, 2) positions, rounded; int64 (n, 2) the cell that each lies in, by the rule of
        `Frame.cells_of`, -1 outside the map; bool (n,), whether it is free.
    """
    cells = grid.frame.cells_of(points)
    is_inside = ((cells >= 0) & (cells < free.shape)).all(axis=1)
    cells[~is_inside] = -1
    is_free = np.asarray(is_inside, dtype=np.bool_)
    is_free[is_inside] = free[tuple(cells[is_inside].T)]
    return _rounded(grid, points), cells, is_free


def _rounded(grid: OccupancyGrid, points: FloatArray) -> FloatArray:
    """Return points as positions in grid units that exact tests of segments can use."""
    rounded: FloatArray = np.round(grid.frame.positions_of(points) * _FRACTION) / _FRACTION
    return rounded
