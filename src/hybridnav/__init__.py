"""Robot routes on two maps: an occupancy grid and the topological map grown out of it.

Names load on first use: `import hybridnav` itself imports neither numba nor matplotlib.
"""

from __future__ import annotations

import importlib
import logging
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hybridnav.config import Preset, load_preset, preset_names
    from hybridnav.errors import (
        CacheWarning,
        HybridNavError,
        InvalidValueError,
        MapError,
        MapNotFoundError,
        MapWarning,
        ModelError,
        OmplError,
        PlanError,
        PresetError,
        PresetNotFoundError,
        RoomsError,
        RoomsNotFoundError,
    )
    from hybridnav.grid import (
        CellClass,
        DroppedIslands,
        Frame,
        OccupancyGrid,
        RoomLabels,
        drop_islands,
    )
    from hybridnav.io import (
        Model,
        example_map,
        load,
        load_blocked,
        load_map,
        load_rooms,
        save,
        save_rooms,
    )
    from hybridnav.planner import (
        Alternative,
        Alternatives,
        Blocked,
        HybridPlanner,
        Tour,
        plan_alternatives,
        plan_tour,
    )
    from hybridnav.pyramid import DualGraphPyramid, Level, LevelArc
    from hybridnav.result import Path, PlanBatch, PlanResult, PlanStatus, Route
    from hybridnav.topology import Door, Rooms, TopologicalMap, find_rooms

__version__ = "0.1.0"

_HOME_OF = {
    "Alternative": "planner",
    "Alternatives": "planner",
    "Blocked": "planner",
    "CacheWarning": "errors",
    "CellClass": "grid",
    "Door": "topology",
    "DroppedIslands": "grid",
    "DualGraphPyramid": "pyramid",
    "Frame": "grid",
    "HybridNavError": "errors",
    "HybridPlanner": "planner",
    "InvalidValueError": "errors",
    "Level": "pyramid",
    "LevelArc": "pyramid",
    "MapError": "errors",
    "MapNotFoundError": "errors",
    "MapWarning": "errors",
    "Model": "io",
    "ModelError": "errors",
    "OccupancyGrid": "grid",
    "OmplError": "errors",
    "Path": "result",
    "PlanBatch": "result",
    "PlanError": "errors",
    "PlanResult": "result",
    "PlanStatus": "result",
    "Preset": "config",
    "PresetError": "errors",
    "PresetNotFoundError": "errors",
    "RoomLabels": "grid",
    "Rooms": "topology",
    "RoomsError": "errors",
    "RoomsNotFoundError": "errors",
    "Route": "result",
    "TopologicalMap": "topology",
    "Tour": "planner",
    "drop_islands": "grid",
    "example_map": "io",
    "find_rooms": "topology",
    "load": "io",
    "load_blocked": "io",
    "load_map": "io",
    "load_preset": "config",
    "load_rooms": "io",
    "plan_alternatives": "planner",
    "plan_tour": "planner",
    "preset_names": "config",
    "save": "io",
    "save_rooms": "io",
}

__all__ = [
    "Alternative",
    "Alternatives",
    "Blocked",
    "CacheWarning",
    "CellClass",
    "Door",
    "DroppedIslands",
    "DualGraphPyramid",
    "Frame",
    "HybridNavError",
    "HybridPlanner",
    "InvalidValueError",
    "Level",
    "LevelArc",
    "MapError",
    "MapNotFoundError",
    "MapWarning",
    "Model",
    "ModelError",
    "OccupancyGrid",
    "OmplError",
    "Path",
    "PlanBatch",
    "PlanError",
    "PlanResult",
    "PlanStatus",
    "Preset",
    "PresetError",
    "PresetNotFoundError",
    "RoomLabels",
    "Rooms",
    "RoomsError",
    "RoomsNotFoundError",
    "Route",
    "TopologicalMap",
    "Tour",
    "drop_islands",
    "example_map",
    "find_rooms",
    "load",
    "load_blocked",
    "load_map",
    "load_preset",
    "load_rooms",
    "plan_alternatives",
    "plan_tour",
    "preset_names",
    "save",
    "save_rooms",
]

logging.getLogger(__name__).addHandler(logging.NullHandler())


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'hybridnav' has no attribute {name!r}")
    return getattr(importlib.import_module(f"hybridnav.{_HOME_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
