"""What a version of the cells and places consists of."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.tiles import CELL, NO_PLACE, Box, Tiles
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.record import SURVIVES, BuildStats, Record

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from hybridnav._base.typing import AnyArray, BoolArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.pyramid import Linkage

# The table of places.

PLACE = np.dtype(
    [
        ("area", np.int64),
        ("cell", np.int32, (2,)),
        ("box", np.int32, (4,)),
        ("part", np.int32),
        ("is_stale", np.bool_),
    ],
    align=True,
)
"""A place: its cells, 0 where there is no place; its surviving cell; its least row and column, and
the first ones beyond it; the part of the map that it lies in, which keeps it from places of other
parts, -1 for none (see `start.parts_of`); whether the levels in it are those of older cells."""


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
        self._columns: tuple[AnyArray, ...] | None = None

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

    def has(self, place: int) -> bool:
        """Return whether there is such a place."""
        return 0 <= place < _NONE and len(self.known([place])) > 0

    def known(self, places: Iterable[int]) -> list[int]:
        """Return those of some numbers that are places."""
        numbers = np.array([*places], np.int64)
        numbers = numbers[self._has(numbers)]
        found: list[int] = numbers[self.read(numbers)["area"] > 0].tolist()
        return found

    def read(self, places: Sequence[int] | LongArray) -> AnyArray:
        """Return the rows of some places, `PLACE` (n,)."""
        rows: AnyArray = self._rows[np.searchsorted(self._numbers, np.asarray(places, np.int64))]
        return rows

    def areas(self, places: Sequence[int]) -> dict[int, int]:
        """Return how many cells each of some places has."""
        at = np.searchsorted(self._numbers, np.asarray(places, np.int64))
        return dict(zip(places, self._rows["area"][at].tolist(), strict=True))

    def write(self, places: Sequence[int] | LongArray, rows: AnyArray) -> None:
        """Set the rows of some places, all different."""
        numbers = np.asarray(places, np.int64)
        self._own()
        new = numbers[~self._has(numbers)]
        if len(new):
            self._add(new)
        self._rows[np.searchsorted(self._numbers, numbers)] = rows

    def drop(self, places: Iterable[int]) -> None:
        """Forget some places."""
        gone = list(places)
        self.write(gone, np.zeros(len(gone), PLACE))

    def columns(self) -> tuple[AnyArray, ...]:
        """Return the numbers, and all of `PLACE` but with the parts last, to change."""
        self._own()
        if self._columns is None:
            names = "area", "cell", "box", "is_stale", "part"
            self._columns = self._numbers, *(self._rows[name] for name in names)
        return self._columns

    def numbers(self, first: int = 0) -> list[int]:
        """Return the numbers of all places from a first one on, ascending."""
        begin = int(np.searchsorted(self._numbers, first))
        found: list[int] = self._numbers[begin:][self._rows["area"][begin:] > 0].tolist()
        return found

    def stale(self) -> LongArray:
        """Return the places with levels of older cells, int64 (n,), ascending."""
        found: LongArray = self._numbers[self._rows["is_stale"] & (self._rows["area"] > 0)]
        return found

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
        """Return which of some numbers have a row."""
        at = np.searchsorted(self._numbers, numbers)
        inside = at < len(self._numbers)
        found: BoolArray = inside.copy()
        found[inside] = self._numbers[at[inside]] == numbers[inside]
        return found

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
        """Copy some rows, with space for more."""
        rows = np.zeros(len(stays) + more + _SPACE, PLACE)
        numbers = np.full(len(rows), _NONE)
        numbers[: len(stays)] = self._numbers[stays]
        _words(rows)[: len(stays)] = _words(self._rows)[stays]
        self._numbers, self._rows, self._used = numbers, rows, len(stays)
        self._is_own, self._columns = True, None

    def _add(self, numbers: LongArray) -> None:
        """Make rows for numbers that have none."""
        self.append(0, np.zeros(len(numbers), PLACE))
        self._numbers[self._used - len(numbers) : self._used] = numbers
        used = self._numbers[: self._used]
        last = used[max(self._used - len(numbers) - 1, 0) :]
        if (last[:-1] < last[1:]).all():  # above all others
            return
        order = np.argsort(used, kind="stable")
        self._numbers[: self._used] = used[order]
        _words(self._rows)[: self._used] = _words(self._rows)[order]


def _rows(words: LongArray) -> AnyArray:
    """Return as rows what `_words` returned."""
    rows: AnyArray = words.view(PLACE).reshape(len(words))
    return rows


def _words(rows: AnyArray) -> LongArray:
    """Return rows as numbers, which numpy copies ten times as fast."""
    words: LongArray = rows.view(np.int64).reshape(len(rows), PLACE.itemsize // 8)
    return words


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


# Versions made from dense pyramids, and dense pyramids from versions.


def state_of(pyramid: DualGraphPyramid) -> State:
    """Return the first version of a pyramid, without the levels above its places."""
    level = pyramid[pyramid.place_level]
    record = pyramid.record.up_to(level.index)
    rows, cols = shape = pyramid.grid.shape
    cells = np.zeros(shape, CELL)
    end = record.vertex_end.reshape(shape)
    cells["class"], cells["end"], cells["place"] = pyramid.grid.classes, end, level.field_of
    cells["edges"] = record.edge_end.reshape(rows, cols, 2)
    row, col = np.nonzero((end > 0) & (end < SURVIVES))
    parent = record.vertex_parent.reshape(shape)[row, col]
    cells["parent"][row, col, 0] = parent // cols - row
    cells["parent"][row, col, 1] = parent % cols - col
    tiles = Tiles({})
    tiles.write(Box(0, 0, rows, cols), cells)
    tiles.close()
    table = np.zeros(level.n_vertices, PLACE)
    table["area"], table["cell"] = level.areas, level.cells
    table["box"] = level.boxes + np.array([0, 0, 1, 1])
    table["part"] = -1
    if pyramid.linkage == "throats":
        # Loading a version needs no decimation.
        from hybridnav.pyramid.decimation import squared_limit  # noqa: PLC0415
        from hybridnav.pyramid.start import parts_of  # noqa: PLC0415

        limit = squared_limit(pyramid.merge_distance_m, pyramid.grid.resolution_m)
        table["part"] = parts_of(pyramid.grid.classes, limit).at(level.cells)
    places = PlaceTable()
    places.write(range(level.n_vertices), table)
    places.close()
    n_ends = np.bincount(end.ravel(), minlength=SURVIVES + 1).astype(np.int64)
    return State(tiles, places, n_ends, level.n_vertices)


def pyramid_of(
    state: State, box: Box, grid: OccupancyGrid, built: tuple[float, Linkage, int]
) -> DualGraphPyramid:
    """Return a version as dense arrays.

    `box`: the cells of its grid among those of the tiles; `built`: the merge distance in metres,
    the linkage and the seed by which it was built.
    """
    cells = state.tiles.read(box)
    differs = cells["class"] != grid.classes
    if differs.any():
        row, col = np.argwhere(differs)[0].tolist()
        raise InvalidValueError(
            f"{int(differs.sum())} cells changed outside what the updates stated, the first at "
            f"row {row}, column {col}: pass changed=None to compare all cells"
        )
    _close_levels(cells, state.vertex_ends)
    record = _record_of(cells)
    record.vertex_parent[cells["place"].ravel() == NO_PLACE] = -1
    stats = BuildStats()
    pyramid = DualGraphPyramid(grid, *built, stats, None, record)
    n_levels = int(np.count_nonzero(state.vertex_ends[1:SURVIVES])) + 1
    stats.tops.append(n_levels - 1)
    stats.sizes.extend(record.sizes(grid.shape[1], n_levels))
    return pyramid


def _close_levels(cells: AnyArray, vertex_ends: LongArray) -> None:
    """Give the levels at which cells end the numbers 1, 2, ..."""
    levels = np.flatnonzero(vertex_ends[1:SURVIVES]) + 1
    new_level = np.arange(SURVIVES + 1, dtype=np.uint8)
    new_level[levels] = np.arange(1, len(levels) + 1)
    new_end = np.arange(SURVIVES + 1, dtype=np.uint8)
    new_end[2 * levels] = 2 * new_level[levels]
    new_end[2 * levels + 1] = 2 * new_level[levels] + 1
    cells["end"], cells["edges"] = new_level[cells["end"]], new_end[cells["edges"]]


def _record_of(cells: AnyArray) -> Record:
    """Return the record of a window, flat."""
    rows, cols = cells.shape
    steps = cells["parent"].astype(np.int32)
    parent = np.arange(rows * cols, dtype=np.int32).reshape(rows, cols)
    parent += steps[..., 0] * np.int32(cols) + steps[..., 1]
    return Record(
        cells["end"].ravel(),
        np.where(cells["end"] == SURVIVES, -1, parent).ravel().astype(np.int32),
        cells["edges"].ravel(),
    )
