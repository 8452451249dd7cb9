"""Planners that follow a changed map: an update and the next answer, against building anew.

A square of 60 x 60 cells is blocked and freed again in turn. `update` is `planner.update` with the
grid and the area of the change, `answer` the next query across it; `fresh` is the structure of the
preset built of the changed map. The second table has `paper`, which takes the version of the
on-line pyramid: CPU time of its update over that of the pyramid's own update by the same change, at
random places; all packed arrays are compared with those of a planner made anew. All ratios are
taken in one process. With --data, the third has the sample of the grid competition's dynamic track:
CPU time of all updates and queries, in turn with own A*, and how many answers have another cost or
other points than those of a planner made anew.
"""

import time
from argparse import Namespace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import hybridnav as hn
from benchmarks.common import with_classes
from benchmarks.options import DATA, option
from benchmarks.subjects.rescore import patched
from benchmarks.tables import print_head, print_load, print_row
from hybridnav.ext.live import OnlinePyramid
from hybridnav.search.mesh import build_mesh
from hybridnav.search.octile import build_jump_graph, contract_graph

Classes = NDArray[np.uint8]

SIDES = (500, 1000, 2000, 4000)
CHANGE = 60
TURNS = 20
RESOLUTION_M = 0.05


class Row(NamedTuple):
    """Milliseconds of a preset on one map."""

    update: list[float]
    answer: list[float]
    fresh: float


