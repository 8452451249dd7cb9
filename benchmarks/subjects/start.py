"""How long one waits for the first answer: commands, models, and bytes of models on disk.

Commands run as processes of their own, with compiled kernels in numba's cache; each time is the
least of the runs, from outside. The model of many cells is that of the project's office, mirrored
side by side; what loads it has answered a query on a small model before, so that no import and no
kernel is counted, and files are in the page cache.
"""

import json
import math
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from pathlib import Path

import numpy as np

import hybridnav as hn
from benchmarks.common import OFFICE, PLAINLY, PLAN, ROOT, prepared, read
from benchmarks.options import option
from benchmarks.subjects.scale import tile_of
from benchmarks.worlds import World
from hybridnav.harness.tables import Row, to_markdown

FIGURE = ROOT / "maps" / "figure1" / "figure1.yaml"

_FIRST = """
import json, sys, time
import hybridnav as hn
small, large, start, goal = sys.argv[1], sys.argv[2], *json.loads(sys.argv[3])
def answered(path, ends):
    began = time.perf_counter()
    planner = hn.load(path).planner()
    loaded = time.perf_counter()
    result = planner.plan(*ends)
    assert result.solved and result.gap < 1e-9
    return loaded - began, time.perf_counter() - loaded
answered(small, ((0.55, 0.55), (2.55, 2.85)))
print(json.dumps(answered(large, (start, goal))))
"""


def seconds(command: list[str], runs: int) -> float:
    """Wall time of a process, the least of some runs after one that is not counted."""
    found = []
    for _ in range(runs + 1):
        began = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True, env=PLAINLY)
        found.append(time.perf_counter() - began)
    return min(found[1:])


def hybridnav(*arguments: object) -> list[str]:
    """Return the command line of the program."""
    return [sys.executable, "-m", "hybridnav", *map(str, arguments)]


def bytes_a_cell(planner: hn.HybridPlanner, path: Path, *, compress: bool) -> float:
    """Write a model; return its size."""
    hn.save(planner, path, compress=compress)
    return path.stat().st_size / planner.topology.grid.classes.size


def far_apart(planner: hn.HybridPlanner) -> str:
    """Start and goal of a long query, as JSON."""
    level = planner.topology.level
    largest = planner.topology.pyramid.islands.component_of[tuple(level.cells.T)]
    inside = np.flatnonzero((largest == np.bincount(largest).argmax()) & (level.classes == 1))
    points = planner.topology.grid.frame.points_of(level.cells[inside])
    order = points.sum(axis=1).argsort()
    return json.dumps([points[order[0]].tolist(), points[order[-1]].tolist()])


def first_answer(large: Path, endpoints: str, folder: Path, runs: int) -> tuple[float, float]:
    """Seconds to load a model, and from there to the first answer, each the least of some runs."""
    small = folder / "small.hnm"
    grid = read(FIGURE, 0)
    hn.save(prepared(grid), small)
    command = [sys.executable, "-c", _FIRST, str(small), str(large), endpoints]
    found = [
        json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
        for _ in range(runs)
    ]
    load_s, answer_s = zip(*found, strict=True)
    return min(load_s), min(answer_s)


def rows_of(cells: float, runs: int, folder: Path) -> list[Row]:
    """Measure everything: what, figure, aim."""
    rows: list[Row] = []

    def add(what: str, figure: str, aim: str) -> None:
        rows.append({"what": what, "figure": figure, "aim": aim})

    office = prepared(read(OFFICE))
    model = folder / "office.hnm"
    mapped = bytes_a_cell(office, model, compress=False)
    packed = bytes_a_cell(office, folder / "packed.hnm", compress=True)
    help_s = seconds(hybridnav("--help"), runs)
    add("`hybridnav --help`", f"{help_s:.2f} s", "0.3 s")
    plan_s = seconds(hybridnav(*PLAN), runs)
    add("second `hybridnav plan` of the office", f"{plan_s:.2f} s", "1.2 s")
    plan_s = seconds(hybridnav("plan", model, *PLAN[2:]), runs)
    add("the same with a model", f"{plan_s:.2f} s", "0.8 s")
    add("model of the office, memory-mapped", f"{mapped:.1f} bytes a cell", "60")
    add("model of the office, compressed", f"{packed:.1f} bytes a cell", "20")

    pixels = tile_of(office.topology.grid, math.isqrt(int(cells)))
    grid = World(pixels, hn.Frame(0.05), "offices").grid()
    planner = prepared(grid)
    large, size = folder / "large.hnm", f"{pixels.size / 1e6:.1f} M cells"
    mapped = bytes_a_cell(planner, large, compress=False)
    load_s, answer_s = first_answer(large, far_apart(planner), folder, runs)
    add(f"load a model of {size}", f"{load_s:.3f} s", "0.3 s")
    add("first exact answer after that", f"{answer_s * 1e3:.1f} ms", "10 ms")
    packed = bytes_a_cell(planner, large, compress=True)
    load_s, _ = first_answer(large, far_apart(planner), folder, runs)
    add("load it compressed", f"{load_s:.3f} s", "")
    add(f"model of {size}", f"{mapped:.1f}, compressed {packed:.1f} bytes a cell", "60, 20")
    return rows


OPTIONS = [option("--cells", type=float, default=2e6), option("--runs", type=int, default=5)]


def main(given: Namespace) -> None:
    """Run the program."""
    with tempfile.TemporaryDirectory() as folder:
        print(to_markdown(rows_of(given.cells, given.runs, Path(folder))))
