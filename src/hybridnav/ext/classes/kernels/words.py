"""Kernels that carry the words of arcs over to the moves between cells."""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.arrays import grow


@njit(cache=True, nogil=True)
def spread_words(enterable, removed, word_of):
    """Return words of the removed edges, so that every full 2x2 block of cells reads the identity.

    `word_of` holds for each base edge the signed number of a word, read from the lower cell to the
    higher one: 0 for the identity, negative for an inverse. The removed edges join the blocks to
    trees; from the leaves on, each edge receives the product of the other three sides of its block.
    A product of more than one word has a new number, above the highest present. The result holds
    these products, three signed factors in each row.
    """
    rows, cols = enterable.shape
    unknown = np.zeros(rows * cols, np.int8)
    ready = np.empty(rows * cols, np.int64)
    n_ready = 0
    for row in range(rows - 1):
        for col in range(cols - 1):
            if not (
                enterable[row, col]
                and enterable[row, col + 1]
                and enterable[row + 1, col]
                and enterable[row + 1, col + 1]
            ):
                continue
            at = row * cols + col
            for quarter in range(4):
                unknown[at] += removed[_edge_of_block(at, quarter, cols)]
            if unknown[at] == 1:
                ready[n_ready] = at
                n_ready += 1
    number = np.int64(np.abs(word_of).max()) if word_of.size else np.int64(0)
    factors = np.empty(64, np.int64)
    n_factors = 0
    open_edge = removed.copy()
    while n_ready > 0:
        n_ready -= 1
        at = ready[n_ready]
        if unknown[at] != 1:
            continue
        solved = 0
        while not open_edge[_edge_of_block(at, solved, cols)]:
            solved += 1
        edge = _edge_of_block(at, solved, cols)
        # Round the block counter-clockwise, from the solved side's end back to its beginning.
        first = _along(word_of, at, solved + 1 & 3, cols)
        second = _along(word_of, at, solved + 2 & 3, cols)
        third = _along(word_of, at, solved + 3 & 3, cols)
        left = (first != 0) + (second != 0) + (third != 0)
        if left < 2 or (left == 2 and (first == -second or second == -third or first == -third)):
            word = -(first + second + third)
        else:
            number += 1
            if n_factors + 3 > factors.size:
                factors = grow(factors)
            factors[n_factors : n_factors + 3] = -third, -second, -first
            n_factors += 3
            word = number
        word_of[edge] = word if solved < 2 else -word
        open_edge[edge] = False
        unknown[at] = 0
        beyond = _beyond(at, solved, cols)
        if beyond >= 0 and unknown[beyond] > 0:
            unknown[beyond] -= 1
            if unknown[beyond] == 1:
                ready[n_ready] = beyond
                n_ready += 1
    return factors[:n_factors].reshape(-1, 3)


@njit(cache=True, nogil=True)
def _edge_of_block(at, quarter, cols):
    """Return the base edge on the south, east, north or west side of a block."""
    if quarter == 0:
        return 2 * at
    if quarter == 1:
        return 2 * (at + 1) + 1
    if quarter == 2:
        return 2 * (at + cols)
    return 2 * at + 1


@njit(cache=True, nogil=True)
def _along(word_of, at, quarter, cols):
    """Return the word of a side, read counter-clockwise round the block."""
    word = np.int64(word_of[_edge_of_block(at, quarter, cols)])
    return word if quarter < 2 else -word


@njit(cache=True, nogil=True)
def _beyond(at, quarter, cols):
    """Return the block on the other side of a side, -1 below the first row."""
    if quarter == 0:
        return at - cols
    if quarter == 1:
        return at + 1
    if quarter == 2:
        return at + cols
    return at - 1
