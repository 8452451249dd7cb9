"""Border cells of regions, beside those of as many fields that the merge distance alone makes.

    python -m benchmarks.regions [--data FOLDER]

`--data` (or HYBRIDNAV_DATA) adds real maps to the office. The fields of version 0.1 were the places
of a second pyramid (linkage `survivor`, a larger merge distance); the regions are those of the one
pyramid, by the expansion rating. Fields below a hundredth of the largest do not count, but their
border cells do.
"""

from __future__ import annotations

import argparse
import os
import time
import warnings
from pathlib import Path

import numpy as np

import hybridnav as hn
from benchmarks.chain import OFFICE, RADIUS_M
from hybridnav._base.moves import legal_moves, moves_along

MAPS = (
    "nav2/maps/depot.yaml",
    "bwi_gdc/3/3.yaml",
    "willow/willow-2010-02-18-0.10.yaml",
    "any_angle_optima/tsc_y4.map",
)
MERGE_DISTANCE_M = 4.0
LEAST_FIELDS = 3
FACTORS = (1, 2, 4, 8)
"""Merge distances of the fields by that of the places."""


def fields_and_border(grid: hn.OccupancyGrid, level: hn.Level) -> tuple[int, int]:
    """Count the large free fields of a level, and all cells with a move to another field."""
    free = grid.enterable()
    areas = np.bincount(level.field_of[free], minlength=1)
    moves = legal_moves(np.ascontiguousarray(free), grid.corner_cutting).ravel()
    label, is_border = level.field_of.ravel(), np.zeros(free.size, dtype=np.bool_)
    for direction in range(8):
        tail, head = moves_along(moves, free.shape[1], direction)
        is_border[tail[label[tail] != label[head]]] = True
    return int((areas > areas.max() / 100).sum()), int(is_border.sum())


def as_many(
    grid: hn.OccupancyGrid, pyramid: hn.DualGraphPyramid, wanted: int
) -> tuple[int, int, float]:
    """Return fields, border cells and seconds of the regions whose number is nearest."""
    low, high = 1, int(grid.enterable().sum())
    tried = []
    while high - low > max(low // 20, 1):
        middle = (low + high) // 2
        began = time.perf_counter()
        level = pyramid.with_regions(middle)
        seconds = time.perf_counter() - began
        n_fields, n_border = fields_and_border(grid, level[level.region_level])
        tried.append((n_fields, n_border, seconds))
        low, high = (middle, high) if n_fields > wanted else (low, middle)
    return min(tried, key=lambda found: abs(found[0] - wanted))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    data = parser.parse_args().data
    warnings.simplefilter("ignore")
    print("| map | fields by merge distance: number, border cells | regions | ratio |")
    print("|---|---|---|---|")
    for path in [OFFICE] + ([Path(data) / name for name in MAPS] if data else []):
        is_metric = path.suffix == ".yaml"  # MovingAI's cells are 1 m
        grid = hn.load_map(path, robot_radius_m=RADIUS_M if is_metric else 0)
        distance_m = MERGE_DISTANCE_M * (1 if is_metric else 20)
        pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m)
        for factor in FACTORS:
            fields = hn.DualGraphPyramid.build(
                grid, merge_distance_m=factor * distance_m, linkage="survivor"
            )
            n_old, border_old = fields_and_border(grid, fields[-1])
            if n_old < LEAST_FIELDS:
                continue
            n_new, border_new, seconds = as_many(grid, pyramid, n_old)
            ratio = border_new / border_old
            regions = f"{n_new}, {border_new:,} ({seconds:.2f} s)"
            print(f"| {path.stem} | {n_old}, {border_old:,} | {regions} | {ratio:.2f} |")


if __name__ == "__main__":
    main()
