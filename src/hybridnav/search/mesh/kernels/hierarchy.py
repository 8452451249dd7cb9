"""Kernels of the hierarchy of corners: the arcs to contract, and those that may follow each other.

Costs are whole numbers, distances in 1 / `UNITS` cells, rounded down: sums of them are exact and
never exceed the distance.
"""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.search.contraction import pack
from hybridnav.search.mesh.kernels.views import distance, lobe_of

UNITS = float(1 << 34)
"""Units of cost per cell: a path of 100,000 segments is exact to 1e-5 cells, and one of 5e8 cells
fits."""
_SECTORS = 32
"""Sectors of a quadrant, by which directions are sorted."""


@njit(cache=True, nogil=True)
def cost_of(ax, ay, bx, by):
    """Return the cost of the segment between two points."""
    return np.int64(distance(ax, ay, bx, by) * UNITS)


@njit(cache=True, nogil=True)
def class_of(kind, dx, dy):
    """Return the class of a direction from a corner that touches its blocked cell.

    The class is its quadrant (see `lobe_of`) and, in there, its sector by slope.
    """
    across = abs(dy)
    sector = min(int(across / (abs(dx) + across) * _SECTORS), _SECTORS - 1)
    return lobe_of(kind, dx, dy) * _SECTORS + sector


@njit(cache=True, nogil=True)
def classes_that_follow():
    """Return the classes that may follow each class at a corner on a shortest path.

    See `contract`. A path goes from one quadrant beside the blocked cell to the other, and does not
    bend away from that cell. Two neighbouring sectors always may follow each other: every excluded
    path is then longer than the shortest one by more than the rounding of costs.

    Returns
    -------
    numpy.ndarray
        int64 (4, 64).
    """
    table = np.zeros((4, 2 * _SECTORS), np.int64)
    for one in range(_SECTORS):
        for two in range(max(one - 1, 0), _SECTORS):
            table[:, one] |= np.int64(1) << _SECTORS + two
            table[:, _SECTORS + two] |= np.int64(1) << one
    return table


@guarded
@njit(cache=True, nogil=True)
def arcs_of(mesh, first, heads):
    """Build the arcs of the graph of corners, as `contract` takes them.

    Parameters
    ----------
    mesh
        See `successors`.
    first, heads
        Results of `edges_of`.

    Returns
    -------
    tuple
        int64 (n + 1,), offsets of the arcs of each corner; int64 (m, 2), these arcs.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    arcs = np.empty((len(heads), 2), np.int64)
    for corner in range(len(kinds)):
        x, y = cx[corner], cy[corner]
        for k in range(first[2 * corner], first[2 * corner + 2]):
            other = np.int64(heads[k])
            dx, dy = cx[other] - x, cy[other] - y
            near, far = class_of(kinds[corner], dx, dy), class_of(kinds[other], -dx, -dy)
            arcs[k, 0] = cost_of(x, y, cx[other], cy[other])
            arcs[k, 1] = pack(other, near, far)
    return first[::2].copy(), arcs
