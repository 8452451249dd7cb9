"""Kernels that settle a line where it costs least, at any angle.

A line is cut short, and then moved as a chain whose points shift aside, all at a time, by dynamic
programming on the cost itself: far at first, less and less then. Points lie close only where a
chain passes costs: elsewhere it is straight. In the end the points by walls, where no step aside
may be legal, move one at a time.

Positions are those of `taut`.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import total
from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.trig import hypot
from hybridnav.maps.costs.integral import legal_cost
from hybridnav.refine.kernels.chain import FINE, costs_of, polish, settle_chain

_SPANS = np.array([2, 3, 4, 8, 16], np.int64)
"""Segments of a line that one may replace."""
_CHAINS = np.array([[6.0, 1.5, 2.0, 4.0], [3.0, 0.6, 2.0, 3.0]])
"""The coarse chain and the fine one: cells from point to point, cells by which points move at
first, levels on which they do, and most passes on each."""
_NO_COST = 1e-6
"""Share by which a segment that passes no costs may be dearer than long, by rounding."""
_NEAR = 1.0
"""Cells from a start within which no bend of a line is aimed at."""
_SLACK = 1e-13
"""Rounding of a sum of costs, relative: of equal costs, the longer segment is taken."""
_FLAT = 0.02
"""Cells by which points may lie off a line that leaves them out."""
_SAVED = 0.002
"""Share of its cost that a line must have saved by its points at walls for these to go on."""


@njit(cache=True, nogil=True)
def line_of_cells(cells, endpoints, corner_cutting):
    """Return the positions of a path of cells between two points, no two in a row equal.

    `cells`: int64 (n, 2), legal moves; `endpoints`: float64 (2, 2), start and goal as (row, col),
    in the first and the last cell but for rounding; `corner_cutting`: whether the line passes the
    centres of the first and the last cell too.
    """
    n = cells.shape[0]
    first, last = (0, n) if corner_cutting else (1, max(n - 1, 1))
    line = np.empty((n + 2, 2))
    size = 0
    for i in range(first - 1, last + 1):
        for k in range(2):
            if i == first - 1 or i == last:
                end = 0 if i == first - 1 else 1
                cell = cells[0 if end == 0 else n - 1, k]
                position = np.rint(endpoints[end, k] * GRAIN) / GRAIN
                line[size, k] = min(max(position, cell + 0.0), cell + 1.0)
            else:
                line[size, k] = cells[i, k] + 0.5
        same = size > 0 and line[size, 0] == line[size - 1, 0]
        size += not (same and line[size, 1] == line[size - 1, 1])
    return line[:size].copy()


@njit(cache=True, nogil=True)
def cost_of(factors, line):
    """Return the cost of a line, in cells."""
    return total(costs_of(factors, line))


@njit(cache=True, nogil=True)
def _cut_short(free, factors, line):
    """Return the cheapest line that leaves out points of a line, by dynamic programming."""
    n = line.shape[0]
    costs = costs_of(factors, line)
    total, before = np.zeros(n), np.arange(-1, n - 1)
    for j in range(1, n):
        row, col = line[j, 0], line[j, 1]
        least = total[j - 1] + costs[j]
        for span in _SPANS:
            i = j - span
            if i < 0:
                break
            most = (least - total[i]) * (1 + _SLACK)
            # No factor is below 1.
            away = hypot(row - line[i, 0], col - line[i, 1])
            if away == 0 or away > most:
                continue
            whole = legal_cost(free, factors, line[i, 0], line[i, 1], row, col, most)
            if whole <= most:
                least, before[j] = min(total[i] + whole, least), i
        total[j] = least
    kept, first, j = np.empty((n, 2)), n, n - 1
    while j >= 0:
        first -= 1
        kept[first] = line[j]
        j = before[j]
    return kept[first:].copy()


@njit(cache=True, nogil=True)
def _is_legal(free, factors, a, c):
    """Return whether the segment between two positions is legal, or none."""
    return legal_cost(free, factors, a[0], a[1], c[0], c[1], np.inf) < np.inf


@njit(cache=True, nogil=True)
def _divided(free, factors, line, spacing):
    """Return a line with points some cells apart where it passes costs, and what its segments cost.

    A segment is left whole where rounding makes a part of it illegal.
    """
    n, whole = line.shape[0], costs_of(factors, line)
    parts, size = np.ones(n, np.int64), 1
    for i in range(1, n):
        length = hypot(line[i, 0] - line[i - 1, 0], line[i, 1] - line[i - 1, 1])
        if whole[i] > length * (1 + _NO_COST):
            parts[i] = max(int(length / spacing + 0.5), 1)
        size += parts[i]
    chain, costs = np.empty((size, 2)), np.zeros(size)
    chain[0], size = line[0], 1
    for i in range(1, n):
        row, col = line[i - 1]
        first, m = size, parts[i]
        for k in range(1, m + 1):
            chain[size] = line[i]
            if k < m:
                share = k / m
                chain[size, 0] = np.rint((row + share * (line[i, 0] - row)) * FINE) / FINE
                chain[size, 1] = np.rint((col + share * (line[i, 1] - col)) * FINE) / FINE
            costs[size] = whole[i]
            if m > 1:
                last_row, last_col = chain[size - 1]
                at_row, at_col = chain[size]
                costs[size] = legal_cost(free, factors, last_row, last_col, at_row, at_col, np.inf)
                if costs[size] == np.inf:
                    size = first
                    chain[size], costs[size] = line[i], whole[i]
                    size += 1
                    break
            size += 1
    return chain[:size].copy(), costs[:size].copy()


@njit(cache=True, nogil=True)
def _thinned(free, factors, chain):
    """Return a chain without the points that lie on the line between others."""
    n = chain.shape[0]
    kept = np.empty((n, 2))
    kept[0], size, i = chain[0], 1, 0
    while i < n - 1:
        j = i + 1
        while j < n - 1:
            down, over = chain[j + 1, 0] - chain[i, 0], chain[j + 1, 1] - chain[i, 1]
            length = hypot(down, over)
            is_flat = length > 0
            for k in range(i + 1, j + 1):
                off = down * (chain[k, 1] - chain[i, 1]) - over * (chain[k, 0] - chain[i, 0])
                is_flat = is_flat and abs(off) <= _FLAT * length
            if not (is_flat and _is_legal(free, factors, chain[i], chain[j + 1])):
                break
            j += 1
        if chain[j, 0] != chain[i, 0] or chain[j, 1] != chain[i, 1]:
            kept[size] = chain[j]
            size += 1
        i = j
    return kept[:size].copy()


@guarded
@njit(cache=True, nogil=True)
def settle(free, factors, path):
    """Return a line between the ends of a path that costs least of those near it.

    The line is never dearer than the path, and its segments are legal if those of the path are.

    `free`: uint8 (rows, cols), 1 where a cell may be entered; `factors`: float32 (rows, cols), >=
    1; `path`: float64 (n, 2), n >= 1, positions, no two in a row equal.
    """
    if path.shape[0] < 3:
        return path.copy()
    line = _cut_short(free, factors, path)
    for spacing, reach, levels, passes in _CHAINS:
        chain, costs = _divided(free, factors, line, spacing)
        settle_chain(free, factors, chain, costs, reach, int(levels), int(passes))
        # A straight line that costs less than points nearly on it.
        line = _cut_short(free, factors, _thinned(free, factors, chain))
    costs, before = costs_of(factors, line), np.inf
    while total(costs) < before * (1 - _SAVED):
        before = total(costs)
        polish(free, factors, line, costs)
        # Points that are left out may cost more again.
        line = _thinned(free, factors, line)
        costs = costs_of(factors, line)
    return line if total(costs) <= cost_of(factors, path) else path.copy()


@guarded
@njit(cache=True, nogil=True)
def rest_of(free, factors, line, start, most):
    """Return the rest of a line from a position beside it; without rows where it has a segment that
    is not legal, or costs more than some cost.

    `free`: uint8 (rows, cols), 1 where a cell may be entered; `factors`: float32 (rows, cols), >=
    1; `line`: float64 (n, 2), n >= 2, positions on the map; `start`: float64 (2,), the position;
    `most`: the cost, in cells.
    """
    row, col = start
    nearest, ahead = np.inf, 1
    for k in range(1, line.shape[0]):
        down, across = line[k, 0] - line[k - 1, 0], line[k, 1] - line[k - 1, 1]
        to_row, to_col = row - line[k - 1, 0], col - line[k - 1, 1]
        squared = down * down + across * across
        share = 0.0 if squared == 0.0 else (to_row * down + to_col * across) / squared
        share = min(max(share, 0.0), 1.0)
        apart = hypot(to_row - share * down, to_col - share * across)
        if apart < nearest:
            nearest, ahead = apart, k
    # Not to a bend close by, which would turn the robot; and past one that is out of sight.
    first, last, total = ahead, line.shape[0] - 1, np.inf
    while first < last and hypot(line[first, 0] - row, line[first, 1] - col) < _NEAR:
        first += 1
    total = legal_cost(free, factors, row, col, line[first, 0], line[first, 1], most)
    while first < last and total == np.inf:
        first += 1
        total = legal_cost(free, factors, row, col, line[first, 0], line[first, 1], most)
    for k in range(first + 1, last + 1):
        total += legal_cost(
            free, factors, line[k - 1, 0], line[k - 1, 1], line[k, 0], line[k, 1], most
        )
    if total > most:
        return np.empty((0, 2))
    rest = np.empty((last - first + 2, 2))
    rest[0] = start
    rest[1:] = line[first:]
    return rest
