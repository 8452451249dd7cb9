"""Scans of a laser, with poses, and which follow from those before."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav._base.trig import dist
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.frame import FARTHEST_M

_MOST_TURN_RAD = 100.0


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
    >>> from hybridnav.ext.live.mapping import LaserScan
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
        object.__setattr__(self, "ranges_m", checked_ranges(self.ranges_m))
        object.__setattr__(self, "pose", checked_pose(self.pose))
        for name in ("start_rad", "step_rad", "max_range_m", "time_s"):
            object.__setattr__(self, name, checked_number(name, getattr(self, name)))
        if not (abs(self.start_rad) <= _MOST_TURN_RAD and abs(self.step_rad) <= _MOST_TURN_RAD):
            raise InvalidValueError(
                f"start_rad and step_rad are {self.start_rad} and {self.step_rad}, expected finite "
                "angles within a few turns: give radians"
            )
        if not self.max_range_m > 0:
            raise InvalidValueError(
                f"max_range_m is {self.max_range_m}, expected a positive number: give metres, or "
                "infinity if the laser states none"
            )


# Checks of scans and of the settings of sensors.

MOST_READINGS = 1_000_000
"""Readings of a scan."""


def checked_pose(pose: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return a finite pose, no farther than a grid may be.

    Raises `InvalidValueError` when it is none.
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

    Raises `InvalidValueError` when it is none.
    """
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(
            f"{name} is {value!r:.80}, expected a number: give it as a float"
        ) from None


def checked_array(name: str, values: Any) -> FloatArray:
    """Return a copy of numbers as a read-only array.

    Raises `InvalidValueError` when they are no numbers.
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

    Raises `InvalidValueError` when they are not numbers in one row.
    """
    ranges = checked_array("ranges", ranges_m)
    if ranges.ndim != 1 or not 0 < ranges.size <= MOST_READINGS:
        raise InvalidValueError(
            f"ranges have the shape {ranges.shape}, expected 1 to {MOST_READINGS} numbers in one "
            "row: give one scan at a time"
        )
    return ranges


# Scans that do not follow from those before.

_JUMP_M = 5.0
_SPEED_M_S = 2.0
"""A robot's pose jumps when it moves farther than 5 m and 2 m for each second since the last."""


class ScanSequence:
    """A test of whether each scan of a robot follows from the scan before.

    A scan may have another number of beams, an earlier time, or a pose beyond reach. That is a
    mistake or a new beginning: the robot was carried, its clock was set. So it is refused, but if
    the next scan follows from it, that one is a new beginning and holds.

    Examples
    --------
    >>> from hybridnav.ext.live.mapping import LaserScan, ScanSequence
    >>> sequence = ScanSequence()
    >>> for x in (0.0, 50.0, 0.1, 70.0, 70.1):
    ...     pose = (x, 0.0, 0.0)
    ...     scan = LaserScan(np.ones(3), pose=pose, start_rad=0.0, step_rad=0.1)
    ...     print(sequence.fault_of(scan))
    None
    pose jumps
    None
    pose jumps
    None
    """

    def __init__(self) -> None:
        self._last: LaserScan | None = None
        self._refused: LaserScan | None = None

    def fault_of(self, scan: LaserScan) -> str | None:
        """Return why a scan does not follow from the last one that did, None if it does.

        Parameters
        ----------
        scan
            The next scan of the robot.

        Returns
        -------
        str or None
            The fault in a few words, the same for all scans with that fault.
        """
        fault = None if self._last is None else _fault_between(self._last, scan)
        if fault is not None and (
            self._refused is None or _fault_between(self._refused, scan) is not None
        ):
            self._refused = scan
            return fault
        self._last, self._refused = scan, None
        return None


def _fault_between(before: LaserScan, after: LaserScan) -> str | None:
    if len(after.ranges_m) != len(before.ranges_m):
        return "other number of beams"
    elapsed_s = after.time_s - before.time_s
    if elapsed_s < 0:
        return "time runs back"
    seconds = elapsed_s if math.isfinite(elapsed_s) else 0.0
    if dist(after.pose[:2], before.pose[:2]) > _JUMP_M + _SPEED_M_S * seconds:
        return "pose jumps"
    return None
