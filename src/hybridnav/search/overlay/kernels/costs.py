"""Kernels of the costs of moves, integers, and of the cells of a field with their moves."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.moves import COL_STEP, ROW_STEP
from hybridnav.search.overlay.kernels.lanes import FAR

ROOT = 1482910
"""sqrt 2 in units of 1 / 2^20, rounded down."""
BLOCK_BITS = 4
"""Bits of the places of cells in the blocks that have slots or have none."""


@njit(cache=True, nogil=True)
def slot_of(ground, cell):
    """Return the slot of a flat cell; see `CellCosts`."""
    return np.int64(ground.block_at[cell >> BLOCK_BITS]) + (cell & (1 << BLOCK_BITS) - 1)


@njit(cache=True, nogil=True)
def move_cost(units, direction):
    """Return the cost of a move from the sum of the units of its two cells, rounded down."""
    units = np.int64(units)
    return units * ROOT >> 20 if direction & 1 else units


@njit(cache=True, nogil=True)
def sums_along(ground, cells):
    """Return the sums of the units of two cells over the straight moves of a path, and the others.

    Parameters
    ----------
    ground
        See `CellCosts`.
    cells
        int64 (n, 2), (row, col).
    """
    units, cols = ground.units, ground.cols
    straight, diagonal = np.int64(0), np.int64(0)
    for i in range(1, len(cells)):
        row, col, row_before, col_before = (
            cells[i, 0],
            cells[i, 1],
            cells[i - 1, 0],
            cells[i - 1, 1],
        )
        both = np.int64(units[slot_of(ground, row * cols + col)])
        both += np.int64(units[slot_of(ground, row_before * cols + col_before)])
        if row != row_before and col != col_before:
            diagonal += both
        else:
            straight += both
    return straight, diagonal


@njit(cache=True, nogil=True)
def octile_units(rows, across, least_units):
    """Return the cost of the octile distance of some rows and columns, with the least units."""
    diagonal = min(rows, across)
    straight = max(rows, across) - diagonal
    return straight * 2 * least_units + diagonal * (2 * least_units * ROOT >> 20)


@njit(cache=True, nogil=True)
def least_cost(cell, goal, cols, least_units):
    """Return a lower bound on the cost between two flat cells: no obstacles, least units.

    It is consistent: a move changes it by at most its own cost.
    """
    # Divisions take longest; those of unsigned numbers of 32 bits least.
    row, goal_row = np.uint32(cell) // np.uint32(cols), np.uint32(goal) // np.uint32(cols)
    rows = abs(np.int64(row) - np.int64(goal_row))
    across = abs(np.int64(cell - row * cols) - np.int64(goal - goal_row * cols))
    return octile_units(rows, across, least_units)


@njit(cache=True, nogil=True)
def clique_place(i, j):
    """Return the place of the distance between nodes i and j in a clique: the lower triangle."""
    return (i * (i + 1) >> 1) + j if i >= j else (j * (j + 1) >> 1) + i


@njit(cache=True, nogil=True)
def cost_between(ground, cell, other):
    """Return the cost of the move between two flat cells side by side, FAR if it is not legal."""
    units, cols = ground.units, ground.cols
    slot = slot_of(ground, cell)
    for k in range(8):
        if ground.moves[slot] >> k & 1 and cell + ROW_STEP[k] * cols + COL_STEP[k] == other:
            return np.int32(move_cost(units[slot] + units[slot_of(ground, other)], k))
    return FAR


@njit(cache=True, nogil=True)
def field_moves(ground, cells, place_of):
    """Return the moves between the cells of one field, for searches in lanes.

    Parameters
    ----------
    ground
        See `CellCosts`.
    cells
        int64 (n,), the flat cells of the field, ascending.
    place_of
        uint16 (slots,), the place of each of these cells in `cells`.

    Returns
    -------
    tuple
        uint32 ((n + 1) * 8,), the places that moves lead to, n for none, and int32 of the same
        shape, their costs.
    """
    field_of, units, cols = ground.field_of, ground.units, ground.cols
    n = cells.size
    near = np.full((n + 1) * 8, n, np.uint32)
    cost = np.zeros((n + 1) * 8, np.int32)
    for i in range(n):
        slot = slot_of(ground, cells[i])
        for k in range(8):
            if ground.moves[slot] >> k & 1:
                other = slot_of(ground, cells[i] + ROW_STEP[k] * cols + COL_STEP[k])
                if field_of[other] == field_of[slot]:
                    near[8 * i + k] = place_of[other]
                    cost[8 * i + k] = move_cost(units[slot] + units[other], k)
    return near, cost


@njit(cache=True, nogil=True)
def crossing_cells(ground, label, cells):
    """Return those of some cells that have a move to a cell of another label.

    Parameters
    ----------
    ground
        See `CellCosts`.
    label
        int32 (fields of the finest level,), the field of a level around each.
    cells
        int (n,), flat cells of fields.
    """
    field_of, cols = ground.field_of, ground.cols
    found, n = np.empty(cells.size, np.int32), 0
    for cell in cells:
        slot = slot_of(ground, np.int64(cell))
        for k in range(8):
            if ground.moves[slot] >> k & 1:
                other = slot_of(ground, np.int64(cell) + ROW_STEP[k] * cols + COL_STEP[k])
                if label[field_of[other]] != label[field_of[slot]]:
                    found[n] = cell
                    n += 1
                    break
    return found[:n]


@guarded
@njit(cache=True, nogil=True)
def crossing_moves(ground, label, cells, node_of):
    """Return the moves between fields of one level: start of each node's, nodes, costs.

    Parameters
    ----------
    ground
        See `CellCosts`.
    label
        int32 (fields of the finest level,), the field of this level around each.
    cells
        int32 (n,), the flat cells of the nodes.
    node_of
        int32 (rows * cols,), the number of the node on each of these cells.
    """
    field_of, units, cols = ground.field_of, ground.units, ground.cols
    n = cells.size
    start = np.zeros(n + 1, np.int64)
    for turn in range(2):
        if turn == 1:
            start = np.cumsum(start)
            to = np.empty(start[n], np.int32)
            cost = np.empty(start[n], np.int32)
        for i in range(n):
            at, slot = start[i], slot_of(ground, np.int64(cells[i]))
            for k in range(8):
                if ground.moves[slot] >> k & 1:
                    cell = np.int64(cells[i]) + ROW_STEP[k] * cols + COL_STEP[k]
                    other = slot_of(ground, cell)
                    if label[field_of[other]] != label[field_of[slot]]:
                        if turn == 0:
                            start[i + 1] += 1
                        else:
                            to[at] = node_of[cell]
                            cost[at] = move_cost(units[slot] + units[other], k)
                            at += 1
    return start, to, cost


@guarded
@njit(cache=True, nogil=True)
def places_of(field_of, n_fields):
    """Return the place of each cell among those of its field, uint16, and their numbers, int64.

    Parameters
    ----------
    field_of
        int (n,), the field of each cell or slot, in the order of the cells.
    n_fields
        Number of fields.
    """
    place_of, count = np.zeros(field_of.size, np.uint16), np.zeros(n_fields, np.int64)
    for cell in range(field_of.size):
        field = field_of[cell]
        if field >= 0:
            place_of[cell] = count[field]
            count[field] += 1
    return place_of, count


@njit(cache=True, nogil=True)
def boxes_of(field_of, cols, n_fields):
    """Return the rows and columns that hold each field, int32 (fields, 4): first, last + 1."""
    box = np.zeros((n_fields, 4), np.int32)
    for cell in range(field_of.size):
        field = field_of[cell]
        if field < 0:
            continue
        row, col = cell // cols, cell % cols
        if box[field, 1] == 0:
            box[field, 0], box[field, 2], box[field, 3] = row, col, col + 1
        box[field, 1] = row + 1
        box[field, 2] = min(box[field, 2], col)
        box[field, 3] = max(box[field, 3], col + 1)
    return box


@njit(cache=True, nogil=True)
def renew_moves(levels, ground, fields, box):
    """Compute the costs of the moves between fields again, from the nodes inside a box.

    Parameters
    ----------
    levels
        See `Levels`; its costs of moves are changed.
    ground
        See `CellCosts`.
    fields
        int32 (k,), fields of all levels that have cells in the box.
    box
        Its first row, the one after the last, and the columns alike.
    """
    for field in fields:
        for node in range(levels.node_at[field], levels.node_at[field + 1]):
            cell = np.int64(levels.cell_of[node])
            row, col = cell // ground.cols, cell % ground.cols
            if box[0] <= row < box[1] and box[2] <= col < box[3]:
                for at in range(levels.move_at[node], levels.move_at[node + 1]):
                    other = np.int64(levels.cell_of[levels.move_to[at]])
                    levels.move_cost[at] = cost_between(ground, cell, other)
