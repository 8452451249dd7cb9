"""Portals: shortest paths of cells over the borders of fields, by stored distances.

Names load on first use: one preset plans on them.
"""

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
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

__getattr__ = on_first_use(
    __name__,
    {
        "BuiltPortals": "prepare",
        "PortalAnswers": "search",
        "PortalOptions": "options",
        "PortalSearch": "search",
        "Portals": "build",
        "Tables": "distances",
        "build_portals": "build",
        "build_tables": "distances",
        "prepare_portals": "prepare",
    },
)
