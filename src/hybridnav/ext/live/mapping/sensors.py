"""Models of sensors, inverse and simulated."""

import math
from dataclasses import dataclass

import numpy as np

from hybridnav._base.trig import log, sines_and_cosines
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.mapping.kernels import ray_lengths
from hybridnav.ext.live.mapping.scans import MOST_READINGS, LaserScan, checked_number
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.checks import checked_type, checked_whole

MOST_RANGE_CELLS = 2**14
"""Cells of a beam that are walked exactly in int64."""


def log_odds_of(probability: float) -> float:
    """Return the log odds of a probability within (0, 1)."""
    return log(probability / (1.0 - probability))


def _check_probabilities(when_hit: float, when_passed: float) -> None:
    least = checked_number("when_passed", when_passed)
    if not 0 < least < 0.5 < checked_number("when_hit", when_hit) < 1:  # noqa: PLR2004 - the prior
        raise InvalidValueError(
            f"when_passed is {when_passed} and when_hit {when_hit}, expected 0 < when_passed < 0.5 "
            "< when_hit < 1: give probabilities on both sides of 0.5, the prior of a cell"
        )


def _check_lengths(**lengths_m: float) -> None:
    for name, length_m in lengths_m.items():
        if not 0 <= checked_number(name, length_m) < math.inf:
            raise InvalidValueError(
                f"{name} is {length_m}, expected a finite length >= 0: give it in metres"
            )


@dataclass(frozen=True)
class LaserModel:
    """Inverse model of laser beams without width (Thrun, Burgard, Fox 2005, section 9.2).

    A beam occupies the cell in which it ends, or one `depth_m` farther. It frees the other cells
    whose inside it passes before it comes within a tolerance of its end. One scan counts once for
    each cell, however many beams meet it. Readings are far from independent where beams are dense,
    near the laser and along walls that they graze (Konolige 1997).

    Parameters
    ----------
    when_hit, when_passed
        Probability that a cell is occupied after one scan in which a beam ended in it, and after
        one that passed it. A hit counts twice as much as a pass by default, and one pass makes a
        cell free at the default thresholds of maps.
    max_range_m
        Readings of that length or more have no return: they are no obstacles. The default is the
        range at which a SICK LMS 200 sees a surface of 10 % reflectivity.
    min_range_m
        Readings of that length or less are none: errors, dust, or parts of the robot.
    clear_range_m
        Length to which a beam without a return frees cells. 0, the default, leaves them: on real
        robots such beams have also met black, mirroring or transparent surfaces.
    tolerance_m
        Distance before the end of a beam that it leaves as it was: half the thickness of obstacles
        in the model of Thrun, Burgard and Fox. It keeps walls that beams graze.
    depth_m
        Distance behind the end of a beam, on its line, at which it occupies a cell. 0, the default,
        occupies the cell in which it ends. With noise, readings of a wall end on either side of
        its surface; three standard deviations put nearly all of them behind it.
    hits_win
        Whether a cell that one beam of a scan occupies and another one passes is occupied by the
        scan, or freed. True, the default, keeps walls where poses are off: without it, maps of
        robots' logs have 1.4 to 6 times as many wrong cells. False suits exact poses and readings
        whose noise is known: beams that cut a corner, or end before a wall, then close no narrow
        door.

    Raises
    ------
    InvalidValueError
        When a probability or a length is out of range.

    Examples
    --------
    >>> from hybridnav.ext.live.mapping import LaserModel
    >>> LaserModel(max_range_m=8.0).max_range_m
    8.0
    """

    when_hit: float = 0.95
    when_passed: float = 0.19
    max_range_m: float = 30.0
    min_range_m: float = 0.0
    clear_range_m: float = 0.0
    tolerance_m: float = 0.1
    depth_m: float = 0.0
    hits_win: bool = True

    def __post_init__(self) -> None:
        _check_probabilities(self.when_hit, self.when_passed)
        _check_lengths(
            max_range_m=self.max_range_m,
            min_range_m=self.min_range_m,
            clear_range_m=self.clear_range_m,
            tolerance_m=self.tolerance_m,
            depth_m=self.depth_m,
        )
        checked_type("hits_win", self.hits_win, bool)
        if not self.min_range_m < self.max_range_m or self.clear_range_m > self.max_range_m:
            raise InvalidValueError(
                f"min_range_m is {self.min_range_m}, clear_range_m {self.clear_range_m} and "
                f"max_range_m {self.max_range_m}, expected the least below and the clearing range "
                "not above the greatest: give ranges in that order"
            )


# Simulated sensors: the scans that a robot would take in a map.


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
    """Return which targets no occupied cell hides from a start, bool (n,).

    Both are `(row, col)` in cells; targets, float64 (n, 2), lie within 2^14 cells of the start.
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
    return np.maximum(ranges_m + rng.normal(0.0, noise_m, ranges_m.shape), 0.0)


@dataclass(frozen=True)
class SimulatedLaser:
    """A laser that measures how far its beams run to the first occupied cell of a map.

    Unexplored cells, and the ground outside the map, do not stop a beam.

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
        far_m = self.max_range_m
        if not 0 < checked_number("max_range_m", far_m) < math.inf:
            raise InvalidValueError(
                f"max_range_m is {far_m}, expected a finite number > 0: give metres"
            )
        _check_lengths(noise_m=self.noise_m)
        checked_whole("n_beams", self.n_beams, 1, MOST_READINGS)
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
        """Return the readings of the laser.

        Parameters
        ----------
        grid
            The world.
        pose
            `(x, y, heading)` of the laser, metres and radians, map frame.
        seed
            Seed of the noise; a generator, for noise that differs from scan to scan.
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
        far_m = self.max_range_m
        if far_m / checked_type("grid", grid, OccupancyGrid).resolution_m > MOST_RANGE_CELLS:
            raise InvalidValueError(
                f"a range of {far_m:g} m is more than {MOST_RANGE_CELLS} cells of "
                f"{grid.resolution_m:g} m: simulate a shorter one"
            )
        angles = self.start_rad, self.step_rad
        shape = LaserScan(np.full(self.n_beams, math.inf), pose, *angles)  # checks the pose
        x_m, y_m, heading_rad = shape.pose
        turns = heading_rad + self.start_rad + np.arange(float(self.n_beams)) * self.step_rad
        ranges = _noisy(_ranges(grid, (x_m, y_m), turns, far_m), self.noise_m, seed)
        return LaserScan(ranges, shape.pose, *angles, far_m, time_s)
