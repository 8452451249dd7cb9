"""Distances to obstacles, and the cells within the robot's radius of them."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._base.trig import hypot
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray

FEW_ROWS = 64
"""Radius in cells up to which rows are shifted one by one: for more of them scipy is quicker."""
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
    if squared > FEW_ROWS**2:
        return _within_distance(occupied, squared)
    # In bands of rows, whose arrays of 2 and 4 bytes a cell stay in the processor's cache.
    reach, within = math.isqrt(squared), np.empty_like(occupied)
    for first in range(0, len(occupied), _BAND):
        low, last = max(first - reach, 0), first + _BAND
        near = squares_near(occupied[low : last + reach], reach) <= squared
        within[first:last] = near[first - low : last - low]
    return within


def squares_near(occupied: BoolArray, reach: int) -> AnyArray:
    """Return the squared distance from each cell to the nearest occupied one, where it is small.

    `occupied`: shape `(rows, cols)`; `reach`: cells, from 0 to 64. Returns uint16, same shape, in
    cells; exact below the square of `reach + 1`, else not below it.
    """
    rows, cols = occupied.shape
    at, far = np.arange(cols, dtype=np.int32), np.int32(cols + reach + 1)
    before = np.maximum.accumulate(np.where(occupied, at, -far), axis=1)
    after = np.minimum.accumulate(np.where(occupied, at, 2 * far)[:, ::-1], axis=1)[:, ::-1]
    in_row = np.minimum(np.minimum(at - before, after - at), reach + 1).astype(np.uint16)
    in_row *= in_row
    least = in_row.copy()
    for down in range(1, min(reach + 1, rows)):
        apart = in_row + np.uint16(down * down)
        np.minimum(least[down:], apart[:-down], out=least[down:])
        np.minimum(least[:-down], apart[down:], out=least[:-down])
    return least


def _within_distance(occupied: BoolArray, most: int) -> BoolArray:
    """Return the same by the distance transform."""
    from scipy import ndimage  # noqa: PLC0415 - half a second that smaller radii do not need

    nearest = ndimage.distance_transform_edt(~occupied, return_distances=False, return_indices=True)
    squared = np.zeros(occupied.shape, dtype=np.int64)
    for axis, size in enumerate(occupied.shape):
        offset = np.arange(size, dtype=np.int64)
        offset = offset[:, None] if axis == 0 else offset[None, :]
        squared += (nearest[axis] - offset) ** 2
    return squared <= most


def clearance_cells(occupied: BoolArray) -> FloatArray:
    """Return the distance from each cell to the nearest occupied one, in cells.

    Distances are between centres.

    `occupied`: shape `(rows, cols)`. Returns float64, same shape; 0 in occupied cells, infinite
    where none is occupied. Exact, by the Euclidean distance transform. Cells beyond the grid are
    not occupied.
    """
    if not occupied.any():
        return np.full(occupied.shape, np.inf)
    from scipy import ndimage  # noqa: PLC0415 - on demand, as above

    return ndimage.distance_transform_edt(~occupied)


def closing(cells: BoolArray, radius_cells: float) -> BoolArray:
    """Return the morphological closing of cells by a disc, bool of the same shape.

    Distances take as long for a large disc as for a small one.

    `cells`: bool (rows, cols); `radius_cells`: radius of the disc, >= 1; a cell belongs to it if
    its centre does.
    """
    if not cells.any():
        return cells.copy()
    from scipy import ndimage  # noqa: PLC0415 - on demand, as above

    margin = int(radius_cells) + 2
    near = ndimage.distance_transform_edt(~np.pad(cells, margin)) <= radius_cells
    closed: BoolArray = ndimage.distance_transform_edt(near) > radius_cells
    return closed[margin:-margin, margin:-margin]
