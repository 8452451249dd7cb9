"""The fewest closures to open for a path."""

import heapq
from collections import defaultdict
from collections.abc import Iterable
from itertools import count
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hybridnav._base.rows import connected_parts, unique_rows
from hybridnav._base.typing import BoolArray, LongArray

Name = TypeVar("Name")
_MOST_REPEATED = 10
"""Closures that bar several passages and are followed one by one; of more, each passage counts."""
_NONE: frozenset[int] = frozenset()


class OpenGround(NamedTuple):
    """Where a robot may go if nothing is closed."""

    enterable: BoolArray
    """(rows, cols), the cells."""
    diagonal: bool
    """Whether cells are neighbours at their corners too."""


def fewest_to_open(
    ground: OpenGround, closures: dict[Name, LongArray], cells: tuple[tuple[int, int], ...]
) -> tuple[Name, ...]:
    """Find the fewest closures that have to open for a path between two open cells.

    Cells with open moves between them, closed by the same closures, form regions. A path over
    regions opens what closes them and the moves between them, once each; the fewest by Dijkstra's
    algorithm. Its states are a region, and which of the closures that bar more than one passage are
    open: no other is met twice.

    `ground`: where a robot may go; `closures`: what each closes: flat cells, int64 (n,), or moves
    between two, int64 (n, 2); `cells`: start and goal, (row, col), open. Returns names of closures,
    in the order given; none if no opening makes a path.
    """
    names = list(closures)
    regions = _Regions(ground, list(closures.values()))
    start, goal = (regions.at(row * ground.enterable.shape[1] + col) for row, col in cells)
    order = count()
    queue: list[Any] = [(0, next(order), start, _NONE, _NONE)]
    known: dict[int, list[tuple[int, frozenset[int]]]] = defaultdict(list)
    while queue:
        cost, _, region, opened, kept = heapq.heappop(queue)
        if region == goal:
            return tuple(names[one] for one in sorted(opened))
        if any(cheap <= cost and kept <= has for cheap, has in known[region]):
            continue
        known[region].append((cost, kept))
        here = regions.closed_by[region] | kept
        for near, barred in regions.beside[region]:
            new = (regions.closed_by[near] | barred) - here
            state = near, opened | new, kept | (new & regions.repeated)
            heapq.heappush(queue, (cost + len(new), next(order), *state))
    return ()


class _Regions:
    """Regions of cells that the same closures close, or none, and the moves between them."""

    closed_by: dict[int, frozenset[int]]
    """The closures of each region; none of a region that is missing."""
    beside: dict[int, set[tuple[int, frozenset[int]]]]
    """The regions beside each, with what closes the moves to them."""
    repeated: frozenset[int]
    """The closures of several passages; none if they are many."""

    def __init__(self, ground: OpenGround, closures: list[LongArray]) -> None:
        from scipy import ndimage  # noqa: PLC0415 - half a second that plans do not need

        shape, free = ground.enterable.shape, ground.enterable.ravel()
        # Cells that are closed or beside a closed move are looked at one by one, others as sets.
        cells = np.unique(np.concatenate([one.ravel() for one in closures]))
        self._special = cells = cells[free[cells]]
        rest = ground.enterable.copy()
        rest.ravel()[cells] = False
        labels, n_sets = ndimage.label(rest, np.ones((3, 3)) if ground.diagonal else None)
        labels = self._labels = labels.ravel()
        cell_sets = _Sets((k, one[:, None]) for k, one in enumerate(closures) if one.ndim == 1)
        move_sets = _Sets(
            (k, np.sort(one, axis=1)) for k, one in enumerate(closures) if one.ndim > 1
        )
        inner, outer = _neighbours(cells, shape, diagonal=ground.diagonal)
        outer = outer[labels[outer[:, 1]] > 0]
        key = cell_sets.of(cells[:, None])
        barred = move_sets.of(np.sort(cells[inner], axis=1))
        # The nodes of a small graph: sets from 0, then cells.
        moves = np.concatenate(
            [inner + n_sets, np.stack([outer[:, 0] + n_sets, labels[outer[:, 1]] - 1], axis=1)]
        )
        barred = np.concatenate([barred, np.zeros(len(outer), np.int64)])
        keys = np.concatenate([np.zeros(n_sets, np.int64), key])
        is_open = (barred == 0) & (keys[moves[:, 0]] == keys[moves[:, 1]])
        self._region_of = connected_parts(moves[is_open], len(keys))
        self._n_sets = n_sets
        closed = np.flatnonzero(keys)
        pairs = zip(self._region_of[closed].tolist(), keys[closed].tolist(), strict=True)
        self.closed_by = defaultdict(lambda: _NONE, {k: cell_sets.sets[one] for k, one in pairs})
        rows = np.column_stack([self._region_of[moves[~is_open]], barred[~is_open]])
        self.beside = defaultdict(set)
        passages: dict[int, set[Any]] = defaultdict(set)
        for one, other, bar in unique_rows(rows).rows.tolist():
            by = move_sets.sets[bar]
            self.beside[one].add((other, by))
            self.beside[other].add((one, by))
            for closure in by:
                passages[closure].add((min(one, other), max(one, other)))
        for region, by in self.closed_by.items():
            for closure in by:
                passages[closure].add(region)
        often = frozenset(one for one, some in passages.items() if len(some) > 1)
        self.repeated = often if len(often) <= _MOST_REPEATED else _NONE

    def at(self, flat: int) -> int:
        node = int(self._labels[flat]) - 1
        if node < 0:
            node = self._n_sets + int(np.searchsorted(self._special, flat))
        return int(self._region_of[node])


