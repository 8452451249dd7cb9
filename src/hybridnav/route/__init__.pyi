from .coarse import CoarseRoute as CoarseRoute, MaxDistanceSearch as MaxDistanceSearch
from .corridor import Corridor as Corridor, corridor_of as corridor_of
from .room_search import RoomRoute as RoomRoute, RoomSearch as RoomSearch
from .route_finder import RouteFinder as RouteFinder

__all__: list[str]
