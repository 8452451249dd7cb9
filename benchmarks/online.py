"""A pyramid that follows its map: time of an update, places against a fresh build, identities.

    python -m benchmarks.online [--data FOLDER] [--updates 1000]

All ratios are taken in one process. `--data` (or HYBRIDNAV_DATA) adds the Intel counting grid, of
which a window moves as a robot's sight does: what it covers becomes known.
"""

from __future__ import annotations

import argparse
import os
import time
import warnings
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import hybridnav as hn
from benchmarks.chain import OFFICE, RADIUS_M
from hybridnav.online import OnlinePyramid

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Classes = NDArray[np.uint8]
    Box = tuple[int, int, int, int]

INTEL = "radish_grids/intel.yaml"
SIDES = (500, 1000, 2000, 4000)
"""Rows and columns of the maps on which growth is measured: 0.25 M to 16 M cells."""
CHANGE = 60
SIGHT = 80
"""Cells that a robot sees to each side: 4 m."""


class Run(NamedTuple):
    """What a sequence of updates did."""

    seconds: list[float]
    flips: int
    seen: int
    version: OnlinePyramid


def with_classes(grid: hn.OccupancyGrid, classes: Classes) -> hn.OccupancyGrid:
    """Return a grid with other classes, without the work of making one."""
    values = {field.name: getattr(grid, field.name) for field in fields(grid)}
    return hn.OccupancyGrid.restored(**{**values, "classes": classes})


def random_changes(grid: hn.OccupancyGrid, count: int) -> Iterator[tuple[Classes, Box]]:
    """Yield maps with things put into them and taken away, and the box of each change."""
    rng = np.random.default_rng(0)
    classes = grid.classes.copy()
    for _ in range(count):
        high, wide = rng.integers(2, 20, 2)
        row = int(rng.integers(0, grid.shape[0] - high))
        col = int(rng.integers(0, grid.shape[1] - wide))
        part = slice(row, row + high), slice(col, col + wide)
        classes[part] = grid.classes[part] if rng.random() < 0.5 else rng.integers(0, 3)
        yield classes.copy(), (row, col, row + int(high) - 1, col + int(wide) - 1)


def exploration(grid: hn.OccupancyGrid, count: int) -> Iterator[tuple[Classes, Box]]:
    """Yield what a robot knows that drives over a map from free cell to free cell, by steps."""
    known = np.full(grid.shape, 2, np.uint8)
    rows, cols = np.nonzero(grid.classes == 1)
    order = np.lexsort((rows, cols // SIGHT))
    for at in order[np.linspace(0, len(order) - 1, count).astype(int)].tolist():
        row, col = int(rows[at]), int(cols[at])
        part = slice(max(row - SIGHT, 0), row + SIGHT), slice(max(col - SIGHT, 0), col + SIGHT)
        known[part] = grid.classes[part]
        last = min(row + SIGHT, grid.shape[0]) - 1, min(col + SIGHT, grid.shape[1]) - 1
        yield known.copy(), (max(row - SIGHT, 0), max(col - SIGHT, 0), *last)


def follow(
    version: OnlinePyramid, grid: hn.OccupancyGrid, steps: Iterator[tuple[Classes, Box]]
) -> Run:
    """Update a version step by step."""
    seconds, flips, seen = [], 0, 0
    for classes, box in steps:
        now = with_classes(grid, classes)
        began = time.perf_counter()
        update = version.update(now, changed=box)
        seconds.append(time.perf_counter() - began)
        flips, seen = flips + len(update.died), seen + version.n_places
        version = update.version
    return Run(seconds, flips, seen, version)


def show(name: str, run: Run, distance_m: float) -> None:
    """Print a row of the first table."""
    fresh = hn.DualGraphPyramid.build(run.version.grid, merge_distance_m=distance_m)
    median, high = np.percentile(run.seconds, [50, 95]) * 1000
    places = fresh[fresh.place_level].n_vertices
    print(
        f"| {name} | {len(run.seconds)} | {median:.1f} | {high:.1f} | {run.version.n_places} | "
        f"{run.version.n_places / places - 1:+.1%} | {run.flips / max(run.seen, 1):.2%} |"
    )


def growth() -> None:
    """Print the time of one change on maps of several sizes, and of a fresh build of each."""
    print("\n| cells | an update, ms | a fresh build, ms | ratio |")
    print("|---|---|---|---|")
    tile = np.ones((250, 250), np.uint8)
    tile[::125] = tile[:, ::125] = 0
    tile[50:60, ::125] = tile[::125, 50:60] = tile[180:190, ::125] = tile[::125, 180:190] = 1
    for side in SIDES:
        classes = np.tile(tile, (side // 250, side // 250))
        probability = np.where(classes == 0, np.float32(1), np.float32(0))
        grid = hn.OccupancyGrid(probability, hn.Frame(0.05), robot_radius_m=0)
        version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid))
        built = time.perf_counter()
        hn.DualGraphPyramid.build(grid)
        fresh = time.perf_counter() - built
        taken = []
        low = side // 2 + 20
        box = (low, low, low + CHANGE - 1, low + CHANGE - 1)
        for turn in range(11):
            changed = classes.copy()
            if turn % 2 == 0:
                changed[low : low + CHANGE, low : low + CHANGE] = 0
            now = with_classes(grid, changed)
            start = time.perf_counter()
            version = version.update(now, changed=box).version
            taken.append(time.perf_counter() - start)
        update = float(np.median(taken[1:]))
        print(
            f"| {side * side:,} | {update * 1e3:.1f} | {fresh * 1e3:.0f} | {fresh / update:.0f} |"
        )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("--updates", type=int, default=1000)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    print("| map | updates | median, ms | p95, ms | places | against a fresh build | ids lost |")
    print("|---|---|---|---|---|---|---|")
    office = hn.load_map(OFFICE, robot_radius_m=RADIUS_M)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(office))
    follow(version, office, random_changes(office, 10))  # loads the kernels
    show("office", follow(version, office, random_changes(office, arguments.updates)), 4.0)
    if arguments.data:
        intel = hn.load_map(Path(arguments.data) / INTEL, robot_radius_m=0)
        unknown = with_classes(intel, np.full(intel.shape, 2, np.uint8))
        version = OnlinePyramid.of(hn.DualGraphPyramid.build(unknown))
        show("Intel", follow(version, unknown, exploration(intel, arguments.updates)), 4.0)
    growth()


if __name__ == "__main__":
    main()
