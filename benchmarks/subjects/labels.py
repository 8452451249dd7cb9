"""Hub labels: memory, preparation, and the time of a distance, against the search without them.

Lengths of the sample are compared with those of the search of intervals: the exit code is 1 if one
differs by more than 1e-9 cells. Times are of the processor, the least of some runs, of kernels
alone.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from benchmarks.common import NEEDED_DATA, OFFICE, option, print_head, print_load, print_row, read
from benchmarks.subjects._study_maps import RAW_MAPS, ROS_MAPS
from hybridnav.search.mesh import MeshSearch, build_mesh, shortest_paths
from hybridnav.search.mesh.kernels.hubs import query_hubs
from hybridnav.search.mesh.kernels.polyanya import WORK_FULL
from hybridnav.search.mesh.kernels.queries import many
from hybridnav.search.mesh.search import rounded_into

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable

_SAME = 1e-9
COLUMNS = ("map", "corners", "entries", "side", "MB", "us a cell", "distance, us", "path, us")
OPTIONS = (
    NEEDED_DATA,
    option("--mb", type=float, default=100.0, help="memory that is allowed"),
    option("--pairs", type=int, default=3000, help="pairs of ends, anywhere in free cells"),
    option("--only", default="", help="part of the path of the maps to measure"),
    option("--runs", type=int, default=7, help="runs; the fastest counts"),
)


@numba.njit
def _lengths(mesh: Any, labels: Any, place: Any, asked: Any, work: Any) -> int:
    n_full = 0
    cells, ends = asked
    for k in range(len(cells)):
        where = place[0], place[1], (cells[k, 0], cells[k, 1], cells[k, 2], cells[k, 3])
        points = ends[k, 0], ends[k, 1], ends[k, 2], ends[k, 3]
        status, _ = query_hubs(mesh, labels, where, points, work, (np.inf, 0.0, 0))
        n_full += status == WORK_FULL
    return n_full


def main(given: Namespace) -> int:
    """Print the table."""
    print_load()
    print_head(*COLUMNS, "path without labels, us", "most off, cells")
    maps = [OFFICE, *(given.data / name for name in (*ROS_MAPS, *RAW_MAPS))]
    maps += sorted((given.data / "movingai" / "cities").glob("*.map"))
    MeshSearch(build_mesh(np.ones((2, 2), np.bool_))).label(1.0)  # compiles
    fit = [path for path in maps if given.only in str(path)]
    return int(max(_measure(path, given) for path in fit) > _SAME)


def _measure(path: Any, given: Namespace) -> float:
    """Print a row; return the greatest difference of two lengths."""
    grid = read(path)
    free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
    mesh = build_mesh(free)
    plain, search = MeshSearch(mesh), MeshSearch(mesh)
    for one in (plain, search):
        one.prepare()
    begun = time.process_time()
    is_made = search.label(given.mb)
    seconds = time.process_time() - begun
    rng = np.random.default_rng(0)
    cells = rng.choice(np.argwhere(free), (2, given.pairs))
    ends = rounded_into(cells, cells + rng.random(cells.shape))
    asked = (
        np.concatenate(tuple(cells), axis=1),
        np.ascontiguousarray(np.concatenate(tuple(ends), axis=1)[:, [1, 0, 3, 2]]),
    )
    row = [f"{path.parent.name}/{path.stem}", str(int(mesh.is_convex.sum()))]
    before = f"{_us(lambda: _paths(plain, asked), given):.0f}"
    if not is_made:
        print_row(*row, "", "", f"> {given.mb:g}", f"{seconds / free.sum() * 1e6:.1f}", "", "")
        return 0.0
    labels: Any
    labels, works = search.engine()
    with works.lent() as room:
        room.make_room()
        place = mesh.component, mesh.polygon_at
        length_us = _us(
            lambda: _lengths(search.arrays, labels.arrays, place, asked, room.arrays), given
        )
    path_us = _us(lambda: _paths(search, asked), given)
    lengths = [
        shortest_paths(one, tuple(cells), tuple(ends)).length_cells for one in (search, plain)
    ]
    reached = np.isfinite(lengths[1])
    off = np.abs(lengths[0][reached] - lengths[1][reached]).max(initial=0.0)
    off = np.inf if (np.isfinite(lengths[0]) != reached).any() else off
    row += [f"{len(labels.entries) / max(1, mesh.is_convex.sum()):.0f}", f"{labels.layout[0]:.0f}"]
    row += [f"{labels.n_bytes / 1e6:.0f}", f"{seconds / free.sum() * 1e6:.1f}"]
    print_row(*row, f"{length_us:.1f}", f"{path_us:.1f}", before, f"{off:.0e}")
    return float(off)


def _paths(search: MeshSearch, asked: tuple[Any, Any]) -> None:
    """Find the paths of all pairs, in this thread."""
    count = len(asked[0])
    answers = np.empty(count), np.empty(count), np.zeros(count + 1, np.int64)
    positions = np.empty((1 << 20, 2))
    graph, works = search.engine()
    arrays: Any = search.blocks if graph is None else graph.arrays
    with works.lent() as work:
        at = n = 0
        while at < count:
            rest = search.place, asked, work.arrays, work.bounds
            at, n, status = many(
                search.arrays, arrays, *rest, (np.inf, 1.0, 1 << 62), (*answers, positions), at, n
            )
            if status == WORK_FULL:
                work.make_room()


def _us(call: Callable[[], object], given: Namespace) -> float:
    """Return the least microseconds of processor time a pair."""
    call()  # compiles
    least = float("inf")
    for _ in range(given.runs):
        begun = time.process_time()
        call()
        least = min(least, time.process_time() - begun)
    return least / float(given.pairs) * 1e6
