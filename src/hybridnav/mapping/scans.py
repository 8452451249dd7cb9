"""Scans: the readings of a laser or of a ring of sonars, with the pose at which they were taken."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid.frame import FARTHEST_M

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray

_MOST_READINGS = 1_000_000
_MOST_TURN_RAD = 100.0


def _is_pose(pose: tuple[float, float, float]) -> bool:
    """Return whether a pose is finite and no farther than a grid may be."""
    return all(math.isfinite(value) and abs(value) <= FARTHEST_M for value in pose)


def _checked_pose(pose: tuple[float, float, float]) -> tuple[float, float, float]:
    x_m, y_m, heading_rad = (float(value) for value in pose)
    if not _is_pose((x_m, y_m, heading_rad)):
        raise InvalidValueError(
            f"a pose must be finite (x, y, heading) within {FARTHEST_M:g} m and radians, got {pose}"
        )
    return x_m, y_m, heading_rad


def _checked_ranges(ranges_m: FloatArray) -> FloatArray:
    ranges = np.array(ranges_m, dtype=np.float64)
    if ranges.ndim != 1 or not 0 < ranges.size <= _MOST_READINGS:
        raise InvalidValueError(
            f"ranges must be 1 to {_MOST_READINGS} numbers in one row, got shape {ranges.shape}"
        )
    ranges.flags.writeable = False
    return ranges


@dataclass(frozen=True, eq=False)
class LaserScan:
    """Readings of a laser that were taken at one pose.

    Parameters
    ----------
    ranges_m
        Distance that each beam measured, float64 (n,), n >= 1. NaN and values below 0 are no
        readings; infinity stands for a beam without a return. Copied.
    pose
        `(x, y, heading)` of the laser in the map frame, in metres and radians.
    start_rad, step_rad
        Direction of the first beam relative to the heading, counter-clockwise, and the angle from
        each beam to the next one.
    max_range_m
        Range of this laser: readings of that length or more are beams without a return.
    time_s
        When the scan was taken; NaN if unknown.

    Raises
    ------
    InvalidValueError
        When the pose or an angle is not finite, there are no ranges, or the maximum is no positive
        number.

    Examples
    --------
    >>> from hybridnav.mapping import LaserScan
    >>> scan = LaserScan(np.array([1.0, 2.0]), pose=(0.0, 0.0, 0.0), start_rad=0, step_rad=1.0)
    >>> len(scan.ranges_m)
    2
    """

    ranges_m: FloatArray = field(repr=False)
    pose: tuple[float, float, float]
    start_rad: float
    step_rad: float
    max_range_m: float = math.inf
    time_s: float = math.nan

    def __post_init__(self) -> None:
        object.__setattr__(self, "ranges_m", _checked_ranges(self.ranges_m))
        object.__setattr__(self, "pose", _checked_pose(self.pose))
        for name in ("start_rad", "step_rad", "max_range_m", "time_s"):
            object.__setattr__(self, name, float(getattr(self, name)))
        if not (abs(self.start_rad) <= _MOST_TURN_RAD and abs(self.step_rad) <= _MOST_TURN_RAD):
            raise InvalidValueError(
                f"angles of beams must be finite and within a few turns, got {self.start_rad} and "
                f"{self.step_rad} radians"
            )
        if not self.max_range_m > 0:
            raise InvalidValueError(
                f"max_range_m must be a positive number of metres, got {self.max_range_m}"
            )


@dataclass(frozen=True, eq=False)
class SonarScan:
    """Readings of the sonars of a robot that were taken at one pose.

    Parameters
    ----------
    ranges_m
        Distance that each sonar measured, float64 (n,), n >= 1; NaN and values below 0 are no
        readings, infinity stands for no echo. Copied.
    pose
        `(x, y, heading)` of the robot in the map frame, in metres and radians.
    mounts
        `(x, y, heading)` of each sonar on the robot, float64 (n, 3), metres and radians; see
        `sonar_ring`. Copied.
    time_s
        When the scan was taken; NaN if unknown.

    Raises
    ------
    InvalidValueError
        When the pose or a mount is not finite, or there is not one mount for each range.

    Examples
    --------
    >>> from hybridnav.mapping import SonarScan, sonar_ring
    >>> scan = SonarScan(np.full(16, 2.0), pose=(0.0, 0.0, 0.0), mounts=sonar_ring())
    >>> len(scan.ranges_m)
    16
    """

    ranges_m: FloatArray = field(repr=False)
    pose: tuple[float, float, float]
    mounts: FloatArray = field(repr=False)
    time_s: float = math.nan

    def __post_init__(self) -> None:
        object.__setattr__(self, "ranges_m", _checked_ranges(self.ranges_m))
        object.__setattr__(self, "pose", _checked_pose(self.pose))
        object.__setattr__(self, "time_s", float(self.time_s))
        mounts = np.array(self.mounts, dtype=np.float64)
        if mounts.shape != (len(self.ranges_m), 3) or not (np.abs(mounts) <= FARTHEST_M).all():
            raise InvalidValueError(
                f"mounts must be finite (x, y, heading), one for each of {len(self.ranges_m)} "
                f"ranges, got shape {mounts.shape}"
            )
        mounts.flags.writeable = False
        object.__setattr__(self, "mounts", mounts)


def sonar_ring(n_sonars: int = 16, *, radius_m: float = 0.23) -> FloatArray:
    """Return the mounts of sonars that stand evenly on a ring and look outwards.

    Parameters
    ----------
    n_sonars
        Number of sonars; the first looks ahead, the others follow counter-clockwise. The Nomad 200
        has 16.
    radius_m
        Radius of the ring in metres; the default is that of the Nomad 200.

    Returns
    -------
    FloatArray
        `(x, y, heading)` of each sonar, float64 (n_sonars, 3), metres and radians.

    Raises
    ------
    InvalidValueError
        When the number or the radius is out of range.

    Examples
    --------
    >>> from hybridnav.mapping import sonar_ring
    >>> sonar_ring(4, radius_m=1.0).round(2) + 0.0
    array([[ 1.  ,  0.  ,  0.  ],
           [ 0.  ,  1.  ,  1.57],
           [-1.  ,  0.  ,  3.14],
           [ 0.  , -1.  ,  4.71]])
    """
    if not 0 < n_sonars <= _MOST_READINGS:
        raise InvalidValueError(f"a ring needs 1 to {_MOST_READINGS} sonars, got {n_sonars}")
    if not (math.isfinite(radius_m) and radius_m >= 0):
        raise InvalidValueError(
            f"radius of the ring must be a finite length in metres >= 0, got {radius_m}"
        )
    heading = np.arange(n_sonars) * (math.tau / n_sonars)
    return np.stack([radius_m * np.cos(heading), radius_m * np.sin(heading), heading], axis=1)
