"""Kernels of reduced words: the tree of the free group, and the words of moves between cells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.arrays import grow
from hybridnav._base.moves import COL_STEP, ROW_STEP

# Vertices of a tree: the Cayley graph of the free group.


class Letters(NamedTuple):
    """The numbered words, letter by letter: word n is letters[start[n]:start[n + 1]].

    Both fields are int32.
    """

    start: np.ndarray
    letters: np.ndarray


class Tree(NamedTuple):
    """The reduced words that were met, int32 (room,) each: vertex 0 is the identity.

    `above` is the word without its last `letter`; `child` the first word with one letter more, and
    `sibling` the next such word of the same `above`. `known` begins a list at each word of products
    met before: `known_next` entry, `known_number` of the other factor, `known_product`. `used`,
    int64 (2,), counts words and products. -1 stands for none.
    """

    above: np.ndarray
    letter: np.ndarray
    child: np.ndarray
    sibling: np.ndarray
    known: np.ndarray
    known_next: np.ndarray
    known_number: np.ndarray
    known_product: np.ndarray
    used: np.ndarray

    @classmethod
    def of_room(cls, room: int) -> Tree:
        """Return a tree of the identity alone, with room for some words and products."""
        arrays = [np.empty(room, np.int32) for _ in range(8)]
        tree = cls._make([*arrays, np.zeros(2, np.int64)])
        tree.above[0] = tree.child[0] = tree.sibling[0] = tree.known[0] = -1
        tree.letter[0] = 0
        tree.used[0] = 1
        return tree


@njit(cache=True, nogil=True)
def _times_letter(tree, word, letter):
    """Return the product of a word and a letter; -1 when there is no room."""
    if tree.letter[word] == -letter:
        return tree.above[word]
    child = tree.child[word]
    while child >= 0:
        if tree.letter[child] == letter:
            return child
        child = tree.sibling[child]
    new = tree.used[0]
    if new == tree.above.size:
        return -1
    tree.used[0] += 1
    tree.above[new], tree.letter[new] = word, letter
    tree.child[new] = tree.known[new] = -1
    tree.sibling[new] = tree.child[word]
    tree.child[word] = new
    return new


@njit(cache=True, nogil=True)
def times(tree, letters, word, number):
    """Return the product with a numbered word, or with the inverse of one; -1 when there is no
    room."""
    if number == 0 or word < 0:
        return word
    at = tree.known[word]
    while at >= 0:
        if tree.known_number[at] == number:
            return np.int64(tree.known_product[at])
        at = tree.known_next[at]
    first, end = letters.start[abs(number)], letters.start[abs(number) + 1]
    result = np.int64(word)
    for i in range(end - first):
        letter = letters.letters[first + i] if number > 0 else -letters.letters[end - 1 - i]
        result = np.int64(_times_letter(tree, result, letter))
        if result < 0:
            return np.int64(-1)
    at = tree.used[1]
    if at == tree.above.size:
        return np.int64(-1)
    tree.used[1] += 1
    tree.known_number[at], tree.known_product[at] = number, result
    tree.known_next[at] = tree.known[word]
    tree.known[word] = at
    return result


@njit(cache=True, nogil=True)
def along(of_edge, cell, direction, cols):
    """Return the numbered word of a step to a neighbour by a side; directions 0, 2, 4, 6."""
    if direction == 0:
        return np.int64(of_edge[2 * cell])
    if direction == 2:
        return np.int64(of_edge[2 * cell + 1])
    if direction == 4:
        return -np.int64(of_edge[2 * (cell - 1)])
    return -np.int64(of_edge[2 * (cell - cols) + 1])


@njit(cache=True, nogil=True)
def after(tree, letters, of_edge, word, cell, direction, cols):
    """Return the word after a step; a diagonal goes by the cell in its own row.

    Parameters
    ----------
    tree, letters
        `Tree` and `Letters`.
    of_edge
        See `Plane`.
    word
        Vertex of the tree.
    cell, direction, cols
        Flat cell before the step, its direction, 0 to 7, and the columns of the grid.
    """
    if direction & 1 == 0:
        return times(tree, letters, word, along(of_edge, cell, direction, cols))
    sideways = 0 if COL_STEP[direction] > 0 else 4
    upwards = 2 if ROW_STEP[direction] > 0 else 6
    word = times(tree, letters, word, along(of_edge, cell, sideways, cols))
    beside = cell + COL_STEP[direction]
    return times(tree, letters, word, along(of_edge, beside, upwards, cols))


@njit(cache=True, nogil=True)
def word_at(tree, word):
    """Return the letters of a word of the tree."""
    count = 0
    at = word
    while at > 0:
        count += 1
        at = tree.above[at]
    letters = np.empty(count, np.int64)
    at = word
    for i in range(count - 1, -1, -1):
        letters[i] = tree.letter[at]
        at = tree.above[at]
    return letters


# The words of arcs, carried over to the moves between cells.


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

    # Only full blocks count their removed sides; the others stay at 0 and are never solved.
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

    # A block enters the stack when its count comes down to 1, once at most: all have room.
    while n_ready > 0:
        n_ready -= 1
        at = ready[n_ready]
        # The last edge of a tree may lie between two ready blocks: the first solved it for both.
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
        # A product of at most one word, or of two that cancel, needs no new number.
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
        # Words are those of steps to the higher cell; round a block, north and west sides run back.
        word_of[edge] = word if solved < 2 else -word
        open_edge[edge] = False
        unknown[at] = 0
        # The edge has its word in the block across it too, which may have one side left now.
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
