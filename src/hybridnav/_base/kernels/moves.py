"""Kernels of the moves between cells: directions, costs, legal moves, recorded paths, and distances
inside fields by them.
"""

import numpy as np

from hybridnav._base.jit import njit

STRAIGHT = 80782
DIAGONAL = 114243
FAR = 1 << 60
"""More than any path costs; two of them add up without an overflow."""

# Directions in the order east, north-east, north, ... counter-clockwise; odd ones are diagonal.
ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1], np.int64)
COL_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1], np.int64)


@njit(cache=True, nogil=True)
def octile_cost(rows, cols):
    """Return the cost of the shortest path between cells without obstacles, from their offsets."""
    rows, cols = abs(rows), abs(cols)
    if rows < cols:
        rows, cols = cols, rows
    return STRAIGHT * (rows - cols) + DIAGONAL * cols


@njit(cache=True, nogil=True)
def legal_moves(enterable, corner_cutting):
    """Return the byte mask of the legal moves of each cell, bit k for direction k.

    A diagonal needs both side cells enterable, unless corners may be cut. Moves are judged once, on
    the whole grid.
    """
    rows, cols = enterable.shape
    moves = np.zeros((rows, cols), np.uint8)
    for row in range(rows):
        for col in range(cols):
            if not enterable[row, col]:
                continue
            to_east, to_west = col + 1 < cols, col > 0
            to_north, to_south = row + 1 < rows, row > 0
            east = to_east and enterable[row, col + 1]
            west = to_west and enterable[row, col - 1]
            north = to_north and enterable[row + 1, col]
            south = to_south and enterable[row - 1, col]
            mask = east | north << 2 | west << 4 | south << 6
            if to_north and to_east and (corner_cutting or (north and east)):
                mask |= enterable[row + 1, col + 1] << 1
            if to_north and to_west and (corner_cutting or (north and west)):
                mask |= enterable[row + 1, col - 1] << 3
            if to_south and to_west and (corner_cutting or (south and west)):
                mask |= enterable[row - 1, col - 1] << 5
            if to_south and to_east and (corner_cutting or (south and east)):
                mask |= enterable[row - 1, col + 1] << 7
            moves[row, col] = mask
    return moves


@njit(cache=True, nogil=True)
def trace(came, cols, start, goal):
    """Return the flat cells of the path that a search recorded, from start to goal.

    The lowest three bits of `came` are the direction from which each cell was reached.
    """
    count = 1
    cell = goal
    while cell != start:
        k = came[cell] & 7
        cell -= ROW_STEP[k] * cols + COL_STEP[k]
        count += 1
    path = np.empty(count, np.int64)
    cell = goal
    for i in range(count - 1, 0, -1):
        path[i] = cell
        k = came[cell] & 7
        cell -= ROW_STEP[k] * cols + COL_STEP[k]
    path[0] = start
    return path


@njit(cache=True, nogil=True)
def trace_cells(came, cols, start, goal):
    """Return the path of `trace` as (row, col), shape (n, 2)."""
    flat = trace(came, cols, start, goal)
    cells = np.empty((flat.size, 2), np.int64)
    for i in range(flat.size):
        row = flat[i] // cols
        cells[i, 0], cells[i, 1] = row, flat[i] - row * cols
    return cells


# Kernels of what searches of cells share: records of cells, and an open list in buckets.
#
# A record holds the generation of the search that wrote it, so that nothing has to be cleared
# between searches, the cost modulo 2^b, in weighted searches whether the cell was expanded at that
# cost, and the direction of arrival, lowest. The bits of the cost are enough, W being the width of
# a bucket and M the cost of the dearest move: (1) A cell p is expanded within W of its least cost
# g*(p), for its f lies in the first bucket that is not empty, and some cell of an optimal path to
# p waits there or later at its least cost. (2) So p offers its neighbour q less than g*(p) + W +
# M, which is less than W + 2 M above the record of q. (3) The record of q had an f of less than W
# + 2 M above the start of the bucket from which it was written, and no later offer has an f below
# that start: the offer is less than W + 2 M below the record. As W + 2 M < 2^(b - 1), the
# difference modulo 2^b has the sign of the difference. Likewise the bucket of a waiting cell
# determines its full cost, and an entry whose cell has been improved since is found outside its
# bucket, or is as good as the newer one.
#
# The open list is a ring of buckets of f, each a stack of cells: the newest comes first, which
# breaks ties in favour of the deeper cell.

