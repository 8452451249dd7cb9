"""The table of the jump-point graph: preparation, memory, and queries against the tuned grid A*.

Maps of FOLDER/maps.tsv (robot radius 0.25 m) and MovingAI maps (a point robot) whose path in FOLDER
matches; without `--map` buildings, open floors and raw maps. Every pair is put to A*, to the graph
and to the contracted one before the next one; lengths must be equal, or the exit code is 1.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.common import (
    NEEDED_DATA,
    Refused,
    maps_of,
    option,
    print_head,
    print_load,
    print_row,
    read,
    timed,
)
from hybridnav._base.moves import path_length_in_cells
from hybridnav.harness.scenes import sample_pairs
from hybridnav.search.grid_search import CellPath, GridSearch
from hybridnav.search.octile import JumpPath, JumpSearch, build_jump_graph, contract_graph

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable
    from pathlib import Path

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


def measured(path: Path, n_pairs: int) -> tuple[list[str], int]:
    """One line of the table, and the number of pairs whose lengths differ."""
    grid = read(path)
    free = grid.enterable()
    n_free = int(free.sum())
    drawn = sample_pairs(grid, n_pairs, seed=0)
    pairs = [(pair.start, pair.goal) for pair in drawn if pair.kind == "sampled"]
    graph, build_s = timed(lambda: build_jump_graph(free), 3)
    contracted, contract_s = timed(lambda: contract_graph(graph))
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
    _, many_s = timed(lambda: searches[2].many(starts, goals), 3)
    figures = [
        path.parent.name + "/" + path.stem,
        str(n_free),
        str(graph.n_corners),
        f"{1e6 * build_s / n_free:.2f}",
        f"{graph.memory_bytes / n_free:.0f}",
        f"{1e6 * contract_s / n_free:.2f}",
        f"{contracted.memory_bytes / n_free:.0f}",
        *(f"{np.median(taken[3:]):.0f} / {np.quantile(taken[3:], 0.95):.0f}" for taken in us),
        f"{1e6 * many_s / len(pairs):.0f}",
        str(unequal),
    ]
    return figures, unequal


OPTIONS = [
    NEEDED_DATA,
    option("--pairs", type=int, default=200),
    option("--map", action="append", metavar="GLOB"),
]


def main(given: Namespace) -> int:
    """Print the table."""
    names = maps_of(given.data, given.map or MAPS)
    if not names:
        raise Refused("no map matches")
    measured(given.data / names[0], 3)  # loads the kernels
    print_load()
    print_head(*COLUMNS)
    wrong = 0
    for name in names:
        figures, unequal = measured(given.data / name, given.pairs)
        wrong += unequal
        print_row(*figures)
    return 1 if wrong else 0
