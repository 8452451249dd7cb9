"""Kernels of the tables of a jump-point graph: corner cells, and the distances to them.

Directions are those of `search.moves`: 0 east (column + 1), 1 north-east, counter-clockwise, row
+ 1 being north. Cells lie in a frame of blocked ones, so that no neighbour is off the map; a flat
cell is its place in the framed grid.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit

BLOCKED = -1
"""Number of cells that are not free."""


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

    `free`: bool (rows, cols). Returns int32 ((rows + 2) * (cols + 2),), the number of each cell of
    the framed grid, `BLOCKED` for none; int32 (n,), flat corner cells; uint8 (n,), which of their
    corners are blocked, bit k for direction 2 * k + 1; the index, int64 (words, 3), which keeps the
    numbers in 3 bits a cell: for every 64 flat cells which are free, which are corner cells, and
    how many of each come before, free ones in the high half.
    """
    rows, cols = free.shape
    width = cols + 2
    number = np.full((rows + 2) * width, BLOCKED, np.int32)
    n_cells = np.int32(0)
    for row in range(rows):
        at = (row + 1) * width + 1
        for col in range(cols):
            if free[row, col]:
                number[at + col] = n_cells
                n_cells += 1
    index = np.zeros((number.size + 63 >> 6, 3), np.int64)
    n_corners, n_free = 0, np.int64(0)
    for cell in range(number.size):
        if cell & 63 == 0:
            index[cell >> 6, 2] = n_free << 32 | n_corners
        if number[cell] != BLOCKED:
            n_free += 1
            index[cell >> 6, 0] |= np.int64(1) << (cell & 63)
            if _kind(number, width, cell) != 0:
                n_corners += 1
                index[cell >> 6, 1] |= np.int64(1) << (cell & 63)
    corners, kinds = np.empty(n_corners, np.int32), np.empty(n_corners, np.uint8)
    n_corners = 0
    for cell in range(number.size):
        if is_corner(index, cell):
            corners[n_corners], kinds[n_corners] = cell, _kind(number, width, cell)
            n_corners += 1
    return number, corners, kinds, index


@njit(cache=True, nogil=True, _nrt=False)
def _kind(number, width, cell):
    """Return the corners of a free cell that are blocked while both cells beside them are free."""
    east, north = number[cell + 1] != BLOCKED, number[cell + width] != BLOCKED
    west, south = number[cell - 1] != BLOCKED, number[cell - width] != BLOCKED
    kind = 0
    if north and east and number[cell + width + 1] == BLOCKED:
        kind |= 1
    if north and west and number[cell + width - 1] == BLOCKED:
        kind |= 2
    if south and west and number[cell - width - 1] == BLOCKED:
        kind |= 4
    if south and east and number[cell - width + 1] == BLOCKED:
        kind |= 8
    return kind


@njit(cache=True, nogil=True)
def look_ahead(number, width, index, ahead, barred):
    """Fill in the distances ahead of each free cell in the eight directions.

    `number`, `index`: results of `number_cells`; `width`: columns of the framed grid; `ahead`:
    int16 or int32 (n_free, 8), filled in; `barred`: uint8 by framed cell, bit k for a move in
    direction k that is illegal though its cells are free; empty for none. Along a side: the
    distance to the next corner cell, or 0 or less, minus the free cells before a blocked one. Along
    a diagonal: the distance to the next cell that is a corner cell or sees one along either side of
    that diagonal, or minus the number of legal moves.
    """
    # Sides come first, because they decide where a diagonal stops.
    for flip in (1, -1):
        first, last = (0, number.size) if flip == 1 else (number.size - 1, -1)
        # Upwards, the cells to the west and south are done before; downwards, those to the north
        # and east.
        towards = ((4, -1), (6, -width)) if flip == 1 else ((0, 1), (2, width))
        for cell in range(first, last, flip):
            here = number[cell]
            if here == BLOCKED:
                continue
            for k, step in towards:
                there = number[cell + step]

                # The neighbour knows the way ahead: one move more, and its sign stays.
                if there == BLOCKED or (barred.size > 0 and barred[cell] >> k & 1):
                    ahead[here, k] = 0
                elif is_corner(index, cell + step):
                    ahead[here, k] = 1
                else:
                    seen = ahead[there, k]
                    ahead[here, k] = seen + 1 if seen > 0 else seen - 1

    # In the same two orders, each diagonal neighbour is done before.
    for flip in (1, -1):
        first, last = (0, number.size) if flip == 1 else (number.size - 1, -1)
        diagonals = (
            ((5, -1, -width), (7, 1, -width)) if flip == 1 else ((1, 1, width), (3, -1, width))
        )
        for cell in range(first, last, flip):
            here = number[cell]
            if here == BLOCKED:
                continue
            for k, along_row, along_col in diagonals:
                there = number[cell + along_row + along_col]
                if (
                    there == BLOCKED
                    or number[cell + along_row] == BLOCKED
                    or number[cell + along_col] == BLOCKED
                    or (barred.size > 0 and barred[cell] >> k & 1)
                ):
                    ahead[here, k] = 0
                elif (
                    is_corner(index, cell + along_row + along_col)
                    or ahead[there, k - 1] > 0
                    or ahead[there, k + 1 & 7] > 0
                ):
                    # A path may turn off the diagonal where a side leads to a corner cell.
                    ahead[here, k] = 1
                else:
                    seen = ahead[there, k]
                    ahead[here, k] = seen + 1 if seen > 0 else seen - 1


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
