"""The topological map: places and boundaries, rooms and doors.

Names load on first use: few maps have rooms, and to find them takes scipy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
    from hybridnav.topology.map import Component, Obstacle, TopologicalMap
    from hybridnav.topology.rooms import Door, Rooms
    from hybridnav.topology.segmentation import find_rooms

__all__ = [
    "Component",
    "Door",
    "Obstacle",
    "Rooms",
    "TopologicalMap",
    "find_rooms",
]

__getattr__ = on_first_use(
    __name__,
    {
        "Component": "map",
        "Door": "rooms",
        "Obstacle": "map",
        "Rooms": "rooms",
        "TopologicalMap": "map",
        "find_rooms": "segmentation",
    },
)
