"""Arrays by their places in memory.

To hand a kernel thirty arrays takes numba four microseconds, and fifty where caches are cold: each
is looked through and gets a record with its owner. One table of their places takes one. The caller
keeps the arrays for as long as the kernel runs. The table has the kind of each array, so that a
kernel that takes one for another raises an error and does not read garbage.
"""

import ctypes
import math
from typing import Any

import numpy as np

from hybridnav._base.jit import overload
from hybridnav._base.typing import LongArray


def kind_of(dtype: Any, n_axes: int) -> int:
    """Return one number, not 0, for the type of the elements of an array and its number of axes."""
    of = np.dtype(dtype)
    return n_axes << 16 | ord(of.kind) << 8 | of.itemsize


def refusal(dtype: Any, n_axes: int) -> str:
    """Return what is wrong with an array that is not of such a kind."""
    return f"a kernel wants an array of {np.dtype(dtype)} with {n_axes} axes and without gaps"


def places_of(*parts: Any) -> LongArray:
    """Return the places of arrays in memory, their lengths and kinds, int64 (n, 4), a whole number
    as it is; `parts`: arrays of one or two axes, numbers, and tuples of these. An array with gaps
    has no kind, as a number has none."""
    rows, left = list[tuple[int, ...]](), list(parts[::-1])
    while left:
        part = left.pop()
        if isinstance(part, tuple):
            left += part[::-1]
        elif isinstance(part, np.ndarray):
            kind = kind_of(part.dtype, part.ndim) if part.flags.c_contiguous else 0
            rows.append((*(part.ctypes.data, *part.shape, 0)[:3], kind))
        else:
            rows.append((part, 0, 0, 0))
    return np.array(rows, np.int64)


def _array(places, k, dtype, n_axes):
    if places[k, 3] != kind_of(dtype, n_axes):
        raise TypeError(refusal(dtype, n_axes))
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

        made = array_at(n_axes, is_fixed, kind_of, refusal)
        return lambda places, k, dtype: made(places, k, dtype)  # noqa: PLW0108 - of these names


_register(fixed, 1, is_fixed=True)
_register(fixed_rows, 2, is_fixed=True)
_register(room, 1, is_fixed=False)
_register(room_rows, 2, is_fixed=False)
