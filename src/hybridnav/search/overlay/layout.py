"""Arrays of a multilevel overlay: fields of every level, their border cells, moves between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.search.overlay.kernels import costs as kernels
from hybridnav.search.overlay.kernels.lanes import LANES, STEP_BITS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, IntArray, LongArray


MOST_CELLS = (1 << 16) - 1
"""Most cells of a field of the finest level: places in it have 16 bits."""
_BLOCK = 1 << kernels.BLOCK_BITS
_MOST_SHORT = (1 << 15) - 1
"""Most fields of the finest level whose numbers have 16 bits."""


class CellCosts(NamedTuple):
    """The cells: what moves over them cost, and the fields of the finest level.

    Cells have slots, in the order of their flat numbers: those in blocks of 16 without a cell of
    any field share the first 16, which stand for cells of no field.
    """

    moves: ByteArray
    """uint8 (slots,), masks of the legal moves; see `legal_moves`."""
    field_of: AnyArray
    """int16 (slots,), the field of each cell of the finest level, -1 for none; int32 where there
    are more fields."""
    units: IntArray
    """int32 (slots,), the factor of each cell; a straight move costs the sum of two."""
    block_at: IntArray
    """int32 (blocks of 16 cells,), the slot of the first cell of each."""
    rows: int
    """Rows of the map."""
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
    move_at: IntArray
    """int32 (nodes + 1,), where the moves from each node to other fields of its level begin."""
    move_to: IntArray
    """int32 (moves,), the nodes that they lead to."""
    move_cost: IntArray
    """int32 (moves,)."""
    clique_at: LongArray
    """int64 (fields + 1,), where the clique of each field begins."""
    clique: IntArray
    """int32, for each field the distances inside it between its n nodes, n * (n + 1) / 2."""
    place_of: AnyArray
    """uint16 (slots,), the place of each cell among those of its field of the finest level, by
    their flat numbers."""
    steps_at: LongArray
    """int64 (fields of the finest level + 1,), where the steps of each begin."""
    steps: AnyArray
    """uint16, for each 16 nodes of a field of the finest level, and each of its cells, the first
    moves of shortest paths inside the field to these nodes: three numbers, the bits of the
    directions."""
    marks_at: LongArray
    """int64 (fields + 1,), where the marks of each field begin; empty but on the level above the
    finest."""
    marks: ByteArray
    """uint8, for each field n * m bits, n its nodes and m those of the level below in it: row by
    row the nodes on shortest paths to one of its nodes from those before."""
    table_at: LongArray
    """int64 (fields + 1,), where the table of each field begins; empty on the two finest levels,
    and where it was never computed."""
    table: IntArray
    """int32, for each field the distances inside it between its nodes and exits of the fields
    inside; see `pack_table`."""
    is_stale: BoolArray
    """bool (fields,), whether a clique and a table are those of former costs, or were never
    computed. Then those of the fields around it are, too. Never on the finest level; on the next
    one only where distances do not fit."""
    is_lowered: BoolArray
    """bool (fields,), of a stale one: whether distances can be less than its table has."""
    is_newer: BoolArray
    """bool (fields,), whether the clique of a field is of later costs than the table around it."""


class Top(NamedTuple):
    """Distances over the last level between gates: of each move, one end is a gate."""

    distance: IntArray
    """int32 (n * (n + 1) / 2,), for n gates; empty where they are not kept. See `clique_place`."""
    gates: IntArray
    """int32 (n,), the nodes, ascending."""
    gate_of: IntArray
    """int32 (nodes of the last level,), the place of each among the gates, -1 for none; empty
    where distances are not kept."""
    is_current: bool
    """Whether these are the distances of now; else those of former costs."""
    lowered: IntArray
    """int32 (k,), the places of the gates in and beside the fields where costs were lowered
    since."""


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


class Numbering(NamedTuple):
    """The fields of all levels and their numbers; see `Levels`."""

    field_of: IntArray
    """int32 (rows * cols,), the field of each cell of the finest level, -1 for none."""
    level_at: LongArray
    """int64 (levels + 1,), the first field of each level."""
    parent: IntArray
    """int32 (fields,), the field of the level above, -1 on the last one."""


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
        When the fields of two levels are not nested, or one of the finest has too many cells.
    """
    inside = labels[0] >= 0
    fields, parents = _numbered([label[inside] for label in labels])
    level_at = np.cumsum([0, *(len(parent) for parent in parents)])
    field_of = np.full(moves.size, -1, dtype=np.int32)
    field_of[inside.ravel()] = fields[0]
    parent = np.concatenate(
        [
            above + level_at[k + 1] if k + 1 < len(labels) else above
            for k, above in enumerate(parents)
        ]
    ).astype(np.int32)
    numbering = Numbering(field_of, level_at, parent)
    return lay_out_numbered(moves, units, numbering, np.flatnonzero(moves))


def lay_out_numbered(
    moves: ByteArray, units: IntArray, numbering: Numbering, cells: LongArray
) -> tuple[CellCosts, Levels]:
    """Number border cells as `lay_out` does, of fields that have their numbers.

    Parameters
    ----------
    moves, units
        See `lay_out`.
    numbering
        The fields.
    cells
        int64 (n,), ascending, the flat cells among which the border cells are.

    Raises
    ------
    InvalidValueError
        When one of the finest fields has too many cells.
    """
    field_of, level_at, parent = numbering
    least = int(units.ravel()[field_of >= 0].min(initial=1 << 30))
    block_at = _block_at(field_of)
    number = np.int16 if level_at[1] <= _MOST_SHORT else np.int32
    ground = CellCosts(
        in_slots(moves, block_at),
        in_slots(field_of.astype(number), block_at, empty=-1),
        in_slots(units, block_at),
        block_at,
        moves.shape[0],
        moves.shape[1],
        least,
    )
    nodes, label = [], np.arange(level_at[1], dtype=np.int32)
    for _ in range(len(level_at) - 1):
        nodes.append(_Nodes(ground, label, cells))
        cells, label = np.sort(nodes[-1].cells), parent[label]
    return ground, _gathered(ground, nodes, numbering)


