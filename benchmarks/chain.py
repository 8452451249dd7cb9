"""The chain's figures: build, grid A* against pyastar2d, second start of the command line.

    python -m benchmarks.chain [--data FOLDER]

Everything that is compared is measured in one process, interleaved; ratios count, seconds depend
on the machine. `--data` (or HYBRIDNAV_DATA) adds real maps.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

import hybridnav as hn
from benchmarks.worlds import office_world, tiled
from hybridnav.search.grid_search import GridSearch

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, LongArray

OFFICE = Path(__file__).parents[1] / "maps" / "office" / "office.yaml"
REAL_MAPS = (
    "strands/tsc_y4/tsc_1701.yaml",
    "bwi_gdc/3/3.yaml",
    "willow/willow-2010-02-18-0.10.yaml",
    "nav2/maps/depot.yaml",
    "aws_small_warehouse/002/map.yaml",
    "radish_grids/belgioioso.yaml",
)
RADIUS_M = 0.25


def build_table(repeats: int) -> None:
    """Whole build of about 1 M vertices: grid to apex, and with the attributes of its arcs."""
    grid = tiled(office_world(), rows=1, cols=2).grid(robot_radius_m=0.0)
    vertices = int((grid.classes != hn.CellClass.OCCUPIED).sum())
    hn.DualGraphPyramid.build(grid)[-1].through_m  # noqa: B018 - compiles or loads the kernels
    builds, attributes = [], []
    for _ in range(repeats):
        began = time.perf_counter()
        pyramid = hn.DualGraphPyramid.build(grid)
        built = time.perf_counter()
        top = pyramid[-1]
        top.max_distance_m, top.through_m, top.boundary(0)
        builds.append(built - began)
        attributes.append(time.perf_counter() - built)
    print(f"## Build, {vertices} vertices (office tiled 1 x 2), U_d 4 m, {len(pyramid)} levels\n")
    print("| stage | s, median | s, least | s per 1 M vertices, median |")
    print("|---|---|---|---|")
    for name, times in (("grid to apex", builds), ("attributes of the apex", attributes)):
        median = statistics.median(times)
        per_million = median / vertices * 1e6
        print(f"| {name} | {median:.3f} | {min(times):.3f} | {per_million:.3f} |")
    print(f"\nstages of the last build: {_stages(pyramid)}\n")


def _stages(pyramid: hn.DualGraphPyramid) -> str:
    return ", ".join(f"{key} {seconds:.3f} s" for key, seconds in pyramid.stats.seconds.items())


def search_table(maps: list[Path], pairs: int, seed: int) -> None:
    """Pure grid A* against pyastar2d, both from cells to cells, on the same pairs, interleaved."""
    try:
        import pyastar2d  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        print('## Grid A*: not measured, pyastar2d is missing (pip install -e ".[bench]")\n')
        return

    print(f"## Grid A* against pyastar2d, {pairs} pairs a map in the largest free component\n")
    print("| map | free cells | A*, ms median | pyastar2d, ms median | ratio, median |")
    print("|---|---|---|---|---|")
    ratios: list[float] = []
    for path in maps:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", hn.MapWarning)
            grid = hn.load_map(path, robot_radius_m=RADIUS_M)
        free = grid.classes == hn.CellClass.FREE
        search = GridSearch(free)
        weights = np.where(free, 1, np.inf).astype(np.float32)
        ours, theirs = [], []
        for start, goal in _pairs(free, pairs, seed):
            began = time.perf_counter()
            search.search(start, goal)
            middle = time.perf_counter()
            pyastar2d.astar_path(weights, start, goal, allow_diagonal=True)
            ours.append(middle - began)
            theirs.append(time.perf_counter() - middle)
        ratio = [b / a for a, b in zip(ours, theirs, strict=True)]
        ratios += ratio
        figures = [statistics.median(values) for values in (ours, theirs, ratio)]
        print(
            f"| {grid.name} | {int(free.sum())} | {figures[0] * 1e3:.3f} | {figures[1] * 1e3:.3f} "
            f"| {figures[2]:.2f} |"
        )
    print(f"\nmedian over all pairs: pyastar2d takes {statistics.median(ratios):.2f} x as long\n")


def _pairs(free: BoolArray, count: int, seed: int) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    label, _ = ndimage.label(free)
    largest = np.bincount(label.ravel())[1:].argmax() + 1
    cells: LongArray = np.argwhere(label == largest)
    chosen = cells[np.random.default_rng(seed).integers(len(cells), size=(count, 2))]
    return [((a, b), (c, d)) for (a, b), (c, d) in chosen.tolist()]


def start_table(repeats: int) -> None:
    """Wall time of a whole `hybridnav plan`, kernels in the cache."""
    command = [sys.executable, "-m", "hybridnav", "plan", str(OFFICE)]
    command += ["--start", "1.0,13.2", "--goal", "40.6,19.4"]
    times = []
    for _ in range(repeats + 1):
        began = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - began)
    print("## Command line, whole process, `hybridnav plan maps/office/office.yaml`\n")
    print(f"first start {times[0]:.2f} s, later starts {statistics.median(times[1:]):.2f} s median")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("--pairs", type=int, default=100)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    maps = [OFFICE]
    if arguments.data is not None:
        maps += [Path(arguments.data) / name for name in REAL_MAPS]
    build_table(arguments.repeats)
    search_table(maps, arguments.pairs, arguments.seed)
    start_table(arguments.repeats)


if __name__ == "__main__":
    main()
