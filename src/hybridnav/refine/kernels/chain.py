"""Kernels that move the points of a chain: all to their sides, by Newton's method, or one by one.

Positions are those of `taut`.
"""

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.arrays import total
from hybridnav._base.trig import hypot
from hybridnav.maps.costs.integral import legal_cost, segment_cost

FINE = 2.0**12
"""Points of a chain are rounded to this part of a cell."""
_BESIDE = 0.4
"""Cells to both sides at which the slope of the factors is measured."""
_DAMPING = 1e-3
_SWEEPS = 16
"""Most times that each point of a line that has settled is tried elsewhere."""
_FIRST_REACH, _LAST_REACH = 1.0, 0.1
"""How far away, in cells, at first and at last."""
# The directions in which points are tried: four, and in every other sweep those between them.
_AROUND = np.array(
    [[-1, 0], [1, 0], [0, -1], [0, 1], [-0.7, -0.7], [-0.7, 0.7], [0.7, -0.7], [0.7, 0.7]]
)
_GAIN = 1e-5
"""Share of the cost of its two segments that it must save."""


@njit(cache=True, nogil=True)
def _factor_at(factors, row, col):
    """Return the factor at a position, interpolated between the centres of four cells; beyond the
    outer ones it stays."""
    row, col = max(row - 0.5, 0.0), max(col - 0.5, 0.0)
    low, left = int(row), int(col)
    up, over = np.float32(row - low), np.float32(col - left)
    if low + 1 < factors.shape[0] and left + 1 < factors.shape[1]:
        first = factors[low, left] + over * (factors[low, left + 1] - factors[low, left])
        low += 1
        second = factors[low, left] + over * (factors[low, left + 1] - factors[low, left])
        return first + up * (second - first)
    low, left = min(low, factors.shape[0] - 1), min(left, factors.shape[1] - 1)
    high, right = min(low + 1, factors.shape[0] - 1), min(left + 1, factors.shape[1] - 1)
    first = factors[low, left] + over * (factors[low, right] - factors[low, left])
    second = factors[high, left] + over * (factors[high, right] - factors[high, left])
    return first + up * (second - first)


@njit(cache=True, nogil=True)
def slopes_of(factors, chain, stride, aside, slope, bend, link):
    """Measure how the cost of a chain changes as its points move aside: the slope, and the
    curvature, which is a matrix with three diagonals. Return the cost.

    Parameters
    ----------
    factors
        See `settle`.
    chain
        float64 (n, 2), positions.
    stride
        Cells from one place at which it is measured to the next.
    aside
        float64 (n, 2), unit vectors, the directions in which points move.
    slope, bend, link
        float64 (n,), changed: the slope by each point, the diagonal of the curvature, and what
        stands beside it, for each point and the next.
    """
    slope[:], bend[:], link[:] = 0.0, 0.0, 0.0
    cost = 0.0
    for i in range(chain.shape[0] - 1):
        down, over = chain[i + 1, 0] - chain[i, 0], chain[i + 1, 1] - chain[i, 1]
        length = hypot(down, over)
        if length < 1e-9:
            continue
        ahead_row, ahead_col = down / length, over / length
        side_row, side_col = -ahead_col, ahead_row
        # Along the segment: the factor, its slope to the side and its curvature. What curves
        # downwards is left out, so that a step leads to a minimum.
        n = max(int(length / stride + 0.999), 1)
        mean, first, second = 0.0, 0.0, 0.0
        first_bend, second_bend, both = 0.0, 0.0, 0.0
        for k in range(n):
            share = (k + 0.5) / n
            row, col = chain[i, 0] + share * down, chain[i, 1] + share * over
            here = _factor_at(factors, row, col)
            right = _factor_at(factors, row + _BESIDE * side_row, col + _BESIDE * side_col)
            left = _factor_at(factors, row - _BESIDE * side_row, col - _BESIDE * side_col)
            rise = (right - left) / (2 * _BESIDE)
            curve = max((right - 2 * here + left) / (_BESIDE * _BESIDE), 0.0)
            mean += here
            first += (1 - share) * rise
            second += share * rise
            first_bend += (1 - share) * (1 - share) * curve
            second_bend += share * share * curve
            both += share * (1 - share) * curve
        mean, weight = mean / n, length / n
        cost += mean * length
        # The segment pulls at both of its points with the factor along it, like a string.
        a_side = aside[i, 0] * side_row + aside[i, 1] * side_col
        b_side = aside[i + 1, 0] * side_row + aside[i + 1, 1] * side_col
        a_ahead = aside[i, 0] * ahead_row + aside[i, 1] * ahead_col
        b_ahead = aside[i + 1, 0] * ahead_row + aside[i + 1, 1] * ahead_col
        tension = mean / length
        slope[i] += weight * first * a_side - mean * a_ahead
        slope[i + 1] += weight * second * b_side + mean * b_ahead
        bend[i] += (tension + weight * first_bend) * a_side * a_side
        bend[i + 1] += (tension + weight * second_bend) * b_side * b_side
        link[i] = (weight * both - tension) * a_side * b_side
    return cost


