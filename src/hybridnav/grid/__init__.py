"""Occupancy grids: probabilities, frame, clearance, islands, rooms on cells, generated worlds."""

from hybridnav.grid.frame import Frame
from hybridnav.grid.islands import DroppedIslands, drop_islands
from hybridnav.grid.occupancy import DEFAULT_MAX_CELLS, MAX_CELLS, CellClass, OccupancyGrid
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
