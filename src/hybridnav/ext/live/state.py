"""A version of the cells and places, and the draft of the next one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.identities import NO_PLACE
from hybridnav.ext.live.kernels import merging as _merge_kernels
from hybridnav.ext.live.kernels.cells import take_out
from hybridnav.ext.live.kernels.near import PlaceColumns, box_groups
from hybridnav.ext.live.tiles import SIDE, Box, Differing, Tiles
from hybridnav.maps import OccupancyGrid
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.contraction import Window
from hybridnav.pyramid.decimation import Criterion, contract_alone, contract_places, squared_limit
from hybridnav.pyramid.record import SURVIVES, BuildStats, Patch, Record
from hybridnav.pyramid.start import PERIOD, parts_of

# The table of places.

PLACE = np.dtype(
    [
        ("area", np.int64),
        ("cell", np.int32, (2,)),
        ("box", np.int32, (4,)),
        ("part", np.int32),
    ],
    align=True,
)
"""A place: its cells, 0 where there is no place; its surviving cell; its least row and column, and
the first ones beyond it; the part of the map that it lies in, which keeps it from places of other
parts, -1 for none (see `start.parts_of`)."""


_NONE = np.iinfo(np.int64).max
"""Number of a row that is not used."""
_SPACE = 256
"""Rows that a copy of the table has to spare."""


@copies_alike
class PlaceTable:
    """Places by number. A number is never used again.

    A new version copies the table when it first changes it, which takes 10 us for 3,000 places.

    `numbers`: int64 (n,), ascending; None for no place; `rows`: `PLACE` (n,), read-only.
    """

    def __init__(self, numbers: LongArray | None = None, rows: AnyArray | None = None) -> None:
        self._numbers = np.empty(0, np.int64) if numbers is None else numbers
        self._rows = np.empty(0, PLACE) if rows is None else rows
        self._used = self._count = len(self._numbers)
        self._is_own = False
        self._columns: PlaceColumns | None = None

    def next_version(self) -> PlaceTable:
        """Return a table that shares all with this one."""
        table = PlaceTable(self._numbers, self._rows)
        table._used, table._count = self._used, self._count
        return table

    def close(self) -> None:
        """Make the table read-only: the version is complete."""
        if self._is_own:
            frozen(self._numbers)
            frozen(self._rows)
            self._is_own, self._columns = False, None
            self._count = int(np.count_nonzero(self._rows["area"]))

    @property
    def count(self) -> int:
        """How many places there were when the table was closed."""
        return self._count

    def known(self, places: Iterable[int]) -> list[int]:
        """Return those of some numbers that are places."""
        numbers = np.array([*places], np.int64)
        numbers = numbers[self._has(numbers)]
        return numbers[self.read(numbers)["area"] > 0].tolist()

    def read(self, places: Sequence[int] | LongArray) -> AnyArray:
        """Return the rows of some places, `PLACE` (n,)."""
        return self._rows[np.searchsorted(self._numbers, np.asarray(places, np.int64))]

    def areas(self, places: Sequence[int]) -> dict[int, int]:
        """Return how many cells each of some places has."""
        return dict(zip(places, self.read(places)["area"].tolist(), strict=True))

    def write(self, places: Sequence[int] | LongArray, rows: AnyArray) -> None:
        """Set the rows of some places, all different; new ones have the next numbers in turn."""
        numbers = np.asarray(places, np.int64)
        self._own()
        new = numbers[~self._has(numbers)]
        if len(new):
            self.append(int(new[0]), np.zeros(len(new), PLACE))
        self._rows[np.searchsorted(self._numbers, numbers)] = rows

    def drop(self, places: Iterable[int]) -> None:
        """Forget some places."""
        gone = list(places)
        self.write(gone, np.zeros(len(gone), PLACE))

    def columns(self) -> PlaceColumns:
        """Return the numbers, and all of `PLACE`, to change."""
        self._own()
        if self._columns is None:
            names = PLACE.names or ()
            self._columns = PlaceColumns(self._numbers, *(self._rows[name] for name in names))
        return self._columns

    def numbers(self, first: int = 0) -> list[int]:
        """Return the numbers of all places from a first one on, ascending."""
        begin = int(np.searchsorted(self._numbers, first))
        return self._numbers[begin:][self._rows["area"][begin:] > 0].tolist()

    def append(self, first: int, rows: AnyArray) -> LongArray:
        """Enter places with the numbers from one on that is above all others; return these."""
        numbers = first + np.arange(len(rows))
        if len(rows):
            self._own(len(rows))
            end = self._used + len(rows)
            self._numbers[self._used : end] = numbers
            self._rows[self._used : end] = rows
            self._used = end
        return numbers

    def _has(self, numbers: LongArray) -> BoolArray:
        at = np.searchsorted(self._numbers, numbers)
        inside = at < len(self._numbers)
        has: BoolArray = inside.copy()
        has[inside] = self._numbers[at[inside]] == numbers[inside]
        return has

    def _own(self, more: int = 0) -> None:
        """Copy what another version has too; make sure that there is space for more rows."""
        if not self._is_own and 2 * self._count < self._used:  # most rows are places no more
            self._copy(np.flatnonzero(self._rows["area"][: self._used] > 0), more)
        elif self._used + more > len(self._numbers):
            self._copy(np.arange(self._used), more)
        elif not self._is_own:
            self._numbers, self._rows = self._numbers.copy(), _rows(_words(self._rows).copy())
            self._is_own, self._columns = True, None

    def _copy(self, stays: LongArray, more: int) -> None:
        rows = np.zeros(len(stays) + more + _SPACE, PLACE)
        numbers = np.full(len(rows), _NONE)
        numbers[: len(stays)] = self._numbers[stays]
        _words(rows)[: len(stays)] = _words(self._rows)[stays]
        self._numbers, self._rows, self._used = numbers, rows, len(stays)
        self._is_own, self._columns = True, None


def _rows(words: LongArray) -> AnyArray:
    """Return as rows what `_words` returned."""
    return words.view(PLACE).reshape(len(words))


def _words(rows: AnyArray) -> LongArray:
    """Return rows as numbers, which numpy copies ten times as fast."""
    return rows.view(np.int64).reshape(len(rows), PLACE.itemsize // 8)


class State(NamedTuple):
    """All that a version consists of."""

    tiles: Tiles
    """Its cells."""
    places: PlaceTable
    """Its places."""
    next_place: int
    """The least number that no place has ever had."""


# Versions made from dense pyramids, and dense pyramids from versions.


def state_of(pyramid: DualGraphPyramid) -> State:
    """Return the first version of a pyramid: its places."""
    level = pyramid[pyramid.place_level]
    tiles = Tiles()
    planes = level.field_of.astype(np.int32), pyramid.grid.classes.copy()
    tiles.put(Box(0, 0, *pyramid.grid.shape), planes)
    tiles.close()
    table = np.zeros(level.n_vertices, PLACE)
    table["area"], table["cell"] = level.areas, level.cells
    table["box"] = level.boxes + np.array([0, 0, 1, 1])
    table["part"] = -1
    if pyramid.linkage == "throats":
        limit = squared_limit(pyramid.merge_distance_m, pyramid.grid.resolution_m)
        table["part"] = parts_of(pyramid.grid.classes, limit).at(level.cells)
    places = PlaceTable()
    places.append(0, table)
    places.close()
    return State(tiles, places, level.n_vertices)


def pyramid_of(
    state: State, box: Box, grid: OccupancyGrid, merge_distance_m: float, criterion: Criterion
) -> DualGraphPyramid:
    """Return a version as dense arrays: each place is contracted to its surviving cell.

    `box`: the cells of its grid among those of the tiles; `criterion`: that of the merge distance.

    To keep the levels of places that stay, and contract the others beside them, was not faster.
    """
    place, classes = state.tiles.planes(box)
    check_stated(classes, grid.classes, (0, 0))
    numbers = state.places.numbers()
    index_of = np.zeros(state.next_place + 1, np.int32)  # the last one is that of no place
    index_of[numbers] = np.arange(1, len(numbers) + 1)
    survivors = np.zeros(box.shape, np.bool_)
    row, col = (state.places.read(numbers)["cell"] - np.array(box[:2])).T
    survivors[row, col] = True
    record = contract_places(index_of[place], survivors, criterion)
    ends = record.vertex_end[record.vertex_end < SURVIVES]
    n_levels = int(ends.max(initial=0)) + 1
    stats = BuildStats(record.sizes(grid.shape[1], n_levels), tops=[n_levels - 1])
    linkage, _, seed = criterion
    return DualGraphPyramid(grid, merge_distance_m, linkage, seed, stats, None, record)


def check_stated(classes: ByteArray, of_grid: ByteArray, low: tuple[int, int]) -> None:
    """Refuse cells whose class is not that of the grid; `low`: the first one of both arrays."""
    differs = classes != of_grid
    if differs.any():
        row, col = (np.argwhere(differs)[0] + low).tolist()
        raise InvalidValueError(
            f"{int(differs.sum())} cells changed outside what the updates stated, the first at "
            f"row {row}, column {col}: pass changed=None to compare all cells"
        )


def patch_of(before: State, now: State, box: Box, criterion: Criterion) -> Patch:
    """Return what differs between the records of two versions of a map.

    `box`: the cells of both grids among those of the tiles.
    """
    lost, gained = set[int](), set[int]()
    for tile in now.tiles.differing_from(before.tiles):
        old, new = (of.tiles.planes(tile)[0] for of in (before, now))
        differs = old != new
        lost.update(np.unique(old[differs]).tolist())
        gained.update(np.unique(new[differs]).tolist())
    numbers = np.intersect1d(before.places.numbers(), now.places.numbers())
    moved = (before.places.read(numbers)["cell"] != now.places.read(numbers)["cell"]).any(axis=1)
    lost.update(numbers[moved].tolist())
    both = sorted((lost | gained) - {NO_PLACE})  # a place whose cells differ is another one
    rows = [of.places.read(of.places.known(both)) for of in (before, now)]
    boxes = np.concatenate([each["box"] for each in rows])
    if not len(boxes):
        none = np.zeros(1, np.uint8)
        return Patch((0, 0), np.zeros((1, 1), np.bool_), Record(none, np.zeros(1, np.int32), none))
    low = np.maximum(boxes[:, :2].min(axis=0) - np.array(box[:2]), 0) // PERIOD * PERIOD
    window = Box(*(low + box[:2]).tolist(), *boxes[:, 2:].max(axis=0).tolist())
    place, _ = now.tiles.planes(window)
    was = np.isin(before.tiles.planes(window)[0], both)
    index_of = np.zeros(now.next_place + 1, np.int32)
    index_of[now.places.known(both)] = np.arange(1, len(rows[1]) + 1)
    survivors = np.zeros(window.shape, np.bool_)
    survivors[tuple((rows[1]["cell"] - np.array(window[:2])).T)] = True
    row, col = low.tolist()
    at = Window(row, col, box.shape[1])
    record = contract_places(index_of[place], survivors, criterion, window=at)
    return Patch((row, col), was, record)


# The draft of a next version, in which single cells move between places.

_SMALL_CELLS = 512 * 512
"""Cells of a window below which it takes longer to divide it than to look at all of it."""


class CellDraft:
    """The next version while it is made; the version before stays as it is.

    Cells that change class leave their places, and join those beside them with the nearest
    surviving cells within the merge distance; what is left of them makes places of its own.

    `before`: the version before; `criterion`: when two fields merge; its linkage is "throats" or
    "radius".
    """

    def __init__(self, before: State, criterion: Criterion) -> None:
        self.before = before
        self.tiles = before.tiles.next_version()
        self.places = before.places.next_version()
        self.next_place = before.next_place
        self.cells: LongArray = np.empty((0, 2), np.int64)
        self.criterion = criterion
        self.limit = criterion.limit

    def change(self, boxes: Iterable[Box], classes: ByteArray, low: tuple[int, int]) -> None:
        """Set the classes of the cells of boxes, and move the cells whose class changes.

        For the parameters see `Tiles.differing`.
        """
        differing = self.tiles.differing(boxes, classes, low)
        self.cells = np.stack([differing.row, differing.col], axis=1)
        if len(differing.row):
            for cells, box in self._groups(differing):
                self._move(cells, box)

    def _groups(self, differing: Differing) -> Iterator[tuple[Differing, Box]]:
        """Yield changed cells that lie far enough from others, and a box round their places."""
        box = self._box_round(differing)
        if box.shape[0] * box.shape[1] <= _SMALL_CELLS:
            yield differing, box
            return
        places = sorted({*differing.place.tolist()} - {NO_PLACE})
        boxes = self.places.read(places)["box"].astype(np.int64)
        keys = ((differing.row // SIDE) << 32) + differing.col // SIDE
        _, first, index = np.unique(keys, return_index=True, return_inverse=True)
        of_tiles = np.stack([differing.row[first], differing.col[first]], axis=1) // SIDE * SIDE
        joined = np.concatenate([boxes, np.hstack([of_tiles, of_tiles + SIDE])])
        group_of = box_groups(joined)
        of_cell = group_of[len(places) + index]
        has = differing.place >= 0
        of_cell[has] = group_of[np.searchsorted(places, differing.place[has])]
        for group in np.unique(of_cell).tolist():
            inside = of_cell == group
            cells = Differing(*(values[inside] for values in differing))
            yield self._as_now(cells, Box(*joined[group].tolist()))

    def _as_now(self, cells: Differing, box: Box) -> tuple[Differing, Box]:
        """Return cells with the places that they are in after other groups, and a box round."""
        place = self.tiles.planes(box)[0][cells.row - box.low_row, cells.col - box.low_col]
        cells = cells._replace(place=place.astype(np.int64))
        return cells, self._box_round(cells)

    def _box_round(self, cells: Differing) -> Box:
        """Return the least box that holds cells and their places."""
        at = np.stack([cells.row, cells.col], axis=1)
        boxes = self.places.read(np.unique(cells.place[cells.place >= 0]))["box"]
        boxes = np.concatenate([np.hstack([at, at + 1]), boxes])
        return Box(*boxes[:, :2].min(axis=0).tolist(), *boxes[:, 2:].max(axis=0).tolist())

    def _move(self, differing: Differing, box: Box) -> None:
        """Move changed cells, and merge places that may merge then."""
        window = _Window(self, box.widened(1))
        first = self.next_place
        waiting, lost, altered = window.take_out(differing)
        joined, moved, boxes = _merge_kernels.let_join(
            window.planes,
            window.low,
            self.places.columns(),
            (altered, first, self.next_place),
            waiting,
            self.limit,
        )
        made = window.make_places(boxes) if len(boxes) else boxes[:, 0]
        beyond = _merge_kernels.merge_after(
            window.planes,
            window.low,
            self.places.columns(),
            _merge_kernels.AlteredPlaces(
                made, moved, lost, first, self.next_place, self.before.next_place
            ),
            joined,
            self.limit,
        )
        self.tiles.put(window.box, window.planes)
        while len(beyond):
            beyond = np.concatenate([self._merge(pair) for pair in unique_rows(beyond).rows])

    def _merge(self, pair: LongArray) -> LongArray:
        """Merge a pair of places if they may merge, and what may merge with them then."""
        if len(self.places.known(pair)) < len(pair):
            return np.empty((0, 2), np.int64)
        some, other = (Box(*box) for box in self.places.read(pair)["box"].tolist())
        window = _Window(self, some.joined(other).widened(1))
        table, first = self.places.columns(), self.before.next_place
        beyond: LongArray = _merge_kernels.merge_pairs(
            window.planes, window.low, table, pair.reshape(1, 2), self.limit, first
        )
        self.tiles.put(window.box, window.planes)
        return beyond

    def close(self) -> State:
        """Return the version."""
        self.tiles.close()
        self.places.close()
        return State(self.tiles, self.places, self.next_place)


class _Window:
    """A box of cells of a draft, which change before they are written back."""

    def __init__(self, draft: CellDraft, box: Box) -> None:
        self._draft = draft
        self.box = box
        self.low = box[:2]
        self.planes = draft.tiles.planes(box)

    def take_out(self, differing: Differing) -> tuple[LongArray, LongArray, LongArray]:
        """Take changed cells out of their places.

        Return flat cells that wait for a place, the places that lost cells, and those of them that
        have to be looked at again beside the new ones.
        """
        draft, places = self._draft, self._draft.places
        cells = (differing.row - self.low[0]) * self.box.shape[1] + differing.col - self.low[1]
        self.planes[1].ravel()[cells] = differing.of_class
        parents, lost, altered = take_out(
            self.planes[0], self.low, places.columns(), (cells, differing.place), draft.next_place
        )
        if len(parents):
            self._new(places.read(parents))
        return cells[differing.of_class > 0], lost, altered

    def _new(self, rows: AnyArray) -> LongArray:
        """Enter places with new numbers; return these."""
        first = self._draft.next_place
        self._draft.next_place += len(rows)
        return self._draft.places.append(first, rows)

    def make_places(self, boxes: LongArray) -> LongArray:
        """Make places of connected cells that no place took in; return those that may be small.

        They have the next numbers, in the window too; their boxes are given.
        """
        low = np.array(self.low)
        rows = np.zeros(len(boxes), PLACE)
        rows["area"], rows["part"], rows["box"] = 1, -1, boxes + np.tile(low, 2)
        rows["cell"] = (boxes[:, :2] + boxes[:, 2:]) // 2 + low
        numbers = self._new(rows)
        sides = boxes[:, 2:] - boxes[:, :2] - 1
        is_large = (sides * sides).sum(axis=1) >= self._draft.limit
        for at in np.flatnonzero(is_large).tolist():
            self._contract(int(numbers[at]), boxes[at])
        return numbers[~is_large]

    def _contract(self, number: int, box: LongArray) -> None:
        """Put places, as contraction makes them, in the place of one that is too large."""
        inside = np.s_[box[0] : box[2], box[1] : box[3]]
        place, of_class = self.planes[0][inside], self.planes[1][inside]
        mask = place == number
        fields = contract_alone(of_class * mask, self._draft.criterion)
        rows = np.zeros(len(fields.survivors), PLACE)
        low = np.array(self.low) + box[:2]
        rows["area"], rows["part"] = fields.areas, -1
        rows["cell"] = np.stack(np.divmod(fields.survivors, mask.shape[1]), axis=1) + low
        rows["box"] = fields.boxes + np.array([0, 0, 1, 1]) + np.tile(low, 2)
        new = self._new(rows)
        place[mask] = new[fields.field_of[mask]]
        self._draft.places.drop([number])
