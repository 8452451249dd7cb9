"""Cells in square tiles that versions share: a change copies the tiles that it touches."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.typing import ByteArray, IntArray, LongArray
from hybridnav.ext.live.identities import NO_PLACE
from hybridnav.ext.live.kernels import tiles as _tile_kernels

SIDE = 64
"""Rows and columns of a tile. A copy takes 3 us: larger tiles are beyond the size for which memory
is taken anew from the system."""

_MANY = 16
"""Tiles that a kernel is called with at once."""
_FEW_ROWS = 256
"""Rows that a list of cells begins with."""
_Tiles = tuple["IntArray | ByteArray", ...]
"""The places or the classes of `_MANY` tiles."""


class Box(NamedTuple):
    """A rectangle of cells: the least row and column, and the first ones beyond it."""

    low_row: int
    """The least row."""
    low_col: int
    """The least column."""
    high_row: int
    """The first row beyond."""
    high_col: int
    """The first column beyond."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.high_row - self.low_row, self.high_col - self.low_col

    @property
    def is_empty(self) -> bool:
        """Whether it holds no cell."""
        return self.high_row <= self.low_row or self.high_col <= self.low_col

    def widened(self, cells: int) -> Box:
        """Return the box with so many more rows and columns on each side."""
        low_row, low_col, high_row, high_col = self
        return Box(low_row - cells, low_col - cells, high_row + cells, high_col + cells)

    def narrowed(self, cells: int, within: Box) -> Box:
        """Return the box without so many rows and columns on the sides inside another box."""
        low_row, low_col, high_row, high_col = self
        return Box(
            min(low_row + cells * (low_row > within.low_row), within.high_row),
            min(low_col + cells * (low_col > within.low_col), within.high_col),
            max(high_row - cells * (high_row < within.high_row), within.low_row),
            max(high_col - cells * (high_col < within.high_col), within.low_col),
        )

    def moved(self, rows: int, cols: int) -> Box:
        """Return the box moved by so many rows and columns."""
        low_row, low_col, high_row, high_col = self
        return Box(low_row + rows, low_col + cols, high_row + rows, high_col + cols)

    def common(self, other: Box) -> Box:
        """Return the intersection with another box."""
        return Box(*map(max, self[:2], other[:2]), *map(min, self[2:], other[2:]))

    def joined(self, other: Box) -> Box:
        """Return the least box that holds this one and another one."""
        return Box(*map(min, self[:2], other[:2]), *map(max, self[2:], other[2:]))

    def scaled(self, side: int) -> Box:
        """Return the cells of a box of tiles of so many cells a side."""
        return Box(*(side * at for at in self))

    def inside(self, outer: Box) -> tuple[slice, slice]:
        """Return the slices by which an array of the outer box holds this one."""
        return (
            slice(self.low_row - outer.low_row, self.high_row - outer.low_row),
            slice(self.low_col - outer.low_col, self.high_col - outer.low_col),
        )


class Differing(NamedTuple):
    """Cells whose class changes."""

    row: LongArray
    """int64 (n,), rows."""
    col: LongArray
    """int64 (n,), columns."""
    place: LongArray
    """int64 (n,), the places that they are in, -1 for none."""
    of_class: ByteArray
    """uint8 (n,), the `CellClass` that they have now."""


class Tile(NamedTuple):
    """The cells of a square, in arrays of shape `(SIDE, SIDE)`."""

    place: IntArray
    """int32, the number of the place of each cell, `NO_PLACE` for none."""
    of_class: ByteArray
    """uint8, its `CellClass`."""


_EMPTY = Tile(
    frozen(np.full((SIDE, SIDE), NO_PLACE, np.int32)),
    frozen(np.zeros((SIDE, SIDE), np.uint8)),
)
"""A tile of cells that are no vertices, as is all that lies outside the tiles."""


