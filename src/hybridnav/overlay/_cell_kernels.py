"""Kernels of the cells of a path over nodes of the finest level."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._cost_kernels import clique_place
from hybridnav.overlay._field_kernels import append_back, forget, spread
from hybridnav.overlay._path_kernels import append


@njit(cache=True, nogil=True)
def append_field_path(ground, span, endpoints, limit, distance, touched, cells, n):
    """Append the cells of a shortest path inside a field, without its first one.

    Parameters
    ----------
    ground
        See `CellCosts`.
    span
        See `spread`.
    endpoints
        Its two flat cells.
    limit
        Its cost.
    distance, touched
        Work arrays, see `spread`.
    cells, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `cells` and `touched`, in new arrays if there was no room; the number of cells filled and of
        cells expanded.
    """
    touched, count, expanded = spread(
        ground, span, endpoints[0], endpoints[1], limit, distance, touched
    )
    begin = n
    cells, n = append_back(ground, span, distance, endpoints[1], cells, n)
    cells[begin:n] = cells[begin:n][::-1].copy()
    forget(distance, touched, count)
    return cells, touched, n, expanded


@njit(cache=True, nogil=True)
def append_cells(ground, levels, nodes, distance, touched, cells, n):
    """Append the cells of a path over nodes of the finest level, without the first one's.

    Parameters
    ----------
    ground, levels
        See `CellCosts` and `Levels`.
    nodes
        int64 (m,), m >= 1.
    distance, touched
        Work arrays, see `spread`.
    cells, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        As `append_field_path`.
    """
    expanded = 0
    for i in range(1, nodes.size):
        before, node = nodes[i - 1], nodes[i]
        field = levels.field_of[node]
        if levels.cell_of[before] == levels.cell_of[node]:
            continue
        if levels.field_of[before] != field:
            cells = append(cells, n, levels.cell_of[node])
            n += 1
            continue
        first = levels.node_at[field]
        place = levels.clique_at[field] + clique_place(before - first, node - first)
        limit = levels.clique[place]
        span = (np.int64(field), np.int64(field) + 1)
        endpoints = (np.int64(levels.cell_of[before]), np.int64(levels.cell_of[node]))
        cells, touched, n, more = append_field_path(
            ground, span, endpoints, limit, distance, touched, cells, n
        )
        expanded += more
    return cells, touched, n, expanded
