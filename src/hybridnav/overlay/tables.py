"""Computing the costs that an overlay stores, on all cores."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from hybridnav._progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.overlay import _clique_kernels, _gate_kernels, _table_kernels, _top_kernels
from hybridnav.overlay._lane_kernels import FAR
from hybridnav.overlay.layout import Top

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._progress import Progress
    from hybridnav._typing import IntArray
    from hybridnav.overlay.layout import CellCosts, Levels

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
        lambda part: _clique_kernels.fill_cliques(levels, ground, part),
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
        return int(_top_kernels.fill_top(levels, fields, gates, part, distance))

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
