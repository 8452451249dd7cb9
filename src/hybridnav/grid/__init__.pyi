from .frame import Frame as Frame
from .islands import DroppedIslands as DroppedIslands, drop_islands as drop_islands
from .limits import DEFAULT_MAX_CELLS as DEFAULT_MAX_CELLS, MAX_CELLS as MAX_CELLS
from .occupancy import CellClass as CellClass, OccupancyGrid as OccupancyGrid
from .rooms import MAX_ROOMS as MAX_ROOMS, NO_ROOM as NO_ROOM, RoomLabels as RoomLabels

__all__: list[str]
