"""Distinct rows of an array, what pairs of numbers join, and numbers in runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from hybridnav._base.typing import AnyArray, LongArray


class UniqueRows(NamedTuple):
    """The distinct rows of an array."""

    rows: AnyArray
    """(m, k), ascending by the first column, then by the next ones."""
    first: LongArray
    """int64 (m,), where each stands first."""
    number_of: LongArray
    """int64 (n,), the number of each given row among the distinct ones."""
    n_times: LongArray
    """int64 (m,), how often each is given."""


def unique_rows(rows: AnyArray) -> UniqueRows:
    """Return the distinct rows of an array.

    `numpy.unique` with an axis would do, but it compares records: an interrupt there ends as a
    TypeError, and nothing tells that it was one.

    `rows`: shape (n, k), k >= 1.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    is_new = np.ones(len(rows), np.bool_)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    begin = np.flatnonzero(is_new)
    number_of = np.empty(len(rows), np.int64)
    number_of[order] = np.cumsum(is_new) - 1
    n_times = np.diff(begin, append=len(rows))
    return UniqueRows(ordered[begin], order[begin], number_of, n_times)


def connected_parts(pairs: AnyArray, count: int) -> LongArray:
    """Return the connected part of each of some things, int64 (count,), numbered from 0.

    `pairs`: whole numbers (n, 2), which of them are joined; `count`: how many there are.
    """
    # Loads scipy, which most callers of this module can do without.
    from scipy.sparse import coo_array  # noqa: PLC0415
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    graph = coo_array((np.ones(len(pairs), np.int8), tuple(pairs.T)), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def in_runs(start: LongArray, length: LongArray) -> LongArray:
    """Return the numbers in runs, one run after the other.

    `start`: int64 (n,), the first number of each run; `length`: int64 (n,), >= 0. Returns int64, as
    many numbers as the runs have in all.
    """
    end = np.cumsum(length)
    numbers: LongArray = np.repeat(start - end + length, length)
    numbers += np.arange(len(numbers))
    return numbers
