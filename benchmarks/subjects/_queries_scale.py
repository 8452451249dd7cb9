"""One building tiled to many millions of cells: what structures cost there, and what queries take.

Structures are asked directly, without a planner: the topological map, which a planner is made from
for the sake of its routes, is a matter of the subject `pyramid`. Preparation includes all that
`planner.prepare()` builds for paths. Some lengths of `shortest` are compared with those of the
search of intervals, which shares no more than the mesh with what is measured: column `differ`
counts those that are not equal to 1e-6 cells, of `compared`.
"""

from __future__ import annotations

import gc
import math
import os
import resource
import sys
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

import hybridnav as hn
from benchmarks.common import read
from benchmarks.subjects._queries_measure import SLACK, YARDSTICK
from hybridnav._base.moves import path_length_in_cells
from hybridnav.harness.adapters import _nbytes
from hybridnav.harness.outcome import nanquantile
from hybridnav.harness.tables import to_markdown
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.mesh import MeshSearch, build_mesh

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.harness.tables import Row

    Cell = tuple[int, int]
    Ask = Callable[[Cell, Cell], float]

DOOR_CELLS = 9
"""Width of the doors between tiles."""
COMPARED = 20
"""Queries that are put to the search of intervals, too."""


def scale(file: Path, millions: list[float], *, pairs: int, seed: int) -> str:
    """Measure a map, tiled to at least so many million cells each; a table in Markdown."""
    free = read(file).classes == hn.CellClass.FREE
    _rows_of(_tiled(free, 0), pairs=2, seed=seed)  # loads every kernel
    rows = []
    for size in millions:
        rows += _rows_of(_tiled(free, 1e6 * size), pairs=pairs, seed=seed)
    return to_markdown([{"map": file.stem, **row} for row in rows])


def _tiled(free: BoolArray, cells: float) -> BoolArray:
    """The largest component of a building, as often as it takes to have so many cells. Tiles are
    mirror images of their neighbours, so that a door in each side leads on into the next."""
    labels, _ = ndimage.label(free)
    sizes = np.bincount(labels.ravel())[1:]
    inside = labels == sizes.argmax() + 1
    rows, cols = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    inside = inside[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
    for axis in (0, 1):
        for line in (0, -1):
            # In a side there is a free cell of the building: its door.
            at = int(np.take(inside, line, axis=axis).argmax())
            door = np.s_[max(at - DOOR_CELLS // 2, 0) : at + DOOR_CELLS // 2 + 1]
            edge = inside[line] if axis == 0 else inside[:, line]
            edge[door] = True
    n = max(math.ceil(math.sqrt(cells / inside.size)), 2)
    row_of = [inside if k % 2 == 0 else inside[:, ::-1] for k in range(n)]
    strip = np.concatenate(row_of, axis=1)
    return np.concatenate([strip if k % 2 == 0 else strip[::-1] for k in range(n)])


def _rows_of(free: BoolArray, *, pairs: int, seed: int) -> list[Row]:
    """A row of figures for each structure."""
    cells = [(row, col) for row, col in _some_cells(free, 2 * pairs, seed).tolist()]
    queries = list(zip(cells[::2], cells[1::2], strict=True))
    makers = {YARDSTICK: _by_cells, "shortest": _by_mesh}
    asked: dict[str, Ask] = {}
    structures: dict[str, Any] = {}
    rows: dict[str, Row] = {}
    load = os.getloadavg()[0]
    n_free = int(free.sum())
    for name, make in makers.items():
        gc.collect()
        began = time.perf_counter()
        structures[name], asked[name] = make(free)
        seconds = time.perf_counter() - began
        asked[name](*queries[0])
        rows[name] = {
            "M cells": free.size / 1e6,
            "M free": n_free / 1e6,
            "structure": name,
            "preparation s": seconds,
            "us/cell": 1e6 * seconds / n_free,
            "B/cell": _nbytes(structures[name], set()) / n_free,
        }
    sys.stderr.write(f"{free.size / 1e6:.1f} M cells: prepared, load {os.getloadavg()[0]:.1f}\n")
    times, lengths = _ask(asked, queries, seed)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    for name, row in rows.items():
        ms = 1e3 * times[name]
        shares = ("median", 0.5), ("p95", 0.95), ("max", 1.0)
        row |= {f"ms {word}": nanquantile(ms, share) for word, share in shares}
        row["times A*"] = nanquantile(times[YARDSTICK] / times[name], 0.5)
        row |= {"load": load, "peak GB": peak}
    compared = queries[:COMPARED]
    found = lengths["shortest"][: len(compared)]
    expected = np.array(_by_intervals(structures["shortest"], compared))
    differ = (found != expected) & ~(np.abs(found - expected) < 1e-6)
    rows["shortest"] |= {"compared": len(compared), "differ": int(differ.sum())}
    if differ.any():
        sys.stderr.write(f"broken promise: {int(differ.sum())} paths are not the shortest\n")
    too_long = lengths["shortest"] > lengths[YARDSTICK] * (1 + SLACK)
    if too_long.any() or not np.isfinite(lengths["shortest"]).all():
        sys.stderr.write(f"broken promise: {int(too_long.sum())} paths longer than A*'s\n")
    return list(rows.values())


def _by_cells(free: BoolArray) -> tuple[object, Ask]:
    """A* on the cells."""
    search = GridSearch(free)

    def ask(start: Cell, goal: Cell) -> float:
        found = search.search(start, goal).cells
        return math.inf if found is None else path_length_in_cells(found)

    return search, ask


def _by_mesh(free: BoolArray) -> tuple[object, Ask]:
    """The search of the convex mesh."""
    search = MeshSearch(build_mesh(free))
    search.prepare()

    def ask(start: Cell, goal: Cell) -> float:
        return search.path((start, goal), _centres(start, goal)).length_cells

    return search, ask


def _by_intervals(prepared: MeshSearch, queries: list[tuple[Cell, Cell]]) -> list[float]:
    """Lengths by the search of intervals: with a budget a search does not prepare itself."""
    plain = MeshSearch(prepared.mesh)
    return [
        plain.path(endpoints, _centres(*endpoints), budget_s=math.inf).length_cells
        for endpoints in queries
    ]


def _centres(start: Cell, goal: Cell) -> tuple[tuple[float, float], tuple[float, float]]:
    """The centres of two cells, (row, col) in grid units."""
    return (start[0] + 0.5, start[1] + 0.5), (goal[0] + 0.5, goal[1] + 0.5)


def _ask(
    asked: dict[str, Ask], queries: list[tuple[Cell, Cell]], seed: int
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Seconds and lengths by structure: pair by pair, in another order each time."""
    times: dict[str, list[float]] = {name: [] for name in asked}
    lengths: dict[str, list[float]] = {name: [] for name in asked}
    rng = np.random.default_rng(seed)
    gc.disable()
    for start, goal in queries:
        for name in rng.permutation(list(asked)).tolist():
            began = time.perf_counter()
            length = asked[name](start, goal)
            times[name].append(time.perf_counter() - began)
            lengths[name].append(length)
    gc.enable()
    by_name, of_paths = (
        {name: np.array(values) for name, values in found.items()} for found in (times, lengths)
    )
    return by_name, of_paths


def _some_cells(free: BoolArray, count: int, seed: int) -> LongArray:
    """Free cells anywhere on the map, int64 (count, 2)."""
    rng = np.random.default_rng(seed)
    found = np.empty((0, 2), dtype=np.int64)
    while len(found) < count:
        drawn = rng.integers(0, free.shape, (count, 2))
        found = np.concatenate([found, drawn[free[tuple(drawn.T)]]])
    return found[:count]
