"""Arrays that kernels take by their places in memory, compiled and as plain Python."""

import numpy as np
import pytest

from hybridnav._base.jit import njit
from hybridnav._base.kernels.places import fixed, fixed_rows, places_of, room, room_rows


@njit()
def _read_and_write(places):
    flags, table = fixed(places, 0, np.bool_), fixed_rows(places, 1, np.int32)
    values, rows = room(places, 2, np.float64), room_rows(places, 4, np.int64)
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            rows[i, j] = table[i, j] * places[3, 0]
    for i in range(flags.size):
        values[i] += 0.5 if flags[i] else -1.0
    return flags.size, table.shape, values.size, rows.shape


@pytest.mark.parametrize("kernel", [_read_and_write, getattr(_read_and_write, "py_func", None)])
@pytest.mark.parametrize("shape", [(0, 3), (1, 1), (5, 2), (3, 7)])
def test_a_kernel_reads_and_writes_arrays_by_their_places(kernel, shape) -> None:
    table = np.arange(shape[0] * shape[1], dtype=np.int32).reshape(shape) - 4
    flags, values = np.arange(shape[0]) % 3 == 0, np.arange(shape[0] + 2.0)
    rows, before = np.full(shape, -1, np.int64), values.copy()
    given = places_of(flags, (table, (values, 7)), rows)
    assert given.shape == (5, 4)
    assert given[3].tolist() == [7, 0, 0, 0]
    assert kernel(given) == (shape[0], shape, shape[0] + 2, shape)
    assert np.array_equal(rows, table * 7)
    assert np.array_equal(values[: shape[0]] - before[: shape[0]], np.where(flags, 0.5, -1.0))
    assert np.array_equal(values[shape[0] :], before[shape[0] :])


def test_a_kernel_takes_a_fixed_array_as_read_only() -> None:
    """So that one compiled form of what it calls serves arrays that Python froze, too."""

    @njit()
    def write(places):
        fixed(places, 0, np.int32)[0] = 1

    if hasattr(write, "py_func"):
        with pytest.raises(Exception, match="readonly"):
            write(places_of(np.zeros(2, np.int32)))


@pytest.mark.parametrize("is_compiled", [True, False])
@pytest.mark.parametrize(
    "given",
    [
        np.zeros(3, np.int64),
        np.zeros(3, np.float32),
        np.zeros(3, np.uint32),
        np.zeros((3, 1), np.int32),
        np.zeros(6, np.int32)[::2],
        7,
    ],
)
def test_an_array_of_another_kind_is_refused(given, is_compiled) -> None:
    @njit()
    def read(places):
        return fixed(places, 0, np.int32)[0]

    kernel = read if is_compiled else getattr(read, "py_func", read)
    assert kernel(places_of(np.array([5], np.int32))) == 5
    with pytest.raises(TypeError, match="array of int32 with 1 axes and without gaps"):
        kernel(places_of(given))
