"""Simulated sensors: the scans that a robot would take in a map."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.trig import cos, sin, sines_and_cosines
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.mapping.kernels import ray_lengths
from hybridnav.ext.live.mapping.models import MOST_RANGE_CELLS
from hybridnav.ext.live.mapping.scans import (
    MOST_READINGS,
    LaserScan,
    SonarScan,
    checked_array,
    checked_count,
    checked_number,
    sonar_ring,
)
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.checks import checked_type

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray


def _check(max_range_m: float, noise_m: float) -> None:
    far, noise = checked_number("max_range_m", max_range_m), checked_number("noise_m", noise_m)
    if not (math.isfinite(far) and far > 0):
        raise InvalidValueError(
            f"max_range_m is {max_range_m}, expected a finite number > 0: give metres"
        )
    if not (math.isfinite(noise) and noise >= 0):
        raise InvalidValueError(
            f"noise_m is {noise_m}, expected a finite length >= 0: give a deviation in metres"
        )


def _check_world(grid: OccupancyGrid, max_range_m: float) -> None:
    if max_range_m / checked_type("grid", grid, OccupancyGrid).resolution_m > MOST_RANGE_CELLS:
        raise InvalidValueError(
            f"a range of {max_range_m:g} m is more than {MOST_RANGE_CELLS} cells of "
            f"{grid.resolution_m:g} m: simulate a shorter one"
        )


def _ranges(
    grid: OccupancyGrid, place: tuple[float, float], angles_rad: FloatArray, max_range_m: float
) -> FloatArray:
    """Return the distance to the first occupied cell in each direction, infinite if there is none
    within the range."""
    side_m = grid.resolution_m
    start = grid.frame.position_of(*place)
    # Directions in the grid, which may be turned in the map frame.
    turned = angles_rad - grid.frame.yaw_rad
    reach = max_range_m / side_m
    sines, cosines = sines_and_cosines(turned)
    targets = np.stack([start[0] + reach * sines, start[1] + reach * cosines], axis=1)
    lengths: FloatArray = ray_lengths(grid.measured, int(CellClass.OCCUPIED), start, targets)
    return lengths * side_m


def in_sight(grid: OccupancyGrid, start: FloatArray, targets: FloatArray) -> BoolArray:
    """Return which targets no occupied cell hides from a start.

    Parameters
    ----------
    grid
        The map.
    start
        `(row, col)` in cells.
    targets
        float64 (n, 2), `(row, col)` in cells, within 2^14 cells of the start.

    Returns
    -------
    BoolArray
        bool (n,).
    """
    hidden: BoolArray = np.isfinite(
        ray_lengths(grid.measured, int(CellClass.OCCUPIED), start, targets)
    )
    return ~hidden


def _noisy(ranges_m: FloatArray, noise_m: float, seed: int | np.random.Generator) -> FloatArray:
    try:
        rng = np.random.default_rng(seed)
    except (TypeError, ValueError):
        raise InvalidValueError(
            f"seed is {seed!r:.80}, expected a whole number >= 0 or a generator: give one"
        ) from None
    if noise_m == 0:
        return ranges_m
    noisy: FloatArray = np.maximum(ranges_m + rng.normal(0.0, noise_m, ranges_m.shape), 0.0)
    return noisy


@dataclass(frozen=True)
class SimulatedLaser:
    """A laser that measures how far its beams run to the first occupied cell of a map.

    Unexplored cells, and what lies outside the map, do not stop a beam.

    Parameters
    ----------
    n_beams
        Number of beams, at least 1.
    start_rad, step_rad
        Direction of the first beam relative to the heading, and the angle to the next one. By
        default those of a SICK LMS: half a turn in steps of one degree.
    max_range_m
        Longer beams have no return.
    noise_m
        Standard deviation of readings, normally distributed.

    Raises
    ------
    InvalidValueError
        When a value is out of range.

    Examples
    --------
    >>> from hybridnav.ext.live.mapping import SimulatedLaser
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.0, 1.0]]), robot_radius_m=0)
    >>> scan = SimulatedLaser(n_beams=1, start_rad=0.0).scan(grid, (0.5, 0.5, 0.0))
    >>> scan.ranges_m.round(3)
    array([2.5])
    """

    n_beams: int = 181
    start_rad: float = -math.pi / 2
    step_rad: float = math.pi / 180
    max_range_m: float = 8.0
    noise_m: float = 0.0

    def __post_init__(self) -> None:
        _check(self.max_range_m, self.noise_m)
        checked_count("n_beams", self.n_beams, MOST_READINGS)
        for name in ("start_rad", "step_rad"):
            checked_number(name, getattr(self, name))

    def scan(
        self,
        grid: OccupancyGrid,
        pose: tuple[float, float, float],
        *,
        seed: int | np.random.Generator = 0,
        time_s: float = math.nan,
    ) -> LaserScan:
        """Return what the laser would measure.

        Parameters
        ----------
        grid
            The world.
        pose
            `(x, y, heading)` of the laser, metres and radians, map frame.
        seed
            Of the noise; a generator, for noise that differs from scan to scan.
        time_s
            When the scan is taken.

        Returns
        -------
        LaserScan
            The readings; infinite without a return.

        Raises
        ------
        InvalidValueError
            When the pose is not finite, or the range more than 2^14 cells.
        """
        _check_world(grid, self.max_range_m)
        shape = LaserScan(
            np.full(self.n_beams, math.inf), pose, self.start_rad, self.step_rad
        )  # checks the pose
        x_m, y_m, heading_rad = shape.pose
        angles = (
            heading_rad + self.start_rad + np.arange(self.n_beams, dtype=np.float64) * self.step_rad
        )
        ranges = _ranges(grid, (x_m, y_m), angles, self.max_range_m)
        ranges = _noisy(ranges, self.noise_m, seed)
        return LaserScan(
            ranges, shape.pose, self.start_rad, self.step_rad, self.max_range_m, time_s
        )


@dataclass(frozen=True, eq=False)
class SimulatedSonars:
    """Sonars that measure the distance to the nearest occupied cell in their cones.

    The cone is searched by rays that are at most a cell apart at the greatest range. Every surface
    returns an echo, at whatever angle it is met: the mirroring of smooth walls is not simulated.

    Parameters
    ----------
    mounts
        `(x, y, heading)` of each sonar on the robot, float64 (n, 3), metres and radians; by default
        the ring of the Nomad 200.
    half_angle_rad
        Half of a cone's opening.
    max_range_m
        Greatest range; beyond there is no echo.
    noise_m
        Standard deviation of readings, normally distributed.

    Raises
    ------
    InvalidValueError
        When a value is out of range.

    Examples
    --------
    >>> from hybridnav.ext.live.mapping import SimulatedSonars, sonar_ring
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.0, 1.0]]), robot_radius_m=0)
    >>> sonars = SimulatedSonars(sonar_ring(4, radius_m=0.0))
    >>> sonars.scan(grid, (0.5, 0.5, 0.0)).ranges_m.round(2)
    array([2.5, inf, inf, inf])
    """

    mounts: FloatArray = field(default_factory=sonar_ring, repr=False)
    half_angle_rad: float = math.radians(12.5)
    max_range_m: float = 6.477
    noise_m: float = 0.0

    def __post_init__(self) -> None:
        _check(self.max_range_m, self.noise_m)
        if not 0 <= checked_number("half_angle_rad", self.half_angle_rad) < math.pi / 2:
            raise InvalidValueError(
                f"half_angle_rad is {self.half_angle_rad}, expected an angle from 0 to pi / 2: "
                "give half of the cone's opening in radians"
            )

    def scan(
        self,
        grid: OccupancyGrid,
        pose: tuple[float, float, float],
        *,
        seed: int | np.random.Generator = 0,
        time_s: float = math.nan,
    ) -> SonarScan:
        """Return what the sonars would measure.

        Parameters
        ----------
        grid
            The world.
        pose
            `(x, y, heading)` of the robot, metres and radians, map frame.
        seed
            Of the noise; a generator, for noise that differs from scan to scan.
        time_s
            When the scan is taken.

        Returns
        -------
        SonarScan
            The readings; infinite without an echo.

        Raises
        ------
        InvalidValueError
            When the pose or a mount is not finite, or the range more than 2^14 cells.
        """
        _check_world(grid, self.max_range_m)
        mounts = np.atleast_1d(checked_array("mounts", self.mounts))
        shape = SonarScan(np.full(len(mounts), math.inf), pose, mounts)
        x_m, y_m, heading_rad = shape.pose
        cosine, sine = cos(heading_rad), sin(heading_rad)
        # Beside the ray on the axis.
        n_aside = math.ceil(self.half_angle_rad * self.max_range_m / grid.resolution_m)
        fan = np.linspace(-self.half_angle_rad, self.half_angle_rad, 2 * n_aside + 1)
        ranges = np.array(
            [
                _ranges(
                    grid,
                    (x_m + cosine * ahead - sine * aside, y_m + sine * ahead + cosine * aside),
                    heading_rad + turn + fan,
                    self.max_range_m,
                ).min()
                for ahead, aside, turn in shape.mounts.tolist()
            ]
        )
        ranges = _noisy(ranges, self.noise_m, seed)
        return SonarScan(ranges, shape.pose, shape.mounts, time_s)
