"""Kernels of hub labels on a jump-point graph: shortest octile distances without a search.

A shortest path leads from its start along a leg to a corner cell, from there to a hub, on to a
corner cell, and along a leg to its goal. A label is parted by the class of the leg on which its
paths begin: the leg that leads from the cell to the corner cell allows few of them, so a query
reads one entry in twenty.
"""

import numpy as np
from numba.extending import overload

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, push
from hybridnav._base.moves import FAR, octile_cost
from hybridnav.search.kernels.labels import reach_next
from hybridnav.search.octile.kernels.legs import class_of, is_direct, join, row_col_kind
from hybridnav.search.octile.kernels.tables import corner_at, is_corner

SIDE = 4
"""Side of the squares in cells: a bit for each fits into an int32."""
PARTS = 17
"""Parts of a label: the corner cell itself, and the classes of legs."""
BITS = 40
"""Bits of a cost, below the rank of a hub."""


@njit(cache=True, nogil=True)
def _reach_on_jumps(graph, edges, here, work, size, n_touched):
    """Reach the corner cells to which a shortest path may go on; see `reach_next`."""
    places, follow = graph
    first, arcs = edges
    costs, before, touched, heap = work
    row, col, kind = row_col_kind(places[here])
    may = np.int64(-1)
    if before[here] >= 0:
        from_row, from_col, _ = row_col_kind(places[before[here]])
        may = follow[kind, class_of(from_row - row, from_col - col)]
    for arc in range(first[here], first[here + 1]):
        packed, reached = arcs[arc, 1], costs[here] + arcs[arc, 0]
        other = packed >> 12
        if may >> (packed >> 6 & 63) & 1 and reached < costs[other]:
            if costs[other] == np.inf:
                touched[n_touched] = other
                n_touched += 1
            costs[other], before[other] = reached, here
            push(heap, size, reached, float(other))
            size += 1
    return size, n_touched


@overload(reach_next)
def _reach_of_jumps(graph, edges, here, work, size, n_touched):  # noqa: ARG001 - numba's rule
    """Return what stands for `reach_next` on a jump-point graph."""

    def reach(graph, edges, here, work, size, n_touched):
        return _reach_on_jumps(graph, edges, here, work, size, n_touched)

    return reach if len(graph) == 2 else None


@guarded
@njit(cache=True, nogil=True)
def ranges_of_legs(follow):
    """Return the first part, and the one after the last, of the legs that may follow each leg at a
    corner cell, int64 (16, 16, 2), see `legs_that_follow`; beyond the last part they begin anew."""
    ranges = np.zeros((16, 16, 2), np.int64)
    for kind in range(16):
        for leg in range(16):
            may = follow[kind, leg]
            low = (leg + 8) & 15  # straight on, which always may follow
            high = low + 1
            while may >> (low + 15 & 15) & 1:
                low -= 1
            while may >> (high & 15) & 1:
                high += 1
            shift = 17 if low < 0 else 1
            ranges[kind, leg, 0], ranges[kind, leg, 1] = low + shift, high + shift
    return ranges


@guarded
@njit(cache=True, nogil=True)
def parts_of(places, order, at, onward):
    """Return the part of each entry: that of the leg from one corner cell to the next; corner cells
    get other numbers, by an order."""
    parts = np.empty(len(at), np.int64)
    for k in range(len(at)):
        row, col, _ = row_col_kind(places[at[k]])
        to_row, to_col, _ = row_col_kind(places[onward[k]])
        parts[k] = np.int64(PARTS) * order[at[k]] + 1 + class_of(to_row - row, to_col - col)
    return parts


