"""Kernels that join cells to corner cells, by the tables of a jump-point graph."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.jumps._leg_kernels import class_of, reverse, row_col_kind
from hybridnav.jumps._table_kernels import corner_at, is_corner, number_of
from hybridnav.search.arrays import grow
from hybridnav.search.contraction import pack
from hybridnav.search.moves import octile_cost


@njit(cache=True, nogil=True)
def join(tables, cell, found):
    """Find the corner cells that are reached from a cell along a diagonal and then a side.

    They include every corner cell that can be the next one on a shortest path, with no other one
    before it. A corner cell does not find itself.

    Parameters
    ----------
    tables
        The index of cells (see `number_cells`), the distances ahead of them (see `look_ahead`), the
        number of each corner cell in the graph, int32 (n,), and the width of the framed grid.
    cell
        Flat free cell.
    found
        int32, room for all corner cells; filled in.

    Returns
    -------
    int
        Number of corner cells found.
    """
    index, ahead, order, width = tables
    here = number_of(index, cell)
    n_found = 0
    for straight in range(0, 8, 2):
        seen = np.int64(ahead[here, straight])
        if seen > 0:
            found[n_found] = order[corner_at(index, cell + seen * step_of(straight, width))]
            n_found += 1
    # The four diagonals take turns, so that the processor fetches their data at the same time: `at`
    # is the position of each, -1 at its end; `limits` how far along its right and left side corner
    # cells count.
    at, limits = np.full(8, cell), np.empty((8, 2), np.int64)
    for k in range(1, 8, 2):
        limits[k, 0], limits[k, 1] = limit_of(ahead[here, k - 1]), limit_of(ahead[here, k + 1 & 7])
    n_left = 4
    while n_left > 0:
        for k in range(1, 8, 2):
            if at[k] < 0:
                continue
            seen = np.int64(ahead[number_of(index, at[k]), k])
            at[k] += seen * step_of(k, width)
            if seen <= 0 or is_corner(index, at[k]):
                if seen > 0:
                    found[n_found] = order[corner_at(index, at[k])]
                    n_found += 1
                at[k] = -1
                n_left -= 1
                continue
            there = number_of(index, at[k])
            for i in range(2):
                along = k - 1 + 2 * i & 7
                seen = np.int64(ahead[there, along])
                if 0 < seen < limits[k, i]:
                    straight = at[k] + seen * step_of(along, width)
                    found[n_found] = order[corner_at(index, straight)]
                    n_found += 1
                limits[k, i] = min(limits[k, i], limit_of(seen))
    return n_found


@njit(cache=True, nogil=True)
def step_of(k, width):
    """Return the step from a flat cell to its neighbour in a direction."""
    if k == 0:
        return 1
    if k < 4:
        return width + 2 - k
    if k == 4:
        return -1
    return k - 6 - width


@njit(cache=True, nogil=True)
def limit_of(seen):
    """Return the distance along a side from which no cell is the next corner cell any more.

    It holds further along the diagonal: a corner cell or a blocked one lies before that distance.
    """
    return seen if seen > 0 else 1 - seen


@njit(cache=True, nogil=True)
def is_direct(tables, cell, goal):
    """Return whether the leg from a cell to another one, diagonal first, is free."""
    width = tables[3]
    rows, cols = goal // width - cell // width, goal % width - cell % width
    diagonal = min(abs(rows), abs(cols))
    straight = max(abs(rows), abs(cols)) - diagonal
    at = cell
    if diagonal > 0:
        k = (1 if cols > 0 else 3) if rows > 0 else (7 if cols > 0 else 5)
        if not _is_free(tables, at, k, diagonal):
            return False
        at += diagonal * step_of(k, width)
    if straight > 0:
        along_col, along_row = (2 if rows > 0 else 6), (0 if cols > 0 else 4)
        k = along_col if abs(rows) > abs(cols) else along_row
        return _is_free(tables, at, k, straight)
    return True


@njit(cache=True, nogil=True)
def _is_free(tables, at, k, distance):
    """Return whether `distance` moves in a direction are legal."""
    index, ahead, _, width = tables
    step = step_of(k, width)
    while True:
        seen = np.int64(ahead[number_of(index, at), k])
        if seen <= 0:
            return -seen >= distance
        if seen >= distance:
            return True
        at += seen * step
        distance -= seen


@njit(cache=True, nogil=True)
def _joined(tables, corners):
    """Join every corner cell to others; return the offsets of those that each finds, and these."""
    n_corners = corners.size
    begin = np.zeros(n_corners + 1, np.int64)
    heads = np.empty(16 * n_corners + 16, np.int32)
    found = np.empty(n_corners, np.int32)
    n_heads = 0
    for corner in range(n_corners):
        n_found = join(tables, np.int64(corners[corner]), found)
        while n_heads + n_found > heads.size:
            heads = grow(heads)
        heads[n_heads : n_heads + n_found] = found[:n_found]
        n_heads += n_found
        begin[corner + 1] = n_heads
    return begin, heads[:n_heads]


@guarded
@njit(cache=True, nogil=True)
def arcs_of(tables, corners, places):
    """Build the arcs between corner cells.

    Parameters
    ----------
    tables
        See `join`.
    corners
        int32 (n,), flat corner cells.
    places
        int64 (n,), see `row_col_kind`.

    Returns
    -------
    tuple
        int32 (n + 1,), where the arcs of each corner cell begin; int64 (m, 2), the cost of each
        arc, and its head and classes (see `pack`). Each arc comes with its reverse.
    """
    begin, heads = _joined(tables, corners)
    # An arc that only one endpoint finds passes another corner cell: two arcs replace it.
    is_kept = np.zeros(heads.size, np.bool_)
    first = np.zeros(corners.size + 1, np.int32)
    for corner in range(corners.size):
        first[corner + 1] = first[corner]
        for at in range(begin[corner], begin[corner + 1]):
            other = heads[at]
            for back in range(begin[other], begin[other + 1]):
                if heads[back] == corner:
                    is_kept[at] = True
                    first[corner + 1] += 1
                    break
    arcs = np.empty((first[-1], 2), np.int64)
    n_arcs = 0
    for corner in range(corners.size):
        row, col, _ = row_col_kind(places[corner])
        for at in range(begin[corner], begin[corner + 1]):
            if is_kept[at]:
                to_row, to_col, _ = row_col_kind(places[heads[at]])
                leg = class_of(to_row - row, to_col - col)
                arcs[n_arcs, 0] = octile_cost(to_row - row, to_col - col)
                arcs[n_arcs, 1] = pack(np.int64(heads[at]), leg, reverse(leg))
                n_arcs += 1
    return first, arcs


@njit(cache=True, nogil=True)
def components(first, arcs):
    """Number the connected parts of a graph, int32 (n,) for its corner cells."""
    part = np.full(first.size - 1, -1, np.int32)
    waiting = np.empty(first.size, np.int32)
    n_parts = 0
    for corner in range(part.size):
        if part[corner] >= 0:
            continue
        part[corner] = n_parts
        waiting[0], n_waiting = corner, 1
        while n_waiting > 0:
            n_waiting -= 1
            at = waiting[n_waiting]
            for arc in range(first[at], first[at + 1]):
                other = arcs[arc, 1] >> 12
                if part[other] < 0:
                    part[other] = n_parts
                    waiting[n_waiting] = other
                    n_waiting += 1
        n_parts += 1
    return part
