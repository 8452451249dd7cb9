"""The table of directions: queries with one-way doors, against those without.

The office of `maps/office`, and the maps whose path in FOLDER a glob of `--map` matches; robot
radius 0.25 m, on MovingAI maps 0. Rooms and doors are found in the map. `--sets` times so many
doors as `--doors` says are drawn, each to be passed one way only, and `--pairs` pairs of points,
cells of the largest connected part. Each pair is planned without the directions and with them, in
turn, the least of three times each. A cell of the table is the median of the ratios, time of the
processor with directions over that without, and in brackets how many pairs:

    all       all pairs
    same      the path without directions is legal, or another one costs as much
    other     another path costs more
    none      there is no legal path
    first     the first query with a set of doors, once for each set
    us        the median time of a query without directions, microseconds
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

import hybridnav as hn
from benchmarks.common import (
    DATA,
    SEED,
    largest_part,
    office_and_maps,
    option,
    prepared,
    print_head,
    print_load,
    print_row,
    read,
    timed,
)

if TYPE_CHECKING:
    from argparse import Namespace

    from numpy.typing import NDArray

COLUMNS = ("all", "same", "other", "none", "first")
RUNS = 3
SAME = 1e-9
"""Metres by which paths of one length may differ."""


def drawn(planner: hn.HybridPlanner, n_doors: int, rng: np.random.Generator) -> hn.OneWay:
    """Draw doors of a map, and for each the room into which it leads."""
    doors = [door for door in planner.topology.rooms.doors if door.passable]
    chosen = rng.permutation(len(doors))[:n_doors].tolist()
    return hn.OneWay(doors=[(doors[k].number, doors[k].rooms[rng.integers(2)]) for k in chosen])


def asked(
    planner: hn.HybridPlanner, ends: NDArray[np.float64], one_way: hn.OneWay | None, runs: int
) -> tuple[Any, float]:
    """Plan one pair some times; return the answer, and the least seconds."""
    return timed(lambda: planner.plan(*ends, one_way=one_way), runs, time.thread_time)


def measure(name: str, planner: hn.HybridPlanner, given: Namespace) -> None:
    """Print the line of one map and preset."""
    grid, rng = planner.topology.grid, np.random.default_rng(given.seed)
    cells, times = largest_part(grid.enterable()), list[float]()
    ratios: dict[str, list[float]] = {column: [] for column in COLUMNS}
    for _ in range(given.sets):
        one_way, is_first = drawn(planner, given.doors, rng), True
        for _ in range(given.pairs):
            ends = grid.frame.points_of(rng.choice(cells, 2, replace=False))
            plain, plain_s = asked(planner, ends, None, RUNS)
            if is_first:
                ratios["first"].append(asked(planner, ends, one_way, 1)[1] / plain_s)
            other, other_s = asked(planner, ends, one_way, RUNS)
            is_same = other.path is not None and other.cost <= plain.cost + SAME
            kind = "same" if is_same else "none" if other.path is None else "other"
            ratios[kind].append(other_s / plain_s)
            ratios["all"].append(other_s / plain_s)
            times.append(plain_s * 1e6)
            is_first = False
    row = [f"{np.median(each or [np.nan]):.2f} ({len(each)})" for each in ratios.values()]
    print_row(name, planner.preset.name, *row, f"{np.median(times):.0f}")


OPTIONS = [
    DATA,
    option("--map", action="append", default=[], metavar="GLOB"),
    option("--preset", action="append", default=[], metavar="NAME"),
    option("--doors", type=int, default=10),
    option("--sets", type=int, default=5),
    option("--pairs", type=int, default=60),
    SEED,
]


def main(given: Namespace) -> None:
    """Run the program."""
    print_load()
    print_head("map", "preset", *COLUMNS, "us")
    for name, file in office_and_maps(given).items():
        for preset in given.preset or ("shortest", "octile", "paper"):
            measure(name, prepared(read(file), preset, rooms=True), given)
