"""Routes over the places of the topological map, and paths over portals of other fields."""

from hybridnav.route.coarse import CoarseRoute, MaxDistanceSearch
from hybridnav.route.corridor import Corridor, corridor_of
from hybridnav.route.portal_search import BuiltPortals, PortalAnswers, PortalSearch
from hybridnav.route.rooms import RoomRoute, RoomSearch
from hybridnav.route.walk import Walks

__all__ = [
    "BuiltPortals",
    "CoarseRoute",
    "Corridor",
    "MaxDistanceSearch",
    "PortalAnswers",
    "PortalSearch",
    "RoomRoute",
    "RoomSearch",
    "Walks",
    "corridor_of",
]
