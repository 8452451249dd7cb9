"""Kernels of legs: the moves between two cells without an obstacle in between.

A leg has moves along one diagonal and along one side next to it, in any order. Its *class* is
2 * k where all its moves go in direction k, 2 * k + 1 where they go in k and in k + 1.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, pop, push
from hybridnav._base.moves import FAR, octile_cost
from hybridnav.search.contraction import NO_ARC, pack
from hybridnav.search.octile.kernels.tables import corner_at, is_corner, number_of

COLUMN_BITS = 24
KIND_BITS = 4
ONWARD, BACKWARD = 16, 32
"""What the class at its tail of an arc without a reverse has more, if it is a leg from the tail to
the head, and if it is one from the head to the tail."""


@njit(cache=True, nogil=True, _nrt=False)
def class_of(rows, cols):
    """Return the class of a leg by its offsets, at least one of which is not 0."""
    if rows == 0:
        return 0 if cols > 0 else 8
    if cols == 0:
        return 4 if rows > 0 else 12
    turn = 0
    if abs(rows) != abs(cols):
        turn = 1 if (abs(rows) > abs(cols)) == ((rows > 0) == (cols > 0)) else -1
    if rows > 0:
        return (2 if cols > 0 else 6) + turn
    return (14 if cols > 0 else 10) + turn


@njit(cache=True, nogil=True)
def reverse(leg):
    """Return the class of a leg when it is walked backwards."""
    return leg + 8 & 15


@njit(cache=True, nogil=True)
def legs_that_follow():
    """Return the legs that may follow each leg at a corner cell on a shortest path.

    Any move of the one leg may come right before any of the other. Two moves that turn by 45
    degrees or less are as short as possible; so are two along sides that turn by 90 degrees if the
    cell between them is blocked. All others are longer than a path past the corner cell, whose
    moves are legal because theirs are. So an excluded pair is never on a shortest path, even where
    there are several. At corner cells of kind 0, beside sides with a direction, any legs follow.

    Returns int64 (16, 16), by the blocked corners of the cell (see `number_cells`) and the class of
    the leg that ends there, walked backwards: bit c is set where a leg of class c may follow.
    """
    table = np.full((16, 16), np.int64(-1))
    table[1:] = 0
    for kind in range(1, 16):
        follow = np.zeros(8, np.int64)
        for k in range(8):
            follow[k] = 1 << k | 1 << (k + 1 & 7) | 1 << (k + 7 & 7)
            if k & 1 == 0:
                # The cell between a move and the next one to its left lies to the left and behind.
                follow[k] |= (kind >> (k // 2 + 1 & 3) & 1) << (k + 2 & 7)
                follow[k] |= (kind >> (k // 2 + 2 & 3) & 1) << (k + 6 & 7)
        for leg in range(16):
            may = follow[leg // 2] & (follow[leg // 2 + 1 & 7] if leg & 1 else 255)
            for other in range(16):
                moves = 1 << other // 2 | (1 << (other // 2 + 1 & 7) if other & 1 else 0)
                if may & moves == moves:
                    table[kind, reverse(leg)] |= 1 << other
    return table


@njit(cache=True, nogil=True, _nrt=False)
def row_col_kind(place):
    """Return the parts of a corner cell's place: row, column, blocked corners."""
    return (
        place >> COLUMN_BITS + KIND_BITS,
        place >> KIND_BITS & (1 << COLUMN_BITS) - 1,
        place & (1 << KIND_BITS) - 1,
    )


# Kernels that join cells to corner cells, by the tables of a jump-point graph.


