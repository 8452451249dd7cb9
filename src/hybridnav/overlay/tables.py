"""Computing the costs that an overlay stores, on all cores."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.overlay import _clique_kernels, _table_kernels
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


def fill_tables(levels: Levels, progress: Progress = no_progress) -> None:
    """Compute the stale tables; those stay stale with distances that do not fit, or above such."""
    n_levels = len(levels.level_at) - 1
    for level in range(1, n_levels):
        fields = np.arange(levels.level_at[level], levels.level_at[level + 1], dtype=np.int32)
        fill_some(levels, fields)
        progress(level + 1, n_levels + 1)


def fill_some(levels: Levels, fields: IntArray) -> None:
    """Compute the stale tables of some fields of one upper level, as `fill_tables` does."""
    stale = np.flatnonzero(levels.is_stale)
    on_stale = np.zeros(len(levels.parent), dtype=np.bool_)
    on_stale[levels.parent[stale[levels.parent[stale] >= 0]]] = True
    fields = fields[levels.is_stale[fields] & ~on_stale[fields]]
    # A few fields of the level above the finest take less time than a start of threads.
    is_quick = len(fields) < _LEAST_CHUNK and (fields < levels.level_at[2]).all()
    fill = partial(_table_kernels.fill_tables, levels)
    most = _in_threads(fill, fields, 1, fewest=_LEAST_CHUNK if is_quick else 2)
    fits = fields[np.array(most, dtype=np.int64) < _LIMIT]
    levels.is_stale[fits] = levels.is_lowered[fits] = False
    levels.is_lowered[np.setdiff1d(fields, fits)] = True


def compute_top(levels: Levels, most_bytes: float) -> Top:
    """Compute the distances between all nodes of the last level, if they fit."""
    none = np.empty(0, dtype=np.int32)
    fields = (int(levels.level_at[-2]), int(levels.level_at[-1]))
    first, last = int(levels.node_at[fields[0]]), int(levels.node_at[fields[1]])
    n = last - first
    if 4 * n * n > most_bytes or levels.is_stale.any():
        return Top(np.empty((0, 0), dtype=np.int32), False, none)
    distance = np.empty((n, n), dtype=np.int32)
    nodes = np.arange(first, last, dtype=np.int32)

    def fill(part: IntArray) -> int:
        rows = distance[part[0] - first : part[-1] - first + 1]
        return int(_table_kernels.distances_among(levels, fields, part, rows))

    if max(_in_threads(fill, nodes, 64), default=0) >= _LIMIT:
        return Top(np.empty((0, 0), dtype=np.int32), False, none)
    return Top(distance, True, none)


def _in_threads(
    fill: Callable[[IntArray], int], items: IntArray, chunk: int, *, fewest: int = 2
) -> list[int]:
    """Compute parts on all cores, fewer than some on one; return what each returned."""
    parts = [items[k : k + chunk] for k in range(0, len(items), chunk)]
    n_threads = min(os.cpu_count() or 1, len(parts))
    if n_threads < 2 or len(parts) < fewest:  # noqa: PLR2004 - one thread
        return [fill(part) for part in parts]
    with ThreadPoolExecutor(n_threads) as threads:
        return list(threads.map(fill, parts))
