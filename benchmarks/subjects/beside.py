"""Answers and times of this checkout against those of another one, commit by commit.

    git worktree add /tmp/before 3a4f805a4  # before anything had a direction
    python -m benchmarks beside --other /tmp/before/src --data FOLDER --map 'ros/*'

Each of the two has a process of its own; they plan the same pairs in turn, one of the two first
and then the other. The maps: the office, and those of FOLDER that a glob of `--map` matches. For
each preset, without costs and with those of clearance where it takes them, and with a square closed
on the way, a line says how many answers differ in any bit: status, cost, bound, points, cells, and
the proof of every sixth. Times are those of the processor, the least of `--runs`; the ratio is
the median of those by pair, this checkout over the other one. Exits with 1 if an answer differs.
"""

from __future__ import annotations

import hashlib
import json
import sys
import time
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import hybridnav as hn
from benchmarks.common import (
    DATA,
    ROOT,
    SEED,
    Checkout,
    largest_part,
    office_and_maps,
    option,
    print_head,
    print_load,
    print_row,
    read,
    timed,
)

if TYPE_CHECKING:
    from argparse import Namespace

PRESETS = "shortest", "octile", "grid-astar", "paper", "robot"
BY_COSTS = "grid-astar", "paper", "robot"
"""Presets that are asked with costs of clearance too."""
PROVED = 6
"""One of so many answers is proved."""
CORNERS_M = 0.4 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
"""Of the square that is closed half-way, less its middle."""
_CODE = "from benchmarks.subjects.beside import answer_all; answer_all()"
Ends = tuple[tuple[float, float], tuple[float, float]]


def answer_all() -> None:
    """Answer the questions of standard input: a map to plan on, or a pair to plan."""
    planner: Any = None
    told: Any
    asked = count()
    for line in sys.stdin:
        question = json.loads(line)
        if isinstance(question[0], str):
            planner = planner_of(*question)
            told = hn.__file__
        else:
            told = answered(planner, question, next(asked))
        sys.stdout.write(json.dumps(told) + "\n")
        sys.stdout.flush()


def planner_of(path: str, preset: str, by_costs: int) -> hn.HybridPlanner:
    """Return a planner that has what it plans on."""
    grid = read(Path(path))
    costs = hn.CostLayer.clearance(grid) if by_costs else None
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    planner = hn.HybridPlanner(topology, preset=preset, costs=costs)
    planner.prepare()
    return planner


def answered(planner: hn.HybridPlanner, question: list[Any], n_before: int) -> list[Any]:
    """Return a digest of an answer, the seconds that it took, and the middle of its path."""
    start, goal, closed, runs = question
    blocked = hn.Blocked(polygons=[(closed + CORNERS_M).tolist()]) if closed else None
    result, seconds = timed(
        lambda: planner.plan(start, goal, blocked=blocked), runs, time.thread_time
    )
    parts = [str(result.status), repr(result.cost), repr(result.lower_bound)]
    middle = None
    if result.path is not None:
        path = result.path
        parts += [path.points.tobytes().hex(), str(path.cells.tolist())]
        middle = path.points[len(path.points) // 2, :2].tolist()
        by_others = planner.costs is not None and planner.preset.name == "robot"  # has no proof
        if n_before % PROVED == 0 and not by_others:
            proof = hn.prove(result)
            parts.append(json.dumps(proof | {"one_way": None}, sort_keys=True))
    return [hashlib.sha256("".join(parts).encode()).hexdigest(), seconds, middle]


def measure(name: str, workers: list[Checkout], ends: list[Ends], runs: int) -> int:
    """Print the line of a map and a preset; return how many answers differ."""
    ratios, times, wrong, n_asked = list[float](), list[float](), 0, 0
    for k, pair in enumerate(ends):
        closed = None
        for _ in range(2):  # as it is, and with a square closed on the way
            order = workers[:: 1 if k % 2 else -1]
            told = [worker.ask(*pair, closed, runs) for worker in order][:: 1 if k % 2 else -1]
            (mine, mine_s, closed), (other, other_s, _) = told
            wrong, n_asked = wrong + (mine != other), n_asked + 1
            ratios.append(mine_s / other_s)
            times.append(other_s * 1e6)
            if closed is None:
                break
    figures = f"{np.median(times):.0f}", f"{np.median(ratios):.2f}"
    print_row(name, n_asked, wrong, *figures)
    return wrong


OPTIONS = [
    DATA,
    option("--other", type=Path, required=True, metavar="SRC", help="sources of the other one"),
    option("--map", action="append", default=[], metavar="GLOB"),
    option("--preset", action="append", default=[], metavar="NAME"),
    option("--pairs", type=int, default=60),
    option("--runs", type=int, default=3),
    SEED,
]


def main(given: Namespace) -> int:
    """Run the program."""
    workers = [Checkout(sources, _CODE) for sources in (ROOT / "src", given.other)]
    print_load()
    print_head("map, preset", "answers", "differ", "us before", "ratio")
    wrong = 0
    for name, file in office_and_maps(given).items():
        grid, rng = read(file), np.random.default_rng(given.seed)
        cells = largest_part(grid.enterable())
        ends = [
            grid.frame.points_of(rng.choice(cells, 2, replace=False)).tolist()
            for _ in range(given.pairs)
        ]
        for preset in given.preset or PRESETS:
            for by_costs in range(1 + (preset in BY_COSTS)):
                used = [worker.ask(str(file), preset, by_costs) for worker in workers]
                assert used[0] != used[1]  # noqa: S101 - two checkouts
                about = f"{name}, {preset}{', costs' * by_costs}"
                wrong += measure(about, workers, ends, given.runs)
    for worker in workers:
        worker.process.communicate()
    print(f"{wrong} answers differ")
    return int(wrong > 0)
