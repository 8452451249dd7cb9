"""Distances to obstacles, and the cells within the robot's radius of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray

_FEW_ROWS = 64
"""Radius in cells up to which rows are shifted one by one: for more of them scipy is quicker."""
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
        Same shape; by exact Euclidean distances (compared as integers).
    """
    if not occupied.any():
        return np.zeros_like(occupied)
    if radius_cells < 1:
        return occupied.copy()
    if radius_cells >= math.hypot(*occupied.shape):
        return np.ones_like(occupied)
    squared = math.floor(radius_cells * radius_cells * (1 + _ROUNDING))
    if squared <= _FEW_ROWS**2:
        return _within_rows(occupied, squared)
    return _within_distance(occupied, squared)


def greatest_within(values: FloatArray, *, radius_cells: float) -> FloatArray:
    """Return the greatest value within a radius of each cell, of the same shape.

    Parameters
    ----------
    values
        Shape `(rows, cols)`, no NaN.
    radius_cells
        Radius in cells, finite and >= 0; distances are compared as in `within_radius`.
    """
    if radius_cells < 1:
        return values.copy()
    from scipy import ndimage  # noqa: PLC0415 - on demand, as above

    reach = min(radius_cells, math.hypot(*values.shape))
    squared = math.floor(reach * reach * (1 + _ROUNDING))
    greatest = values.copy()
    for down in range(min(math.isqrt(squared) + 1, len(values))):
        width = 2 * min(math.isqrt(squared - down**2), values.shape[1]) + 1
        in_row = ndimage.maximum_filter1d(values, width, axis=1, mode="constant", cval=-math.inf)
        for here, there in (
            (greatest[down:], in_row[: len(values) - down]),
            (greatest[: len(values) - down], in_row[down:]),
        ):
            np.maximum(here, there, out=here)
    return greatest


def _within_rows(occupied: BoolArray, most: int) -> BoolArray:
    """Return the cells that have an occupied cell of some row within a squared distance."""
    cols = np.arange(occupied.shape[1], dtype=np.int32)
    far = np.int32(occupied.shape[1] + _FEW_ROWS)
    before = np.maximum.accumulate(np.where(occupied, cols, -far), axis=1)
    after = np.minimum.accumulate(np.where(occupied, cols, 2 * far)[:, ::-1], axis=1)[:, ::-1]
    in_row = np.minimum(cols - before, after - cols)
    within = np.zeros_like(occupied)
    for down in range(min(math.isqrt(most) + 1, len(occupied))):
        near = in_row <= math.isqrt(most - down**2)
        within[down:] |= near[: len(near) - down]
        within[: len(near) - down] |= near[down:]
    return within


def _within_distance(occupied: BoolArray, most: int) -> BoolArray:
    """Return the same by the distance transform."""
    from scipy import ndimage  # noqa: PLC0415 - half a second that smaller radii do not need

    nearest = ndimage.distance_transform_edt(~occupied, return_distances=False, return_indices=True)
    squared = np.zeros(occupied.shape, dtype=np.int64)
    for axis, size in enumerate(occupied.shape):
        offset = np.arange(size, dtype=np.int64)
        offset = offset[:, None] if axis == 0 else offset[None, :]
        squared += (nearest[axis] - offset) ** 2
    within: BoolArray = squared <= most
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


def closing(cells: BoolArray, radius_cells: float) -> BoolArray:
    """Return the morphological closing of cells by a disc, bool of the same shape.

    Distances take as long for a large disc as for a small one.

    Parameters
    ----------
    cells
        bool (rows, cols).
    radius_cells
        Radius of the disc, >= 1; a cell belongs to it if its centre does.
    """
    if not cells.any():
        return cells.copy()
    from scipy import ndimage  # noqa: PLC0415 - on demand, as above

    margin = int(radius_cells) + 2
    near = ndimage.distance_transform_edt(~np.pad(cells, margin)) <= radius_cells
    closed: BoolArray = ndimage.distance_transform_edt(near) > radius_cells
    return closed[margin:-margin, margin:-margin]
