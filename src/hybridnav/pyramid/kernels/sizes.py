"""The kernel that counts what each level has, without making the levels."""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import guarded, njit

_SURVIVES = 255


@guarded
@njit(cache=True, nogil=True)
def level_sizes(vertex_end, vertex_parent, edge_end, cols, n_levels):
    """Count the vertices, arcs and self-loops of each level of a record, int64 (n_levels, 3).

    An edge is a self-loop from the level at which its two cells have gone into the same one.
    """
    sizes = np.zeros((n_levels + 1, 3), np.int64)  # ends of runs of levels, summed below
    for cell in range(vertex_end.size):
        end = vertex_end[cell]
        if end > 0:
            sizes[n_levels - 1 if end == _SURVIVES else end - 1, 0] += 1
    for edge in range(edge_end.size):
        end = edge_end[edge]
        if end == 0:
            continue
        last = n_levels - 1 if end == _SURVIVES else end // 2 - 1
        sizes[last, 1] += 1
        u, v = edge >> 1, (edge >> 1) + (cols if edge & 1 else 1)
        joined = 0
        while u != v and joined <= last:
            if vertex_end[u] > vertex_end[v]:
                u, v = v, u
            joined = n_levels if vertex_end[u] == _SURVIVES else int(vertex_end[u])
            u = vertex_parent[u] if joined <= last else u
        if joined <= last:
            sizes[last, 2] += 1
            sizes[joined - 1, 2] -= 1
    for level in range(n_levels - 1, -1, -1):
        sizes[level] += sizes[level + 1]
    return sizes[:n_levels]
