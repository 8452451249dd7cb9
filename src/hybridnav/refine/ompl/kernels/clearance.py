"""Kernel of the clearance objective: length weighted by the crossed cells."""

import math

from hybridnav._base.jit import njit
from hybridnav.maps.geometry import position_of

_STEP = 0.5
"""Greatest distance between samples, in cells."""


@njit(cache=True, nogil=True)
def weighted_length(factors, frame, x0, y0, x1, y1):
    """Return the length of a line in metres, each step times the factor of the cell at its middle.

    The result is the same in both directions, and never less than the length: `factors`, float32
    (rows, cols), are at least 1. Outside the map the factor is 1. `frame` is `Frame.for_kernels`;
    the line goes from `x0`, `y0` to `x1`, `y1`, in metres, map frame.
    """
    length_m = math.hypot(x1 - x0, y1 - y0)
    n = max(math.ceil(length_m / (_STEP * frame[0])), 1)
    rows, cols = factors.shape
    total = 0.0
    for i in range(n):
        along = (i + 0.5) / n
        at = position_of(x0 + along * (x1 - x0), y0 + along * (y1 - y0), frame)
        row, col = math.floor(at[0]), math.floor(at[1])
        inside = 0 <= row < rows and 0 <= col < cols
        total += factors[row, col] if inside else 1.0
    return length_m * total / n
