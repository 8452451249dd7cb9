"""Tables of costs of cells, by one search from each start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.kernels.moves import legal_moves
from hybridnav._base.moves import FAR, STRAIGHT
from hybridnav.maps.costs import UNIT_BITS
from hybridnav.search.kernels.labels import costs_to_cells

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.search.distance_table import Ends, Labels


class GridLabels:
    """Least costs of cells from each start to all goals, by Dijkstra's algorithm; no labels.

    Parameters
    ----------
    enterable
        bool (rows, cols), cells that may be entered.
    units
        int32 (rows, cols), the factor of each cell in units; None for 1.
    corner_cutting
        As for `GridSearch`.
    """

    n_corners, most = 1, 16

    def __init__(
        self, enterable: BoolArray, units: IntArray | None, *, corner_cutting: bool
    ) -> None:
        moves = legal_moves(np.ascontiguousarray(enterable), corner_cutting).ravel()
        one = np.broadcast_to(np.int32(1 << UNIT_BITS), enterable.shape)
        factors = np.ascontiguousarray(one if units is None else units).ravel()
        self._grid = moves, factors, enterable.shape[1]

    def placed(self, ends: Ends) -> LongArray:
        """Return flat cells."""
        flat: LongArray = ends[0] @ np.array([self._grid[2], 1])
        return flat

    def labels(self, ends: LongArray) -> Labels:
        """Return labels without entries."""
        return np.zeros(len(ends) + 1, np.int64), np.empty(0, np.int32), np.empty(0, np.int64)

    goal_labels = labels

    def direct(self, starts: LongArray, goals: LongArray, table: LongArray) -> None:
        """Set all entries."""
        is_goal, best = (
            np.zeros(self._grid[0].size, np.bool_),
            np.empty(self._grid[0].size, np.int64),
        )
        is_goal[goals] = True
        count = int(np.count_nonzero(is_goal))
        for row, start in zip(table, starts.tolist(), strict=True):
            costs_to_cells(self._grid, start, is_goal, count, best)
            row[:] = best[goals]

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs in cells, within 1e-10 of them, infinite for `FAR`."""
        return np.where(table < FAR, table / ((2 << UNIT_BITS) * STRAIGHT), np.inf)
