"""Kernels that settle a line where it costs least, at any angle.

A line is moved as a chain that is pulled taut: its points shift to their sides, all at a time, by
Newton's method on the integral of the factors, which are interpolated between the centres of cells
for it. That integral has few local optima, so lines that begin near each other end on one. What a
line costs, and whether it is legal, is decided on the cells themselves. In the end the points at
bends, the only ones left, move one at a time, by the cost itself.

Positions are those of `taut`.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import total
from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.trig import hypot
from hybridnav.maps.costs.integral import legal_cost
from hybridnav.refine.kernels.chain import FINE, costs_of, polish, slopes_of, solve

_SPANS = np.array([2, 3, 4, 8, 16], np.int64)
"""Segments of a line that one may replace."""
_COARSE, _FINE_SPACING = 9.0, 3.0
"""Cells from one point of a chain to the next: a coarse chain settles first, then a fine one."""
_STEPS = 6
"""Most steps of Newton's method in a round."""
_ROUNDS = 4
"""Most rounds of the fine chain: more than one where it is dearer than the line it came from."""
_ALIKE = 1e-3
"""Share by which costs differ that count as equal then."""
_FARTHEST = 1.5
"""Cells by which a point is moved in a step at most; half as many each time it turns back."""
_STILL = 0.02
"""Cells by which a chain that has settled may still move."""
_HALVES, _SOLVED, _TRIES = 2, 5, 16
"""Times that a step is tried because it leads off free cells. In the first ones points there make
half of their way, later none; in the last ones the others are not solved for anew."""
_NEAR = 1.0
"""Cells from a start within which no bend of a line is aimed at."""
_SLACK = 1e-13
"""Rounding of a sum of costs, relative: of equal costs, the longer segment is taken."""
_WORSE = 0.01
"""Share by which a chain that has settled may be dearer than the line that it was: a limit that few
meet, since lines that begin near each other are to end in one place."""
_FLAT = 0.02
"""Cells by which points may lie off a line that leaves them out."""


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
def _spread(free, factors, line, spacing):
    """Return a line with its points evenly spaced along it.

    It has points of its own only where a shortcut past them is not legal, and is the line itself if
    rounding makes that illegal.
    """
    n = line.shape[0]
    whole = 0.0
    for i in range(1, n):
        whole += hypot(line[i, 0] - line[i - 1, 0], line[i, 1] - line[i - 1, 1])
    m = max(int(whole / spacing + 0.5), 1)
    chain = np.empty((m + n, 2))
    chain[0] = line[0]
    size, passed, ahead, first = 1, 0.0, 1, 1
    for k in range(1, m + 1):
        # The segment that holds the next point.
        at = line[n - 1].copy()
        while k < m and ahead < n:
            row, col = line[ahead - 1]
            down, over = line[ahead, 0] - row, line[ahead, 1] - col
            step, left = hypot(down, over), whole * k / m - passed
            if step > left:
                at[0] = np.rint((row + left / step * down) * FINE) / FINE
                at[1] = np.rint((col + left / step * over) * FINE) / FINE
                break
            passed += step
            ahead += 1
        if k == m:
            ahead = n - 1
        if not _is_legal(free, factors, chain[size - 1], at):
            while first < min(ahead, n - 1):
                chain[size] = line[first]
                size, first = size + 1, first + 1
            if k < m and not _is_legal(free, factors, chain[size - 1], at):
                continue  # the point before the next one is that of the line
        first = ahead
        chain[size] = at
        size += 1
    for k in range(1, size):
        if not _is_legal(free, factors, chain[k - 1], chain[k]):
            return line.copy()
    return chain[:size].copy()


@njit(cache=True, nogil=True)
def _move(free, factors, chain, aside, step, moved, is_off):
    """Move the points of a chain aside; return whether it stays legal.

    Parameters
    ----------
    free, factors, chain
        See `_settled`.
    aside
        See `slopes_of`.
    step
        float64 (n,), how far, in cells.
    moved
        float64 (n, 2), changed: the points after it.
    is_off
        bool (n,), changed: which points have a segment that is not legal.
    """
    rows, cols = free.shape
    n = chain.shape[0]
    for i in range(1, n - 1):
        row = chain[i, 0] + step[i] * aside[i, 0]
        col = chain[i, 1] + step[i] * aside[i, 1]
        if step[i] != 0:
            row, col = np.rint(row * FINE) / FINE, np.rint(col * FINE) / FINE
        moved[i, 0], moved[i, 1] = min(max(row, 0.0), rows + 0.0), min(max(col, 0.0), cols + 0.0)
    is_legal, is_off[:] = True, False
    for i in range(1, n):
        if not _is_legal(free, factors, moved[i - 1], moved[i]):
            is_off[i - 1] = is_off[i] = True
            is_legal = False
    return is_legal


