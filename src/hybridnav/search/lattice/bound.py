"""A lower bound on the cost of all paths at any angle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.search.lattice.kernels.bound import least_over_corners

if TYPE_CHECKING:
    from typing import Any

    from hybridnav._base.typing import AnyArray

_RATIO = math.sqrt(4 - 2 * math.sqrt(2))
"""Most by which a path over corners is dearer than one at any angle, 1.0824."""


def cost_bound(
    free: AnyArray,
    factors: AnyArray,
    ends: tuple[tuple[float, float], tuple[float, float]],
    cells: tuple[tuple[int, int], tuple[int, int]],
    known: float = math.inf,
) -> float:
    """Return a lower bound on the cost of all paths between two positions, in cells.

    Between two corners of cells, the cheapest path along sides and diagonals of cells is at most
    1.0824 times as dear as the cheapest at any angle, whatever the factors are; a move along a side
    costs the smaller factor of its two cells. Start and goal are joined to corners of their cells.

    Parameters
    ----------
    free
        uint8 (rows, cols), 1 where a cell may be entered.
    factors
        float32 (rows, cols), >= 1.
    ends
        Positions (row, col) of start and goal, in grid units.
    cells
        The free cells (row, col) that hold them.
    known
        Cost of a path; a bound above it is of no use.

    Returns
    -------
    float
        At least the distance of the two; at most `known`.

    Notes
    -----
    The ratio for squares with any factors: arXiv 2404.07562, 2024.

    Examples
    --------
    >>> from hybridnav.search.lattice import cost_bound
    >>> free, factors = np.ones((9, 9), np.uint8), np.full((9, 9), 2, np.float32)
    >>> round(cost_bound(free, factors, ((0, 0), (9, 9)), ((0, 0), (8, 8))), 3)
    23.518
    """
    corners: list[Any] = []
    joins = 0.0
    for (row, col), cell in zip(ends, cells, strict=True):
        corner = round(row), round(col)
        joins += float(factors[tuple(cell)]) * math.dist((row, col), corner)
        corners.append(np.array(corner, dtype=np.int64))
    over_corners: float = least_over_corners(free, factors, *corners, (known + joins) * _RATIO)
    return min(max(over_corners / _RATIO - joins, math.dist(*ends)), known)
