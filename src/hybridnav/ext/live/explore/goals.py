"""Goals of exploration: unexplored places that free cells in reach of the robot lie beside."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.moves import legal_moves, length_in_cells
from hybridnav.maps import CellClass
from hybridnav.search.grid_search import costs_from

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.topology import TopologicalMap


@dataclass(frozen=True, eq=False)
class Goals:
    """The unexplored places that a robot can drive up to, each with the free cell to drive to.

    A frontier after Yamauchi (1997) is the boundary between free and unexplored cells. In the
    topological map unexplored places are nodes, as in the source paper, and frontiers arcs between
    them and free places; all frontiers of one unexplored place are one goal.

    Examples
    --------
    >>> from hybridnav.ext.live.explore import Goals
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.5, 0.5, 1.0, 0.5]]), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    >>> goals = Goals.of(topology, (0, 0), np.zeros(grid.shape, dtype=bool))
    >>> goals.cells, goals.beyond, goals.costs_m
    (array([[0, 1]]), array([[0, 2]]), array([1.]))
    """

    cells: LongArray = field(repr=False)
    """int64 (n, 2), of the free cells beside each place the one that costs least to reach."""
    beyond: LongArray = field(repr=False)
    """int64 (n, 2), the unexplored cell beside it."""
    costs_m: FloatArray = field(repr=False)
    """float64 (n,), length of the shortest path of cells to each from the robot's cell."""
    places: LongArray = field(repr=False)
    """int64 (n,), the unexplored place of each."""
    sizes: LongArray = field(repr=False)
    """int64 (n,), cell sides of the frontiers of each place that the robot can reach."""

    @classmethod
    def of(cls, topology: TopologicalMap, cell: tuple[int, int], left_out: BoolArray) -> Goals:
        """Return the goals that can be reached from a cell, one for each unexplored place.

        Parameters
        ----------
        topology
            The places of what is known.
        cell
            (row, col) of the robot, a free cell.
        left_out
            bool (rows, cols), unexplored cells that are no goals.
        """
        grid = topology.grid
        edges, arc = topology.level.boundary_table
        pairs = np.stack([edges >> 1, (edges >> 1) + np.where(edges & 1, grid.shape[1], 1)], axis=1)
        classes, field_of = grid.classes.ravel(), topology.level.field_of.ravel()
        free = classes[pairs] == CellClass.FREE
        kept = free[:, 0] != free[:, 1]
        pairs, free, arc = pairs[kept], free[kept], arc[kept]
        pairs = np.where(free[:, :1], pairs, pairs[:, ::-1])
        pairs = pairs[~left_out.ravel()[pairs[:, 1]]]
        moves = legal_moves(classes.reshape(grid.shape) == CellClass.FREE, grid.corner_cutting)
        cost = costs_from(moves, cell, pairs[:, 0])
        pairs = pairs[cost[pairs[:, 0]] >= 0]
        place = field_of[pairs[:, 1]]
        order = np.lexsort((pairs[:, 1], pairs[:, 0], cost[pairs[:, 0]], place))
        places, first, sizes = np.unique(place[order], return_index=True, return_counts=True)
        best = pairs[order][first]
        cols = grid.shape[1]
        return cls(
            np.stack(np.divmod(best[:, 0], cols), axis=1),
            np.stack(np.divmod(best[:, 1], cols), axis=1),
            length_in_cells(cost[best[:, 0]]) * grid.resolution_m,
            places.astype(np.int64),
            sizes,
        )

    def __len__(self) -> int:
        return len(self.costs_m)
