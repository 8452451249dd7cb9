"""The topological map: places and boundaries, rooms and doors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hybridnav.topology.map import Component, Obstacle, TopologicalMap
from hybridnav.topology.rooms import Door, Rooms

if TYPE_CHECKING:
    from hybridnav.topology.segmentation import find_rooms

__all__ = [
    "Component",
    "Door",
    "Obstacle",
    "Rooms",
    "TopologicalMap",
    "find_rooms",
]


def __getattr__(name: str) -> Any:
    if name != "find_rooms":
        raise AttributeError(f"module 'hybridnav.topology' has no attribute {name!r}")
    from hybridnav.topology.segmentation import find_rooms  # noqa: PLC0415 - loads scipy

    return find_rooms
