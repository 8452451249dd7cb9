"""Distances to obstacles, and the cells within the robot's radius of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray

_ROUNDING = 1e-9
"""Relative slack on a squared radius, so that 0.25 m is 5 cells of 0.05 m and not 4.999..."""


def within_radius(occupied: BoolArray, *, radius_cells: float) -> BoolArray:
    """Return the cells whose centre lies within a radius of the centre of an occupied cell.

    Parameters
    ----------
    occupied
        Shape `(rows, cols)`.
    radius_cells
        Radius in cells, finite and >= 0; a distance equal to it counts as within.

    Returns
    -------
    BoolArray
        Same shape; by the exact Euclidean distance transform (compared as integers).
    """
    if not occupied.any():
        return np.zeros_like(occupied)
    if radius_cells < 1:
        return occupied.copy()
    if radius_cells >= math.hypot(*occupied.shape):
        return np.ones_like(occupied)
    from scipy import ndimage  # noqa: PLC0415 - half a second that a radius of 0 does not need

    nearest = ndimage.distance_transform_edt(~occupied, return_distances=False, return_indices=True)
    squared = np.zeros(occupied.shape, dtype=np.int64)
    for axis, size in enumerate(occupied.shape):
        offset = np.arange(size, dtype=np.int64)
        offset = offset[:, None] if axis == 0 else offset[None, :]
        squared += (nearest[axis] - offset) ** 2
    within: BoolArray = squared <= math.floor(radius_cells**2 * (1 + _ROUNDING))
    return within


def clearance_cells(occupied: BoolArray) -> FloatArray:
    """Return the distance from each cell to the nearest occupied one, in cells.

    Distances are between centres.

    Parameters
    ----------
    occupied
        Shape `(rows, cols)`.

    Returns
    -------
    FloatArray
        float64, same shape; 0 in occupied cells, infinite where none is occupied. Exact, by the
        Euclidean distance transform. Cells beyond the grid are not occupied.
    """
    if not occupied.any():
        return np.full(occupied.shape, np.inf)
    from scipy import ndimage  # noqa: PLC0415 - on demand, as above

    distances: FloatArray = ndimage.distance_transform_edt(~occupied)
    return distances
