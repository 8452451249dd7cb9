"""Kernels that look round a cell: its neighbours, what changed beside it, and which place is near.

A window has the places and classes of its cells, int32 and uint8 (rows, cols); `low` is its first
row and column, two integers. A `table` is a `PlaceColumns`.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit


class PlaceColumns(NamedTuple):
    """The columns of places; see `PLACE`."""

    numbers: np.ndarray
    """int64 (n,), ascending."""
    area: np.ndarray
    """Cells."""
    survivor: np.ndarray
    """Flat cell."""
    box: np.ndarray
    """First and last row, first and last column."""
    part: np.ndarray
    """The part of free space, or of obstacles, that it belongs to."""


@njit(cache=True, nogil=True)
def beside_of(cell, side, rows, cols):
    """Return the flat cell on a side of another one, 0 east to 3 south, -1 beyond the window."""
    row, col = cell // cols, cell % cols
    if side == 0:
        return cell + 1 if col + 1 < cols else -1
    if side == 1:
        return cell + cols if row + 1 < rows else -1
    if side == 2:
        return cell - 1 if col > 0 else -1
    return cell - cols if row > 0 else -1


@njit(cache=True, nogil=True)
def with_rows(rows, count, more):
    """Return rows with space for more than some, the same array where it has it."""
    if count + more <= len(rows):
        return rows
    longer = np.empty((2 * (count + more),) + rows.shape[1:], rows.dtype)
    longer[:count] = rows[:count]
    return longer


@njit(cache=True, nogil=True)
def step_to(side, cols):
    """Return what a flat cell on a side differs by, for cells that are at no side of the window.

    `beside_of` divides, which takes longer than all else that is done for a cell.
    """
    if side == 0:
        return 1
    if side == 1:
        return cols
    if side == 2:
        return -1
    return -cols


@guarded
@njit(cache=True, nogil=True)
def look_again(place, low, table, numbers, limit):
    """Bring areas, boxes and surviving cells of places up to date.

    Their boxes hold them. A place from no cell of which all others are near enough loses those that
    are too far from the one nearest to its surviving cell before.

    Parameters
    ----------
    place, low, table
        See above; changed.
    numbers
        int64 (n,), the places.
    limit
        Squared distances to a surviving cell stay below it.

    Returns
    -------
    int64 (m,)
        The flat cells that were lost.
    int64 (k,)
        The places that have another surviving cell.
    """
    area, survivor = table.area, table.survivor
    moved, n_moved = np.empty(numbers.size, np.int64), 0
    cells, n_cells = np.empty(16, np.int64), 0
    around = np.empty(4, np.int64)
    for number in numbers:
        i = np.searchsorted(table.numbers, number)
        measure(place, low, (number, i), table, around)
        if area[i] == 0:
            continue
        at_row, at_col = np.int64(survivor[i, 0] - low[0]), np.int64(survivor[i, 1] - low[1])
        is_in = around[0] <= at_row < around[2] and around[1] <= at_col < around[3]
        if is_in and place[at_row, at_col] == number:
            continue
        found, is_near = survivor_in(place, number, around, (at_row, at_col), limit)
        survivor[i, 0], survivor[i, 1] = found[0] + low[0], found[1] + low[1]
        moved[n_moved] = number
        n_moved += 1
        if not is_near:
            lost = leave_near(place, number, around, found, limit)
            cells = with_rows(cells, n_cells, lost.size)
            cells[n_cells : n_cells + lost.size] = lost
            n_cells += lost.size
            measure(place, low, (number, i), table, around)
    return cells[:n_cells].copy(), moved[:n_moved].copy()


@njit(cache=True, nogil=True)
def measure(place, low, of_place, table, around):
    """Bring the area and the box of a place, given by number and row, up to date.

    `around` receives its box in the window, where it has cells; the box in the table holds it.
    """
    number, i = of_place
    area, box = table.area, table.box
    n_found = 0
    low_row, low_col, high_row, high_col = place.shape[0], place.shape[1], 0, 0
    for row in range(box[i, 0] - low[0], box[i, 2] - low[0]):
        for col in range(box[i, 1] - low[1], box[i, 3] - low[1]):
            if place[row, col] == number:
                n_found += 1
                low_row, low_col = min(low_row, row), min(low_col, col)
                high_row, high_col = max(high_row, row + 1), max(high_col, col + 1)
    area[i] = n_found
    if n_found > 0:
        around[0], around[1], around[2], around[3] = low_row, low_col, high_row, high_col
        for k in range(4):
            box[i, k] = around[k] + low[k & 1]


@njit(cache=True, nogil=True)
def leave_near(place, number, box, survivor, limit):
    """Leave a place the cells near its surviving one that connect to it; return the others, flat.

    `box` holds the place, in the window.
    """
    cols = place.shape[1]
    flat = place.ravel()
    lost, n_lost = np.empty((box[2] - box[0]) * (box[3] - box[1]), np.int64), 0
    for row in range(box[0], box[2]):
        for col in range(box[1], box[3]):
            if place[row, col] == number:
                place[row, col] = -1
                lost[n_lost] = row * cols + col
                n_lost += 1
    waits = np.zeros(flat.size, np.bool_)
    waits[lost[:n_lost]] = True
    stack, size = np.empty(n_lost, np.int64), 1
    stack[0] = survivor[0] * cols + survivor[1]
    waits[stack[0]] = False
    while size > 0:
        size -= 1
        cell = stack[size]
        flat[cell] = number
        for side in range(4):
            beside = cell + step_to(side, cols)
            if not waits[beside]:
                continue
            squared = (beside // cols - survivor[0]) ** 2 + (beside % cols - survivor[1]) ** 2
            if squared < limit:
                waits[beside] = False
                stack[size] = beside
                size += 1
    return lost[:n_lost][waits[lost[:n_lost]]]


@njit(cache=True, nogil=True)
def survivor_in(place, number, box, before, limit):
    """Return a cell of a place, and whether no other one is too far from it.

    Tried are the cells that are nearest to the surviving one before and to the middle of the box;
    the first of them is returned where neither suits.
    """
    first_row, first_col = nearest_cell(place, number, box, float(before[0]), float(before[1]))
    if is_within(place, number, box, (first_row, first_col), limit):
        return (first_row, first_col), True
    middle = (box[0] + box[2] - 1) / 2, (box[1] + box[3] - 1) / 2
    row, col = nearest_cell(place, number, box, middle[0], middle[1])
    if is_within(place, number, box, (row, col), limit):
        return (row, col), True
    return (first_row, first_col), False


@njit(cache=True, nogil=True)
def is_within(place, number, box, cell, limit):
    """Return whether all cells of a place in a box are near enough to a cell."""
    row, col = np.int64(cell[0]), np.int64(cell[1])
    for i in range(box[0], box[2]):
        left = limit - (i - row) ** 2
        for j in range(box[1], box[3]):
            if (j - col) ** 2 >= left and place[i, j] == number:
                return False
    return True


@njit(cache=True, nogil=True)
def nearest_cell(place, number, box, row, col):
    """Return the cell of a place in a box that is nearest to a point, row and column."""
    least, found_row, found_col = np.inf, np.int64(-1), np.int64(-1)
    for i in range(box[0], box[2]):
        for j in range(box[1], box[3]):
            if place[i, j] == number:
                squared = (i - row) ** 2 + (j - col) ** 2
                if squared < least:
                    least, found_row, found_col = squared, i, j
    return found_row, found_col


@guarded
@njit(cache=True, nogil=True)
def box_groups(boxes):
    """Return the group of each box, int64 (n,), the number of its first box.

    The boxes round two groups have no cell in common, not even when one is a cell wider.

    Parameters
    ----------
    boxes
        int64 (n, 4), the least row and column and the first ones beyond; changed.
    """
    count = len(boxes)
    group = np.arange(count)
    grows = True
    while grows:
        grows = False
        for i in range(count):
            if group[i] != i:
                continue
            for j in range(i + 1, count):
                if group[j] != j:
                    continue
                if (
                    boxes[i, 0] <= boxes[j, 2]
                    and boxes[j, 0] <= boxes[i, 2]
                    and boxes[i, 1] <= boxes[j, 3]
                    and boxes[j, 1] <= boxes[i, 3]
                ):
                    group[j] = i
                    for k in range(2):
                        boxes[i, k] = min(boxes[i, k], boxes[j, k])
                        boxes[i, k + 2] = max(boxes[i, k + 2], boxes[j, k + 2])
                    grows = True
    for i in range(count):
        group[i] = group[group[i]]
    return group
