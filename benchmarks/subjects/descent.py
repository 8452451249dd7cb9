"""What the pyramid gains: `paper`, which comes down its levels, beside `grid-astar`.

Both presets answer the same pairs in turn, in one process; of three plans each the one of least CPU
time counts. Ratios are times of `grid-astar` over those of `paper`: of the means, and the median of
those of the pairs. Losses are over the octile optimum, with line of sight over that of `shortest`.
Expansions are fields of all levels and cells, over the cells of `grid-astar`; what is prepared is a
part of the time that the pyramid takes, the least of four of each. The maps are those of the study,
or others by `--map`; the last rows are tiles of one map, with the time for each cell of the path
over that of the first row.
"""

import time
from argparse import Namespace
from typing import Any

import numpy as np

import hybridnav as hn
from benchmarks.common import (
    NEEDED_DATA,
    SEED,
    largest_part,
    maps_of,
    option,
    print_head,
    print_load,
    print_row,
    read,
)
from benchmarks.subjects._study_maps import maps_of as study_maps
from hybridnav._base.moves import path_length_in_cells

COLUMNS = (
    "map", "free cells", "A*, ms", "of means", "median", "loss %", "worst", "expanded",
    "any-angle %", "prepared", "B a cell",
)  # fmt: skip
OPTIONS = (
    NEEDED_DATA,
    option("--map", action="append", default=[], metavar="GLOB"),
    option("--pairs", type=int, default=100),
    option("--set", action="append", default=[], metavar="KEY=VALUE", help="of the preset paper"),
    option("--tiles", type=int, default=0, help="most tiles of the last map along a side"),
    SEED,
)


def least_s(planner: hn.HybridPlanner, ends: Any) -> tuple[float, Any]:
    """Return the least CPU seconds of three plans, and the last result."""
    best, result = np.inf, None
    for _ in range(3):
        began = time.process_time()
        result = planner.plan(*ends)
        best = min(best, time.process_time() - began)
    return best, result


def measured(grid: hn.OccupancyGrid, given: Namespace, n_builds: int = 4) -> dict[str, Any]:
    """Return what the presets of one map take."""
    preset = hn.load_preset("paper", overrides=[f"planner.{each}" for each in given.set])
    took = []
    for _ in range(n_builds):  # the first compiles
        began = time.process_time()
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        built = time.process_time()
        paper = hn.HybridPlanner(topology, preset=preset)
        paper.prepare()
        descent: Any = paper.method.prepare()
        took.append((built - began, time.process_time() - built))
    build_s, prepare_s = np.min(took, axis=0)
    others = [hn.HybridPlanner(topology, preset=name) for name in ("grid-astar", "shortest")]
    cells = largest_part(grid.enterable())
    pairs = cells[np.random.default_rng(given.seed).integers(len(cells), size=(given.pairs, 2))]
    rows = []
    for ends in grid.frame.points_of(pairs.reshape(-1, 2)).reshape(-1, 2, 2):
        if (ends[0] == ends[1]).all():
            continue
        whole_s, whole = least_s(others[0], ends)
        paper_s, found = least_s(paper, ends)
        taut = paper.plan(*ends, smooth="line-of-sight").cost / others[1].plan(*ends).cost - 1
        effort = found.stats.expanded + found.stats.expanded_places
        loss = found.cost / whole.cost - 1
        n_cells = path_length_in_cells(found.path.cells)
        rows.append((whole_s, paper_s, loss, effort, whole.stats.expanded, taut, n_cells))
    table = np.array(rows)
    return {
        "rows": table,
        "built": prepare_s / build_s,
        "bytes": descent.memory_bytes / grid.classes.size,
    }


def show(name: str, n_free: int, rows: Any, prepared: float, n_bytes: float) -> None:
    """Print the figures of a map, or of all."""
    whole_s, paper_s, loss, effort, cells, taut, _ = rows.T
    print_row(
        name, f"{n_free:,}", f"{whole_s.mean() * 1e3:.3f}",
        f"{whole_s.mean() / paper_s.mean():.2f}",
        f"{np.median(whole_s / paper_s):.2f}", f"{loss.mean():.2%}", f"{loss.max():.1%}",
        f"{effort.sum() / cells.sum():.3f}", f"{taut.mean():.2%}", f"{prepared:.2f}",
        f"{n_bytes:.1f}",
    )  # fmt: skip


def main(given: Namespace) -> None:
    """Print the tables."""
    print_load()
    if given.map:
        names = maps_of(given.data, given.map)
    else:
        names = [one.path.relative_to(given.data).as_posix() for one in study_maps(given.data)]
    print_head(*COLUMNS)
    every, large, prepared, held = [], [], [], []
    for name in names:
        grid = read(given.data / name)
        found = measured(grid, given)
        n_free = int(grid.class_counts()["free"])
        show(name, n_free, found["rows"], found["built"], found["bytes"])
        every.append(found["rows"])
        prepared.append(found["built"])
        held.append(found["bytes"])
        if n_free >= 300_000:
            large.append(found["rows"])
    about = float(np.mean(prepared)), float(np.mean(held))
    show("all", 0, np.concatenate(every), *about)
    if large:
        show("0.3 M free cells and more", 0, np.concatenate(large), *about)
    first = None
    for side in (1, 2, 4, 8):
        if side > given.tiles:
            break
        grid = read(given.data / names[-1])
        whole = hn.OccupancyGrid(
            np.tile(grid.probability, (side, side)), frame=grid.frame, robot_radius_m=0.25
        )
        found = measured(whole, given, 1)
        rows = found["rows"]
        a_cell = rows[:, 1].sum() / rows[:, 6].sum()
        first = first or a_cell
        show(
            f"{side} x {side} tiles, {a_cell / first:.2f} a cell",
            0,
            rows,
            found["built"],
            found["bytes"],
        )
