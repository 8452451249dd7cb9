"""Routes over the places and the rooms of the topological map, and their corridors."""

from hybridnav.route.coarse import CoarseRoute, MaxDistanceSearch
from hybridnav.route.corridor import Corridor, corridor_of
from hybridnav.route.rooms import RoomRoute, RoomSearch
from hybridnav.route.walk import Walks

__all__ = [
    "CoarseRoute",
    "Corridor",
    "MaxDistanceSearch",
    "RoomRoute",
    "RoomSearch",
    "Walks",
    "corridor_of",
]
