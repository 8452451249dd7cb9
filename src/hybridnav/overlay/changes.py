"""What a change of costs inside a box of cells makes stale."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import ndimage

from hybridnav.errors import InvalidValueError
from hybridnav.overlay.layout import slots_of
from hybridnav.search.moves import legal_moves

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray, IntArray
    from hybridnav.overlay.layout import CellCosts, Levels

    Window = tuple[slice, slice]

_SIDES = 4
_CLOSED = 1 << 30
"""Stands for the units of a closed cell when they are compared."""


class Change(NamedTuple):
    """New costs in a window, and the fields of the finest level that they touch."""

    window: Window
    """The box with the cells beside it."""
    units: IntArray
    """int32, the units in the window."""
    moves: ByteArray
    """uint8, the legal moves in the window."""
    touched: IntArray
    """int32 (k,), the fields with another cost or move inside."""
    lowered: IntArray
    """int32 (k,), the fields with a cheaper or a new move inside or at their border."""
    beside: IntArray
    """int32 (k,), the fields with cells in the window."""


def box_within(changed: tuple[int, int, int, int] | None, shape: tuple[int, int]) -> Window:
    """Return the rows and the columns of a box, of the whole map for None.

    Raises
    ------
    InvalidValueError
        When it is no box of four sides inside the map.
    """
    if changed is None:
        return slice(0, shape[0]), slice(0, shape[1])
    sides = tuple(changed) if isinstance(changed, tuple | list) else ()
    fits = len(sides) == _SIDES and all(isinstance(side, int | np.integer) for side in sides)
    if not fits or not (
        0 <= sides[0] <= sides[1] <= shape[0] and 0 <= sides[2] <= sides[3] <= shape[1]
    ):
        raise InvalidValueError(
            f"changed is {changed!r:.80}: give first row, last row + 1, first column, last "
            f"column + 1 inside {shape} cells"
        )
    return slice(int(sides[0]), int(sides[1])), slice(int(sides[2]), int(sides[3]))


def change_in(ground: CellCosts, shape: tuple[int, int], box: Window, units: IntArray) -> Change:
    """Return what changes when the cells in a box get other units.

    Parameters
    ----------
    ground
        See `CellCosts`.
    shape
        Rows and columns of the map.
    box
        Its rows and its columns.
    units
        int32, the new units in the box, 0 for a closed cell.
    """
    window, around = _grown(box, shape, 1), _grown(box, shape, 2)
    slots, slots_around = slots_of(ground, window), slots_of(ground, around)
    before, in_all = ground.units[slots], ground.units[slots_around]
    in_all[_within(box, around)] = units
    is_open = (ground.field_of[slots_around] >= 0) & (in_all > 0)
    moves = legal_moves(np.ascontiguousarray(is_open), False)[_within(window, around)]
    after = in_all[_within(window, around)]
    is_touched = (before != after) | (ground.moves[slots] != moves)
    is_lower = np.where(after > 0, after, _CLOSED) < np.where(before > 0, before, _CLOSED)
    near_lower = ndimage.binary_dilation(is_lower, np.ones((3, 3), dtype=np.bool_))
    own = ground.field_of[slots].astype(np.int32)
    return Change(
        window,
        after,
        moves,
        touched=np.unique(own[is_touched & (own >= 0)]),
        lowered=np.unique(own[near_lower & (own >= 0)]),
        beside=np.unique(own[own >= 0]),
    )


def fields_around(levels: Levels, fields: IntArray) -> list[IntArray]:
    """Return some fields of the finest level, and for each level above the fields around them."""
    around = [fields]
    for _ in range(len(levels.level_at) - 2):
        around.append(np.unique(levels.parent[around[-1]]))
    return around


def _grown(box: Window, shape: tuple[int, int], by: int) -> Window:
    rows, cols = (
        slice(max(side.start - by, 0), min(side.stop + by, size))
        for side, size in zip(box, shape, strict=True)
    )
    return rows, cols


def _within(box: Window, outer: Window) -> Window:
    rows, cols = (
        slice(side.start - other.start, side.stop - other.start)
        for side, other in zip(box, outer, strict=True)
    )
    return rows, cols
