"""A pyramid that follows its map: time of an update, places against a fresh build, identities.

All ratios are taken in one process. `--data` (or HYBRIDNAV_DATA) adds the Intel counting grid, of
which a window moves as a robot's sight does: what it covers becomes known. It also adds the scans
of the Intel log, at most so many as there are updates: each is added to a map with cells of 5 cm,
and the time is that of the update alone. The last table has each figure beside its aim.
"""

import time
import warnings
from argparse import Namespace
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import hybridnav as hn
from benchmarks.common import OFFICE, read, with_classes
from benchmarks.options import DATA, option
from benchmarks.tables import print_head, print_load, print_row
from hybridnav.ext.live import OnlinePyramid
from hybridnav.ext.live.mapping import Mapper

Classes = NDArray[np.uint8]
Area = tuple[float, ...]

INTEL = "radish_grids/intel.yaml"
INTEL_LOG = "radish_logs/intel-corrected.log.gz"
SIDES = (500, 1000, 2000, 4000)
"""Rows and columns of the maps on which growth is measured: 0.25 M to 16 M cells."""
CHANGE = 60
PLACES = 24
"""Changes of each map: at the same cells of all maps, so that their sizes alone differ."""
SIGHT = 80
"""Cells that a robot sees to each side: 4 m."""


class Run(NamedTuple):
    """What a sequence of updates did."""

    seconds: list[float]
    flips: int
    seen: int
    version: OnlinePyramid


class Shown(NamedTuple):
    """Figures of a row of the first table."""

    median_ms: float
    p95_ms: float
    drift: float


def area_of(frame: hn.Frame, low: tuple[int, int], high: tuple[int, int]) -> Area:
    """Return the area in metres of a box of cells of a map that is not turned: from a row and a
    column to the first ones beyond."""
    return tuple(frame.points_of_grid([low, high]).ravel().tolist())


def random_changes(grid: hn.OccupancyGrid, count: int) -> Iterator[tuple[Classes, Area]]:
    """Yield maps with things put into them and taken away, and the box of each change."""
    rng = np.random.default_rng(0)
    classes = grid.classes.copy()
    for _ in range(count):
        high, wide = rng.integers(2, 20, 2)
        row = int(rng.integers(0, grid.shape[0] - high))
        col = int(rng.integers(0, grid.shape[1] - wide))
        part = slice(row, row + high), slice(col, col + wide)
        classes[part] = grid.classes[part] if rng.random() < 0.5 else rng.integers(0, 3)
        yield classes.copy(), area_of(grid.frame, (row, col), (row + int(high), col + int(wide)))


def exploration(grid: hn.OccupancyGrid, count: int) -> Iterator[tuple[Classes, Area]]:
    """Yield what a robot knows that drives over a map from free cell to free cell, by steps."""
    known = np.full(grid.shape, 2, np.uint8)
    rows, cols = np.nonzero(grid.classes == 1)
    order = np.lexsort((rows, cols // SIGHT))
    for at in order[np.linspace(0, len(order) - 1, count).astype(int)].tolist():
        row, col = int(rows[at]), int(cols[at])
        part = slice(max(row - SIGHT, 0), row + SIGHT), slice(max(col - SIGHT, 0), col + SIGHT)
        known[part] = grid.classes[part]
        low = max(row - SIGHT, 0), max(col - SIGHT, 0)
        yield known.copy(), area_of(grid.frame, low, (row + SIGHT, col + SIGHT))


def scans(log: Path, count: int) -> Iterator[tuple[hn.OccupancyGrid, Area | None]]:
    """Yield the map after each laser scan of a log, and the area in which the scan lies."""
    mapper = Mapper(resolution_m=0.05)
    for scan in islice(hn.ext.live.CarmenLog(log), count + 1):
        area = mapper.add(scan)
        yield mapper.to_grid(robot_radius_m=0), area


def log_pace(log: Path) -> float:
    """Return how many times faster than recorded a log becomes a map whose places follow each scan.

    All of it counts: reading, mapping, the grid of each scan, and the update of the pyramid.
    """
    began = time.perf_counter()
    lines, mapper = hn.ext.live.CarmenLog(log), Mapper(resolution_m=0.05)
    version: OnlinePyramid | None = None
    for scan in lines:
        area = mapper.add(scan)
        grid = mapper.to_grid(robot_radius_m=0)
        if version is None:
            version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid))
        else:
            version = version.update(grid, changed=area).version
    seconds = time.perf_counter() - began
    print(
        f"\nThe whole log of Intel, {lines.n_scans} scans, each into the map and the pyramid: "
        f"recorded in {lines.duration_s:.0f} s, done in {seconds:.1f} s.",
        flush=True,
    )
    return lines.duration_s / seconds


