"""Positions and polylines on the cells of a grid, compiled: for kernels, and for few cells, where
numpy is slower.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.maps.kernels import (
    centres,
    classes_at,
    least_along,
    line_between,
    passed_cells,
    points_at,
    polyline_length,
    polyline_lengths,
    position_of,
    positions_on_grain,
    walks_clear,
)

__all__ = [
    "cells_of_line",
    "centres",
    "classes_at",
    "least_along",
    "line_between",
    "passed_cells",
    "points_at",
    "polyline_length",
    "polyline_lengths",
    "position_of",
    "positions_on_grain",
    "walks_clear",
]


def cells_of_line(
    free: BoolArray, positions: FloatArray, ends: Sequence[Sequence[int]] = ()
) -> LongArray:
    """Find the cells that a polyline on free cells passes.

    `free`: bool (rows, cols); `positions`: float64 (n, 2), n >= 1, (row, col) on the lattice of the
    cells' corners; `ends`: the cells that it begins and ends in, which on a side may lie behind it.
    Returns int64 (m, 2), (row, col), each a neighbour of the one before, diagonally where the line
    passes a corner. Where the line runs between two cells, a free one.
    """
    # One memory layout, so that the kernel is compiled once.
    cells = np.ascontiguousarray(free).view()
    cells.flags.writeable = False
    passed = passed_cells(cells, np.ascontiguousarray(positions, dtype=np.float64))
    for at, end in zip((0, -1), ends, strict=False):
        if passed[at].tolist() != list(end):
            passed = np.insert(passed, at % (len(passed) + 1), end, axis=0)
    return passed
