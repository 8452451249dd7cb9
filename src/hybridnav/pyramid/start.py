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
from hybridnav.pyramid.kernels.darts import NO_LEVEL
from hybridnav.pyramid.kernels.decimation import Vertices
from hybridnav.pyramid.level import Level
from hybridnav.pyramid.record import SURVIVES, Record

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


class Blocks(NamedTuple):
    """The blocks of a base."""

    record: Record
    """The record for the blocks alone; all else survives."""
    power: ByteArray
    """See `block_powers`."""
    new_edge: IntArray
    """int32 by base edge, the number of each edge between blocks."""
    n_vertices: int
    """Blocks and single cells."""
    n_edges: int
    """Edges between them."""


def mark_blocks(kinds: KindArray, limit: int, *, in_blocks: KindArray | None = None) -> Blocks:
    """Fill the record for the blocks of the base; see `start_at_base` for the parameters."""
    record = Record(
        np.empty(kinds.size, np.uint8),
        np.empty(kinds.size, np.int32),
        np.empty(2 * kinds.size, np.uint8),
    )
    power = block_powers(kinds if in_blocks is None else in_blocks, max_power(limit))
    new_edge = np.empty(2 * kinds.size, np.int32)
    n_vertices, n_edges = _base_kernels.mark_base(
        kinds,
        power,
        _base_kernels.BaseTemplates(
            TEMPLATES.vertex_end, steps_to_parents(kinds.shape[1]), *TEMPLATES[3:]
        ),
        record.vertex_end,
        record.vertex_parent,
        record.edge_end,
        new_edge,
    )
    return Blocks(record, power, new_edge, n_vertices, n_edges)


def start_at_base(kinds: KindArray, limit: int, *, in_blocks: KindArray | None = None) -> Start:
    """Fill the record for the blocks of the base, and return their darts and vertices.

    `kinds`: uint8, uint16 or int32 (rows, cols); see `kinds_of`; `limit`: see `squared_limit`; no
    block is wider than half of it; `in_blocks`: the kinds of the cells that may lie in blocks, 0
    elsewhere; None for all cells.
    """
    marked = mark_blocks(kinds, limit, in_blocks=in_blocks)
    record, power, new_edge, n_vertices, n_edges = marked
    vertices = Vertices(*_base_kernels.block_vertices(kinds, power, record.vertex_end, n_vertices))
    first, last = _base_kernels.block_darts(kinds, power, vertices, new_edge, n_edges)
    darts = Darts._make((*first, *last, np.full(n_edges, NO_LEVEL, np.uint8)))
    return Start(record, darts, vertices, 0, kinds.shape[1])


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


class Templates(NamedTuple):
    """Ends of cells and edges by the power p of their block (side 2^p) and their place in it.

    `vertex_end`, and `parent_rows` and `parent_cols`, the steps to the parent, are indexed by
    (p, row mod 16, col mod 16). The other arrays hold ends of edges as `Record.edge_end` does:
    `inside_*` by (p, row mod 8, col mod 8), 0 for an edge that leaves the block; `across_*`, for
    edges that leave it, by (lesser power, row or column mod 8).
    """

    vertex_end: ByteArray
    parent_rows: LongArray
    parent_cols: LongArray
    inside_east: ByteArray
    inside_north: ByteArray
    across_east: ByteArray
    across_north: ByteArray


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
    """Return how often two divides a positive number."""
    return (number & -number).bit_length() - 1


def _across(power: int, position: int, *, upright: bool) -> int:
    """Return the end of an edge between two blocks by its place along the border.

    Parallel edges go when the cells beside each other are merged on both sides.
    """
    place = position % (1 << power)
    if place == 0:
        return SURVIVES
    level = 2 * _twos(place) + (2 if upright else 1)
    return 2 * level + 1


