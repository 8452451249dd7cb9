"""What blocks do to the pyramid: places and time of a build with them and without.

    python -m benchmarks.blocks [--data FOLDER]

`--data` (or HYBRIDNAV_DATA) adds real maps to the office. Means over four seeds.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING
from unittest import mock

import hybridnav as hn
from benchmarks.chain import OFFICE, RADIUS_M

if TYPE_CHECKING:
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


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    data = parser.parse_args().data
    warnings.simplefilter("ignore")
    paths = [OFFICE] + ([Path(data) / name for name in MAPS] if data else [])
    print("| map | U_d, m | linkage | places | without blocks | change | build time |")
    print("|---|---|---|---|---|---|---|")
    changes: dict[str, list[float]] = {linkage: [] for linkage in LINKAGES}
    hn.DualGraphPyramid.build(hn.load_map(OFFICE, robot_radius_m=0))
    for path in paths:
        grid = hn.load_map(path, robot_radius_m=RADIUS_M)
        for distance_m in (1.0, 2.0, 4.0):
            for linkage in LINKAGES:
                places, seconds = measure(grid, distance_m, linkage)
                with mock.patch("hybridnav.pyramid.start.max_power", return_value=0):
                    plain, plain_seconds = measure(grid, distance_m, linkage)
                changes[linkage].append(places / plain - 1)
                print(
                    f"| {path.stem} | {distance_m:g} | {linkage} | {places:.0f} | {plain:.0f} "
                    f"| {changes[linkage][-1]:+.1%} | {seconds / plain_seconds:.2f} x |"
                )
    for name, values in changes.items():
        sys.stdout.write(
            f"{name}: {min(values):+.1%} to {max(values):+.1%}, "
            f"mean {statistics.mean(values):+.1%}\n"
        )


if __name__ == "__main__":
    main()
