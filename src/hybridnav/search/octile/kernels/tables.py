"""Kernels of the tables of a jump-point graph: corner cells, and the distances to them.

Directions are those of `search.moves`: 0 east (column + 1), 1 north-east, counter-clockwise, row
+ 1 being north. Cells lie in a frame of blocked ones, so that no neighbour is off the map; a flat
cell is its place in the framed grid.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit


@njit(cache=True, nogil=True, _nrt=False)
def _n_bits(word):
    """Count the bits that are set in an int64."""
    pairs = word - (word >> 1 & 0x5555555555555555)
    fours = (pairs & 0x3333333333333333) + (pairs >> 2 & 0x3333333333333333)
    return ((fours + (fours >> 4)) & 0x0F0F0F0F0F0F0F0F) * 0x0101010101010101 >> 56


@njit(cache=True, nogil=True, _nrt=False)
def number_of(index, cell):
    """Return the number of a free cell; see `number_cells` for the index."""
    word, before = cell >> 6, (np.int64(1) << (cell & 63)) - 1
    return (index[word, 2] >> 32) + _n_bits(index[word, 0] & before)


@njit(cache=True, nogil=True, _nrt=False)
def is_corner(index, cell):
    """Return whether a cell is a corner cell."""
    return index[cell >> 6, 1] >> (cell & 63) & 1 == 1


@njit(cache=True, nogil=True, _nrt=False)
def corner_at(index, cell):
    """Return the number of a corner cell among these, in the order of rows."""
    word, before = cell >> 6, (np.int64(1) << (cell & 63)) - 1
    return (index[word, 2] & 0xFFFFFFFF) + _n_bits(index[word, 1] & before)


@guarded
@njit(cache=True, nogil=True)
def number_cells(free):
    """Number the free cells, and the corner cells among them, in the order of rows.

    A corner cell has a blocked cell at one of its corners, and both cells beside the blocked one
    are free: shortest paths turn there.

    `free`: uint8 (rows, cols), 1 for free cells, in a frame of blocked ones. Returns uint8 (rows,
    cols), which corners of a corner cell are blocked, bit k for direction 2 * k + 1, else 0; int32
    (n,), the flat corner cells; uint8 (n,), their blocked corners; the index, int64 (words, 3),
    which keeps the numbers in 3 bits a cell: for every 64 flat cells which are free, which are
    corner cells, and how many of each come before, free ones in the high half.
    """
    kinds = np.zeros(free.shape, np.uint8)
    for row in range(1, len(free) - 1):
        _kinds(free[row], free[row - 1], kinds[row], 4, 8)
        _kinds(free[row], free[row + 1], kinds[row], 2, 1)
    flat, flat_kinds = free.reshape(-1), kinds.reshape(-1)
    index = np.zeros((flat.size + 63 >> 6, 3), np.int64)
    n_free = n_corners = np.int64(0)
    for word in range(len(index)):
        first = word << 6
        free_bits = corner_bits = np.int64(0)
        for k in range(min(64, flat.size - first)):
            free_bits |= np.int64(flat[first + k]) << k
            corner_bits |= np.int64(flat_kinds[first + k] != 0) << k
        index[word, 0], index[word, 1] = free_bits, corner_bits
        index[word, 2] = n_free << 32 | n_corners
        n_free += _n_bits(free_bits)
        n_corners += _n_bits(corner_bits)
    corners, blocked = np.empty(n_corners, np.int32), np.empty(n_corners, np.uint8)
    n_corners = 0
    for word in range(len(index)):
        if index[word, 1] == 0:
            continue
        for cell in range(word << 6, min(word + 1 << 6, flat.size)):
            if flat_kinds[cell] != 0:
                corners[n_corners], blocked[n_corners] = cell, flat_kinds[cell]
                n_corners += 1
    return kinds, corners, blocked, index


# Loops over one row are kernels of their own, without a branch and with indices from 0 on: so they
# become vector instructions.


@njit(cache=True, nogil=True, _nrt=False)
def _kinds(here, beside, kinds, west, east):
    """Add the bits of cells of a row whose corner in the row beside it is blocked while both cells
    beside that corner are free: `west` and `east`, by the side on which it is."""
    before, middle, after = here[:-2], here[1:-1], here[2 : len(here)]
    beside_before, beside_middle, beside_after = beside[:-2], beside[1:-1], beside[2 : len(beside)]
    inner = kinds[1:-1]
    for i in range(len(inner)):
        is_open = middle[i] & beside_middle[i]
        inner[i] |= (is_open & before[i] & (beside_before[i] ^ 1)) * west
        inner[i] |= (is_open & after[i] & (beside_after[i] ^ 1)) * east


@njit(cache=True, nogil=True)
def look_ahead(free, halts, ahead, barred):
    """Fill in the distances ahead of each free cell in the eight directions.

    `free`: see `number_cells`; `halts`: uint8 (rows, cols), not 0 for corner cells; `ahead`: int16
    or int32 (n_free, 8), filled in; `barred`: uint8 (rows, cols), bit k for a move in direction k
    that is illegal though its cells are free; without rows for none. Along a side: the distance to
    the next corner cell, or 0 or less, minus the free cells before a blocked one. Along a diagonal:
    the distance to the next cell that is a corner cell or sees one along either side of that
    diagonal, or minus the number of legal moves.
    """
    rows, width = free.shape
    nothing = np.zeros(width, np.uint8)
    # Rows come first, because what a cell sees along a side decides where a diagonal halts.
    east, west = np.zeros(width, ahead.dtype), np.zeros(width, ahead.dtype)
    sees, events = np.zeros((2, rows, width), np.uint8), np.empty(width, np.int32)
    first = np.zeros(rows + 1, np.int64)
    for row in range(1, rows - 1):
        here, n_before = free[row], first[row]
        bar = barred[row] if len(barred) else nothing
        _look_east(here[1:], halts[row, 1:], bar, east[:-1], events)
        _look_west(here[:-1], halts[row, :-1], bar[1:], west[1:], events)
        for col in range(width):
            sees[0, row, col], sees[1, row, col] = east[col] > 0, west[col] > 0
        for col in range(width):
            if here[col]:
                ahead[n_before, 0], ahead[n_before, 4] = east[col], west[col]
                n_before += 1
        first[row + 1] = n_before
    # From row to row: each neighbour in the row before knows the way ahead.
    for step in (-1, 1):
        straight, to_east, to_west = (2, 1, 3) if step == 1 else (6, 7, 5)
        before, distances = np.zeros((3, width), ahead.dtype), np.zeros((3, width), ahead.dtype)
        for k in range(1, rows - 1):
            row = k if step == -1 else rows - 1 - k
            here, there, stop = free[row], free[row + step], halts[row + step]
            bar = (barred[row] if len(barred) else nothing)[1:-1]
            own, near = (here[1:-1], bar, straight), (there[1:-1], stop[1:-1], before[0, 1:-1])
            _look_straight(own, near, distances[0, 1:-1])
            look = stop[2:], sees[0, row + step, 2:], before[0, 2:], before[1, 2:]
            square = here[1:-1], there[1:-1], here[2:], there[2:]
            _look_aslant(square, bar, to_east, look, distances[1, 1:-1])
            look = stop[:-2], sees[1, row + step, :-2], before[0, :-2], before[2, :-2]
            square = here[1:-1], there[1:-1], here[:-2], there[:-2]
            _look_aslant(square, bar, to_west, look, distances[2, 1:-1])
            n_before = first[row]
            for col in range(width):
                if here[col]:
                    ahead[n_before, straight] = distances[0, col]
                    ahead[n_before, to_east] = distances[1, col]
                    ahead[n_before, to_west] = distances[2, col]
                    n_before += 1
            before, distances = distances, before


@njit(cache=True, nogil=True, _nrt=False)
def _look_west(free, halts, bar, distances, events):
    """Fill in the distances to the west of the cells of a row by what lies west of each.

    An event is a cell where the look ends: twice its place, and 1 more if it is a corner cell that
    is not barred. Each cell sees the event with the highest number before it.
    """
    for i in range(len(distances)):
        is_open = free[i] & ~(bar[i] >> 4) & 1
        events[i] = np.int32(2 * i + is_open) * np.int32(is_open ^ 1 | (halts[i] != 0))
    last = np.int32(0)
    for i in range(len(distances)):
        last = max(last, events[i])
        events[i] = last
    for i in range(len(distances)):
        at = events[i] >> 1
        distances[i] = i + 1 - at if events[i] & 1 else at - i


@njit(cache=True, nogil=True, _nrt=False)
def _look_east(free, halts, bar, distances, events):
    """Fill in the distances to the east of the cells of a row by what lies east of each; see
    `_look_west`."""
    n = len(distances)
    for i in range(n):
        is_open = free[i] & ~bar[i] & 1
        is_event = is_open ^ 1 | (halts[i] != 0)
        events[i] = np.int32(2 * i + is_open) if is_event else np.int32(2 * n)
    last = np.int32(2 * n)
    for i in range(n):
        last = min(last, events[n - 1 - i])
        events[n - 1 - i] = last
    for i in range(n):
        at = events[i] >> 1
        distances[i] = at + 1 - i if events[i] & 1 else i - at


@njit(cache=True, nogil=True, _nrt=False)
def _look_straight(own, near, distances):
    """Fill in the distances of a row towards the row before it: one move more than from there, and
    its sign stays.

    `own`: which cells are free, what is barred there, and the direction; `near`: which cells of the
    row before are free, which of them stop a look, and their distances.
    """
    (is_free, bar, k), (is_free_there, halts, before) = own, near
    for i in range(len(distances)):
        seen = before[i] + 1 if before[i] > 0 else before[i] - 1
        seen = 1 if halts[i] else seen
        distances[i] = seen if is_free[i] & is_free_there[i] & ~(bar[i] >> k) & 1 else 0


@njit(cache=True, nogil=True, _nrt=False)
def _look_aslant(square, bar, k, look, distances):
    """Fill in the distances of a row along a diagonal towards the row before it.

    `square`: which of the four cells of a move are free; `bar`: what is barred; `k`: the direction;
    `look`: of the cells where these moves end, which stop a look, which see a corner cell along
    their row, and their distances straight on and aslant.
    """
    (one, two, three, four), (halts, sees, straight, before) = square, look
    for i in range(len(distances)):
        seen = before[i] + 1 if before[i] > 0 else before[i] - 1
        # A path may turn off the diagonal where a side leads to a corner cell.
        seen = 1 if ((halts[i] | sees[i]) != 0) | (straight[i] > 0) else seen
        distances[i] = seen if one[i] & two[i] & three[i] & four[i] & ~(bar[i] >> k) & 1 else 0


@njit(cache=True, nogil=True)
def turning_cells(moves, width, cells):
    """Return which of some cells are corner cells where moves have a direction, bool (n,).

    A cell is one if a path of two moves through it has no other path to take its place: as long
    and in the other order, if it turns by 45 degrees, else shorter.

    `moves`: uint8 by framed cell, the legal moves; `width`: columns of the framed grid; `cells`:
    int64 (n,), flat cells.
    """
    step = np.array([1, width + 1, width, width - 1, -1, -width - 1, -width, 1 - width])
    found = np.zeros(len(cells), np.bool_)
    for i in range(len(cells)):
        for way in range(64):
            d, k = way >> 3, way & 7
            before, turn = cells[i] - step[d], k - d & 7
            if not moves[before] >> d & moves[cells[i]] >> k & 1 or turn in (0, 4):
                continue
            hand = 1 if turn < 4 else -1
            turns = min(turn, 8 - turn)
            # The first move of the other path, and the second one, -1 for none.
            one, two = k, d
            if turns > 1:
                one, two = d + hand * (2 if turns == 3 and d & 1 == 0 else 1) & 7, -1
            if turns == 2 and d & 1:
                two = one
            is_other = moves[before] >> one & 1
            if two >= 0:
                is_other &= moves[before + step[one]] >> two & 1
            found[i] |= is_other == 0
    return found
