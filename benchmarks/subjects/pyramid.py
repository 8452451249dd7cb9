"""Build time and memory of the pyramid: tiled offices up to 64 M vertices, and maps of the study.

Each map runs in a process of its own, on one core, with the kernels loaded by a build of one
office: the office tiled, its copies joined by doors, or, with --data, a map of the study with at
least 1 M cells; grid in memory to apex. The first build measures the memory: the growth of the
resident set's peak, with the grid loaded (Linux only). Those after it, in turn with
`scipy.ndimage.distance_transform_edt` of the same free cells, measure the time of the processor;
the least counts.
"""

import ctypes
import json
import subprocess
import sys
import time
from argparse import SUPPRESS, Namespace
from pathlib import Path

from scipy import ndimage

from benchmarks.common import matches, read, timed
from benchmarks.options import DATA, option
from benchmarks.subjects._study_maps import RAW_MAPS, ROS_MAPS
from benchmarks.tables import print_head, print_load, print_row

TILINGS = ((1, 2), (2, 4), (4, 8), (8, 9), (10, 12))
VERTICES_PER_TILE = 531_450
LEAST_CELLS = 1_000_000
RUNS = 3

_STATUS = Path("/proc/self/status")
_CLEAR = Path("/proc/self/clear_refs")


def _resident(key: str) -> int:
    """Bytes of VmRSS (now) or VmHWM (peak)."""
    for line in _STATUS.read_text().splitlines():
        if line.startswith(key):
            return int(line.split()[1]) * 1024
    raise ValueError(key)


def measure(which: str) -> dict[str, object]:
    """Build "rows x cols" tiles or a map file: memory of the first build, time of the others."""
    import hybridnav as hn  # noqa: PLC0415 - in the child only
    from benchmarks.worlds import office_world, tiled  # noqa: PLC0415

    build = hn.DualGraphPyramid.build
    if Path(which).exists():
        grid = read(Path(which))
    else:
        rows, cols = map(int, which.split("x"))
        grid = tiled(office_world(), rows=rows, cols=cols).grid(robot_radius_m=0)
    build(office_world().grid(robot_radius_m=0))
    ctypes.CDLL(None).malloc_trim(0)  # what the build of the office has left is no room for this
    before = _resident("VmRSS")
    _CLEAR.write_text("5")
    pyramid = build(grid)
    peak = _resident("VmHWM")
    n = grid.classes.size
    levels, places, vertices = len(pyramid), pyramid.stats.sizes[-1].vertices, pyramid[0].n_vertices
    del pyramid
    free = grid.classes == hn.CellClass.FREE
    builds, transforms = [], []
    for _ in range(RUNS):
        pyramid, seconds = timed(lambda: build(grid), clock=time.thread_time)
        builds.append((seconds, pyramid.stats.seconds))
        del pyramid
        transforms.append(
            timed(lambda: ndimage.distance_transform_edt(free), clock=time.thread_time)[1]
        )
    seconds, stages = min(builds, key=lambda one: one[0])
    counts = f"{n:,}", f"{vertices:,}", levels, f"{places:,}"
    times = f"{seconds:.2f}", f"{seconds / n * 1e9:.0f}", f"{seconds / min(transforms):.2f}"
    return {
        "cells": n,
        "row": [*counts, *times, f"{(peak - before) / n:.1f}"],
        "stages": {key: f"{s / n * 1e9:.1f}" for key, s in stages.items()},
    }


OPTIONS = [
    DATA,
    option("--map", nargs="*", default=(), metavar="GLOB", help="maps of --data, else all"),
    option("--most", type=float, default=64.0, help="largest tiling, million vertices"),
    option("--one", help=SUPPRESS),
]


def main(given: Namespace) -> None:
    """Print the table."""
    if given.one:
        sys.stdout.write(json.dumps(measure(given.one)))
        return
    tilings = [
        f"{rows}x{cols}"
        for rows, cols in TILINGS
        if rows * cols * VERTICES_PER_TILE <= given.most * 1e6
    ]
    print_load()
    columns = "map", "cells", "vertices", "levels", "places", "s", "ns a cell"
    print_head(*columns, "over the distance transform", "bytes a cell")
    stages = {}
    for name in [*tilings, *([] if given.data is None else (*ROS_MAPS, *RAW_MAPS))]:
        if given.map and name not in tilings and not matches(name, given.map):
            continue
        of = name if name in tilings else str(given.data / name)
        command = [sys.executable, "-m", "benchmarks", "pyramid", "--one", of]
        run = subprocess.run(command, check=True, capture_output=True, text=True)
        figures = json.loads(run.stdout)
        if figures["cells"] >= LEAST_CELLS:
            print_row(name, *figures["row"])
            stages[name] = figures["stages"]
    print("\nns a cell by stage, by the clock on the wall\n")
    for name, times in stages.items():
        print(f"- {name}: " + ", ".join(f"{key} {ns}" for key, ns in times.items()))
