"""Kernels that divide the free cells of a map at its throats, by how far obstacles are away."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import find

STRAIGHT, DIAGONAL, KNIGHT = 5, 7, 11
"""Lengths of steps in fifths of a cell (Borgefors 1986): at most 2 % off the Euclidean distance."""


@guarded
@njit(cache=True, nogil=True)
def clearances(classes, most):
    """Return how far obstacles are from each square of 2 x 2 cells, uint16.

    It is the distance from the free cell of the square that lies farthest from all cells that are
    not free, in fifths of a cell, by chains of steps to the eight cells around and those a knight's
    move away; at most `most`, and 0 where no cell of the square is free. Squares at the last row
    and column may have half their cells. Cells beyond the map are no obstacles.
    """
    rows, cols = classes.shape
    # Two cells of margin on each side, so that no step needs a look at where it leads.
    away = np.full((rows + 4, cols + 4), np.uint16(most), np.uint16)
    for row in range(rows):
        for col in range(cols):
            away[row + 2, col + 2] = most if classes[row, col] == 1 else 0
    squares = np.zeros((rows + 1 >> 1, cols + 1 >> 1), np.uint16)
    for row in range(2, rows + 2):
        step_across(away[row, 2:-2], away[row - 1], away[row - 2])
        step_along(away[row, 2:-2], most)
    for row in range(rows + 1, 1, -1):
        step_across(away[row, 2:-2], away[row + 1], away[row + 2])
        step_along(away[row, -3:1:-1], most)
        of_row = squares[(row >> 1) - 1]
        for i in range(cols >> 1):
            of_row[i] = max(of_row[i], away[row, 2 * i + 2], away[row, 2 * i + 3])
        if cols & 1:
            of_row[cols >> 1] = max(of_row[cols >> 1], away[row, cols + 1])
    return squares


@njit(cache=True, nogil=True, _nrt=False)
def step_across(away, one, two):
    """Shorten the distances of a row by the steps to the row beside it and the one after that.

    The rows begin two cells before it. There is no branch: many cells are one instruction.
    """
    n = away.size
    far_west, west, beside = one[:n], one[1 : n + 1], one[2 : n + 2]
    east, far_east, two_west, two_east = (
        one[3 : n + 3],
        one[4 : n + 4],
        two[1 : n + 1],
        two[3 : n + 3],
    )
    for col in range(n):
        diagonal = np.uint16(min(west[col], east[col]) + np.uint16(DIAGONAL))
        knight = min(two_west[col], two_east[col], far_west[col], far_east[col])
        least = min(np.uint16(beside[col] + np.uint16(STRAIGHT)), diagonal)
        away[col] = min(away[col], least, np.uint16(knight + np.uint16(KNIGHT)))


@njit(cache=True, nogil=True, _nrt=False)
def step_along(away, most):
    """Shorten the distances of a row by steps from each cell to the next one."""
    near = np.uint16(most)
    for col in range(away.size):
        near = min(away[col], np.uint16(near + np.uint16(STRAIGHT))) if away[col] > 0 else away[col]
        away[col] = near


@njit(cache=True, nogil=True)
def in_order(away, most):
    """Return the flat cells with a clearance, the least first, and where each clearance begins."""
    begin = np.zeros(most + 2, np.int64)
    for k in away:
        if k > 0:
            begin[k + 1] += 1
    for k in range(1, most + 1):
        begin[k + 1] += begin[k]
    order = np.empty(begin[most + 1], np.int32)
    place = begin[: most + 1].copy()
    for cell in range(away.size):
        k = away[cell]
        if k > 0:
            order[place[k]] = cell
            place[k] += 1
    return order, begin


@guarded
@njit(cache=True, nogil=True)
def divide(classes, clearance, most, small, slight, depth):
    """Divide free cells into parts that meet in throats, by a flood from the widest to the
    narrowest.

    Squares are visited in the order of falling clearance; among equal ones those first that a part
    reached first, so that two parts meet in the middle of a passage of one width. A square joins
    the part that reached it, or begins one. Where two parts meet, the clearance of that square is
    half the width of the widest passage between them, and what they have so far is wider than it.

    `classes`: uint8 (rows, cols), `CellClass`; `clearance`: uint16, see `clearances`; `most`: the
    greatest one: passages as wide as that are no throats; `small`, `slight`: two parts become one
    where they meet if either has had fewer squares than `small` (a fine part) or `slight` (a part);
    `depth`: both kinds become one where the greatest clearance of either is less than that of the
    passage and this. Returns the fine part of each square, -1 where no cell of it is free. The part
    that each fine part lies in.
    """
    shape = clearance.shape
    order, begin = in_order(clearance.ravel(), most)
    fine_of = unreached_squares(crossings_of(classes), clearance.ravel())
    # A part is a tree of what was begun; its root is the oldest, which has the widest square.
    parents = np.empty(order.size, np.int32), np.empty(order.size, np.int32)
    sizes = np.empty(order.size, np.int32), np.empty(order.size, np.int32)
    widest = np.empty(order.size, np.int32)
    limits = small, slight, depth
    # One queue for each clearance, side by side, of squares and their crossings: what is read next
    # is known ahead, so that on large maps the processor waits for many squares at once.
    queue = np.empty(order.size, np.uint32)
    head, tail = begin.copy(), begin.copy()
    steps = (1, shape[1], -1, -shape[1])
    # Every square with a clearance is in `order` once, and in at most one queue once.
    n_begun = 0
    for level in range(most, 0, -1):
        unreached = begin[level]
        while True:
            if head[level] < tail[level]:
                square, crossings = np.int64(queue[head[level]] >> 4), queue[head[level]] & 15
                head[level] += 1
            else:
                # No part has reached what is left of this clearance.
                while unreached < begin[level + 1] and fine_of[order[unreached]] >= 0:
                    unreached += 1
                if unreached == begin[level + 1]:
                    break
                square = np.int64(order[unreached])
                crossings = np.uint32(_NONE - fine_of[square]) & 15
                fine_of[square] = parents[0][n_begun] = parents[1][n_begun] = n_begun
                sizes[0][n_begun] = sizes[1][n_begun] = 0
                widest[n_begun] = level
                n_begun += 1
            # From here on the square belongs to its part, which is that wide at least.
            fine = find(parents[0], fine_of[square])
            sizes[0][fine] += 1
            sizes[1][find(parents[1], fine)] += 1
            for side in range(4):
                if crossings >> side & 1 == 0:
                    continue
                beside = square + steps[side]
                state = fine_of[beside]
                # Two parts meet here: all that either has so far is as wide or wider.
                if state >= 0:
                    if state != fine:
                        other = find(parents[0], state)
                        if other != fine:
                            fine = meet(fine, other, level, most, parents, sizes, widest, limits)
                    continue
                # An unreached square, no wider than this one, waits for its turn.
                fine_of[beside] = fine
                k = (_NONE - state) >> 4
                queue[tail[k]] = np.uint32(beside) << 4 | np.uint32(_NONE - state) & 15
                tail[k] += 1
    number, part_of = numbered(parents, n_begun)
    for square in range(fine_of.size):
        if fine_of[square] >= 0:
            fine_of[square] = number[find(parents[0], fine_of[square])]
    return fine_of.reshape(shape), part_of


_NONE = -1
"""The fine part of a square without one. Squares that wait for theirs have lesser numbers."""


@njit(cache=True, nogil=True)
def unreached_squares(crossings, away):
    """Return how squares are marked before a part reaches them, int32: `_NONE` less 16 times the
    clearance and the crossings. One number is one line of memory, and not three."""
    marks = np.empty(away.size, np.int32)
    for square in range(away.size):
        marks[square] = _NONE - (np.int32(away[square]) << 4 | crossings[square])
    return marks


@njit(cache=True, nogil=True)
def crossings_of(classes):
    """Return the sides on which free cells of each square have free cells beside them, as bits:
    east 1, north 2, west 4, south 8."""
    rows, cols = classes.shape
    n_cols = cols + 1 >> 1
    crossings = np.zeros((rows + 1 >> 1) * n_cols, np.uint8)
    for row in range(rows):
        base = (row >> 1) * n_cols
        for col in range(1, cols - 1, 2):
            if classes[row, col] == 1 and classes[row, col + 1] == 1:
                crossings[base + (col >> 1)] |= 1
                crossings[base + (col >> 1) + 1] |= 4
        if row & 1 and row + 1 < rows:
            for col in range(cols):
                if classes[row, col] == 1 and classes[row + 1, col] == 1:
                    crossings[base + (col >> 1)] |= 2
                    crossings[base + n_cols + (col >> 1)] |= 8
    return crossings


@guarded
@njit(cache=True, nogil=True, _nrt=False)
def kinds_of_parts(classes, fine_of, kinds):
    """Fill in the kind of each cell, (rows, cols): one number for its class and its fine part.

    `fine_of` are the parts of squares, see `divide`. Kinds are those of `start.kinds_of`, with fine
    parts in place of rooms and no room for unexplored cells.
    """
    for row in range(classes.shape[0]):
        of_row = fine_of[row >> 1]
        for col in range(classes.shape[1]):
            of_class = classes[row, col]
            kinds[row, col] = 2 * of_row[col >> 1] + 3 if of_class == 1 else of_class


@njit(cache=True, nogil=True, _nrt=False)
def meet(fine, other, level, most, parents, sizes, widest, limits):
    """Let two fine parts become one, or the parts that they lie in; return the first one's root.

    `fine`, `other`: roots of the fine parts; `level`, `most`: the clearance where they meet, and
    the greatest one; `parents`, `sizes`: pairs of int32 arrays, of fine parts and of parts;
    changed; `widest`: int32, the clearance at which each was begun; `limits`: `small`, `slight` and
    `depth`, see `divide`.
    """
    small, slight, depth = limits
    one, two = find(parents[1], fine), find(parents[1], other)
    is_wide = level == most or level + depth > min(widest[fine], widest[other])
    joins_fine = is_wide or min(sizes[0][fine], sizes[0][other]) < small
    joins = joins_fine or min(sizes[1][one], sizes[1][two]) < slight
    if joins and one != two:
        join_trees(parents[1], sizes[1], one, two)
    if joins_fine:
        return join_trees(parents[0], sizes[0], fine, other)
    return fine


@njit(cache=True, nogil=True, _nrt=False)
def join_trees(parent, size, one, two):
    """Join two trees; return the root, which is the older one."""
    first, second = min(one, two), max(one, two)
    parent[second] = first
    size[first] += size[second]
    return first


@njit(cache=True, nogil=True)
def numbered(parents, n_begun):
    """Return the number of each root of a fine part, and the part of each number, both from 0
    without gaps."""
    number = np.full(n_begun, np.int32(-1), np.int32)
    part_number = np.full(n_begun, np.int32(-1), np.int32)
    part_of = np.empty(n_begun, np.int32)
    n_fine = n_parts = 0
    for k in range(n_begun):
        if parents[0][k] == k:
            part = find(parents[1], np.int32(k))
            if part_number[part] < 0:
                part_number[part] = n_parts
                n_parts += 1
            number[k] = n_fine
            part_of[n_fine] = part_number[part]
            n_fine += 1
    return number, part_of[:n_fine].copy()