@njit(cache=True, nogil=True)
def solve(slope, bend, link, held, farthest, step):
    """Solve for the step of the inner points that makes the slope 0, by elimination.

    `slope`, `bend`, `link`: see `slopes_of`; `held`: float64 (n,), the steps of points that are
    held, NaN for others; `farthest`: float64 (n,), the farthest that points may go; `step`: float64
    (n,), changed; the first and the last stay 0.
    """
    n = slope.shape[0]
    above = np.zeros(n)
    for i in range(1, n - 1):
        if not np.isnan(held[i]):
            above[i], step[i] = 0.0, held[i]
            continue
        below = link[i - 1] if i > 1 else 0.0
        pivot = bend[i] + _DAMPING - below * above[i - 1]
        above[i] = link[i] / pivot if i < n - 2 else 0.0
        step[i] = (-slope[i] - below * step[i - 1] * (i > 1)) / pivot
    for i in range(n - 3, 0, -1):
        step[i] -= above[i] * step[i + 1]
    for i in range(1, n - 1):
        step[i] = min(max(step[i], -farthest[i]), farthest[i])


@njit(cache=True, nogil=True)
def costs_of(factors, line):
    """Return the cost of each segment of a line, float64 (n,), the first being 0."""
    costs = np.zeros(line.shape[0])
    for i in range(1, line.shape[0]):
        costs[i] = segment_cost(factors, line[i - 1, 0], line[i - 1, 1], line[i, 0], line[i, 1])
    return costs


@njit(cache=True, nogil=True)
def polish(free, factors, line):
    """Move the points of a line, one at a time, to where it costs less, by compass search: what a
    chain that was held by an obstacle leaves undone. Return the line, no two points in a row equal.

    `free`, `factors`: see `settle`; `line`: float64 (n, 2), changed.
    """
    n, rows, cols = line.shape[0], free.shape[0] + 0.0, free.shape[1] + 0.0
    # How far away each point is tried, what the segment before it costs, and whether it is done.
    reach = np.full(n, _FIRST_REACH)
    costs = costs_of(factors, line)
    is_still = np.zeros(n, np.bool_)
    # Sweeps over the points that may still move.
    for sweep in range(_SWEEPS):
        first_way = 4 * (sweep % 2)
        for i in range(1, n - 1):
            if is_still[i]:
                continue
            # The cheapest of the places around it that its segments may lead to.
            row, col = line[i]
            whole = costs[i] + costs[i + 1]
            least, first_least = whole * (1 - _GAIN), 0.0
            to_row, to_col = row, col
            for k in range(first_way, first_way + 4):
                new_row = np.rint((row + reach[i] * _AROUND[k, 0]) * FINE) / FINE
                new_col = np.rint((col + reach[i] * _AROUND[k, 1]) * FINE) / FINE
                if not (0 <= new_row <= rows and 0 <= new_col <= cols):
                    continue
                first = legal_cost(
                    free, factors, line[i - 1, 0], line[i - 1, 1], new_row, new_col, least
                )
                if first >= least:
                    continue
                now = first + legal_cost(
                    free, factors, new_row, new_col, line[i + 1, 0], line[i + 1, 1], least - first
                )
                if now < least:
                    least, first_least, to_row, to_col = now, first, new_row, new_col
            # It moves there, and its neighbours may move again; else it looks nearer by.
            if to_row != row or to_col != col:
                line[i, 0], line[i, 1] = to_row, to_col
                costs[i], costs[i + 1] = first_least, least - first_least
                is_still[i - 1] = is_still[i + 1] = False
            else:
                reach[i] *= 0.5
                is_still[i] = reach[i] < _LAST_REACH
        if total(is_still[1 : n - 1]) == n - 2:
            break
    # Points that have met are one.
    size = 1
    for i in range(1, n):
        if line[i, 0] != line[size - 1, 0] or line[i, 1] != line[size - 1, 1]:
            line[size] = line[i]
            size += 1
    return line[:size].copy()
