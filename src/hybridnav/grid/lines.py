"""Cells that a polyline passes."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, LongArray

_SLIVER_CELLS = 1e-9
"""Pieces of a line below this are rounding: the line passes the corner of a cell."""


def cells_of_line(free: BoolArray, positions: FloatArray) -> LongArray:
    """The cells that a polyline passes which stays on free cells.

    Parameters
    ----------
    free
        bool (rows, cols).
    positions
        float64 (n, 2), n >= 1, (row, col) on the lattice of the cells' corners.

    Returns
    -------
    LongArray
        int64 (m, 2), (row, col), each a neighbour of the one before, diagonally where the line
        passes a corner. Where it runs between two cells, a free one.
    """
    pieces = [_middles(*ends) for ends in itertools.pairwise(positions)]
    at = np.concatenate([positions[:1], *pieces, positions[-1:]])
    cells = _free_cells_at(np.pad(free, 1), at)
    moved = np.ones(len(cells), dtype=np.bool_)
    moved[1:] = (cells[1:] != cells[:-1]).any(axis=1)
    passed: LongArray = cells[moved]
    return passed


def _middles(start: FloatArray, end: FloatArray) -> FloatArray:
    """The middle of each piece of a segment between two lines of the lattice."""
    way = end - start
    low, high = np.minimum(start, end), np.maximum(start, end)
    cuts = [np.array([0.0, 1.0])]
    for axis in np.flatnonzero(way):
        lines = np.arange(math.ceil(low[axis]), math.floor(high[axis]) + 1)
        cuts.append((lines - start[axis]) / way[axis])
    along = np.unique(np.clip(np.concatenate(cuts), 0.0, 1.0))
    whole = np.diff(along) * np.hypot(*way) > _SLIVER_CELLS
    at = ((along[:-1] + along[1:]) / 2)[whole]
    middles: FloatArray = start + at[:, None] * way
    return middles


def _free_cells_at(free: BoolArray, positions: FloatArray) -> LongArray:
    """A free cell at each position, of the map whose padded free cells are given."""
    above = np.floor(positions).astype(np.int64)
    below = np.ceil(positions).astype(np.int64) - 1
    cells = above.copy()
    # Where a position lies on lines of the lattice the cells beside it are tried in turn.
    for rows, cols in ((above, below), (below, above), (below, below)):
        walled = ~free[tuple((cells + 1).T)]
        cells[walled] = np.column_stack([rows[walled, 0], cols[walled, 1]])
    return cells
