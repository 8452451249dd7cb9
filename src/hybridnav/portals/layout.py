"""The layout of portals: the order of cells, gates and sides."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, IntArray, LongArray
    from hybridnav.portals.crossings import Crossings


def starts_of(sorted_keys: IntArray | LongArray, count: int) -> LongArray:
    """Return where each of the keys 0 to count - 1 begins in a sorted array, and its end."""
    starts: LongArray = np.searchsorted(sorted_keys, np.arange(count + 1)).astype(np.int64)
    return starts


def offsets_of(sizes: LongArray) -> LongArray:
    """Return where things of these sizes begin one after the other, and the end of the last."""
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Layout:
    """Cells, gates and sides in the order of their fields; see `Portals` for the arrays."""

    label: IntArray
    """int32 (rows * cols,), the field of each cell."""
    cols: int
    crossings: Crossings

    @cached_property
    def n_fields(self) -> int:
        """Number of fields."""
        return int(self.label.max(initial=-1)) + 1

    @cached_property
    def cells(self) -> IntArray:
        """int32, flat cells in the order of their positions: by field, then by square of 8 x 8."""
        cells = np.flatnonzero(self.label >= 0)
        row, col = np.divmod(cells, self.cols)
        tile = (row >> 3) * (self.cols + 7 >> 3) + (col >> 3)
        ordered: IntArray = cells[np.lexsort((tile, self.label[cells]))].astype(np.int32)
        return ordered

    @cached_property
    def index(self) -> IntArray:
        """int32 (rows * cols,), position of each cell, -1 where it has none."""
        index = np.full(self.label.size, -1, dtype=np.int32)
        index[self.cells] = np.arange(len(self.cells), dtype=np.int32)
        return index

    @cached_property
    def field_start(self) -> LongArray:
        """int64 (F + 1,), first position of each field."""
        return starts_of(self.label[self.cells], self.n_fields)

    @cached_property
    def gate_cell(self) -> LongArray:
        """int64 (G,), flat cells, in the order of their positions."""
        cells = np.unique(self.crossings.endpoints[np.tile(self.crossings.is_gate, 2)])
        ordered: LongArray = cells[np.argsort(self.index[cells], kind="stable")]
        return ordered

    @cached_property
    def gate_of(self) -> IntArray:
        """int32 (rows * cols,), the gate at each cell, -1 for none."""
        gate_of = np.full(self.label.size, -1, dtype=np.int32)
        gate_of[self.gate_cell] = np.arange(len(self.gate_cell), dtype=np.int32)
        return gate_of

    @cached_property
    def gate_start(self) -> LongArray:
        """int64 (F + 1,), first gate of each field."""
        return starts_of(self.label[self.gate_cell], self.n_fields)

    @cached_property
    def is_exit(self) -> BoolArray:
        """bool, which crossings lead from gate to gate."""
        low, high = self.gate_of[self.crossings.endpoints].reshape(2, -1)
        is_exit: BoolArray = (low >= 0) & (high >= 0)
        return is_exit

    @cached_property
    def first_move_start(self) -> LongArray:
        """int64 (G + 1,), first byte of each gate's row of directions."""
        sizes = np.diff(self.field_start)[self.label[self.gate_cell]]
        return offsets_of((sizes + 1) // 2)

    @cached_property
    def side_order(self) -> LongArray:
        """int64 (2 P,), sides by field: portal p's lower side is p, its higher one P + p."""
        n_portals = self.crossings.n_portals
        field = np.empty(2 * n_portals, dtype=np.int64)
        portal = self.crossings.portal
        field[np.concatenate([portal, portal + n_portals])] = self.label[self.crossings.endpoints]
        return np.argsort(field, kind="stable")

    @cached_property
    def side_rank(self) -> LongArray:
        """int64 (2 P,), its inverse."""
        rank = np.empty_like(self.side_order)
        rank[self.side_order] = np.arange(len(rank))
        return rank

    @cached_property
    def side_of_endpoint(self) -> LongArray:
        """int64, the side of each end of a crossing."""
        portal = self.crossings.portal
        endpoints = np.concatenate([portal, portal + self.crossings.n_portals])
        side: LongArray = self.side_rank[endpoints]
        return side

    @cached_property
    def side_start(self) -> LongArray:
        """int64 (F + 1,), first side of each field."""
        n_sides = len(self.side_order)
        field = np.empty(n_sides, dtype=np.int64)
        field[self.side_of_endpoint] = self.label[self.crossings.endpoints]
        return starts_of(field, self.n_fields)

    @cached_property
    def side_gates(self) -> tuple[LongArray, LongArray]:
        """Gates of each side, each once: starts, and gates."""
        gate = self.gate_of[self.crossings.endpoints]
        is_exit = np.tile(self.is_exit, 2)
        n_gates = max(len(self.gate_cell), 1)
        pairs = np.unique(self.side_of_endpoint[is_exit] * n_gates + gate[is_exit])
        return starts_of(pairs // n_gates, len(self.side_order)), pairs % n_gates

    @cached_property
    def side_box(self) -> IntArray:
        """int32 (R, 4), first and last row, first and last column of the endpoints of each side."""
        order = np.argsort(self.side_of_endpoint, kind="stable")
        row, col = np.divmod(self.crossings.endpoints[order], self.cols)
        if not len(order):
            return np.empty((0, 4), dtype=np.int32)
        at = starts_of(self.side_of_endpoint[order], len(self.side_order))[:-1]
        box = [edge.reduceat(x, at) for x in (row, col) for edge in (np.minimum, np.maximum)]
        return np.stack(box, axis=1).astype(np.int32)

    @cached_property
    def source_gate(self) -> IntArray:
        """int32 (S,), the gates in the lower field of a crossing between gates."""
        gates: IntArray = np.unique(self.gate_of[self.crossings.low[self.is_exit]])
        return gates

    @property
    def n_bytes(self) -> float:
        """What paths to all gates, costs between them, and a table of those of a lower field to all
        will take."""
        sizes, gates = np.diff(self.field_start), np.diff(self.gate_start)
        first_move = 0.5 * (sizes * gates).sum()
        side_cost = 2.0 * (sizes * np.diff(self.side_start)).sum()
        cliques = 4.0 * (gates.astype(np.float64) ** 2).sum()
        lower = len(np.unique(self.crossings.low[self.crossings.is_gate]))
        table = 4.0 * lower * len(self.gate_cell)
        return float(first_move + cliques + side_cost + table)
