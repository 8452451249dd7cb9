"""Inverse sensor models: how probable a reading makes it that a cell is occupied.

References
----------
H. Moravec, A. Elfes: High resolution maps from wide angle sonar, 1985: profiles of a sonar's cone.
A. Elfes: Using occupancy grids for mobile robot perception and navigation, 1989: Bayes' rule for
cells. K. Konolige: Improved occupancy grids for map building, 1997: log odds, and readings that
must not count many times. S. Thrun, W. Burgard, D. Fox: Probabilistic Robotics, 2005, chapter 9:
the inverse model of a beam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hybridnav._base.trig import log
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.mapping.scans import checked_number
from hybridnav.maps.checks import checked_type

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

    A beam occupies the cell in which it ends, or one `depth_m` farther, and frees the other cells
    whose inside it passes before it comes within a tolerance of its end. One scan counts once for
    each cell, however many beams meet it: readings are far from independent where beams are dense,
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


@dataclass(frozen=True)
class SonarModel:
    """Inverse model of a sonar's cone, with the profiles of Moravec and Elfes (1985).

    For a reading R, a cell whose centre lies at distance r and at the angle a off the axis has

    * `r < R - e`: the probability 0.5 - (0.5 - when_passed) E, with
      E = (1 - ((r - min_range) / (R - e - min_range))^2) (1 - (a / half_angle)^2);
    * `R - e <= r <= R + e`: 0.5 + (when_hit - 0.5) O, with
      O = (1 - ((r - R) / e)^2) (1 - (a / half_angle)^2);

    and other cells stay as they are. Each sonar's reading counts by itself, by Bayes' rule (Elfes
    1989): so the free cone of a neighbour clears a part of the arc on which an echo may lie.

    Parameters
    ----------
    when_hit, when_passed
        The greatest and the least probability that one reading yields, on the axis.
    half_angle_rad
        Half of the cone's opening; the default is that of Polaroid's sonars, 12.5 degrees.
    tolerance_m
        e, by which echoes are uncertain.
    max_range_m
        Readings of that length or more have no echo: the cone up to that length is free. The
        default is that of the Nomad 200, 255 inches.
    min_range_m
        What the sonar cannot measure: cells nearer than that stay, and readings of that length or
        less are none.

    Raises
    ------
    InvalidValueError
        When a probability, a length or the angle is out of range.

    Examples
    --------
    >>> from hybridnav.ext.live.mapping import SonarModel
    >>> SonarModel(max_range_m=3.0).max_range_m
    3.0
    """

    when_hit: float = 0.7
    when_passed: float = 0.3
    half_angle_rad: float = math.radians(12.5)
    tolerance_m: float = 0.1
    max_range_m: float = 6.477
    min_range_m: float = 0.15

    def __post_init__(self) -> None:
        _check_probabilities(self.when_hit, self.when_passed)
        _check_lengths(
            tolerance_m=self.tolerance_m,
            max_range_m=self.max_range_m,
            min_range_m=self.min_range_m,
        )
        if not 0 < checked_number("half_angle_rad", self.half_angle_rad) < math.pi / 2:
            raise InvalidValueError(
                f"half_angle_rad is {self.half_angle_rad}, expected an angle within 0 and pi / 2: "
                "give half of the cone's opening in radians"
            )
        if not (self.tolerance_m > 0 and self.min_range_m < self.max_range_m):
            raise InvalidValueError(
                f"tolerance_m is {self.tolerance_m}, min_range_m {self.min_range_m} and "
                f"max_range_m {self.max_range_m}, expected a tolerance > 0 and the "
                "least range below the greatest: give lengths in metres"
            )
