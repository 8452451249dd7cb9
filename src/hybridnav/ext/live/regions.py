"""Regions that follow the places of a changing map, with numbers that last."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.identities import events_of, shift_of
from hybridnav.ext.live.pyramid import OnlinePyramid
from hybridnav.ext.live.region_growth import (
    Touched,
    grown,
    held_together,
    lengths_between,
    touched_between,
)
from hybridnav.ext.live.tiles import NO_PLACE
from hybridnav.maps.checks import checked_type
from hybridnav.topology.rooms.carrying import Overlap, heirs_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from hybridnav._base.typing import IntArray, LongArray
    from hybridnav.pyramid import DualGraphPyramid


@copies_alike
@dataclass(frozen=True, eq=False)
class OnlineRegions:
    """One version of the regions of a map that changes, the level above its places.

    `update` returns the next version and leaves this one as it is. Regions have numbers that are
    never used again; they are not indices of `pyramid`, in which `region_numbers` states the number
    of each vertex of the level of the regions.

    Examples
    --------
    >>> from hybridnav.ext.live import OnlinePyramid, OnlineRegions
    >>> cells = np.zeros((6, 24))
    >>> grid = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    >>> places = OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    >>> regions = OnlineRegions.of(places, most_cells=72)
    >>> regions.n_regions, regions.region_at((0, 0)) == regions.region_at((5, 0))
    (3, True)
    >>> cells[3, 3] = 1.0
    >>> now = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    >>> update = regions.update(places.update(now).version)
    >>> update.version.n_regions, update.born, update.died, update.changed
    (3, (), (), (0,))
    """

    places: OnlinePyramid
    """The places of this version."""
    most_cells: int
    """Most cells of a region of several places."""
    region_of: MappingProxyType[int, int] = field(repr=False)
    """The number of the region of each place."""
    _places_of: MappingProxyType[int, tuple[int, ...]] = field(repr=False)
    _next: int = field(repr=False)
    """The least number that no region has had."""

    @classmethod
    def of(cls, places: OnlinePyramid, most_cells: int) -> OnlineRegions:
        """Make the first version: the regions of `places.pyramid.with_regions`.

        Takes time in proportion to the map.

        Parameters
        ----------
        places
            A version of the places.
        most_cells
            Most cells of a region, >= 1; a place that has more is a region by itself.

        Raises
        ------
        InvalidValueError
            When the number is not a whole number >= 1.
        """
        if isinstance(most_cells, np.integer):
            most_cells = int(most_cells)
        pyramid = checked_type("places", places, OnlinePyramid).pyramid.with_regions(most_cells)
        regions = pyramid[pyramid.region_level]
        region = regions.field_of[tuple(pyramid[pyramid.place_level].cells.T)]
        region_of = dict(zip(places.place_numbers.tolist(), region.tolist(), strict=True))
        members: dict[int, list[int]] = {}
        for place, number in sorted(region_of.items()):
            members.setdefault(number, []).append(place)
        places_of = {number: tuple(held) for number, held in members.items()}
        return cls(
            places,
            most_cells,
            MappingProxyType(region_of),
            MappingProxyType(places_of),
            regions.n_vertices,
        )

    def update(self, places: OnlinePyramid) -> RegionsUpdate:
        """Return the next version, that of other places, most often later ones.

        Regions that hold a changed place are contracted again with new places and with the regions
        beside them, which take part whole. They are dissolved into places only where these do not
        connect any more, or have too many cells. All other regions keep their places and their
        numbers.

        Parameters
        ----------
        places
            Another version of the places, most often a later one; updates in between may be left
            out.

        Returns
        -------
        RegionsUpdate
            The next version, and what became of the regions.

        Raises
        ------
        InvalidValueError
            When their map does not cover that of this version, cell on cell, or their versions did
            not begin on the same map.
        """
        before = self.places
        checked_type("places", places, OnlinePyramid)
        shift = shift_of(before.grid, places.grid, otherwise="make new regions")
        if (before.low[0] - shift[0], before.low[1] - shift[1]) != places.low:
            raise InvalidValueError(
                f"the places lie at {places.low} among the cells of their first version, expected "
                "a later version of the places of these regions: make new regions"
            )
        touched = touched_between(before.state, places.state)
        if not len(touched.cells):
            return RegionsUpdate(replace(self, places=places), (), (), {}, {}, ())
        known = {*touched.old.tolist(), *touched.new.tolist()} & self.region_of.keys()
        gone = {self.region_of[place] for place in known}
        groups = self._contract(places, self._dissolved(gone, touched, places))
        whole = gone.union(*(group.regions for group in groups))
        areas = self._areas_of(sorted(whole))
        found = self._overlaps(gone, touched, groups, areas)
        heirs = heirs_of(found, areas)
        name, following = dict(heirs.name), self._next
        for at in range(len(groups)):
            if at not in name:
                name[at], following = following, following + 1
        areas_now = {at: group.area for at, group in enumerate(groups)}
        events = events_of(found, heirs._replace(name=name), areas_now, self._next)
        held = {name[at]: group.places for at, group in enumerate(groups)}
        return RegionsUpdate(self._with(places, whole, held, following), *events)

    def _dissolved(self, gone: Iterable[int], touched: Touched, places: OnlinePyramid) -> list[int]:
        """Return the places that are contracted again: those now of some regions, and new ones."""
        members = [place for region in gone for place in self._places_of[region]]
        return sorted({*places.state.places.known(members), *touched.new.tolist()} - {NO_PLACE})

    def _contract(self, places: OnlinePyramid, dissolved: list[int]) -> list[_Group]:
        """Contract places among themselves and with the regions beside them."""
        of_places = places.state.places.read(dissolved)["area"].tolist()
        area_of = dict(zip(dissolved, of_places, strict=True))
        between = lengths_between(places.state, dissolved)
        vertex_of = held_together(area_of, between, self.region_of, self.most_cells)
        held: dict[int, list[int]] = {}
        for place, vertex in vertex_of.items():
            held.setdefault(vertex, []).append(place)
        lengths: Counter[tuple[int, int]] = Counter()
        for pair, length in between.items():
            # Regions as a whole are vertices with numbers below those of all places.
            one, other = (vertex_of[p] if p in vertex_of else -1 - self.region_of[p] for p in pair)
            if one != other:
                lengths[min(one, other), max(one, other)] += length
        areas = {vertex: sum(area_of[place] for place in held[vertex]) for vertex in held}
        beside = sorted({-1 - vertex for pair in lengths for vertex in pair if vertex < 0})
        for region, area in self._areas_of(beside).items():
            areas[-1 - region] = area
            held[-1 - region] = [*self._places_of[region]]
        groups = []
        for vertices in grown(areas, lengths, self.most_cells):
            regions = frozenset(-1 - vertex for vertex in vertices if vertex < 0)
            if len(regions) < len(vertices) or len(regions) > 1:
                members = sorted(place for vertex in vertices for place in held[vertex])
                area = sum(areas[vertex] for vertex in vertices)
                groups.append(_Group(tuple(members), regions, area))
        return groups

    def _overlaps(
        self,
        gone: Iterable[int],
        touched: Touched,
        groups: list[_Group],
        areas: Mapping[int, int],
    ) -> list[Overlap]:
        """Return the cells that old regions and groups have in common."""
        group_of = {place: at for at, group in enumerate(groups) for place in group.places}
        found: Counter[tuple[int, int]] = Counter()
        members = [place for region in gone for place in self._places_of[region]]
        area_of = self.places.state.places.read(members)["area"].tolist()
        left = dict(zip(members, area_of, strict=True))
        for old, new, cells in zip(*(values.tolist() for values in touched), strict=True):
            if old != NO_PLACE:
                found[self.region_of[old], group_of.get(new, NO_PLACE)] += cells
                left[old] -= cells
        for place, cells in left.items():
            if cells:
                found[self.region_of[place], group_of[place]] += cells
        for at, group in enumerate(groups):
            for region in group.regions:
                found[region, at] += areas[region]
        return [(old, new, cells) for (old, new), cells in sorted(found.items())]

    def _with(
        self,
        places: OnlinePyramid,
        gone: Iterable[int],
        held: Mapping[int, tuple[int, ...]],
        following: int,
    ) -> OnlineRegions:
        """Return the version in which regions are replaced by others."""
        region_of, places_of = self.region_of.copy(), self._places_of.copy()
        for region in gone:
            for place in places_of.pop(region):
                del region_of[place]
        for region, members in held.items():
            places_of[region] = members
            region_of.update(dict.fromkeys(members, region))
        views = MappingProxyType(region_of), MappingProxyType(places_of)
        return OnlineRegions(places, self.most_cells, *views, following)

    def _areas_of(self, regions: list[int]) -> dict[int, int]:
        """Return the cells of some regions."""
        members = [place for region in regions for place in self._places_of[region]]
        counts = [len(self._places_of[region]) for region in regions]
        cells = np.append(0, np.cumsum(self.places.state.places.read(members)["area"]))
        ends = cells[np.append(0, np.cumsum(counts)).astype(np.int64)]
        return dict(zip(regions, np.diff(ends).tolist(), strict=True))

    @property
    def n_regions(self) -> int:
        """Regions of the version."""
        return len(self._places_of)

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of the regions, ascending."""
        return tuple(sorted(self._places_of))

    def places_of(self, region: int) -> tuple[int, ...]:
        """Return the numbers of the places of a region, ascending.

        Raises
        ------
        InvalidValueError
            When the version has no such region.
        """
        is_number = isinstance(region, int | np.integer)
        if not is_number or region not in self._places_of:
            raise InvalidValueError(
                f"there is no region {region!r:.40} in this version, expected one of its "
                f"{self.n_regions}: an update states what became of a region"
            )
        return self._places_of[region]

    def region_at(self, cell: tuple[int, int]) -> int:
        """Return the number of the region that holds a cell (row, col) of the grid, -1 for none.

        Raises
        ------
        InvalidValueError
            When it is no cell.
        """
        return self.region_of.get(self.places.place_at(cell), NO_PLACE)

    @cached_property
    def number_of(self) -> IntArray:
        """int32 (rows, cols), the number of the region of each cell of the grid, -1 for none."""
        places, regions = map(np.array, (list(self.region_of), list(self.region_of.values())))
        table = np.full(int(places.max(initial=-1)) + 2, NO_PLACE, np.int32)
        table[places.astype(np.int64)] = regions
        return frozen(table[self.places.number_of])

    @cached_property
    def pyramid(self) -> DualGraphPyramid:
        """The version as a pyramid of dense arrays, from the cells to the regions and the apex.

        Up to the places its levels are those of `places.pyramid`. It has the regions that
        `with_regions(most_cells)` asks for. Making it takes time in proportion to the map.
        """
        below = self.places.pyramid
        regions = [self.region_of[place] for place in self.places.place_numbers.tolist()]
        return below.with_regions(self.most_cells, region_of=np.array(regions, np.int64))

    @cached_property
    def region_numbers(self) -> LongArray:
        """int64 (n_regions,), the number of the region of each vertex of the level of the regions
        in `pyramid`."""
        rows, cols = self.pyramid[self.pyramid.region_level].cells.T
        return frozen(self.number_of[rows, cols].astype(np.int64))


