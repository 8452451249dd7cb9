"""Plans of the preset `robot`, against another checkout: times, costs, and how steady they are.

    git worktree add /tmp/before 4f9a53394
    python -m benchmarks robot_speed --old /tmp/before --data FOLDER

Each checkout has a process of its own; the two plan the same pairs in turn, and read the points of
the paths. Times are those of the processor, the least of `--runs`; the maps are those of the study.
Columns:

    us before       median by pair of the other checkout
    ratio           median by pair of the times, this checkout over the other one
    cost            mean by pair of what this one costs more, and the most, in %
    above           pairs that cost more by over 0.3 %
    gap             mean of the proved gap, other and this checkout, %
    steady          part of the plans from points along a line, to its goal, that stay within a cell
                    of its rest, other and this checkout, %
"""

import json
import sys
import time
from argparse import Namespace
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

import hybridnav as hn
from benchmarks.common import (
    NEEDED_DATA,
    OFFICE,
    ROOT,
    SEED,
    Checkout,
    largest_part,
    option,
    print_head,
    print_load,
    print_row,
    read,
    timed,
)
from benchmarks.subjects._study_maps import maps_of
from benchmarks.subjects.robot import strayed_cells

N_ALONG = 50
"""Plans from points along a line."""
MOST = 0.3
"""Percent that a pair may cost more."""
_CODE = "from benchmarks.subjects.robot_speed import answer_all; answer_all()"


def answer_all() -> None:
    """Answer the questions of standard input: plans, gaps, or plans along a line."""

    @cache
    def planner_of(path: str) -> hn.HybridPlanner:
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(read(Path(path))))
        planner = hn.HybridPlanner(topology, preset="robot")
        planner.prepare()
        return planner

    for line in sys.stdin:
        what, path, start, goal, runs = json.loads(line)
        planner = planner_of(path)
        told: Any = None
        if what == "plan":

            def plan() -> Any:
                result = planner.plan(start, goal)  # noqa: B023 - called at once
                return result.cost, result.path and result.path.points

            (told, _), seconds = timed(plan, runs, time.thread_time)
            told = told, seconds
        elif what == "gap":
            told = planner.plan(start, goal).gap
        else:
            found = planner.plan(start, goal, smooth="line-of-sight").path
            assert found is not None  # noqa: S101 - ends lie in one part
            cell_m = planner.grid.resolution_m
            told = strayed_cells(planner, found.points, N_ALONG, cell_m)
        sys.stdout.write(json.dumps(told) + "\n")
        sys.stdout.flush()


def measured(workers: list[Checkout], file: Path, given: Namespace) -> dict[str, Any]:
    """Return the figures of one map, by pair, the other checkout first."""
    grid = read(file)
    drawn = np.random.default_rng(given.seed).choice(
        largest_part(grid.enterable()), (given.pairs, 2)
    )
    pairs = grid.frame.points_of(drawn.reshape(-1, 2)).reshape(-1, 2, 2).tolist()
    costs, seconds, gaps = [], [], []
    for k, pair in enumerate(pairs):
        turn = 1 if k % 2 else -1
        if k == 0:  # kernels load
            for worker in workers:
                worker.ask("gap", str(file), *pair, 1)
        told = [worker.ask("plan", str(file), *pair, given.runs) for worker in workers[::turn]]
        costs.append([each[0] for each in told[::turn]])
        seconds.append([each[1] for each in told[::turn]])
        if k < given.gaps:
            gaps.append([worker.ask("gap", str(file), *pair, 1) for worker in workers])
    strayed: list[list[float]] = [[], []]
    for pair in pairs[: given.steady]:
        for each, worker in zip(strayed, workers, strict=True):
            each.extend(worker.ask("steady", str(file), *pair, 1))
    return {
        "cost": np.array(costs),
        "seconds": np.array(seconds),
        "gap": np.array(gaps).reshape(-1, 2),
        "strayed": strayed,
    }


def row(name: str, found: dict[str, Any]) -> None:
    """Print the line of a map."""
    more = 100 * (found["cost"][:, 1] / found["cost"][:, 0] - 1)
    steady = [f"{100 * np.mean(np.array(each) <= 1):.1f}" for each in found["strayed"] if each]
    print_row(
        name,
        f"{1e6 * np.median(found['seconds'][:, 0]):.0f}",
        f"{np.median(found['seconds'][:, 1] / found['seconds'][:, 0]):.2f}",
        f"{more.mean():+.3f}, {more.max():+.2f}",
        int((more > MOST).sum()),
        " / ".join(f"{100 * np.mean(each):.2f}" for each in found["gap"].T if each.size),
        " / ".join(steady),
    )


OPTIONS = [
    NEEDED_DATA,
    option("--old", type=Path, required=True, metavar="PATH", help="another checkout"),
    option("--map", action="append", default=[], metavar="GLOB"),
    option("--pairs", type=int, default=40),
    option("--runs", type=int, default=3),
    option("--gaps", type=int, default=10, help="pairs whose gap is proved"),
    option("--steady", type=int, default=6, help="pairs that are planned again along their lines"),
    SEED,
]


def main(given: Namespace) -> None:
    """Print the table."""
    workers = [Checkout(path / "src", _CODE) for path in (given.old, ROOT)]
    print_load()
    print_head("map", "us before", "ratio", "cost", "above", "gap", "steady")
    every: list[dict[str, Any]] = []
    files = [] if given.map else [OFFICE]
    for file in files + [one.path for one in maps_of(given.data, given.map)]:
        every.append(measured(workers, file, given))
        row(f"{file.parent.name}/{file.stem}", every[-1])
    arrays = "cost", "seconds", "gap"
    whole: dict[str, Any] = {key: np.concatenate([each[key] for each in every]) for key in arrays}
    both = zip(*(each["strayed"] for each in every), strict=True)
    row("all pairs", whole | {"strayed": [list(chain(*side)) for side in both]})
    medians = [np.median(each["seconds"][:, 1] / each["seconds"][:, 0]) for each in every]
    print(f"ratio: median of the maps {np.median(medians):.2f}, most {max(medians):.2f}")
    print_load()
    for worker in workers:
        worker.process.communicate()