@njit(cache=True, nogil=True)
def join(tables, cell, found, is_directed):
    """Find the corner cells that are reached from a cell along a diagonal and then a side.

    They include every corner cell that can be the next one on a shortest path, with no other one
    before it. A corner cell does not find itself.

    `tables`: the index of cells (see `number_cells`), the distances ahead of them (see
    `look_ahead`), the number of each corner cell in the graph, int32 (n,), and the width of the
    framed grid; `cell`: flat free cell; `found`: int32, room for all corner cells; filled in;
    `is_directed`: whether moves have directions, so that the way over another corner cell, which a
    diagonal and then a side lead to, may be illegal.
    Result: number of corner cells found.
    """
    index, ahead, order, width = tables
    here = number_of(index, cell)
    n_found = 0
    for straight in range(0, 8, 2):
        seen = np.int64(ahead[here, straight])
        if seen > 0:
            found[n_found] = order[corner_at(index, cell + seen * step_of(straight, width))]
            n_found += 1
    # The four diagonals take turns, so that the processor fetches their data at the same time: `at`
    # is the position of each, -1 at its end; `limits` how far along its right and left side corner
    # cells count.
    at, limits, by = np.full(8, cell), np.empty((8, 2), np.int64), np.full((8, 2), -1)
    for k in range(1, 8, 2):
        limits[k, 0], limits[k, 1] = limit_of(ahead[here, k - 1]), limit_of(ahead[here, k + 1 & 7])
        # The corner cells that set these limits: only what a legal leg from there reaches is over
        # them.
        for i in range(2 if is_directed else 0):
            seen = np.int64(ahead[here, k - 1 + 2 * i & 7])
            by[k, i] = cell + seen * step_of(k - 1 + 2 * i & 7, width) if seen > 0 else -1
    n_left = 4
    while n_left > 0:
        for k in range(1, 8, 2):
            if at[k] < 0:
                continue
            seen = np.int64(ahead[number_of(index, at[k]), k])
            at[k] += seen * step_of(k, width)
            if seen <= 0 or is_corner(index, at[k]):
                if seen > 0:
                    found[n_found] = order[corner_at(index, at[k])]
                    n_found += 1
                at[k] = -1
                n_left -= 1
                continue
            there = number_of(index, at[k])
            for i in range(2):
                along = k - 1 + 2 * i & 7
                seen = np.int64(ahead[there, along])
                # Beyond the limit another corner cell comes first, on a way that is as short.
                if seen > 0:
                    straight = at[k] + seen * step_of(along, width)
                    is_over = seen >= limits[k, i]
                    if is_over and is_directed:
                        is_over = by[k, i] >= 0 and is_direct(tables, by[k, i], straight)
                    if not is_over:
                        found[n_found] = order[corner_at(index, straight)]
                        n_found += 1
                if is_directed and limit_of(seen) < limits[k, i]:
                    by[k, i] = straight if seen > 0 else -1
                limits[k, i] = min(limits[k, i], limit_of(seen))
    return n_found


@njit(cache=True, nogil=True, _nrt=False)
def step_of(k, width):
    """Return the step from a flat cell to its neighbour in a direction."""
    if k == 0:
        return 1
    if k < 4:
        return width + 2 - k
    if k == 4:
        return -1
    return k - 6 - width


@njit(cache=True, nogil=True, _nrt=False)
def limit_of(seen):
    """Return the distance along a side from which no cell is the next corner cell any more.

    It holds further along the diagonal: a corner cell or a blocked one lies before that distance.
    """
    return seen if seen > 0 else 1 - seen


@njit(cache=True, nogil=True, _nrt=False)
def is_direct(tables, cell, goal):
    """Return whether the leg from a cell to another one, diagonal first, is free."""
    width = tables[3]
    rows, cols = goal // width - cell // width, goal % width - cell % width
    diagonal = min(abs(rows), abs(cols))
    straight = max(abs(rows), abs(cols)) - diagonal
    at = cell
    if diagonal > 0:
        k = (1 if cols > 0 else 3) if rows > 0 else (7 if cols > 0 else 5)
        if not _is_clear(tables, at, k, diagonal):
            return False
        at += diagonal * step_of(k, width)
    if straight > 0:
        along_col, along_row = (2 if rows > 0 else 6), (0 if cols > 0 else 4)
        k = along_col if abs(rows) > abs(cols) else along_row
        return _is_clear(tables, at, k, straight)
    return True


