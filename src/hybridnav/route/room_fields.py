"""Distances inside the fields of the room level, by length or by costs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.kernels.moves import field_distances
from hybridnav._base.moves import DIAGONAL, STRAIGHT
from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
from hybridnav.maps import CellClass
from hybridnav.rooms import Rooms

if TYPE_CHECKING:
    from scipy.sparse import csr_array


class RoomFields:
    """The fields of the room level.

    `closed`: int64 (m,), flat cells that may not be entered; None for none; `units`: int64 (rows,
    cols), the factor of each cell in units; None for lengths.
    """

    def __init__(
        self, rooms: Rooms, closed: LongArray | None, units: LongArray | None = None
    ) -> None:
        from scipy import ndimage  # noqa: PLC0415 - most planners need no rooms

        self._field_of = rooms.level.field_of
        self._classes = rooms.grid.classes
        self._closed, self._units = closed, units
        self._windows = ndimage.find_objects(self._field_of + 1)

    def vertices_of(self, cells: LongArray) -> LongArray:
        """Return the vertex of each flat cell, -1 for none."""
        return self._field_of.ravel()[cells].astype(np.int64)

    def window(self, vertex: int) -> FieldWindow:
        """Return the part of the map that a field spans."""
        spans = self._windows[vertex]
        corner = spans[0].start, spans[1].start
        classes = np.array(self._classes[spans], dtype=np.uint8)
        label = np.where(self._field_of[spans] == vertex, np.int32(0), np.int32(-1))
        if self._closed is not None:
            rows, cols = np.divmod(self._closed, self._field_of.shape[1])
            rows, cols = rows - corner[0], cols - corner[1]
            met = (rows >= 0) & (rows < label.shape[0]) & (cols >= 0) & (cols < label.shape[1])
            classes[rows[met], cols[met]] = 0
            label[rows[met], cols[met]] = -1
        moves = None
        if self._units is not None:
            moves = _weighted_moves(classes, np.asarray(label == 0), self._units[spans])
        return FieldWindow(corner, self._field_of.shape[1], classes, label, moves)


class FieldWindow(NamedTuple):
    """The part of the map that a field spans."""

    corner: tuple[int, int]
    """Its lowest cell, (row, col)."""
    cols: int
    """Columns of the map."""
    classes: ByteArray
    """uint8 (rows, cols), the class of each cell, 0 if closed."""
    label: IntArray
    """int32 (rows, cols), 0 in the field and -1 elsewhere."""
    moves: csr_array[np.float64, tuple[int, int]] | None = None
    """The moves inside the field with their costs, whole numbers; None for lengths."""

    def costs(self, cell: int, others: LongArray) -> LongArray:
        """Return the integer costs of the shortest paths inside the field from a flat cell of it to
        others, -1 for no path."""
        rows, cols = np.divmod(np.append(cell, others), self.cols)
        rows, cols = rows - self.corner[0], cols - self.corner[1]
        inside = (rows >= 0) & (rows < self.label.shape[0]) & (cols >= 0)
        inside &= cols < self.label.shape[1]
        at = np.where(inside, rows * self.label.shape[1] + cols, 0)
        if self.moves is None:
            known = field_distances(self.classes, self.label.ravel(), at[:1])
        else:
            from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415 - most planners need no rooms

            reached = dijkstra(self.moves, directed=False, indices=at[:1])[0]
            known = np.where(np.isfinite(reached), reached, -1.0).astype(np.int64)
        return np.where(inside, known[at], -1)[1:]


def _weighted_moves(
    classes: ByteArray, inside: BoolArray, units: LongArray
) -> csr_array[np.float64, tuple[int, int]]:
    """Return the legal moves inside a field, each in one direction, with their costs.

    A move costs its length, STRAIGHT or DIAGONAL, times the sum of the units of its two cells.
    Diagonals are judged as in `field_distances`.
    """
    from scipy.sparse import coo_array  # noqa: PLC0415 - most planners need no rooms

    rows, cols = inside.shape
    number = np.arange(rows * cols).reshape(rows, cols)
    is_free_field = bool((classes[inside] == CellClass.FREE).all())
    may_pass = classes == CellClass.FREE if is_free_field else classes != CellClass.OCCUPIED
    every, low, high = slice(None), slice(None, -1), slice(1, None)
    parts = []
    for tail, head, sides, length in (
        ((every, low), (every, high), (), STRAIGHT),
        ((low, every), (high, every), (), STRAIGHT),
        ((low, low), (high, high), ((low, high), (high, low)), DIAGONAL),
        ((high, low), (low, high), ((high, high), (low, low)), DIAGONAL),
    ):
        legal = inside[tail] & inside[head]
        for side in sides:
            legal &= may_pass[side]
        costs = length * (units[tail] + units[head]).astype(np.float64)
        parts.append((number[tail][legal], number[head][legal], costs[legal]))
    tails, heads, costs = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return coo_array((costs, (tails, heads)), shape=(rows * cols, rows * cols)).tocsr()
