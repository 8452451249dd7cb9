"""Kernel of the bound on any-angle paths between two points."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit


@njit(cache=True, nogil=True)
def least_over_boxes(box, portal, between, sides, start, goal):
    """Return the least length of a path from a point to another over portals.

    `sides` are the first side of the start's field and its end, and those of the goal's field.
    """
    first, first_end, last, last_end = sides
    far = np.empty(last_end - last, np.float64)
    for j in range(last, last_end):
        far[j - last] = _gap(box, j, goal)
    least = np.inf
    for i in range(first, first_end):
        near = _gap(box, i, start)
        for j in range(last, last_end):
            least = min(least, near + between[portal[i], portal[j]] + far[j - last])
    return least


@njit(cache=True, nogil=True)
def _gap(box, side, point):
    """Return the distance from a point to a side's box."""
    down = max(box[side, 0] - point[0], point[0] - box[side, 1], 0.0)
    right = max(box[side, 2] - point[1], point[1] - box[side, 3], 0.0)
    return np.hypot(down, right)
