"""What a second thread on one planner is worth: queries per second of two threads over one.

    python -m benchmarks.threads [--map FILE] [--seconds S] [--many]

Two cores that do nothing else answer nearly twice as many; the load of the machine is printed
beside. A single look-up is over before Python has prepared the next one, for which it holds its
lock; with `--many` each thread asks for all pairs in one call of `plan_many`. Presets with OMPL
answer one query after the other and are left out.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks.chain import OFFICE, RADIUS_M
from hybridnav.harness.pairs import sample_pairs

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray

ROUNDS = 5


def per_second(
    planner: hn.HybridPlanner,
    endpoints: list[tuple[FloatArray, FloatArray]],
    n_threads: int,
    time_s: float,
    *,
    many: bool = False,
) -> float:
    """Queries answered per second by so many threads, each with all pairs in its own order."""
    starts, goals = (np.array(side) for side in zip(*endpoints, strict=True))
    counts = [0] * n_threads
    start = threading.Barrier(n_threads + 1)

    def work(number: int) -> None:
        at = number * len(endpoints) // n_threads
        start.wait()
        until = time.perf_counter() + time_s
        while time.perf_counter() < until:
            if many:
                planner.plan_many(starts, goals)
            else:
                planner.plan(*endpoints[at % len(endpoints)])
            counts[number] += len(endpoints) if many else 1
            at += 1

    threads = [threading.Thread(target=work, args=(number,)) for number in range(n_threads)]
    for thread in threads:
        thread.start()
    start.wait()
    began = time.perf_counter()
    for thread in threads:
        thread.join()
    return sum(counts) / (time.perf_counter() - began)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--map", type=Path, default=OFFICE)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--many", action="store_true", help="one call for all pairs")
    options = parser.parse_args()
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(hn.load_map(options.map, robot_radius_m=RADIUS_M))
    )
    pairs = sample_pairs(topology.grid, 100, seed=0)
    frame = topology.grid.frame
    endpoints = [(frame.points_of(pair.start), frame.points_of(pair.goal)) for pair in pairs]
    sys.stdout.write(f"{options.map.stem}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")
    print("| preset | queries/s, one thread | two threads | ratio |")
    print("|---|---|---|---|")
    for preset in hn.preset_names():
        if preset == "ompl":
            continue
        planner = hn.HybridPlanner(topology, preset=preset)
        per_second(planner, endpoints, 2, options.seconds, many=options.many)
        # In turns, so that what else the machine does meets both.
        rates = [
            [
                per_second(planner, endpoints, n_threads, options.seconds, many=options.many)
                for n_threads in (1, 2)
            ]
            for _ in range(ROUNDS)
        ]
        one, two = (statistics.median(column) for column in zip(*rates, strict=True))
        ratio = statistics.median(rate[1] / rate[0] for rate in rates)
        print(f"| {preset} | {one:.0f} | {two:.0f} | {ratio:.2f} |")
    sys.stdout.write(f"load {os.getloadavg()[0]:.1f} at the end\n")


if __name__ == "__main__":
    main()
