"""Kernels of arrays: growing them, and a heap of four branches in them."""

import numpy as np

from hybridnav._base.jit import njit


@njit(cache=True, nogil=True, _nrt=False)
def push(heap, size, key, value):
    """Put an entry into a heap of `size`, which then has one more; it has room for that."""
    at = size
    while at > 0:
        above = at - 1 >> 2
        if heap[above, 0] <= key:
            break
        heap[at, 0], heap[at, 1] = heap[above, 0], heap[above, 1]
        at = above
    heap[at, 0], heap[at, 1] = key, value


@njit(cache=True, nogil=True, _nrt=False)
def pop(heap, size):
    """Take the entry with the least key out of a heap of `size`, which then has one fewer."""
    found = heap[0, 1]
    size -= 1
    key, value = heap[size, 0], heap[size, 1]
    at, below = 0, 1
    while below < size:
        least, least_key = below, heap[below, 0]
        for other in range(below + 1, min(below + 4, size)):
            if heap[other, 0] < least_key:
                least, least_key = other, heap[other, 0]
        if key <= least_key:
            break
        heap[at, 0], heap[at, 1] = least_key, heap[least, 1]
        at, below = least, 4 * least + 1
    heap[at, 0], heap[at, 1] = key, value
    return found


@njit(cache=True, nogil=True, _nrt=False)
def find(root, i):
    """Return the representative of i in a union-find forest, halving the path."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


@njit(cache=True, nogil=True)
def total(values):
    """Return the sum of an array of one axis, as a float.

    numba's own `sum`, `mean`, `max` and `all` load scipy's linear algebra with a kernel: a third of
    a second of the first plan.
    """
    found = 0.0
    for value in values:
        found += value
    return found


@njit(cache=True, nogil=True)
def grow(array):
    """Return a copy of an array with twice the room."""
    larger = np.empty(2 * array.size, array.dtype)
    larger[: array.size] = array
    return larger


@njit(cache=True, nogil=True)
def grow_rows(rows):
    """Return a copy of an array of rows with room for twice as many."""
    larger = np.empty((2 * len(rows), rows.shape[1]), rows.dtype)
    larger[: len(rows)] = rows
    return larger
