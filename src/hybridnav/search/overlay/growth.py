"""Fields that take cells which were occupied when the overlay was built."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import ndimage

from hybridnav._base.moves import legal_moves
from hybridnav.maps.islands import unique_rows
from hybridnav.search.overlay.kernels import costs as kernels
from hybridnav.search.overlay.layout import (
    CellCosts,
    Levels,
    Numbering,
    Top,
    in_slots,
    lay_out_numbered,
    slots_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._base.typing import BoolArray, IntArray, LongArray

_BLOCK = 16
"""Side in cells of the squares whose new cells become a field."""
_LEAST_CELLS = 64
"""Least number of new cells in a square that become a field; fewer join the nearest one."""
_NEAR = 32
"""Cells round the box in which the nearest field is looked for first."""


class Grown(NamedTuple):
    """An overlay with more cells, all of them closed, and what has to be computed of it."""

    ground: CellCosts
    """The cells, in more fields."""
    levels: Levels
    """Fields and border cells; what is stored of the affected ones is not computed yet."""
    top: Top
    """Empty where the border cells of the last level are others than before."""
    affected: list[IntArray]
    """int32 for each level, the fields with other border cells or cells than before."""


def grow(
    ground: CellCosts, levels: Levels, top: Top, added: BoolArray, box: tuple[slice, slice]
) -> Grown:
    """Add cells to the fields; no cost changes, because they are closed.

    Parameters
    ----------
    ground, levels, top
        See `CellCosts`, `Levels` and `Top`.
    added
        bool, the cells of the box to add; they are in no field yet.
    box
        Its rows and columns.
    """
    shape = (ground.rows, ground.cols)
    slots = slots_of(ground, (slice(0, shape[0]), slice(0, shape[1])))
    field_of = ground.field_of[slots].astype(np.int32)
    numbering, number_of = _numbered(levels, field_of, added, box)
    beside = _beside(shape, box)
    around = numbering.field_of[beside]
    all_moves = legal_moves(np.ascontiguousarray(numbering.field_of.reshape(shape) >= 0), False)
    can_cross = np.zeros(field_of.size, dtype=np.bool_)
    can_cross[levels.cell_of] = True
    can_cross[beside] = all_moves.ravel()[beside] > 0
    cells = np.flatnonzero(can_cross)
    laid, grown = lay_out_numbered(all_moves, ground.units[slots], numbering, cells)
    moves = in_slots(ground.moves[slots], laid.block_at)
    ground = laid._replace(moves=moves, least_units=ground.least_units)
    whole = (0, shape[0], 0, shape[1])
    fields = np.arange(grown.level_at[-1], dtype=np.int32)
    kernels.renew_moves(grown, ground, fields, whole)
    affected = [np.unique(around[around >= 0])]
    for _ in range(len(levels.level_at) - 2):
        affected.append(np.unique(grown.parent[affected[-1]]))
    grown = _copied(grown, levels, number_of, np.concatenate(affected))
    return Grown(ground, grown, _top_of(grown, levels, top), affected)


def _numbered(
    levels: Levels, field_of: IntArray, added: BoolArray, box: tuple[slice, slice]
) -> tuple[Numbering, LongArray]:
    """Number the fields again, those of the added cells among them.

    Return the numbering, and the new number of each old field.
    """
    n_finest, n_fields = int(levels.level_at[1]), int(levels.level_at[-1])
    near = tuple(
        slice(max(side.start - _NEAR, 0), min(side.stop + _NEAR, size))
        for side, size in zip(box, field_of.shape, strict=True)
    )
    if (field_of[near] < 0).all():
        near = slice(0, field_of.shape[0]), slice(0, field_of.shape[1])
    nearest = ndimage.distance_transform_edt(
        field_of[near] < 0, return_distances=False, return_indices=True
    )
    rows, cols = np.nonzero(added)
    rows, cols = rows + box[0].start, cols + box[1].start
    own = field_of[near][tuple(nearest[:, rows - near[0].start, cols - near[1].start])]
    parent = levels.parent[:n_finest]
    squares = np.stack([parent[own], rows // _BLOCK, cols // _BLOCK], axis=1)
    _, first, square, count = unique_rows(squares)
    is_field = count >= _LEAST_CELLS
    number = n_finest + np.cumsum(is_field) - 1
    own = np.where(is_field[square], number[square], own)
    parents = np.concatenate([parent, squares[first[is_field], 0]])
    order = np.argsort(parents, kind="stable")
    rank = np.empty(len(order), dtype=np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    more = int(is_field.sum())
    fields = np.where(field_of >= 0, rank[field_of], -1).astype(np.int32)
    fields[rows, cols] = rank[own]
    number_of = np.concatenate([rank[:n_finest], np.arange(n_finest, n_fields) + more])
    parent = np.concatenate([parents[order], levels.parent[n_finest:]])
    parent = np.where(parent >= 0, parent + more, -1).astype(np.int32)
    level_at = levels.level_at + np.where(levels.level_at > 0, more, 0)
    return Numbering(fields.ravel(), level_at, parent), number_of


def _beside(shape: tuple[int, int], box: tuple[slice, slice]) -> LongArray:
    """Return the flat cells in a box and beside it."""
    rows, cols = (
        np.arange(max(side.start - 1, 0), min(side.stop + 1, size))
        for side, size in zip(box, shape, strict=True)
    )
    flat: LongArray = (rows[:, None] * shape[1] + cols).ravel()
    return flat


def _copied(grown: Levels, levels: Levels, number_of: LongArray, affected: IntArray) -> Levels:
    """Return new levels with what is stored of the fields that are not affected."""
    is_kept = np.ones(len(grown.parent), dtype=np.bool_)
    is_kept[affected] = False
    kept = np.flatnonzero(is_kept[number_of])
    new = number_of[kept]
    for name in ("is_stale", "is_lowered", "is_newer"):
        getattr(grown, name)[new] = getattr(levels, name)[kept]
    sizes = np.zeros(len(grown.parent), dtype=np.int64)
    sizes[new] = np.diff(levels.table_at)[kept]
    table_at = np.concatenate([[0], np.cumsum(sizes)])
    grown = grown._replace(table_at=table_at, table=np.empty(table_at[-1], dtype=np.int32))
    n_finest = int(levels.level_at[1])
    for old_run, new_run in _runs(kept, new):
        for name in ("clique", "marks", "table"):
            _copy_run(grown, levels, name, old_run, new_run)
        low = slice(old_run.start, min(old_run.stop, n_finest))
        if low.start < low.stop:
            moved = slice(new_run.start, new_run.start + low.stop - low.start)
            _copy_run(grown, levels, "steps", low, moved)
    return grown


def _runs(old: LongArray, new: LongArray) -> Iterator[tuple[slice, slice]]:
    """Yield old and new numbers of fields that follow each other in both."""
    breaks = np.flatnonzero((np.diff(old) != 1) | (np.diff(new) != 1)) + 1
    for a, b in zip(np.split(old, breaks), np.split(new, breaks), strict=True):
        if a.size:
            yield slice(int(a[0]), int(a[-1]) + 1), slice(int(b[0]), int(b[-1]) + 1)


def _copy_run(grown: Levels, levels: Levels, name: str, old: slice, new: slice) -> None:
    target, source = getattr(grown, name), getattr(levels, name)
    to, at = getattr(grown, f"{name}_at"), getattr(levels, f"{name}_at")
    target[to[new.start] : to[new.stop]] = source[at[old.start] : at[old.stop]]


def _top_of(grown: Levels, levels: Levels, top: Top) -> Top:
    """Return the distances between gates, if these are still the gates of all moves."""
    moved = len(grown.cell_of) - len(levels.cell_of)
    begin = int(grown.node_at[grown.level_at[-2]])
    cells, before = grown.cell_of[begin:], levels.cell_of[begin - moved :]
    if np.array_equal(cells, before) and len(top.gates):
        starts = np.repeat(np.arange(len(cells)), np.diff(grown.move_at[begin:]))
        ends = grown.move_to[grown.move_at[begin] :] - begin
        if ((top.gate_of[starts] >= 0) | (top.gate_of[ends] >= 0)).all():
            return top._replace(gates=(top.gates + moved).astype(np.int32))
    nothing = np.empty(0, dtype=np.int32)
    return Top(nothing, nothing, nothing, False, nothing)
