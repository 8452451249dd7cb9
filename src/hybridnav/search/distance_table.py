"""Tables of exact distances between many ends, by labels in a hierarchy or searches of cells."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

import numpy as np

from hybridnav._base.moves import FAR, STRAIGHT, length_in_cells
from hybridnav._base.threads import SHARES, cores
from hybridnav._base.typing import ByteArray, FloatArray, IntArray, LongArray
from hybridnav.maps.costs import UNIT_BITS
from hybridnav.search.kernels.labels import costs_to_cells, meet

Labels = tuple[LongArray, IntArray, LongArray]
"""Offsets of ends, corners, costs."""
Ends = tuple[LongArray, FloatArray]
"""int64 (n, 2) free cells, and float64 (n, 2) points in them, (row, col) in grid units."""


BLOCK = 1024
"""Ends whose labels are held at a time."""
ROOM = 4096


class LabelSource(Protocol):
    """What makes labels of ends as `placed` returns them, on one kind of hierarchy."""

    n_corners: int
    most: int
    """Starts whose labels are held at a time."""

    def placed(self, ends: Ends) -> Any:
        """Return ends where they lie, which is found once."""

    def labels(self, ends: Any) -> Labels:
        """Return the labels of starts."""

    def goal_labels(self, ends: Any) -> Labels:
        """Return the labels of goals."""

    def direct(self, starts: Any, goals: Any, table: LongArray) -> None:
        """Set the entries of a table whose path passes no corner."""

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs as lengths in cells, infinite for `FAR`."""


def climbing_room(n_corners: int) -> tuple[LongArray, LongArray]:
    """Return the work of `climb`."""
    return np.full((n_corners, 2), FAR, np.int64), np.empty((ROOM, 2), np.int64)


def by_number(numbers: IntArray, count: int) -> tuple[LongArray, LongArray]:
    """Return where the entries of each number begin, and their order."""
    begin = np.zeros(count + 1, np.int64)
    np.cumsum(np.bincount(numbers, minlength=count), out=begin[1:])
    return begin, np.argsort(numbers, kind="stable")


def distance_blocks(
    source: LabelSource, starts: Ends, goals: Ends
) -> Iterator[tuple[slice, slice, FloatArray]]:
    """Yield the lengths of shortest paths between ends, in cells, block by block.

    Labels of a block of goals are sorted into buckets by corner, and looked up for each start, on
    all cores. Memory is that of two blocks of labels and the blocks of the table at work.

    `source`: makes labels; `starts`, `goals`: the ends; their cells are free. Yields the rows and
    columns of a block, and float64 lengths, infinite without a path.
    """
    with ThreadPoolExecutor(cores()) as pool:
        for first in range(0, len(goals[0]), BLOCK):
            columns = slice(first, min(first + BLOCK, len(goals[0])))
            yield from _rows_of(source, starts, goals, columns, pool)


def _rows_of(
    source: LabelSource, starts: Ends, goals: Ends, columns: slice, pool: ThreadPoolExecutor
) -> Iterator[tuple[slice, slice, FloatArray]]:
    def labels_of(part: slice) -> Labels:
        return source.goal_labels(source.placed((goals[0][part], goals[1][part])))

    parts = _parts(columns, BLOCK)
    offsets, corners, costs = zip(*pool.map(labels_of, parts), strict=True)
    n_goals, corner = columns.stop - columns.start, np.concatenate(corners)
    sizes = np.concatenate([np.diff(one) for one in offsets])
    begin, order = by_number(corner, source.n_corners)
    which = np.repeat(np.arange(n_goals, dtype=np.int32), sizes)[order]
    buckets = begin, which, np.concatenate(costs)[order]
    block = source.placed((goals[0][columns], goals[1][columns]))

    def fill(rows: slice) -> FloatArray:
        some = source.placed((starts[0][rows], starts[1][rows]))
        table = np.full((rows.stop - rows.start, n_goals), FAR, np.int64)
        source.direct(some, block, table)
        meet(source.labels(some), buckets, table)
        return source.lengths(table)

    rows, at_once = _parts(slice(0, len(starts[0])), source.most), SHARES * cores()
    for first in range(0, len(rows), at_once):  # no more blocks wait for who reads them
        some = rows[first : first + at_once]
        for part, lengths in zip(some, pool.map(fill, some), strict=True):
            yield part, columns, lengths


def _parts(whole: slice, most: int) -> list[slice]:
    count = whole.stop - whole.start
    size = max(1, min(most, -(-count // (SHARES * cores()))))
    return [slice(at, min(at + size, whole.stop)) for at in range(whole.start, whole.stop, size)]


# Tables of costs of cells.


class GridLabels:
    """Least costs of cells from each start to all goals, by Dijkstra's algorithm; no labels.

    `moves`: uint8 (rows, cols), the legal moves of each cell; `units`: int32 (rows, cols), the
    factor of each cell in units; None for 1.
    """

    n_corners, most = 1, 16

    def __init__(self, moves: ByteArray, units: IntArray | None) -> None:
        one = np.broadcast_to(np.int32(1 << UNIT_BITS), moves.shape)
        factors = np.ascontiguousarray(one if units is None else units).ravel()
        self._grid, self._is_plain = (moves.ravel(), factors, moves.shape[1]), units is None

    def placed(self, ends: Ends) -> LongArray:
        """Return flat cells."""
        return ends[0] @ np.array([self._grid[2], 1])

    def labels(self, ends: LongArray) -> Labels:
        """Return labels without entries."""
        return np.zeros(len(ends) + 1, np.int64), np.empty(0, np.int32), np.empty(0, np.int64)

    goal_labels = labels

    def direct(self, starts: LongArray, goals: LongArray, table: LongArray) -> None:
        """Set all entries."""
        size = self._grid[0].size
        is_goal, best = np.zeros(size, np.bool_), np.empty(size, np.int64)
        is_goal[goals] = True
        count = int(np.count_nonzero(is_goal))
        for row, start in zip(table, starts.tolist(), strict=True):
            costs_to_cells(self._grid, start, is_goal, count, best)
            row[:] = best[goals]

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs in cells, infinite for `FAR`: lengths exact, others within 1e-10."""
        found, reached = np.full(table.shape, np.inf), table < FAR
        unit, cost = 2 << UNIT_BITS, table[reached]
        found[reached] = (
            length_in_cells(cost // unit) if self._is_plain else cost / (unit * STRAIGHT)
        )
        return found
