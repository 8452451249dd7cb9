from .runs import CellClass as CellClass
from .frame import Frame as Frame
from .runs import DroppedIslands as DroppedIslands
from .limits import DEFAULT_MAX_CELLS as DEFAULT_MAX_CELLS, MAX_CELLS as MAX_CELLS
from .occupancy import OccupancyGrid as OccupancyGrid, drop_islands as drop_islands
from .names import MAX_ROOMS as MAX_ROOMS, NO_ROOM as NO_ROOM, RoomLabels as RoomLabels

__all__: list[str]
