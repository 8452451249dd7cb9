"""Optimal paths on the octile grid: A* with integer costs and buckets.

P. E. Hart, N. J. Nilsson, B. Raphael: A formal basis for the heuristic determination of minimum
cost paths, 1968.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.search import _kernels

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, IntArray, LongArray

Cell = tuple[int, int]


@dataclass(frozen=True, eq=False)
class CellPath:
    """Outcome of a grid search: the cells of an optimal path, None where there is none."""

    cells: LongArray | None
    expanded: int


class GridSearch:
    """A* on the cells of one grid; holds 10 bytes a cell that all its searches share.

    Moves go to the 8 neighbours; a diagonal needs both side cells enterable (no corner cutting).
    They are judged once, on the whole grid; a corridor limits only the cells stood on.

    Parameters
    ----------
    enterable
        bool (rows, cols), cells that paths may use; start and goal must be among them.
    corner_cutting
        Whether a diagonal needs no side cell enterable.
    """

    def __init__(self, enterable: BoolArray, *, corner_cutting: bool = False) -> None:
        self._cols = enterable.shape[1]
        moves = _kernels.legal_moves(np.ascontiguousarray(enterable), corner_cutting)
        self._moves = moves.ravel()
        self._best = np.full(enterable.size, np.iinfo(np.int64).max)
        self._came = np.zeros(enterable.size, dtype=np.uint8)
        self._generation = 0

    def search(
        self,
        start: Cell,
        goal: Cell,
        *,
        field_of: IntArray | None = None,
        in_corridor: BoolArray | None = None,
    ) -> CellPath:
        """Find a shortest path between the centres of two cells.

        Parameters
        ----------
        start, goal
            Enterable cells as (row, col); with a corridor, inside it.
        field_of
            int32 (rows, cols), a label for each enterable cell; None for the whole grid.
        in_corridor
            bool, whether the cells of each label may be stood on; goes with `field_of`.
        """
        if self._generation == _kernels.GENERATIONS:
            self._best.fill(np.iinfo(np.int64).max)
            self._generation = 0
        first = start[0] * self._cols + start[1]
        last = goal[0] * self._cols + goal[1]
        cost, expanded = _kernels.astar(
            self._moves,
            self._cols,
            first,
            last,
            None if field_of is None else field_of.ravel(),
            in_corridor,
            self._best,
            self._came,
            self._generation,
        )
        self._generation += 1
        if cost < 0:
            return CellPath(None, int(expanded))
        flat = _kernels.trace(self._came, self._cols, first, last)
        return CellPath(np.stack(divmod(flat, self._cols), axis=1), int(expanded))
