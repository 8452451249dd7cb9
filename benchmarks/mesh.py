"""The table of the mesh: preparation, memory and queries of `MeshSearch`, map by map.

    python -m benchmarks.mesh --data FOLDER [--map GLOB] [--pairs 200] [--seed 0] [--tiles 1]

All ROS maps of kind `map` in FOLDER/maps.tsv with at least 0.3 M cells, robot radius 0.25 m;
`--map` takes those of any size whose path in FOLDER it matches, and the grids of
FOLDER/any_angle_optima and FOLDER/movingai. With `--tiles N` a map is repeated N times in both
directions, joined by a row and a column. Cells are drawn from the largest connected part. Every
query is put to the search of intervals and to the graph of corners in turn, in one process, and
their lengths are compared; exit code 1 where they differ. Times are of the thread, the least of
three runs.
"""

from __future__ import annotations

import argparse
import fnmatch
import gc
import os
import sys
import time
import warnings
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import hybridnav as hn
from hybridnav.maps import CellClass
from hybridnav.search.mesh import MeshSearch, build_mesh

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from hybridnav._base.typing import BoolArray

Cell = tuple[int, int]

LEAST_CELLS = 300_000
WARM = np.random.default_rng(0).random((60, 60)) > 0.2
HEAD = (
    "| map | free cells | corners | edges or arcs | mesh, graph: us a free cell | bytes |"
    " intervals | corners expanded | intervals: ms | corners: ms | 1 %: ms |\n" + "|---" * 11 + "|"
)


def maps_of(data: Path, globs: list[str]) -> Iterator[tuple[str, BoolArray]]:
    """Names and free cells of the maps."""
    lines = (data / "maps.tsv").read_text(encoding="utf-8").splitlines()[1:]
    names = [path for path, kind in (line.split("\t") for line in lines) if kind == "map"]
    names += [
        path.relative_to(data).as_posix()
        for folder in ("any_angle_optima", "movingai")
        for path in sorted((data / folder).rglob("*.map"))
    ]
    for name in names:
        if globs and not any(fnmatch.fnmatch(name, glob) for glob in globs):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", hn.MapWarning)
            radius_m = 0.0 if name.endswith(".map") else 0.25
            free = hn.load_map(data / name, robot_radius_m=radius_m).classes == CellClass.FREE
        if globs or (free.size >= LEAST_CELLS and not name.endswith(".map")):
            yield name, free


def tiled(free: BoolArray, number: int) -> BoolArray:
    """The map many times in both directions, joined by its row and its column that have the most
    free cells: these are freed altogether."""
    tile = np.pad(free, ((0, 1), (0, 1)))
    tile[free.sum(axis=1).argmax(), :] = tile[:, free.sum(axis=0).argmax()] = True
    return np.tile(tile, (number, number))


def nbytes(things: object) -> int:
    """Bytes of the arrays in a value and what it holds, each once."""
    seen: dict[int, int] = {}

    def walk(thing: Any) -> None:
        if isinstance(thing, np.ndarray):
            seen[id(thing)] = thing.nbytes
        elif isinstance(thing, tuple):
            for item in thing:
                walk(item)
        elif hasattr(thing, "__dict__"):
            walk(tuple(vars(thing).values()))

    walk(things)
    return sum(seen.values())


def clocked(call: Callable[[], Any], runs: int = 3) -> tuple[Any, float]:
    """What a call returns, and the least milliseconds that it took."""
    best = np.inf
    for _ in range(runs):
        began = time.thread_time()
        found = call()
        best = min(best, time.thread_time() - began)
    return found, best * 1e3


def measure(name: str, free: BoolArray, *, pairs: int, seed: int) -> bool:
    """Print the line of one map; returns whether all lengths agree."""
    mesh, mesh_ms = clocked(lambda: build_mesh(free), 1)
    plain, prepared = MeshSearch(mesh), MeshSearch(mesh)
    _, graph_ms = clocked(prepared.prepare, 1)
    part = mesh.component[mesh.polygon_at[free]]
    cells = np.argwhere(free)[part == np.bincount(part).argmax()]
    chosen = cells[np.random.default_rng(seed).integers(len(cells), size=(pairs, 2))].tolist()
    rows = []
    agree = True
    for (a, b), (c, d) in chosen:
        endpoints = ((a, b), (c, d)), ((a + 0.5, b + 0.5), (c + 0.5, d + 0.5))
        slow, slow_ms = clocked(partial(plain.path, *endpoints, budget_s=1e9))
        fast, fast_ms = clocked(partial(prepared.path, *endpoints))
        _, near_ms = clocked(partial(prepared.path, *endpoints, epsilon=0.01))
        agree = agree and abs(slow.length_cells - fast.length_cells) < 1e-6
        rows.append((slow.expanded, fast.expanded, slow_ms, fast_ms, near_ms))
    n_free = int(free.sum())
    table = np.array(rows)
    middle, high = np.median(table, axis=0), np.percentile(table, 95, axis=0)
    counts = [f"{m:.0f} / {h:.0f}" for m, h in zip(middle[:2], high[:2], strict=True)]
    times = [f"{m:.3f} / {h:.3f}" for m, h in zip(middle[2:], high[2:], strict=True)]
    graph = prepared.graph
    costs = f"{mesh_ms / n_free * 1e3:.2f}, {graph_ms / n_free * 1e3:.2f}"
    sizes = f"{nbytes(plain) / n_free:.0f}, {nbytes(graph) / n_free:.0f}"
    edges = 0 if graph is None else len(graph.arrays[1])
    cells_of = [name, f"{n_free / 1e6:.2f} M", str(len(mesh.corners)), str(edges), costs, sizes]
    print("| " + " | ".join(cells_of + counts + times) + " |", flush=True)
    return agree


def main() -> int:
    """Run the program."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("--map", action="append", default=[], metavar="GLOB")
    parser.add_argument("--pairs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tiles", type=int, default=1)
    asked = parser.parse_args()
    search = MeshSearch(build_mesh(WARM))
    for _ in range(2):
        cell = tuple(np.argwhere(WARM)[0].tolist()), tuple(np.argwhere(WARM)[-1].tolist())
        search.path(cell, cell)
        search.prepare()
    print(HEAD)
    agree = True
    for name, free in maps_of(asked.data, asked.map):
        cells = tiled(free, asked.tiles) if asked.tiles > 1 else free
        agree = measure(name, cells, pairs=asked.pairs, seed=asked.seed) and agree
        gc.collect()
    return 0 if agree else 1


if __name__ == "__main__":
    sys.exit(main())
