"""Filter masks of Nav2 on the cells of a map: speed limits and keepout zones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.maps.limits import MAX_CELLS

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray
    from hybridnav.maps import Frame, OccupancyGrid


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
    def source(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "base": self.base,
            "multiplier": self.multiplier,
            "unit": self.unit,
            "full_speed_mps": self.full_speed_mps,
        }

    def factors(self, most: float) -> FloatArray:
        """Return the factor for each value, float64 (102,), the last one for unknown."""
        limits = self.base + self.multiplier * np.arange(_VALUES + 1)
        full = _FULL_PERCENT if self.full_speed_mps is None else self.full_speed_mps
        is_limit = limits > 0
        if self.unit == "percent":
            is_limit &= limits <= _FULL_PERCENT
        is_limit[[0, _UNKNOWN]] = False  # no limit by the definition of the mask
        factors = np.ones(len(limits))
        with np.errstate(over="ignore"):  # infinite beside the least limits, then `most`
            np.divide(full, limits, out=factors, where=is_limit)
        return np.clip(factors, 1.0, most)


def checked_speeds(base: float, multiplier: float, unit: str, full_mps: float | None) -> Any:
    """Return the settings of a speed mask.

    Raises
    ------
    InvalidValueError
        When one is out of range.
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

    Raises
    ------
    InvalidValueError
        When they are no integers from -1 to 100 of two dimensions.
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


def on_map(grid: OccupancyGrid, values: NDArray[np.int8], frame: Frame | None) -> NDArray[np.int8]:
    """Return the value of a mask at the centre of each cell of a map, int8 (rows, cols).

    It is -1 outside the mask.
    """
    if _is_cell_by_cell(grid, values, frame):
        return values
    frame = grid.frame if frame is None else frame
    rows, cols = grid.shape
    found = np.full(grid.shape, _UNKNOWN, dtype=np.int8)
    for first in range(0, rows, _ROWS):
        strip = np.mgrid[first : min(first + _ROWS, rows), :cols]
        cells = frame.cells_of(grid.frame.points_of(np.moveaxis(strip, 0, -1)))
        is_inside = ((cells >= 0) & (cells < values.shape)).all(axis=-1)
        found[first : first + _ROWS][is_inside] = values[tuple(cells[is_inside].T)]
    return found


def holding_centres(grid: OccupancyGrid, marked: BoolArray, frame: Frame | None) -> BoolArray:
    """Return the cells of a map in which the centre of a marked cell of a mask lies.

    Parameters
    ----------
    grid
        The map.
    marked
        bool (rows, cols), cells of the mask.
    frame
        Their place; None for that of the map.
    """
    if _is_cell_by_cell(grid, marked, frame):
        return marked
    frame = grid.frame if frame is None else frame
    found = np.zeros(grid.shape, dtype=np.bool_)
    for first in range(0, marked.shape[0], _ROWS):
        own = np.argwhere(marked[first : first + _ROWS]) + np.array([first, 0])
        cells = grid.frame.cells_of(frame.points_of(own))
        is_inside = ((cells >= 0) & (cells < grid.shape)).all(axis=-1)
        found[tuple(cells[is_inside].T)] = True
    return found


def _is_cell_by_cell(grid: OccupancyGrid, mask: AnyArray, frame: Frame | None) -> bool:
    """Return whether each cell of a mask is one of the map."""
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