@njit(cache=True, nogil=True)
def _face_aside(chain, aside):
    """Set the directions in which the points of a chain move: across the line past each."""
    for i in range(1, chain.shape[0] - 1):
        down, over = chain[i + 1, 0] - chain[i - 1, 0], chain[i + 1, 1] - chain[i - 1, 1]
        length = hypot(down, over)
        aside[i, 0] = -over / length if length > 0 else 0.0
        aside[i, 1] = down / length if length > 0 else 0.0


@njit(cache=True, nogil=True)
def _settled(free, factors, chain, stride, steps):
    """Return a chain whose inner points have moved to their sides until it costs least there.

    `free`, `factors`: see `settle`; `chain`: float64 (n, 2), positions; `stride`: see `slopes_of`.
    """
    n = chain.shape[0]
    chain, moved, best, least = chain.copy(), chain.copy(), chain.copy(), np.inf
    is_off, held, step = np.zeros(n, np.bool_), np.empty(n), np.zeros(n)
    # Directions and slopes at the best chain, and at the last one.
    aside, slope, bend, link = np.zeros((n, 2)), np.zeros(n), np.zeros(n), np.zeros(n)
    next_aside, next_slope = np.zeros((n, 2)), np.zeros(n)
    next_bend, next_link = np.zeros(n), np.zeros(n)
    farthest, last = np.full(n, _FARTHEST), np.zeros(n)
    for _ in range(steps):
        _face_aside(chain, next_aside)
        cost = slopes_of(factors, chain, stride, next_aside, next_slope, next_bend, next_link)
        if cost > least:  # too far: half as far, from where it was
            farthest[:] = farthest * 0.5
        else:
            best, chain, least = chain, best, cost
            aside, next_aside, slope, next_slope = next_aside, aside, next_slope, slope
            bend, next_bend, link, next_link = next_bend, bend, next_link, link
        # Points whose segments would leave the free cells are held, and the others solved for anew.
        held[:], is_legal = np.nan, False
        for k in range(_TRIES):
            if k < _SOLVED:
                solve(slope, bend, link, held, farthest, step)
            is_legal = _move(free, factors, best, aside, step, moved, is_off)
            if is_legal:
                break
            for i in range(1, n - 1):
                if is_off[i]:
                    held[i] = 0.5 * step[i] if k < _HALVES else 0.0
                    step[i] = held[i]
        if not is_legal:
            return best
        for i in range(1, n - 1):
            if step[i] * last[i] < 0:
                farthest[i] *= 0.5
            last[i] = step[i]
        chain[:] = moved
        if total(np.abs(step) < _STILL) == step.size:
            break
    cost = slopes_of(factors, chain, stride, next_aside, next_slope, next_bend, next_link)
    return best if cost > least else chain


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


@njit(cache=True, nogil=True)
def _finely_settled(free, factors, line, least):
    """Return a line after a fine chain along it has settled: in more than one round where that is
    dearer than another line, which costs `least`."""
    now = np.inf
    for _ in range(_ROUNDS):
        before = now
        line = _settled(free, factors, _spread(free, factors, line, _FINE_SPACING), 1.0, _STEPS)
        now = cost_of(factors, line)
        if now < least * (1 + _ALIKE) or now > before * (1 - _ALIKE):
            break
    return _thinned(free, factors, line)


@guarded
@njit(cache=True, nogil=True)
def settle(free, factors, path):
    """Return a line between the ends of a path that costs least of those near it, its cost, and
    that of the path.

    The line is never dearer than the path, and its segments are legal if those of the path are.

    `free`: uint8 (rows, cols), 1 where a cell may be entered; `factors`: float32 (rows, cols), >=
    1; `path`: float64 (n, 2), n >= 1, positions, no two in a row equal.
    """
    whole = cost_of(factors, path)
    if path.shape[0] < 3:
        return path.copy(), whole, whole
    line = _cut_short(free, factors, path)
    best, least = line, cost_of(factors, line)
    # A coarse chain leads far in few steps, but cuts through narrow bends.
    chain = _settled(free, factors, _spread(free, factors, line, _COARSE), 2.0, _STEPS)
    is_coarse = cost_of(factors, chain) < least * (1 + _WORSE)
    line = _finely_settled(free, factors, chain if is_coarse else line, least)
    now = cost_of(factors, line)
    if is_coarse and now > least:
        other = _finely_settled(free, factors, best, least)
        if cost_of(factors, other) < now:
            line, now = other, cost_of(factors, other)
    # Costs that jump from cell to cell are not always those between the centres of cells.
    if now <= least * (1 + _WORSE):
        best, least = line, now
    best = polish(free, factors, best)
    least = cost_of(factors, best)
    if least > whole:
        return path.copy(), whole, whole
    return best, least, whole


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
