"""Occupancy grids: probabilities, frame, clearance, generated worlds."""

from hybridnav.grid.frame import Frame
from hybridnav.grid.occupancy import MAX_CELLS, CellClass, OccupancyGrid

__all__ = ["MAX_CELLS", "CellClass", "Frame", "OccupancyGrid"]
