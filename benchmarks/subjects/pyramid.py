"""Build time and memory of the pyramid, from 1 M to 64 M vertices.

Each size runs in a process of its own, on one core, with the kernels loaded by a build of one
office: the office tiled, its copies joined by doors, grid in memory to apex. The first build of the
size measures the memory: the growth of the resident set's peak, with the grid loaded (Linux only).
The second measures the time.
"""

import json
import subprocess
import sys
import time
from argparse import SUPPRESS, Namespace
from pathlib import Path

import numpy as np

from benchmarks.common import option, print_head, print_row

TILINGS = ((1, 2), (2, 4), (4, 8), (8, 9), (10, 12))
VERTICES_PER_TILE = 531_450

_STATUS = Path("/proc/self/status")
_CLEAR = Path("/proc/self/clear_refs")


def _resident(key: str) -> int:
    """Bytes of VmRSS (now) or VmHWM (peak)."""
    for line in _STATUS.read_text().splitlines():
        if line.startswith(key):
            return int(line.split()[1]) * 1024
    raise ValueError(key)


def measure(rows: int, cols: int) -> dict[str, object]:
    """Build one size twice: memory of the first, time of the second.

    The floor is one pass over memory: the classes read, the record of seven bytes a cell written.
    """
    import hybridnav as hn  # noqa: PLC0415 - in the child only
    from benchmarks.worlds import office_world, tiled  # noqa: PLC0415

    grid = tiled(office_world(), rows=rows, cols=cols).grid(robot_radius_m=0)
    vertices = int((grid.classes != hn.CellClass.OCCUPIED).sum())
    hn.DualGraphPyramid.build(office_world().grid(robot_radius_m=0))
    before = _resident("VmRSS")
    _CLEAR.write_text("5")
    pyramid = hn.DualGraphPyramid.build(grid)
    peak = _resident("VmHWM")
    del pyramid
    began = time.perf_counter()
    pyramid = hn.DualGraphPyramid.build(grid)
    seconds = time.perf_counter() - began
    levels, places, stages = len(pyramid), pyramid.stats.sizes[-1].vertices, pyramid.stats.seconds
    del pyramid
    began = time.perf_counter()
    grid.classes.sum()
    np.ones(grid.classes.size, np.uint8), np.ones(grid.classes.size, np.int32)
    np.ones(2 * grid.classes.size, np.uint8)
    floor = time.perf_counter() - began
    return {
        "vertices": vertices,
        "levels": levels,
        "places": places,
        "seconds": seconds,
        "bytes": (peak - before) / vertices,
        "stages": stages | {"floor": floor},
    }


OPTIONS = [
    option("--most", type=float, default=64.0, help="largest size, million vertices"),
    option("--one", type=int, nargs=2, help=SUPPRESS),
]


def main(given: Namespace) -> None:
    """Print the table."""
    if given.one:
        sys.stdout.write(json.dumps(measure(*given.one)))
        return
    columns = "vertices", "levels", "places", "s", "M vertices/s", "ns a vertex"
    print_head(*columns, "bytes a vertex")
    stages = {}
    for rows, cols in TILINGS:
        if rows * cols * VERTICES_PER_TILE > given.most * 1e6:
            continue
        command = [sys.executable, "-m", "benchmarks", "pyramid", "--one", str(rows), str(cols)]
        run = subprocess.run(command, check=True, capture_output=True, text=True)
        figures = json.loads(run.stdout)
        n, seconds = figures["vertices"], figures["seconds"]
        times = f"{seconds:.2f}", f"{n / seconds / 1e6:.2f}", f"{seconds / n * 1e9:.0f}"
        places = f"{figures['places']:,}"
        print_row(f"{n:,}", figures["levels"], places, *times, f"{figures['bytes']:.0f}")
        stages[n] = figures["stages"]
    print("\nns a vertex by stage, and the floor\n")
    for n, times in stages.items():
        print(f"- {n:,}: " + ", ".join(f"{key} {s / n * 1e9:.0f}" for key, s in times.items()))