def rooms_of(side: int) -> Classes:
    """Return rooms of 6 m with doors, `side` x `side` cells, and noise as of a laser scan."""
    tile = np.ones((250, 250), np.uint8)
    tile[::125] = tile[:, ::125] = 0
    tile[50:60, ::125] = tile[::125, 50:60] = tile[180:190, ::125] = tile[::125, 180:190] = 1
    classes = np.tile(tile, (side // 250, side // 250))
    classes[np.random.default_rng(0).random(classes.shape) < 0.001] = 0
    return classes


def fresh_ms(preset: str, classes: Classes) -> float:
    """Return the time to build the structure of a preset."""
    free = classes == 1
    began = time.perf_counter()
    if preset == "shortest":
        build_mesh(free)
    else:
        contract_graph(build_jump_graph(free))
    return (time.perf_counter() - began) * 1e3


def run(preset: str, grid: hn.OccupancyGrid, topology: hn.TopologicalMap) -> Row:
    """Block and free a square in turn, with a query from the one side of it to the other."""
    planner = hn.HybridPlanner(topology, preset=preset)
    low = grid.shape[0] // 2 + 20
    part = slice(low, low + CHANGE), slice(low, low + CHANGE)
    area = low * RESOLUTION_M, low * RESOLUTION_M, *[(low + CHANGE) * RESOLUTION_M] * 2
    # Ends in other rooms, on both sides of the square.
    free = np.argwhere(grid.classes == 1)
    ends = [
        grid.frame.points_of(free[np.abs(free - low - CHANGE // 2 - shift).sum(axis=1).argmin()])
        for shift in (-150, 150)
    ]
    planner.plan(*ends)
    update, answer = [], []
    blocked = grid.classes.copy()
    blocked[part] = 0
    maps = [with_classes(grid, blocked), grid]
    for turn in range(TURNS + 4):
        began = time.perf_counter()
        planner.update(grid=maps[turn % 2], changed=area)
        then = time.perf_counter()
        planner.plan(*ends)
        update.append((then - began) * 1e3)
        answer.append((time.perf_counter() - then) * 1e3)
    return Row(update[4:], answer[4:], fresh_ms(preset, blocked))


def run_paper(grid: hn.OccupancyGrid) -> tuple[list[float], ...]:
    """Return CPU milliseconds of updates of the pyramid and of the planner, and of answers."""
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid))
    planner = hn.HybridPlanner(hn.TopologicalMap(version), preset="paper")
    free = np.argwhere(grid.classes == 1)
    rng = np.random.default_rng(0)
    planner.plan(*grid.frame.points_of(rng.choice(free, 2)))
    own, update, answer = list[float](), list[float](), list[float]()
    for low in rng.integers(0, grid.shape[0] - CHANGE, (TURNS, 2)).tolist():
        blocked = grid.classes.copy()
        blocked[low[0] : low[0] + CHANGE, low[1] : low[1] + CHANGE] = 0
        high = low[0] + CHANGE, low[1] + CHANGE
        area = grid.frame.points_of_grid([low, high]).ravel().tolist()
        ends = grid.frame.points_of(rng.choice(np.argwhere(blocked == 1), 2))
        for now in (with_classes(grid, blocked), grid):
            times = [time.process_time()]
            version = version.update(now, changed=area).version
            times.append(time.process_time())
            planner.update(grid=version, changed=area)
            times.append(time.process_time())
            planner.plan(*ends)
            times.append(time.process_time())
            for found, took in zip((own, update, answer), np.diff(times) * 1e3, strict=True):
                found.append(float(took))
    anew = hn.HybridPlanner(hn.TopologicalMap(version.pyramid), preset="paper")
    fields: list[Any] = [each.method.prepare() for each in (planner, anew)]
    if not all(map(np.array_equal, *(each.fields for each in fields))):
        raise SystemExit("paper: what was repaired differs from what is made anew")
    return own[4:], update[4:], answer[4:]


Bits = tuple[float, bytes, bytes]
"""Cost, points and cells of an answer."""


def run_sample(preset: str, maps: list[Any]) -> list[float]:
    """Return CPU milliseconds of updates and of queries on a sample."""
    planner, spent = hn.HybridPlanner(maps[0][0], preset=preset), np.zeros(2)
    for turn, (grid, ends) in enumerate(maps):
        times = [time.process_time()]
        if turn:
            planner.update(grid=grid)
        times.append(time.process_time())
        for pair in ends:
            planner.plan(*pair)
        times.append(time.process_time())
        spent += np.diff(times) * 1e3
    return spent.tolist()


def answers_of(preset: str, maps: list[Any], *, is_anew: bool) -> list[Bits]:
    """Return the answers on a sample, of a planner that follows or of one for each map."""
    found, planner = list[Bits](), hn.HybridPlanner(maps[0][0], preset=preset)
    for grid, ends in maps:
        if is_anew:
            planner = hn.HybridPlanner(grid, preset=preset)
        planner.update(grid=grid)
        for pair in ends:
            result = planner.plan(*pair)
            path = result.path
            line = (b"", b"") if path is None else (path.points.tobytes(), path.cells.tobytes())
            found.append((result.cost, *line))
    return found


def sample(data: Path) -> None:
    """Print the table of the dynamic sample."""
    maps = []
    for scenario in sorted((data / "gppc_dynamic").glob("*.scen")):
        for free, batch in patched(scenario):
            grid = hn.OccupancyGrid((~free[::-1]).astype(np.float32), robot_radius_m=0)
            ends = np.array(batch)[:, :4].reshape(-1, 2, 2) + 0.5
            ends[..., 1] = len(free) - ends[..., 1]
            maps.append((grid, ends))
    print_load()
    print_head(
        "dynamic sample", "updates, ms", "queries, ms", "own A* / it", "wrong", "not as anew"
    )
    presets = "grid-astar", "octile", "shortest"
    turns = [{preset: run_sample(preset, maps) for preset in presets} for _ in range(4)][1:]
    right = np.array([cost for cost, *_ in answers_of("grid-astar", maps, is_anew=True)])
    for preset in presets:
        spent = np.median([turn[preset] for turn in turns], axis=0)
        ratio = np.median([sum(turn["grid-astar"]) / sum(turn[preset]) for turn in turns])
        found, anew = (answers_of(preset, maps, is_anew=is_anew) for is_anew in (False, True))
        costs, is_exact = np.array([cost for cost, *_ in found]), preset == "octile"
        wrong = (abs(costs - right) > 1e-6) & (costs != right) if is_exact else costs > right + 1e-6
        others = sum(one != other for one, other in zip(found, anew, strict=True))
        shown = *(f"{ms:.1f}" for ms in spent), f"{ratio:.2f}"
        print_row(preset, *shown, int(wrong.sum()), others)


OPTIONS = [DATA, option("--sides", type=int, nargs="*", default=SIDES)]


def main(given: Namespace) -> None:
    """Print the tables."""
    print_head(
        "preset", "cells", "update, ms", "answer, ms", "both, p95", "fresh, ms", "fresh / both"
    )
    for side in given.sides:
        classes = rooms_of(side)
        probability = np.where(classes == 0, np.float32(1), np.float32(0))
        grid = hn.OccupancyGrid(probability, hn.Frame(RESOLUTION_M), robot_radius_m=0)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        for preset in ("shortest", "octile"):
            found = run(preset, grid, topology)
            both = np.add(found.update, found.answer)
            update, answer, middle = map(np.median, (found.update, found.answer, both))
            of_both = f"{update:.1f}", f"{answer:.1f}", f"{np.percentile(both, 95):.1f}"
            fresh = f"{found.fresh:.0f}", f"{found.fresh / middle:.0f}"
            print_row(preset, f"{side * side:,}", *of_both, *fresh)
    print_load()
    print_head("paper", "the pyramid's update, ms", "the planner's, ms", "ratio", "answer, ms")
    for side in given.sides:
        classes = rooms_of(side)
        probability = np.where(classes == 0, np.float32(1), np.float32(0))
        grid = hn.OccupancyGrid(probability, hn.Frame(RESOLUTION_M), robot_radius_m=0)
        own, update, answer = map(np.median, run_paper(grid))
        figures = f"{own:.2f}", f"{update:.2f}", f"{update / own:.1f}", f"{answer:.2f}"
        print_row(f"{side * side:,}", *figures)
    if given.data is not None:
        sample(given.data)