class _Sets:
    """Which closures hold a row of numbers: a cell, or a move between two."""

    def __init__(self, closures: Iterable[tuple[int, LongArray]]) -> None:
        self.sets: list[frozenset[int]] = [_NONE]
        given = list(closures)
        if not given:
            return
        sets_of = unique_rows(np.concatenate([rows for _, rows in given]))
        by = np.concatenate([np.full(len(rows), k) for k, rows in given])
        order = np.lexsort([by, sets_of.number_of])
        parts = np.split(by[order], np.cumsum(sets_of.n_times)[:-1])
        numbers: dict[frozenset[int], int] = {_NONE: 0}
        self._number = np.array(
            [numbers.setdefault(frozenset(part.tolist()), len(numbers)) for part in parts]
        )
        self._rows, self.sets = sets_of.rows, list(numbers)

    def of(self, rows: LongArray) -> LongArray:
        """Return the number of the set that holds each row, 0 for none."""
        if len(self.sets) == 1 or not len(rows):
            return np.zeros(len(rows), np.int64)
        at = unique_rows(np.concatenate([self._rows, rows]))
        number = np.zeros(len(at.rows), np.int64)
        number[at.number_of[: len(self._rows)]] = self._number
        return number[at.number_of[len(self._rows) :]]


def _neighbours(
    cells: LongArray, shape: tuple[int, int], *, diagonal: bool
) -> tuple[LongArray, LongArray]:
    """Return the pairs of neighbours among sorted flat cells, as their places in the array.

    Return also the pairs of one of them, by its place, and a neighbour on the map, by its flat
    cell.
    """
    rows, cols = np.divmod(cells, shape[1])
    inner, outer = [], []
    for down in (-1, 0, 1):
        for across in (-1, 0, 1):
            if not (down or across) or (down and across and not diagonal):
                continue
            row, col = rows + down, cols + across
            at = np.flatnonzero((row >= 0) & (row < shape[0]) & (col >= 0) & (col < shape[1]))
            near = row[at] * shape[1] + col[at]
            place = np.minimum(np.searchsorted(cells, near), len(cells) - 1)
            is_own = cells[place] == near
            inner.append(np.stack([at[is_own], place[is_own]], axis=1))
            outer.append(np.stack([at[~is_own], near[~is_own]], axis=1))
    return np.concatenate(inner), np.concatenate(outer)
