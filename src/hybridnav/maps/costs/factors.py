"""Factors of cells: their checks and the units to which they are rounded, and the factors that the
distance to obstacles and the filter masks of Nav2 make.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hybridnav._base.copies import frozen
from hybridnav._base.trig import exp
from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.maps.cells import MAX_CELLS, Box
from hybridnav.maps.clearance import clearance_cells

UNIT_BITS = 14
"""Factors are whole multiples of 2^-14."""
MOST_FACTOR = 1000.0
"""Largest factor of a cell."""


def rounded(factors: AnyArray) -> NDArray[np.float32]:
    """Return factors, rounded down to units; float32 holds these exactly."""
    units = np.floor(np.asarray(factors, dtype=np.float64) * (1 << UNIT_BITS))
    return (units / (1 << UNIT_BITS)).astype(np.float32)


def checked_factors(given: ArrayLike) -> NDArray[np.float32]:
    """Return the factors as a new float32 array in units.

    Raises `InvalidValueError` when they are no numbers from 1 to 1000 of two dimensions.
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

    Raises `InvalidValueError` when they are no bool array of this shape.
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

    Raises `InvalidValueError` when it is not four whole numbers, has no cell, or reaches beyond the
    layer.
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
    occupied = grid.measured == CellClass.OCCUPIED
    reach = min(math.ceil(inflation_m / resolution_m), sum(grid.shape))
    # Distances between centres are roots of whole numbers.
    squared = np.rint(np.minimum(clearance_cells(occupied), reach + 1) ** 2).astype(np.int64)
    counts = np.bincount(squared.ravel())
    cost_of = np.zeros(len(counts), dtype=np.uint8)
    for number in np.flatnonzero(counts[: reach**2 + 1]).tolist():
        cost_of[number] = cost_at(math.sqrt(number) * resolution_m, scaling, inscribed_m)
    return cost_of[squared]


# --- filter masks: speed limits and keepout zones -------------------------------------------------

Unit = Literal["percent", "m/s"]

_FULL_PERCENT = 100.0
_UNKNOWN = -1
"""Also the last value of tables over values, 0 to 100 and unknown."""
_VALUES = 101
_LETHAL = 254
_ROWS = 256
"""Rows that are converted at a time."""


@dataclass(frozen=True)
class SpeedLimits:
    """How the values of a speed mask limit the speed."""

    base: float
    multiplier: float
    unit: Unit
    full_speed_mps: float | None

    @property
    def _of_values(self) -> FloatArray:
        """The limit for each value, float64 (102,), the last one for unknown."""
        return self.base + self.multiplier * np.arange(_VALUES + 1, dtype=np.float64)

    @property
    def limiting(self) -> LongArray:
        """int64 (n,), the values that limit the speed."""
        limits = self._of_values
        is_limit = limits > 0
        if self.unit == "percent":
            is_limit &= limits <= _FULL_PERCENT
        is_limit[[0, _UNKNOWN]] = False  # no limit by the definition of the mask
        return np.flatnonzero(is_limit)

    def factors(self, most: float) -> FloatArray:
        """Return the factor for each value, float64 (102,), the last one for unknown."""
        full = _FULL_PERCENT if self.full_speed_mps is None else self.full_speed_mps
        own = self.limiting
        factors = np.ones(_VALUES + 1)
        with np.errstate(over="ignore"):  # infinite beside the least limits, then `most`
            factors[own] = full / self._of_values[own]
        return np.clip(factors, 1.0, most)


def checked_speeds(base: float, multiplier: float, unit: str, full_mps: float | None) -> Any:
    """Return the settings of a speed mask.

    Raises `InvalidValueError` when one is out of range.
    """
    if unit not in get_args(Unit):
        raise InvalidValueError(f"the unit of speed limits is percent or m/s, got {unit!r:.80}")
    if (unit == "m/s") != (full_mps is not None):
        what = "is needed with" if unit == "m/s" else "does not go with"
        raise InvalidValueError(f"full_speed_mps {what} the unit {unit}")
    numbers = {"base": base, "multiplier": multiplier}
    numbers |= {} if full_mps is None else {"full_speed_mps": full_mps}
    for name, value in numbers.items():
        is_number = isinstance(value, int | float | np.number) and math.isfinite(value)
        if not is_number or (name == "full_speed_mps" and value <= 0):
            least = " > 0" if name == "full_speed_mps" else ""
            raise InvalidValueError(f"{name} must be a finite number{least}, got {value!r:.80}")
    full = None if full_mps is None else float(full_mps)
    return SpeedLimits(float(base), float(multiplier), "percent" if full is None else "m/s", full)


