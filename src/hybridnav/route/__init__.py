"""Routes over the places and the rooms of the topological map, and their corridors.

Names load on first use: a preset plans on one of them.
"""

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
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

__getattr__ = on_first_use(
    __name__,
    {
        "CoarseRoute": "coarse",
        "Corridor": "corridor",
        "MaxDistanceSearch": "coarse",
        "RoomRoute": "rooms",
        "RoomSearch": "rooms",
        "Walks": "walk",
        "corridor_of": "corridor",
    },
)