class _Group(NamedTuple):
    """What is one region after a contraction."""

    places: tuple[int, ...]
    """Its places, ascending."""
    regions: frozenset[int]
    """Old regions that took part whole and are in it."""
    area: int
    """Its cells."""


@dataclass(frozen=True, eq=False)
class RegionsUpdate:
    """A new version of regions, and what became of those of the one before, by number.

    Examples
    --------
    >>> from hybridnav.ext.live import OnlinePyramid, OnlineRegions
    >>> grid = hn.OccupancyGrid(np.zeros((3, 5)), robot_radius_m=0)
    >>> places = OnlinePyramid.of(hn.DualGraphPyramid.build(grid))
    >>> wall = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    >>> now = hn.OccupancyGrid(np.tile(wall, (3, 1)), robot_radius_m=0)
    >>> update = OnlineRegions.of(places, most_cells=100).update(places.update(now).version)
    >>> update.died, update.split
    ((0,), {0: (1, 2)})
    """

    version: OnlineRegions
    """The new version."""
    born: tuple[int, ...]
    """Regions that are none of the old ones; their numbers are new."""
    died: tuple[int, ...]
    """Old regions that are no more."""
    merged: dict[int, int]
    """Those of them most of whose cells went into another region, with that region."""
    split: dict[int, tuple[int, ...]]
    """Old regions of which several new ones mostly consist, with these."""
    changed: tuple[int, ...]
    """Regions that kept their number, but were contracted again."""
