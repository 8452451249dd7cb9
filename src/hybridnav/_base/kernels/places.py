"""Arrays by their places in memory.

To hand a kernel thirty arrays takes numba four microseconds, and fifty where caches are cold: each
is looked through and gets a record with its owner. One table of their places takes one. The caller
keeps the arrays for as long as the kernel runs.
"""

import ctypes
import math
from typing import Any

import numpy as np

from hybridnav._base.jit import overload
from hybridnav._base.typing import LongArray


def places_of(*parts: Any) -> LongArray:
    """Return the places of arrays in memory and their lengths, int64 (n, 3), a whole number as it
    is; `parts`: arrays of one or two axes without gaps, numbers, and tuples of these."""
    rows, left = list[tuple[int, ...]](), list(parts[::-1])
    while left:
        part = left.pop()
        if isinstance(part, tuple):
            left += part[::-1]
        elif isinstance(part, np.ndarray):
            rows.append((part.ctypes.data, part.shape[0], *part.shape[1:], 0)[:3])
        else:
            rows.append((part, 0, 0))
    return np.array(rows, np.int64)


def _array(places, k, dtype, n_axes):
    shape = tuple(places[k, 1 : 1 + n_axes].tolist())
    size = math.prod(shape) * np.dtype(dtype).itemsize
    return np.ndarray(shape, dtype, (ctypes.c_byte * size).from_address(int(places[k, 0])))


def fixed(places, k, dtype):
    """Return array k of `places`, of one axis, to be read."""
    return _array(places, k, dtype, 1)


def fixed_rows(places, k, dtype):
    """Return array k of `places`, of two axes, to be read."""
    return _array(places, k, dtype, 2)


def room(places, k, dtype):
    """Return array k of `places`, of one axis, which may be changed."""
    return _array(places, k, dtype, 1)


def room_rows(places, k, dtype):
    """Return array k of `places`, of two axes, which may be changed."""
    return _array(places, k, dtype, 2)


def _register(function, n_axes, *, is_fixed):
    @overload(function)
    def _by_numba(places, k, dtype):  # noqa: ARG001 - numba's rule
        from hybridnav._base.compiler import array_at  # noqa: PLC0415 - numba is loaded by now

        made = array_at(n_axes, is_fixed)
        return lambda places, k, dtype: made(places, k, dtype)  # noqa: PLW0108 - of these names


_register(fixed, 1, is_fixed=True)
_register(fixed_rows, 2, is_fixed=True)
_register(room, 1, is_fixed=False)
_register(room_rows, 2, is_fixed=False)
