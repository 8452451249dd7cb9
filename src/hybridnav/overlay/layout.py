"""Arrays of a multilevel overlay: fields of every level, their border cells, moves between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.overlay import _cost_kernels as kernels
from hybridnav.overlay._lane_kernels import FAR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import BoolArray, ByteArray, IntArray, LongArray


class CellCosts(NamedTuple):
    """The cells: what moves over them cost, and the fields of the finest level."""

    moves: ByteArray
    """uint8 (rows * cols,), masks of the legal moves; see `legal_moves`."""
    field_of: IntArray
    """int32 (rows * cols,), the field of each cell of the finest level, -1 for none."""
    units: IntArray
    """int32 (rows * cols,), the factor of each cell; a straight move costs the sum of two."""
    cols: int
    """Columns of the map."""
    least_units: int
    """The least of `units` on cells that may be entered."""


class Levels(NamedTuple):
    """Fields and nodes of all levels, numbered level by level from the finest.

    A node is a border cell of a field: a cell with a legal move to another field of its level. The
    fields inside one field of the level above have consecutive numbers, and so have their nodes. A
    cell can be a node of several levels, of the finest and of some above.
    """

    level_at: LongArray
    """int64 (levels + 1,), the first field of each level."""
    node_at: LongArray
    """int64 (fields + 1,), the first node of each field."""
    inner_at: LongArray
    """int64 (fields + 1,), the first field of the level below inside each field; 0 on the finest
    level."""
    parent: IntArray
    """int32 (fields,), the field of the level above, -1 on the last one."""
    cell_of: IntArray
    """int32 (nodes,), the flat cell of each node."""
    field_of: IntArray
    """int32 (nodes,), the field of each node."""
    below: IntArray
    """int32 (nodes,), the node of the level below on the same cell, -1 on the finest level."""
    above: IntArray
    """int32 (nodes,), the node of the level above on the same cell, -1 for none."""
    box: IntArray
    """int32 (fields of the finest level, 4), rows and columns that hold each: first, last + 1."""
    move_at: LongArray
    """int64 (nodes + 1,), where the moves from each node to other fields of its level begin."""
    move_to: IntArray
    """int32 (moves,), the nodes that they lead to."""
    move_cost: IntArray
    """int32 (moves,)."""
    clique_at: LongArray
    """int64 (fields + 1,), where the clique of each field begins."""
    clique: IntArray
    """int32, for each field the distances inside it between its n nodes, n * (n + 1) / 2."""
    table_at: LongArray
    """int64 (fields + 1,), where the table of each field begins; empty on the two finest
    levels."""
    table: IntArray
    """int32, for each field the distances inside it from its n nodes to the m nodes of the level
    below that lie in it, n * m, row by row."""
    is_stale: BoolArray
    """bool (fields,), whether a table is that of former costs, or was never computed. Then those of
    the fields around it are, too. Never on the finest level; on the next one only where distances
    do not fit."""
    is_lowered: BoolArray
    """bool (fields,), of a stale one: whether distances can be less than its table has."""


class Top(NamedTuple):
    """Distances between the nodes of the last level."""

    distance: IntArray
    """int32 (n, n), (0, 0) where they are not kept."""
    is_current: bool
    """Whether these are the distances of now; else those of former costs."""
    lowered: IntArray
    """int32 (k,), the nodes of the fields where costs were lowered since."""


class NodeWork(NamedTuple):
    """Work arrays of a search among nodes, all but `seen` and `before` alike before and after."""

    distance: LongArray
    """int64 (nodes,), NO_PATH."""
    before: IntArray
    """int32 (nodes,), the node before each, its bits inverted after a clique."""
    ahead: LongArray
    """int64 (nodes,), bounds on the distances to the goal, -1 where not known."""
    seen: IntArray
    """int32 (nodes,), the nodes whose bound is known."""
    counts: LongArray
    """int64 (1,), their number."""


def lay_out(
    moves: ByteArray, units: IntArray, labels: Sequence[IntArray]
) -> tuple[CellCosts, Levels]:
    """Number fields and border cells; cliques and tables are left empty.

    Parameters
    ----------
    moves
        uint8 (rows, cols), masks of the legal moves; cells without moves may be in fields.
    units
        int32 (rows, cols), > 0 in fields.
    labels
        One int32 (rows, cols) for each level, the finest first: the field of each cell, any
        numbers, -1 outside the map; each field lies in one field of the next level.

    Raises
    ------
    InvalidValueError
        When the fields of two levels are not nested.
    """
    inside = labels[0] >= 0
    fields, parents = _numbered([label[inside] for label in labels])
    level_at = np.cumsum([0, *(len(parent) for parent in parents)])
    flat = np.full((len(labels), moves.size), -1, dtype=np.int32)
    flat[:, inside.ravel()] = fields
    least = int(units[inside].min(initial=1 << 30))
    ground = CellCosts(
        moves.ravel(), flat[0], np.ascontiguousarray(units).ravel(), moves.shape[1], least
    )
    parent = np.concatenate(
        [
            above + level_at[k + 1] if k + 1 < len(labels) else above
            for k, above in enumerate(parents)
        ]
    ).astype(np.int32)
    nodes = [_Nodes(ground, flat[k], int(level_at[k]), k) for k in range(len(labels))]
    return ground, _gathered(ground, nodes, flat, level_at, parent)


def _numbered(labels: list[IntArray]) -> tuple[list[IntArray], list[IntArray]]:
    """Number the fields of each level from 0, those inside one field of the next in a row.

    Return the numbers of the cells and the parents of the fields, -1 on the last level.
    """
    numbers: list[IntArray] = []
    parents: list[IntArray] = []
    above = np.full(labels[0].shape, -1, dtype=np.int32)
    for label in reversed(labels):
        _, first, field = np.unique(label, return_index=True, return_inverse=True)
        parent = above[first]
        if not np.array_equal(parent[field], above):
            raise InvalidValueError("each field must lie in one field of the next level")
        rank = np.empty(len(first), dtype=np.int32)
        order = np.argsort(parent, kind="stable")
        rank[order] = np.arange(len(first), dtype=np.int32)
        above = rank[field]
        numbers.append(above)
        parents.append(parent[order].astype(np.int32))
    return numbers[::-1], parents[::-1]


class _Nodes:
    """The nodes of one level, sorted by field."""

    def __init__(self, ground: CellCosts, label: IntArray, first_field: int, level: int) -> None:
        crossing = np.flatnonzero(kernels.crossing_cells(ground.moves, label, ground.cols))
        order = np.argsort(label[crossing], kind="stable")
        self.cells = crossing[order].astype(np.int32)
        self.fields = label[self.cells] + first_field
        self.level = level


def _gathered(
    ground: CellCosts, nodes: list[_Nodes], label: IntArray, level_at: LongArray, parent: IntArray
) -> Levels:
    """Join the levels, and number what lies between and below their nodes."""
    field_of = np.concatenate([level.fields for level in nodes]).astype(np.int32)
    node_at = np.searchsorted(field_of, np.arange(level_at[-1] + 1))
    node_of = np.full(ground.moves.size, -1, dtype=np.int32)
    below, starts, ends, costs = [], [np.zeros(1, dtype=np.int64)], [], []
    first = n_moves = 0
    for level in nodes:
        below.append(node_of[level.cells])
        node_of.fill(-1)
        node_of[level.cells] = np.arange(first, first + len(level.cells), dtype=np.int32)
        start, to, cost = kernels.crossing_moves(ground, label[level.level], level.cells, node_of)
        starts.append(start[1:] + n_moves)
        ends.append(to)
        costs.append(cost)
        first += len(level.cells)
        n_moves += len(to)
    inner_at = np.searchsorted(parent[: level_at[-2]], np.arange(level_at[-1] + 1))
    inner_at[: level_at[1]] = 0
    n_nodes = np.diff(node_at)
    clique_at = np.concatenate([[0], np.cumsum(n_nodes * (n_nodes + 1) // 2)])
    n_inner = node_at[inner_at[1:]] - node_at[inner_at[:-1]]
    n_inner[: level_at[min(2, len(nodes))]] = 0
    table_at = np.concatenate([[0], np.cumsum(n_nodes * n_inner)])
    below_of = np.concatenate(below)
    has_below = below_of >= 0
    above = np.full(len(below_of), -1, dtype=np.int32)
    above[below_of[has_below]] = np.flatnonzero(has_below)
    is_stale = np.arange(level_at[-1]) >= level_at[1]
    return Levels(
        level_at=level_at,
        node_at=node_at,
        inner_at=inner_at,
        parent=parent,
        cell_of=np.concatenate([level.cells for level in nodes]),
        field_of=field_of,
        below=below_of,
        above=above,
        box=kernels.boxes_of(ground.field_of, ground.cols, int(level_at[1])),
        move_at=np.concatenate(starts),
        move_to=np.concatenate(ends),
        move_cost=np.concatenate(costs),
        clique_at=clique_at,
        clique=np.empty(clique_at[-1], dtype=np.int32),
        table_at=table_at,
        table=np.full(table_at[-1], FAR, dtype=np.int32),
        is_stale=is_stale,
        is_lowered=is_stale.copy(),
    )