def follow(
    version: OnlinePyramid, grid: hn.OccupancyGrid, steps: Iterator[tuple[Classes, Area]]
) -> Run:
    """Update a version with the classes of a map step by step."""
    return follow_grids(version, ((with_classes(grid, classes), box) for classes, box in steps))


def follow_grids(
    version: OnlinePyramid, steps: Iterator[tuple[hn.OccupancyGrid, Area | None]]
) -> Run:
    """Update a version step by step."""
    seconds, flips, seen = [], 0, 0
    for now, box in steps:
        began = time.perf_counter()
        update = version.update(now, changed=box)
        seconds.append(time.perf_counter() - began)
        flips, seen = flips + len(update.died), seen + version.n_places
        version = update.version
    return Run(seconds, flips, seen, version)


def show(name: str, run: Run, distance_m: float) -> Shown:
    """Print a row of the first table, and return its figures."""
    began = time.perf_counter()
    levels = len(run.version.pyramid)
    read = time.perf_counter()
    fresh = hn.DualGraphPyramid.build(run.version.grid, merge_distance_m=distance_m)
    built = time.perf_counter()
    median, high = np.percentile(run.seconds, [50, 95]) * 1000
    places = fresh[fresh.place_level].n_vertices
    print(
        f"| {name} | {len(run.seconds)} | {median:.1f} | {high:.1f} | {run.version.n_places} | "
        f"{run.version.n_places / places - 1:+.1%} | {run.flips / max(run.seen, 1):.2%} | "
        f"{levels} | {(read - began) * 1e3:.0f} | {(built - read) * 1e3:.0f} |",
        flush=True,
    )
    return Shown(float(median), float(high), run.version.n_places / places - 1)


