"""Coarse routes on the topological map, and the corridors they open."""

from hybridnav.route.coarse import CoarseRoute, MaxDistanceSearch
from hybridnav.route.corridor import Corridor, corridor_of
from hybridnav.route.portal_search import PortalSearch
from hybridnav.route.portal_table import PortalRoute, PortalTable
from hybridnav.route.walk import Walks

__all__ = [
    "CoarseRoute",
    "Corridor",
    "MaxDistanceSearch",
    "PortalRoute",
    "PortalSearch",
    "PortalTable",
    "Walks",
    "corridor_of",
]
