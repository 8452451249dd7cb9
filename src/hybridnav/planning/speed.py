"""Speeds along a path: the profile by which a robot with limits arrives first."""

import math
from dataclasses import dataclass, fields

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.poses import BEND, Spread, wrapped
from hybridnav._base.trig import directions
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, SignArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps.checks import checked_type
from hybridnav.maps.frame import Frame
from hybridnav.maps.geometry import least_along
from hybridnav.planning.settings import LimitSettings

_DEFAULTS = LimitSettings()


@dataclass(frozen=True)
class MotionLimits:
    """Limits of a robot's motion, each finite and above 0.

    The defaults are those of the velocity smoother in Nav2's bringup; it has none of the lateral
    acceleration.

    Raises
    ------
    InvalidValueError
        When a limit is no finite number above 0.

    Examples
    --------
    >>> from hybridnav.planning import MotionLimits
    >>> MotionLimits(max_speed_m_s=0.26).max_turning_rate_rad_s
    2.0
    """

    max_speed_m_s: float = _DEFAULTS.max_speed_m_s
    """Speed ahead and backwards, m / s."""
    max_acceleration_m_s2: float = _DEFAULTS.max_acceleration_m_s2
    """Gain of speed, m / s^2."""
    max_deceleration_m_s2: float = _DEFAULTS.max_deceleration_m_s2
    """Loss of speed when braking, m / s^2."""
    max_lateral_acceleration_m_s2: float = _DEFAULTS.max_lateral_acceleration_m_s2
    """Speed^2 * curvature on arcs, m / s^2."""
    max_turning_rate_rad_s: float = _DEFAULTS.max_turning_rate_rad_s
    """Turn of the heading, on the spot and on the way, rad / s."""
    max_angular_acceleration_rad_s2: float = _DEFAULTS.max_angular_acceleration_rad_s2
    """Change of the turning rate in turns on the spot, rad / s^2; on the way it is not limited,
    as the curvature jumps where a line meets an arc."""

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
            if not (is_number and 0 < value < math.inf):
                raise InvalidValueError(
                    f"{each.name} must be a finite number above 0, got {brief(value)}"
                )
            object.__setattr__(self, each.name, float(value))


@copies_alike
@dataclass(frozen=True, eq=False)
class SpeedMap:
    """Speed limits of the cells of a map, as a speed filter mask of Nav2 sets them.

    Raises
    ------
    InvalidValueError
        When the limits are no numbers above 0 in rows and columns.

    Examples
    --------
    The layer of a speed mask holds full speed / limit for each cell:

    >>> from hybridnav.planning import SpeedMap
    >>> grid = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
    >>> layer = hn.CostLayer.speed_mask(grid, [[0, 50, 75]])  # per cent below full speed
    >>> zones = SpeedMap(0.5 / layer.factors, grid.frame)
    >>> zones.least_along(np.array([(0.5, 0.5), (0.9, 0.5), (1.5, 0.5)]))
    array([0.5 , 0.25])
    """

    limits_m_s: AnyArray
    """float64 (rows, cols), m / s, row 0 at the lowest y; infinite for no limit."""
    frame: Frame
    """Place of the cells in the map frame; outside of them there is no limit."""

    def __post_init__(self) -> None:
        checked_type("frame", self.frame, Frame)
        try:
            limits = np.array(self.limits_m_s, dtype=np.float64)
        except (TypeError, ValueError):
            limits = np.zeros(0)
        if limits.ndim != 2 or not (limits > 0).all():  # noqa: PLR2004
            raise InvalidValueError(
                "speed limits must be numbers above 0 in m/s, of shape (rows, cols), "
                f"got {brief(self.limits_m_s)}"
            )
        object.__setattr__(self, "limits_m_s", frozen(limits))

    def least_along(self, points: FloatArray) -> FloatArray:
        """Return the least limit of the cells that each segment of a polyline touches.

        Parameters
        ----------
        points
            float64 (n, 2), n >= 1, `(x, y)` in metres, map frame.

        Returns
        -------
        FloatArray
            float64 (n - 1,), m / s. On the line between two cells both count.
        """
        positions = np.ascontiguousarray(self.frame.positions_of(points))
        return least_along(self.limits_m_s, positions)


@copies_alike
@dataclass(frozen=True, eq=False)
class SpeedProfile:
    """Poses along a path, with the speed and the time at each.

    A step from a pose to the next is a drive or a turn on the spot. Two poses at one point are a
    turn on the spot, also where straight lines without headings bend.

    Examples
    --------
    >>> from hybridnav.planning import MotionLimits
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> path = hn.HybridPlanner(topology).plan((0.5, 0.5), (1.5, 0.5)).path
    >>> profile = path.profile(MotionLimits(), spacing_m=0.25)
    >>> profile.speed_m_s, profile.time_s
    (array([0. , 0.5, 0.5, 0.5, 0. ]), array([0. , 0.6, 1.1, 1.6, 2.2]))
    """

    poses: FloatArray
    """float64 (n, 3), `(x, y, yaw)`, metres and radians in [-pi, pi), map frame."""
    directions: SignArray
    """int8 (n,), as `Path.directions`."""
    along_m: FloatArray
    """float64 (n,), metres driven before each pose."""
    curvature_per_m: FloatArray
    """float64 (n,), turn of the heading in a metre of the step after each pose, rad / m, positive
    to the left. The last pose has that of the step before it; turns on the spot have 0."""
    speed_m_s: FloatArray
    """float64 (n,), m / s, >= 0 backwards too; 0 at both ends, turns on the spot, kinks and
    reversals."""
    time_s: FloatArray
    """float64 (n,), seconds from the start to each pose."""

    @property
    def duration_s(self) -> float:
        """Seconds from the first pose to the last one."""
        return float(self.time_s[-1])


