"""Kernels of the contraction that boundaries resist."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.pyramid._kernels import make_key

_LEAST_ATTRIBUTE = 8191


@njit(cache=True, nogil=True)
def yielding(origin, base_edge, classes, widths, peaks, share, seed, keys):
    """Fill `keys` with the arcs that may be contracted, widest first, and return their number.

    Parameters
    ----------
    origin, base_edge
        int32 (2 n_arcs,) and (n_arcs,), as in `Darts`.
    classes, peaks
        By vertex: its kind, and the greatest clearance of its field.
    widths
        float64 (n_arcs,), in the unit of `peaks`.
    share
        In (0, 1]: an arc narrower than this share of the lower peak is kept.
    seed
        uint64, orders equal widths.
    keys
        uint64 (n_arcs,), filled in.
    """
    widest = 0.0
    for e in range(base_edge.size):
        widest = max(widest, widths[e])
    count = 0
    for e in range(base_edge.size):
        u = np.uint32(origin[2 * e])
        v = np.uint32(origin[2 * e + 1])
        if u == v or classes[u] != classes[v] or widths[e] < share * min(peaks[u], peaks[v]):
            continue
        narrowness = 1.0 - widths[e] / widest if widest > 0 else 1.0
        keys[count] = make_key(np.int64(_LEAST_ATTRIBUTE * narrowness), base_edge[e], seed, e)
        count += 1
    return count


@njit(cache=True, nogil=True)
def refuse_narrow_leaves(leaves, parent, kernel_dart, widths, peaks, share):
    """Keep a leaf only if its arc does not resist the star as merged so far.

    `leaves` are in the order of falling width. The first leaf of a star always stays: its arc was a
    candidate.
    """
    peak = peaks.copy()
    for v in leaves:
        p = parent[v]
        if widths[kernel_dart[v] >> 1] < share * min(peak[v], peak[p]):
            parent[v] = v
            kernel_dart[v] = -1
        else:
            peak[p] = max(peak[p], peak[v])
