"""Kernels that convert as `Frame` does."""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import guarded, njit


@njit(cache=True, nogil=True)
def centres(cells, frame):
    """Return the centres of cells in the map frame, float64 (n, 2), those of `Frame.points_of`.

    `cells` are (row, col), int64 (n, 2), and `frame` is `Frame.for_kernels`.
    """
    resolution, origin_x, origin_y, cosine, sine = frame
    points = np.empty((cells.shape[0], 2), np.float64)
    for i in range(cells.shape[0]):
        x, y = (cells[i, 1] + 0.5) * resolution, (cells[i, 0] + 0.5) * resolution
        points[i, 0] = origin_x + cosine * x - sine * y
        points[i, 1] = origin_y + sine * x + cosine * y
    return points


@guarded
@njit(cache=True, nogil=True)
def position_of(x, y, frame):
    """Return a point as (row, col) in grid units, that of `Frame.position_of` for near points.

    `x` and `y` are in metres, map frame, and `frame` is `Frame.for_kernels`.
    """
    resolution, origin_x, origin_y, cosine, sine = frame
    along, across = x - origin_x, y - origin_y
    row = (cosine * across - sine * along) / resolution
    return row, (cosine * along + sine * across) / resolution
