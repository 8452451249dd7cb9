"""Tables of distances over all cells, by one search from each start: lengths, or costs of cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.kernels.moves import legal_moves
from hybridnav._base.moves import FAR, STRAIGHT, length_in_cells
from hybridnav.maps.costs import UNIT_BITS
from hybridnav.search.kernels.waypoints import spread

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.search.distance_table import Ends, Labels


class GridLabels:
    """Least costs of cells from each start to all goals, by Dijkstra's algorithm; no labels.

    Parameters
    ----------
    enterable
        bool (rows, cols), cells that may be entered.
    corner_cutting
        As for `GridSearch`.
    units
        int32 (rows, cols), the factor of each cell in units; None for lengths.
    """

    n_corners, most = 1, 4

    def __init__(
        self, enterable: BoolArray, *, corner_cutting: bool, units: IntArray | None
    ) -> None:
        self._cols = enterable.shape[1]
        self._moves = legal_moves(np.ascontiguousarray(enterable), corner_cutting).ravel()
        self._units = None if units is None else np.ascontiguousarray(units).ravel()

    def placed(self, ends: Ends) -> LongArray:
        """Return flat cells."""
        flat: LongArray = ends[0] @ np.array([self._cols, 1])
        return flat

    def labels(self, ends: LongArray) -> Labels:
        """Return labels without entries."""
        return np.zeros(len(ends) + 1, np.int64), np.empty(0, np.int32), np.empty(0, np.int64)

    goal_labels = labels

    def direct(self, starts: LongArray, goals: LongArray, table: LongArray) -> None:
        """Set all entries."""
        is_target = np.zeros(self._moves.size, np.bool_)
        is_target[goals] = True
        nothing = np.zeros(1, np.int64)
        for row, start in zip(table, starts, strict=True):
            asked = np.array([start]), nothing, is_target, True
            cost = spread(self._moves, self._units, self._cols, *asked)[0][goals]
            row[:] = np.where(cost < 0, FAR, cost)

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs as lengths in cells, of costs within 1e-10 of them, infinite for `FAR`."""
        found = np.full(table.shape, np.inf)
        reached = table < FAR
        if self._units is None:
            found[reached] = length_in_cells(table[reached])
        else:
            found[reached] = table[reached] / ((2 << UNIT_BITS) * STRAIGHT)
        return found