def profile_of(
    driven: Spread, limits: MotionLimits, speed_map: SpeedMap | None, *, is_curved: bool
) -> SpeedProfile:
    """Return the time-optimal speeds along poses, as `Path.profile` does.

    `driven`: the poses, two at each turn on the spot, and the steps between them, each of one
    curvature; `is_curved`: whether these are arcs, tangent to the headings; else straight lines.

    Notes
    -----
    J. E. Bobrow, S. Dubowsky, J. S. Gibson: Time-optimal control of robotic manipulators along
    specified paths, 1985. With limits of the acceleration that do not depend on the speed, the
    square z of the speed is the greatest function of the distance that is nowhere above its limit,
    rises by at most 2 a in a metre and falls by at most 2 d: a pass forward and one backward.
    Between two poses it is exact too: the robot accelerates, keeps the limit and brakes.
    """
    checked_type("limits", limits, MotionLimits)
    poses, lengths = driven.poses, driven.lengths_m
    moves = lengths > 0
    curvature = np.divide(driven.turns_rad, lengths, out=np.zeros_like(lengths), where=moves)
    most = _most_squares(curvature, limits, is_curved=is_curved)
    if speed_map is not None:
        zone = checked_type("speed_map", speed_map, SpeedMap).least_along(poses[:, :2])
        most = np.minimum(most, zone * zone)
    rise, fall = 2 * limits.max_acceleration_m_s2, 2 * limits.max_deceleration_m_s2
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    square = np.zeros(len(poses))
    square[1:-1] = np.where(_stands(driven, is_curved), 0.0, np.minimum(most[:-1], most[1:]))
    square = _slowly_rising(square, along, rise)
    square = _slowly_rising(square[::-1], along[-1] - along[::-1], fall)[::-1]
    seconds = np.where(
        moves,
        _drive_seconds(square, lengths, most, (rise, fall)),
        _spot_seconds(np.abs(driven.turns_rad), limits),
    )
    return SpeedProfile(
        frozen(poses),
        frozen(driven.directions),
        frozen(along),
        frozen(np.append(curvature, curvature[-1:] if len(curvature) else 0.0)),
        frozen(np.sqrt(square)),
        frozen(np.concatenate([[0.0], np.cumsum(seconds)])),
    )


def _most_squares(curvature: FloatArray, limits: MotionLimits, *, is_curved: bool) -> FloatArray:
    """Return the greatest square of the speed on each step, by its curvature."""
    most: FloatArray = np.full(len(curvature), limits.max_speed_m_s * limits.max_speed_m_s)
    bent = np.abs(curvature)
    with np.errstate(divide="ignore", over="ignore"):
        by_rate = limits.max_turning_rate_rad_s / bent
        most = np.minimum(most, by_rate * by_rate)
        if is_curved:
            most = np.minimum(most, limits.max_lateral_acceleration_m_s2 / bent)
    return most


def _stands(driven: Spread, is_curved: bool) -> BoolArray:  # noqa: FBT001 - a fact of the path
    """Return whether the robot stops at each inner pose.

    It does so for turns on the spot and reversals, and where straight lines meet at an angle.
    """
    moves = driven.lengths_m > 0
    stops: BoolArray = ~moves[:-1] | ~moves[1:]
    if is_curved:
        ahead = driven.directions[:-1]
        stops |= ahead[1:] != ahead[:-1]
        return stops
    steps = np.diff(driven.poses[:, :2], axis=0)
    turn = wrapped(np.diff(directions(steps[:, 1], steps[:, 0])))
    stops |= np.abs(turn) > BEND
    return stops


def _slowly_rising(most: FloatArray, along: FloatArray, rise: float) -> FloatArray:
    """Return the greatest values below others that rise by at most so much in a metre.

    Each of the others bounds all behind it, by the rise between: without that rise, which all have
    in common, the bound is the least value so far.
    """
    risen = rise * along
    bound = risen + np.minimum.accumulate(most - risen)
    return np.clip(bound, 0.0, most)


def _drive_seconds(
    square: FloatArray, lengths: FloatArray, most: FloatArray, rates: tuple[float, float]
) -> FloatArray:
    """Return the seconds of each step, driven as fast as its ends and its limit allow."""
    rise, fall = rates
    first, last = square[:-1], square[1:]
    peak = (rise * fall * lengths + fall * first + rise * last) / (rise + fall)
    peak = np.maximum(np.minimum(peak, most), np.maximum(first, last))
    level = lengths - (peak - first) / rise - (peak - last) / fall
    top = np.sqrt(peak)
    change = 2 * (top - np.sqrt(first)) / rise + 2 * (top - np.sqrt(last)) / fall
    kept = np.divide(np.maximum(level, 0.0), top, out=np.zeros_like(top), where=top > 0)
    return change + kept


def _spot_seconds(angles_rad: FloatArray, limits: MotionLimits) -> FloatArray:
    """Return the seconds of turns on the spot: the rate rises, stays and falls as a trapezoid."""
    rate, gain = limits.max_turning_rate_rad_s, limits.max_angular_acceleration_rad_s2
    short = angles_rad * gain < rate * rate
    return np.where(short, 2 * np.sqrt(angles_rad / gain), angles_rad / rate + rate / gain)
