"""Coarse routes on the topological map, and the corridors they open."""

from hybridnav.route.coarse import CoarseRoute, MaxDistanceSearch
from hybridnav.route.corridor import Corridor, corridor_of

__all__ = ["CoarseRoute", "Corridor", "MaxDistanceSearch", "corridor_of"]
