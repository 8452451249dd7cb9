"""Portals: where paths cross from field to field, and exact distances inside the fields.

A portal is one legal move between two fields, the middle one of those whose lower cell lies in one
square of a lattice; fields that meet at a point only have one too. From both its cells the shortest
paths inside their fields are stored, as a direction and a distance for each cell of the field.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.search._costs import DIAGONAL, STRAIGHT
from hybridnav.search._kernels import legal_moves
from hybridnav.topology import _portal_kernels as kernels

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, ByteArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid

    StepArray = NDArray[np.uint16]

STEPS_PER_CELL = kernels.STEPS_PER_CELL
"""Stored distances are rounded to this part of a cell."""

_STEPS = ((0, 1), (1, 1), (1, 0), (1, -1))


@dataclass(frozen=True, eq=False)
class Portals:
    """Portals of a partition of the free cells, and the paths from them inside the fields.

    Every portal has two sides, a cell in each of two fields. Sides are sorted by field: those of
    field f are `side_start[f]` to `side_start[f + 1]`.
    """

    field_of: IntArray
    """int32 (rows * cols,), the field of each cell, -1 where it is not free."""
    place_in_field: IntArray
    """int32 (rows * cols,), position of each cell in its field."""
    field_sizes: LongArray
    """int64 (n_fields,), cells of each field."""
    low_cell: LongArray
    """int64 (n_portals,), flat cell on the side of the field with the lower number."""
    high_cell: LongArray
    """int64 (n_portals,), the neighbour in the other field."""
    cost: LongArray
    """int64 (n_portals,), integer cost of the move across."""
    side_start: LongArray
    side_portal: LongArray
    """int64 (2 n_portals,), the portal of each side."""
    side_is_high: ByteArray
    """uint8 (2 n_portals,), 1 for the side of `high_cell`."""
    offset: LongArray
    """int64 (2 n_portals + 1,), where a side's entries of `steps` and `towards` begin."""
    steps: StepArray
    """uint16, distance inside the field from each of its cells to the side's cell, rounded."""
    towards: ByteArray
    """uint8, first direction of that path, 8 at the side's own cell, 9 where there is none."""
    between: IntArray
    """int32, exact integer costs between the sides of each field, row by row."""
    between_start: LongArray
    """int64 (2 n_portals + 1,), where a side's row of `between` begins."""

    @property
    def n_portals(self) -> int:
        """Portals."""
        return len(self.cost)

    @property
    def n_fields(self) -> int:
        """Fields."""
        return len(self.field_sizes)


def build_portals(
    grid: OccupancyGrid,
    field_of: IntArray,
    *,
    spacing_cells: int = 8,
    allow_unexplored: bool = False,
) -> Portals:
    """Place portals along all borders of a partition and compute the paths inside its fields.

    Parameters
    ----------
    grid
        The map; its free cells are planned on.
    field_of
        int32 (rows, cols), the field of each free cell, such as `Level.field_of`.
    allow_unexplored
        Whether unexplored cells are entered too.
    spacing_cells
        Side of the lattice squares: portals of a border lie about this far apart.

    Returns
    -------
    Portals
        Time and memory grow with the sum, over the fields, of cells times sides.

    Raises
    ------
    InvalidValueError
        When the spacing is not positive, or a cell that may be entered is in no field.
    """
    if spacing_cells < 1:
        raise InvalidValueError(f"portals need a spacing of at least one cell, got {spacing_cells}")
    free = grid.enterable(allow_unexplored=allow_unexplored)
    if field_of.shape != grid.shape or (field_of[free] < 0).any():
        raise InvalidValueError("every cell that may be entered must be in a field")
    cols = grid.shape[1]
    label = np.full(free.size, -1, dtype=np.int32)
    label[free.ravel()] = np.unique(field_of[free], return_inverse=True)[1]
    sizes = np.bincount(label[label >= 0]).astype(np.int64)
    place = _places(label, sizes)
    moves = legal_moves(np.ascontiguousarray(free), grid.corner_cutting).ravel()
    low, high, diagonal = _crossings(moves, label, cols)
    square = low // cols // spacing_cells * cols + low % cols // spacing_cells
    keys = np.stack([label[low], label[high], square], axis=1)
    chosen = _middles(keys, np.stack([low // cols, low % cols]), diagonal)
    low, high = low[chosen], high[chosen]
    cost = np.where(diagonal[chosen], DIAGONAL, STRAIGHT).astype(np.int64)
    cells = np.concatenate([low, high])
    order = np.argsort(label[cells], kind="stable")
    cells = cells[order].astype(np.int32)
    side_field = label[cells]
    offset = np.concatenate([[0], np.cumsum(sizes[side_field])]).astype(np.int64)
    steps = np.empty(offset[-1], dtype=np.uint16)
    towards = np.empty(offset[-1], dtype=np.uint8)
    begin, between = kernels.fill_sides(
        moves, cols, label, place, sizes, side_field, cells, offset, steps, towards
    )
    return Portals(
        field_of=label,
        place_in_field=place,
        field_sizes=sizes,
        low_cell=low,
        high_cell=high,
        cost=cost,
        side_start=np.searchsorted(side_field, np.arange(len(sizes) + 1)).astype(np.int64),
        side_portal=(order % max(len(low), 1)).astype(np.int64),
        side_is_high=(order >= len(low)).astype(np.uint8),
        offset=offset,
        steps=steps,
        towards=towards,
        between=between,
        between_start=begin,
    )


def _places(label: IntArray, sizes: LongArray) -> IntArray:
    """Position of each cell in its field, in the order of cells."""
    cells = np.flatnonzero(label >= 0)
    order = cells[np.argsort(label[cells], kind="stable")]
    start = np.concatenate([[0], np.cumsum(sizes)])
    place = np.zeros(label.size, dtype=np.int32)
    place[order] = np.arange(len(order)) - start[label[order]]
    return place


def _crossings(
    moves: ByteArray, label: IntArray, cols: int
) -> tuple[LongArray, LongArray, BoolArray]:
    """All legal moves between two fields: cell in the lower one, in the higher, if diagonal."""
    found = []
    for direction, (down, right) in enumerate(_STEPS):
        tail = np.flatnonzero(moves >> direction & 1)
        head = tail + down * cols + right
        apart = label[tail] != label[head]
        diagonal = np.full(int(apart.sum()), direction & 1 == 1)
        found.append((tail[apart], head[apart], diagonal))
    tail, head, diagonal = (np.concatenate(part) for part in zip(*found, strict=True))
    turned = label[tail] > label[head]
    return np.where(turned, head, tail), np.where(turned, tail, head), diagonal


def _middles(keys: LongArray, position: LongArray, diagonal: BoolArray) -> LongArray:
    """Of the moves of equal keys the one nearest their middle; a diagonal counts as a cell off."""
    if not len(keys):
        return np.empty(0, dtype=np.int64)
    group = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    count = np.bincount(group)
    row, col = (axis - (np.bincount(group, axis) / count)[group] for axis in position)
    order = np.lexsort((np.hypot(row, col) + diagonal, group))
    middles: LongArray = order[np.searchsorted(group[order], np.arange(len(count)))]
    return middles