@guarded
@njit(cache=True, nogil=True)
def views_of_squares(tables, places, is_free, most):
    """Find the corner cells that the cells of each square are joined to.

    `tables`: see `join`; `places`: int64 (n,), see `row_col_kind`; `is_free`: bool (rows, cols),
    the free cells of the framed rectangle. Returns int32 (squares + 1,) offsets; int32 (v, 2), a
    corner cell, and a bit for each cell of the square that is joined to it; whether there was room
    for all.
    """
    index, _, order, width = tables
    rows, cols = is_free.shape
    n_across, n_down = (cols + SIDE - 1) // SIDE, (rows + SIDE - 1) // SIDE
    begin, n = np.zeros(n_across * n_down + 1, np.int32), 0
    seen, bits = np.empty(4096, np.int32), np.empty(4096, np.int32)
    last, found = np.full(len(places), -1, np.int32), np.empty(len(places) + 1, np.int32)
    for square in range(n_across * n_down):
        low, top, left = n, square // n_across * SIDE, square % n_across * SIDE
        for bit in range(SIDE * SIDE):
            row, col = top + bit // SIDE, left + bit % SIDE
            if row >= rows or col >= cols or not is_free[row, col]:
                continue
            cell, n_found = np.int64(row * width + col), 1
            if is_corner(index, cell):
                found[0] = order[corner_at(index, cell)]
            else:
                n_found = join(tables, cell, found)
            for corner in found[:n_found]:
                if last[corner] < low:
                    if n == len(seen):
                        seen, bits = grow(seen), grow(bits)
                    last[corner], seen[n], bits[n] = n, corner, 0
                    n += 1
                bits[last[corner]] |= 1 << bit
        begin[square + 1] = n
        if n > most:
            return begin, np.empty((0, 2), np.int32), False
    return begin, np.stack((seen[:n], bits[:n]), axis=1), True


@njit(cache=True, nogil=True)
def _look(width, corners, labels, cell, runs):
    """Write the runs of entries that paths from a cell may go on to, with the costs to their corner
    cells, int64 (room, 3); return how many, and the component, -1 for no corner cell."""
    places, component, ranges = corners
    _, offset, begin, views = labels
    row, col, n, part = cell // width, cell % width, 0, -1
    square = row // SIDE * ((width + SIDE - 1) // SIDE) + col // SIDE
    bit = row % SIDE * SIDE + col % SIDE
    for view in range(begin[square], begin[square + 1]):
        if views[view, 1] >> bit & 1 == 0:
            continue
        corner = np.int64(views[view, 0])
        at_row, at_col, kind = row_col_kind(places[corner])
        rows, cols = row - at_row, col - at_col
        cost, at = octile_cost(rows, cols), PARTS * corner
        part, low, high = component[corner], 0, PARTS
        if rows != 0 or cols != 0:  # else the cell is the corner cell, which rules nothing out
            low, high = ranges[kind, class_of(rows, cols)]
            runs[n, 0], runs[n, 1], runs[n, 2] = offset[at], offset[at + 1], cost
            n += 1
        # The legs that may follow are next to each other, in a circle.
        if offset[at + low] < offset[at + min(high, PARTS)]:
            runs[n, 0], runs[n, 1] = offset[at + low], offset[at + min(high, PARTS)]
            runs[n, 2] = cost
            n += 1
        if high > PARTS and offset[at + 1] < offset[at + high - PARTS + 1]:
            runs[n, 0], runs[n, 1] = offset[at + 1], offset[at + high - PARTS + 1]
            runs[n, 2] = cost
            n += 1
    return n, part


@guarded
@njit(cache=True, nogil=True)
def hub_cost(tables, corners, labels, endpoints, work):
    """Return the cost of a shortest path between two cells, `FAR` for none.

    `tables`: see `join`; `corners`: places and components of corner cells, `ranges_of_legs`;
    `labels`: the arrays of `JumpHubs`; `endpoints`: flat cells of start and goal; `work`: room for
    the runs of both ends, int64 (2, n, 3); by hub int64 (n,) the least cost from the start (`FAR`).
    """
    start, goal = endpoints
    runs, least = work
    entries, width = labels[0], tables[3]
    if is_direct(tables, start, goal) or is_direct(tables, goal, start):
        return octile_cost(goal // width - start // width, goal % width - start % width)
    n_start, part = _look(width, corners, labels, start, runs[0])
    n_goal, to_part = _look(width, corners, labels, goal, runs[1])
    if part < 0 or part != to_part:
        return np.int64(FAR)
    mask, best = (np.int64(1) << BITS) - 1, np.int64(FAR)
    for k in range(n_start):
        for packed in entries[runs[0, k, 0] : runs[0, k, 1]]:
            hub = packed >> BITS
            least[hub] = min(least[hub], runs[0, k, 2] + (packed & mask))
    for k in range(n_goal):
        for packed in entries[runs[1, k, 0] : runs[1, k, 1]]:
            best = min(best, least[packed >> BITS] + runs[1, k, 2] + (packed & mask))
    for k in range(n_start):
        for packed in entries[runs[0, k, 0] : runs[0, k, 1]]:
            least[packed >> BITS] = FAR
    return best
