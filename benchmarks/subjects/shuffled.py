"""Queries that find caches cold, as the study asks them, against another checkout and own A*.

    git worktree add /tmp/before 4f9a53394
    python -m benchmarks shuffled --old /tmp/before --data FOLDER

Each checkout has a process of its own, and the two are asked in turn, pair by pair: warm (the best
of five), in shuffled order (as in the study's timing pass, the median of three), and cold (after
a write over more memory than all caches have). Times are those of the plan and of reading its path,
on the clock, which asks no kernel whose code is cold too; ratios are medians over all pairs of all
maps, those over A* of the harness's baseline, as in the study. Exits with 1 if a path of one
checkout has other bits than that of the other.
"""

import statistics
from argparse import Namespace
from pathlib import Path

from benchmarks.common import ROOT, Checkout
from benchmarks.options import NEEDED_DATA, option
from benchmarks.subjects._study_maps import maps_of
from benchmarks.tables import print_head, print_load, print_row

MODES = "warm", "shuffled", "cold"
REFERENCE, *PRESETS = "grid-astar", "shortest", "octile", "paper"

_WORKER = """
import hashlib, json, statistics, sys, time, warnings
import numpy as np
import hybridnav as hn
from hybridnav.harness.baselines.grid import GridAstar
warnings.simplefilter("ignore")
path, n_pairs, reference, presets = json.loads(sys.stdin.readline())
grid = hn.load_map(path, robot_radius_m=0.0 if path.endswith(".map") else 0.25)
topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
planners = {name: hn.HybridPlanner(topology, preset=name) for name in presets}
astar, methods = GridAstar(grid), [reference, *presets]
free, rng, filler = np.argwhere(grid.classes == 1), np.random.default_rng(0), np.ones(1 << 26, "u1")
def path_of(name):
    if name == reference:
        return astar.solve(*cells).cells
    path = planners[name].plan(*ends).path
    return None if path is None else path.points if name == "shortest" else path.cells
def ask(name):
    began = time.perf_counter()
    found = path_of(name)
    took = time.perf_counter() - began
    return took, b"" if found is None else found.tobytes()
def shuffled():
    found = {name: [] for name in methods}
    for _ in range(3):
        for name in rng.permutation(methods).tolist():
            found[name].append(ask(name)[0])
    return {name: statistics.median(times) for name, times in found.items()}
def cold(name):
    filler[::64] += 1
    return ask(name)[0]
for planner in planners.values():
    planner.prepare()
print(json.dumps(len(free)), flush=True)
for _ in range(n_pairs + 1):
    sys.stdin.readline()
    chosen = rng.choice(free, 2)
    cells, ends = [tuple(cell) for cell in chosen.tolist()], grid.frame.points_of(chosen)
    kept = {name: ask(name)[1] for name in methods}
    warm = {name: min(ask(name)[0] for _ in range(5)) for name in methods}
    digest = hashlib.sha256(b"".join(kept.values())).hexdigest()
    times = warm, shuffled(), {name: cold(name) for name in methods}
    print(json.dumps([times, digest]), flush=True)
"""

OPTIONS = [
    NEEDED_DATA,
    option("--old", type=Path, metavar="PATH", help="another checkout, to be compared with"),
    option("--map", nargs="*", default=(), metavar="GLOB", help="else all of the study"),
    option("--pairs", type=int, default=16, help="of each map"),
]


def main(given: Namespace) -> int:
    """Print a table."""
    times: list[list[list[dict[str, float]]]] = []  # by pair, checkout and mode
    all_same = True
    for one in maps_of(given.data, given.map):
        sides = [Checkout(path / "src", _WORKER) for path in (given.old, ROOT) if path is not None]
        for side in sides:
            side.ask(str(one.path), given.pairs, REFERENCE, PRESETS)
        found = [[side.ask() for side in sides] for _ in range(given.pairs + 1)][1:]
        all_same &= all(len({digest for _, digest in pair}) == 1 for pair in found)
        times += [[took for took, _ in pair] for pair in found]
        for side in sides:
            side.process.communicate()
    print_load()
    print_head("preset", "caches", *["old, ms"] * bool(given.old), "ms", "new/old", "A* / it")
    for preset in (*PRESETS, REFERENCE):
        for k, mode in enumerate(MODES):
            of = [[side[k][preset] * 1e3 for side in pair] for pair in times]
            shown = (f"{statistics.median(column):.3f}" for column in zip(*of, strict=True))
            ratio = f"{statistics.median(pair[-1] / pair[0] for pair in of):.2f}"
            rival = statistics.median(
                pair[-1][k][REFERENCE] / pair[-1][k][preset] for pair in times
            )
            print_row(preset, mode, *shown, ratio, f"{rival:.2f}")
    print("paths are the same, bit for bit" if all_same else "paths DIFFER")
    return 0 if all_same else 1
