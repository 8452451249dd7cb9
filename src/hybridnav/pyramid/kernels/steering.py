"""Kernels of steered contraction: which leaves a star may keep."""

from __future__ import annotations

from hybridnav._base.jit import njit


@njit(cache=True, nogil=True)
def refuse_large_leaves(leaves, parent, kernel_dart, areas, most_cells):
    """Keep a leaf only if the star as merged so far has room for it.

    `leaves` are in the order of falling rating; `areas`, int64 (n_vertices,), in cells. The first
    leaf of a star always stays: its arc was a candidate.
    """
    area = areas.copy()
    for v in leaves:
        p = parent[v]
        if area[v] + area[p] > most_cells:
            parent[v] = v
            kernel_dart[v] = -1
        else:
            area[p] += area[v]
