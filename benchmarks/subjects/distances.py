"""Tables of distances: 1,000 starts by 1,000 goals, against plans of single pairs.

The costs of a sample of pairs are compared with those of `plan_many`: the exit code is 1 if one
differs by more than 1e-9 of it.
"""

import time
from argparse import Namespace

import numpy as np

import hybridnav as hn
from benchmarks.common import OFFICE, read
from benchmarks.options import NEEDED_DATA, option
from benchmarks.tables import print_head, print_load, print_row
from hybridnav.maps import CellClass

MAPS = ("bwi_gdc/3/3.yaml", "strands/tsc_y4/tsc_1701.yaml", "fetch_maps/4_26_15.yaml")
COLUMNS = ("map", "preset", "us a pair", "`plan_many`, us", "times", "most off, m", "no path, %")
OPTIONS = (
    NEEDED_DATA,
    option("--ends", type=int, default=1000, help="starts, and goals"),
    option("--sample", type=int, default=2000, help="pairs that are planned"),
)


def main(given: Namespace) -> int:
    """Print the table."""
    print_load()
    print_head(*COLUMNS)
    is_wrong = False
    for path in (OFFICE, *(given.data / name for name in MAPS)):
        grid = read(path)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        rng = np.random.default_rng(0)
        cells = rng.choice(np.argwhere(grid.classes == CellClass.FREE), (2, given.ends))
        starts, goals = grid.frame.points_of_grid(cells + rng.random(cells.shape))
        pairs = rng.integers(given.ends, size=(2, given.sample))
        for preset in ("shortest", "octile"):
            planner = hn.HybridPlanner(topology, preset=preset)
            planner.prepare()
            planner.distances(starts[:8], goals[:8])  # compiles
            seconds = []
            for _ in range(3):
                begun = time.perf_counter()
                table = planner.distances(starts, goals)
                seconds.append(time.perf_counter() - begun)
            us = min(seconds) / table.size * 1e6
            begun = time.perf_counter()
            costs = planner.plan_many(starts[pairs[0]], goals[pairs[1]]).cost
            pair_us = (time.perf_counter() - begun) / given.sample * 1e6
            found, reached = table[tuple(pairs)], np.isfinite(costs)
            off = np.abs(np.where(reached, found, 0) - np.where(reached, costs, 0))
            wrong = (np.isfinite(found) != reached) | (
                off > 1e-9 * np.where(reached, costs, 1) + 1e-8
            )
            is_wrong |= bool(wrong.any())
            shares = f"{us:.2f}", f"{pair_us:.0f}", f"{pair_us / us:.0f}", f"{off.max():.0e}"
            print_row(path.stem, preset, *shares, f"{(1 - reached.mean()) * 100:.0f}")
    return int(is_wrong)
