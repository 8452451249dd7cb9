"""A drive through a room, recorded in a bag: where the laser is, by complex numbers."""

import cmath
import math
from typing import Any

import numpy as np

from tests.ext.live.files.bag_writer import BagWriter

SECOND = 10**9
BEGAN = 1_700_000_000 * SECOND
BASE_TO_LASER = (0.2, 0.1, 0.3)
HALF_M = (4.0, 3.0)
"""Half the sides of a room round the origin of the map."""


def about_z(yaw: float) -> tuple[float, float, float, float]:
    return 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)


def base_at(seconds: float) -> tuple[complex, float]:
    """Pose of the robot in the frame odom: even motion, even turning."""
    return complex(-1 + 0.5 * seconds, 0.3 * seconds), 0.4 * seconds


ODOM = complex(0.5, -0.4), 0.25
"""Pose of odom in the map."""
LASER = complex(*BASE_TO_LASER[:2]), 0.7


def laser_at(seconds: float) -> tuple[complex, float]:
    """Pose of the laser in the map, by complex numbers."""
    place, yaw = base_at(seconds)
    place, yaw = place + LASER[0] * cmath.exp(1j * yaw), yaw + LASER[1]
    return ODOM[0] + place * cmath.exp(1j * ODOM[1]), yaw + ODOM[1]


def ranges_in_room(place: complex, angles: Any) -> Any:
    """Distance to the walls of the room in each direction."""
    direction = np.exp(1j * angles)
    with np.errstate(divide="ignore"):
        along_x = (np.sign(direction.real) * HALF_M[0] - place.real) / direction.real
        along_y = (np.sign(direction.imag) * HALF_M[1] - place.imag) / direction.imag
    return np.minimum(along_x, along_y)


def stamp(seconds: float) -> int:
    return BEGAN + round(seconds * SECOND)


def driven(kind: str, *, flipped: bool = False, odometry: bool = False) -> BagWriter:
    """Four seconds in the room: transforms ten times a second, scans in between."""
    bag = BagWriter(kind)
    place, yaw = LASER
    # Upside down: half a turn about the axis that the laser looks along.
    turn = (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0) if flipped else about_z(yaw)
    bag.add_tf("base", "laser", stamp(0), (place.real, place.imag, 0.3), turn, "/tf_static")
    for tenth in range(41):
        at = stamp(tenth / 10)
        place, yaw = base_at(tenth / 10)
        if odometry:
            bag.add_odometry(at, (place.real, place.imag, 0), about_z(yaw))
        else:
            bag.add_tf("odom", "base", at, (place.real, place.imag, 0), about_z(yaw))
        place, yaw = ODOM
        bag.add_tf("map", "odom", at, (place.real, place.imag, 0), about_z(yaw))
    for seconds in np.arange(0.05, 4, 0.1).tolist():
        place, heading = laser_at(seconds)
        angles = -math.pi + np.arange(90) * 2 * math.pi / 90
        side = -1 if flipped else 1
        bag.add_scan(stamp(seconds), ranges_in_room(place, heading + side * angles))
    return bag