@copies_alike
class Tiles:
    """The tiles of a version, and those of the next one while it is made.

    Arrays of a version never change: those of a tile are copied when they first change. All that a
    kernel reads is read-only, those copies too, because it takes arrays of one type only.
    """

    def __init__(self) -> None:
        self._rows: dict[int, dict[int, Tile]] = {}
        """The tiles of each row of tiles, by their column; versions share rows, too."""
        self._own_rows: set[int] = set()
        """Rows that may be written to."""
        self._own: dict[tuple[int, int], tuple[IntArray, ByteArray]] = {}
        """The places and classes that may be written to."""

    def next_version(self) -> Tiles:
        """Return tiles that share all arrays of these."""
        tiles = Tiles()
        tiles._rows = dict(self._rows)
        return tiles

    def close(self) -> None:
        """Forget what may be written to: the version is complete."""
        self._own_rows.clear()
        self._own.clear()

    def planes(self, box: Box) -> tuple[IntArray, ByteArray]:
        """Return copies of the places and the classes of the cells of a box."""
        planes = np.empty(box.shape, np.int32), np.empty(box.shape, np.uint8)
        for begin, tiles in self._groups_of(box):
            _tile_kernels.read_tiles(tiles, begin, box, planes)
        return planes

    def differing(
        self, boxes: Iterable[Box], classes: ByteArray, low: tuple[int, int]
    ) -> Differing:
        """Return the cells of boxes whose class is another than that given for a map.

        `boxes`: boxes on the map without common cells; `classes`: uint8 (rows, cols), `CellClass`
        of the cells of the map; `low`: row and column of its first cell.
        """
        rows, count = np.empty((_FEW_ROWS, 4), np.int64), 0
        for box in boxes:
            for begin, tiles in self._groups_of(box):
                rows, count = _tile_kernels.find_differing(
                    tiles, begin, box, (classes, low), rows, count
                )
        row, col, place, of_class = rows[:count].T.copy()
        return Differing(row, col, place, of_class.astype(np.uint8))

    def _groups_of(self, box: Box) -> Iterator[tuple[int, tuple[_Tiles, _Tiles]]]:
        """Yield the places and the classes of the tiles that a box meets, `_MANY` at a time.

        They come in the order of rows of tiles, after the number of the first one; what lies beyond
        the last one is empty.
        """
        tiles = [self._get(key) for key in _keys_of(box)]
        tiles += [_EMPTY] * (-len(tiles) % _MANY)
        for begin in range(0, len(tiles), _MANY):
            places, classes = zip(*tiles[begin : begin + _MANY], strict=True)
            yield begin, (places, classes)

    def put(self, box: Box, planes: tuple[IntArray, ByteArray]) -> None:
        """Set the places and the classes of the cells of a box; tiles in which all is equal stay
        shared.

        Cells whose class changes are taken to change their place too: places have one class.
        """
        keys = [*_keys_of(box)]
        for begin, tiles in self._groups_of(box):
            differs = _tile_kernels.tiles_differ(tiles[0], begin, box, planes[0])
            for at in differs.tolist():
                _tile_kernels.put_cells(self._owned(keys[at]), keys[at], box, planes)

    def _owned(self, key: tuple[int, int]) -> tuple[IntArray, ByteArray]:
        """Return the places and the classes of a tile, to be written to."""
        own = self._own.get(key)
        if own is None:
            tile = self._get(key)
            own = tile.place.copy(), tile.of_class.copy()
            self._set(key, Tile(frozen(own[0].view()), frozen(own[1].view())))
            self._own[key] = own
        return own

    def moved(self, before: Tiles) -> LongArray:
        """Return how many cells went from one place to another, until `close`.

        int64 (n, 3): the place in a version before, the one here, and the cells; no pair of places
        comes twice.
        """
        keys, runs, count = sorted(self._own), np.empty((_FEW_ROWS, 2), np.int64), 0
        for begin in range(0, len(keys), _MANY):
            some = keys[begin : begin + _MANY]
            more = (_EMPTY.place,) * (_MANY - len(some))
            old = *(before._get(key).place for key in some), *more
            new = *(self._get(key).place for key in some), *more
            runs, count = _tile_kernels.moved_cells(old, new, runs, count)
        return _tile_kernels.sums_of(runs, count)

    def differing_from(self, before: Tiles) -> list[Box]:
        """Return the boxes of the tiles that another version does not share."""
        keys = []
        for row in self._rows.keys() | before._rows.keys():
            mine, others = self._rows.get(row, {}), before._rows.get(row, {})
            if mine is not others:
                cols = mine.keys() | others.keys()
                keys += [(row, col) for col in cols if mine.get(col) is not others.get(col)]
        return [Box(row, col, row + 1, col + 1).scaled(SIDE) for row, col in sorted(keys)]

    def arrays(self) -> dict[tuple[int, int], Tile]:
        """Return each tile, by row and column of tiles."""
        return {(row, col): tile for row, of in self._rows.items() for col, tile in of.items()}

    def _get(self, key: tuple[int, int]) -> Tile:
        return self._rows.get(key[0], {}).get(key[1], _EMPTY)

    def _set(self, key: tuple[int, int], tile: Tile) -> None:
        row, col = key
        if row not in self._own_rows:
            self._rows[row] = dict(self._rows.get(row, {}))
            self._own_rows.add(row)
        self._rows[row][col] = tile


def _keys_of(box: Box) -> Iterator[tuple[int, int]]:
    """Yield row and column of the tiles that a box meets."""
    if not box.is_empty:
        low_row, low_col, high_row, high_col = box
        rows = range(low_row // SIDE, -(-high_row // SIDE))
        yield from product(rows, range(low_col // SIDE, -(-high_col // SIDE)))
