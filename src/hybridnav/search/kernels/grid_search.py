"""Kernels of A* on cells: by lengths, and by lengths times factors of cells."""

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

# A record: generation, cost modulo 2^b, with factors whether expanded, direction of arrival; see
# `_base.kernels.moves`. Of costs without factors the width of a bucket and two diagonals are below
# 2^18.
_DIRECTION_BITS = 3
_COST_BITS = 19
GENERATIONS = (1 << (32 - _DIRECTION_BITS - _COST_BITS)) - 1
"""Number of searches after which the array of records must be filled with zeros again."""
_LONG_COST_BITS = 36
LONG_GENERATIONS = (1 << (63 - _DIRECTION_BITS - _LONG_COST_BITS)) - 1
"""The same of records of 64 bits, whose costs lose nothing: a cell that is far from those beside
it, because there is no way back, is recorded right."""
_EXPANDED = 1 << _DIRECTION_BITS
_WIDE_LOW_BITS, _WIDE_COST_BITS = _DIRECTION_BITS + 1, 48
WIDE_GENERATIONS = (1 << (63 - _WIDE_LOW_BITS - _WIDE_COST_BITS)) - 1
"""The same with factors."""

# Width of a bucket of the open list, 0.41 of a straight step; a quarter and an eighth of that are
# equal within noise. A move raises f by less than 2 * DIAGONAL, 7 buckets: 8 take turns.
_BUCKET_SHIFT = 15
BUCKETS = 8


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
def forbid(moves, cols, blocked, corner_cutting):
    """Remove all moves into, out of and past the corners of some flat cells from the masks.

    Return the flat cells whose masks may have changed, and their former masks.
    """
    rows = moves.size // cols
    touched = np.empty(9 * blocked.size, np.int64)
    n_touched = 0
    for cell in blocked:
        row, col = cell // cols, cell % cols
        for to_row in range(max(row - 1, 0), min(row + 2, rows)):
            for to_col in range(max(col - 1, 0), min(col + 2, cols)):
                touched[n_touched] = to_row * cols + to_col
                n_touched += 1
    touched = touched[:n_touched]
    masks = moves[touched]
    for cell in blocked:
        moves[cell] = 0
        row, col = cell // cols, cell % cols
        for k in range(8):
            to_row, to_col = row + ROW_STEP[k], col + COL_STEP[k]
            if to_row < 0 or to_row >= rows or to_col < 0 or to_col >= cols:
                continue
            gone = 1 << (k + 4 & 7)
            if not (k & 1 or corner_cutting):
                gone |= 1 << (k + 3 & 7) | 1 << (k + 5 & 7)
            moves[to_row * cols + to_col] &= 255 - gone
    return touched, masks


@njit(cache=True, nogil=True)
def makes_any(moves, cells):
    """Return whether a path makes one of some moves.

    `moves`: uint8 (rows, cols), the moves from each cell, bit k for direction k; `cells`: int64 (n,
    2), (row, col), each beside the one before.
    """
    for i in range(len(cells) - 1):
        mask = moves[cells[i, 0], cells[i, 1]]
        if mask:
            row, col = cells[i + 1, 0] - cells[i, 0], cells[i + 1, 1] - cells[i, 1]
            for k in range(8):
                if mask >> k & 1 and ROW_STEP[k] == row and COL_STEP[k] == col:
                    return True
    return False


@njit(cache=True, nogil=True)
def _with_detours(todo, spared, k, cell, cols, field_of, in_corridor):
    """Return successors with those detours that stand on a cell outside the corridor.

    Parameters
    ----------
    todo, spared
        Successors and detours, see `grid_search.move_tables`.
    k, cell, cols
        Direction of arrival, the flat cell, and the columns of the grid.
    field_of, in_corridor
        See `astar`.
    """
    while spared != 0:
        pruned = spared & 7
        spared >>= 4
        via = pruned + (1 if pruned - k & 7 < 4 else -1) & 7
        if not in_corridor[field_of[cell + ROW_STEP[via] * cols + COL_STEP[via]]]:
            todo = todo << 4 | 8 | pruned
    return todo


