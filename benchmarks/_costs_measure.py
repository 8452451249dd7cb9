"""One map of the tables of costs: the overlay prepared, queries in turn with weighted A*."""

from __future__ import annotations

import gc
import time
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks._costs_judge import EPSILON, by_dijkstra, judged
from benchmarks._queries_measure import read
from benchmarks.worlds import office_world
from hybridnav.harness.outcome import nanquantile
from hybridnav.harness.pairs import sample_pairs
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.overlay import OverlaySearch, prepare_overlay

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hybridnav._base.typing import FloatArray, LongArray
    from hybridnav.harness.tables import Row
    from hybridnav.search.overlay import Overlay

    Cell = tuple[int, int]

RADIUS_M, MERGE_DISTANCE_M = 0.25, 4.0


@dataclass
class Bench:
    """A map with its costs, what is measured on it, and pairs of cells."""

    grid: hn.OccupancyGrid
    topology: hn.TopologicalMap
    layer: hn.CostLayer
    factors: FloatArray
    """Those of the layer."""
    pairs: list[tuple[Cell, Cell]]
    overlay: Overlay
    search: OverlaySearch
    astar: GridSearch
    preparation_s: float
    optimum: dict[tuple[Cell, Cell], float] = field(default_factory=dict)
    """Cost of the cheapest path in cells, by A*."""

    @property
    def n_free(self) -> int:
        """Number of cells that may be entered."""
        return int(self.grid.enterable().sum())

    def by_cells(self, start: Cell, goal: Cell, blocked: LongArray | None = None) -> float:
        """Return the cost of the path that weighted A* finds."""
        cells = self.astar.search(start, goal, blocked=blocked).cells
        return np.inf if cells is None else self.layer.cost_of_cells(cells)


def bench_of(grid: hn.OccupancyGrid, pairs: int, seed: int) -> Bench:
    """Prepare what is measured on a map; only the overlay is timed."""
    layer = hn.CostLayer.clearance(grid)
    factors = layer.factors.astype(np.float64)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=MERGE_DISTANCE_M)
    topology = hn.TopologicalMap(pyramid)
    gc.collect()
    began = time.perf_counter()
    overlay = prepare_overlay(topology, factors)
    preparation_s = time.perf_counter() - began
    drawn = sample_pairs(grid, pairs, seed=seed)
    return Bench(
        grid=grid,
        topology=topology,
        layer=layer,
        factors=factors,
        pairs=[(pair.start, pair.goal) for pair in drawn if pair.kind == "sampled"],
        overlay=overlay,
        search=OverlaySearch(overlay),
        astar=GridSearch(grid.enterable(), units=layer.units),
        preparation_s=preparation_s,
    )


def prepared(file: Path, pairs: int, seed: int) -> Bench:
    """Read and prepare a map file."""
    return bench_of(read(file), pairs, seed)


def warm_up() -> None:
    """Load every kernel, so that no time includes it."""
    measure(bench_of(office_world().grid(robot_radius_m=RADIUS_M), 5, 0))


def clocked(ask: Callable[..., object], *arguments: object, **options: object) -> float:
    """Return the seconds that a call takes."""
    began = time.perf_counter()
    ask(*arguments, **options)
    return time.perf_counter() - began


def measure(bench: Bench) -> tuple[Row, list[str]]:
    """Put all pairs to A* and to the overlay; return a row of figures, and what is wrong."""
    methods: dict[str, Callable[..., object]] = {
        "A*": bench.astar.search,
        "exact": bench.search.path,
        "epsilon": partial(bench.search.path, epsilon=EPSILON),
    }
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in methods}
    rng = np.random.default_rng(0)
    gc.disable()
    for pair in bench.pairs:
        for name in rng.permutation(list(methods)).tolist():
            times[name].append((clocked(methods[name], *pair), clocked(methods[name], *pair)))
    gc.enable()
    ms = {name: 1e3 * np.array(taken) for name, taken in times.items()}
    wrong, figures = judged(bench)
    wrong += by_dijkstra(bench)
    return _row(bench, ms) | figures, wrong


def _row(bench: Bench, ms: dict[str, FloatArray]) -> Row:
    row: Row = {
        "free cells": bench.n_free,
        "us/cell": 1e6 * bench.preparation_s / bench.n_free,
        "B/cell": bench.overlay.memory_bytes / bench.n_free,
    }
    for name, taken in ms.items():
        row[f"{name} ms"] = nanquantile(taken[:, 0], 0.5)
        row[f"{name} p95"] = nanquantile(taken[:, 0], 0.95)
        row[f"{name} max"] = nanquantile(taken[:, 0], 1.0)
    for name in ("exact", "epsilon"):
        for turn, word in enumerate(("cold", "again")):
            ratios = ms["A*"][:, turn] / ms[name][:, turn]
            row[f"{name} {word} x"] = nanquantile(ratios, 0.5)
            row[f"{name} {word} x, worst"] = nanquantile(ratios, 0.0)
    return row
