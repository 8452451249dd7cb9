"""Where a decimation starts: at the blocks of the base, or at a level that another one has made."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.typing import AnyArray, ByteArray, IntArray, LongArray
from hybridnav.pyramid.darts import Darts
from hybridnav.pyramid.kernels import base as _base_kernels
from hybridnav.pyramid.kernels import fields as _field_kernels
from hybridnav.pyramid.kernels import throats as _throat_kernels
from hybridnav.pyramid.kernels.base import Merging
from hybridnav.pyramid.kernels.darts import NO_LEVEL
from hybridnav.pyramid.kernels.decimation import Vertices
from hybridnav.pyramid.level import Level
from hybridnav.pyramid.record import Record

KindArray = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.int32]


N_CLASSES = 2
"""Classes of vertices: free and unexplored."""
_KINDS = (np.uint8, np.uint16, np.int32)
"""Types of kinds, the least that has enough of them."""


class Start(NamedTuple):
    """The level at which a decimation starts; its arrays are worked on in place."""

    record: Record
    """The record, complete up to this level."""
    darts: Darts
    """Darts of the level."""
    vertices: Vertices
    """Vertices of the level."""
    level: int
    """Index of the level; 0 is the base."""
    cols: int
    """Columns of the grid."""


def kinds_of(classes: ByteArray, rooms: IntArray) -> KindArray:
    """Return the kind of each cell, one number for its class and its room.

    0 is occupied, `CellClass` outside rooms, and so on, two kinds for each room.
    """
    n_kinds = N_CLASSES * (int(rooms.max()) + 2) + 1
    kinds = np.where(classes == 0, 0, N_CLASSES * (rooms + 1) + classes)
    kinds = kinds.astype(_type_for(n_kinds))
    kinds.flags.writeable = False  # as the classes are: another type is compiled once more
    return kinds


def _type_for(n_kinds: int) -> type[np.integer[Any]]:
    """Return the least type of kinds that has so many."""
    return next(kind for kind in _KINDS if n_kinds <= np.iinfo(kind).max + 1)


class Parts(NamedTuple):
    """The free cells of a map, divided at its throats."""

    classes: ByteArray
    """uint8 `CellClass` (rows, cols)."""
    fine_of_square: IntArray
    """int32, the fine part of the free cells of each square of 2 x 2, -1 for none; a square at the
    last row or column may have fewer cells."""
    part_of: IntArray
    """int32 (n_fine,), the part that each fine part lies in."""

    @property
    def kinds(self) -> KindArray:
        """The kind of each cell, (rows, cols); see `kinds_of`, with fine parts as rooms."""
        kinds = np.empty(self.classes.shape, _type_for(N_CLASSES * (len(self.part_of) + 1) + 1))
        _throat_kernels.kinds_of_parts(self.classes, self.fine_of_square, kinds)
        kinds.flags.writeable = False
        return kinds

    def at(self, cells: LongArray) -> IntArray:
        """Return the part of each of some cells, (n, 2), int32: -1 for those that are not free."""
        row, col = cells.T
        fine = np.where(self.classes[row, col] == 1, self.fine_of_square[row // 2, col // 2], -1)
        return np.append(self.part_of, np.int32(-1))[fine]


# Shares of the merge distance, so that a map in other units has the same parts. At 4 m: passages
# of up to 2.4 m, and parts with 0.4 m2 (fine ones with 0.05 m2) that are wider than their passages.
_WIDEST = 0.3
_LEAST_AREA, _LEAST_FINE_AREA = 1 / 40, 1 / 320
_LEAST_CELLS = 9
"""Parts have more cells than this before they meet others: less is the roughness of a wall."""
_DEPTH = 3 * _throat_kernels.STRAIGHT
"""Clearance that a throat has less than what lies on either side: three cells."""
_FARTHEST = 60_000
"""Clearances are 16 bits wide."""


def parts_of(classes: ByteArray, limit: int) -> Parts:
    """Divide the free cells of a map at its throats.

    A watershed of the distance to the nearest cell that is not free: parts are the catchment basins
    of wide places, and meet where the passage between them is narrowest. Two basins are one part
    unless both are large enough and the passage is narrower than either by some cells.

    L. Vincent, P. Soille: Watersheds in digital spaces, IEEE PAMI 13(6), 1991; that narrow passages
    are where a topological map of a building is divided is the idea of S. Thrun's critical lines
    (Artificial Intelligence 99(1), 1998).

    `classes`: uint8 `CellClass`, shape `(rows, cols)`; `limit`: see `decimation.squared_limit`.
    """
    farthest = _WIDEST * _throat_kernels.STRAIGHT * math.sqrt(limit)
    most = int(min(max(farthest, _throat_kernels.STRAIGHT), _FARTHEST))
    clearance = _throat_kernels.clearances(classes, most)
    small, slight = (
        max(share * limit, _LEAST_CELLS) / 4 for share in (_LEAST_FINE_AREA, _LEAST_AREA)
    )
    return Parts(classes, *_throat_kernels.divide(classes, clearance, most, small, slight, _DEPTH))


def start_at_base(kinds: KindArray, limit: int, *, in_blocks: KindArray | None = None) -> Start:
    """Fill the record for the blocks of the base, and return their darts and vertices.

    `kinds`: uint8, uint16 or int32 (rows, cols); see `kinds_of`; `limit`: see `squared_limit`; no
    block is wider than half of it; `in_blocks`: the kinds of the cells that may lie in blocks, 0
    elsewhere; None for all cells.
    """
    rows, cols = kinds.shape
    # In whole words, of which the last may have bytes of no cell.
    vertex_words, edge_words = (
        np.zeros(-(-kinds.size // 8), np.uint64),
        np.zeros(-(-kinds.size // 4), np.uint64),
    )
    record = Record(
        vertex_words.view(np.uint8)[: kinds.size],
        np.empty(kinds.size, np.int32),
        edge_words.view(np.uint8)[: 2 * kinds.size],
    )
    power = block_powers(kinds if in_blocks is None else in_blocks, max_power(limit))
    merging = merging_of(rows, cols), merging_of(cols, 1)
    _base_kernels.mark_base(kinds, power, *merging, *vars(record).values())
    survivors, _ = _base_kernels.surviving(vertex_words)
    base_edge, before = _base_kernels.surviving(edge_words)
    vertices = Vertices(*_base_kernels.block_vertices(kinds, power, survivors))
    darts = _base_kernels.block_darts(kinds, power, vertices, len(base_edge), edge_words, before)
    waits = np.full(len(base_edge), NO_LEVEL, np.uint8)
    return Start(record, Darts._make((*darts, base_edge, waits)), vertices, 0, cols)


def start_at_level(level: Level, record: Record, kinds: KindArray) -> Start:
    """Forget what a record has above a level, and return the darts and vertices of the level.

    `level`: a level at which all blocks are whole, such as that of the places; `record`: the record
    of its pyramid; it is copied; `kinds`: uint8, uint16 or int32 (rows, cols), kinds that no field
    of the level mixes.
    """
    record = record.up_to(level.index)
    cols = kinds.shape[1]
    row, col = level.cells.T
    vertices = Vertices(
        level.cells.astype(np.int32),
        level.boxes.copy(),
        kinds[row, col],
        np.zeros(level.n_vertices, np.uint8),
    )
    plane = level.darts
    sweep = _field_kernels.sweeps(row * cols + col, record.edge_end, level.index, cols)
    darts = Darts(
        plane.sigma.copy(),
        plane.origin.copy(),
        sweep[(level.base_pairs @ (cols, 1)).ravel()],
        plane.protected.copy(),
        plane.base_edge.copy(),
        np.full(level.n_arcs, NO_LEVEL, np.uint8),
    )
    return Start(record, darts, vertices, level.index, cols)


# The lower levels of open ground in closed form: blocks.
#
# A *block* is an aligned square of 2, 4 or 8 cells a side, all of one class; those of 4 and 8 lie
# in the middle of more of their class. Its cells are contracted along a quadtree, first pairs
# along rows (levels 1, 3, 5), then pairs of those along columns (levels 2, 4, 6), and until it is
# whole no other vertex joins it: a block of side 2^p is one vertex from level 2p on. The place of
# a cell or edge in its block alone decides when and how it goes, so the darts inside a block are
# never built.

MAX_POWER = 3
"""The largest block has 2^3 cells a side: larger ones gain no time."""

PERIOD = 2 << MAX_POWER
"""Rows after which blocks lie as before: their survivors depend on whether their number is odd."""


def survivor_offset(power: int, number: int) -> int:
    """Return the row or column of the surviving cell in a block.

    It is near the middle, on the side where the middle of the next larger block is.

    `number` is the row or column of the block among blocks of its size.
    """
    if power == 0:
        return 0
    if number % 2 == 0:
        return (1 << power - 1) + survivor_offset(power - 1, 1)
    return survivor_offset(power - 1, 0)


def survivor_at(power: int, position: int) -> int:
    """Return the row or column of the surviving cell of the block over a row or column."""
    number = position >> power
    return (number << power) + survivor_offset(power, number)


def _death(position: int) -> int:
    """Return the least power of a block over a row or column whose surviving one is another."""
    for power in range(1, MAX_POWER + 1):
        if survivor_at(power, position) != position:
            return power
    return MAX_POWER + 1


def _twos(number: int) -> int:
    """Return how often two divides a number, at most 4; 4 for 0."""
    return (number & -number or PERIOD).bit_length() - 1


def merging_of(count: int, stride: int) -> Merging:
    """Return how so many rows or columns merge; `stride`: flat cells from one to the next."""
    numbers = range(PERIOD)
    deaths = [_death(number) for number in numbers]
    steps = [survivor_at(death, k) - k for k, death in enumerate(deaths)]
    of_period = [_twos(k) for k in numbers], [_twos(k + 1) for k in numbers], deaths
    fields = [np.resize(np.array(values, np.uint8), count) for values in of_period]
    return Merging._make([*fields, np.resize(np.array(steps, np.int32) * stride, count)])


def pieces_of(vertices: Vertices, darts: Darts) -> list[tuple[int, int]]:
    """Return what each level below that where all blocks are whole has besides a start.

    These are vertices, one less than the pieces of each block, and edges: those inside blocks, and
    those that the edge on a side stands for.
    """
    powers = np.arange(MAX_POWER + 1)
    blocks = np.bincount(vertices.whole_at >> 1, minlength=MAX_POWER + 1)
    east, north = _base_kernels.count_sides(darts.origin, darts.base_edge, vertices.whole_at)
    found = []
    for level in range(vertices.whole_at.max(initial=0)):
        rows, cols = (1 << np.maximum(powers - (level + odd) // 2, 0) for odd in (0, 1))
        arcs = blocks @ (2 * rows * cols - rows - cols) + east @ (rows - 1) + north @ (cols - 1)
        found.append((int(blocks @ (rows * cols - 1)), int(arcs)))
    return found


def max_power(limit: int) -> int:
    """Return the power of the largest blocks: at most half the merge distance a side.

    Every linkage allows blocks of that size, and they leave room for fields of other shapes.
    `limit` is the squared distance in cells.
    """
    return sum(4 << 2 * power <= limit for power in range(1, MAX_POWER + 1))


def block_powers(kinds: AnyArray, largest: int) -> ByteArray:
    """Return the power of the block of every aligned 2x2 cells, 0 outside blocks.

    `kinds`: the kind of each cell, (rows, cols), read-only; 0 for no vertex; `largest`: power of
    the largest blocks. Returns uint8, with one row and one column more than there are whole
    squares, for the cells beyond them.
    """
    power = np.zeros((kinds.shape[0] // 2 + 1, kinds.shape[1] // 2 + 1), np.uint8)
    squares = kinds
    for p in range(1, largest + 1):
        halves, squares = squares, _base_kernels.uniform_squares(squares)
        squares.flags.writeable = False  # like the kinds, so that one compilation serves both
        if p == 1:
            power[:-1, :-1] = squares != 0
        else:
            _base_kernels.raise_powers(power, halves, p)
    return power