@njit(cache=True, nogil=True, _nrt=False)
def _is_clear(tables, at, k, distance):
    """Return whether `distance` moves in a direction are legal."""
    index, ahead, _, width = tables
    step = step_of(k, width)
    while True:
        seen = np.int64(ahead[number_of(index, at), k])
        if seen <= 0:
            return -seen >= distance
        if seen >= distance:
            return True
        at += seen * step
        distance -= seen


@njit(cache=True, nogil=True)
def _joined(tables, corners, is_directed):
    """Join every corner cell to others; return the offsets of those that each finds, and these."""
    n_corners = corners.size
    begin = np.zeros(n_corners + 1, np.int64)
    heads = np.empty(16 * n_corners + 16, np.int32)
    found = np.empty(n_corners, np.int32)
    n_heads = 0
    for corner in range(n_corners):
        n_found = join(tables, np.int64(corners[corner]), found, is_directed)
        while n_heads + n_found > heads.size:
            heads = grow(heads)
        heads[n_heads : n_heads + n_found] = found[:n_found]
        n_heads += n_found
        begin[corner + 1] = n_heads
    return begin, heads[:n_heads]


@guarded
@njit(cache=True, nogil=True)
def arcs_of(tables, back, corners, places, is_directed):
    """Build the arcs between corner cells.

    `tables`: see `join`; `back`: those of the moves backwards; `corners`: int32 (n,), flat corner
    cells; `places`: int64 (n,), see `row_col_kind`; `is_directed`: whether moves have directions.
    Returns int32 (n + 1,), where the arcs of each corner cell begin; int64 (m, 2), the cost of each
    arc, and its head and classes (see `pack`). Without directions each arc comes with its reverse.
    """
    begin, heads = _joined(tables, corners, is_directed)
    begin_back, tails = begin, heads
    if is_directed:
        begin_back, tails = _joined(back, corners, is_directed)
    # An arc that only one endpoint finds passes another corner cell: two arcs replace it, if the
    # leg is legal in the other order too.
    is_kept = np.zeros(heads.size, np.bool_)
    first = np.zeros(corners.size + 1, np.int32)
    for corner in range(corners.size):
        first[corner + 1] = first[corner]
        for at in range(begin[corner], begin[corner + 1]):
            other = heads[at]
            for k in range(begin_back[other], begin_back[other + 1]):
                if tails[k] == corner:
                    is_kept[at] = True
                    break
            if is_directed and not is_kept[at]:
                ends = np.int64(corners[other]), np.int64(corners[corner])
                is_kept[at] = not is_direct(back, ends[0], ends[1])
            first[corner + 1] += is_kept[at]
    arcs = np.empty((first[-1], 2), np.int64)
    n_arcs = 0
    for corner in range(corners.size):
        row, col, _ = row_col_kind(places[corner])
        for at in range(begin[corner], begin[corner + 1]):
            if is_kept[at]:
                to_row, to_col, _ = row_col_kind(places[heads[at]])
                leg = class_of(to_row - row, to_col - col)
                arcs[n_arcs, 0] = octile_cost(to_row - row, to_col - col)
                arcs[n_arcs, 1] = pack(np.int64(heads[at]), leg, reverse(leg))
                n_arcs += 1
    return first, arcs


@njit(cache=True, nogil=True)
def components(first, arcs):
    """Number the connected parts of a graph, int32 (n,) for its corner cells."""
    part = np.full(first.size - 1, -1, np.int32)
    waiting = np.empty(first.size, np.int32)
    n_parts = 0
    for corner in range(part.size):
        if part[corner] >= 0:
            continue
        part[corner] = n_parts
        waiting[0], n_waiting = corner, 1
        while n_waiting > 0:
            n_waiting -= 1
            at = waiting[n_waiting]
            for arc in range(first[at], first[at + 1]):
                other = arcs[arc, 1] >> 12
                if part[other] < 0:
                    part[other] = n_parts
                    waiting[n_waiting] = other
                    n_waiting += 1
        n_parts += 1
    return part