class Tiled:
    """A map of rooms with doors, of some size, whose cells are closed and opened again."""

    def __init__(self, side: int) -> None:
        tile = np.ones((250, 250), np.uint8)
        tile[::125] = tile[:, ::125] = 0
        tile[50:60, ::125] = tile[::125, 50:60] = tile[180:190, ::125] = tile[::125, 180:190] = 1
        self.classes = np.tile(tile, (side // 250, side // 250))
        probability = np.where(self.classes == 0, np.float32(1), np.float32(0))
        self.grid = hn.OccupancyGrid(probability, hn.Frame(0.05), robot_radius_m=0)
        self.version = OnlinePyramid.of(hn.DualGraphPyramid.build(self.grid))
        start = time.perf_counter()
        hn.DualGraphPyramid.build(self.grid)
        self.fresh = time.perf_counter() - start

    def update(self, low: tuple[int, int], *, closed: bool) -> float:
        """Return the seconds of an update by which a box of cells is closed, or open again."""
        changed = self.classes.copy()
        if closed:
            changed[tuple(slice(at, at + CHANGE) for at in low)] = 0
        now = with_classes(self.grid, changed)
        box = area_of(self.grid.frame, low, (low[0] + CHANGE, low[1] + CHANGE))
        start = time.perf_counter()
        after = self.version.update(now, changed=box)
        taken = time.perf_counter() - start
        self.version = after.version  # frees the map before, which is no part of an update
        return taken


def growth() -> tuple[dict[int, float], dict[int, float]]:
    """Print the time of one change on maps of several sizes, and of a fresh build of each.

    Return, by the side of the map, the time of an update and how many times longer a build takes.
    """
    maps = {side: Tiled(side) for side in SIDES}
    taken: dict[int, list[float]] = {side: [] for side in SIDES}
    # At many places: how many places a change touches depends on where it lies. All maps in turn,
    # so that a machine that slows down slows down all of them.
    rng = np.random.default_rng(0)
    for row, col in rng.integers(0, SIDES[0] - CHANGE, (PLACES, 2)).tolist():
        for closed in (True, False):
            for side, one in maps.items():
                taken[side].append(one.update((row, col), closed=closed))
    times = {side: float(np.median(found[2:])) for side, found in taken.items()}
    ratios = {side: one.fresh / times[side] for side, one in maps.items()}
    print()
    print_head("cells", "an update, ms", "a fresh build, ms", "ratio")
    for side, one in maps.items():
        figures = f"{times[side] * 1e3:.2f}", f"{one.fresh * 1e3:.0f}", f"{ratios[side]:.0f}"
        print_row(f"{side * side:,}", *figures)
    return times, ratios


def show_aims(rows: list[tuple[str, float, float, str]]) -> None:
    """Print figures beside their aims: name, figure, aim, and "<" or ">=" between the two."""
    print_load()
    print_head("figure", "measured", "aim", "reached")
    for name, figure, aim, sign in rows:
        reached = figure < aim if sign == "<" else figure >= aim
        print_row(name, f"{figure:.3g}", f"{sign} {aim:g}", "yes" if reached else "no")


OPTIONS = [DATA, option("--updates", type=int, default=1000)]


def main(given: Namespace) -> None:
    """Print the tables."""
    warnings.simplefilter("ignore")
    columns = "map", "updates", "median, ms", "p95, ms", "places", "against a fresh build"
    print_head(*columns, "ids lost", "levels", "made when read, ms", "a fresh build, ms")
    office = read(OFFICE)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(office))
    warm = follow(version, office, random_changes(office, 10))
    warm.version.pyramid  # noqa: B018 - loads the kernels
    shown = [show("office", follow(version, office, random_changes(office, given.updates)), 4.0)]
    aims: list[tuple[str, float, float, str]] = []
    if given.data:
        intel = read(given.data / INTEL, 0)
        unknown = with_classes(intel, np.full(intel.shape, 2, np.uint8))
        version = OnlinePyramid.of(hn.DualGraphPyramid.build(unknown))
        run = follow(version, unknown, exploration(intel, given.updates))
        shown.append(show("Intel", run, 4.0))
        steps = scans(given.data / INTEL_LOG, given.updates)
        version = OnlinePyramid.of(hn.DualGraphPyramid.build(next(steps)[0]))
        shown.append(show("Intel, scans", follow_grids(version, steps), 4.0))
        aims.append(("Intel, a scan, median in ms", shown[-1].median_ms, 1.0, "<"))
        aims.append(("Intel, a scan, p95 in ms", shown[-1].p95_ms, 10.0, "<"))
        pace = log_pace(given.data / INTEL_LOG)
        aims.append(("Intel, the whole log, times faster than recorded", pace, 100.0, ">="))
    times, ratios = growth()
    drift = max(abs(row.drift) for row in shown)
    show_aims(
        [
            *aims,
            ("60 x 60 cells of 4 M, times faster than a build", ratios[2000], 50.0, ">="),
            ("longest time over shortest, 0.25 to 16 M", max_over_min(times), 1.3, "<"),
            ("places against a fresh build, greatest share", drift, 0.15, "<"),
        ]
    )


def max_over_min(times: dict[int, float]) -> float:
    """Return the longest time over the shortest."""
    return max(times.values()) / min(times.values())
