"""A* on the cells against pyastar2d, on the same pairs.

Everything that is compared is measured in one process, interleaved; ratios count, seconds depend
on the machine. `--data` (or HYBRIDNAV_DATA) adds real maps.
"""

from __future__ import annotations

import statistics
import time
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks.common import (
    DATA,
    OFFICE,
    SEED,
    Refused,
    largest_part,
    option,
    print_head,
    print_row,
    read,
)
from hybridnav.search.grid_search import GridSearch

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path


REAL_MAPS = (
    "strands/tsc_y4/tsc_1701.yaml",
    "bwi_gdc/3/3.yaml",
    "willow/willow-2010-02-18-0.10.yaml",
    "nav2/maps/depot.yaml",
    "aws_small_warehouse/002/map.yaml",
    "radish_grids/belgioioso.yaml",
)


def search_table(maps: list[Path], pairs: int, seed: int) -> None:
    """Pure grid A* against pyastar2d, both from cells to cells, on the same pairs, interleaved."""
    try:
        import pyastar2d  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        raise Refused('pyastar2d is missing (pip install -e ".[bench]")') from None
    print(f"## Grid A* against pyastar2d, {pairs} pairs a map in the largest free component\n")
    print_head("map", "free cells", "A*, ms median", "pyastar2d, ms median", "ratio, median")
    ratios: list[float] = []
    for path in maps:
        grid = read(path)
        free = grid.classes == hn.CellClass.FREE
        search = GridSearch(free)
        weights = np.where(free, 1, np.inf).astype(np.float32)
        ours, theirs = [], []
        cells = largest_part(free)
        chosen = cells[np.random.default_rng(seed).integers(len(cells), size=(pairs, 2))]
        for (a, b), (c, d) in chosen.tolist():
            start, goal = (a, b), (c, d)
            began = time.perf_counter()
            search.search(start, goal)
            middle = time.perf_counter()
            pyastar2d.astar_path(weights, start, goal, allow_diagonal=True)
            ours.append(middle - began)
            theirs.append(time.perf_counter() - middle)
        ratio = [b / a for a, b in zip(ours, theirs, strict=True)]
        ratios += ratio
        figures = [statistics.median(values) for values in (ours, theirs, ratio)]
        ms = [f"{figure * 1e3:.3f}" for figure in figures[:2]]
        print_row(grid.name, int(free.sum()), *ms, f"{figures[2]:.2f}")
    print(f"\nmedian over all pairs: pyastar2d takes {statistics.median(ratios):.2f} x as long\n")


OPTIONS = [
    DATA,
    option("--pairs", type=int, default=100),
    SEED,
]


def main(given: Namespace) -> None:
    """Print the tables."""
    maps = [OFFICE]
    if given.data is not None:
        maps += [given.data / name for name in REAL_MAPS]
    search_table(maps, given.pairs, given.seed)
