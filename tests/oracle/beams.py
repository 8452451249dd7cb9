"""What a laser scan does to each cell, by the definition: exact tests of every cell in a box."""

import math
from fractions import Fraction

_PARTS = 2**16
"""Positions are counted in parts of a cell, and are odd."""


def position(cells: float) -> int:
    return math.floor(cells * _PARTS) | 1


def passes(start: tuple[int, int], end: tuple[int, int], cell: tuple[int, int]) -> bool:
    """Return whether a segment passes the inside of a cell: clipped to it, some length is left."""
    low, high = Fraction(0), Fraction(1)
    for axis in range(2):
        begin, reach = start[axis], end[axis] - start[axis]
        near, far = cell[axis] * _PARTS, (cell[axis] + 1) * _PARTS
        if reach == 0:
            if not near < begin < far:
                return False
            continue
        first, second = sorted((Fraction(near - begin, reach), Fraction(far - begin, reach)))
        low, high = max(low, first), min(high, second)
    return low < high


def kinds_of_cells(scan, model, resolution_m, corner_m=(0.0, 0.0)):
    """Return the cells that a scan occupies and those that it frees; the model settles a draw."""
    x, y = scan.pose[0] - corner_m[0], scan.pose[1] - corner_m[1]
    start = (position(y / resolution_m), position(x / resolution_m))
    far = min(model.max_range_m, scan.max_range_m)
    hits, passed = set(), set()
    for k, reading in enumerate(scan.ranges_m.tolist()):
        if not reading > model.min_range_m:
            continue
        angle = scan.pose[2] + (scan.start_rad + k * scan.step_rad)

        def at(reach, angle=angle):
            return (
                position((y + reach * math.sin(angle)) / resolution_m),
                position((x + reach * math.cos(angle)) / resolution_m),
            )

        own = None
        if reading < far:
            own = tuple(part // _PARTS for part in at(reading + model.depth_m))
            hits.add(own)
            until = reading - model.tolerance_m
        else:
            until = min(model.clear_range_m, far)
        if until <= 0 or at(until) == start:
            continue
        end = at(until)
        rows, cols = (
            range(min(start[axis], end[axis]) // _PARTS, max(start[axis], end[axis]) // _PARTS + 1)
            for axis in range(2)
        )
        cells = ((row, col) for row in rows for col in cols if (row, col) != own)
        passed |= {cell for cell in cells if passes(start, end, cell)}
    return (hits, passed - hits) if model.hits_win else (hits - passed, passed)
