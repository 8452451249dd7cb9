"""Maps of 1 M to 256 M cells: seconds and memory of each step, the first answers and later ones.

Each size is a square of tiles. A tile is a real building, mirrored until it fills the tile, with a
street round it. The map is written as a file, which a process of its own loads and plans on, with
the kernels loaded by a small map. It prints, for each step,

    s           seconds of a core: a busy machine stretches all others; in brackets those of a cell,
                over those of the row before
    GB          peak of the resident set (Linux only)

    read        from the file to the classes of its cells
    places      the pyramid and its places
    first       the first `planner.plan`, with what it waits for
    rest        what is built behind the first ones, or by `planner.prepare`
    ms          median of the next plans, before the rest is built; then median and 95 % quantile of
                later ones, each the least of three

Pairs are drawn from the largest part of free space, all over it.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from argparse import SUPPRESS, Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import hybridnav as hn
from benchmarks.common import FAR_APART, OFFICE, largest_part, prepared, read
from benchmarks.options import NEEDED_DATA, SEED, option
from benchmarks.tables import print_head, print_row
from hybridnav._base.typing import ByteArray, FloatArray

TILES = (
    "willow/willow-2010-02-18-0.10.yaml",
    "bwi_gdc/3/3.yaml",
    "strands/tsc_y4/tsc_1701.yaml",
    "bwi_gdc/2/2.yaml",
)
"""Real buildings, which take turns as tiles."""
TILE, STREET = 1024, 24
"""Cells of a tile's side, at most half of the map's, and of its margin that is free."""
SIDES = (1024, 2048, 4096, 8192, 16384)
N_PAIRS, N_EARLY = 300, 5
_GREY = np.array([0, 254, 205], np.uint8)
"""Grey values of map_server by `CellClass`."""


def tile_of(grid: hn.OccupancyGrid, side: int) -> ByteArray:
    """Return a square tile, uint8 grey, full of one building and its mirror images.

    A building is cut where its largest part ends. There the part has a cell at each side of the
    cut, and its mirror image beside it, as far from walls as the radius: so they are joined.
    """
    inside = largest_part(grid.classes == hn.CellClass.FREE)
    low, high = inside.min(axis=0), inside.max(axis=0) + 1
    building = _GREY[grid.measured[low[0] : high[0], low[1] : high[1]]]
    room = side - 2 * STREET
    more = [(0, max(room - size, 0)) for size in building.shape]
    tile = np.pad(building, more, mode="symmetric")[:room, :room]
    return np.pad(tile, STREET, constant_values=_GREY[hn.CellClass.FREE])


def write_map(data: Path, side: int, folder: Path) -> Path:
    """Write a square map of tiles; return its file."""
    of_side = min(side // 2, TILE)
    one, two, three, four = (tile_of(read(data / name), of_side) for name in TILES)
    block = np.block([[one, two], [three, four]])
    with (folder / "map.pgm").open("wb") as stream:
        stream.write(b"P5 %d %d 255\n" % (side, side))
        for _ in range(side // len(block)):
            stream.write(np.tile(block, (1, side // len(block))).tobytes())
    yaml = folder / "map.yaml"
    yaml.write_text(
        "{image: map.pgm, resolution: 0.05, origin: [0, 0, 0], negate: 0, "
        "free_thresh: 0.196, occupied_thresh: 0.65}"
    )
    return yaml


def step(call: Callable[[], Any], clock: Callable[[], float] = time.thread_time) -> Any:
    """Return what a call returns, its seconds by a clock, and the peak in GB."""
    Path("/proc/self/clear_refs").write_text("5")
    began = clock()
    found = call()
    seconds = clock() - began
    peak = Path("/proc/self/status").read_text().split("VmHWM:")[1]
    return found, (seconds, int(peak.split()[0]) * 1024 / 1e9)


def solved_ms(planner: hn.HybridPlanner, ends: FloatArray) -> float:
    """Milliseconds of a plan, which must be solved."""
    began = time.perf_counter()
    result = planner.plan(*ends)
    seconds = time.perf_counter() - began
    result.raise_for_status()
    return 1e3 * seconds


def measure(yaml: Path, seed: int, presets: list[str]) -> dict[str, Any]:
    """Measure one map in this process."""
    for preset in presets:
        prepared(read(OFFICE), preset).plan(*FAR_APART)
    told: dict[str, Any] = {"load": os.getloadavg()[0]}
    grid, told["read"] = step(lambda: hn.load_map(yaml, robot_radius_m=0.25, max_cells=1 << 28))
    told["cells"] = grid.classes.size
    inside = largest_part(grid.classes == hn.CellClass.FREE)
    chosen = np.random.default_rng(seed).choice(inside, (N_PAIRS, 2))
    ends = grid.frame.points_of(chosen.reshape(-1, 2)).reshape(-1, 2, 2)
    del inside
    topology, told["places"] = step(lambda: hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    for preset in presets:
        planner = hn.HybridPlanner(topology, preset=preset)
        _, told[f"{preset}, first"] = step(partial(solved_ms, planner, ends[0]))
        early = [solved_ms(planner, ends[k]) for k in range(1, 1 + N_EARLY)]
        _, told[f"{preset}, rest"] = step(planner.prepare, time.process_time)
        ms = np.min([[solved_ms(planner, pair) for pair in ends] for _ in range(3)], axis=0)
        told[f"{preset}, ms"] = np.median(early), *np.quantile(ms[N_EARLY:], (0.5, 0.95))
        del planner
    return told


def measured(given: Namespace, side: int) -> dict[str, Any]:
    """Measure a map of a size in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        yaml = write_map(given.data, side, Path(folder))
        words = "--presets", given.presets, "--most-gb", str(given.most_gb)
        command = [sys.executable, "-m", "benchmarks", "scale", "--one", str(yaml), *words]
        run = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    told: dict[str, Any] = json.loads(run.stdout)
    return told


OPTIONS = [
    NEEDED_DATA,
    SEED,
    option("--least", type=float, default=1.0, help="smallest size, million cells"),
    option("--most", type=float, default=64.0, help="largest size, million cells"),
    option("--most-gb", type=float, default=18.0, help="address space of the process"),
    option("--presets", default="shortest,octile"),
    option("--one", type=Path, help=SUPPRESS),
]


def main(given: Namespace) -> None:
    """Print the tables."""
    presets = given.presets.split(",")
    if given.one:
        most = int(given.most_gb * 1e9)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        sys.stdout.write(json.dumps(measure(given.one, given.seed, presets)))
        return
    steps = [
        "read",
        "places",
        *(f"{name}, {part}" for name in presets for part in ("first", "rest")),
    ]
    print_head("cells", *steps)
    before: dict[str, float] = {}
    answers = []
    for side in SIDES:
        if not given.least <= side * side / 2**20 <= given.most:
            continue
        told = measured(given, side)
        row = [f"{told['cells']:,}"]
        for name in steps:
            seconds, peak = told[name]
            of_cell = seconds / told["cells"]
            ratio = f" ({of_cell / before[name]:.2f})" if name in before else ""
            row.append(f"{seconds:.2f} s{ratio}, {peak:.1f} GB")
            before[name] = of_cell
        print_row(*row)
        answers.append([row[0], *(told[f"{name}, ms"] for name in presets), f"{told['load']:.1f}"])
    print()
    print_head("cells", *(f"{name}, ms" for name in presets), "load")
    for cells, *answered, load in answers:
        words = (f"{one:.1f}, then {middle:.2f} / {high:.2f}" for one, middle, high in answered)
        print_row(cells, *words, load)
