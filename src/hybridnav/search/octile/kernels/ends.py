"""Kernels of many cells at once on a jump-point graph: their labels, and the legs between them."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.moves import octile_cost
from hybridnav.search.kernels.labels import climb
from hybridnav.search.octile.kernels.legs import class_of, is_direct, join, row_col_kind
from hybridnav.search.octile.kernels.tables import corner_at, is_corner


@guarded
@njit(cache=True, nogil=True)
def labels_of_cells(tables, places, hierarchy, cells, work):
    """Return the labels of flat cells.

    `tables`, `places`: see `shortest`; `hierarchy`, `work`: see `climb`; `cells`: int64 (n,), flat
    free cells in the framed rectangle. Returns int64 (n + 1,) offsets; int32 corner cells, int64
    costs.
    """
    index, _, order, width = tables
    follow = hierarchy[3]
    records, heap = work
    offset = np.zeros(len(cells) + 1, np.int64)
    nodes, costs, n = np.empty(4096, np.int32), np.empty(4096, np.int64), 0
    found = np.empty(len(places) + 1, np.int32)
    for k in range(len(cells)):
        cell = cells[k]
        n_found = 1
        if is_corner(index, cell):
            found[0] = order[corner_at(index, cell)]
        else:
            n_found = join(tables, cell, found, False)
        seen = found[:n_found]
        to_seen, may_follow = np.empty(n_found, np.int64), np.empty(n_found, np.int64)
        for i in range(n_found):
            row, col, kind = row_col_kind(places[seen[i]])
            rows, cols = cell // width - row, cell % width - col
            to_seen[i] = octile_cost(rows, cols)
            # An end on the corner cell rules nothing out.
            is_on = rows == 0 and cols == 0
            may_follow[i] = np.int64(-1) if is_on else follow[kind, class_of(rows, cols)]
        seeds = seen, to_seen, may_follow
        nodes, costs, n, heap = climb(hierarchy, seeds, (records, heap), nodes, costs, n)
        offset[k + 1] = n
    return offset, nodes[:n], costs[:n]


@guarded
@njit(cache=True, nogil=True)
def direct_costs(tables, starts, goals, table):
    """Set the entries of a table with one free leg between their cells to its cost.

    `tables`: see `join`; `starts`, `goals`: int64 (n,) and (m,), flat free cells; `table`: int64
    (n, m); changed.
    """
    width = tables[3]
    for k in range(len(starts)):
        one = starts[k]
        for m in range(len(goals)):
            other = goals[m]
            if is_direct(tables, one, other) or is_direct(tables, other, one):
                table[k, m] = octile_cost(
                    other // width - one // width, other % width - one % width
                )
