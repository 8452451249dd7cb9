"""The cells that are closed for some queries, and paths that meet them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.result import PlanStatus

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, LongArray
    from hybridnav.grid import OccupancyGrid

Cell = tuple[int, int]


@dataclass(frozen=True, eq=False)
class ClosedCells:
    """What is closed on one map, found once for several queries."""

    flat: LongArray
    """int64 (n,), flat cells, sorted, each once."""

    def holds(self, flat: LongArray) -> BoolArray:
        """Return which of some flat cells are closed."""
        if not len(self.flat):
            return np.zeros(len(flat), dtype=np.bool_)
        at = np.minimum(np.searchsorted(self.flat, flat), len(self.flat) - 1)
        found: BoolArray = self.flat[at] == flat
        return found

    def meets(self, cells: LongArray, grid: OccupancyGrid) -> bool:
        """Whether a path stands on a closed cell, or passes one on a diagonal where that counts.

        Parameters
        ----------
        cells
            int64 (n, 2), legal moves.
        grid
            The map; where its corners may be cut diagonals need no side cells.
        """
        cols = grid.shape[1]
        flat = cells[:, 0] * cols + cells[:, 1]
        if not grid.corner_cutting:
            sides = cells[:-1, 0] * cols + cells[1:, 1], cells[1:, 0] * cols + cells[:-1, 1]
            flat = np.concatenate([flat, *sides])
        return bool(self.holds(flat).any())

    def refusal(self, cells: tuple[Cell, Cell], shape: tuple[int, int]) -> PlanStatus | None:
        """Return the status of a query whose start or goal is closed, None where neither is."""
        shut = self.holds(np.array(cells) @ [shape[1], 1])
        if not shut.any():
            return None
        return PlanStatus.START_BLOCKED if shut[0] else PlanStatus.GOAL_BLOCKED
