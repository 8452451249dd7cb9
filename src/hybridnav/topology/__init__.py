"""The topological map: places and boundaries, rooms and doors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hybridnav.topology.map import Component, Obstacle, TopologicalMap
from hybridnav.topology.rooms import Door, Rooms

if TYPE_CHECKING:
    from hybridnav.topology.segmentation import Segmentation, find_rooms

__all__ = [
    "Component",
    "Door",
    "Obstacle",
    "Rooms",
    "Segmentation",
    "TopologicalMap",
    "find_rooms",
]


def __getattr__(name: str) -> Any:
    if name not in {"Segmentation", "find_rooms"}:
        raise AttributeError(f"module 'hybridnav.topology' has no attribute {name!r}")
    from hybridnav.topology import segmentation  # noqa: PLC0415 - loads scipy

    return getattr(segmentation, name)
