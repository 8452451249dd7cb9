"""The table of alternatives: seconds for three of them between random points, by doors and by
homotopy.

    python -m benchmarks.alternatives [--data FOLDER] [--pairs 30] [--seed 0] [--homotopy]

The office of `maps/office`, and from FOLDER the maps of Willow Garage and of GDC floors 2, 3 and
3ne; robot radius 0.25 m, preset `shortest`, rooms found. Points are cells drawn from the largest
connected part. `prepare` is the time of the first query, which measures the rooms; then for each
pair the time of all alternatives, median and longest, over that of the plain plan alone in the
median, the number of pairs with one, two and three alternatives, the greatest overlap and stretch,
and the number of second alternatives that pass the same doors as the first. With `--homotopy` the
same for homotopy classes.
"""

from __future__ import annotations

import argparse
import os
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

import hybridnav as hn

if TYPE_CHECKING:
    from hybridnav.planner.alternatives import By

ROOT = Path(__file__).parents[1]
MAPS = {
    "Willow Garage": "willow/willow-2010-02-18-0.10.yaml",
    "GDC floor 2": "bwi_gdc/2/2.yaml",
    "GDC floor 3": "bwi_gdc/3/3.yaml",
    "GDC floor 3ne": "bwi_gdc/3ne/3ne.yaml",
}
WANTED = 3


def planner_of(file: Path) -> hn.HybridPlanner:
    """A planner that is prepared, of a map with rooms."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        grid = hn.load_map(file, robot_radius_m=0.25)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid))
    planner = hn.HybridPlanner(hn.TopologicalMap(pyramid))
    planner.prepare()
    return planner


def pairs_of(planner: hn.HybridPlanner, count: int, seed: int) -> list[np.ndarray]:
    """Pairs of points of the largest connected part."""
    grid = planner.topology.grid
    parts, _ = ndimage.label(grid.enterable())
    largest = np.argwhere(parts == np.bincount(parts.ravel())[1:].argmax() + 1)
    drawn = np.random.default_rng(seed).choice(largest, (count, 2))
    return [grid.frame.points_of(pair) for pair in drawn]


def row_of(planner: hn.HybridPlanner, pairs: list[np.ndarray], by: By) -> list[str]:
    """The figures of one map."""
    began = time.perf_counter()
    hn.plan_alternatives(planner, pairs[0][0], pairs[0][1], WANTED, by=by)
    prepare_s = time.perf_counter() - began
    spent_s, plain_s, counts, overlaps, stretches, same = [], [], [0] * WANTED, [0.0], [1.0], 0
    stopped = 0
    for pair in pairs:
        began = time.perf_counter()
        planner.plan(*pair)
        plain_s.append(time.perf_counter() - began)
        began = time.perf_counter()
        found = hn.plan_alternatives(planner, pair[0], pair[1], WANTED, by=by)
        spent_s.append(time.perf_counter() - began)
        counts[len(found) - 1] += 1
        stopped += not found.complete
        overlaps += [other.overlap for other in found]
        stretches += [other.path.length_m / found[0].path.length_m for other in found]
        same += len(found) > 1 and found[1].doors == found[0].doors
    return [
        f"{prepare_s:.2f} s",
        f"{np.median(spent_s) * 1000:.0f} ms",
        f"{max(spent_s) * 1000:.0f} ms",
        f"{np.median(plain_s) * 1000:.1f} ms",
        " / ".join(map(str, counts)),
        str(stopped),
        f"{max(overlaps):.0%}",
        f"{max(stretches):.2f}",
        str(same),
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--homotopy", action="store_true")
    options = parser.parse_args()
    files = {"office": ROOT / "maps" / "office" / "office.yaml"}
    if options.data is not None:
        files |= {name: Path(options.data) / file for name, file in MAPS.items()}
    print("| map | by | prepare | median | longest | plain | 1 / 2 / 3 | stopped |", end="")
    print(" overlap | stretch | same doors |")
    print("|" + "---|" * 11)
    for name, file in files.items():
        planner = planner_of(file)
        pairs = pairs_of(planner, options.pairs, options.seed)
        asked: tuple[By, ...] = ("doors", "homotopy") if options.homotopy else ("doors",)
        for by in asked:
            print("|", " | ".join([name, by, *row_of(planner, pairs, by)]), "|", flush=True)


if __name__ == "__main__":
    main()
