"""Places from which a robot should look again: doubtful cells may close a door that is open."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from hybridnav.grid import CellClass

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.grid import OccupancyGrid

DOUBTFUL_BELOW = 0.9
"""Probability below which an occupied cell is doubtful."""


def doubtful_spots(grid: OccupancyGrid, cell: tuple[int, int]) -> LongArray:
    """Return the cells in reach beside what would be in reach without doubtful cells.

    The doubtful occupied cells are taken away. Each connected set of cells that a robot could then
    reach in addition, and from which it could see unexplored cells beside, has one spot: its first
    neighbour, in the order of rows, among the cells that the robot can reach.

    Parameters
    ----------
    grid
        What the robot knows.
    cell
        (row, col) of the robot, a free cell.

    Returns
    -------
    LongArray
        int64 (n, 2), (row, col).
    """
    doubtful = (grid.measured == CellClass.OCCUPIED) & (grid.probability < DOUBTFUL_BELOW)
    without = replace(grid, probability=np.where(doubtful, np.float32(0.0), grid.probability))
    reach, more = (
        labels == labels[cell]
        for labels, _ in (ndimage.label(g.classes == CellClass.FREE) for g in (grid, without))
    )
    beyond = ndimage.binary_dilation(without.classes == CellClass.UNEXPLORED)
    parts, n_parts = ndimage.label(more & ~reach)
    leads_on = np.zeros(n_parts + 1, dtype=np.bool_)
    leads_on[parts[beyond]] = True
    leads_on[0] = False
    rows, cols = np.nonzero(ndimage.binary_dilation(leads_on[parts]) & reach)
    part = ndimage.maximum_filter(np.where(leads_on[parts], parts, 0), footprint=_CROSS)[rows, cols]
    _, first = np.unique(part, return_index=True)
    return np.stack([rows[first], cols[first]], axis=1)


_CROSS = ndimage.generate_binary_structure(2, 1)
"""A cell and its four neighbours."""
