"""Checks of scans and of the settings of sensors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._copies import frozen
from hybridnav.errors import InvalidValueError
from hybridnav.grid.frame import FARTHEST_M

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray

MOST_READINGS = 1_000_000
"""Readings of a scan, and sonars of a ring."""


def checked_count(name: str, value: Any, most: int) -> int:
    """Return a whole number from 1 to the most.

    Raises
    ------
    InvalidValueError
        When it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 0 < value <= most:
        raise InvalidValueError(
            f"{name} is {value!r:.80}, expected a whole number from 1 to {most}: give another one"
        )
    return int(value)


def checked_pose(pose: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return a finite pose, no farther than a grid may be.

    Raises
    ------
    InvalidValueError
        When it is none.
    """
    try:
        x_m, y_m, heading_rad = (float(value) for value in pose)
    except (TypeError, ValueError, OverflowError):
        x_m = y_m = heading_rad = math.nan
    if not all(abs(value) <= FARTHEST_M for value in (x_m, y_m, heading_rad)):
        raise InvalidValueError(
            f"pose is {pose!r:.80}, expected finite (x, y, heading) within {FARTHEST_M:g} metres "
            "and radians: give the pose at which the scan was taken"
        )
    return x_m, y_m, heading_rad


def checked_number(name: str, value: Any) -> float:
    """Return a number, NaN and infinite ones too.

    Raises
    ------
    InvalidValueError
        When it is none.
    """
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(
            f"{name} is {value!r:.80}, expected a number: give it as a float"
        ) from None


def checked_array(name: str, values: Any) -> FloatArray:
    """Return a copy of numbers as a read-only array.

    Raises
    ------
    InvalidValueError
        When they are no numbers.
    """
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(
            f"{name} are {type(values).__name__} {values!r:.60}, expected numbers: give them as an "
            "array of float64"
        ) from None
    return frozen(array)


def checked_ranges(ranges_m: FloatArray) -> FloatArray:
    """Return a read-only copy of the readings of a scan.

    Raises
    ------
    InvalidValueError
        When they are not numbers in one row.
    """
    ranges = checked_array("ranges", ranges_m)
    if ranges.ndim != 1 or not 0 < ranges.size <= MOST_READINGS:
        raise InvalidValueError(
            f"ranges have the shape {ranges.shape}, expected 1 to {MOST_READINGS} numbers in one "
            "row: give one scan at a time"
        )
    return ranges
