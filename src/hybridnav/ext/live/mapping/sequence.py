"""Scans that do not follow from those before: other counts, earlier times, poses that jump."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hybridnav.ext.live.mapping.scans import LaserScan

_JUMP_M = 5.0
_SPEED_M_S = 2.0
"""A robot's pose jumps when it moves farther than 5 m and 2 m for each second since the last."""


class ScanSequence:
    """A test of whether each scan of a robot follows from the scan before.

    A scan that has another number of beams, an earlier time, or a pose beyond reach is a mistake,
    or a new beginning: the robot was carried, its clock was set. So it is refused, but if the next
    scan follows from it, that one is a new beginning and holds.

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
    if math.dist(after.pose[:2], before.pose[:2]) > _JUMP_M + _SPEED_M_S * seconds:
        return "pose jumps"
    return None