# Kernels of the search on a graph of corner cells, contracted or not.

FROM_START, FROM_GOAL = -2, -3
"""Returned by `shortest` as the corner cell when the path is one leg: free with the diagonal first
from the start, or with the diagonal first from the goal."""


class CornerCells(NamedTuple):
    """A graph of corner cells; see `JumpGraph`."""

    tables: tuple[np.ndarray, np.ndarray, np.ndarray, int]
    """See `join`."""
    places: np.ndarray
    """The corners' cells."""
    component: np.ndarray
    """The part of free space of each."""
    follow: np.ndarray
    """The legs that may follow, see `legs_that_follow`."""
    first: np.ndarray
    """Offsets of the arcs of each corner."""
    arcs: np.ndarray
    """The corners to which they lead."""
    back: tuple[np.ndarray, np.ndarray, np.ndarray, int]
    """The tables of the moves backwards: the same, unless moves have directions."""
    reach: np.ndarray
    """Bool (k, k), whether one of the first k parts can be left for another one, if moves have
    directions; else empty."""


@njit(cache=True, nogil=True)
def _begin(graph, endpoints, direction, work, is_queued):
    """Queue the corner cells that an end is joined to, with their costs from this end.

    Return the number of queued corner cells, the number that got their first cost, and their
    component, -1 where the end is joined to none.
    """
    tables, places = (graph.back if direction else graph.tables), graph.places
    index, _, order, width = tables
    records, heaps, touched, found = work
    cell, aim = endpoints[direction], endpoints[1 - direction]
    n_found = 1
    if is_corner(index, cell):
        found[0] = order[corner_at(index, cell)]
    else:
        n_found = join(tables, cell, found, graph.reach.size > 0)
    row, col = cell // width, cell % width
    aim_row, aim_col = aim // width, aim % width
    n_touched = 0
    for i in range(n_found):
        node = np.int64(found[i])
        to_row, to_col, _ = row_col_kind(places[node])
        if records[node, 0] == FAR and records[node, 1] == FAR:
            touched[n_touched] = node
            n_touched += 1
        cost = octile_cost(to_row - row, to_col - col)
        records[node, direction], records[node, 2 + direction] = cost, NO_ARC
        if is_queued:
            push(heaps[direction], i, cost + octile_cost(to_row - aim_row, to_col - aim_col), node)
    part = graph.component[found[0]] if n_found > 0 else -1
    return (n_found if is_queued else 0), n_touched, part


@njit(cache=True, nogil=True)
def _is_reached(graph, records, touched):
    """Return whether a corner cell at the goal can be reached from one at the start, where moves
    have directions."""
    for node in touched:
        if records[node, 0] == FAR:
            continue
        part = graph.component[node]
        for other in touched:
            to = graph.component[other]
            if records[other, 1] < FAR and (
                part == to or (max(part, to) < len(graph.reach) and graph.reach[part, to])
            ):
                return True
    return False