def keepout_costs() -> LongArray:
    """Return the cost for each value of a keepout mask, int64 (102,), the last one for unknown."""
    # Half away from zero, as std::round in Nav2's `CostmapFilter::getMaskCost` rounds.
    costs = np.floor(np.arange(_VALUES + 1) * _LETHAL / _FULL_PERCENT + 0.5).astype(np.int64)
    costs[_UNKNOWN] = 0
    return costs


def checked_values(values: ArrayLike) -> NDArray[np.int8]:
    """Return the values of a mask as int8.

    Raises `InvalidValueError` when they are no integers from -1 to 100 of two dimensions.
    """
    try:
        array = np.asarray(values)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.ndim != 2 or not 0 < array.size <= MAX_CELLS or array.dtype.kind not in "iu":  # noqa: PLR2004
        raise InvalidValueError(
            "a mask must be integers of shape (rows, cols), "
            f"got {array.dtype} of shape {array.shape}"
        )
    wrong = (array < _UNKNOWN) | (array >= _VALUES)
    if wrong.any():
        row, col = np.unravel_index(int(wrong.argmax()), array.shape)
        raise InvalidValueError(
            "the values of a mask are 0 to 100, or -1 for unknown, "
            f"got {array[row, col]} in cell ({row}, {col})"
        )
    return array.astype(np.int8)


def mask_on_map(
    grid: OccupancyGrid, values: NDArray[np.int8], frame: Frame | None
) -> NDArray[np.int8]:
    """Return the value of a mask at the centre of each cell of a map, int8 (rows, cols).

    It is -1 outside the mask.
    """
    if _is_cell_by_cell(grid, values, frame):
        return values
    frame = grid.frame if frame is None else frame
    rows, cols = grid.shape
    mask = np.full(grid.shape, _UNKNOWN, dtype=np.int8)
    for first in range(0, rows, _ROWS):
        strip = np.mgrid[first : min(first + _ROWS, rows), :cols]
        cells = frame.cells_of(grid.frame.points_of(np.moveaxis(strip, 0, -1)))
        is_inside = ((cells >= 0) & (cells < values.shape)).all(axis=-1)
        mask[first : first + _ROWS][is_inside] = values[tuple(cells[is_inside].T)]
    return mask


def holding_centres(grid: OccupancyGrid, marked: BoolArray, frame: Frame | None) -> BoolArray:
    """Return the cells of a map in which the centre of a marked cell of a mask lies.

    `marked`: bool (rows, cols), cells of the mask; `frame`: their place; None for that of the map.
    """
    if _is_cell_by_cell(grid, marked, frame):
        return marked
    frame = grid.frame if frame is None else frame
    holds = np.zeros(grid.shape, dtype=np.bool_)
    for first in range(0, marked.shape[0], _ROWS):
        own = np.argwhere(marked[first : first + _ROWS]) + np.array([first, 0])
        cells = grid.frame.cells_of(frame.points_of(own))
        is_inside = ((cells >= 0) & (cells < grid.shape)).all(axis=-1)
        holds[tuple(cells[is_inside].T)] = True
    return holds


def _is_cell_by_cell(grid: OccupancyGrid, mask: AnyArray, frame: Frame | None) -> bool:
    if frame is None and mask.shape != grid.shape:
        raise InvalidValueError(
            f"a mask of shape {mask.shape} is not that of a map of shape {grid.shape}: give the "
            "frame of the mask"
        )
    return mask.shape == grid.shape and (frame is None or frame == grid.frame)


# Sources of layers of costs: the origin of the factors, plain values for JSON.

_MOST_SOURCES = 8
"""Sources that a layer names after changes."""


def joined_source(first: dict[str, Any], second: dict[str, Any], how: str) -> dict[str, Any]:
    """Return the source of two layers joined in one way; what was joined so before is one list."""
    parts = [
        part for each in (first, second) for part in (each["of"] if each["kind"] == how else [each])
    ]
    return {"kind": how, "of": parts}


def changed_source(before: dict[str, Any], part: dict[str, Any]) -> dict[str, Any]:
    """Return the source of a layer with a changed part; it does not grow with every change."""
    is_changed = before["kind"] == "changed"
    sources = before["of"] if is_changed else [before]
    left_out = before.get("left_out", 0) if is_changed else 0
    if part not in sources:
        sources = [*sources, part]
    if len(sources) > _MOST_SOURCES:
        sources, left_out = [sources[0], *sources[2:]], left_out + 1
    source = {"kind": "changed", "of": sources}
    return source | {"left_out": left_out} if left_out else source
