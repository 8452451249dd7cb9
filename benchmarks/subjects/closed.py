"""The table of closures: queries of `shortest` that close something, against the open ones.

The office of `maps/office`, and the maps whose path in FOLDER a glob of `--map` matches; robot
radius 0.25 m, on MovingAI maps 0. Rooms and doors are found in the map. For each pair of points,
cells drawn from the largest connected part, the planner is asked with nothing closed, then with
each of some doors and rooms, and with a rectangle of 0.3 to 1 m on its path. Every answer is put
into one of three columns of ratios, time of the processor over that of the open query just before
it, median / p95:

    beside    the open path does not meet what is closed; the first query that closes it
    first     it does; the first query that closes it
    later     it does; the query after that

What is closed is handed over as a user does, but for `first` and `beside` of doors and rooms, whose
cells the planner has found before: finding those of a door takes some 10 ms, once. In brackets: how
many answers, and how many of them have no path.
"""

import time
from argparse import Namespace
from typing import Any

import numpy as np
import shapely

import hybridnav as hn
from benchmarks.common import office_and_maps, prepared, read, timed
from benchmarks.options import DATA, MAPS, SEED, option
from benchmarks.tables import print_head, print_row
from hybridnav.planning.methods.shortest import OverMesh
from hybridnav.search.mesh import build_mesh

COLUMNS = ("beside", "first", "later")
CLOSED = 4
"""Doors and rooms that each pair is asked with."""
Times = dict[str, list[tuple[float, bool]]]
"""Ratio of each answer, and whether it has a path, by column."""


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
    opened, open_s = timed(lambda: planner.plan(*endpoints), 3, time.thread_time)
    planner.closed(closed)
    forget(planner)

    def again(runs: int = 1) -> tuple[hn.PlanResult, float]:
        return timed(lambda: planner.plan(*endpoints, blocked=closed), runs, time.thread_time)

    result, first_s = again()
    if "blocked" in result.status or not opened.solved:
        return
    for _ in range(2):  # the least of three, each the first
        forget(planner)
        first_s = min(first_s, again()[1])
    _, later_s = again(3)
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
        print_row(*line)


OPTIONS = [DATA, MAPS, option("--pairs", type=int, default=60), SEED]


def main(given: Namespace) -> None:
    """Run the program."""
    print_head("map", "closed", *COLUMNS)
    for name, file in office_and_maps(given).items():
        measure(name, prepared(read(file), rooms=True), pairs=given.pairs, seed=given.seed)
