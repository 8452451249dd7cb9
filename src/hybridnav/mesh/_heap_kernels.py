"""Kernels of a binary heap of keys and values."""

from __future__ import annotations

from hybridnav._jit import njit


@njit(cache=True, nogil=True)
def push(heap, size, key, value):
    """Put an entry into a binary heap; return the new size."""
    keys, values = heap
    at = size
    while at > 0:
        above = (at - 1) >> 1
        if keys[above] <= key:
            break
        keys[at], values[at] = keys[above], values[above]
        at = above
    keys[at], values[at] = key, value
    return size + 1


@njit(cache=True, nogil=True)
def pop(heap, size):
    """Take the least entry out of a binary heap; return the new size."""
    keys, values = heap
    size -= 1
    key, value = keys[size], values[size]
    at = 0
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        if below + 1 < size and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[at], values[at] = keys[below], values[below]
        at = below
    keys[at], values[at] = key, value
    return size
