"""Occupancy grids: probabilities, frame, clearance, islands, rooms on cells, generated worlds.

Names load on first use: how many cells a grid may have is known without numpy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use
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

__getattr__ = on_first_use(
    __name__,
    {
        "CellClass": "occupancy",
        "DroppedIslands": "islands",
        "Frame": "frame",
        "MAX_ROOMS": "rooms",
        "NO_ROOM": "rooms",
        "OccupancyGrid": "occupancy",
        "RoomLabels": "rooms",
        "drop_islands": "islands",
    },
)
