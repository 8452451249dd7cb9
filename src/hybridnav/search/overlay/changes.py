"""What a change of costs inside a box of cells makes stale."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from scipy import ndimage

from hybridnav._base.moves import legal_moves
from hybridnav._base.progress import Progress, no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.maps.costs.factors import MOST_FACTOR, UNIT_BITS
from hybridnav.search.overlay.kernels import gates as _gate_kernels
from hybridnav.search.overlay.kernels import tables as _table_kernels
from hybridnav.search.overlay.kernels.lanes import FAR
from hybridnav.search.overlay.layout import CellCosts, Levels, Top, slots_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._base.typing import BoolArray, FloatArray, IntArray


if TYPE_CHECKING:
    from hybridnav._base.typing import ByteArray, IntArray

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


# Factors of cells as an overlay takes them: checked, and in whole units.

ONE = 1 << UNIT_BITS
"""Units of a factor of 1; a straight move over such cells costs twice as many."""


def units_of(
    factor: FloatArray, shape: tuple[int, int], enterable: BoolArray, box: tuple[slice, slice]
) -> IntArray:
    """Return the factors of the cells in a box in units, rounded down, 0 where not enterable.

    Parameters
    ----------
    factor
        Any float (rows, cols).
    shape
        Rows and columns of the map.
    enterable
        bool, the cells of the box that may be entered.
    box
        Its rows and columns.

    Raises
    ------
    InvalidValueError
        When the shape is another one, or a factor of a cell that may be entered is out of range.
    """
    if factor.shape != shape:
        raise InvalidValueError(
            f"factors have shape {factor.shape}, the map has {shape}: give one per cell"
        )
    own = np.where(enterable, factor[box], 1.0)
    if not ((own >= 1) & (own <= MOST_FACTOR)).all():
        bad = own[~((own >= 1) & (own <= MOST_FACTOR))][0]
        raise InvalidValueError(
            f"a factor of a free cell is {bad}, expected a number from 1 to {MOST_FACTOR:.0f}: "
            "close cells that must not be entered"
        )
    units: IntArray = np.where(enterable, np.floor(own * ONE), 0).astype(np.int32)
    return units


def numbers_of(factor: FloatArray) -> FloatArray:
    """Return factors as an array of floats.

    Raises
    ------
    InvalidValueError
        When they are no numbers, or rows differ in length.
    """
    try:
        array = np.asarray(factor)
    except ValueError:
        array = np.empty(0, dtype=np.bool_)
    if array.dtype.kind not in "iuf":
        raise InvalidValueError(
            f"factors are {factor!r:.60}, expected one number per cell: give an array of rows and "
            "columns"
        )
    return array


def are_whole(factor: FloatArray) -> bool:
    """Return whether factors are whole units."""
    return bool((np.floor(factor * ONE) == factor * ONE).all())


# Computing the costs that an overlay stores, on all cores.

_LIMIT = int(FAR) // 2
"""Largest distance that is stored: sums of two must stay below FAR."""
_LEAST_CHUNK = 8
"""Least number of fields that one task of a thread computes."""
_LEAST_GATES = 1 / 8
"""Bytes for the square of a number of nodes when a quarter of them are gates; more are."""

T = TypeVar("T")


class PathsTooLongError(InvalidValueError):
    """Costs inside a field that do not fit into 30 bits."""


def fill_cliques(ground: CellCosts, levels: Levels, fields: IntArray) -> None:
    """Compute the distances between the border cells of some of the finest fields.

    Raises
    ------
    PathsTooLongError
        When a distance is so large that sums would not fit.
    """
    most = _in_threads(
        lambda part: _table_kernels.fill_cliques(levels, ground, part),
        fields,
        max(_LEAST_CHUNK, len(fields) // 64),
    )
    if max(most, default=0) >= _LIMIT:
        raise PathsTooLongError(
            "a path inside a field costs more than 16,000 cells: use smaller fields or factors"
        )


def fill_tables(levels: Levels, progress: Progress = no_progress) -> Levels:
    """Compute what is stale; return the levels, with other tables.

    Fields stay stale with distances that do not fit, or above such.
    """
    n_levels = len(levels.level_at) - 1
    for level in range(1, n_levels):
        fields = np.arange(levels.level_at[level], levels.level_at[level + 1], dtype=np.int32)
        levels = fill_some(levels, fields)
        progress(level + 1, n_levels + 1)
    return levels


def fill_some(levels: Levels, fields: IntArray) -> Levels:
    """Compute what is stale of some fields of one upper level, as `fill_tables` does.

    The levels returned are the same ones on the second level, which has no tables.
    """
    stale = np.flatnonzero(levels.is_stale)
    on_stale = np.zeros(len(levels.parent), dtype=np.bool_)
    on_stale[levels.parent[stale[levels.parent[stale] >= 0]]] = True
    fields = fields[levels.is_stale[fields] & ~on_stale[fields]]
    # A few fields of the level above the finest take less time than a start of threads.
    is_quick = len(fields) < _LEAST_CHUNK and (fields < levels.level_at[2]).all()
    filled = _in_threads(
        lambda part: _table_kernels.fill_clique(levels, part[0]),
        fields,
        1,
        fewest=_LEAST_CHUNK if is_quick else 2,
    )
    fits = np.array([most < _LIMIT for most, _ in filled], dtype=np.bool_)
    if (fields >= levels.level_at[2]).any():
        tables = [packed for _, packed in filled]
        levels = _with_tables(levels, fields[fits], [tables[k] for k in np.flatnonzero(fits)])
    levels.is_stale[fields[fits]] = levels.is_lowered[fields[fits]] = False
    levels.is_lowered[fields[~fits]] = True
    return levels


def _with_tables(levels: Levels, fields: IntArray, tables: list[IntArray]) -> Levels:
    """Return levels with other tables of some fields, and with marks of stale fields of their own.

    An interrupt leaves the former levels as they were.
    """
    sizes = np.diff(levels.table_at)
    sizes[fields] = [len(table) for table in tables]
    table_at = np.concatenate([[0], np.cumsum(sizes)])
    joined = np.empty(table_at[-1], dtype=np.int32)
    is_new = np.zeros(len(sizes), dtype=np.bool_)
    is_new[fields] = True
    for field in np.flatnonzero((sizes > 0) & ~is_new):
        joined[table_at[field] : table_at[field + 1]] = levels.table[
            levels.table_at[field] : levels.table_at[field + 1]
        ]
    for field, table in zip(fields, tables, strict=True):
        joined[table_at[field] : table_at[field + 1]] = table
    is_newer = levels.is_newer.copy()
    is_newer[(levels.parent >= 0) & is_new[levels.parent]] = False
    return levels._replace(
        table_at=table_at,
        table=joined,
        is_stale=levels.is_stale.copy(),
        is_lowered=levels.is_lowered.copy(),
        is_newer=is_newer,
    )


def compute_top(levels: Levels, most_bytes: float) -> Top:
    """Compute the distances between gates of the last level, if they fit."""
    nothing = np.empty(0, dtype=np.int32)
    none = Top(nothing, nothing, nothing, False, nothing)
    fields = (int(levels.level_at[-2]), int(levels.level_at[-1]))
    first, last = int(levels.node_at[fields[0]]), int(levels.node_at[fields[1]])
    if _LEAST_GATES * (last - first) ** 2 > most_bytes or levels.is_stale.any():
        return none
    gates = _gate_kernels.gates_among(levels.move_at, levels.move_to, first, last)
    n = len(gates)
    if 2 * n * (n + 1) > most_bytes:
        return none
    distance = np.empty(n * (n + 1) // 2, dtype=np.int32)
    gate_of = np.full(last - first, -1, dtype=np.int32)
    gate_of[gates - first] = np.arange(n, dtype=np.int32)

    def fill(part: IntArray) -> int:
        return int(_gate_kernels.fill_top(levels, fields, gates, part, distance))

    if max(_in_threads(fill, np.arange(n, dtype=np.int32), 64), default=0) >= _LIMIT:
        return none
    return Top(distance, gates, gate_of, True, nothing)


def _in_threads(
    fill: Callable[[IntArray], T], items: IntArray, chunk: int, *, fewest: int = 2
) -> list[T]:
    """Compute parts on all cores, fewer than some on one; return what each returned."""
    parts = [items[k : k + chunk] for k in range(0, len(items), chunk)]
    n_threads = min(os.cpu_count() or 1, len(parts))
    if n_threads < 2 or len(parts) < fewest:  # noqa: PLR2004 - one thread
        return [fill(part) for part in parts]
    with ThreadPoolExecutor(n_threads) as threads:
        return list(threads.map(fill, parts))
