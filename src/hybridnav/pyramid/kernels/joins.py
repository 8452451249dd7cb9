"""Kernels by which cells join at the levels at which they do so elsewhere, or survive."""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import njit
from hybridnav.pyramid.kernels.decimation import FIRST_MAY_SURVIVE, SECOND_MAY_SURVIVE

_POSITION = np.uint64(0x3FFFFFFF)


@njit(cache=True, nogil=True)
def select_joins(origin, base_edge, joins, level, parent, kernel_dart):
    """Add stars of the edges that join up to a level; return the number of their leaves.

    Parameters
    ----------
    origin, base_edge
        See `_kernels.contractible`.
    joins
        uint8 by base edge, the level at which its two cells join, 0 for never.
    level
        Number of the level.
    parent, kernel_dart
        int32 (n_vertices,), changed; see `_kernels.select_stars`, whose stars have no vertex in
        common with these. A centre has a kernel dart of its own only while this runs.
    """
    leaves = 0
    for e in range(base_edge.size):
        join = joins[base_edge[e]]
        u, v = origin[2 * e], origin[2 * e + 1]
        if join == 0 or join > level or u == v:
            continue
        is_leaf = parent[u] != u, parent[v] != v
        is_centre = kernel_dart[u] == -2, kernel_dart[v] == -2
        if is_leaf[0] or is_leaf[1] or (is_centre[0] and is_centre[1]):
            continue
        centre, leaf, dart = (v, u, 2 * e + 1) if is_centre[1] else (u, v, 2 * e)
        kernel_dart[centre] = -2
        parent[leaf] = centre
        kernel_dart[leaf] = dart
        leaves += 1
    for v in range(parent.size):
        if kernel_dart[v] == -2:
            kernel_dart[v] = -1
    return leaves


@njit(cache=True, nogil=True)
def let_survive(origin, keys, cells, cols, survivors, survivors_of_edge):
    """Let certain cells survive whatever they merge with.

    Parameters
    ----------
    origin, keys, survivors_of_edge
        See `_kernels.contractible`; the last is changed.
    cells
        int32 (n_vertices, 2), the surviving cells of the level.
    cols
        Columns of the grid.
    survivors
        bool by flat cell, the cells that survive; no edge has two of them.
    """
    for i in range(keys.size):
        edge = np.int64(keys[i] & _POSITION)
        u, v = origin[2 * edge], origin[2 * edge + 1]
        if survivors[cells[u, 0] * cols + cells[u, 1]]:
            survivors_of_edge[edge] = FIRST_MAY_SURVIVE
        elif survivors[cells[v, 0] * cols + cells[v, 1]]:
            survivors_of_edge[edge] = SECOND_MAY_SURVIVE
