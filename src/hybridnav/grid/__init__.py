"""Occupancy grids: probabilities, frame, clearance, rooms on cells, generated worlds."""

from hybridnav.grid.frame import Frame
from hybridnav.grid.occupancy import MAX_CELLS, CellClass, OccupancyGrid
from hybridnav.grid.rooms import MAX_ROOMS, NO_ROOM, RoomLabels

__all__ = ["MAX_CELLS", "MAX_ROOMS", "NO_ROOM", "CellClass", "Frame", "OccupancyGrid", "RoomLabels"]
