"""What a change of costs inside a box of cells makes stale."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import ndimage

from hybridnav.search.moves import legal_moves

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray, IntArray
    from hybridnav.overlay.layout import CellCosts, Levels

    Window = tuple[slice, slice]

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
    field_of = ground.field_of.reshape(shape)
    before = ground.units.reshape(shape)[window]
    in_all = ground.units.reshape(shape)[around].copy()
    in_all[_within(box, around)] = units
    is_open = (field_of[around] >= 0) & (in_all > 0)
    moves = legal_moves(np.ascontiguousarray(is_open), False)[_within(window, around)]
    after = in_all[_within(window, around)]
    is_touched = (before != after) | (ground.moves.reshape(shape)[window] != moves)
    is_lower = np.where(after > 0, after, _CLOSED) < np.where(before > 0, before, _CLOSED)
    near_lower = ndimage.binary_dilation(is_lower, np.ones((3, 3), dtype=np.bool_))
    own = field_of[window]
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
