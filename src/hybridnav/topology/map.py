"""The topological map: places and the boundaries between them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray, FloatArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.pyramid import DualGraphPyramid, Level


class TopologicalMap:
    """The apex of a pyramid, seen as places and arcs with lasting ids.

    Arrays are indexed by the dense indices of the level; `place_ids` and `arc_ids` are what
    results, files and arguments name.

    Parameters
    ----------
    pyramid
        The pyramid whose apex holds the places.
    """

    def __init__(self, pyramid: DualGraphPyramid) -> None:
        self.pyramid = pyramid
        self.level: Level = pyramid[-1]
        self.place_ids: LongArray = np.arange(self.level.n_vertices, dtype=np.int64)
        self.arc_ids: LongArray = np.arange(self.level.n_arcs, dtype=np.int64)
        self.place_ids.flags.writeable = False
        self.arc_ids.flags.writeable = False

    def __repr__(self) -> str:
        return f"TopologicalMap(n_places={self.n_places}, n_arcs={self.n_arcs})"

    @property
    def grid(self) -> OccupancyGrid:
        """The map it was grown from."""
        return self.pyramid.grid

    @property
    def n_places(self) -> int:
        """Places, free and unexplored."""
        return self.level.n_vertices

    @property
    def n_arcs(self) -> int:
        """Arcs, self-loops included."""
        return self.level.n_arcs

    @property
    def arcs(self) -> IntArray:
        """int32 (n_arcs, 2), the places that each arc joins, as dense indices."""
        return self.level.arcs

    @property
    def classes(self) -> ByteArray:
        """uint8 (n_places,), `CellClass` of each place."""
        return self.level.classes

    @cached_property
    def positions(self) -> FloatArray:
        """float64 (n_places, 2), surviving cell of each place as (x, y) in metres, map frame."""
        return self.grid.frame.points_of(self.level.cells)

    @cached_property
    def areas_m2(self) -> FloatArray:
        """float64 (n_places,), area of each place in square metres."""
        areas: FloatArray = self.level.areas * np.float64(self.grid.resolution_m**2)
        return areas

    def place_at(self, cell: tuple[int, int]) -> int:
        """Dense index of the place that holds a cell of the grid, -1 for an occupied cell."""
        return int(self.level.field_of[cell])

    def boundary_middle(self, arc: int) -> FloatArray:
        """The point in the middle of an arc's boundary, to draw the arc through.

        Parameters
        ----------
        arc
            Dense index of the arc.

        Returns
        -------
        FloatArray
            `(x, y)` in metres, map frame: the middle of the side between the two cells whose side
            is nearest the mean of all sides of the boundary, so that it lies on the boundary.

        Raises
        ------
        InvalidValueError
            When there is no such arc.
        """
        if not 0 <= arc < self.n_arcs:
            raise InvalidValueError(f"arc must be from 0 to {self.n_arcs - 1}, got {arc}")
        middle: FloatArray = self.level.boundary_middles[arc]
        return middle

    def parallel_arcs(self) -> int:
        """Arcs beyond the first between the same two places: doors that a simple graph loses."""
        plain = np.sort(self.arcs[~self.level.is_self_loop], axis=1)
        return len(plain) - len(np.unique(plain, axis=0))
