"""Crossings: all legal moves between the fields of a partition, grouped by portal."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.search.moves import DIAGONAL, STRAIGHT, moves_along

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, ByteArray, IntArray, LongArray


class Crossings(NamedTuple):
    """Legal moves between fields; every field has n entries."""

    low: LongArray
    """Flat cell in the lower field."""
    high: LongArray
    """Flat cell in the higher field."""
    diagonal: BoolArray
    """Whether the move is diagonal."""
    portal: LongArray
    """Number of its portal."""
    is_gate: BoolArray
    """Whether its endpoints were chosen as gates."""

    @property
    def n_portals(self) -> int:
        """Number of portals."""
        return int(self.portal.max(initial=-1)) + 1

    @property
    def endpoints(self) -> LongArray:
        """int64 (2 n,), all lower cells, then all higher ones."""
        return np.concatenate([self.low, self.high])

    @property
    def cost(self) -> IntArray:
        """int32 (n,), integer cost of each move."""
        return np.where(self.diagonal, DIAGONAL, STRAIGHT).astype(np.int32)


def find_crossings(
    moves: ByteArray, label: IntArray, cols: int, spacing: int, gate_spacing: int
) -> Crossings:
    """Find all legal moves between two fields, and group them.

    Parameters
    ----------
    moves
        uint8 (rows * cols,), masks of the legal moves.
    label
        int32 (rows * cols,), the field of each cell, -1 where there is none.
    cols
        Columns of the map.
    spacing, gate_spacing
        Sides of the lattice squares of portals and of gates, in cells: the move in the middle of
        each square is between gates, with squares of one cell all moves are.
    """
    low, high, diagonal = _moves_between(moves, label, cols)
    position = np.stack([low // cols, low % cols])
    fields = label[low] * (label.max(initial=0) + np.int64(1)) + label[high]

    def groups(square_cells: int) -> LongArray:
        square = position[0] // square_cells * cols + position[1] // square_cells
        order = np.lexsort((square, fields))
        new = np.ones(len(order), dtype=np.bool_)
        new[1:] = (np.diff(fields[order]) != 0) | (np.diff(square[order]) != 0)
        group = np.empty(len(order), dtype=np.int64)
        group[order] = np.cumsum(new) - 1
        return group

    is_gate = np.full(len(low), gate_spacing == 1)
    if gate_spacing > 1:
        is_gate[_middles(groups(gate_spacing), position, diagonal)] = True
    return Crossings(low, high, diagonal, groups(spacing), is_gate)


def _moves_between(
    moves: ByteArray, label: IntArray, cols: int
) -> tuple[LongArray, LongArray, BoolArray]:
    """Return all legal moves between two fields: cell in the lower one, in the higher, if
    diagonal."""
    found = []
    for direction in range(4):
        tail, head = moves_along(moves, cols, direction)
        apart = label[tail] != label[head]
        diagonal = np.full(int(apart.sum()), direction & 1 == 1)
        found.append((tail[apart], head[apart], diagonal))
    tail, head, diagonal = (np.concatenate(part) for part in zip(*found, strict=True))
    turned = label[tail] > label[head]
    return np.where(turned, head, tail), np.where(turned, tail, head), diagonal


def _middles(group: LongArray, position: LongArray, diagonal: BoolArray) -> LongArray:
    """Return the move nearest the middle of each group; a diagonal counts as a cell away."""
    if not len(group):
        return np.empty(0, dtype=np.int64)
    count = np.bincount(group)
    row, col = (axis - (np.bincount(group, axis) / count)[group] for axis in position)
    order = np.lexsort((np.hypot(row, col) + diagonal, group))
    middles: LongArray = order[np.searchsorted(group[order], np.arange(len(count)))]
    return middles
