"""Portals: shortest paths of cells over the borders of fields, by stored distances."""

from hybridnav.portals.build import Portals, build_portals
from hybridnav.portals.search import BuiltPortals, PortalAnswers, PortalSearch

__all__ = [
    "BuiltPortals",
    "PortalAnswers",
    "PortalSearch",
    "Portals",
    "build_portals",
]