BUCKET_FULL = -2
"""Returned by a search when a bucket of its open list is full."""


@njit(cache=True, nogil=True)
def is_no_gain(known, low_bits, cost_mask, cost):
    """Return whether an offer is no better than a record of the same search.

    `known` is the record without its generation, `low_bits` are the bits below the cost.
    """
    gain = (known >> low_bits) - cost & cost_mask
    return gain == 0 or gain > cost_mask >> 1


@njit(cache=True, nogil=True)
def full_cost(record, low_bits, cost_mask, least):
    """Return the cost of a record, of which the lowest bits are known, from the least that it can
    be."""
    return least + ((record >> low_bits) - least & cost_mask)


@njit(cache=True, nogil=True)
def put(waiting, count, room, slot, cell):
    """Put a cell into a bucket with some room; return whether there was any left."""
    at = np.uint64(slot)
    if count[at] == room:
        return False
    waiting[np.uint64(slot * room + count[at])] = cell
    count[at] += 1
    return True


@njit(cache=True, nogil=True)
def field_distances(classes, field_of, sources):
    """Return the cost of the shortest path inside each field from its source to each cell.

    It is -1 for cells without a field.

    A diagonal is judged on the whole grid: in a free field both side cells must be free, in an
    unexplored one free or unexplored. Buckets as wide as a straight step make the search
    label-setting (Dinic 1978): no cell can be improved from its own bucket, and three buckets that
    take turns hold all open cells.
    """
    rows, cols = classes.shape
    distance = np.full(rows * cols, np.int64(-1), np.int64)
    open_cells = np.empty((3, 1024), np.int32)
    count = np.zeros(3, np.int64)

    # No search leaves its field, so one array holds the distances of all and is never cleared.
    for v in range(sources.size):
        distance[sources[v]] = 0
        free_only = classes[sources[v] // cols, sources[v] % cols] == 1
        open_cells[0, 0] = sources[v]
        count[0] = 1
        turn = 0
        while count[0] + count[1] + count[2] > 0:
            # A move costs one width or more, less than two: it leads into one of the next two.
            slot = turn % 3
            while count[slot] > 0:
                count[slot] -= 1
                cell = np.int64(open_cells[slot, count[slot]])
                cost = distance[cell]
                # A better cost put this cell into an earlier bucket, which expanded it.
                if cost // STRAIGHT != turn:
                    continue
                row, col = cell // cols, cell % cols
                for k in range(8):
                    to_row, to_col = row + ROW_STEP[k], col + COL_STEP[k]
                    if to_row < 0 or to_row >= rows or to_col < 0 or to_col >= cols:
                        continue
                    to = to_row * cols + to_col
                    if field_of[to] != v:
                        continue
                    # A field is of one class: that of its source decides what a diagonal needs.
                    if k & 1:
                        side_cell, other_side_cell = classes[row, to_col], classes[to_row, col]
                        if side_cell == 0 or other_side_cell == 0:
                            continue
                        if free_only and (side_cell != 1 or other_side_cell != 1):
                            continue
                    new_cost = cost + (DIAGONAL if k & 1 else STRAIGHT)
                    if distance[to] >= 0 and distance[to] <= new_cost:
                        continue
                    distance[to] = new_cost
                    # An entry with the worse cost stays: to take it out would need a search.
                    into = new_cost // STRAIGHT % 3
                    if count[into] == open_cells.shape[1]:
                        open_cells = np.concatenate((open_cells, open_cells), axis=1)
                    open_cells[into, count[into]] = to
                    count[into] += 1
            turn += 1
    return distance
