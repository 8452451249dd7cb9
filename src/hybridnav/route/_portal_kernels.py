"""Kernels that portal routes are made of: stored paths, a heap, the cells of a way.

Directions are those of `search._kernels`: 0 to 7, east and on counter-clockwise; 8 is the source.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from hybridnav.search._costs import DIAGONAL, STRAIGHT

_ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1], np.int64)
_COL_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1], np.int64)
SOURCE = 8
FAR = 1 << 60
"""More than any path costs."""


class Work(NamedTuple):
    """Scratch of one search; G gates, F fields."""

    at: np.ndarray
    """int64 (G,), cost of the best way found to each gate entered."""
    seen: np.ndarray
    """int64 (G,), the generation in which `at` and `ahead` were set."""
    parent: np.ndarray
    """int64 (G,), the gate entered before, -1 for the start."""
    via: np.ndarray
    """int64 (G,), the gate left to enter this one."""
    ahead: np.ndarray
    """int64 (G,), lower bound on the cost from here to the goal."""
    side_seen: np.ndarray
    """int64 (2 P,), the generation in which `side_ahead` was set."""
    side_ahead: np.ndarray
    """int64 (2 P,), lower bound on the cost from any gate of the side to the goal."""
    passed: np.ndarray
    """int64 (F,), the generation in which a field was on the first way."""
    generation: np.ndarray
    """int64 (1,)."""


class Tables(NamedTuple):
    """What is known between sources and gates; S sources, G gates, P portals."""

    route: np.ndarray
    """float32 (S, G), costs of shortest paths over gates, rounded down; infinite for none."""
    bound: np.ndarray
    """float32 (S, G), no path at all costs less: the same array where every border cell is a gate.
    Empty where nothing is known."""
    reach: np.ndarray
    """int64 (2 P,), cost within which every border cell of a side lies from its portal's source."""
    gate_field: np.ndarray
    """int32 (G,), the field of each gate."""


@njit(cache=True)
def push(keys, items, count, key, item):
    """Put an item on a binary heap; the caller has made room."""
    i = count
    while i > 0:
        parent = (i - 1) >> 1
        if keys[parent] <= key:
            break
        keys[i], items[i] = keys[parent], items[parent]
        i = parent
    keys[i], items[i] = key, item
    return count + 1


@njit(cache=True)
def pop(keys, items, count):
    """Remove the first item of a binary heap; gives the new count. Read it before."""
    count -= 1
    key, item = keys[count], items[count]
    i = 0
    while True:
        child = 2 * i + 1
        if child >= count:
            break
        if child + 1 < count and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[i], items[i] = keys[child], items[child]
        i = child
    keys[i], items[i] = key, item
    return count


