"""Check of the robot's radius, which map and preset both state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from hybridnav.config import Preset
    from hybridnav.grid import OccupancyGrid


def check_radius(grid: OccupancyGrid, preset: Preset) -> None:
    """Refuse a map of the default radius with a preset for another radius.

    A radius that the caller chose for the map wins over the preset's, and results record it.

    Raises
    ------
    InvalidValueError
        When the map has the default radius, not chosen by the caller, and the preset names another.
    """
    wanted_m, radius_m = preset.pyramid.robot_radius_m, grid.robot_radius_m
    if grid.radius_is_default and wanted_m != radius_m:
        raise InvalidValueError(
            f"preset {preset.name} is for a robot radius of {wanted_m} m, the map was made with "
            f"the default of {radius_m} m: make it with robot_radius_m={wanted_m}, or with "
            f"robot_radius_m={radius_m} if that is meant"
        )
