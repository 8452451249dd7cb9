"""Islands that a pyramid and its levels share, found when one of them first needs them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hybridnav.maps import OccupancyGrid
    from hybridnav.pyramid.islands import Islands


class LazyIslands:
    """The islands of a grid, on first use.

    Levels hold this and not their pyramid: without a cycle of references, memory is free as soon as
    a pyramid is not used any more.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid

    @cached_property
    def found(self) -> Islands:
        """Obstacles and components, with their nesting."""
        from hybridnav.pyramid.islands import Islands  # noqa: PLC0415 - loads scipy.ndimage

        return Islands.of_classes(self._grid.classes)
