"""Maps in: ROS maps, MovingAI benchmarks, examples, rooms, what is closed; and rooms out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hybridnav.io.examples import example_map
from hybridnav.io.maps import load_map
from hybridnav.io.movingai import Scenario, load_movingai_map, read_scenarios
from hybridnav.io.rooms import load_rooms
from hybridnav.io.rooms_out import save_rooms
from hybridnav.io.ros import load_ros_map

if TYPE_CHECKING:
    from hybridnav.io.blocked import load_blocked

__all__ = [
    "Scenario",
    "example_map",
    "load_blocked",
    "load_map",
    "load_movingai_map",
    "load_rooms",
    "load_ros_map",
    "read_scenarios",
    "save_rooms",
]


def __getattr__(name: str) -> Any:
    if name != "load_blocked":
        raise AttributeError(f"module 'hybridnav.io' has no attribute {name!r}")
    from hybridnav.io.blocked import load_blocked  # noqa: PLC0415 - loads numba

    return load_blocked
