"""Paths that vehicles can drive, pose by pose: shortest curves with a turning circle, Dubins
forwards and Reeds-Shepp both ways, and straight lines with turns on the spot.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from hybridnav._base.trig import atan2, cos, sin, sines_and_cosines
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.refine.kernels.curves import shortest_word
from hybridnav.refine.motions import MotionCheck

Pose = tuple[float, float, float]
"""`(x, y, yaw)`, metres and radians, map frame."""
_MAX_POSES = 10_000_000
_NOTHING_M = 1e-10
"""Segments no longer than this are what rounding leaves of a word with fewer."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Arcs of one radius and straight lines, each tangent to the next."""

    start: Pose
    kinds: LongArray
    """int64 (n,): 1 for an arc to the left, 0 for straight on, -1 for an arc to the right."""
    lengths_m: FloatArray
    """float64 (n,), metres, negative backwards."""
    radius_m: float

    @property
    def length_m(self) -> float:
        """Metres along the curve, backward segments counted like forward ones."""
        return math.fsum(np.abs(self.lengths_m).tolist())

    def poses(self, step_m: float) -> FloatArray:
        """Return poses along the curve, at most a step apart, including the endpoints of segments,
        each once.

        `step_m`: metres, positive. Returns float64 (n, 3), `(x, y, yaw)`, metres and radians; the
        yaw is not wrapped. Raises `InvalidValueError` when the step is not positive, or so small
        that there would be more than ten million poses.
        """
        if not step_m > 0 or self.length_m / step_m > _MAX_POSES:
            raise InvalidValueError(
                f"step must be a length in metres above 0 and not far below the curve's, "
                f"got {step_m} on {self.length_m:.3g} m"
            )
        segments = [np.array([self.start])]
        for kind, length_m in zip(self.kinds.tolist(), self.lengths_m.tolist(), strict=True):
            if abs(length_m) <= _NOTHING_M:
                continue
            count = math.ceil(abs(length_m) / step_m)
            along = length_m * np.arange(1, count + 1) / count
            segments.append(self._ahead(segments[-1][-1], kind, along))
        return np.concatenate(segments)

    def _ahead(self, pose: FloatArray, kind: int, along_m: FloatArray) -> FloatArray:
        """Return the poses at some metres along an arc or a straight line."""
        x, y, yaw = pose.tolist()
        if kind == 0:
            xs, ys = x + along_m * cos(yaw), y + along_m * sin(yaw)
            return np.stack([xs, ys, np.full(len(along_m), yaw)], axis=1)
        radius_m = kind * self.radius_m
        yaws = yaw + along_m / radius_m
        sines, cosines = sines_and_cosines(yaws)
        xs, ys = x + radius_m * (sines - sin(yaw)), y + radius_m * (cos(yaw) - cosines)
        return np.stack([xs, ys, yaws], axis=1)


def shortest_curve(start: Pose, goal: Pose, *, radius_m: float, reverses: bool) -> Curve:
    """Return the shortest curve between two poses of a vehicle with a turning radius.

    L. E. Dubins: On curves of minimal length with a constraint on average curvature, 1957;
    J. A. Reeds, L. A. Shepp: Optimal paths for a car that goes both forwards and backwards, 1990.

    Parameters
    ----------
    start, goal
        `(x, y, yaw)`, metres and radians.
    radius_m
        Turning radius, positive.
    reverses
        Whether the vehicle may go backwards too.

    Returns
    -------
    Curve
        As long as that of OMPL's `DubinsStateSpace` or `ReedsSheppStateSpace`; among equally long
        curves, OMPL may return another one.

    Raises
    ------
    InvalidValueError
        When a number is not finite, a heading beyond a million, or the radius not positive.

    Examples
    --------
    >>> from hybridnav.refine.curves import shortest_curve
    >>> round(shortest_curve((0, 0, 0), (0, 2, 3.14159265), radius_m=1, reverses=False).length_m, 6)
    3.141593
    """
    kinds, lengths_m = np.empty(5, dtype=np.int64), np.empty(5)
    # Integers would compile another version of the kernel.
    x0, y0, yaw0, x1, y1, yaw1 = map(float, (*start, *goal))
    n = shortest_word(x0, y0, yaw0, x1, y1, yaw1, float(radius_m), bool(reverses), kinds, lengths_m)
    if n == 0:
        raise InvalidValueError(
            f"no curve of radius {radius_m} m goes from {start} to {goal}: poses must be finite, "
            "headings up to a million, and the radius positive"
        )
    return Curve(start, kinds[:n], lengths_m[:n], radius_m)


_EQUAL_RAD = 1e-9
"""Drives whose headings differ by less are merged, if the robot can drive them as one; a turn that
differs by less from half a circle has no short way."""


def driven(check: MotionCheck, poses: FloatArray, *, reverses: bool = False) -> FloatArray:
    """Return the turns and drives of a robot that visits some poses, pose by pose.

    The robot drives straight from point to point, forwards if possible. At each point it turns from
    one drive's heading to the next one's, at the endpoints from or to the heading of the pose. The
    headings of the poses in between are left out: a robot that can turn to them can turn past them,
    one way round or the other.

    `poses`: float64 (n, 3), n >= 1, `(x, y, yaw)`, metres and radians, map frame; `reverses`:
    whether the robot may drive backwards too. Returns float64 (m, 3). From each pose to the next
    the robot either turns on the spot, the short way, or drives straight with one heading. Where it
    turns, a point occurs with the heading before and after, and with one half-way if it turns by
    half a circle or the long way round. Without rows if a motion between two of the poses is not
    valid.
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
