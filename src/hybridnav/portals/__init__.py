"""Portals: shortest paths of cells over the borders of fields, by stored distances."""

from hybridnav.portals.build import Portals, build_portals
from hybridnav.portals.distances import Tables, build_tables
from hybridnav.portals.options import PortalOptions
from hybridnav.portals.prepare import BuiltPortals, prepare_portals
from hybridnav.portals.search import PortalAnswers, PortalSearch

__all__ = [
    "BuiltPortals",
    "PortalAnswers",
    "PortalOptions",
    "PortalSearch",
    "Portals",
    "Tables",
    "build_portals",
    "build_tables",
    "prepare_portals",
]
