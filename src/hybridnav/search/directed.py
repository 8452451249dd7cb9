"""Sides of cells that may be crossed in one direction only, and the moves that they forbid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.moves import STEPS
from hybridnav._base.rows import unique_rows
from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, IntArray, LongArray

    Cell = tuple[int, int]


@copies_alike
@dataclass(frozen=True, eq=False)
class DirectedSides:
    """Sides between 4-neighbour cells of a map that may be crossed in one direction only.

    A diagonal is legal if one of the two ways of two straight moves round its middle is. So a path
    may go round the end of a chain of sides, and touch it there, but not through it.
    """

    sides: IntArray
    """int32 (n, 4), `row_from, col_from, row_to, col_to`: may be crossed from the first cell to the
    second and not back. Sorted, each once; a side that is listed both ways is shut."""
    shape: tuple[int, int]
    """Rows and columns of the map."""
    parts: Mapping[str, LongArray]
    """What has which sides, as `door 5` or `line 1`: places in `sides`, int64, ascending."""

    @classmethod
    def of(cls, parts: Iterable[tuple[str, AnyArray]], shape: tuple[int, int]) -> DirectedSides:
        """Join named sides, int (n, 4); those off the map are left out.

        Raises `InvalidValueError` when none of the sides of one lies on the map.
        """
        kept: dict[str, list[IntArray]] = {}
        for name, sides in parts:
            inside = ((sides >= 0) & (sides < [*shape, *shape])).all(axis=1)
            if not inside.any():
                raise InvalidValueError(
                    f"a one-way boundary must lie on the map of {shape[0]} x {shape[1]} cells, "
                    f"and {name} lies beside it: draw it through free space"
                )
            kept.setdefault(name, []).append(sides[inside].astype(np.int32))
        none = np.empty((0, 4), np.int32)
        found = unique_rows(
            np.concatenate([none, *(one for each in kept.values() for one in each)])
        )
        ends = np.cumsum([sum(map(len, each)) for each in kept.values()])[:-1]
        which = np.split(found.number_of, ends) if kept else []
        places = {name: np.unique(one) for name, one in zip(kept, which, strict=True)}
        return cls(frozen(found.rows), shape, places)

    def __or__(self, other: DirectedSides) -> DirectedSides:
        """Return what either forbids."""
        parts = [
            (name, each.sides[places])
            for each in (self, other)
            for name, places in each.parts.items()
        ]
        return DirectedSides.of(parts, self.shape)

    @cached_property
    def forbidden(self) -> tuple[LongArray, ByteArray]:
        """The cells out of which moves are forbidden: int64 (m,), flat, ascending; and the mask of
        these moves, uint8 (m,), bit k for direction k of `hybridnav._base.moves`."""
        # A frame of cells round the map keeps neighbours apart that only follow in flat order.
        width = self.shape[1] + 2
        steps = STEPS @ np.array([width, 1])
        first = (self.sides[:, :2].astype(np.int64) + 1) @ np.array([width, 1])
        last = (self.sides[:, 2:].astype(np.int64) + 1) @ np.array([width, 1])
        order = np.argsort(steps, kind="stable")
        back = order[np.searchsorted(steps[order], first - last)]
        straight = np.unique(last * 8 + back)

        def is_wrong(cells: LongArray, k: LongArray) -> BoolArray:
            return np.isin(cells * 8 + k, straight)

        # A diagonal past an end of such a side begins or ends in one of its two cells.
        cells, k = (
            np.tile(np.concatenate([first, last]), 4),
            np.arange(1, 8, 2).repeat(2 * len(first)),
        )
        keys = np.unique(np.concatenate([cells * 8 + k, (cells + steps[k]) * 8 + (k + 4 & 7)]))
        cells, k = np.divmod(keys, 8)
        by = []
        for one, other in ((k - 1, k + 1 & 7), (k + 1 & 7, k - 1)):
            by.append(is_wrong(cells, one) | is_wrong(cells + steps[one], other))
        ends = np.stack(np.divmod([cells, cells + steps[k]], width), axis=-1)
        inside = ((ends > 0) & (ends <= self.shape)).all(axis=(0, 2))
        keys = np.union1d(straight, keys[by[0] & by[1] & inside])
        found, at = np.unique(keys >> 3, return_inverse=True)
        masks = np.zeros(len(found), np.uint8)
        np.bitwise_or.at(masks, at, np.uint8(1) << (keys & 7).astype(np.uint8))
        flat = (found // width - 1) * self.shape[1] + found % width - 1
        return frozen(flat), frozen(masks)

    @cached_property
    def moves(self) -> ByteArray:
        """uint8 (rows, cols), the mask of the forbidden moves of each cell."""
        moves = np.zeros(self.shape, np.uint8)
        flat, masks = self.forbidden
        moves.ravel()[flat] = masks
        return frozen(moves)

    @cached_property
    def listed(self) -> frozenset[tuple[int, ...]]:
        """The sides as a set of `(row_from, col_from, row_to, col_to)`: there is no way back."""
        return frozenset(map(tuple, self.sides.tolist()))

    def allows(self, cell: Cell, to: Cell, *, between: Collection[Cell]) -> bool:
        """Return whether the way from a cell to one of its neighbours crosses no side the wrong
        way.

        `between`: the free cells at the point where it leads over. A diagonal needs another one of
        them, from which to go on, unless there are none.
        """
        if abs(to[0] - cell[0]) + abs(to[1] - cell[1]) == 1:
            return (*to, *cell) not in self.listed
        k = _DIRECTION[to[0] - cell[0] + 1, to[1] - cell[1] + 1]
        return len(between) == 2 and not self.moves[cell] >> k & 1  # noqa: PLR2004

    def meets(self, cells: LongArray) -> bool:
        """Return whether a path of cells, int64 (n, 2), makes a forbidden move."""
        # Loads numba, which files and words need not.
        from hybridnav.search.kernels.grid_search import makes_any  # noqa: PLC0415

        return bool(makes_any(self.moves, cells))

    def bars(self, cells: LongArray, free: BoolArray) -> bool:
        """Return whether a path of cells, int64 (n, 2), cannot be driven round its corners.

        A move is forbidden, or a diagonal one cannot go by either of the two other cells at its
        corner, of which one at least is free in `free`, bool (rows, cols).
        """
        if self.meets(cells):
            return True
        ends = cells[:-1], cells[1:]
        first, last = (end[(ends[0] != ends[1]).all(axis=1)] for end in ends)
        is_beside = is_open = np.zeros(len(first), bool)
        for row, col in ((first, last), (last, first)):
            corner = np.stack([row[:, 0], col[:, 1]], axis=1)
            is_free = free[tuple(corner.T)]
            is_wrong = self._are_forbidden(first, corner) | self._are_forbidden(corner, last)
            is_beside, is_open = is_beside | is_free, is_open | is_free & ~is_wrong
        return bool((is_beside & ~is_open).any())

    def _are_forbidden(self, cells: LongArray, to: LongArray) -> BoolArray:
        rows, cols = (to - cells).T
        return (self.moves[tuple(cells.T)] >> _DIRECTION[rows + 1, cols + 1] & 1).astype(bool)

    def lost(self, enterable: BoolArray) -> tuple[str, ...]:
        """Return the names of what has no side between two cells that may be entered."""
        ends = self.sides[:, :2], self.sides[:, 2:]
        both = enterable[tuple(ends[0].T)] & enterable[tuple(ends[1].T)]
        return tuple(name for name, places in self.parts.items() if not both[places].any())


_DIRECTION = np.zeros((3, 3), np.uint8)
_DIRECTION[tuple(STEPS.T + 1)] = np.arange(8)
