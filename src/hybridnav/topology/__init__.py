"""The topological map: places and boundaries."""

from hybridnav.topology.map import TopologicalMap

__all__ = ["TopologicalMap"]
