"""The table of alternatives: time for three of them between random points.

The office of `maps/office`, and from FOLDER the maps of Willow Garage and of GDC floors 2, 3 and
3ne; robot radius 0.25 m, preset `shortest`, rooms found. Points are cells drawn from the largest
connected part, and times are those of one processor. The columns:

    prepare     the first query, which measures the rooms
    median      all alternatives of a pair
    longest     the same
    plain       the plain plan alone, in the median
    1 / 2 / 3   pairs with as many alternatives
    stopped     pairs for which the search stopped early
    overlap     the greatest share of an alternative in common with a shorter one
    stretch     the greatest length of one over that of the first
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks.common import (
    DATA,
    OFFICE,
    SEED,
    largest_part,
    option,
    prepared,
    print_head,
    print_row,
    read,
)

if TYPE_CHECKING:
    from argparse import Namespace

MAPS = {
    "Willow Garage": "willow/willow-2010-02-18-0.10.yaml",
    "GDC floor 2": "bwi_gdc/2/2.yaml",
    "GDC floor 3": "bwi_gdc/3/3.yaml",
    "GDC floor 3ne": "bwi_gdc/3ne/3ne.yaml",
}
WANTED = 3


def pairs_of(planner: hn.HybridPlanner, count: int, seed: int) -> list[np.ndarray]:
    """Pairs of points of the largest connected part."""
    grid = planner.topology.grid
    drawn = np.random.default_rng(seed).choice(largest_part(grid.enterable()), (count, 2))
    return [grid.frame.points_of(pair) for pair in drawn]


def row_of(planner: hn.HybridPlanner, pairs: list[np.ndarray]) -> list[str]:
    """The figures of one map."""
    began = time.process_time()
    hn.plan_alternatives(planner, pairs[0][0], pairs[0][1], WANTED)
    prepare_s = time.process_time() - began
    spent_s, plain_s, counts, overlaps, stretches = [], [], [0] * WANTED, [0.0], [1.0]
    stopped = 0
    for pair in pairs:
        began = time.process_time()
        planner.plan(*pair)
        plain_s.append(time.process_time() - began)
        began = time.process_time()
        found = hn.plan_alternatives(planner, pair[0], pair[1], WANTED)
        spent_s.append(time.process_time() - began)
        counts[len(found) - 1] += 1
        stopped += not found.complete
        overlaps += [other.overlap for other in found]
        stretches += [other.path.length_m / found[0].path.length_m for other in found]
    return [
        f"{prepare_s:.2f} s",
        f"{np.median(spent_s) * 1000:.0f} ms",
        f"{max(spent_s) * 1000:.0f} ms",
        f"{np.median(plain_s) * 1000:.1f} ms",
        " / ".join(map(str, counts)),
        str(stopped),
        f"{max(overlaps):.0%}",
        f"{max(stretches):.2f}",
    ]


OPTIONS = [
    DATA,
    option("--pairs", type=int, default=30),
    SEED,
]


def main(given: Namespace) -> None:
    """Print the table."""
    files = {"office": OFFICE}
    if given.data is not None:
        files |= {name: given.data / file for name, file in MAPS.items()}
    columns = "map", "prepare", "median", "longest", "plain", "1 / 2 / 3", "stopped"
    print_head(*columns, "overlap", "stretch")
    for name, file in files.items():
        planner = prepared(read(file), rooms=True)
        pairs = pairs_of(planner, given.pairs, given.seed)
        print_row(name, *row_of(planner, pairs))
