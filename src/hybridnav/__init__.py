"""Robot routes planned on two maps at once: an occupancy grid and the topological map grown on it.

Names load on first use: `import hybridnav` itself imports neither numba nor matplotlib.
"""

from __future__ import annotations

import importlib
import logging
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hybridnav.config import Preset, load_preset, preset_names
    from hybridnav.errors import (
        HybridNavError,
        InvalidValueError,
        MapError,
        MapNotFoundError,
        MapWarning,
        OmplError,
        PlanError,
        PresetError,
        PresetNotFoundError,
    )
    from hybridnav.grid import CellClass, Frame, OccupancyGrid
    from hybridnav.io import load_map
    from hybridnav.planner import Blocked, HybridPlanner
    from hybridnav.pyramid import DualGraphPyramid, Level
    from hybridnav.result import Path, PlanBatch, PlanResult, PlanStatus, Route
    from hybridnav.topology import TopologicalMap

__version__ = "0.1.0"

_HOME_OF = {
    "Blocked": "planner",
    "CellClass": "grid",
    "DualGraphPyramid": "pyramid",
    "Frame": "grid",
    "HybridNavError": "errors",
    "HybridPlanner": "planner",
    "InvalidValueError": "errors",
    "Level": "pyramid",
    "MapError": "errors",
    "MapNotFoundError": "errors",
    "MapWarning": "errors",
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
    "Route": "result",
    "TopologicalMap": "topology",
    "load_map": "io",
    "load_preset": "config",
    "preset_names": "config",
}

__all__ = [
    "Blocked",
    "CellClass",
    "DualGraphPyramid",
    "Frame",
    "HybridNavError",
    "HybridPlanner",
    "InvalidValueError",
    "Level",
    "MapError",
    "MapNotFoundError",
    "MapWarning",
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
    "Route",
    "TopologicalMap",
    "load_map",
    "load_preset",
    "preset_names",
]

logging.getLogger(__name__).addHandler(logging.NullHandler())


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'hybridnav' has no attribute {name!r}")
    return getattr(importlib.import_module(f"hybridnav.{_HOME_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