def _block_at(field_of: IntArray) -> IntArray:
    """Return the first slot of each block of cells; see `CellCosts`."""
    begins = np.arange(0, field_of.size, _BLOCK)
    is_used = np.logical_or.reduceat(field_of >= 0, begins) if len(begins) else begins > 0
    return np.where(is_used, _BLOCK * np.cumsum(is_used), 0).astype(np.int32)


def in_slots(dense: AnyArray, block_at: IntArray, *, empty: int = 0) -> AnyArray:
    """Return the values of cells in the order of their slots.

    Parameters
    ----------
    dense
        The value of each cell of the map.
    block_at
        See `CellCosts`.
    empty
        Value of the slots that stand for cells of no field.
    """
    blocks = np.flatnonzero(block_at)
    cells = (blocks[:, None] * _BLOCK + np.arange(_BLOCK)).ravel()
    values: AnyArray = np.full(_BLOCK + len(cells), empty, dtype=dense.dtype)
    is_cell = cells < dense.size
    values[_BLOCK:][is_cell] = dense.ravel()[cells[is_cell]]
    return values


def slots_of(ground: CellCosts, box: tuple[slice, slice]) -> LongArray:
    """Return the slots of the cells in a box, int64 (rows, cols)."""
    rows, cols = (np.arange(side.start, side.stop) for side in box)
    cells = rows[:, None] * ground.cols + cols
    slots: LongArray = ground.block_at[cells // _BLOCK] + cells % _BLOCK
    return slots


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

    def __init__(self, ground: CellCosts, label: IntArray, cells: AnyArray) -> None:
        crossing = kernels.crossing_cells(ground, label, cells)
        slots = ground.block_at[crossing // _BLOCK] + crossing % _BLOCK
        own = label[ground.field_of[slots]]
        order = np.argsort(own, kind="stable")
        self.cells = crossing[order]
        self.fields = own[order]
        self.label = label


def _gathered(ground: CellCosts, nodes: list[_Nodes], numbering: Numbering) -> Levels:
    """Join the levels, and number what lies between and below their nodes."""
    cell_field, level_at, parent = numbering
    field_of = np.concatenate([level.fields for level in nodes]).astype(np.int32)
    node_at = np.searchsorted(field_of, np.arange(level_at[-1] + 1))
    node_of = np.full(cell_field.size, -1, dtype=np.int32)
    below, starts, ends, costs = [], [np.zeros(1, dtype=np.int64)], [], []
    first = n_moves = 0
    for level in nodes:
        below.append(node_of[level.cells])
        node_of.fill(-1)
        node_of[level.cells] = np.arange(first, first + len(level.cells), dtype=np.int32)
        start, to, cost = kernels.crossing_moves(ground, level.label, level.cells, node_of)
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
    second = slice(level_at[1], level_at[min(2, len(nodes))])
    n_marks = np.zeros(level_at[-1], dtype=np.int64)
    n_marks[second] = -(-n_nodes[second] * n_inner[second] // 8)
    marks_at = np.concatenate([[0], np.cumsum(n_marks)])
    below_of = np.concatenate(below)
    has_below = below_of >= 0
    above = np.full(len(below_of), -1, dtype=np.int32)
    above[below_of[has_below]] = np.flatnonzero(has_below)
    is_stale = np.arange(level_at[-1]) >= level_at[1]
    place_of, n_cells = kernels.places_of(ground.field_of, int(level_at[1]))
    if n_cells.max(initial=0) > MOST_CELLS:
        raise InvalidValueError(
            f"a field of the finest level has {n_cells.max()} cells, expected at most "
            f"{MOST_CELLS}: use smaller fields"
        )
    blocks = -(-n_nodes[: level_at[1]] // LANES)
    steps_at = np.concatenate([[0], np.cumsum(blocks * n_cells * STEP_BITS)])
    return Levels(
        level_at=level_at,
        node_at=node_at,
        inner_at=inner_at,
        parent=parent,
        cell_of=np.concatenate([level.cells for level in nodes]),
        field_of=field_of,
        below=below_of,
        above=above,
        box=kernels.boxes_of(cell_field, ground.cols, int(level_at[1])),
        move_at=np.concatenate(starts).astype(np.int32),
        move_to=np.concatenate(ends),
        move_cost=np.concatenate(costs),
        clique_at=clique_at,
        clique=np.empty(clique_at[-1], dtype=np.int32),
        place_of=place_of,
        steps_at=steps_at,
        steps=np.zeros(steps_at[-1], dtype=np.uint16),
        marks_at=marks_at,
        marks=np.zeros(marks_at[-1], dtype=np.uint8),
        table_at=np.zeros(level_at[-1] + 1, dtype=np.int64),
        table=np.empty(0, dtype=np.int32),
        is_stale=is_stale,
        is_lowered=is_stale.copy(),
        is_newer=np.zeros(level_at[-1], dtype=np.bool_),
    )
