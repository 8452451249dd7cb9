"""Kernels of arrays: loading them ahead, growing them, and a heap of four branches in them."""

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

from hybridnav._base.jit import njit


def fetch(array, at):
    """Have the processor load an entry of an array into its cache, while other work goes on."""


@intrinsic
def _prefetch(_, array, at):
    def build(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        index = args[1:]
        place = cgutils.get_item_pointer(context, builder, signature.args[0], view, index)
        pointer, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer, number, number, number])
        load = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        # To read, into the nearest cache, data.
        how = [number(value) for value in (0, 3, 1)]
        builder.call(load, [builder.bitcast(place, pointer), *how])
        return context.get_dummy_value()

    return types.void(array, at), build


@overload(fetch)
def _compiled_fetch(array, at):  # noqa: ARG001 - numba's rule
    def compiled(array, at):
        _prefetch(array, at)

    return compiled


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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
