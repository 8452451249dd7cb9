"""What a version of the cells and places consists of."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.online.places import PlaceTable
    from hybridnav.online.tiles import Tiles


class State(NamedTuple):
    """All that a version consists of."""

    tiles: Tiles
    """Its cells."""
    places: PlaceTable
    """Its places."""
    vertex_ends: LongArray
    """int64 (256,), how many cells have each end. Levels at which none ends are left out of the
    dense form."""
    next_place: int
    """The least number that no place has ever had."""
    has_levels: bool = True
    """Whether all levels below the places are those of its cells; see `levels`."""
