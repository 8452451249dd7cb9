"""Kernels of A* on cells whose costs are lengths times factors of cells.

A move costs its length, STRAIGHT or DIAGONAL, times the sum of the units of its two cells; with one
unit for each cell, twice its length. Integer costs order any two paths as the exact ones do, up to
1e-10 of the cost.
"""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.moves import (
    BUCKET_FULL,
    COL_STEP,
    DIAGONAL,
    ROW_STEP,
    STRAIGHT,
    full_cost,
    is_no_gain,
    octile_cost,
    put,
)

# A record: generation, cost modulo 2^48, whether expanded, direction of arrival; see
# `_open_kernels`.
_EXPANDED = 8
_LOW_BITS = 4
_COST_BITS = 48
_GENERATION_SHIFT = _LOW_BITS + _COST_BITS
_COST_MASK = (1 << _COST_BITS) - 1
_SAME_GENERATION = 1 << _GENERATION_SHIFT
GENERATIONS = (1 << (63 - _GENERATION_SHIFT)) - 1
"""Number of searches after which the array of records must be filled with zeros again."""

_BUCKET_SHIFT = 15
"""Exponent of the width of a bucket, for a factor of one unit."""


def bucket_shift(least_units: int) -> int:
    """Return the exponent of the width of a bucket: 0.4 to 0.8 of the cheapest straight move."""
    return _BUCKET_SHIFT + (2 * least_units).bit_length() - 1


def n_buckets(least_units: int, most_units: int) -> int:
    """Return the number of buckets that take turns, a power of 2."""
    # A move raises f by less than its cost and the change of the estimate.
    most = 2 * DIAGONAL * (least_units + most_units)
    return 1 << ((most >> bucket_shift(least_units)) + 1).bit_length()


@guarded
@njit(cache=True, nogil=True)
def weighted_astar(
    moves,
    units,
    cols,
    endpoints,
    limit,
    scales,
    successors,
    field_of,
    in_corridor,
    records,
    generation,
    waiting,
    n_buckets,
):
    """Return the cost of the cheapest path between two flat cells in a corridor, and the
    expansions.

    The cost is -1 if there is no path below `limit`, `BUCKET_FULL` if a bucket is full. The search
    is that of `astar`, but all moves ahead and to the sides are tried. Those that turn by 135
    degrees or more are not: the cell before is a neighbour of such a successor, and the move from
    there costs less.

    Parameters
    ----------
    moves, units, cols
        uint8 (n_cells,), the legal moves of each flat cell; int32 (n_cells,), its factor in units;
        the columns of the grid.
    endpoints, limit
        Flat cells of start and goal, and the integer cost that a path must stay below.
    scales
        Twice the least number of units of a cell, by which the octile distance is a lower bound,
        and the exponent of the width of a bucket.
    successors
        Those of `grid_search.moves_ahead`.
    field_of, in_corridor
        As in `astar`.
    records, generation
        int64 (n_cells,), and the number of this search, below `GENERATIONS`.
    waiting, n_buckets
        The open list, see `_open_kernels`, and the number of its buckets.
    """
    start, goal = endpoints
    scale, shift = scales
    stamp = np.int64(generation) << _GENERATION_SHIFT
    goal_row, goal_col = goal // cols, goal % cols
    count = np.zeros(n_buckets, np.int64)
    room = waiting.size // n_buckets
    left = 0
    bucket = slot = np.int64(0)
    cell, cost, k = np.int64(start), np.int64(0), np.int64(8)
    row, col = cell // cols, cell % cols
    origin = octile_cost(row - goal_row, col - goal_col) * scale
    per_col = 1.0 / cols
    records[start] = stamp
    bound = np.int64(limit)
    if start == goal:
        bound = np.int64(0)
    expanded = 0
    while cell >= 0:
        expanded += 1
        records[np.uint64(cell)] |= _EXPANDED
        todo = np.int64(successors[np.uint64(k << 8 | np.int64(moves[np.uint64(cell)]))])
        own = np.int64(units[np.uint64(cell)])
        following = np.int64(-1)
        following_row = following_col = following_cost = following_k = np.int64(0)
        while todo != 0:
            k = todo & 7
            todo >>= 4
            row_step, col_step = ROW_STEP[np.uint64(k)], COL_STEP[np.uint64(k)]
            to = cell + row_step * cols + col_step
            if field_of is not None and not in_corridor[field_of[to]]:
                continue
            length = STRAIGHT + (k & 1) * (DIAGONAL - STRAIGHT)
            new_cost = cost + length * (own + np.int64(units[np.uint64(to)]))
            known = records[np.uint64(to)] ^ stamp
            if known < _SAME_GENERATION and is_no_gain(known, _LOW_BITS, _COST_MASK, new_cost):
                continue
            to_row, to_col = row + row_step, col + col_step
            estimate = new_cost + octile_cost(to_row - goal_row, to_col - goal_col) * scale
            if estimate >= bound:
                continue
            records[np.uint64(to)] = stamp | (new_cost & _COST_MASK) << _LOW_BITS | k
            if to == goal:
                bound = new_cost
                continue
            into = estimate - origin >> shift
            entry = to
            if into == bucket:
                entry = following
                following, following_cost, following_k = to, new_cost, k
                following_row, following_col = to_row, to_col
                if entry < 0:
                    continue
            if not put(waiting, count, room, into & n_buckets - 1, entry):
                return BUCKET_FULL, expanded
            left += 1
        if following >= 0:
            cell, cost, k = following, following_cost, following_k
            row, col = following_row, following_col
            continue
        cell = np.int64(-1)
        while left > 0:
            if count[np.uint64(slot)] == 0:
                bucket += 1
                slot = bucket & n_buckets - 1
                if origin + (bucket << shift) >= bound:
                    break
                continue
            count[np.uint64(slot)] -= 1
            left -= 1
            waits = np.int64(waiting[np.uint64(slot * room + count[np.uint64(slot)])])
            record = np.int64(records[np.uint64(waits)])
            if record & _EXPANDED != 0:
                continue
            # Exact: half a cell off any multiple, and far fewer than 2^50 cells.
            row = np.int64((waits + 0.5) * per_col)
            col = waits - row * cols
            estimate = octile_cost(row - goal_row, col - goal_col) * scale
            least = origin + (bucket << shift) - estimate
            cost = full_cost(record, _LOW_BITS, _COST_MASK, least)
            if cost - least >> shift == 0 and cost + estimate < bound:
                cell, k = waits, record & 7
                break
    return (bound if bound < limit else -1), expanded