def _inside(power: int, along: int, across: int, *, upright: bool) -> int:
    """Return the end of an edge from `along` to the next cell inside a block, at `across`.

    It is the end of an edge between the two halves that it joins; it is contracted where they keep
    it.
    """
    if (along + 1) % (1 << power) == 0:
        return 0
    halves = _twos(along + 1)
    end = _across(halves if upright else halves + 1, across, upright=upright)
    return 2 * (2 * halves + (1 if upright else 2)) if end == SURVIVES else end


def make_templates() -> Templates:
    """Fill the tables."""
    powers, width = MAX_POWER + 1, 1 << MAX_POWER
    vertex_end = np.full((powers, PERIOD, PERIOD), SURVIVES, np.uint8)
    parent_rows = np.zeros((powers, PERIOD, PERIOD), np.int64)
    parent_cols = np.zeros((powers, PERIOD, PERIOD), np.int64)
    inside_east = np.zeros((powers, width, width), np.uint8)
    inside_north = np.zeros((powers, width, width), np.uint8)
    for power, row, col in np.ndindex(powers, PERIOD, PERIOD):
        by_row, by_col = _death(row), _death(col)
        if by_col <= min(power, by_row):
            vertex_end[power, row, col] = 2 * by_col - 1
            parent_cols[power, row, col] = survivor_at(by_col, col) - col
        elif by_row <= power:
            vertex_end[power, row, col] = 2 * by_row
            parent_rows[power, row, col] = survivor_at(by_row, row) - row
    for power, row, col in np.ndindex(powers, width, width):
        inside_east[power, row, col] = _inside(power, col, row, upright=True)
        inside_north[power, row, col] = _inside(power, row, col, upright=False)
    across_east, across_north = (
        np.array(
            [[_across(p, i, upright=u) for i in range(width)] for p in range(powers)], np.uint8
        )
        for u in (True, False)
    )
    return Templates(
        vertex_end, parent_rows, parent_cols, inside_east, inside_north, across_east, across_north
    )


TEMPLATES = make_templates()


def _alive(ends: ByteArray) -> LongArray:
    """Return how many of some ends, none of which survives, each of the lower levels has."""
    levels = np.arange(2 * MAX_POWER)[:, None]
    return ((ends >= 2 * levels + 2) & (ends < SURVIVES)).sum(axis=1)


def pieces_of(vertices: Vertices, darts: Darts) -> list[list[int]]:
    """Return what each level up to that where all blocks are whole has besides a start.

    These are vertices, one less than the pieces of each block, and edges: those inside blocks, and
    those that the edge on a side stands for.
    """
    blocks = np.bincount(vertices.whole_at >> 1, minlength=MAX_POWER + 1)
    sides = _base_kernels.count_sides(darts.origin, darts.base_edge, vertices.whole_at)
    found = np.zeros((2 * MAX_POWER, 2), np.int64)
    for power in range(1, MAX_POWER + 1):
        pieces = np.maximum(1, 4**power >> np.arange(2 * MAX_POWER)) - 1
        found[:, 0] += blocks[power] * pieces
        place = power, slice(1 << power), slice(1 << power)
        for side, inside, across in zip(sides, TEMPLATES[3:5], TEMPLATES[5:], strict=True):
            found[:, 1] += blocks[power] * _alive(inside[place].ravel())
            found[:, 1] += side[power] * _alive(across[place[:2]])
    return found[: vertices.whole_at.max(initial=0)].tolist()


def max_power(limit: int) -> int:
    """Return the power of the largest blocks: at most half the merge distance a side.

    Every linkage allows blocks of that size, and they leave room for fields of other shapes.
    `limit` is the squared distance in cells.
    """
    return sum(4 << 2 * power <= limit for power in range(1, MAX_POWER + 1))


def steps_to_parents(cols: int) -> LongArray:
    """Return the steps from each cell to the one it is contracted into.

    They are differences of flat cells on a map with `cols` columns: int64, by power and place as
    `Templates.parent_rows`.
    """
    return TEMPLATES.parent_rows * cols + TEMPLATES.parent_cols


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
        _base_kernels.raise_powers(power, squares, halves, p)
    return power
