"""The table of closures: queries of `shortest` that close something, against the open ones.

    python -m benchmarks.closed [--data FOLDER] [--map GLOB] [--pairs 60] [--seed 0]

The office of `maps/office`, and the maps of FOLDER/maps.tsv whose path in FOLDER a glob of `--map`
matches; robot radius 0.25 m. Rooms and doors are found in the map. For each pair of points, cells
drawn from the largest connected part, the planner is asked with nothing closed, then with each of
some doors and rooms, and with a rectangle of 0.3 to 1 m on its path. Every answer is put into one
of three columns of ratios, time over that of the open query just before it, median / p95:

    beside    the open path does not meet what is closed; the first query that closes it
    first     it does; the first query that closes it
    later     it does; the query after that

What is closed is handed over as a user does, but for `first` and `beside` of doors and rooms, whose
cells the planner has found before: finding those of a door takes some 10 ms, once. In brackets: how
many answers, and how many of them have no path.
"""

from __future__ import annotations

import argparse
import fnmatch
import os
import sys
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

import hybridnav as hn
from hybridnav.planner.methods.shortest import OverMesh
from hybridnav.search.mesh import build_mesh

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).parents[1]
COLUMNS = ("beside", "first", "later")
CLOSED = 4
"""Doors and rooms that each pair is asked with."""
Times = dict[str, list[tuple[float, bool]]]
"""Ratio of each answer, and whether it has a path, by column."""


def clocked(ask: Callable[[], hn.PlanResult], runs: int = 3) -> tuple[hn.PlanResult, float]:
    """An answer, and the least seconds that it took."""
    best = np.inf
    for _ in range(runs):
        began = time.perf_counter()
        result = ask()
        best = min(best, time.perf_counter() - began)
    return result, best


def planner_of(file: Path) -> hn.HybridPlanner:
    """A planner that is prepared, of a map with rooms."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hn.MapWarning)
        grid = hn.load_map(file, robot_radius_m=0.25)
        rooms = hn.find_rooms(grid)
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms)))
    planner.prepare()
    return planner


def forget(planner: hn.HybridPlanner) -> None:
    """Drop the searches round what was closed."""
    assert isinstance(planner.method, OverMesh)  # noqa: S101
    planner.method._detours.clear()  # noqa: SLF001


def on_path(path: hn.Path, rng: np.random.Generator) -> shapely.Polygon:
    """A rectangle with a point of a path inside."""
    leg = int(rng.integers(len(path.points) - 1))
    low, high = path.points[leg : leg + 2]
    middle = low + rng.random() * (high - low)
    width, height = rng.uniform(0.3, 1.0, 2)
    x, y = middle - rng.random(2) * (width, height)
    area: shapely.Polygon = shapely.box(x, y, x + width, y + height)
    return area


def ask(planner: hn.HybridPlanner, endpoints: Any, closed: Any, times: Times) -> None:
    """Measure one pair with something closed."""
    opened, open_s = clocked(lambda: planner.plan(*endpoints))
    planner.closed(closed)
    forget(planner)
    result, first_s = clocked(lambda: planner.plan(*endpoints, blocked=closed), 1)
    if "blocked" in result.status or not opened.solved:
        return
    for _ in range(2):  # the least of three, each the first
        forget(planner)
        first_s = min(first_s, clocked(lambda: planner.plan(*endpoints, blocked=closed), 1)[1])
    _, later_s = clocked(lambda: planner.plan(*endpoints, blocked=closed))
    assert opened.path is not None  # noqa: S101
    if result.path is None or not np.array_equal(result.path.points, opened.path.points):
        times["first"].append((first_s / open_s, result.solved))
        times["later"].append((later_s / open_s, result.solved))
    else:
        times["beside"].append((first_s / open_s, result.solved))


def measure(name: str, planner: hn.HybridPlanner, *, pairs: int, seed: int) -> None:
    """Print the lines of one map."""
    grid, rooms = planner.topology.grid, planner.topology.rooms
    rng = np.random.default_rng(seed)
    mesh = build_mesh(grid.enterable())
    cells = np.argwhere(mesh.polygon_at >= 0)
    part = mesh.component[mesh.polygon_at[tuple(cells.T)]]
    cells = cells[part == np.bincount(part).argmax()]
    doors = [{"doors": [door.number]} for door in rooms.doors if door.passable]
    kinds: dict[str, list[dict[str, Any]]] = {
        "doors": doors,
        "rooms": [{"rooms": [room]} for room in rooms.labels.names],
    }
    times: dict[str, Times] = {
        kind: {column: [] for column in COLUMNS} for kind in (*kinds, "rectangles")
    }
    for _ in range(pairs):
        endpoints = grid.frame.points_of(rng.choice(cells, 2, replace=False))
        for kind, every in kinds.items():
            for index in rng.permutation(len(every))[:CLOSED]:
                ask(planner, endpoints, every[index], times[kind])
        path = planner.plan(*endpoints).path
        if path is not None and len(path.points) > 1:
            ask(planner, endpoints, on_path(path, rng), times["rectangles"])
    for kind, columns in times.items():
        line = [name, kind]
        for column in COLUMNS:
            ratios, are_solved = np.array(columns[column] or [(np.nan, True)]).T
            middle, high = np.median(ratios), np.percentile(ratios, 95)
            counts = f"({len(columns[column])}, {int((are_solved == 0).sum())})"
            line.append(f"{middle:.2f} / {high:.2f} {counts}")
        print("| " + " | ".join(line) + " |", flush=True)


def main() -> int:
    """Run the program."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("--map", action="append", default=[], metavar="GLOB")
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    files = {"office": ROOT / "maps" / "office" / "office.yaml"}
    if asked.data is not None and asked.map:
        lines = (asked.data / "maps.tsv").read_text(encoding="utf-8").splitlines()[1:]
        names = [line.split("\t")[0] for line in lines]
        for name in names:
            if any(fnmatch.fnmatch(name, glob) for glob in asked.map):
                files[name] = asked.data / name
    print("| map | closed | " + " | ".join(COLUMNS) + " |\n" + "|---" * 5 + "|")
    for name, file in files.items():
        measure(name, planner_of(file), pairs=asked.pairs, seed=asked.seed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
