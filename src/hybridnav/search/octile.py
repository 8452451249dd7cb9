"""Lengths on the octile grid, exact in a + b sqrt 2."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.search._costs import DIAGONAL, STRAIGHT

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import FloatArray, LongArray

# DIAGONAL^2 = 2 * STRAIGHT^2 + 1, so DIAGONAL is its own inverse modulo STRAIGHT.
_INVERSE = DIAGONAL % STRAIGHT


def length_in_cells(cost: ArrayLike) -> FloatArray:
    """Return the path lengths of integer costs, recounted as a + b sqrt 2 of their moves.

    Parameters
    ----------
    cost
        Sums of STRAIGHT and DIAGONAL, >= 0, any shape.

    Returns
    -------
    FloatArray
        Lengths in cells, same shape; exact below 80782 diagonal moves, and within 1e-5 beyond.
    """
    total = np.asarray(cost, dtype=np.int64)
    diagonal = total % STRAIGHT * _INVERSE % STRAIGHT
    straight = (total - diagonal * DIAGONAL) // STRAIGHT
    length: FloatArray = straight + diagonal * math.sqrt(2.0)
    return length


def length_of_cost(cost: int) -> float:
    """Return the length of one cost, like `length_in_cells` without numpy."""
    diagonal = cost % STRAIGHT * _INVERSE % STRAIGHT
    return (cost - diagonal * DIAGONAL) // STRAIGHT + diagonal * math.sqrt(2.0)


def path_length_in_cells(cells: LongArray) -> float:
    """Return the length of a path of 8-neighbour moves, counted as a + b sqrt 2.

    Parameters
    ----------
    cells
        `(row, col)` of the cells passed, shape `(n, 2)`, n >= 1.
    """
    diagonal = int((np.abs(np.diff(cells, axis=0)).sum(axis=1) == 2).sum())  # noqa: PLR2004
    return (len(cells) - 1 - diagonal) + diagonal * math.sqrt(2.0)


def cost_of(cells: LongArray) -> int:
    """Return the integer cost of a path of 8-neighbour moves; see `_kernels` for its unit.

    Parameters
    ----------
    cells
        `(row, col)` of the cells passed, shape `(n, 2)`, n >= 1.
    """
    diagonal = int((np.abs(np.diff(cells, axis=0)).sum(axis=1) == 2).sum())  # noqa: PLR2004
    return (len(cells) - 1 - diagonal) * STRAIGHT + diagonal * DIAGONAL


def octile_distance_in_cells(first: ArrayLike, second: ArrayLike) -> float:
    """Return the length of the shortest octile path between two cells without obstacles."""
    rows, cols = np.abs(np.subtract(first, second))
    return float(abs(int(rows) - int(cols)) + min(int(rows), int(cols)) * math.sqrt(2.0))
