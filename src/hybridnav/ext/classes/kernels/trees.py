"""Kernels of reduced words: vertices of a tree, the Cayley graph of the free group."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.moves import COL_STEP, ROW_STEP


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
