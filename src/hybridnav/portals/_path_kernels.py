"""Kernels of the parts of portal routes: stored paths, and the cells of a path.

Directions are those of `search.moves`: 0 to 7, east and on counter-clockwise, with `LEAP` set
where as many moves lead that way.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.grid.centres import centres
from hybridnav.portals._gate_kernels import LEAP
from hybridnav.search.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT

_INVERSE = DIAGONAL % STRAIGHT
UNREACHED = np.uint32(0xFFFFFFFF)


@njit(cache=True, nogil=True)
def position_of(index, cols, cell):
    """Return the position of a cell in the order of `Portals.position`."""
    row, col = np.uint64(cell // cols), np.uint64(cell % cols)
    tile = (row >> np.uint64(3)) * np.uint64(cols + 7 >> 3) + (col >> np.uint64(3))
    inside = (row & np.uint64(7)) << np.uint64(3) | (col & np.uint64(7))
    return np.int64(index[tile << np.uint64(6) | inside])


@njit(cache=True, nogil=True)
def field_at(portals, cols, cell):
    """Return the field of a cell that may be entered."""
    index = portals.position
    field_start = portals.field_start
    position = position_of(index, cols, cell)
    return np.searchsorted(field_start, position, side="right") - 1


@njit(cache=True, nogil=True)
def stored_costs(portals, field, cols, gates, count, cell, costs):
    """Fill in the costs of the stored paths from a cell to some gates of its field.

    The paths are walked side by side, a step of each in turn: a step waits for memory, and steps of
    different paths wait together.

    Parameters
    ----------
    portals
        `Portals`.
    field
        The field of the cell.
    cols
        Columns of the grid.
    gates, count
        Gates of the field, and how many of them to walk to.
    cell
        Flat cell.
    costs
        int64 (count,), filled in.
    """
    index = portals.position
    first_move = portals.first_move
    first_move_start = portals.first_move_start
    gate_cell = portals.gate_cell
    first = portals.field_start[field]
    width = np.uint64(cols + 7 >> 3)
    row = np.full(count, cell // cols, np.int64)
    col = np.full(count, cell % cols, np.int64)
    begin = np.empty(count, np.int64)
    end = np.empty(count, np.int64)
    place = np.arange(count)
    for i in range(count):
        begin[i], end[i] = first_move_start[gates[i]], gate_cell[gates[i]]
        costs[i] = 0
    left = count
    while left > 0:
        i = 0
        while i < left:
            if row[i] * cols + col[i] == end[i]:
                left -= 1
                row[i], col[i], begin[i], end[i] = row[left], col[left], begin[left], end[left]
                place[i] = place[left]
                continue
            r, c = np.uint64(row[i]), np.uint64(col[i])
            tile = (r >> np.uint64(3)) * width + (c >> np.uint64(3))
            inside = (r & np.uint64(7)) << np.uint64(3) | (c & np.uint64(7))
            at = index[tile << np.uint64(6) | inside] - first
            code = first_move[np.uint64(begin[i] + (at >> 1))] >> ((at & 1) << 2)
            k, n = code & 7, 1 + (LEAP - 1) * (code >> 3 & 1)
            costs[place[i]] += n * (STRAIGHT + (k & 1) * (DIAGONAL - STRAIGHT))
            row[i] += n * ROW_STEP[k]
            col[i] += n * COL_STEP[k]
            i += 1


@njit(cache=True, nogil=True)
def moves_of(cost):
    """Return the number of moves of a path from its integer cost."""
    diagonal = cost % STRAIGHT * _INVERSE % STRAIGHT
    return (cost - diagonal * DIAGONAL) // STRAIGHT + diagonal


@njit(cache=True, nogil=True)
def cells_of_path(portals, gate_field, cols, start, goal, out, into, legs, frame):
    """Return the cells of a path and their centres.

    The path leaves its fields by the gates `out` and enters the next ones by `into`. Its parts are
    walked side by side, as in `stored_costs`: from where each begins to the gate it ends at, the
    last one back from the goal.

    Parameters
    ----------
    portals
        `Portals`.
    gate_field
        int32 (G,), the field of each gate.
    cols
        Columns of the grid.
    start, goal
        Flat cells.
    out, into
        (n,), gates.
    legs
        int64 (n + 1,), integer costs of the parts.
    frame
        `Frame.for_kernels` of the grid.

    Returns
    -------
    tuple
        int64 (m, 2), cells (row, col), and float64 (m, 2), their centres in the map frame.
    """
    index = portals.position
    first_move = portals.first_move
    field_start = portals.field_start
    first_move_start = portals.first_move_start
    gate_cell = portals.gate_cell
    n = out.size
    row = np.empty(n + 1, np.int64)
    col = np.empty(n + 1, np.int64)
    begin = np.empty(n + 1, np.int64)
    first = np.empty(n + 1, np.int64)
    end = np.empty(n + 1, np.int64)
    at = np.empty(n + 1, np.int64)
    onward = np.ones(n + 1, np.int64)
    count = 0
    for k in range(n + 1):
        cell = start
        if k == n:
            cell = goal
        elif k > 0:
            cell = np.int64(gate_cell[into[k - 1]])
        gate = out[k] if k < n else into[n - 1]
        row[k], col[k] = cell // cols, cell % cols
        begin[k], end[k] = first_move_start[gate], gate_cell[gate]
        first[k] = field_start[gate_field[gate]]
        at[k] = count
        count += moves_of(legs[k]) + 1
    at[n], onward[n] = count - 1, -1
    cells = np.empty((count, 2), np.int64)
    width = np.uint64(cols + 7 >> 3)
    left = n + 1
    while left > 0:
        i = 0
        while i < left:
            here = at[i]
            cells[here, 0], cells[here, 1] = row[i], col[i]
            if row[i] * cols + col[i] == end[i]:
                left -= 1
                row[i], col[i], begin[i], first[i] = row[left], col[left], begin[left], first[left]
                end[i], at[i], onward[i] = end[left], at[left], onward[left]
                continue
            r, c = np.uint64(row[i]), np.uint64(col[i])
            tile = (r >> np.uint64(3)) * width + (c >> np.uint64(3))
            inside = (r & np.uint64(7)) << np.uint64(3) | (c & np.uint64(7))
            position = index[tile << np.uint64(6) | inside] - first[i]
            code = first_move[np.uint64(begin[i] + (position >> 1))] >> ((position & 1) << 2)
            k = code & 7
            for _ in range(LEAP - 1 if code & LEAP else 0):
                row[i] += ROW_STEP[k]
                col[i] += COL_STEP[k]
                here += onward[i]
                cells[here, 0], cells[here, 1] = row[i], col[i]
            row[i] += ROW_STEP[k]
            col[i] += COL_STEP[k]
            at[i] = here + onward[i]
            i += 1
    return cells, centres(cells, frame)
