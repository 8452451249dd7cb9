"""Costs that change: a door closed, a box of cells, and maps of growing size."""

from __future__ import annotations

import gc
import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks._costs_measure import RADIUS_M, bench_of, clocked
from benchmarks.worlds import office_world, tiled
from hybridnav.harness.outcome import nanquantile
from hybridnav.search.grid_search import GridSearch

if TYPE_CHECKING:
    from benchmarks._costs_measure import Bench, Cell
    from hybridnav._base.typing import FloatArray, LongArray
    from hybridnav.harness.tables import Row
    from hybridnav.search.overlay import OverlayPath

    Box = tuple[int, int, int, int]

_DOORS, _BOXES = 25, 10
_HALF_DOOR, _HALF_BOX = 8, 30


def doors(bench: Bench) -> tuple[Row, list[str]]:
    """Close a square on the path of some pairs, ask again, open it, ask again, and renew."""
    taken: dict[str, list[float]] = {}
    wrong: list[str] = []
    shape, overlay = bench.overlay.shape, bench.overlay
    closed = np.zeros(shape, dtype=np.bool_)
    for start, goal in bench.pairs[:_DOORS]:
        box = _box_on(bench.search.path(start, goal), shape, _HALF_DOOR)
        if box is None:
            continue
        blocked = _cells_of(box, shape[1])
        closed.ravel()[blocked] = True
        update = partial(overlay.update, bench.factors, closed=closed, changed=box)
        seconds = {"close": clocked(update), **_asked(bench, start, goal, "closed")}
        seconds["A*"] = clocked(bench.astar.search, start, goal, blocked=blocked)
        wrong += _differ(bench, start, goal, bench.by_cells(start, goal, blocked))
        closed.ravel()[blocked] = False
        seconds["open"] = clocked(update)
        seconds |= _asked(bench, start, goal, "open")
        wrong += _differ(bench, start, goal, bench.optimum[start, goal])
        seconds["renew"] = clocked(overlay.renew)
        for name, value in seconds.items():
            taken.setdefault(name, []).append(value)
    return _medians(taken), wrong


def _asked(bench: Bench, start: Cell, goal: Cell, when: str) -> dict[str, float]:
    """Return the seconds of the first answer after a change, and of the second."""
    return {
        f"{when}: {word} answer": clocked(bench.search.path, start, goal)
        for word in ("first", "second")
    }


def _differ(bench: Bench, start: Cell, goal: Cell, best: float) -> list[str]:
    """Return a line if an exact answer differs from A*'s by more than rounding."""
    found = bench.search.path(start, goal)
    if math.isinf(best) and found.cells is None:
        return []
    if found.lower_bound_cells <= best * (1 + 1e-12) and found.cost_cells <= best * (1 + 1e-4):
        return []
    return [f"{start} to {goal}, changed: cost {found.cost_cells}, A* {best}"]


def _by_cells(bench: Bench, factors: FloatArray, start: Cell, goal: Cell) -> float:
    """Return the cost of the path that A* finds with other factors."""
    layer = hn.CostLayer(factors.astype(np.float32))
    cells = GridSearch(bench.grid.enterable(), units=layer.units).search(start, goal).cells
    return math.inf if cells is None else layer.cost_of_cells(cells)


def _box_on(found: OverlayPath, shape: tuple[int, int], half: int) -> Box | None:
    """Return a square round the middle of a path, None where the path is too short for one."""
    if found.cells is None or len(found.cells) < 4 * half:
        return None
    row, col = found.cells[len(found.cells) // 2].tolist()
    return (
        max(row - half, 0),
        min(row + half + 1, shape[0]),
        max(col - half, 0),
        min(col + half + 1, shape[1]),
    )


def _cells_of(box: Box, cols: int) -> LongArray:
    rows, columns = np.meshgrid(np.arange(*box[:2]), np.arange(*box[2:]), indexing="ij")
    flat: LongArray = (rows * cols + columns).ravel()
    return flat


def _medians(taken: dict[str, list[float]]) -> Row:
    """Return median and p95 of each kind of step, in milliseconds."""
    row: Row = {"changes": max(map(len, taken.values()), default=0)}
    for name, seconds in taken.items():
        ms = 1e3 * np.array(seconds)
        row[name] = nanquantile(ms, 0.5)
        row[f"{name}, p95"] = nanquantile(ms, 0.95)
    return row


def scale(millions: list[float], pairs: int, seed: int) -> tuple[list[Row], list[str]]:
    """Measure the office, repeated to so many million free cells each; rows, and what is wrong."""
    rows: list[Row] = []
    wrong: list[str] = []
    of_one = int(office_world().grid(robot_radius_m=RADIUS_M).enterable().sum())
    for size in millions:
        copies = 1e6 * size / of_one
        n_rows = max(round(math.sqrt(copies)), 1)
        world = tiled(office_world(), rows=n_rows, cols=max(round(copies / n_rows), 1))
        bench = bench_of(world.grid(robot_radius_m=RADIUS_M), pairs, seed)
        row: Row = {
            "M free": bench.n_free / 1e6,
            "us/cell": 1e6 * bench.preparation_s / bench.n_free,
            "B/cell": bench.overlay.memory_bytes / bench.n_free,
            "levels": len(bench.overlay.levels.level_at) - 1,
        }
        row["cost of a cell, times the first"] = (
            float(row["us/cell"]) / float(rows[0]["us/cell"]) if rows else 1.0
        )
        changed, lines = _boxes(bench)
        rows.append(row | changed)
        wrong += lines
        del bench
        gc.collect()
    return rows, wrong


def _boxes(bench: Bench) -> tuple[Row, list[str]]:
    """Raise some costs of a box on a path and lower others, ask, and set the costs back."""
    taken: dict[str, list[float]] = {}
    wrong: list[str] = []
    rng = np.random.default_rng(0)
    for start, goal in bench.pairs[:_BOXES]:
        seconds = {
            "A*": clocked(bench.astar.search, start, goal),
            "exact": clocked(bench.search.path, start, goal),
        }
        box = _box_on(bench.search.path(start, goal), bench.overlay.shape, _HALF_BOX)
        if box is None:
            continue
        factors = bench.factors.copy()
        part = factors[box[0] : box[1], box[2] : box[3]]
        part[:] = 1 + 2 * rng.random(part.shape)
        seconds["update"] = clocked(bench.overlay.update, factors, changed=box)
        seconds |= _asked(bench, start, goal, "changed")
        wrong += _differ(bench, start, goal, _by_cells(bench, factors, start, goal))
        bench.overlay.update(bench.factors, changed=box)
        wrong += _differ(bench, start, goal, bench.by_cells(start, goal))
        seconds["renew"] = clocked(bench.overlay.renew)
        for name, value in seconds.items():
            taken.setdefault(name, []).append(value)
    return _medians(taken), wrong
