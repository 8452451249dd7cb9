from .coarse import CoarseRoute as CoarseRoute, MaxDistanceSearch as MaxDistanceSearch
from .corridor import Corridor as Corridor, corridor_of as corridor_of
from .rooms import RoomRoute as RoomRoute, RoomSearch as RoomSearch
from .walk import Walks as Walks

__all__: list[str]