@njit(cache=True, nogil=True)
def shortest(graph, endpoints, is_contracted, work):
    """Search for a shortest path between two cells.

    A* runs from the start; in a hierarchy from both endpoints, up to corner cells contracted later.
    A corner cell that both directions reach completes a path, and entries that are not better are
    pruned.

    `graph`: `CornerCells`; `endpoints`: flat cells of start and goal; `is_contracted`:
    whether the arcs are those of a hierarchy; `work`: records, int64 (n, 4), the first two columns
    `FAR`: costs from the start and from the goal, and the tail and arc by which each was reached;
    two heaps with room for n and m entries; room for n corner cells, int64; the same, int32.
    Result: cost, `FAR` where there is no path; the corner cell where both directions meet,
    `FROM_START` or `FROM_GOAL`; corner cells expanded; number of records to clear.
    """
    tables, places, follow = graph.tables, graph.places, graph.follow
    first, arcs = graph.first, graph.arcs
    records, heaps, touched, found = work
    width = tables[3]

    # Two cells with a free leg between them need no corner cell, and no path is shorter.
    rows, cols = (
        endpoints[1] // width - endpoints[0] // width,
        endpoints[1] % width - endpoints[0] % width,
    )
    if is_direct(tables, endpoints[0], endpoints[1]):
        return octile_cost(rows, cols), FROM_START, 0, 0
    if is_direct(graph.back, endpoints[1], endpoints[0]):
        return octile_cost(rows, cols), FROM_GOAL, 0, 0

    # The corner cells at the goal get their costs even if no search starts there: by these, A* from
    # the start completes its paths.
    to_goal, n_touched, goal_part = _begin(graph, endpoints, 1, work, is_contracted)
    rest = records, heaps, touched[n_touched:], found
    to_start, n_more, start_part = _begin(graph, endpoints, 0, rest, True)
    n_touched += n_more

    # Corner cells in different components, or none at an end: no search would find a path.
    if (graph.reach.size == 0 and start_part != goal_part) or goal_part < 0:
        return FAR, FROM_START, 0, n_touched
    if graph.reach.size > 0 and not _is_reached(graph, records, touched[:n_touched]):
        return FAR, FROM_START, 0, n_touched
    best, meeting, expanded = FAR, np.int64(FROM_START), 0
    while True:
        # A direction ends when its least estimate, a lower bound, is no better than the best path.
        if to_start > 0 and heaps[0][0, 0] >= best:
            to_start = 0
        if to_goal > 0 and heaps[1][0, 0] >= best:
            to_goal = 0
        if to_start == 0 and to_goal == 0:
            break
        direction = 0 if to_start > 0 and (to_goal == 0 or heaps[0][0, 0] <= heaps[1][0, 0]) else 1
        heap, size, aim = (
            heaps[direction],
            (to_goal if direction else to_start),
            endpoints[1 - direction],
        )
        aim_row, aim_col = aim // width, aim % width
        estimate = heap[0, 0]
        node = pop(heap, size)
        size -= 1

        # An entry that its record no longer matches is out of date: the cell was reached at less.
        row, col, kind = row_col_kind(places[node])
        cost = records[node, direction]
        if estimate == cost + octile_cost(row - aim_row, col - aim_col):
            expanded += 1

            # Reached from both ends, a corner cell completes a path; `FAR` is not reached.
            if cost + records[node, 1 - direction] < best:
                best, meeting = cost + records[node, 1 - direction], node

            # What may follow depends on the leg of arrival, walked backwards: the class of the arc
            # at this cell, or that of the leg from the end. An end on this cell rules nothing out.
            by = records[node, 2 + direction]
            if by != NO_ARC:
                may_follow = follow[kind, arcs[by & 0xFFFFFFFF, 1] & 63]
            elif row * width + col == endpoints[direction]:
                may_follow = np.int64(-1)
            else:
                leg = class_of(
                    endpoints[direction] // width - row, endpoints[direction] % width - col
                )
                may_follow = follow[kind, leg]
            may_follow &= 0xFFFF
            may_follow |= may_follow << (BACKWARD if direction else ONWARD)
            for arc in range(first[node], first[node + 1]):
                packed, further = arcs[arc, 1], cost + arcs[arc, 0]
                other = packed >> 12
                known = records[other, direction]
                if may_follow >> (packed >> 6 & 63) & 1 == 0 or known <= further:
                    continue
                row, col, _ = row_col_kind(places[other])
                estimate = further + octile_cost(row - aim_row, col - aim_col)
                if estimate >= best:
                    continue
                # Noted once, by whichever direction comes first: the caller resets both.
                if known == FAR and records[other, 1 - direction] == FAR:
                    touched[n_touched] = other
                    n_touched += 1
                records[other, direction], records[other, 2 + direction] = further, node << 32 | arc
                push(heap, size, estimate, other)
                size += 1
        if direction:
            to_goal = size
        else:
            to_start = size
    return best, meeting, expanded, n_touched
