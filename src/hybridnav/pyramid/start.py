"""Where a decimation starts: at the blocks of the base, or at a level that another one has made."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.combinatorial.darts import Darts
from hybridnav.pyramid import _base_kernels, _field_kernels
from hybridnav.pyramid._kernels import Vertices
from hybridnav.pyramid.blocks import TEMPLATES, block_powers, max_power, steps_to_parents
from hybridnav.pyramid.record import Record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import ByteArray, IntArray
    from hybridnav.pyramid.level import Level

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
    kinds = kinds.astype(next(kind for kind in _KINDS if n_kinds <= np.iinfo(kind).max + 1))
    kinds.flags.writeable = False  # as the classes are: another type is compiled once more
    return kinds


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
        (TEMPLATES[0], steps_to_parents(kinds.shape[1]), *TEMPLATES[3:]),
        record.vertex_end,
        record.vertex_parent,
        record.edge_end,
        new_edge,
    )
    return Blocks(record, power, new_edge, n_vertices, n_edges)


def start_at_base(kinds: KindArray, limit: int, *, in_blocks: KindArray | None = None) -> Start:
    """Fill the record for the blocks of the base, and return their darts and vertices.

    Parameters
    ----------
    kinds
        uint8, uint16 or int32 (rows, cols); see `kinds_of`.
    limit
        See `squared_limit`; no block is wider than half of it.
    in_blocks
        The kinds of the cells that may lie in blocks, 0 elsewhere; None for all cells.
    """
    marked = mark_blocks(kinds, limit, in_blocks=in_blocks)
    record, power, new_edge, n_vertices, n_edges = marked
    vertices = Vertices(*_base_kernels.block_vertices(kinds, power, record.vertex_end, n_vertices))
    darts = Darts(*_base_kernels.block_darts(kinds, power, vertices, new_edge, n_edges))
    return Start(record, darts, vertices, 0, kinds.shape[1])


def start_at_level(level: Level, record: Record, kinds: KindArray) -> Start:
    """Forget what a record has above a level, and return the darts and vertices of the level.

    Parameters
    ----------
    level
        A level at which all blocks are whole, such as that of the places.
    record
        The record of its pyramid; it is copied.
    kinds
        uint8, uint16 or int32 (rows, cols), kinds that no field of the level mixes.
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
    )
    return Start(record, darts, vertices, level.index, cols)
