"""Paths of robots that turn on the spot and drive straight, pose by pose."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.trig import atan2

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray
    from hybridnav.refine.curves import Pose
    from hybridnav.refine.motions import MotionCheck

_EQUAL_RAD = 1e-9
"""Drives whose headings differ by less are merged, if the robot can drive them as one; a turn that
differs by less from half a circle has no short way."""


def driven(check: MotionCheck, poses: FloatArray, *, reverses: bool = False) -> FloatArray:
    """Return the turns and drives of a robot that visits some poses, pose by pose.

    The robot drives straight from point to point, forwards if possible. At each point it turns from
    one drive's heading to the next one's, at the endpoints from or to the heading of the pose. The
    headings of the poses in between are left out: a robot that can turn to them can turn past them,
    one way round or the other.

    Parameters
    ----------
    check
        Check of motions.
    poses
        float64 (n, 3), n >= 1, `(x, y, yaw)`, metres and radians, map frame.
    reverses
        Whether the robot may drive backwards too.

    Returns
    -------
    FloatArray
        float64 (m, 3). From each pose to the next the robot either turns on the spot, the short
        way, or drives straight with one heading. Where it turns, a point occurs with the heading
        before and after, and with one half-way if it turns by half a circle or the long way round.
        Without rows if a motion between two of the poses is not valid.
    """
    states: list[Pose] = [tuple(pose) for pose in poses.tolist()]
    drives = _drives(check, states, reverses=reverses)
    if drives is None:
        return np.empty((0, 3))
    spelled = states[:1]
    for first, last in [*drives, (states[-1], None)]:
        x, y, before = spelled[-1]
        turn = check.spin(x, y, before, first[2])
        if math.isnan(turn):
            return np.empty((0, 3))
        if abs(turn) > math.pi - _EQUAL_RAD:
            spelled.append((x, y, math.remainder(before + turn / 2, math.tau)))
        if turn:
            spelled.append((x, y, first[2]))
        if last is not None:
            spelled.append(last)
    return np.array(spelled)


def _drives(
    check: MotionCheck, poses: list[Pose], *, reverses: bool
) -> list[tuple[Pose, Pose]] | None:
    """Return the first and last pose of each drive; None if a motion is not valid."""
    drives: list[tuple[Pose, Pose]] = []
    for first, second in itertools.pairwise(poses):
        if first[:2] == second[:2]:
            if math.isnan(check.spin(*first, second[2])):
                return None
            continue
        heading = atan2(second[1] - first[1], second[0] - first[0])
        if not check.drive_valid(*first, *second):
            if not (reverses and check.drive_valid(*first, *second, backwards=True)):
                return None
            heading = math.remainder(heading + math.pi, math.tau)
        begin = (first[0], first[1], heading)
        if drives and abs(math.remainder(heading - drives[-1][0][2], math.tau)) < _EQUAL_RAD:
            before = drives[-1][0]
            if check.turn_valid(*before, second[0], second[1], before[2]):
                drives.pop()
                begin = before
        drives.append((begin, (second[0], second[1], begin[2])))
    return drives
