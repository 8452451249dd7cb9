from .coarse import CoarseRoute as CoarseRoute, MaxDistanceSearch as MaxDistanceSearch
from .corridor import Corridor as Corridor, corridor_of as corridor_of
from .door_graph import DoorGraph as DoorGraph, DoorRoute as DoorRoute, door_graph as door_graph
from .route import Route as Route
from .route_finder import RouteFinder as RouteFinder

__all__: list[str]
