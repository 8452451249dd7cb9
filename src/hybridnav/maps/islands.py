"""Islands: small sets of free or unexplored cells, as raw scans contain many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
from hybridnav.maps.cells import CellClass

_ROUNDING = 1e-9
"""Relative slack on an area, so that 1 m² is 400 cells of 0.05 m and not 400.00001."""


@dataclass(frozen=True)
class DroppedIslands:
    """Counts of the islands that a grid leaves out, and of their cells.

    Parameters
    ----------
    free, free_cells
        Free islands, and their cells: unexplored now, or closed.
    unexplored, unexplored_cells
        Unexplored islands, and their cells: closed now.
    closed_cells
        Cells of both kinds that are closed now: like an obstacle they belong to no place, but they
        are not inflated.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.0, 1.0, 0.0]]), robot_radius_m=0)
    >>> hn.drop_islands(grid, 2.0).dropped
    DroppedIslands(free=1, free_cells=1, unexplored=0, unexplored_cells=0, closed_cells=1)
    """

    free: int = 0
    free_cells: int = 0
    unexplored: int = 0
    unexplored_cells: int = 0
    closed_cells: int = 0


def without_islands(
    classes: ByteArray, *, least_area_m2: float, cell_area_m2: float
) -> tuple[ByteArray, DroppedIslands]:
    """Drop the islands of an array of classes; see `drop_islands`.

    `classes`: uint8 `CellClass`, shape `(rows, cols)`; `least_area_m2`, `cell_area_m2`: least area
    of an island, >= 0, and area of a cell, in square metres. Returns a new array of the same shape.
    Counts of the dropped islands.
    """
    least_cells = least_area_m2 / cell_area_m2 * (1 - _ROUNDING)
    free_of, areas = _islands(classes == CellClass.FREE)
    small = areas < least_cells
    small[0] = False
    specks = small[free_of]
    kept = np.where(specks, np.uint8(CellClass.UNEXPLORED), classes)
    free_of[specks] = 0

    island_of, areas = _islands(kept == CellClass.UNEXPLORED)
    closed = (areas < least_cells) & (_free_neighbours(island_of, free_of) <= 1)
    closed[0] = False
    shut = closed[island_of]
    kept[shut] = CellClass.OCCUPIED
    unexplored = shut & (classes == CellClass.UNEXPLORED)
    return kept, DroppedIslands(
        free=int(np.count_nonzero(small)),
        free_cells=int(np.count_nonzero(specks)),
        unexplored=len(np.unique(island_of[unexplored])),
        unexplored_cells=int(np.count_nonzero(unexplored)),
        closed_cells=int(np.count_nonzero(shut)),
    )


def _islands(cells: BoolArray) -> tuple[IntArray, LongArray]:
    """Label 4-connected sets of some cells from 1, 0 elsewhere, and count the cells of each."""
    from scipy import ndimage  # noqa: PLC0415 - half a second that most grids do not need

    label_of, count = ndimage.label(cells)
    areas = np.bincount(label_of.ravel(), minlength=count + 1)
    return label_of.astype(np.int32, copy=False), areas.astype(np.int64, copy=False)


def _free_neighbours(island_of: IntArray, free_of: IntArray) -> LongArray:
    """Return the number of free sets that are 4-adjacent to each island, int64 (n_islands + 1,)."""
    pairs = []
    for axis in (0, 1):
        island, free = np.moveaxis(island_of, axis, 0), np.moveaxis(free_of, axis, 0)
        for one, other in ((island[:-1], free[1:]), (island[1:], free[:-1])):
            beside = (one > 0) & (other > 0)
            pairs.append(np.stack([one[beside], other[beside]], axis=1))
    islands = unique_rows(np.concatenate(pairs)).rows[:, 0]
    counts = np.bincount(islands, minlength=int(island_of.max(initial=0)) + 1)
    return counts.astype(np.int64, copy=False)
