"""Lines past sides with a direction: whether they obey, exactly, and lines that do."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Protocol

import numpy as np

from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, IntArray, LongArray
from hybridnav.maps import Frame
from hybridnav.maps.geometry import positions_on_grain
from hybridnav.search.directed import DirectedSides
from hybridnav.search.found import ClosedCells, Query

Cell = tuple[int, int]
Span = tuple[int, ...]
"""One or two rows, or columns."""


_UNIT = int(GRAIN)
_PARTS = 8
"""Most parts, doors or lines, that a line is led round before it is pulled taut in halves."""


class Finisher(Protocol):
    """What pulls a path of cells taut."""

    frame: Frame

    @property
    def free(self) -> AnyArray:
        """The cells that it may enter, (rows, cols)."""
        ...

    def closing(self, closed: LongArray) -> Finisher:
        """Return one that does not enter some flat cells either."""
        ...

    def shorten(self, cells: LongArray, start: FloatArray, goal: FloatArray) -> FloatArray:
        """Return an any-angle path along a path of cells, `(x, y)` in metres."""
        ...


def shorten(
    finisher: Finisher,
    closed: ClosedCells | None,
    cells: LongArray,
    ends: Sequence[FloatArray],
) -> FloatArray:
    """Shorten a path of cells to an any-angle path round what is closed.

    `cells`: int64 (n, 2), a legal path of cells; `ends`: `(x, y)` in metres, in the first and in
    the last one. Returns `(x, y)` in metres, float64 (m, 2).
    """
    own = finisher if closed is None else finisher.closing(closed.flat)
    if closed is None or closed.one_way is None:
        return own.shorten(cells, ends[0], ends[1])
    return _pulled(own, closed.one_way, cells, ends)


def _pulled(
    finisher: Finisher, one_way: DirectedSides, cells: LongArray, ends: Sequence[FloatArray]
) -> FloatArray:
    """Pull a path of cells taut where that obeys: round the doors or lines that the string would
    cross the wrong way, else in halves. A path of one or two cells needs no more."""
    (first, last), frame = map(tuple, cells[[0, -1]].tolist()), finisher.frame
    shut = np.empty(0, np.int64)
    for _ in range(_PARTS):
        string = finisher.closing(shut) if len(shut) else finisher
        points = string.shorten(cells, ends[0], ends[1])
        wrong = _wrong_on(finisher, one_way, points, (first, last))
        if wrong is None:
            return points
        beside = _unused(_sides_at(one_way, wrong), cells, one_way.shape[1])
        if np.isin(beside, shut).all():
            break
        shut = np.union1d(shut, beside)
    if len(cells) <= 2:  # noqa: PLR2004 - a diagonal, legal over the corner in its middle
        corner = frame.points_of_grid(cells.max(axis=0).astype(np.float64))
        return np.stack([ends[0], corner, ends[1]])
    half = len(cells) // 2
    (middle,) = frame.points_of(cells[half : half + 1])
    one = _pulled(finisher, one_way, cells[: half + 1], (ends[0], middle))
    two = _pulled(finisher, one_way, cells[half:], (middle, ends[1]))
    return np.concatenate([one, two[1:]])


def _sides_at(one_way: DirectedSides, cell: Cell) -> IntArray:
    apart = np.abs(one_way.sides.reshape(-1, 2, 2) - np.array(cell)).max(axis=2)
    near = np.flatnonzero((apart <= 1).any(axis=1))
    parts = [places for places in one_way.parts.values() if np.isin(near, places).any()]
    return one_way.sides[np.concatenate([near[:0], *parts])]  # none at a mere end of a line


def _unused(sides: IntArray, cells: LongArray, cols: int) -> LongArray:
    """Return the flat cells on both sides of some sides, but those that a path needs open."""
    across = np.array([cols, 1])
    corners = np.concatenate([cells[:-1, :1], cells[1:, 1:], cells[1:, :1], cells[:-1, 1:]], axis=1)
    used = np.concatenate([cells @ across, corners.reshape(-1, 2) @ across])
    flat: LongArray = np.setdiff1d(sides.reshape(-1, 2) @ across, used)
    return flat


def led(closed: ClosedCells | None, cells: LongArray) -> ClosedCells | None:
    """Return what is closed with the cells beside sides with a direction, but those that a path of
    cells passes: who searches near it crosses them as it does, or not at all."""
    if closed is None or closed.one_way is None:
        return closed
    one_way = closed.one_way
    beside = _unused(one_way.sides, cells, one_way.shape[1])
    return replace(closed, flat=np.union1d(closed.flat, beside))


def obeys(finisher: Finisher, query: Query, points: FloatArray) -> bool:
    """Return whether a line, `(x, y)` in metres, crosses no side of a query the wrong way.

    `finisher`: holds the cells that it may enter.
    """
    one_way = query.one_way
    return one_way is None or _wrong_on(finisher, one_way, points, query.cells) is None


def _wrong_on(
    finisher: Finisher, one_way: DirectedSides, points: FloatArray, ends: tuple[Cell, Cell]
) -> Cell | None:
    """Return where a line, `(x, y)` in metres, crosses a side the wrong way; see `wrong_at`."""
    free = finisher.free
    line = on_grain(points, finisher.frame, free.shape)
    for k, cell in zip((0, -1), ends, strict=True):
        line[k] = np.clip(line[k], cell, np.array(cell) + 1)
    return wrong_at(one_way, free, line, ends)


def on_grain(points: FloatArray, frame: Frame, shape: tuple[int, ...]) -> FloatArray:
    """Return the positions of points, (row, col), on the grain of exact tests; those on the rim of
    the map stay there."""
    # A copy: arrays that may not be written would compile the kernel again.
    return positions_on_grain(np.array(points, np.float64), frame.for_kernels, *shape)


# The exact test. A line lies in the closure of one cell, along a side in those of two, at a corner
# in those of four. Which of them the robot may be in follows from where it was: at a point it may
# go over to a free cell beside, over a side in its direction.


def wrong_at(
    one_way: DirectedSides, free: AnyArray, line: FloatArray, ends: tuple[Cell, Cell]
) -> Cell | None:
    """Return a cell at which a line crosses a side the wrong way; None for a line that obeys.

    `free`: (rows, cols), nonzero where a cell may be entered; `line`: float64 (n, 2), positions
    (row, col) in grid units, multiples of 2^-24, in free space; `ends`: the cells of its ends.
    """
    points = np.rint(line * GRAIN).astype(np.int64).tolist()
    inside = {ends[0]}
    for (first, last), is_near in zip(pairwise(points), _near(one_way, line), strict=True):
        if first == last:
            continue
        if not is_near:
            inside = _open(free, *_ahead(last, (last[0] - first[0], last[1] - first[1]), -1))
            continue
        for at, ahead in _runs_of(first, last):
            beside = _open(free, *at)
            # At its start the line has not come through the point.
            between = () if inside == {ends[0]} and first == points[0] else beside
            reached = _spread(one_way, inside, beside, between)
            inside = reached & _open(free, *ahead)
            if not inside:
                return min(reached, default=ends[0])
    reached = _spread(one_way, inside, _open(free, *map(_touched, points[-1])), ())
    return None if ends[1] in reached else ends[1]


def _near(one_way: DirectedSides, line: FloatArray) -> list[bool]:
    """Return which segments of a line come near a side with a direction."""
    low, high = np.minimum(line[:-1], line[1:]), np.maximum(line[:-1], line[1:])
    sides = one_way.sides.reshape(-1, 2, 2)
    first, last = sides.min(axis=1), sides.max(axis=1) + 1
    met = (low[:, None] <= last) & (high[:, None] >= first)
    near: BoolArray = met.all(axis=2).any(axis=1)
    for k in (0, -1):  # an end on a side may be beside its cell
        near[k] |= (line[k] % 1 == 0).any()
    found: list[bool] = near.tolist()
    return found


def _open(free: AnyArray, rows: Span, cols: Span) -> set[Cell]:
    n_rows, n_cols = free.shape
    return {
        (row, col)
        for row in rows
        for col in cols
        if 0 <= row < n_rows and 0 <= col < n_cols and free[row, col]
    }


def _spread(
    one_way: DirectedSides, inside: Iterable[Cell], cells: set[Cell], between: Collection[Cell]
) -> set[Cell]:
    """Return which of the free cells at a point are reached from some of them.

    `between`: these cells where the line leads through the point, none at an end of it.
    """
    reached = set(inside) & cells
    todo = list(reached)
    while todo:
        row, col = todo.pop()
        for to in cells - reached:
            if one_way.allows((row, col), to, between=between):
                reached.add(to)
                todo.append(to)
    return reached


def _touched(at: int) -> Span:
    """Return the rows, or columns, that hold a coordinate."""
    index = at // _UNIT
    return (index,) if at % _UNIT else (index - 1, index)


def _ahead(point: Sequence[int], step: Sequence[int], sign: int = 1) -> tuple[Span, Span]:
    """Return the rows and columns that a segment runs in after a point, or with -1 before it."""
    spans = [
        _touched(at) if not along else ((at if along * sign > 0 else at - 1) // _UNIT,)
        for at, along in zip(point, step, strict=True)
    ]
    return spans[0], spans[1]


def _runs_of(
    first: Sequence[int], last: Sequence[int]
) -> Iterator[tuple[tuple[Span, Span], tuple[Span, Span]]]:
    """Yield the rows and columns at each point where a segment meets a line between cells, its
    first point too, and those in which it runs on from there."""
    step = last[0] - first[0], last[1] - first[1]
    spans = list(_ahead(first, step))
    yield (_touched(first[0]), _touched(first[1])), (spans[0], spans[1])
    signs = [1 if along > 0 else -1 for along in step]
    # The way to the next line, in each direction; the first is met where the lesser share ends.
    gaps = [
        (_UNIT - at % _UNIT) if sign > 0 else ((at - 1) % _UNIT + 1)
        for at, sign in zip(first, signs, strict=True)
    ]
    sizes = [abs(along) for along in step]
    while True:
        meets = [gap < size for gap, size in zip(gaps, sizes, strict=True)]
        if not any(meets):
            return
        apart = gaps[0] * sizes[1] - gaps[1] * sizes[0] if all(meets) else 1 - 2 * meets[0]
        at = list(spans)
        for k, is_met in enumerate((apart <= 0, apart >= 0)):
            if is_met:
                index = (first[k] + signs[k] * gaps[k]) // _UNIT
                at[k], spans[k] = (index - 1, index), (index if signs[k] > 0 else index - 1,)
                gaps[k] += _UNIT
        yield (at[0], at[1]), (spans[0], spans[1])
