"""Checks of factors and of the settings of costs, and the units that factors are rounded to."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav._base.trig import exp
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import CellClass
from hybridnav.maps.clearance import clearance_cells

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from hybridnav._base.typing import AnyArray, BoolArray, ByteArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.areas import Box


UNIT_BITS = 14
"""Factors are whole multiples of 2^-14."""
MOST_FACTOR = 1000.0
"""Largest factor of a cell."""


def rounded(factors: AnyArray) -> NDArray[np.float32]:
    """Return factors, rounded down to units; float32 holds these exactly."""
    units = np.floor(np.asarray(factors, dtype=np.float64) * (1 << UNIT_BITS))
    rounded: NDArray[np.float32] = (units / (1 << UNIT_BITS)).astype(np.float32)
    return rounded


def checked_factors(given: ArrayLike) -> NDArray[np.float32]:
    """Return the factors as a new float32 array in units.

    Raises
    ------
    InvalidValueError
        When they are no numbers from 1 to 1000 of two dimensions.
    """
    try:
        array = np.asarray(given)
        numbers = array.astype(np.float64) if array.dtype.kind in "iuf" else None
    except (TypeError, ValueError, OverflowError):
        numbers = None
    if numbers is None or numbers.ndim != 2 or numbers.size == 0:  # noqa: PLR2004
        shape = "no array of numbers" if numbers is None else f"shape {numbers.shape}"
        raise InvalidValueError(
            f"factors must be numbers of shape (rows, cols), one for each cell, got {shape}"
        )
    wrong = ~((numbers >= 1) & (numbers <= MOST_FACTOR))
    if wrong.any():
        row, col = np.unravel_index(int(wrong.argmax()), numbers.shape)
        raise InvalidValueError(
            f"factors must be numbers from 1 to {MOST_FACTOR:g}, got {numbers[row, col]:g} in cell "
            f"({row}, {col}): close a cell with `closed`, or scale the factors"
        )
    return rounded(numbers)


def checked_cells(name: str, given: ArrayLike | None, shape: tuple[int, int]) -> BoolArray | None:
    """Return closed cells of a layer of some rows and columns, None for none.

    Raises
    ------
    InvalidValueError
        When they are no bool array of this shape.
    """
    if given is None:
        return None
    cells = np.array(given)
    if cells.dtype != np.bool_ or cells.shape != shape:
        raise InvalidValueError(
            f"{name} cells must be bool of the shape {shape} of the factors, got {cells.dtype} of "
            f"shape {cells.shape}"
        )
    return frozen(cells) if cells.any() else None


def changed_cells(
    cells: BoolArray | None, part: BoolArray | None, box: Box, shape: tuple[int, int]
) -> BoolArray | None:
    """Return closed cells with those in a box as in a part; None stands for none."""
    if cells is None and part is None:
        return None
    changed = np.zeros(shape, np.bool_) if cells is None else cells.copy()
    changed[box[0] : box[1], box[2] : box[3]] = False if part is None else part
    return frozen(changed) if changed.any() else None


def joined_cells(*given: BoolArray | None) -> BoolArray | None:
    """Return the cells that some layers close, None for none."""
    known = [cells for cells in given if cells is not None]
    return np.logical_or.reduce(known) if known else None


def checked_setting(name: str, value: Any) -> float:
    """Return a finite number >= 0."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not (math.isfinite(number) and number >= 0) or isinstance(value, bool):
        raise InvalidValueError(f"{name} must be a finite number >= 0, got {value!r:.80}")
    return number


def checked_multiplier(multiplier: float) -> float:
    """Return a multiplier with which no factor is too large."""
    most = (MOST_FACTOR - 1) * HIGHEST / 254
    if multiplier > most:
        raise InvalidValueError(
            f"multiplier must be at most {math.floor(most)}, so that no factor is above "
            f"{MOST_FACTOR:g}, got {multiplier:g}"
        )
    return multiplier


def checked_box(box: Any, shape: tuple[int, int]) -> Box:
    """Return a box of cells of a layer that has a number of rows and columns.

    Raises
    ------
    InvalidValueError
        When it is not four whole numbers, has no cell, or reaches beyond the layer.
    """
    rows, cols = shape
    try:
        top, bottom, left, right = map(operator.index, box)
    except (TypeError, ValueError):
        top = bottom = left = right = -1
    if not (0 <= top < bottom <= rows and 0 <= left < right <= cols):
        raise InvalidValueError(
            f"box is {brief(box)}, expected (first row, last row + 1, first column, last column + "
            f"1) of cells inside costs of {cols} x {rows} cells: give four whole numbers"
        )
    return top, bottom, left, right


# Nav2's inflation: the cost of a cell by its distance from the nearest obstacle.

LETHAL, INSCRIBED, HIGHEST = 254, 253, 252
"""Costs of an occupied cell, of one within the inscribed radius, and the highest of all others."""


def cost_at(distance_m: float, scaling: float, inscribed_m: float) -> int:
    """Return the cost of a cell at a distance from an obstacle, as Nav2's `computeCost` does.

    Parameters
    ----------
    distance_m, inscribed_m
        Distance between the centres of cells, and inscribed radius, in metres.
    scaling
        `cost_scaling_factor`, 1 / m.

    Notes
    -----
    `nav2_costmap_2d/inflation_layer.hpp` (open-navigation/navigation2): a conversion to unsigned
    char truncates.
    """
    if distance_m == 0:
        return LETHAL
    if distance_m <= inscribed_m:
        return INSCRIBED
    return int(HIGHEST * exp(-scaling * (distance_m - inscribed_m)))


def inflated_costs(
    grid: OccupancyGrid, inflation_m: float, scaling: float, inscribed_m: float
) -> ByteArray:
    """Return the cost of each cell, uint8 (rows, cols), from 0 to 254.

    Nav2 rounds the inflation radius up to whole cells (`Costmap2D::cellDistance`), and inflates a
    cell whose centre is that far.
    """
    resolution_m = grid.resolution_m
    distance = clearance_cells(grid.measured == CellClass.OCCUPIED)
    reach = min(math.ceil(inflation_m / resolution_m), sum(grid.shape))
    costs = np.zeros(grid.shape, dtype=np.uint8)
    is_near = distance <= reach
    # Distances between centres are roots of whole numbers.
    squared = np.rint(distance[is_near] ** 2).astype(np.int64)
    present, at = np.unique(squared, return_inverse=True)
    cost_of = [
        cost_at(math.sqrt(number) * resolution_m, scaling, inscribed_m)
        for number in present.tolist()
    ]
    costs[is_near] = np.array(cost_of, dtype=np.uint8)[at]
    return costs
