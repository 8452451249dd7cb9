"""Optimal lengths on the octile grid by scipy, an oracle independent of the planners."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from hybridnav.errors import InvalidValueError
from hybridnav.metrics.judge import Cell, free_classes

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray
    from hybridnav.grid import OccupancyGrid

# In the order of the flat indices that they lead to, so that the matrix has sorted rows.
_STEPS = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))


class ScipyOptimum:
    """The graph of all legal moves of a grid, and Dijkstra's algorithm on it by scipy.

    Moves go to the 8 neighbours; a diagonal needs both side cells free. The graph takes up to 96
    bytes for each free cell.

    Parameters
    ----------
    grid
        The map.
    allow_unexplored
        Whether unexplored cells may be entered.

    Examples
    --------
    >>> from hybridnav.metrics import ScipyOptimum
    >>> optimum = ScipyOptimum(hn.OccupancyGrid(np.zeros((2, 3)), robot_radius_m=0))
    >>> optimum.lengths_from((0, 0)).round(3)
    array([[0.   , 1.   , 2.   ],
           [1.   , 1.414, 2.414]])
    """

    def __init__(self, grid: OccupancyGrid, *, allow_unexplored: bool = False) -> None:
        self._free = free_classes(allow_unexplored=allow_unexplored)[grid.classes]
        self._node_of = np.where(self._free, np.cumsum(self._free).reshape(grid.shape) - 1, -1)
        self._graph = _move_graph(self._free)
        self._resolution_m = grid.resolution_m

    def lengths_from(self, start: Cell) -> FloatArray:
        """Return the length of the shortest path from a cell to every cell.

        Parameters
        ----------
        start
            (row, col), inside the map.

        Returns
        -------
        FloatArray
            float64 (rows, cols), metres, a sum of steps (1e-12 off at most, relatively); infinite
            where there is no path, and everywhere when the start is not free.

        Raises
        ------
        InvalidValueError
            When the cell lies outside the map.

        Notes
        -----
        E. W. Dijkstra: A note on two problems in connexion with graphs, 1959.
        """
        row, col = start
        rows, cols = self._free.shape
        if not (0 <= row < rows and 0 <= col < cols):
            raise InvalidValueError(
                f"cell ({row}, {col}) lies outside the map of {rows} x {cols} cells"
            )
        lengths: FloatArray = np.full(self._free.shape, np.inf)
        node = int(self._node_of[tuple(start)])
        if node >= 0:
            reached = csgraph.dijkstra(self._graph, directed=True, indices=[node])[0]
            lengths[self._free] = reached * self._resolution_m
        return lengths


def _move_graph(free: BoolArray) -> sparse.csr_array[np.float64, tuple[int, int]]:
    """Return the legal moves between free cells, numbered in the order of the map; in cells."""
    padded = np.pad(free, 1)
    number = np.cumsum(padded, dtype=np.int32).reshape(padded.shape) - 1
    row, col = (index.astype(np.int32) + 1 for index in np.nonzero(free))
    legal = np.empty((len(row), len(_STEPS)), dtype=np.bool_)
    heads = np.empty(legal.shape, dtype=np.int32)
    for k, (up, right) in enumerate(_STEPS):
        legal[:, k] = padded[row + up, col + right]
        if up and right:
            legal[:, k] &= padded[row + up, col] & padded[row, col + right]
        heads[:, k] = number[row + up, col + right]
    offsets = np.zeros(len(row) + 1, dtype=np.int32)
    np.cumsum(legal.sum(axis=1), out=offsets[1:])
    lengths = np.array([math.hypot(*step) for step in _STEPS])
    weights = np.broadcast_to(lengths, legal.shape)[legal]
    return sparse.csr_array((weights, heads[legal], offsets), shape=(len(row), len(row)))
