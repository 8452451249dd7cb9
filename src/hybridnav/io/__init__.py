"""Readers of ROS maps, MovingAI benchmarks, examples, rooms and closed areas; rooms out; models.

Names load on first use: rooms need scipy, models and closed areas numba, a map file neither.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
    from hybridnav.io.blocked import load_blocked
    from hybridnav.io.examples import example_map
    from hybridnav.io.maps import load_map
    from hybridnav.io.models import Model, load, save
    from hybridnav.io.movingai import Scenario, load_movingai_map, read_scenarios
    from hybridnav.io.rooms import load_rooms
    from hybridnav.io.rooms_out import save_rooms
    from hybridnav.io.ros import load_ros_map

__all__ = [
    "Model",
    "Scenario",
    "example_map",
    "load",
    "load_blocked",
    "load_map",
    "load_movingai_map",
    "load_rooms",
    "load_ros_map",
    "read_scenarios",
    "save",
    "save_rooms",
]

__getattr__ = on_first_use(
    __name__,
    {
        "Model": "models",
        "Scenario": "movingai",
        "example_map": "examples",
        "load": "models",
        "load_blocked": "blocked",
        "load_map": "maps",
        "load_movingai_map": "movingai",
        "load_rooms": "rooms",
        "load_ros_map": "ros",
        "read_scenarios": "movingai",
        "save": "models",
        "save_rooms": "rooms_out",
    },
)
