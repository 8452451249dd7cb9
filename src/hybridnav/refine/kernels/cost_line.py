"""Kernels that shorten a path of cells to a line of positions without raising its cost.

Positions are those of `taut`. A line has `costs`, float64 (n,), that of the segment, or of
the part of a path, before each of its points; and `at`, int64 (n,), where on the path of cells each
point lies.
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import compare_products
from hybridnav.maps.costs.integral import segment_cost
from hybridnav.refine.kernels.segments import is_legal

_GRAIN = 2.0**24
_STRIDE = 6
"""Cells from one point of the first line to the next."""
_FIRST_SPANS = np.array([1, 2, 4], np.int64)
"""Segments of the first line that one may replace."""
_SPANS = np.array([2, 3, 4], np.int64)
_FAR = 8
"""Cells by which a point is moved along the path at most at a time."""
_ROUNDS = 5
_SLACK = 1e-13
"""Rounding of a sum of costs, relative: of equal costs, the longer segment is taken."""


@njit(cache=True, nogil=True)
def line_of_cells(cells, endpoints, corner_cutting):
    """Return the positions of a path of cells between two points, no two in a row equal.

    Parameters
    ----------
    cells
        int64 (n, 2), legal moves.
    endpoints
        float64 (2, 2), start and goal as (row, col), in the first and the last cell but for
        rounding.
    corner_cutting
        Whether the line passes the centres of the first and the last cell too.
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
                position = np.rint(endpoints[end, k] * _GRAIN) / _GRAIN
                line[size, k] = min(max(position, cell + 0.0), cell + 1.0)
            else:
                line[size, k] = cells[i, k] + 0.5
        same = size > 0 and line[size, 0] == line[size - 1, 0]
        size += not (same and line[size, 1] == line[size - 1, 1])
    return line[:size].copy()


@njit(cache=True, nogil=True)
def _costs_of_moves(factors, path):
    """Return the cost of the path of cells up to each of its points."""
    n = path.shape[0]
    total = np.zeros(n)
    for i in range(1, n):
        row, col, to_row, to_col = path[i - 1, 0], path[i - 1, 1], path[i, 0], path[i, 1]
        if i == 1 or i == n - 1:
            cost = segment_cost(factors, row, col, to_row, to_col)
        else:  # between centres of neighbours
            cost = 0.5 * factors[math.floor(row), math.floor(col)]
            cost += 0.5 * factors[math.floor(to_row), math.floor(to_col)]
            if row != to_row and col != to_col:
                cost *= math.sqrt(2.0)
        total[i] = total[i - 1] + cost
    return total


@njit(cache=True, nogil=True)
def _cheapest(free, factors, line, costs, spans):
    """Find the cheapest lines that leave out points of a line, by dynamic programming.

    Return the cost up to each point, and the point before it; -1 if the part of the path before it
    stays.
    """
    n = line.shape[0]
    total, before = np.zeros(n), np.full(n, -1, np.int64)
    for j in range(1, n):
        row, col = line[j, 0], line[j, 1]
        least = total[j - 1] + costs[j]
        for span in spans:
            i = j - span
            if i < 0:
                break
            from_row, from_col = line[i, 0], line[i, 1]
            most = (least - total[i]) * (1 + _SLACK)
            # No factor is below 1.
            away = math.hypot(row - from_row, col - from_col)
            if away == 0 or away > most:
                continue
            whole = legal_cost(free, factors, from_row, from_col, row, col, most)
            if whole <= most:
                least, before[j] = min(total[i] + whole, least), i
        total[j] = least
    return total, before


@njit(cache=True, nogil=True)
def _first_line(free, factors, path):
    """Return which points of a path of cells a first line keeps, its costs, and that of the path.

    Every sixth point may be a bend; a part that no straight segment makes cheaper stays.
    """
    n = path.shape[0]
    moves = _costs_of_moves(factors, path)
    m = (n + _STRIDE - 2) // _STRIDE + 1
    at = np.minimum(np.arange(m) * _STRIDE, n - 1)
    costs = np.zeros(m)
    for k in range(1, m):
        costs[k] = moves[at[k]] - moves[at[k - 1]]
    total, before = _cheapest(free, factors, path[at], costs, _FIRST_SPANS)
    kept, parts = np.empty(n, np.int64), np.zeros(n)
    first, j = n - 1, m - 1
    kept[first] = n - 1
    while j > 0:
        i = before[j]
        if i >= 0:
            parts[first] = total[j] - total[i]
            first, j = first - 1, i
            kept[first] = at[i]
            continue
        for k in range(at[j] - 1, at[j - 1] - 1, -1):
            parts[first] = moves[k + 1] - moves[k]
            first -= 1
            kept[first] = k
        j -= 1
    return kept[first:].copy(), parts[first:].copy(), moves[n - 1]


