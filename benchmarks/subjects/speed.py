"""What people wait for, against another checkout: pyramids, lanes, and the start of commands.

    git worktree add /tmp/before 4f9a53394
    python -m benchmarks speed --old /tmp/before --data FOLDER

Each checkout has a process of its own, and the two are asked in turn: the pyramid of maps of the
study, its record compared bit by bit, beside `scipy.ndimage.distance_transform_edt` of the same
free cells; the lanes of maps, all arrays compared. Commands run as processes, in turn too. Times
are those of the processor, medians of `--runs`. Without --old there is nothing to compare with.
Exits with 1 if a pyramid or a graph differs.
"""

import os
import statistics
import subprocess
import sys
import tempfile
from argparse import Namespace
from pathlib import Path
from typing import Any

from benchmarks.common import OFFICE, PLAN, ROOT, Checkout, matches
from benchmarks.options import NEEDED_DATA, option
from benchmarks.subjects._study_maps import RAW_MAPS, ROS_MAPS
from benchmarks.tables import print_head, print_row

LANES = "aws_small_warehouse/002/map.yaml", "fetch_maps/4_26_15.yaml", "bwi_gdc/3ne/3ne.yaml"
LEAST_CELLS = 1_000_000
COMMANDS = {
    "--help": "--help",
    "plan": " ".join(PLAN),
    "evaluate": "evaluate maps/figure1/figure1.yaml --pairs 20 -o {folder}/{run}",
    "rooms": f"rooms {OFFICE}",
    "export": f"export {OFFICE} -o {{folder}}/graph.geojson --force",
    "show": f"show {OFFICE}",
    "check": f"check {OFFICE} {{folder}}/graph.geojson",
}
"""`check` reads what `export` wrote."""

_WORKER = """
import hashlib, json, sys, time, warnings
from functools import cache
import numpy as np
from scipy import ndimage
import hybridnav as hn
from hybridnav.graphs import build_lane_graph
warnings.simplefilter("ignore")
grid_of = cache(lambda path: hn.load_map(path, robot_radius_m=0.25))
build = hn.DualGraphPyramid.build
map_of = cache(lambda path: hn.TopologicalMap(build(grid_of(path))))
def lanes(graph):
    return graph.positions, graph.edges, graph.clearances_m, graph.widths_m
asked = {
    "pyramid": (grid_of, build, lambda made: vars(made.record).values()),
    "transform": (lambda path: grid_of(path).classes == 1, ndimage.distance_transform_edt, list),
    "lanes": (map_of, build_lane_graph, lanes),
}
for line in sys.stdin:
    what, path = json.loads(line)
    given, make, arrays = asked[what]
    thing = given(path)
    began = time.thread_time()
    made = make(thing)
    took = time.thread_time() - began
    digest = hashlib.sha256(b"".join(np.ascontiguousarray(one) for one in arrays(made)))
    print(json.dumps([took, digest.hexdigest(), grid_of(path).classes.size]), flush=True)
"""


class Side(Checkout):
    """A process that builds with the sources of one checkout, and commands that run with them."""

    def __init__(self, checkout: Path) -> None:
        super().__init__(checkout / "src", _WORKER)

    def command_s(self, words: str) -> float:
        """Return the processor's seconds of a command, of its own processes too."""
        before = os.times()
        command = [sys.executable, "-m", "hybridnav", *words.split()]
        run = subprocess.run(command, env=self.env, cwd=ROOT, capture_output=True, check=False)
        if run.returncode not in {0, 1}:  # 1: found something
            raise ChildProcessError(run.stderr.decode())
        after = os.times()
        return sum(after[2:4]) - sum(before[2:4])  # of children


def row_of(what: str, times: list[list[float]], *more: object) -> None:
    """Print medians of the checkouts, the old one first, and the ratio of the new one to it."""
    medians = [statistics.median(each) for each in times]
    ratio = f"{medians[-1] / medians[0]:.2f}" if len(medians) > 1 else ""
    print_row(what, *(f"{median:.3f}" for median in medians), ratio, *more)


def in_turn(sides: list[Side], what: str, path: Path, runs: int) -> tuple[list[list[float]], bool]:
    """Return the times of each side, and whether all made the same; the first run only warms."""
    found = [[side.ask(what, str(path)) for side in sides] for _ in range(runs + 1)]
    same = len({digest for run in found for _, digest, _ in run}) == 1
    return [[run[k][0] for run in found[1:]] for k in range(len(sides))], same


OPTIONS = [
    NEEDED_DATA,
    option("--old", type=Path, metavar="PATH", help="another checkout, to be compared with"),
    option("--map", nargs="*", default=(), metavar="GLOB", help="else all with 1 M cells"),
    option("--runs", type=int, default=5),
]


def main(given: Namespace) -> int:
    """Print three tables."""
    sides = [Side(path) for path in (given.old, ROOT) if path is not None]
    heads = ["old, s", "new, s", "new/old"] if given.old else ["s", ""]
    all_same = True
    print_head("pyramid", *heads, "over the distance transform", "bits")
    for name in (*ROS_MAPS, *RAW_MAPS):
        path = given.data / name
        if given.map and not matches(name, given.map):
            continue
        if sides[-1].ask("transform", str(path))[2] < LEAST_CELLS:
            continue
        times, same = in_turn(sides, "pyramid", path, given.runs)
        scipy_s = statistics.median(in_turn(sides[-1:], "transform", path, given.runs)[0][0])
        over = f"{statistics.median(times[-1]) / scipy_s:.2f}"
        row_of(name, times, over, "same" if same else "DIFFER")
        all_same &= same
    print()
    print_head("lanes", *heads, "arrays")
    for name in LANES:
        times, same = in_turn(sides, "lanes", given.data / name, given.runs)
        row_of(name, times, "same" if same else "DIFFER")
        all_same &= same
    print()
    print_head("command", *heads)
    with tempfile.TemporaryDirectory() as folder:
        for name, words in COMMANDS.items():
            found: list[list[Any]] = [[] for _ in sides]
            for run in range(given.runs + 1):
                for k, side in enumerate(sides):
                    at = words.format(folder=folder, run=f"{name}{run}{k}")
                    found[k].append(side.command_s(at))
            row_of(f"`hybridnav {name}`", [each[1:] for each in found])
    return 0 if all_same else 1
