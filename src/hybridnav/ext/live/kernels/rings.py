"""Kernels on the cells round those that are contracted anew."""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import guarded, njit


@guarded
@njit(cache=True, nogil=True)
def ring_joins(ring, end, parent, place):
    """Return the level at which the cells of each base edge in a ring join, flat, 0 for never.

    The second result, int64 (n, 6), are edges whose cells have surviving cells beyond the window:
    the edge, the level reached, and row and column of both, one of them beyond.

    Parameters
    ----------
    ring
        bool (rows, cols), the cells of the ring, in a window.
    end, parent, place
        Fields of `CELL` in the window.
    """
    rows, cols = ring.shape
    joins = np.zeros(2 * rows * cols, np.uint8)
    beyond = np.empty((16, 6), np.int64)
    count = 0
    for edge in range(2 * rows * cols):
        row, col = (edge >> 1) // cols, (edge >> 1) % cols
        to_row, to_col = row + (edge & 1), col + 1 - (edge & 1)
        if not ring[row, col] or to_row == rows or to_col == cols or not ring[to_row, to_col]:
            continue
        if place[row, col] != place[to_row, to_col]:
            continue
        level = 0
        while row != to_row or col != to_col:
            if end[row, col] > end[to_row, to_col]:
                row, col, to_row, to_col = to_row, to_col, row, col
            level = max(level, end[row, col])
            step_row, step_col = parent[row, col, 0], parent[row, col, 1]
            row, col = row + step_row, col + step_col
            if not (0 <= row < rows and 0 <= col < cols):
                if count == len(beyond):
                    longer = np.empty((2 * count, 6), np.int64)
                    longer[:count] = beyond
                    beyond = longer
                beyond[count, 0], beyond[count, 1] = edge, level
                beyond[count, 2], beyond[count, 3] = row, col
                beyond[count, 4], beyond[count, 5] = to_row, to_col
                count += 1
                break
        joins[edge] = level
    return joins, beyond[:count].copy()


@guarded
@njit(cache=True, nogil=True)
def ring_round(dissolved):
    """Return the cells that share a 2x2 block with one of a mask and are not in it, bool."""
    rows, cols = dissolved.shape
    ring = np.zeros((rows, cols), np.bool_)
    for row in range(rows):
        for col in range(cols):
            if not dissolved[row, col]:
                continue
            for i in range(max(row - 1, 0), min(row + 2, rows)):
                for j in range(max(col - 1, 0), min(col + 2, cols)):
                    ring[i, j] |= not dissolved[i, j]
    return ring


@guarded
@njit(cache=True, nogil=True)
def index_in(place, numbers):
    """Return 1 plus the index of the place of each cell among some numbers, 0 for others.

    The result is int32 (rows, cols).

    Parameters
    ----------
    place
        int32 (rows, cols).
    numbers
        int64 (n,), ascending.
    """
    rows, cols = place.shape
    found = np.zeros((rows, cols), np.int32)
    last, index = np.int64(-1), np.int64(0)
    for row in range(rows):
        for col in range(cols):
            number = np.int64(place[row, col])
            if number != last:
                at = np.searchsorted(numbers, number)
                is_in = at < numbers.size and numbers[at] == number
                last, index = number, at + 1 if is_in else 0
            found[row, col] = index
    return found


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


@guarded
@njit(cache=True, nogil=True)
def box_round(row, col, place, table):
    """Return the least box round cells and the places that they are in, four numbers.

    `row`, `col` and `place` are int64 (n,), n at least 1, places -1 for none, `table` the
    columns of the places (see `PlaceTable.columns`).
    """
    numbers, box = table[0], table[3]
    low_row, low_col, high_row, high_col = row[0], col[0], row[0] + 1, col[0] + 1
    last = np.int64(-1)
    for k in range(row.size):
        low_row, low_col = min(low_row, row[k]), min(low_col, col[k])
        high_row, high_col = max(high_row, row[k] + 1), max(high_col, col[k] + 1)
        if place[k] >= 0 and place[k] != last:
            last = place[k]
            i = np.searchsorted(numbers, last)
            low_row, low_col = min(low_row, box[i, 0]), min(low_col, box[i, 1])
            high_row, high_col = max(high_row, box[i, 2]), max(high_col, box[i, 3])
    return low_row, low_col, high_row, high_col


# The kernel that enters what a window was contracted to.

_SURVIVES = 255


@njit(cache=True, nogil=True)
def enter(cells, changed, record, field_of, numbers):
    """Enter the record of a window into its cells, in place.

    Nothing changes beyond the cells that began anew, and their edges.

    Parameters
    ----------
    cells
        The fields class, end, parent, edges and place of `CELL`, of shape (rows, cols).
    changed
        bool and uint8 (rows, cols): the cells that began anew, and the `CellClass` of these now, 0
        elsewhere.
    record
        `vertex_end`, `vertex_parent` and `edge_end` of the window, flat.
    field_of
        int32 (rows, cols), the fields.
    numbers
        int64 (n_fields,), the number of the place of each.
    """
    of_class, end, parent, edges, place = cells
    gone, fresh = changed
    vertex_end, vertex_parent, edge_end = record
    rows, cols = gone.shape
    for row in range(rows):
        for col in range(cols):
            cell = row * cols + col
            if gone[row, col]:
                end[row, col] = vertex_end[cell]
                parent[row, col, 0] = parent[row, col, 1] = 0
                of_class[row, col] = fresh[row, col]
                place[row, col] = -1
                if fresh[row, col] > 0:
                    place[row, col] = numbers[field_of[row, col]]
                    if vertex_end[cell] != _SURVIVES:
                        parent[row, col, 0] = vertex_parent[cell] // cols - row
                        parent[row, col, 1] = vertex_parent[cell] % cols - col
            for north in range(2):
                to_row, to_col = row + north, col + 1 - north
                if to_row == rows or to_col == cols:
                    continue
                if gone[row, col] or gone[to_row, to_col]:
                    edges[row, col, north] = edge_end[2 * cell + north]


# Kernels on the cells of places that regions are made of.
