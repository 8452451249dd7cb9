"""The topological map: places and boundaries."""

from hybridnav.topology.map import Component, Obstacle, TopologicalMap

__all__ = ["Component", "Obstacle", "TopologicalMap"]
