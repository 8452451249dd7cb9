from .coarse import (
    CoarseRoute as CoarseRoute,
    MaxDistanceSearch as MaxDistanceSearch,
    corridor_of as corridor_of,
)
from .route import Corridor as Corridor, Route as Route, RouteFinder as RouteFinder
from .door_graph import DoorGraph as DoorGraph, DoorRoute as DoorRoute, door_graph as door_graph

__all__: list[str]
