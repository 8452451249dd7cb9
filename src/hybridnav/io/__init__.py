"""Maps in: ROS maps, MovingAI benchmarks, examples, rooms, what is closed; rooms out; models."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from hybridnav.io.examples import example_map
from hybridnav.io.maps import load_map
from hybridnav.io.movingai import Scenario, load_movingai_map, read_scenarios
from hybridnav.io.rooms import load_rooms
from hybridnav.io.rooms_out import save_rooms
from hybridnav.io.ros import load_ros_map

if TYPE_CHECKING:
    from hybridnav.io.blocked import load_blocked
    from hybridnav.io.models import Model, load, save

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

_LATE = {"load_blocked": "blocked", "Model": "models", "load": "models", "save": "models"}
"""Names whose modules load numba."""


def __getattr__(name: str) -> Any:
    if name not in _LATE:
        raise AttributeError(f"module 'hybridnav.io' has no attribute {name!r}")
    return getattr(importlib.import_module(f"hybridnav.io.{_LATE[name]}"), name)
