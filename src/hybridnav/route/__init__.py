"""Routes over the places of the topological map, and paths over portals of other fields.

Names load on first use: a preset plans on one of them.
"""

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
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

__getattr__ = on_first_use(
    __name__,
    {
        "BuiltPortals": "portal_search",
        "CoarseRoute": "coarse",
        "Corridor": "corridor",
        "MaxDistanceSearch": "coarse",
        "PortalAnswers": "portal_search",
        "PortalSearch": "portal_search",
        "RoomRoute": "rooms",
        "RoomSearch": "rooms",
        "Walks": "walk",
        "corridor_of": "corridor",
    },
)
