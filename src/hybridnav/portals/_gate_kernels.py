"""Kernels that prepare portals: shortest paths inside fields, from many gates at once.

Directions are those of `search.moves`: 0 to 7, east and on counter-clockwise. Cells of a field
are numbered from 0, `n` stands for "no such neighbour".
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.search.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT

LANES = 16
"""Gates that are searched from together: one cache line of costs a cell."""
TOO_FAR = 1 << 30
"""No path inside a field may cost as much; a diagonal more still fits int32."""
_STRAIGHT = np.int32(STRAIGHT)
_DIAGONAL = np.int32(DIAGONAL)
LEAP = 8
"""A stored direction with this bit set stands for as many moves, so paths have few steps."""
_STRAIGHTS = np.int32(LEAP * STRAIGHT)
_DIAGONALS = np.int32(LEAP * DIAGONAL)


@njit(cache=True, nogil=True)
def neighbours_in_field(moves, cols, index, cells, first, out):
    """Fill `out[i]` with the neighbours of each cell of a field, all legal moves inside it."""
    n = cells.size
    for i in range(n):
        cell = np.int64(cells[i])
        mask = moves[cell]
        for k in range(8):
            out[i, k] = n
            if mask >> k & 1:
                j = index[cell + ROW_STEP[k] * cols + COL_STEP[k]] - first
                if 0 <= j < n:
                    out[i, k] = j


@njit(cache=True, nogil=True)
def leaps_in_field(near, n, out):
    """Fill `out[i]` with the cells `LEAP` moves away in each direction, inside the field."""
    for k in range(8):
        for i in range(n):
            j = i
            for _ in range(LEAP):
                j = near[j, k]
                if j == n:
                    break
            out[i, k] = j


@njit(cache=True, nogil=True)
def wave(near, n, source, cost, ring, order):
    """Fill in the costs from one cell to all of its field, and the cells in the order reached;
    return the number of cells reached.

    Dijkstra's algorithm with buckets one straight step wide: no step is shorter, so a bucket is
    final when its turn comes, and three buckets in turn are enough. `ring` is scratch, (3, size).

    """
    cost[:n] = TOO_FAR
    count = np.zeros(3, np.int64)
    cost[source] = 0
    ring[0, 0] = source
    count[0] = 1
    turn = reached = 0
    left = 1
    while left > 0:
        at = turn % 3
        for i in range(count[at]):
            cell = np.int64(ring[at, i])
            here = cost[cell]
            if here // STRAIGHT != turn:
                continue
            order[reached] = cell
            reached += 1
            for k in range(8):
                j = near[cell, k]
                if j == n:
                    continue
                new_cost = here + (_DIAGONAL if k & 1 else _STRAIGHT)
                if new_cost >= cost[j]:
                    continue
                listed = cost[j] // STRAIGHT == new_cost // STRAIGHT
                cost[j] = new_cost
                if listed:
                    continue
                into = new_cost // STRAIGHT % 3
                ring[into, count[into]] = j
                count[into] += 1
                left += 1
        left -= count[at]
        count[at] = 0
        turn += 1
    return reached


@njit(cache=True, nogil=True)
def _sweep(near, order, begin, end, step, cost, row, stale, lanes):
    """Relax the stale cells of order[begin:end:step] in all lanes; return whether any changed.

    The inner loops run over contiguous lanes and compile to vector instructions; unsigned offsets
    keep out the test for negative indices.

    Parameters
    ----------
    near, order, cost, row, stale, lanes
        See `relax`.
    begin, end, step
        A slice of the order.
    """
    any_changed = False
    width = np.uint64(lanes)
    for q in range(begin, end, step):
        cell = np.uint64(order[q])
        if not stale[cell]:
            continue
        stale[cell] = 0
        at = cell * width
        e, ne = np.uint64(near[cell, 0]) * width, np.uint64(near[cell, 1]) * width
        n, nw = np.uint64(near[cell, 2]) * width, np.uint64(near[cell, 3]) * width
        w, sw = np.uint64(near[cell, 4]) * width, np.uint64(near[cell, 5]) * width
        s, se = np.uint64(near[cell, 6]) * width, np.uint64(near[cell, 7]) * width
        changed = np.int32(0)
        for lane in range(width):
            straight = min(cost[e + lane], cost[n + lane], cost[w + lane], cost[s + lane])
            diagonal = min(cost[ne + lane], cost[nw + lane], cost[sw + lane], cost[se + lane])
            best = min(straight + _STRAIGHT, diagonal + _DIAGONAL, cost[at + lane])
            changed |= best ^ cost[at + lane]
            row[lane] = best
        if changed != 0:
            any_changed = True
            for lane in range(width):
                cost[at + lane] = row[lane]
            for k in range(8):
                stale[near[cell, k]] = 1
    return any_changed


@njit(cache=True, nogil=True)
def relax(near, n, order, prefix, cost, row, stale, lanes):
    """Compute the costs from all lanes' sources, which lie among the first cells of the order.

    The order is that of one source. Its first cells are swept to and fro until nothing changes;
    then one or two sweeps over all cells are nearly always enough. The sweeps end when no cell can
    be improved, so the costs are exact in any order.

    Parameters
    ----------
    near
        (n, 8), the neighbour of each local cell in each direction, n for none.
    n
        Number of cells of the field.
    order
        (n,), the cells in the order of `wave`.
    prefix
        How many cells of the order hold all sources.
    cost
        int32 ((n + 1) * lanes,), integer cost of each cell and lane; changed.
    row, stale
        Scratch by lane and by cell.
    lanes
        Number of sources.
    """
    stale[: n + 1] = 0
    for q in range(prefix):
        stale[order[q]] = 1
    while True:
        back = _sweep(near, order, prefix - 1, -1, -1, cost, row, stale, lanes)
        forth = _sweep(near, order, 0, prefix, 1, cost, row, stale, lanes)
        if not (back or forth):
            break
    stale[:n] = 1
    while _sweep(near, order, 0, n, 1, cost, row, stale, lanes):
        pass


@njit(cache=True, nogil=True)
def directions(near, far, n, cost, row, lanes, out):
    """Write the first direction of the path from each cell to each lane's source.

    `LEAP` is added where the path goes on so for as many moves; such a path is taken before others
    of the same cost. A straight line of legal moves between two cells is the only shortest path, so
    it is part of one to the source if the costs at its endpoints differ by its length.

    Parameters
    ----------
    near, n, cost, row, lanes
        See `relax`.
    far
        (n, 8), the cell `LEAP` moves away in each direction, n for none.
    out
        (`LANES`, n), receives the directions.
    """
    width = np.uint64(lanes)
    for i in range(n):
        cell = np.uint64(i)
        at = cell * width
        e, ne = np.uint64(near[cell, 0]) * width, np.uint64(near[cell, 1]) * width
        nn, nw = np.uint64(near[cell, 2]) * width, np.uint64(near[cell, 3]) * width
        w, sw = np.uint64(near[cell, 4]) * width, np.uint64(near[cell, 5]) * width
        s = np.uint64(near[cell, 6]) * width
        e8, ne8 = np.uint64(far[cell, 0]) * width, np.uint64(far[cell, 1]) * width
        nn8, nw8 = np.uint64(far[cell, 2]) * width, np.uint64(far[cell, 3]) * width
        w8, sw8 = np.uint64(far[cell, 4]) * width, np.uint64(far[cell, 5]) * width
        s8, se8 = np.uint64(far[cell, 6]) * width, np.uint64(far[cell, 7]) * width
        for lane in range(width):
            here = cost[at + lane]
            straight, diagonal = here - _STRAIGHT, here - _DIAGONAL
            k = np.int32(7)
            k = np.int32(5) if cost[sw + lane] == diagonal else k
            k = np.int32(3) if cost[nw + lane] == diagonal else k
            k = np.int32(1) if cost[ne + lane] == diagonal else k
            k = np.int32(6) if cost[s + lane] == straight else k
            k = np.int32(4) if cost[w + lane] == straight else k
            k = np.int32(2) if cost[nn + lane] == straight else k
            k = np.int32(0) if cost[e + lane] == straight else k
            straight, diagonal = here - _STRAIGHTS, here - _DIAGONALS
            k = np.int32(LEAP + 7) if cost[se8 + lane] == diagonal else k
            k = np.int32(LEAP + 5) if cost[sw8 + lane] == diagonal else k
            k = np.int32(LEAP + 3) if cost[nw8 + lane] == diagonal else k
            k = np.int32(LEAP + 1) if cost[ne8 + lane] == diagonal else k
            k = np.int32(LEAP + 6) if cost[s8 + lane] == straight else k
            k = np.int32(LEAP + 4) if cost[w8 + lane] == straight else k
            k = np.int32(LEAP + 2) if cost[nn8 + lane] == straight else k
            k = np.int32(LEAP) if cost[e8 + lane] == straight else k
            row[lane] = k
        for lane in range(lanes):
            out[lane, i] = row[lane]


@njit(cache=True, nogil=True)
def _pack(directions_of_lane, n, row):
    """Write directions, four bits each, into the bytes of a row, even ones into the low half."""
    for i in range(n // 2):
        row[i] = directions_of_lane[2 * i] | directions_of_lane[2 * i + 1] << 4
    if n & 1:
        row[n // 2] = directions_of_lane[n - 1]


@njit(cache=True, nogil=True)
def shift_of(cost):
    """Return the bits to drop so that twice the largest cost, which bounds all in the field, fits
    uint16."""
    bound = 2 * np.int64(cost.max())
    shift = 0
    while bound >> shift > np.iinfo(np.uint16).max:
        shift += 1
    return shift


@njit(cache=True, nogil=True)
def _lower_side_cost(cost, n, lanes, sides, count, shift, side_cost):
    """Set side_cost[i, side] to the least of itself and the shifted costs of some lanes.

    Parameters
    ----------
    cost, n
        See `relax`.
    lanes, sides
        (count,), lanes and the side of each.
    count
        How many there are.
    shift
        Bits that `side_cost` lacks.
    side_cost
        uint16 (n, R), changed.
    """
    for i in range(n):
        for q in range(count):
            there = cost[i * LANES + lanes[q]] >> shift
            if there < side_cost[i, sides[q]]:
                side_cost[i, sides[q]] = there


@njit(cache=True, nogil=True)
def fill_field(near, far, n, gates, first_move, clique, begin, side, side_cost, scratch):
    """Store the paths from all gates of a field.

    Parameters
    ----------
    near, far, n
        See `directions`.
    gates
        Local cells of the gates.
    first_move
        Receives the directions of the paths, a row a gate, two cells a byte.
    clique
        Receives the integer costs from gate to gate.
    begin, side
        Gate c is one of the sides `side[begin[c]:begin[c + 1]]`.
    side_cost
        uint16 (n, R), receives the costs from each cell to the nearest gate of each side.
    scratch
        Arrays of the sweeps, by cell, gate and lane.

    Returns
    -------
    int
        The bits that `side_cost` lacks, -1 where a path is too long.
    """
    cost, first_cost, ring, order, row, stale, heading, member, gate_at = scratch
    if wave(near, n, gates[0], first_cost, ring, order) < n:
        return -1
    shift = shift_of(first_cost[:n])
    if 2 * np.int64(first_cost[:n].max()) >= TOO_FAR:
        return -1
    side_cost[:] = np.iinfo(np.uint16).max
    lane_of = np.empty(side.size, np.int64)
    side_of = np.empty(side.size, np.int64)
    gate_at[:n] = -1
    for c in range(gates.size):
        gate_at[gates[c]] = c
    following = 0
    left = gates.size
    while left > 0:
        while gate_at[gates[following]] < 0:
            following += 1
        wave(near, n, gates[following], first_cost, ring, order)
        lanes = prefix = 0
        for q in range(n):  # the gates nearest to it that are not done
            c = gate_at[order[q]]
            if c >= 0:
                gate_at[order[q]] = -1
                member[lanes] = c
                lanes += 1
                prefix = q + 1
                if lanes == LANES:
                    break
        left -= lanes
        cost[: (n + 1) * LANES] = TOO_FAR
        for lane in range(lanes):
            cost[np.int64(gates[member[lane]]) * LANES + lane] = 0
        relax(near, n, order, prefix, cost, row, stale, LANES)
        count = 0
        for lane in range(lanes):
            c = member[lane]
            for b in range(gates.size):
                clique[c, b] = cost[np.int64(gates[b]) * LANES + lane]
            for q in range(begin[c], begin[c + 1]):
                lane_of[count], side_of[count] = lane, side[q]
                count += 1
        _lower_side_cost(cost, n, lane_of, side_of, count, shift, side_cost)
        directions(near, far, n, cost, row, LANES, heading)
        for lane in range(lanes):
            _pack(heading[lane], n, first_move[member[lane]])
    return shift
