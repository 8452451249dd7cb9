"""Kernel of the clearance objective: length weighted by the crossed cells."""

from __future__ import annotations

import math

from hybridnav._jit import njit

_STEP = 0.5
"""Greatest distance between samples, in cells."""


@njit(cache=True, nogil=True)
def weighted_length(factors, origin, cosine, sine, resolution_m, x0, y0, x1, y1):
    """Return the length of a line in metres, each step times the factor of the cell at its middle.

    The result is the same in both directions, and never less than the length.

    Parameters
    ----------
    factors
        float32 (rows, cols), >= 1; outside the map the factor is 1.
    origin, cosine, sine, resolution_m
        The frame: its origin (x, y), cosine and sine of its yaw, and metres of a cell's side.
    x0, y0, x1, y1
        Ends of the line in metres, map frame.
    """
    length_m = math.hypot(x1 - x0, y1 - y0)
    n = max(math.ceil(length_m / (_STEP * resolution_m)), 1)
    rows, cols = factors.shape
    total = 0.0
    for i in range(n):
        along = (i + 0.5) / n
        x, y = x0 + along * (x1 - x0) - origin[0], y0 + along * (y1 - y0) - origin[1]
        col = math.floor((cosine * x + sine * y) / resolution_m)
        row = math.floor((cosine * y - sine * x) / resolution_m)
        inside = 0 <= row < rows and 0 <= col < cols
        total += factors[row, col] if inside else 1.0
    return length_m * total / n
