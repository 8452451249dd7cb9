"""Distances to obstacles, and the cells within the robot's radius of them."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._base.trig import hypot
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.maps.kernels import nearest_distances

_BAND = 256
"""Rows that are looked at together."""
_ROUNDING = 1e-9
"""Relative slack on a squared radius, so that 0.25 m is 5 cells of 0.05 m and not 4.999..."""


def within_radius(occupied: BoolArray, *, radius_cells: float) -> BoolArray:
    """Return the cells whose centre lies within a radius of the centre of an occupied cell.

    `occupied`: shape `(rows, cols)`; `radius_cells`: radius in cells, finite and >= 0; a distance
    equal to it counts as within. Result: same shape; by exact Euclidean distances (compared as
    integers).
    """
    if not occupied.any():
        return np.zeros_like(occupied)
    if radius_cells < 1:
        return occupied.copy()
    if radius_cells >= hypot(*occupied.shape):
        return np.ones_like(occupied)
    squared = math.floor(radius_cells * radius_cells * (1 + _ROUNDING))
    # In bands of rows, whose distances of eight bytes a cell stay in the processor's cache.
    reach, within = math.isqrt(squared), np.empty_like(occupied)
    band = max(_BAND, 4 * reach)
    for first in range(0, len(occupied), band):
        low, last = max(first - reach, 0), first + band
        near = clearance_cells(occupied[low : last + reach]) <= math.sqrt(squared)
        within[first:last] = near[first - low : last - low]
    return within


def clearance_cells(occupied: BoolArray) -> FloatArray:
    """Return the distance from each cell to the nearest occupied one, in cells.

    Distances are between centres.

    `occupied`: shape `(rows, cols)`. Returns float64, same shape; 0 in occupied cells, infinite
    where none is occupied. Exact, to the last bit those of scipy's Euclidean distance transform, in
    a quarter of its time. Cells beyond the grid are not occupied.
    """
    return nearest_distances(occupied.astype(np.bool_, order="C"))


def closing(cells: BoolArray, radius_cells: float) -> BoolArray:
    """Return the morphological closing of cells by a disc, bool of the same shape.

    Distances take as long for a large disc as for a small one.

    `cells`: bool (rows, cols); `radius_cells`: radius of the disc, >= 1; a cell belongs to it if
    its centre does.
    """
    if not cells.any():
        return cells.copy()
    margin = int(radius_cells) + 2
    near = clearance_cells(np.pad(cells, margin)) <= radius_cells
    closed: BoolArray = clearance_cells(~near) > radius_cells
    return closed[margin:-margin, margin:-margin]
