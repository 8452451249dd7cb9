"""The dual graph pyramid of an occupancy grid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.typing import IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.pyramid.darts import Resists
from hybridnav.pyramid.islands import Islands, LazyIslands
from hybridnav.pyramid.level import Level
from hybridnav.pyramid.record import (
    BuildStats,
    Linkage,
    Record,
    check_fit,
    checked_most_cells,
    checked_settings,
    checked_vertices,
)


@dataclass(frozen=True, eq=False)
class DualGraphPyramid:
    """A hierarchy of plane graphs with their duals, from single cells to places and above.

    `pyramid[0]` is the base, `pyramid[-1]` the apex, the level at which contraction ended;
    `len(pyramid)` counts the levels. `DualGraphPyramid.build` ends at the places, unless rooms or a
    resistance let it go on. `with_regions` goes on from there, to one vertex for each connected set
    of cells of one class.

    Examples
    --------
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> [level.n_vertices for level in pyramid]
    [671, 327, 166, 73, 33, 14, 10]
    >>> above = pyramid.with_regions(300)
    >>> [above[at].n_vertices for at in (above.place_level, above.region_level, -1)]
    [10, 4, 3]
    """

    grid: OccupancyGrid
    merge_distance_m: float
    linkage: Linkage
    seed: int
    stats: BuildStats = field(repr=False)
    """Size of each level and seconds per stage of the build."""
    rooms: RoomLabels | None = field(repr=False)
    """The rooms that the pyramid was built with."""
    _record: Record = field(repr=False)
    region_cells: int | None = field(repr=False, default=None)
    """Most cells of a region, None for a pyramid without regions."""
    _levels: dict[int, Level] = field(repr=False, default_factory=dict)
    _below: DualGraphPyramid | None = field(repr=False, default=None)
    """The pyramid that this one goes on above: both have the same levels up to the places."""

    @classmethod
    def build(  # noqa: PLR0913 - all but the grid have defaults
        cls,
        grid: OccupancyGrid,
        *,
        merge_distance_m: float = 4.0,
        linkage: Linkage = "throats",
        seed: int = 0,
        rooms: RoomLabels | None = None,
        resistance: Resists | None = None,
    ) -> DualGraphPyramid:
        """Contract the cells of a grid to places and, with rooms, further to rooms and the apex.

        At each level the stars of a maximal independent edge set are contracted (MIES; Haxhimusa
        and Kropatsch). Then edges that have become redundant are removed. So every arc of a level
        is exactly one connected boundary between two fields. A field has cells of one class.

        Parameters
        ----------
        grid
            The map; its free and unexplored cells are the vertices of the base.
        merge_distance_m
            U_d in metres, positive, infinity allowed: how coarse the places are.
        linkage
            The distance that stays strictly below U_d, between cell centres, to 1e-9 of its square.
            `"survivor"`: the distance between the two surviving cells when one is contracted into
            the other; it holds for each such link, not for the field. `"radius"`: the distance from
            every cell of a field to its surviving cell. `"diameter"`: the distance between every
            two cells of a field (complete linkage). `"throats"`: as `"radius"`, and no field lies
            on both sides of a throat, a narrow passage between wider parts of the map such as a
            door. With rooms or a resistance it is `"radius"`: they decide where fields part.
        seed
            Breaks ties; equal input and seed give an equal pyramid.
        rooms
            The room of each cell. No two rooms ever merge at the levels of the places. Above them,
            all places of a class that are connected inside one room merge whatever U_d is, which
            makes `room_level`; cells outside rooms count as one room. Above that, all fields of one
            class that touch merge, up to the apex.
        resistance
            Lets contraction go on above the places, whatever U_d is, until every arc of the apex
            resists; rooms are found so. Not with rooms, which decide themselves what merges.

        Raises
        ------
        InvalidValueError
            When the merge distance is not positive, the linkage is not known, or the seed is no
            whole number. When both rooms and a resistance are given, or those of a grid of another
            shape. When the map needs more than 126 levels.
        """
        seed = checked_settings(merge_distance_m, linkage, seed)
        check_fit(grid, rooms, resistance)
        # A model holds what they build.
        from hybridnav.pyramid.decimation import decimate, squared_limit  # noqa: PLC0415

        limit = squared_limit(merge_distance_m, grid.resolution_m)
        record, stats, darts = decimate(
            grid.classes,
            linkage=linkage,
            limit=limit,
            seed=seed,
            rooms=None if rooms is None else rooms.label_of,
            resistance=resistance,
        )
        pyramid = cls(grid, float(merge_distance_m), linkage, seed, stats, rooms, record)
        # The level need not find them again: on large maps that takes longer than the build.
        vars(pyramid[pyramid.place_level])["darts"] = darts
        return pyramid

    def with_regions(self, most_cells: int) -> DualGraphPyramid:
        """Let contraction go on above the places: to regions, and from there to the apex.

        All levels up to the places are those of this pyramid. Above them, the arcs with the
        greatest *expansion rating* are contracted first: the squared length of the boundaries
        between two fields over the product of their areas, both in cells. Regions are the fields
        when no two may merge without having more than so many cells. From there contraction goes on
        without this limit. With rooms, regions lie inside rooms, and the levels of the rooms and of
        the apex come above them.

        Parameters
        ----------
        most_cells
            Most cells of a region, >= 1; a place that has more is a region by itself.

        Returns
        -------
        DualGraphPyramid
            This pyramid itself if it has such regions, else another one.

        Raises
        ------
        InvalidValueError
            When the number is not a whole number >= 1.
        """
        most_cells = checked_most_cells(most_cells)
        if self.region_cells == most_cells:
            return self
        if self._below is not None:
            return self._below.with_regions(most_cells)
        # Loading a model needs no decimation.
        from hybridnav.pyramid.decimation import go_on_above  # noqa: PLC0415

        record, stats = go_on_above(
            self[self.place_level],
            self._record,
            self.stats,
            most_cells=most_cells,
            seed=self.seed,
            rooms=None if self.rooms is None else self.rooms.label_of,
        )
        return replace(
            self, stats=stats, region_cells=most_cells, _record=record, _levels={}, _below=self
        )

    @property
    def record(self) -> Record:
        """Level and kind of the end of each vertex and edge, from which all levels are rebuilt."""
        return self._record

    @property
    def place_level(self) -> int:
        """Index of the level of the places: the apex, unless contraction went on above it."""
        return self.stats.tops[0]

    @property
    def region_level(self) -> int:
        """Index of the level of the regions.

        Raises
        ------
        InvalidValueError
            When the pyramid has no regions.
        """
        if self.region_cells is None:
            raise InvalidValueError("this pyramid has no regions: use pyramid.with_regions(...)")
        return self.stats.tops[1]

    @property
    def room_level(self) -> int:
        """Index of the level of the rooms.

        Raises
        ------
        InvalidValueError
            When the pyramid was built without rooms.
        """
        if self.rooms is None:
            raise InvalidValueError("this pyramid has no rooms: build it with rooms=...")
        return self.stats.tops[-2]

    def __len__(self) -> int:
        return len(self.stats.sizes)

    @overload
    def __getitem__(self, index: int) -> Level: ...

    @overload
    def __getitem__(self, index: slice) -> list[Level]: ...

    def __getitem__(self, index: int | slice) -> Level | list[Level]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        at = index + len(self) if index < 0 else index
        if not 0 <= at < len(self):
            raise IndexError(f"the pyramid has levels 0 to {len(self) - 1}, got {index}")
        if self._below is not None and at <= self.place_level:
            return self._below[at]
        if at not in self._levels:  # one call, so that all threads share one level
            self._levels.setdefault(at, Level(self.grid, self._record, at, self._lazy_islands))
        return self._levels[at]

    def ancestor(self, vertices: ArrayLike, *, level: int, to: int) -> IntArray:
        """Return the vertices of a higher level whose fields contain given vertices of a lower one.

        Parameters
        ----------
        vertices
            Indices at `level`, any shape.
        level, to
            `to >= level`; negative ones count from the apex.

        Returns
        -------
        IntArray
            int32, indices at `to`, same shape.

        Raises
        ------
        InvalidValueError
            When `to` is below `level`, or there is no such vertex.
        IndexError
            When there is no such level.
        """
        lower, upper = self._in_order(level, to)
        rows, cols = np.moveaxis(
            lower.cells[checked_vertices(vertices, lower.index, lower.n_vertices)], -1, 0
        )
        return upper.field_of[rows, cols]

    def descendants(self, vertex: int, *, level: int, to: int) -> LongArray:
        """Return the vertices of a lower level whose fields lie in the field of a higher one.

        Parameters
        ----------
        vertex
            Index at `level`.
        level, to
            `to <= level`; negative ones count from the apex.

        Returns
        -------
        LongArray
            int64, indices at `to`, ascending.

        Raises
        ------
        InvalidValueError
            When `to` is above `level`, or there is no such vertex.
        IndexError
            When there is no such level.
        """
        lower, upper = self._in_order(to, level)
        found = checked_vertices(vertex, upper.index, upper.n_vertices)
        return np.flatnonzero(upper.field_of[tuple(lower.cells.T)] == found)

    def parent(self, level: int) -> IntArray:
        """Return the vertex of the next level above each vertex of `level`, int32 (n_vertices,).

        Raises
        ------
        IndexError
            When there is no such level, or none above it.
        """
        below = self[level]
        return self.ancestor(np.arange(below.n_vertices), level=below.index, to=below.index + 1)

    def children(self, level: int, vertex: int) -> LongArray:
        """Return the reduction window of a vertex of `level`, int64: its sons one level down.

        Raises
        ------
        InvalidValueError
            When the level is the base, or there is no such vertex.
        IndexError
            When there is no such level.
        """
        above = self[level].index
        if above == 0:
            raise InvalidValueError("nothing lies below level 0, the base")
        return self.descendants(vertex, level=above, to=above - 1)

    def contraction_kernel(self, level: int) -> LongArray:
        """Return the arcs of `level` that are contracted on the way to the next level, int64.

        They form a forest of stars, one for each reduction window.

        Raises
        ------
        IndexError
            When there is no such level, or none above it.
        """
        return self._kernel(level, removed=False)

    def removal_kernel(self, level: int) -> LongArray:
        """Return the arcs of `level` that are removed as redundant below the next level, int64.

        Raises
        ------
        IndexError
            When there is no such level, or none above it.
        """
        return self._kernel(level, removed=True)

    def _kernel(self, level: int, *, removed: bool) -> LongArray:
        below = self[level]
        self[below.index + 1]  # raises at the apex, which has no kernels
        end = self._record.edge_end[below.base_edges]
        return np.flatnonzero(end == 2 * (below.index + 1) + removed)

    def _in_order(self, low: int, high: int) -> tuple[Level, Level]:
        lower, upper = self[low], self[high]
        if lower.index > upper.index:
            raise InvalidValueError(
                f"level {lower.index} is not below level {upper.index}: ask the other way round"
            )
        return lower, upper

    @property
    def islands(self) -> Islands:
        """Return the obstacles and components of the grid, with their nesting."""
        return self._lazy_islands.found if self._below is None else self._below.islands

    @cached_property
    def _lazy_islands(self) -> LazyIslands:
        return LazyIslands(self.grid)

    def __iter__(self) -> Iterator[Level]:
        return (self[index] for index in range(len(self)))