@njit(cache=True)
def position_of(index, cols, cell):
    """Position of a cell in the order of `Portals.position`."""
    row, col = np.uint64(cell // cols), np.uint64(cell % cols)
    tile = (row >> np.uint64(3)) * np.uint64(cols + 7 >> 3) + (col >> np.uint64(3))
    inside = (row & np.uint64(7)) << np.uint64(3) | (col & np.uint64(7))
    return np.int64(index[tile << np.uint64(6) | inside])


@njit(cache=True)
def cost_to_gate(index, rows, first, begin, cols, cell):
    """Cost of the stored path from a cell to a gate; `first` is where its field begins in the
    order of cells, `begin` the gate's row."""
    row, col = cell // cols, cell % cols
    width = np.uint64(cols + 7 >> 3)
    straight = diagonal = 0
    while True:
        r, c = np.uint64(row), np.uint64(col)
        tile = (r >> np.uint64(3)) * width + (c >> np.uint64(3))
        inside = (r & np.uint64(7)) << np.uint64(3) | (c & np.uint64(7))
        at = index[tile << np.uint64(6) | inside] - first
        k = rows[np.uint64(begin + (at >> 1))] >> ((at & 1) << 2) & 15
        if k == SOURCE:
            return straight * STRAIGHT + diagonal * DIAGONAL
        diagonal += k & 1
        straight += 1 - (k & 1)
        row += _ROW_STEP[k]
        col += _COL_STEP[k]


@njit(cache=True)
def costs_to_gates(index, rows, row_start, first, cols, gates, count, cell, costs):
    """Costs of the stored paths from a cell to the first `count` of some gates of its field.

    The paths are walked side by side, a step of each in turn: a step waits for memory, and steps of
    different paths wait together.
    """
    width = np.uint64(cols + 7 >> 3)
    row = np.full(count, cell // cols, np.int64)
    col = np.full(count, cell % cols, np.int64)
    begin = np.empty(count, np.int64)
    place = np.arange(count)
    for i in range(count):
        begin[i] = row_start[gates[i]]
        costs[i] = 0
    left = count
    while left > 0:
        i = 0
        while i < left:
            r, c = np.uint64(row[i]), np.uint64(col[i])
            tile = (r >> np.uint64(3)) * width + (c >> np.uint64(3))
            inside = (r & np.uint64(7)) << np.uint64(3) | (c & np.uint64(7))
            at = index[tile << np.uint64(6) | inside] - first
            k = rows[np.uint64(begin[i] + (at >> 1))] >> ((at & 1) << 2) & 15
            if k == SOURCE:
                left -= 1
                row[i], col[i], begin[i] = row[left], col[left], begin[left]
                place[i] = place[left]
                continue
            costs[place[i]] += STRAIGHT + (k & 1) * (DIAGONAL - STRAIGHT)
            row[i] += _ROW_STEP[k]
            col[i] += _COL_STEP[k]
            i += 1


@njit(cache=True)
def follow(index, rows, first, begin, cols, cell, path, count):
    """Append the cells of the stored path from a cell to a gate; gives the new count."""
    row, col = cell // cols, cell % cols
    width = np.uint64(cols + 7 >> 3)
    while True:
        path[count] = row * cols + col
        count += 1
        r, c = np.uint64(row), np.uint64(col)
        tile = (r >> np.uint64(3)) * width + (c >> np.uint64(3))
        inside = (r & np.uint64(7)) << np.uint64(3) | (c & np.uint64(7))
        at = index[tile << np.uint64(6) | inside] - first
        k = rows[np.uint64(begin + (at >> 1))] >> ((at & 1) << 2) & 15
        if k == SOURCE:
            return count
        row += _ROW_STEP[k]
        col += _COL_STEP[k]


@njit(cache=True)
def field_at(portals, cols, cell):
    """The field of a cell that may be entered."""
    index = portals.position
    field_start = portals.field_start
    position = position_of(index, cols, cell)
    return np.searchsorted(field_start, position, side="right") - 1


@njit(cache=True)
def cells_of_way(portals, gate_field, cols, start, goal, last, work, cost):
    """Cells of the way that a search has left, from start to goal; `cost` is the path's."""
    index = portals.position
    rows = portals.rows
    field_start = portals.field_start
    row_start = portals.row_start
    gate_cell = portals.gate_cell
    parent = work.parent
    via = work.via
    n = 0
    x = last
    while x >= 0:
        n += 1
        x = parent[x]
    chain = np.empty(n, np.int64)
    x = last
    for i in range(n - 1, -1, -1):
        chain[i] = x
        x = parent[x]
    # No move is shorter than a cell, and each leg begins anew.
    path = np.empty(cost // STRAIGHT + 2 * n + 2, np.int64)
    count = 0
    cell = start
    field = field_at(portals, cols, start)
    for i in range(n):
        count = follow(
            index, rows, field_start[field], row_start[via[chain[i]]], cols, cell, path, count
        )
        cell = np.int64(gate_cell[chain[i]])
        field = gate_field[chain[i]]
    begin = count
    count = follow(
        index, rows, field_start[field], row_start[chain[n - 1]], cols, goal, path, count
    )
    path[begin:count] = path[begin:count][::-1].copy()
    return path[:count]
