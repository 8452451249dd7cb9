"""Starts and goals as they are given, checked."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import FloatArray


def _numbers(given: ArrayLike) -> FloatArray:
    """Float64, one NaN for what is no number."""
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return np.full(1, np.nan)


def read_point(name: str, point: ArrayLike) -> FloatArray:
    """A position, float64 (2,)."""
    xy = _numbers(point)
    if xy.shape != (2,) or not (math.isfinite(xy[0]) and math.isfinite(xy[1])):
        raise InvalidValueError(
            f"{name} must be two finite coordinates (x, y) in metres, got {point!r:.80}"
        )
    return xy


def read_pose(name: str, given: ArrayLike, *, needs_heading: bool) -> FloatArray:
    """Position and heading, float64 (3,); the heading is 0 where none is needed or given."""
    pose = _numbers(given)
    if pose.size != 3 and not needs_heading:  # noqa: PLR2004
        return np.append(read_point(name, given), 0.0)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise InvalidValueError(
            f"{name} must be three finite numbers (x, y, yaw) in metres and radians, "
            f"got {given!r:.80}"
        )
    return pose


def read_points(name: str, points: ArrayLike) -> FloatArray:
    """Positions, float64 (n, 2); n may be 0."""
    xy = _numbers(points)
    if xy.shape in {(0,), (0, 2)}:
        return np.empty((0, 2))
    if xy.ndim != 2 or xy.shape[1] != 2 or not np.isfinite(xy).all():  # noqa: PLR2004
        raise InvalidValueError(
            f"{name} must be finite coordinates (x, y) in metres, shape (n, 2), got {points!r:.80}"
        )
    return xy
