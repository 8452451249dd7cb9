"""What blocks do to the pyramid: places and time of a build with them and without.

`--data` (or HYBRIDNAV_DATA) adds real maps to the office. Means over four seeds.
"""

from __future__ import annotations

import statistics
import sys
import time
from typing import TYPE_CHECKING
from unittest import mock

import hybridnav as hn
from benchmarks.common import DATA, OFFICE, print_head, print_row, read

if TYPE_CHECKING:
    from argparse import Namespace

    from hybridnav.pyramid import Linkage

MAPS = ("nav2/maps/depot.yaml", "bwi_gdc/3/3.yaml", "willow/willow-2010-02-18-0.10.yaml")
LINKAGES: tuple[Linkage, ...] = ("radius", "diameter")
SEEDS = range(4)


def measure(grid: hn.OccupancyGrid, distance_m: float, linkage: Linkage) -> tuple[float, float]:
    """Mean number of places, and seconds of processor a build."""
    places, seconds = [], []
    for seed in SEEDS:
        began = time.process_time()
        pyramid = hn.DualGraphPyramid.build(
            grid, merge_distance_m=distance_m, linkage=linkage, seed=seed
        )
        seconds.append(time.process_time() - began)
        places.append(pyramid[-1].n_vertices)
    return statistics.mean(places), statistics.median(seconds)


OPTIONS = [DATA]


def main(given: Namespace) -> None:
    """Print the table."""
    paths = [OFFICE] + ([given.data / name for name in MAPS] if given.data else [])
    print_head("map", "U_d, m", "linkage", "places", "without blocks", "change", "build time")
    changes: dict[str, list[float]] = {linkage: [] for linkage in LINKAGES}
    hn.DualGraphPyramid.build(read(OFFICE, 0))
    for path in paths:
        grid = read(path)
        for distance_m in (1.0, 2.0, 4.0):
            for linkage in LINKAGES:
                places, seconds = measure(grid, distance_m, linkage)
                with mock.patch("hybridnav.pyramid.start.max_power", return_value=0):
                    plain, plain_seconds = measure(grid, distance_m, linkage)
                changes[linkage].append(places / plain - 1)
                figures = f"{places:.0f}", f"{plain:.0f}", f"{changes[linkage][-1]:+.1%}"
                times = f"{seconds / plain_seconds:.2f} x"
                print_row(path.stem, f"{distance_m:g}", linkage, *figures, times)
    for name, values in changes.items():
        sys.stdout.write(
            f"{name}: {min(values):+.1%} to {max(values):+.1%}, "
            f"mean {statistics.mean(values):+.1%}\n"
        )
