"""Kernels that move the points of a chain: all aside at a time, by dynamic programming, or one by
one.

Positions are those of `taut`.
"""

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.trig import hypot
from hybridnav.maps.costs.integral import legal_cost, segment_cost

FINE = 2.0**12
"""Points of a chain are rounded to this part of a cell."""
_SLANT = np.sqrt(0.5)
"""Cosine and sine of the angle, an eighth of a turn, by which points move off the direction across
their chain, by turns to one side and the other: so two passes try all directions."""
_IDLE = 2
"""Passes in which a point has to stay until it is left in peace."""
_SAVED = 1e-7
"""Cells that a move must save."""
_SWEEPS = 48
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
def costs_of(factors, line):
    """Return the cost of each segment of a line, float64 (n,), the first being 0."""
    costs = np.zeros(line.shape[0])
    for i in range(1, line.shape[0]):
        costs[i] = segment_cost(factors, line[i - 1, 0], line[i - 1, 1], line[i, 0], line[i, 1])
    return costs


@njit(cache=True, nogil=True)
def _set_aside(chain, i, reach, slant, beside, limits):
    """Set the two positions beside a point of a chain; return whether there are any.

    `reach`, `slant`: see `_moved_aside`; `beside`: float64 (3, 2), changed, the first and the last;
    `limits`: float64 (2,), the rows and columns of the map.
    """
    down, over = chain[i + 1, 0] - chain[i - 1, 0], chain[i + 1, 1] - chain[i - 1, 1]
    length = hypot(down, over)
    if length == 0:
        return False
    row, col = -over / length, down / length
    aside = _SLANT * row - slant * col, slant * row + _SLANT * col
    for side in (0, 2):
        for k in range(2):
            at = np.rint((chain[i, k] + (side - 1) * reach * aside[k]) * FINE) / FINE
            beside[side, k] = min(max(at, 0.0), limits[k])
    return True


@njit(cache=True, nogil=True)
def _moved_aside(free, factors, chain, costs, reach, slant, live):
    """Move the points of a chain aside, each or none, so that the whole costs least, by dynamic
    programming over the three places of each.

    Parameters
    ----------
    free, factors
        See `cost_line.settle`.
    chain
        float64 (n, 2), changed: positions; the first and the last stay.
    costs
        float64 (n,), changed: see `costs_of`.
    reach
        Cells by which points move.
    slant
        `_SLANT`, or less than 0 to the other side.
    live
        int64 (n,), changed: passes that each point takes part in still.
    """
    n = chain.shape[0]
    limits = np.array([free.shape[0] + 0.0, free.shape[1] + 0.0])
    places, before = np.empty((n, 3, 2)), np.ones((n, 3), np.int64)
    # The least cost up to the three places of the last point and of this one; and of segments.
    totals, following = np.array([np.inf, 0.0, np.inf]), np.empty(3)
    segments = np.empty((n, 3))
    for i in range(n):
        places[i, 1] = chain[i]
        if i == 0:
            continue
        # Points that have settled, and the last one, stay: they have one place.
        moves = i < n - 1 and live[i] > 0
        moves = moves and _set_aside(chain, i, reach, slant, places[i], limits)
        for k in range(3):
            least, segment, best = np.inf, np.inf, 1
            if k == 1 or moves:
                row, col = places[i, k]
                # From where the last point stood; between two that stay, the cost is known.
                if k == 1:
                    segment = costs[i]
                elif totals[1] < np.inf:
                    segment = legal_cost(
                        free, factors, chain[i - 1, 0], chain[i - 1, 1], row, col, np.inf
                    )
                least = totals[1] + segment
                # From its places aside, if that saves something.
                for j in (0, 2):
                    if totals[j] >= least:
                        continue
                    near_row, near_col = places[i - 1, j]
                    cost = legal_cost(
                        free, factors, near_row, near_col, row, col, least - totals[j]
                    )
                    if totals[j] + cost < least - _SAVED:
                        least, segment, best = totals[j] + cost, cost, j
            following[k], segments[i, k], before[i, k] = least, segment, best
        totals[:] = following
    # Back from the end; points that moved and their neighbours may move again.
    k, is_next_moved = 1, False
    for i in range(n - 1, 0, -1):
        costs[i] = segments[i, k]
        if is_next_moved or k != 1 or before[i, k] != 1:
            live[i] = _IDLE
        else:
            live[i] = max(live[i] - 1, 0)
        is_next_moved = k != 1
        if is_next_moved:
            chain[i] = places[i, k]
        k = before[i, k]


@njit(cache=True, nogil=True)
def settle_chain(free, factors, chain, costs, reach, levels, passes):
    """Move the points of a chain aside to where it costs least: by some cells at first, by half as
    much on each further level.

    `free`, `factors`: see `cost_line.settle`; `chain`, `costs`, `reach`: see `_moved_aside`;
    `levels`: how many there are; `passes`: most on each.
    """
    n, slant = chain.shape[0], _SLANT
    live = np.empty(n, np.int64)
    for _ in range(levels):
        live[:] = _IDLE
        for _ in range(passes):
            _moved_aside(free, factors, chain, costs, reach, slant, live)
            slant = -slant
            is_still = True
            for i in range(1, n - 1):
                is_still = is_still and live[i] == 0
            if is_still:
                break
        reach *= 0.5


@njit(cache=True, nogil=True)
def _is_by_wall(free, row, col):
    """Return whether a cell round that of a position is blocked."""
    rows, cols = free.shape
    row, col = int(row), int(col)
    for down in range(max(row - 1, 0), min(row + 2, rows)):
        for over in range(max(col - 1, 0), min(col + 2, cols)):
            if free[down, over] == 0:
                return True
    return False


@njit(cache=True, nogil=True)
def polish(free, factors, line, costs):
    """Move the points of a line that lie by walls, one at a time, to where it costs less.

    Compass search does what a chain that is held by an obstacle leaves undone.

    `free`, `factors`: see `cost_line.settle`; `line`: float64 (n, 2), changed; `costs`: see
    `costs_of`, changed.
    """
    n, rows, cols = line.shape[0], free.shape[0] + 0.0, free.shape[1] + 0.0
    # How far away each point is tried.
    reach = np.zeros(n)
    for i in range(1, n - 1):
        if _is_by_wall(free, line[i, 0], line[i, 1]):
            reach[i] = _FIRST_REACH
    # Sweeps over the points that may still move.
    for sweep in range(_SWEEPS):
        first_way, is_still = 4 * (sweep % 2), True
        for i in range(1, n - 1):
            if reach[i] < _LAST_REACH:
                continue
            # The cheapest of the places around it that its segments may lead to.
            is_still = False
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
                for k in (i - 1, i + 1):
                    if 0 < reach[k] < _LAST_REACH:
                        reach[k] *= 2
            else:
                reach[i] *= 0.5
        if is_still:
            break
