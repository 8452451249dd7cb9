"""Distances to obstacles, and the cells within the robot's radius of them."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._base.trig import hypot
from hybridnav._base.typing import BoolArray, FloatArray

_ROUNDING = 1e-9
"""Relative slack on a squared radius, so that 0.25 m is 5 cells of 0.05 m and not 4.999..."""


def within_radius(occupied: BoolArray, *, radius_cells: float) -> BoolArray:
    """Return the cells whose centre lies within a radius of the centre of an occupied cell.

    `occupied`: shape `(rows, cols)`; `radius_cells`: radius in cells, finite and >= 0; a distance
    equal to it counts as within. Result: same shape; by exact Euclidean distances (compared as
    integers).
    """
    if radius_cells < 1 or not occupied.any():
        return occupied.copy()
    if radius_cells >= hypot(*occupied.shape):
        return np.ones_like(occupied)
    return _dilated(occupied, math.floor(radius_cells * radius_cells * (1 + _ROUNDING)))


def _dilated(cells: BoolArray, squared: int) -> BoolArray:
    """Return cells, and those within a squared distance, >= 0, of one: rows are words of 64 bits,
    the first column in the lowest bit."""
    packed = np.packbits(cells, axis=1, bitorder="little")
    wide = np.pad(packed, ((0, 0), (0, -packed.shape[1] % 8))).view("<u8")
    found, width = np.zeros_like(wide), 0
    for down in range(min(math.isqrt(squared), len(wide) - 1), -1, -1):
        reach = math.isqrt(squared - down * down)
        while width < reach:  # a longer step would go through what lies beyond the last column
            step = min(reach - width, width + 1, 63)
            left, right = wide << np.uint64(step), wide >> np.uint64(step)
            left[:, 1:] |= wide[:, :-1] >> np.uint64(64 - step)
            right[:, :-1] |= wide[:, 1:] << np.uint64(64 - step)
            wide |= left
            wide |= right
            width += step
        found[down:] |= wide[: len(wide) - down]
        found[: len(wide) - down] |= wide[down:]
    bits = np.unpackbits(found.view(np.uint8), axis=1, count=cells.shape[1], bitorder="little")
    return bits.view(np.bool_)


def clearance_cells(occupied: BoolArray) -> FloatArray:
    """Return the distance from each cell to the nearest occupied one, in cells.

    Distances are between centres.

    `occupied`: shape `(rows, cols)`. Returns float64, same shape; 0 in occupied cells, infinite
    where none is occupied. Exact, to the last bit those of scipy's Euclidean distance transform, in
    a quarter of its time. Cells beyond the grid are not occupied.
    """
    from hybridnav.maps.kernels import nearest_distances  # noqa: PLC0415 - loads numba

    return nearest_distances(occupied.astype(np.bool_, order="C"))


def closing(cells: BoolArray, radius_cells: float) -> BoolArray:
    """Return the morphological closing of cells by a disc, bool of the same shape.

    `cells`: bool (rows, cols); `radius_cells`: radius of the disc, >= 1; a cell belongs to it if
    its centre does.
    """
    squared = math.floor(radius_cells * radius_cells * (1 + _ROUNDING))
    margin = math.isqrt(squared) + 1
    closed = ~_dilated(~_dilated(np.pad(cells, margin), squared), squared)
    return closed[margin:-margin, margin:-margin]
