"""The topological map: places and boundaries, rooms and doors."""

from hybridnav.topology.map import Component, Obstacle, TopologicalMap
from hybridnav.topology.rooms import Door, Rooms

__all__ = ["Component", "Door", "Obstacle", "Rooms", "TopologicalMap"]
