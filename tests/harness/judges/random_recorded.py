"""Random recorded paths on random maps, judged twice.

`python -m tests.harness.judges.random_recorded 10000` counts the verdicts that shapely and
fractions contradict.
"""

import math
import sys
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

import hybridnav as hn
from hybridnav.harness.judges import clearance_of, contacts_of
from tests.oracle.recorded import RecordedJudge, Run, Verdict

SIDE_M = 0.25
FRAMES = [hn.Frame(SIDE_M), hn.Frame(SIDE_M, (-3.0, 2.0), 0.7)]
OFF = 1 / 128 + 1e-6
"""Cells by which depths and the least clearance may be off."""
ROUNDING = 1e-6


def scene(rng: np.random.Generator) -> tuple[hn.OccupancyGrid, Any]:
    """Draw a map, and the positions (row, col) of a path: on corners, sides, anywhere."""
    shape = rng.integers(2, 9, 2)
    values = rng.choice([0.0, 1.0, np.nan], shape, p=[0.72, 0.23, 0.05])
    radius_m = SIDE_M * rng.choice([0.0, 0.0, 0.0, 1.0, 1.5])
    frame = FRAMES[rng.integers(2)]
    grid = hn.OccupancyGrid(values.astype(np.float32), frame, robot_radius_m=radius_m)
    free = np.argwhere(grid.enterable())
    cells = free if len(free) else np.argwhere(np.ones(shape))
    finest = rng.choice([1, 2, 8, 1024])
    positions = [_place(rng, cells[rng.integers(len(cells))], finest)]
    for _ in range(rng.integers(0, 6)):
        last, kind = positions[-1], rng.integers(10)
        near = cells[np.argsort(np.abs(cells + 0.5 - last).sum(axis=1), kind="stable")[:6]]
        new = _place(rng, near[rng.integers(len(near))], finest)
        if kind < 4:  # along a row or a column, often along sides
            new[kind % 2] = last[kind % 2]
        elif kind == 4:
            new = last.copy()
        elif kind == 5:  # out of the map, or back on itself
            new = rng.integers(-2, 11, 2).astype(float) if len(positions) < 2 else positions[-2]
        positions.append(new)
    return grid, np.array(positions)


def _place(rng: np.random.Generator, cell: Any, finest: int) -> Any:
    """Return a position in the closed square of a cell, on a lattice."""
    return cell + rng.integers(0, finest + 1, 2) / finest


def faults(grid: hn.OccupancyGrid, positions: Any) -> Iterator[str]:
    """Yield what the judge of paths says otherwise than shapely and fractions do."""
    oracle = RecordedJudge(grid)
    truth = oracle.verdict(positions)
    points = grid.frame.points_of_grid(positions)
    found = contacts_of(grid, points)
    if oracle.covers(positions) != all(run.kinds == {"corner"} for run in truth.runs):
        yield "the two oracles disagree"
    if truth.legal == bool(found):
        yield "legal or not"
        return
    corners = sorted(one.from_m / SIDE_M for one in found if one.what == "corner")
    known = [run.begin for run in truth.runs if run.kinds == {"corner"}]
    if not _are_near(corners, known):
        yield "corners that are passed"
    mine = [
        Run(one.from_m / SIDE_M, one.to_m / SIDE_M, one.depth_m / SIDE_M, frozenset({one.what}))
        for one in found
        if one.what != "corner"
    ]
    theirs = [run for run in truth.runs if run.kinds != {"corner"}]
    yield from _of_runs(_merged(mine), _merged(theirs))
    yield from _of_clearance(grid, points, truth)


def _are_near(one: list[float], other: list[float]) -> bool:
    return len(one) == len(other) and np.allclose(one, other, rtol=0, atol=ROUNDING)


def _merged(runs: list[Run]) -> list[Run]:
    """Join runs that touch: whether a corner of a free cell parts them is a matter of words."""
    merged: list[Run] = []
    for run in sorted(runs):
        if merged and run.begin - merged[-1].end < ROUNDING:
            last = merged.pop()
            depth = max(last.depth, run.depth)
            run = Run(last.begin, max(run.end, last.end), depth, last.kinds | run.kinds)  # noqa: PLW2901
        merged.append(run)
    return merged


def _of_runs(mine: list[Run], theirs: list[Run]) -> Iterator[str]:
    if len(mine) != len(theirs):
        yield "number of contacts"
        return
    for one, other in zip(mine, theirs, strict=True):
        if not _are_near([one.begin, one.end], [other.begin, other.end]):
            yield "where a contact begins or ends"
        if not other.depth - OFF <= one.depth <= other.depth + 1 / 512 + ROUNDING:
            yield "depth of a contact"
        if not one.kinds <= other.kinds:
            yield "what is met"


def _of_clearance(grid: hn.OccupancyGrid, points: Any, truth: Verdict) -> Iterator[str]:
    limit = 0.5
    found = clearance_of(grid, points, limit_m=limit * SIDE_M)
    least, mean = found.least_m / SIDE_M, found.mean_m / SIDE_M
    if math.isinf(truth.clearance):
        if (least, mean, found.below) != (math.inf, math.inf, 0.0):
            yield "clearance without obstacles"
        return
    if not truth.clearance - ROUNDING <= least <= truth.clearance + OFF:
        yield "least clearance"
    # A distance changes by no more than the way: samples lie within an eighth of a cell of all.
    if abs(mean - truth.mean) > 1 / 8:
        yield "mean clearance"
    if truth.length:
        low, high = ((truth.at < limit + by).mean() for by in (-1 / 8, 1 / 8))
        if not low - 0.02 <= found.below <= high + 0.02:
            yield "share below the limit"


def count(number: int, seed: int = 63) -> Counter[str]:
    """Judge so many random paths; returns how often each fault came, and how many were legal."""
    rng, found = np.random.default_rng(seed), Counter[str]()
    for index in range(number):
        grid, positions = scene(rng)
        try:
            wrong = sorted(set(faults(grid, positions)))
        except Exception as error:  # noqa: BLE001 - counted as a fault
            wrong = [f"{type(error).__name__}: {error}"]
        found["paths"] += 1
        found["legal"] += not contacts_of(grid, grid.frame.points_of_grid(positions))
        for fault in wrong:
            found[fault] += 1
            if found[fault] <= 3:
                sys.stderr.write(
                    f"{index}: {fault}\n{grid.classes.tolist()} radius {grid.robot_radius_m} "
                    f"yaw {grid.frame.yaw_rad}\n{positions.tolist()}\n"
                )
    return found


if __name__ == "__main__":
    print(dict(count(int(sys.argv[1]))))  # noqa: T201
