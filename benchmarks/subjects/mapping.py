"""Maps from logs, as `hybridnav map` makes them: time, and agreement with counting grids.

`--data` (or HYBRIDNAV_DATA) holds `radish_logs` and `radish_grids`. A counting grid calls a cell
occupied by its share of hits, so the two methods differ. A cell is known by a map if it is free or
occupied there; the disagreement is the share of the cells known by both that one map calls free and
the other one occupied.
"""

import time
from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import hybridnav as hn
from benchmarks.common import read
from benchmarks.options import NEEDED_DATA, option
from benchmarks.tables import print_head, print_row
from hybridnav.ext.live.mapping import LaserModel, Mapper


@dataclass(frozen=True)
class Agreement:
    """Cells of two maps on one lattice."""

    by_both: int
    disagreeing: int
    by_given: int
    by_ours: int


def compare(ours: hn.OccupancyGrid, given: hn.OccupancyGrid) -> Agreement:
    """Count the cells that two maps know, and those on which they disagree."""
    shift = np.subtract(ours.frame.origin_m, given.frame.origin_m) / given.resolution_m
    col, row = np.rint(shift).astype(int).tolist()
    unexplored = hn.CellClass.UNEXPLORED
    whole = np.full(np.add(given.shape, 2 * max(ours.shape)), unexplored, dtype=np.uint8)
    top, left = row + max(ours.shape), col + max(ours.shape)
    whole[top : top + ours.shape[0], left : left + ours.shape[1]] = ours.measured
    rows, cols = given.shape
    begin = max(ours.shape)
    there = whole[begin : begin + rows, begin : begin + cols]
    both = (there != unexplored) & (given.measured != unexplored)
    return Agreement(
        by_both=int(both.sum()),
        disagreeing=int((both & (there != given.measured)).sum()),
        by_given=int((given.measured != unexplored).sum()),
        by_ours=int((ours.measured != unexplored).sum()),
    )


def map_log(path: Path, given: hn.OccupancyGrid) -> tuple[hn.OccupancyGrid, list[str]]:
    """Map a log on the lattice of a given grid; return the map, and cells of the table."""
    mapper = Mapper(
        resolution_m=given.resolution_m,
        laser=LaserModel(when_hit=0.988),
        corner_m=given.frame.origin_m,
        least_probability=0.0,
    )
    log, adding_s = hn.ext.live.CarmenLog(path), []
    began = time.perf_counter()
    for scan in log:
        before = time.perf_counter()
        if not mapper.add(scan):
            log.leave_out("beyond the greatest map")
        adding_s.append(time.perf_counter() - before)
    seconds = time.perf_counter() - began
    pace = f"{log.duration_s / seconds:,.0f} x" if log.duration_s > 1 else "-"
    per_scan = np.array(adding_s) * 1e6
    figures = [
        f"{log.n_scans}",
        f"{log.skipped.total()}",
        f"{seconds:.2f}",
        f"{np.median(per_scan):.0f} / {np.quantile(per_scan, 0.95):.0f}",
        pace,
    ]
    return mapper.to_grid(robot_radius_m=0, name=path.stem), figures


OPTIONS = [
    NEEDED_DATA,
    option("--pictures", type=Path, help="folder for our maps beside the given ones"),
]


def main(given: Namespace) -> None:
    """Print the table."""
    logs = sorted((given.data / "radish_logs").glob("*-corrected.log.gz"))
    columns = "log", "scans", "left out", "seconds", "us a scan, median / p95"
    judged = "disagreement", "known by both, of the given", "of ours"
    print_head(*columns, "faster than recorded", *judged)
    for number, path in enumerate(logs):
        name = path.name.removesuffix("-corrected.log.gz")
        published = read(given.data / "radish_grids" / f"{name}.yaml", 0)
        if number == 0:
            map_log(path, published)  # compiles
        ours, figures = map_log(path, published)
        found = compare(ours, published)
        shares = [
            f"{found.disagreeing / found.by_both:.2%}",
            f"{found.by_both / found.by_given:.1%}",
            f"{found.by_both / found.by_ours:.1%}",
        ]
        print_row(name, *figures, *shares)
        if given.pictures is not None:
            hn.write_ros_map(ours, given.pictures / f"{name}.yaml")