@njit(cache=True, nogil=True)
def _moved(free, factors, path, at, costs):
    """Move the inner points of a line along the path of cells, where that is cheaper, in place.

    Steps are 8 cells, then 4, 2 and 1, ahead and back. Return whether anything was moved.
    """
    found = False
    for i in range(1, at.shape[0] - 1):
        a, c = path[at[i - 1]], path[at[i + 1]]
        for ahead in (-1, 1):
            step = _FAR
            while step > 0:
                k = at[i] + ahead * step
                if at[i - 1] < k < at[i + 1]:
                    row, col = path[k]
                    now = (costs[i] + costs[i + 1]) * (1 - 10 * _SLACK)
                    first = math.hypot(row - a[0], col - a[1])
                    second = math.hypot(c[0] - row, c[1] - col)
                    if first > 0 and second > 0 and first + second < now:
                        first = legal_cost(free, factors, a[0], a[1], row, col, now - second)
                        if first + second < now:
                            second = legal_cost(free, factors, row, col, c[0], c[1], now - first)
                            if first + second < now:
                                at[i], costs[i], costs[i + 1] = k, first, second
                                found = True
                                continue
                step //= 2
    return found


@guarded
@njit(cache=True, nogil=True)
def shorten(free, factors, path):
    """Return a line through some of the points of a path of cells, no dearer, its cost, and that of
    the path.

    Its segments are legal, or are segments of the path.

    Parameters
    ----------
    free
        uint8 (rows, cols), 1 where a cell may be entered.
    factors
        float32 (rows, cols), >= 1.
    path
        float64 (n, 2), n >= 1, see `line_of_cells`.
    """
    at, costs, whole = _first_line(free, factors, path)
    for _ in range(_ROUNDS):
        moved = _moved(free, factors, path, at, costs)
        total, before = _cheapest(free, factors, path[at], costs, _SPANS)
        n = at.shape[0]
        first, j = n - 1, n - 1
        while j > 0:
            i = before[j] if before[j] >= 0 else j - 1
            costs[first] = total[j] - total[i]
            first, j = first - 1, i
            at[first] = at[i]
        at, costs = at[first:].copy(), costs[first:].copy()
        costs[0] = 0.0
        if first == 0 and not moved:
            break
    return path[at], costs.sum(), whole


# The cost of a segment and the test whether it is legal, in one walk over its cells.
#
# Positions are those of `taut`.

_FREE = 1
_LEGAL_SLACK = 1e-12
"""Rounding of a sum of costs, relative."""


@njit(cache=True, nogil=True)
def legal_cost(free, factors, a_row, a_col, b_row, b_col, most):
    """Return the integral of the factors along a segment, in cells, if it is legal; else infinity.

    The walk is that of `segment_cost` and `is_legal`. It ends, and returns infinity, where the
    rest makes the segment dearer than `most`, because no factor is below 1.

    Parameters
    ----------
    free
        uint8 (rows, cols), 1 where a cell may be entered.
    factors
        float32 (rows, cols), >= 1.
    a_row, a_col, b_row, b_col
        The endpoints, inside the map; if they are equal, the cost is 0.
    most
        The largest cost that is of use; a little more may be returned.
    """
    if a_row == b_row or a_col == b_col:
        if a_row == b_row and a_col == b_col:
            return 0.0
        if not is_legal(free, a_row, a_col, b_row, b_col, _FREE, _FREE):
            return np.inf
        return segment_cost(factors, a_row, a_col, b_row, b_col)

    # The walk runs towards higher columns, so that only rows have two directions.
    if b_col < a_col:
        a_row, a_col, b_row, b_col = b_row, b_col, a_row, a_col
    up = b_row > a_row
    turn = 1 if up else -1
    row, col = math.floor(a_row) if up else math.ceil(a_row) - 1, math.floor(a_col)
    last_row, last_col = math.ceil(b_row) - 1 if up else math.floor(b_row), math.ceil(b_col) - 1
    rows, cols = abs(b_row - a_row), b_col - a_col
    per_row, per_col = 1.0 / rows, 1.0 / cols
    # How far the next line between rows, and between columns, is from the first endpoint.
    to_row, to_col = row + 1.0 - a_row if up else a_row - row, col + 1.0 - a_col
    length = math.sqrt(rows * rows + cols * cols)
    limit = most / length * (1 + _LEGAL_SLACK)

    # `share` of the segment is behind, at a cost of `total` if the whole had length 1.
    share, total = 0.0, 0.0
    while free[row, col] >= _FREE:
        if row == last_row and col == last_col:
            return (total + factors[row, col] * (1.0 - share)) * length
        left, right = to_row * cols, to_col * rows
        # Rounding preserves order: only equal products need their errors.
        hand = compare_products(to_row, cols, to_col, rows) if left == right else 0
        if left < right or hand < 0:
            until = to_row * per_row
            total += factors[row, col] * (until - share)
            row += turn
            to_row += 1.0
        else:
            until = to_col * per_col
            total += factors[row, col] * (until - share)
            if left == right and hand == 0:  # through a corner
                if free[row, col + 1] < _FREE and free[row + turn, col] < _FREE:
                    break
                row += turn
                to_row += 1.0
            col += 1
            to_col += 1.0
        share = until
        if total + (1.0 - share) > limit:
            break
    return np.inf