@guarded
@njit(cache=True, nogil=True)
def astar(
    moves,
    cols,
    endpoints,
    limit,
    weights,
    successors,
    detours,
    field_of,
    in_corridor,
    records,
    generation,
    waiting,
):
    """Return the cost of the optimal path between two flat cells in a corridor, and the expansions.

    The cost is -1 if there is no path below `limit`, `BUCKET_FULL` if a bucket is full.

    A successor in the current bucket is expanded next without a stay in its bucket, as the newest
    one would be. A cell can be expanded again within a bucket; the search ends when no entry below
    the goal's cost is left, so the cost is optimal.

    No array grows here: with arrays that may be replaced in the loop, numba's code took 50 %
    longer. Indices are unsigned because a test for negative ones took 15 % of the time.

    With factors all moves ahead and to the sides are tried. Those that turn by 135 degrees or more
    are not: the cell before is a neighbour of such a successor, and the move from there costs less.
    The kernel is compiled for both, as it is with and without a corridor.

    Parameters
    ----------
    moves, cols
        uint8 (n_cells,), the legal moves of each flat cell, and the columns of the grid.
    endpoints, limit
        Flat cells of start and goal, and the integer cost that a path must stay below.
    weights
        None for lengths. Or int32 (n_cells,), the factor of each cell in units; twice the least
        number of units of a cell, by which the octile distance is a lower bound; the exponent of
        the width of a bucket; the number of buckets.
    successors, detours
        Those of `grid_search.move_tables`; with weights of `moves_by_turn`, and None.
    field_of
        int16 or int32 (n_cells,), a label for each cell; None makes the whole map the corridor.
    in_corridor
        bool by label, whether such a cell may be stood on.
    records, waiting
        uint32 or int64 (n_cells,), with weights int64, and the open list; see
        `_base.kernels.moves`.
    generation
        Number of this search, below `GENERATIONS`, `LONG_GENERATIONS` or `WIDE_GENERATIONS`.
    """
    start, goal = endpoints
    # Known when this is compiled: records of 64 bits take longer costs.
    low_bits, cost_bits = _DIRECTION_BITS, _COST_BITS if records.itemsize == 4 else _LONG_COST_BITS
    scale, shift, n_buckets = 1, _BUCKET_SHIFT, BUCKETS
    if weights is not None:
        units, scale, shift, n_buckets = weights
        low_bits, cost_bits = _WIDE_LOW_BITS, _WIDE_COST_BITS
    cost_mask, same_generation = (1 << cost_bits) - 1, 1 << low_bits + cost_bits
    stamp = np.int64(generation) << low_bits + cost_bits
    goal_row, goal_col = goal // cols, goal % cols
    count = np.zeros(n_buckets, np.int64)
    room = waiting.size // n_buckets
    left = 0

    # The cell in hand; no move led to the start, which direction 8 states.
    bucket = slot = np.int64(0)
    cell, cost, k = np.int64(start), np.int64(0), np.int64(8)
    row, col = cell // cols, cell % cols

    # No f is below that of the start, from which the buckets count.
    origin = octile_cost(row - goal_row, col - goal_col) * scale
    per_col = 1.0 / cols
    records[start] = stamp

    # Only an f below the bound counts: the limit, later the cost of the best path found.
    bound = np.int64(limit)
    if start == goal:
        bound = np.int64(0)
    expanded = 0
    while cell >= 0:
        expanded += 1

        # Left out are moves that paths without this cell replace (see `grid_search.move_tables`);
        # those whose other path leaves the corridor are put back.
        index = k << 8 | np.int64(moves[np.uint64(cell)])
        todo = np.int64(successors[np.uint64(index)])
        if weights is not None:
            # An improved cell loses the mark with its old record, and may be expanded again.
            records[np.uint64(cell)] |= _EXPANDED
            own = np.int64(units[np.uint64(cell)])
        elif field_of is not None and detours is not None:
            spared = np.int64(detours[np.uint64(index)])
            todo = _with_detours(todo, spared, k, cell, cols, field_of, in_corridor)

        # The newest successor in the current bucket. It would be taken out next, so it never goes
        # in.
        following = np.int64(-1)
        following_row = following_col = following_cost = following_k = np.int64(0)
        while todo != 0:
            k = todo & 7
            todo >>= 4
            row_step, col_step = ROW_STEP[np.uint64(k)], COL_STEP[np.uint64(k)]
            to = cell + row_step * cols + col_step
            if field_of is not None and not in_corridor[field_of[to]]:
                continue
            step = STRAIGHT + (k & 1) * (DIAGONAL - STRAIGHT)
            if weights is not None:
                # The sum of both factors, twice their mean, keeps costs whole.
                step *= own + np.int64(units[np.uint64(to)])
            new_cost = cost + step

            # The exclusive or clears the generation of this search: a record of another one stays
            # large.
            known = np.int64(records[np.uint64(to)]) ^ stamp
            if known < same_generation and is_no_gain(known, low_bits, cost_mask, new_cost):
                continue
            to_row, to_col = row + row_step, col + col_step
            estimate = new_cost + octile_cost(to_row - goal_row, to_col - goal_col) * scale
            if estimate >= bound:
                continue
            records[np.uint64(to)] = stamp | (new_cost & cost_mask) << low_bits | k

            # The goal never waits: it lowers the bound, which ends the search when nothing lies
            # below.
            if to == goal:
                bound = new_cost
                continue

            # A newer successor in the current bucket sends the one before it into the bucket.
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

        # A successor of the current bucket comes before all waiting cells.
        if following >= 0:
            cell, cost, k = following, following_cost, following_k
            row, col = following_row, following_col
            continue

        # Otherwise the newest waiting cell of the first bucket. A wrap of the ring is safe: all
        # waiting cells lie less than a round ahead.
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
            # Each improvement left an entry: another one had the cell expanded at its present cost.
            if weights is not None and record & _EXPANDED != 0:
                continue
            # Exact: half a cell off any multiple, and far fewer than 2^50 cells.
            row = np.int64((waits + 0.5) * per_col)
            col = waits - row * cols

            # The bucket determines the full cost. An entry whose cell was improved since lies
            # outside its bucket, or is as good as the newer one.
            estimate = octile_cost(row - goal_row, col - goal_col) * scale
            least = origin + (bucket << shift) - estimate
            cost = full_cost(record, low_bits, cost_mask, least)
            if cost - least >> shift == 0 and cost + estimate < bound:
                cell, k = waits, record & 7
                break
    return (bound if bound < limit else -1), expanded
