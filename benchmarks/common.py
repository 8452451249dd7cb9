"""What several subjects share: maps, pairs, planners, times, and other checkouts."""

import fnmatch
import json
import os
import subprocess
import sys
import time
import warnings
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import IO, Any, TypeVar, cast

import numpy as np
from scipy import ndimage

import hybridnav as hn
from hybridnav._base.typing import FloatArray, LongArray

T = TypeVar("T")

ROOT = Path(__file__).parents[1]
OFFICE = ROOT / "maps" / "office" / "office.yaml"
FAR_APART = (1.0, 13.2), (40.6, 19.4)
"""Ends of a long path through the office."""
PLAN = ("plan", str(OFFICE), "--start", "1.0,13.2", "--goal", "40.6,19.4")
"""The command that plans it."""
RADIUS_M = 0.25


def maps_of(data: Path, globs: Sequence[str] = ()) -> list[str]:
    """Return the maps in the data folder that a glob matches, all without one, ROS maps first."""
    lines = (data / "maps.tsv").read_text(encoding="utf-8").splitlines()[1:]
    ros = [path for path, kind in (line.split("\t") for line in lines) if kind == "map"]
    movingai = sorted((data / "movingai").rglob("*.map"))
    every = ros + [path.relative_to(data).as_posix() for path in movingai]
    return [name for name in every if not globs or matches(name, globs)]


def office_and_maps(given: Namespace) -> dict[str, Path]:
    """Return the files of the office and of the maps of --data that --map names, by their names."""
    names = maps_of(given.data, given.map) if given.data is not None and given.map else []
    return {"office": OFFICE} | {name: given.data / name for name in names}


def matches(name: str, globs: Sequence[str]) -> bool:
    """Tell whether one of the globs matches a name."""
    return any(fnmatch.fnmatch(name, glob) for glob in globs)


def read(path: Path, radius_m: float = RADIUS_M) -> hn.OccupancyGrid:
    """Return the grid of a map file: ROS maps inflated, MovingAI maps for a point robot."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hn.errors.MapWarning)
        return hn.load_map(path, robot_radius_m=0.0 if path.suffix == ".map" else radius_m)


def prepared(
    grid: hn.OccupancyGrid, preset: str = "shortest", *, rooms: bool = False
) -> hn.HybridPlanner:
    """Return a planner of a grid with all that it plans on, and with rooms if these are wanted."""
    labels = hn.find_rooms(grid) if rooms else None
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    planner = hn.HybridPlanner(topology, preset=preset)
    planner.prepare()
    return planner


def timed(
    call: Callable[[], T], runs: int = 1, clock: Callable[[], float] = time.perf_counter
) -> tuple[T, float]:
    """Return what a call returns, and the least seconds that it took; other programs change those
    of `time.thread_time` little."""
    best = np.inf
    for _ in range(runs):
        began = clock()
        found = call()
        best = min(best, clock() - began)
    return found, best


PLAINLY = {key: text for key, text in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
"""The environment in which Python keeps the bytecode of modules, as it does for users."""


class Checkout:
    """A process with the sources of one checkout, its `src`, that answers lines of JSON."""

    def __init__(self, sources: Path, code: str) -> None:
        paths = os.pathsep.join(map(str, (sources.resolve(), ROOT)))
        self.env, pipe = {**PLAINLY, "PYTHONPATH": paths}, subprocess.PIPE
        command = [sys.executable, "-c", code]
        self.process = subprocess.Popen(command, env=self.env, stdin=pipe, stdout=pipe, text=True)
        self._asks = cast("IO[str]", self.process.stdin)
        self._answers = cast("IO[str]", self.process.stdout)

    def ask(self, *question: Any) -> Any:
        """Return what it says to a question."""
        self._asks.write(json.dumps(question) + "\n")
        self._asks.flush()
        return json.loads(self._answers.readline())


def largest_part(free: Any) -> LongArray:
    """Return the cells of the largest connected part, int64 (n, 2)."""
    labels, _ = ndimage.label(free)
    cells: LongArray = np.argwhere(labels == np.bincount(labels.ravel())[1:].argmax() + 1)
    return cells


def random_pairs(grid: hn.OccupancyGrid, count: int, seed: int) -> FloatArray:
    """Draw pairs of centres of cells from the largest part of free space, float64 (count, 2, 2)."""
    cells = np.random.default_rng(seed).choice(largest_part(grid.enterable()), (count, 2))
    return grid.frame.points_of(cells.reshape(-1, 2)).reshape(-1, 2, 2)


def with_classes(grid: hn.OccupancyGrid, classes: Any) -> hn.OccupancyGrid:
    """Return a grid with other classes, without the work of making one."""
    values = {field.name: getattr(grid, field.name) for field in fields(grid)}
    return hn.OccupancyGrid.restored(**{**values, "classes": classes})
