"""Planners of others and our presets on the same pairs, in one process: what a query takes.

Times are of the processor, which other programs change little, the least of some repeats of each
pair, of a query as its user asks it: two ends in, a path out. Maps and pairs are the same for all.
Paths of cells are compared with the octile optimum, paths at any angle with theirs.
"""

import time
from argparse import Namespace
from collections.abc import Callable
from typing import Any

import numpy as np

import hybridnav as hn
from benchmarks.common import OFFICE, largest_part, matches, read
from benchmarks.options import MAPS, NEEDED_DATA, SEED, Refused, option
from benchmarks.rivals import NanoAstar, Networkx, Pyastar2d, RoutingKit, ScikitImage, Scipy, Tcod
from benchmarks.rivals_any_angle import ExtremityPathfinder
from benchmarks.tables import print_head, print_load, print_row
from hybridnav._base.moves import path_length_in_cells
from hybridnav.maps import OccupancyGrid

FILES = (
    "nav2/maps/tb3_sandbox.yaml",
    "cob_environments/ipa-apartment/map.yaml",
    "bwi_gdc/3/3.yaml",
    "strands/tsc_y4/tsc_1701.yaml",
)
COLUMNS = (
    "map",
    "planner",
    "paths",
    "ready after, s",
    "median, us",
    "p95, us",
    "times `shortest`",
    "longer, %",
)
OPTIONS = (
    NEEDED_DATA,
    MAPS,
    option("--pairs", type=int, default=100),
    option("--repeats", type=int, default=5),
    option("--patience", type=float, default=60.0, help="seconds a planner has for the pairs"),
    option("--cells", type=int, default=1_000_000, help="free cells up to which graphs are made"),
    SEED,
)
_OPTIMA = {"cells": "octile", "any angle": "shortest"}


class _Ours:
    """A preset of this package."""

    def __init__(self, grid: OccupancyGrid, preset: str) -> None:
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        self.planner = hn.HybridPlanner(topology, preset=preset)
        self.planner.prepare()

    def solve(self, start: Any, goal: Any) -> float:
        """Plan; return the length in metres."""
        return float(self.planner.plan(start, goal).cost)


def lineup(given: Namespace) -> dict[str, tuple[str, Callable[[OccupancyGrid], Any]]]:
    """Return what is asked: the kind of its paths, and how it is made of a grid."""
    several = {"most_cells": given.cells}
    return {
        "shortest": ("any angle", lambda grid: _Ours(grid, "shortest")),
        "octile": ("cells", lambda grid: _Ours(grid, "octile")),
        "extremitypathfinder": ("any angle", ExtremityPathfinder),
        "nano-astar": ("cells", NanoAstar),
        "pyastar2d": ("cells", Pyastar2d),
        "pyroutingkit": ("cells", lambda grid: RoutingKit(grid, **several)),
        "tcod": ("cells", Tcod),
        "scikit-image": ("cells", ScikitImage),
        "scipy": ("cells", Scipy),
        "networkx": ("cells", lambda grid: Networkx(grid, **several)),
    }


def ask(solve: Callable[..., Any], ends: Any, given: Namespace) -> tuple[list[float], list[Any]]:
    """Return the least seconds and the answers of the first pairs, as many as patience allows."""
    seconds, answers, over = [], [], time.perf_counter() + given.patience
    for start, goal in ends:
        least = np.inf
        for _ in range(given.repeats):
            began = time.thread_time()
            answer = solve(start, goal)
            least = min(least, time.thread_time() - began)
            if time.perf_counter() > over:
                break
        seconds.append(least)
        answers.append(answer)
        if time.perf_counter() > over:
            break
    return seconds, answers


def length_of(answer: Any, resolution_m: float) -> float:
    """Return the metres of an answer, infinite without a path."""
    if isinstance(answer, float):
        return answer
    if answer.any_angle is not None:
        return float(answer.any_angle.length_m)
    return np.inf if answer.cells is None else path_length_in_cells(answer.cells) * resolution_m


def measure(path: Any, given: Namespace) -> None:
    """Print the rows of one map."""
    grid = read(path)
    rng = np.random.default_rng(given.seed)
    cells = rng.choice(largest_part(grid.enterable()), (given.pairs, 2))
    cells = cells[(cells[:, 0] != cells[:, 1]).any(1)]
    as_cells = [tuple(map(tuple, pair)) for pair in cells.tolist()]
    as_points = [tuple(map(tuple, pair)) for pair in grid.frame.points_of(cells).tolist()]
    best: dict[str, Any] = {}
    median = np.nan
    for name, (kind, made_of) in lineup(given).items():
        began = time.process_time()
        try:
            planner = made_of(grid)
        except hn.errors.UnsuitableMapError:
            print_row(path.stem, name, kind, "", "not asked", "", "", "")
            continue
        ready = time.process_time() - began
        ends = as_points if isinstance(planner, _Ours) else as_cells
        planner.solve(*ends[0])
        seconds, answers = ask(planner.solve, ends, given)
        us = np.array(seconds) * 1e6
        lengths = np.array([length_of(one, grid.resolution_m) for one in answers])
        best.setdefault(name, lengths)
        optimum = best[_OPTIMA[kind]][: len(lengths)]
        solved = np.isfinite(lengths)
        longer = (lengths[solved] / optimum[solved] - 1).mean() * 100
        median = float(np.median(us)) if name == "shortest" else median
        few = f", {len(us)} pairs" if len(us) < len(ends) else ""
        missed = f", {len(solved) - solved.sum()} unsolved" if not solved.all() else ""
        print_row(
            path.stem,
            name,
            kind,
            f"{ready:.2f}",
            f"{np.median(us):,.3g}{few}",
            f"{np.percentile(us, 95):,.3g}",
            f"{np.median(us) / median:,.3g}",
            f"{round(longer, 6) + 0.0:.2g}{missed}",
        )


def main(given: Namespace) -> None:
    """Print the table."""
    paths = [OFFICE, *(given.data / name for name in FILES)]
    paths = [path for path in paths if not given.map or matches(str(path), given.map)]
    if not paths:
        raise Refused("no map has such a name")
    print_load()
    small = hn.OccupancyGrid(np.zeros((4, 4), np.float32))
    for _, made_of in lineup(given).values():
        made_of(small).solve((0, 0), (3, 3))  # compiles
    print_head(*COLUMNS)
    for path in paths:
        measure(path, given)
    print_load()
