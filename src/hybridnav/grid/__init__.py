"""Occupancy grids: probabilities, frame, clearance, islands, rooms on cells, generated worlds.

Names load on first use: how many cells a grid may have is known without numpy.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from hybridnav.grid.limits import DEFAULT_MAX_CELLS, MAX_CELLS

if TYPE_CHECKING:
    from hybridnav.grid.frame import Frame
    from hybridnav.grid.islands import DroppedIslands, drop_islands
    from hybridnav.grid.occupancy import CellClass, OccupancyGrid
    from hybridnav.grid.rooms import MAX_ROOMS, NO_ROOM, RoomLabels

__all__ = [
    "DEFAULT_MAX_CELLS",
    "MAX_CELLS",
    "MAX_ROOMS",
    "NO_ROOM",
    "CellClass",
    "DroppedIslands",
    "Frame",
    "OccupancyGrid",
    "RoomLabels",
    "drop_islands",
]

_HOME_OF = {
    "CellClass": "occupancy",
    "DroppedIslands": "islands",
    "Frame": "frame",
    "MAX_ROOMS": "rooms",
    "NO_ROOM": "rooms",
    "OccupancyGrid": "occupancy",
    "RoomLabels": "rooms",
    "drop_islands": "islands",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'hybridnav.grid' has no attribute {name!r}")
    return getattr(importlib.import_module(f"hybridnav.grid.{_HOME_OF[name]}"), name)
