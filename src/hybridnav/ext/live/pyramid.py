"""A pyramid that follows its map. Public: `Update`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.typing import BoolArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.ext.live.identities import NO_PLACE, Events, events_of, shift_of
from hybridnav.ext.live.state import CellDraft, State, check_stated, patch_of, pyramid_of, state_of
from hybridnav.ext.live.tiles import Box
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.areas import box_of_area, class_reach, class_rules
from hybridnav.maps.checks import checked_cell, checked_type
from hybridnav.pyramid import DualGraphPyramid, Linkage
from hybridnav.pyramid.decimation import Criterion, squared_limit
from hybridnav.pyramid.record import Patch
from hybridnav.rooms.carrying import Heirs, Overlap, heirs_of


@copies_alike
@dataclass(frozen=True, eq=False)
class OnlinePyramid:
    """One version of a pyramid that follows its map: the places; `pyramid` has all levels below.

    `update` returns the next version and leaves this one as it is: both share what did not change.
    A version is a value: plans on an older one go on, in any thread.

    Places have numbers that last from version to version. They are not indices of `pyramid`, the
    dense form of a version, in which `place_numbers` states the number of each vertex.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from hybridnav.ext.live import OnlinePyramid
    >>> grid = hn.example_map("figure1")
    >>> online = OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    >>> online.n_places, online.place_at((5, 13))
    (10, 0)
    >>> probability = grid.probability.copy()
    >>> probability[5, 13] = 1.0
    >>> update = online.update(replace(grid, probability=probability), changed=(1.3, 0.5, 1.4, 0.6))
    >>> update.version.place_at((5, 13)), update.changed
    (-1, (0, 2))
    """

    grid: OccupancyGrid
    """The map of this version."""
    merge_distance_m: float
    linkage: Linkage
    """`"throats"` or `"radius"`."""
    seed: int
    low: tuple[int, int]
    """Row and column of cell (0, 0) among the cells of the first version, negative where the map
    has grown."""
    state: State = field(repr=False)
    """The cells and the table of places, for what follows the places."""

    @classmethod
    def of(cls, pyramid: DualGraphPyramid) -> OnlinePyramid:
        """Make the first version from a pyramid; its places are numbered as the vertices are.

        Parameters
        ----------
        pyramid
            A pyramid without rooms, of the linkage "throats" or "radius"; levels above its places
            are left out.

        Raises
        ------
        InvalidValueError
            When the pyramid was built with rooms or another linkage, or its grid is too long.
        """
        if checked_type("pyramid", pyramid, DualGraphPyramid).rooms is not None:
            raise InvalidValueError(
                "the pyramid was built with rooms, expected one without: "
                "build it without rooms, and find them on a version"
            )
        if pyramid.linkage not in {"throats", "radius"}:
            raise InvalidValueError(
                f"the pyramid was built with the linkage {brief(pyramid.linkage)}, expected "
                "'throats', the default, or 'radius': places of others do not follow a map"
            )
        return cls(
            pyramid.grid,
            pyramid.merge_distance_m,
            pyramid.linkage,
            pyramid.seed,
            (0, 0),
            state_of(pyramid),
        )

    def update(
        self, grid: OccupancyGrid, *, changed: BaseGeometry | ArrayLike | None = None
    ) -> Update:
        """Return the next version, that of a changed map.

        Places that hold no changed cell keep their cells and their numbers, unless they take in new
        cells, or may merge with what changed beside them. The other places give away and take in
        single cells. Levels below the places are made when they are read.

        Under the linkage "throats" places of different parts of the first map stay apart, and new
        places may merge with any. Only a build finds throats of new cells.

        Parameters
        ----------
        grid
            The map now, with the cells of this version's grid: its frame may have its origin whole
            rows and columns lower, and it may be larger on any side.
        changed
            The area where measurements changed, as in `HybridPlanner.update`. It is a shapely
            geometry in metres, map frame, whose bounds are taken, or `(x_min, y_min, x_max,
            y_max)`, or a mask, bool (rows, cols) of the new grid. The robot's radius is added on
            all sides, and cells by which the map grew always count. Other cells stay as they were
            until an update states them, and `pyramid` refuses such a version. None compares all
            cells, as do grids with another radius or other thresholds.

        Raises
        ------
        InvalidValueError
            When the grid has cells of another size or at other points, or does not cover that of
            this version. When `changed` is no area and no mask of it.
        """
        checked_type("grid", grid, OccupancyGrid)
        rows, cols = shift_of(self.grid, grid, otherwise="build a new pyramid")
        low = self.low[0] - rows, self.low[1] - cols
        whole = Box(0, 0, *grid.shape)
        first_row, high_row, first_col, high_col = box_of_area(changed, grid.frame, grid.shape)
        box = Box(first_row, first_col, high_row, high_col).widened(class_reach(grid)).common(whole)
        if class_rules(grid) != class_rules(self.grid) or grid.least_island_m2 > 0:
            box = whole
        old = Box(0, 0, *self.grid.shape).moved(rows, cols)
        # Obstacles in new cells reach into those at the former rim.
        apart = old.narrowed(class_reach(grid), whole)
        inside = box.common(apart)
        boxes = [*_outside(apart, whole), *([] if inside.is_empty else [inside])]
        draft = CellDraft(self.state, self._criterion)
        draft.change([part.moved(*low) for part in boxes], grid.classes, low)
        events = _settled(draft)
        cells = draft.cells - np.array(low)
        version = replace(self, grid=grid, low=low, state=draft.close())
        order = np.argsort(cells[:, 0] * grid.shape[1] + cells[:, 1], kind="stable")
        return Update(version, *events, frozen(cells[order]))

    @property
    def n_places(self) -> int:
        """Places of the version."""
        return self.state.places.count

    @property
    def _criterion(self) -> Criterion:
        limit = squared_limit(self.merge_distance_m, self.grid.resolution_m)
        return Criterion(self.linkage, limit, self.seed)

    @cached_property
    def number_of(self) -> IntArray:
        """int32 (rows, cols), the number of the place of each cell of the grid, -1 for none."""
        return frozen(self.state.tiles.planes(self._box())[0])

    def place_at(self, cell: tuple[int, int]) -> int:
        """Return the number of the place that holds a cell (row, col) of the grid.

        `NO_PLACE`, -1, for an occupied cell and for one outside the grid.

        Raises
        ------
        InvalidValueError
            When it is no cell.
        """
        row, col = checked_cell("cell", cell)
        row, col = row + self.low[0], col + self.low[1]
        return int(self.state.tiles.planes(Box(row, col, row + 1, col + 1))[0][0, 0])

    def receptive_field(self, place: int) -> LongArray:
        """Return the cells of a place, int64 (n, 2), (row, col) of the grid, in the order of rows.

        Raises
        ------
        InvalidValueError
            When the version has no such place.
        """
        is_number = isinstance(place, int | np.integer)
        if not is_number or place not in self.state.places.numbers():
            raise InvalidValueError(
                f"there is no place {place!r:.40} in this version, expected one of its "
                f"{self.n_places}: an update states what became of a place"
            )
        box = Box(*self.state.places.read([place])[0]["box"].tolist())
        cells = np.argwhere(self.state.tiles.planes(box)[0] == place)
        return cells + np.array(box[:2]) - np.array(self.low)

    @cached_property
    def pyramid(self) -> DualGraphPyramid:
        """The version as a pyramid of dense arrays, with all levels below the places.

        Making it takes up to twice as long as a build, far longer than an update.

        Raises
        ------
        InvalidValueError
            When cells of the grid changed that no update stated.
        """
        box = self._box()
        return pyramid_of(self.state, box, self.grid, self.merge_distance_m, self._criterion)

    def patched(self, before: OnlinePyramid, cells: LongArray) -> Patch | None:
        """Return what differs between the records of `pyramid` and that of another version, in the
        time of a change and not of the map. It is for planners that follow.

        Parameters
        ----------
        before
            The other version.
        cells
            int64 (n, 2), the cells (row, col) of the grid whose class is another one.

        Returns
        -------
        Patch or None
            None for a version of another map, or of other settings.

        Raises
        ------
        InvalidValueError
            When one of the cells changed and no update stated it.
        """
        same = (self.grid.shape, self.low, self._criterion)
        if (before.grid.shape, before.low, before._criterion) != same:
            return None
        if len(cells):
            (row, col), high = cells.min(axis=0).tolist(), (cells.max(axis=0) + 1).tolist()
            box = Box(row, col, *high)
            classes = self.state.tiles.planes(box.moved(*self.low))[1]
            check_stated(classes, self.grid.classes[row : high[0], col : high[1]], (row, col))
        return patch_of(before.state, self.state, self._box(), self._criterion)

    @cached_property
    def place_numbers(self) -> LongArray:
        """int64 (n_places,), the number of the place of each vertex of the last level of
        `pyramid`."""
        rows, cols = self.pyramid[-1].cells.T
        return frozen(self.number_of[rows, cols].astype(np.int64))

    def _box(self) -> Box:
        return Box(0, 0, *self.grid.shape).moved(*self.low)


@copies_alike
@dataclass(frozen=True, eq=False)
class Update:
    """A new version, and what became of the places of the one before, by number.

    Examples
    --------
    >>> from hybridnav.ext.live import OnlinePyramid
    >>> grid = hn.OccupancyGrid(np.zeros((3, 5)), robot_radius_m=0)
    >>> version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid))
    >>> wall = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    >>> update = version.update(hn.OccupancyGrid(np.tile(wall, (3, 1)), robot_radius_m=0))
    >>> update.died, update.split
    ((0,), {0: (1, 2)})
    >>> update.cells.tolist()
    [[0, 2], [1, 2], [2, 2]]
    """

    version: OnlinePyramid
    born: tuple[int, ...]
    """Places that are none of the old ones; their numbers are new."""
    died: tuple[int, ...]
    """Old places that are no more."""
    merged: dict[int, int]
    """Those of them most of whose cells went into another place, with that place."""
    split: dict[int, tuple[int, ...]]
    """Old places that fell into several new ones, with these."""
    changed: tuple[int, ...]
    """Places that kept their number, and most of their cells, but not all that they were."""
    cells: LongArray
    """int64 (n, 2), the cells (row, col) of the new grid whose `CellClass` is another than before,
    in the order of rows. What lay outside the map before counts as occupied there. Whatever depends
    on the classes of cells alone is as it was where none of these lies."""


def _outside(inner: Box, outer: Box) -> list[Box]:
    """Return the boxes that make up an outer box without an inner one."""
    if inner.is_empty:
        return [outer]
    low, high = inner.low_row, inner.high_row
    boxes = [
        Box(outer.low_row, outer.low_col, low, outer.high_col),
        Box(high, outer.low_col, outer.high_row, outer.high_col),
        Box(low, outer.low_col, high, inner.low_col),
        Box(low, inner.high_col, high, outer.high_col),
    ]
    return [box for box in boxes if not box.is_empty]


def changed_cells(before: OccupancyGrid, after: OccupancyGrid) -> BoolArray:
    """Return bool (rows, cols) of the newer grid, the cells of the older one whose class differs.

    Cells by which the map grew are left out, as updates look at them anyway.

    Raises `InvalidValueError` when the newer grid does not cover the older one, cell on cell.
    """
    rows, cols = shift_of(before, after, otherwise="begin a new replay")
    changed = np.zeros(after.shape, np.bool_)
    inside = np.s_[rows : rows + before.shape[0], cols : cols + before.shape[1]]
    changed[inside] = after.classes[inside] != before.classes
    return changed


def _settled(draft: CellDraft) -> Events:
    """Give the places of a draft the numbers of old ones as far as these have heirs.

    See `heirs_of`. Most places bear their final numbers already.
    """
    first = draft.before.next_place
    moved: list[list[int]] = draft.tiles.moved(draft.before.tiles).tolist()
    areas = draft.before.places.areas(
        sorted({place for overlap in moved for place in overlap[:2] if NO_PLACE < place < first})
    )
    stay = dict(areas)
    overlaps: list[Overlap] = []
    for old, went_to, cells in moved:
        if old != NO_PLACE:
            overlaps.append((old, went_to, cells))
            stay[old] -= cells
    overlaps += [(old, old, cells) for old, cells in stay.items() if cells > 0]
    heirs = heirs_of(overlaps, areas)
    name = dict(heirs.name)
    new = {place for _, place, _ in overlaps} | set(draft.places.numbers(first))
    for place in sorted(new - name.keys() - {NO_PLACE}):
        name[place] = place
        if place < first:
            name[place] = draft.next_place
            draft.next_place += 1
    _renumber(draft, {place: final for place, final in name.items() if place != final})
    now = draft.places.areas([*name.values()])
    areas_now = {place: now[final] for place, final in name.items()}
    return events_of(overlaps, Heirs(heirs.of, name), areas_now, first)


def _renumber(draft: CellDraft, name: dict[int, int]) -> None:
    if not name:
        return
    tiles, rows = draft.tiles, draft.places.read([*name])
    boxes = [Box(*around) for around in rows["box"].tolist()]
    # A final number may be that of another place until now: all cells are found first.
    masks = [tiles.planes(box)[0] == number for number, box in zip(name, boxes, strict=True)]
    for final, box, mask in zip(name.values(), boxes, masks, strict=True):
        planes = tiles.planes(box)
        planes[0][mask] = final
        tiles.put(box, planes)
    draft.places.drop(name)
    draft.places.write([*name.values()], rows)
