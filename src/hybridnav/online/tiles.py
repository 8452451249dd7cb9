"""Cells in square tiles that versions share: a change copies the tiles that it touches."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._copies import frozen

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from hybridnav._typing import AnyArray

SIDE = 128
"""Rows and columns of a tile: a copy takes 20 us, and a table for 16 M cells has 1,024 tiles."""

CELL = np.dtype(
    [
        ("class", np.uint8),
        ("end", np.uint8),
        ("parent", np.int16, (2,)),
        ("edges", np.uint8, (2,)),
        ("place", np.int32),
    ]
)
"""A cell: its `CellClass`; the record of its vertex, the parent as a step in rows and columns, and
of its edges east and north (see `Record`); the number of its place. Steps instead of flat cells
stay what they are when the map grows."""

NO_PLACE = -1
NOTHING = frozen(np.array((0, 0, (0, 0), (0, 0), NO_PLACE), CELL))
"""A cell that is no vertex, as is all that lies outside the tiles."""


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
        return Box(
            max(self.low_row, other.low_row),
            max(self.low_col, other.low_col),
            min(self.high_row, other.high_row),
            min(self.high_col, other.high_col),
        )

    def joined(self, other: Box) -> Box:
        """Return the least box that holds this one and another one."""
        return Box(
            min(self.low_row, other.low_row),
            min(self.low_col, other.low_col),
            max(self.high_row, other.high_row),
            max(self.high_col, other.high_col),
        )

    def inside(self, outer: Box) -> tuple[slice, slice]:
        """Return the slices by which an array of the outer box holds this one."""
        return (
            slice(self.low_row - outer.low_row, self.high_row - outer.low_row),
            slice(self.low_col - outer.low_col, self.high_col - outer.low_col),
        )


class Tiles:
    """The tiles of a version, and those of the next one while it is made.

    Tiles of a version never change: `write` copies a tile when it first changes it.

    Parameters
    ----------
    tiles
        Read-only arrays of `CELL`, shape `(SIDE, SIDE)`, by row and column of tiles.
    """

    def __init__(self, tiles: Mapping[tuple[int, int], AnyArray]) -> None:
        self._tiles = dict(tiles)
        self._own: set[tuple[int, int]] = set()

    def next_version(self) -> Tiles:
        """Return tiles that share all arrays of these."""
        return Tiles(self._tiles)

    def close(self) -> None:
        """Make all tiles read-only: the version is complete."""
        for key in self._own:
            frozen(self._tiles[key])
        self._own.clear()

    def read(self, box: Box) -> AnyArray:
        """Return a copy of the cells of a box, `CELL` of its shape."""
        window = np.full(box.shape, NOTHING)
        for key, part in _tiles_of(box):
            tile = self._tiles.get(key)
            if tile is not None:
                window[part.inside(box)] = tile[_within(part, key)]
        return window

    def write(self, box: Box, window: AnyArray) -> None:
        """Set the cells of a box; tiles in which all is equal stay shared."""
        for key, part in _tiles_of(box):
            cells, within = window[part.inside(box)], _within(part, key)
            tile = self._tiles.get(key)
            if tile is None:
                tile = np.full((SIDE, SIDE), NOTHING)
            if _equal(tile[within], cells):
                continue
            if key not in self._own:
                tile = tile.copy()
                self._own.add(key)
                self._tiles[key] = tile
            tile[within] = cells

    def changed(self, before: Tiles) -> Iterator[tuple[AnyArray, AnyArray]]:
        """Yield each tile that is not shared with a version, as it is there and as it is here.

        Until `close`, the second array may be written to.
        """
        nothing = np.full((SIDE, SIDE), NOTHING)
        for key in sorted(self._own):
            yield before._tiles.get(key, nothing), self._tiles[key]

    def boxes(self) -> list[Box]:
        """Return the box of each tile."""
        return [
            Box(row * SIDE, col * SIDE, (row + 1) * SIDE, (col + 1) * SIDE)
            for row, col in sorted(self._tiles)
        ]

    def shared_with(self, other: Tiles) -> int:
        """Count the tiles that are the same array in both versions."""
        return sum(other._tiles.get(key) is tile for key, tile in self._tiles.items())

    def __len__(self) -> int:
        return len(self._tiles)


def _tiles_of(box: Box) -> Iterator[tuple[tuple[int, int], Box]]:
    """Yield the tiles that a box meets, and the part of the box in each."""
    if box.is_empty:
        return
    for row in range(box.low_row // SIDE, (box.high_row - 1) // SIDE + 1):
        for col in range(box.low_col // SIDE, (box.high_col - 1) // SIDE + 1):
            tile = Box(row * SIDE, col * SIDE, (row + 1) * SIDE, (col + 1) * SIDE)
            yield (row, col), box.common(tile)


def _within(part: Box, key: tuple[int, int]) -> tuple[slice, slice]:
    """Return the slices of a tile that hold a part of it."""
    row, col = key[0] * SIDE, key[1] * SIDE
    return part.inside(Box(row, col, row + SIDE, col + SIDE))


def _equal(some: AnyArray, others: AnyArray) -> bool:
    """Return whether two arrays of cells hold the same bytes."""
    return np.array_equal(_words(some), _words(others))


def _words(cells: AnyArray) -> AnyArray:
    """Return cells as whole numbers, without their copy where it can be."""
    return np.ascontiguousarray(cells).view(np.int32)
