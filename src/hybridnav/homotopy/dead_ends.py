"""Dead ends: parts of a map that only winding paths enter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage, sparse

from hybridnav.grid.runs import in_runs
from hybridnav.homotopy import _dead_end_kernels

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, IntArray, LongArray

Cell = tuple[int, int]


class DeadEnds:
    """The parts of a map behind narrow passages.

    A *passage* is a run of cells along a row or a column from one blocked cell to the next. A path
    enters and leaves the part behind it through the passage alone, at two cells that see each other
    along it. If the loop between the two can be drawn together, the path along the passage is
    shorter and of the same class. Otherwise the path winds if the passage is at most as wide as
    `reach`. So no shortest path of a class that does not wind goes there.

    Parameters
    ----------
    enterable
        bool (rows, cols), the cells that may be entered; moves between them cut no corners.
    reach
        Cells between two cells of a passage at most.
    """

    def __init__(self, enterable: BoolArray, reach: int) -> None:
        self.reach = reach
        self._enterable = enterable
        rows, cols = enterable.shape
        self._node_of = np.full(rows * cols, -1, dtype=np.int32)
        n_passages = 0
        for along_rows in (True, False):
            cells, run_of = _short_runs(enterable if along_rows else enterable.T, reach + 1)
            if not along_rows:
                cells = cells % rows * cols + cells // rows
            # Crossing passages are not two nodes: only the one along a row counts.
            crossed = np.bincount(run_of, self._node_of[cells] >= 0)[run_of] > 0
            numbers, run_of = np.unique(run_of[~crossed], return_inverse=True)
            self._node_of[cells[~crossed]] = n_passages + run_of
            n_passages += len(numbers)
        rest = enterable & (self._node_of < 0).reshape(enterable.shape)
        parts, n_parts = ndimage.label(rest)
        self._node_of[rest.ravel()] = n_passages - 1 + parts[rest]
        self._is_passage = np.arange(n_passages + n_parts) < n_passages
        self._graph = _neighbours(self._node_of.reshape(enterable.shape), n_passages + n_parts)

    def left(self, start: Cell, goal: Cell) -> BoolArray:
        """Return the cells that remain for paths from start to goal.

        Parameters
        ----------
        start, goal
            Cells (row, col) that may be entered.

        Returns
        -------
        BoolArray
            bool (rows, cols).
        """
        first, last = (
            int(self._node_of[row * self._enterable.shape[1] + col]) for row, col in (start, goal)
        )
        behind = _dead_end_kernels.behind_passages(
            self._graph.indptr, self._graph.indices, self._is_passage, first, last
        )
        # The last entry is for the cells of no node, whose number is -1.
        dead = np.append(behind, True)[self._node_of]
        remaining: BoolArray = ~dead.reshape(self._enterable.shape)
        return remaining


def _short_runs(enterable: BoolArray, longest: int) -> tuple[LongArray, LongArray]:
    """Return the flat cells of the short runs along rows, and the number of each cell's run."""
    cols = enterable.shape[1]
    steps = np.diff(np.pad(enterable, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, begins = np.nonzero(steps == 1)
    lengths = np.nonzero(steps == -1)[1] - begins
    short = lengths <= longest
    row, begins, lengths = row[short], begins[short], lengths[short]
    return in_runs(row * cols + begins, lengths), np.repeat(np.arange(len(lengths)), lengths)


def _neighbours(node_of: IntArray, n_nodes: int) -> sparse.csr_array:
    """Return the nodes that hold cells with a common side, each pair in both directions."""
    pairs = [np.empty((0, 2), dtype=np.int64)]
    for one, other in ((node_of[:, :-1], node_of[:, 1:]), (node_of[:-1], node_of[1:])):
        between = (one >= 0) & (other >= 0) & (one != other)
        pairs.append(np.stack([one[between], other[between]], axis=1))
    tail, head = np.concatenate(pairs).T
    ones = np.ones(2 * len(tail), dtype=np.int8)
    joined = (np.concatenate([tail, head]), np.concatenate([head, tail]))
    return sparse.coo_array((ones, joined), shape=(n_nodes, n_nodes)).tocsr()
