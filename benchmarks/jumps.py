"""The table of the jump-point graph: preparation, memory, and queries against the tuned grid A*.

    python -m benchmarks.jumps --data FOLDER [--pairs 200] [--map GLOB]

Maps of FOLDER/maps.tsv (robot radius 0.25 m) and MovingAI maps (a point robot) whose path in FOLDER
matches; without `--map` buildings, open floors and raw maps. Every pair is put to A*, to the graph
and to the contracted one before the next one; lengths must be equal, or the exit code is 1.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks._queries_measure import read
from benchmarks.queries import maps_of
from hybridnav._base.moves import path_length_in_cells
from hybridnav.harness.pairs import sample_pairs
from hybridnav.search.grid_search import CellPath, GridSearch
from hybridnav.search.octile import JumpPath, JumpSearch, build_jump_graph, contract_graph

if TYPE_CHECKING:
    from collections.abc import Callable

MAPS = [
    "nav2/maps/depot.yaml",
    "aws_small_warehouse/005/map.yaml",
    "bwi_mapper/intel.yaml",
    "willow/willow-2010-02-18-0.10.yaml",
    "bwi_gdc/3/3.yaml",
    "strands/tsc_y4/tsc_1701.yaml",
    "cob_environments/ipa-production-plant/map.yaml",
    "cob_environments/izs-carpark-top/map.yaml",
    "fetch_maps/4_26_15.yaml",
    "radish_grids/*.yaml",
]
COLUMNS = (
    "map",
    "free cells",
    "corner cells",
    "graph, us a cell",
    "bytes a cell",
    "contraction, us a cell",
    "bytes a cell",
    "A*, us median / p95",
    "graph",
    "contracted",
    "many",
    "not equal",
)


def timed(function: Callable[[], object]) -> float:
    """Microseconds that a call takes."""
    began = time.perf_counter()
    function()
    return 1e6 * (time.perf_counter() - began)


def row(path: Path, n_pairs: int) -> tuple[list[str], int]:
    """One line of the table, and the number of pairs whose lengths differ."""
    grid = read(path)
    free = grid.enterable()
    n_free = int(free.sum())
    drawn = sample_pairs(grid, n_pairs, seed=0)
    pairs = [(pair.start, pair.goal) for pair in drawn if pair.kind == "sampled"]
    build_us = min(timed(lambda: build_jump_graph(free)) for _ in range(3))
    graph = build_jump_graph(free)
    contract_us = timed(lambda: contract_graph(graph))
    contracted = contract_graph(graph)
    searches = GridSearch(free), JumpSearch(graph), JumpSearch(contracted)
    methods: list[Callable[..., CellPath | JumpPath]] = [
        searches[0].search,
        searches[1].path,
        searches[2].path,
    ]
    us: list[list[float]] = [[], [], []]
    unequal = 0
    for pair in [*pairs[:3], *pairs]:
        found: list[float] = []
        for taken, method in zip(us, methods, strict=True):
            began = time.perf_counter()
            answer = method(*pair)
            taken.append(1e6 * (time.perf_counter() - began))
            assert answer.cells is not None  # noqa: S101 - of one component
            found.append(path_length_in_cells(answer.cells))
        unequal += max(found) - min(found) > 1e-9
    starts, goals = (np.array(side) for side in zip(*pairs, strict=True))
    many_us = min(timed(lambda: searches[2].many(starts, goals)) for _ in range(3)) / len(pairs)
    figures = [
        path.parent.name + "/" + path.stem,
        str(n_free),
        str(graph.n_corners),
        f"{build_us / n_free:.2f}",
        f"{graph.memory_bytes / n_free:.0f}",
        f"{contract_us / n_free:.2f}",
        f"{contracted.memory_bytes / n_free:.0f}",
        *(f"{np.median(taken[3:]):.0f} / {np.quantile(taken[3:], 0.95):.0f}" for taken in us),
        f"{many_us:.0f}",
        str(unequal),
    ]
    return figures, unequal


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("--pairs", type=int, default=200)
    parser.add_argument("--map", action="append", metavar="GLOB")
    arguments = parser.parse_args()
    if arguments.data is None:
        parser.error("the table needs --data or HYBRIDNAV_DATA")
    data = Path(arguments.data)
    names = maps_of(data, arguments.map or MAPS)
    if not names:
        parser.error("no map matches")
    row(data / names[0], 3)  # loads the kernels
    sys.stdout.write(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")
    print(f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}")
    wrong = 0
    for name in names:
        figures, unequal = row(data / name, arguments.pairs)
        wrong += unequal
        print(f"| {' | '.join(figures)} |", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
