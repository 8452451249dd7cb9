"""Checks of values that public functions are given."""

from __future__ import annotations

import math
import operator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError, brief

_T = TypeVar("_T")


def checked_type(name: str, value: Any, kind: type[_T]) -> _T:
    """Return a value of a type.

    `name`: what the caller calls it; `value`: what was given. Raises `InvalidValueError` when it is
    of another type.
    """
    if isinstance(value, kind):
        return value
    article = "an" if kind.__name__[0] in "AEIOU" else "a"
    raise InvalidValueError(
        f"{name} is {brief(value)} of type {type(value).__name__}, expected {article} "
        f"{kind.__name__}: make one"
    )


def checked_whole(name: str, value: Any, low: int, high: int) -> int:
    """Return a whole number in a range.

    `name`: what the caller calls it; `value`: what was given; `low`, `high`: the least and the
    greatest number. Raises `InvalidValueError` when it is no whole number, or lies outside the
    range.
    """
    try:
        number = operator.index(value)
    except TypeError:
        number = low - 1
    if low <= number <= high:
        return number
    raise InvalidValueError(
        f"{name} must be a whole number from {low} to {high}, got {brief(value)}"
    )


def checked_radius(radius_m: Any) -> float:
    """Return the radius of a robot in metres.

    Raises `InvalidValueError` when it is no finite number >= 0.
    """
    try:
        metres = float(radius_m)
    except (TypeError, ValueError):
        metres = math.nan
    if math.isfinite(metres) and metres >= 0:
        return metres
    raise InvalidValueError(
        f"robot radius must be a finite length in metres >= 0, got {brief(radius_m)}"
    )


def checked_thresholds(free: Any, occupied: Any) -> tuple[float, float]:
    """Return the thresholds of free and occupied cells.

    Raises `InvalidValueError` when these are not two ascending numbers from 0 to 1.
    """
    try:
        low, high = float(free), float(occupied)
    except (TypeError, ValueError):
        low = high = math.nan
    if 0 <= low <= high <= 1:
        return low, high
    raise InvalidValueError(
        "thresholds must satisfy 0 <= free <= occupied <= 1, "
        f"got free {brief(free)} and occupied {brief(occupied)}"
    )


def checked_cell(name: str, cell: Any) -> tuple[int, int]:
    """Return a cell as two integers.

    `name`: what the caller calls it; `cell`: what was given. Raises `InvalidValueError` when it is
    not two whole numbers.
    """
    try:
        row, col = cell
        return operator.index(row), operator.index(col)
    except (TypeError, ValueError):
        raise InvalidValueError(
            f"{name} is {brief(cell)}, expected a cell (row, col): give two whole numbers"
        ) from None


def checked_between(name: str, value: Any, low: float, high: float) -> float:
    """Return a number in a range.

    `name`: what the caller calls it; `value`: what was given; `low`, `high`: the least and the
    greatest number. Raises `InvalidValueError` when it is no number, or lies outside the range.
    """
    if isinstance(value, int | float | np.number) and low <= value <= high:
        return float(value)
    raise InvalidValueError(
        f"{name} is {brief(value)}, expected a number from {low:,g} to {high:,g}: choose another "
        "one"
    )


def checked_points(points: ArrayLike) -> FloatArray:
    """Return the points as float64 (n, 2).

    Raises `InvalidValueError` when they are no finite array of shape (n, 2) or there is none.
    """
    try:
        xy = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError(
            f"points are {points!r:.60}, expected finite numbers (x, y) of shape (n, 2): give each "
            "point two"
        ) from None
    if xy.ndim != 2 or xy.shape[1] != 2 or not len(xy):  # noqa: PLR2004
        raise InvalidValueError(
            f"points must be finite numbers (x, y) of shape (n, 2), n >= 1, got shape {xy.shape}"
        )
    if not np.isfinite(xy).all():
        raise InvalidValueError("points need finite coordinates in metres")
    return xy
