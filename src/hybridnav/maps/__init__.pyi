from .cells import (
    DEFAULT_MAX_CELLS as DEFAULT_MAX_CELLS,
    DEFAULT_ROBOT_RADIUS_M as DEFAULT_ROBOT_RADIUS_M,
    MAX_CELLS as MAX_CELLS,
    CellClass as CellClass,
)
from .islands import DroppedIslands as DroppedIslands
from .frame import Frame as Frame
from .occupancy import OccupancyGrid as OccupancyGrid, drop_islands as drop_islands
from .one_way import OneWayRule as OneWayRule
from .room_labels import (
    MAX_ROOMS as MAX_ROOMS,
    NO_ROOM as NO_ROOM,
    RoomLabels as RoomLabels,
    RoomUse as RoomUse,
)
from .shapes import ShapeGrids as ShapeGrids, grids_of_shapes as grids_of_shapes
from .widest import Bottleneck as Bottleneck, WidestPaths as WidestPaths

__all__: list[str]
