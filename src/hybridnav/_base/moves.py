"""Moves between neighbouring cells: directions, costs, legal moves, lengths of paths.

A cell has 8 neighbours. Direction k leads `ROW_STEP[k]` rows and `COL_STEP[k]` columns on, counted
counter-clockwise from east; odd directions are diagonal. Searches count in integers, `STRAIGHT` for
a step along a side and `DIAGONAL` for one along a diagonal; lengths are exact in a + b sqrt 2.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.kernels.moves import (
    COL_STEP,
    DIAGONAL,
    FAR,
    ROW_STEP,
    STRAIGHT,
    legal_moves,
    octile_cost,
    trace,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._base.typing import ByteArray, FloatArray, LongArray

__all__ = [
    "COL_STEP",
    "DIAGONAL",
    "FAR",
    "ROW_STEP",
    "STEPS",
    "STRAIGHT",
    "cost_of",
    "legal_moves",
    "length_in_cells",
    "moves_along",
    "octile_cost",
    "octile_distance_in_cells",
    "path_length_in_cells",
    "trace",
]

STEPS = np.stack([ROW_STEP, COL_STEP], axis=1)
"""int64 (8, 2), `(rows, columns)` of each direction; the first four are half of the moves, each
the opposite of one of the others."""
STEPS.flags.writeable = False

# DIAGONAL^2 = 2 * STRAIGHT^2 + 1, so DIAGONAL is its own inverse modulo STRAIGHT.
_INVERSE = DIAGONAL % STRAIGHT


def moves_along(moves: ByteArray, cols: int, direction: int) -> tuple[LongArray, LongArray]:
    """Return the flat cells that the legal moves in one direction lead from, and to.

    `moves`: uint8 (rows * cols,), masks of the legal moves, as `legal_moves` returns them; `cols`:
    columns of the map; `direction`: from 0 to 7.
    """
    tail = np.flatnonzero(moves >> direction & 1)
    row_step, col_step = STEPS[direction].tolist()
    return tail, tail + row_step * cols + col_step


def length_in_cells(cost: ArrayLike) -> FloatArray:
    """Return the path lengths of integer costs, recounted as a + b sqrt 2 of their moves.

    `cost`: sums of STRAIGHT and DIAGONAL, >= 0, any shape. Result: lengths in cells, same shape;
    exact below 80782 diagonal moves, and within 1e-5 beyond.
    """
    total = np.asarray(cost, dtype=np.int64)
    diagonal = total % STRAIGHT * _INVERSE % STRAIGHT
    straight = (total - diagonal * DIAGONAL) // STRAIGHT
    return straight + diagonal * math.sqrt(2.0)


def path_length_in_cells(cells: LongArray) -> float:
    """Return the length of a path of 8-neighbour moves, counted as a + b sqrt 2.

    `cells`: `(row, col)` of the cells passed, shape `(n, 2)`, n >= 1.
    """
    diagonal = int((np.abs(np.diff(cells, axis=0)).sum(axis=1) == 2).sum())  # noqa: PLR2004
    return (len(cells) - 1 - diagonal) + diagonal * math.sqrt(2.0)


def cost_of(cells: LongArray) -> int:
    """Return the integer cost of a path of 8-neighbour moves; see `STRAIGHT`.

    `cells`: `(row, col)` of the cells passed, shape `(n, 2)`, n >= 1.
    """
    diagonal = int((np.abs(np.diff(cells, axis=0)).sum(axis=1) == 2).sum())  # noqa: PLR2004
    return (len(cells) - 1 - diagonal) * STRAIGHT + diagonal * DIAGONAL


def octile_distance_in_cells(first: tuple[int, int], second: tuple[int, int]) -> float:
    """Return the length of the shortest octile path between two cells without obstacles."""
    rows, cols = abs(first[0] - second[0]), abs(first[1] - second[1])
    return abs(rows - cols) + min(rows, cols) * math.sqrt(2.0)
