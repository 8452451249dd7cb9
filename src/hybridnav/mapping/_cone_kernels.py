"""Kernels of cones: the evidence of a sonar's reading."""

from __future__ import annotations

import math

from hybridnav._jit import njit
from hybridnav._trig import atan2, cos, log, sin, tan


@njit(cache=True, nogil=True)
def _profile(share, off_axis):
    """Return the product of the profiles along the range and across the cone."""
    return (1.0 - share * share) * (1.0 - off_axis * off_axis)


@njit(cache=True, nogil=True)
def _box(apex, half_angle, far):
    """Return the first and last row, and column, of cells that a cone may meet."""
    low_row, high_row, low_col, high_col = apex[0], apex[0], apex[1], apex[1]
    for k in range(-2, 3):
        angle = apex[2] + k * half_angle / 2
        row, col = apex[0] + far * sin(angle), apex[1] + far * cos(angle)
        low_row, high_row = min(low_row, row), max(high_row, row)
        low_col, high_col = min(low_col, col), max(high_col, col)
    # Between two of these directions the arc bulges.
    bulge = far * (1.0 - cos(half_angle / 4))
    rows = math.floor(low_row - bulge), math.floor(high_row + bulge)
    return rows, (math.floor(low_col - bulge), math.floor(high_col + bulge))


@njit(cache=True, nogil=True)
def add_cone(evidence, seen_at, corner, apex, reading, shape, changes, scan):
    """Add the reading of one sonar to a grid; see `SonarModel`.

    Parameters
    ----------
    evidence
        float32 (rows, cols), log odds; changed.
    seen_at
        int32 (rows, cols), the number of the last scan that met a cell; changed.
    corner
        Row and column of the first cell of these arrays.
    apex
        `(row, col, heading)` of the sonar, in cells and radians.
    reading
        The range in cells, and whether there was an echo.
    shape
        Half of the opening in radians, tolerance and least range in cells.
    changes
        The greatest and the least probability of a reading, and the limit of log odds.
    scan
        Number of the scan, at least 1.
    """
    reach, is_echo = reading
    half_angle, tolerance, least = shape
    when_hit, when_passed, limit = changes
    axis_row, axis_col = sin(apex[2]), cos(apex[2])
    far = reach + tolerance if is_echo else reach
    near = reach - tolerance if is_echo else reach
    widest = tan(half_angle)
    (first_row, last_row), (first_col, last_col) = _box(apex, half_angle, far)
    for row in range(first_row, last_row + 1):
        for col in range(first_col, last_col + 1):
            rows, cols = row + 0.5 - apex[0], col + 0.5 - apex[1]
            ahead, aside = cols * axis_col + rows * axis_row, rows * axis_col - cols * axis_row
            if abs(aside) > widest * ahead:  # most cells of the box
                continue
            distance = math.hypot(rows, cols)
            if not least <= distance <= far:
                continue
            off_axis = atan2(aside, ahead) / half_angle
            if distance >= near and is_echo:
                share = _profile((distance - reach) / tolerance, off_axis)
                probability = 0.5 + (when_hit - 0.5) * share
            elif distance < near:
                share = _profile((distance - least) / (near - least), off_axis)
                probability = 0.5 - (0.5 - when_passed) * share
            else:
                continue
            i, j = row - corner[0], col - corner[1]
            seen_at[i, j] = scan
            change = log(probability / (1.0 - probability))
            evidence[i, j] = min(max(evidence[i, j] + change, -limit), limit)
