"""The methods of presets: each answers a query on one map, by a structure of its own."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from hybridnav.errors import InvalidValueError
from hybridnav.planning import PlannerSettings
from hybridnav.planning.settings import CheapestSettings

if TYPE_CHECKING:
    from hybridnav.planning.methods.grid import KnownMap
    from hybridnav.search.found import Method

_METHODS = {
    "shortest": "shortest:OverMesh",
    "octile": "octile:OverJumps",
    "cheapest": "cheapest:OverLattice",
    "paper": "paper:MaxDistance",
    "grid-astar": "grid:WholeMap",
}
"""Module and class of each method; only that of a preset is loaded."""


def make_method(known: KnownMap, settings: PlannerSettings) -> Method:
    """Make the method that some settings name.

    Raises `InvalidValueError` when these settings do not use structures of the given kind, or the
    map does not suit. Raises `PresetError` when the settings name a refiner of the user's own that
    cannot be used.
    """
    by_costs = settings.sampling is not None and known.costs is not None
    allowed = settings.allow_unexplored
    settings = CheapestSettings(allow_unexplored=allowed) if by_costs else settings.underlying
    if settings.method not in _METHODS:
        from hybridnav.planning.methods.own_method import own_method  # noqa: PLC0415 - for these alone

        return own_method(known, settings)
    module, _, name = _METHODS[settings.method].partition(":")
    made: Method = getattr(import_module(f"{__name__}.{module}"), name)(known, settings)
    if known.prepared is not None and made.prepared is not known.prepared:
        raise InvalidValueError(
            f"method {settings.method} plans on nothing like a {type(known.prepared).__name__}: "
            "prepared must come from a planner of the same preset"
        )
    return made
