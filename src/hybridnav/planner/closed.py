"""The cells that are closed for some queries, and tests of paths against them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav.planner import PlanStatus

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.planner.blocked import Closable
    from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]

_KEPT = 16
"""Number of closures whose cells are kept: a door of a large room takes some 10 ms."""


@dataclass(frozen=True, eq=False)
class ClosedCells:
    """The closed cells of one map, computed once for several queries."""

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
        """Return whether a path stands on a closed cell, or illegally passes one on a diagonal.

        Parameters
        ----------
        cells
            int64 (n, 2), legal moves.
        grid
            The map; if its corners may be cut, diagonals need no side cells.
        """
        cols = grid.shape[1]
        flat = cells[:, 0] * cols + cells[:, 1]
        if not grid.corner_cutting:
            side_cells = cells[:-1, 0] * cols + cells[1:, 1], cells[1:, 0] * cols + cells[:-1, 1]
            flat = np.concatenate([flat, *side_cells])
        return bool(self.holds(flat).any())

    def refusal(self, cells: tuple[Cell, Cell], shape: tuple[int, int]) -> PlanStatus | None:
        """Return the status of a query whose start or goal is closed, None if neither is."""
        shut = self.holds(np.array(cells) @ [shape[1], 1])
        if not shut.any():
            return None
        return PlanStatus.START_BLOCKED if shut[0] else PlanStatus.GOAL_BLOCKED


@copies_alike
class Closures:
    """A cache of the cells that were closed for the last queries.

    Parameters
    ----------
    topology
        The map of the closures.
    """

    def __init__(self, topology: TopologicalMap) -> None:
        self._topology = topology
        self._known: dict[object, ClosedCells] = {}

    def of(self, blocked: Closable) -> ClosedCells:
        """Return the cells that a closure closes."""
        # Loads shapely, which most queries do not need.
        from hybridnav.planner.blocked import as_blocked  # noqa: PLC0415

        closed = as_blocked(blocked)
        key = closed.key
        # Without a lock: two threads may compute the same cells.
        found = self._known.pop(key, None)
        if found is None:
            found = ClosedCells(closed.cells_of(self._topology))
        self._known[key] = found  # the last one now
        for old in list(self._known)[:-_KEPT]:
            self._known.pop(old, None)
        return found
