"""Hub labels: memory, preparation, and the time of a distance, against the search without them.

Ends are those of pairs that a path joins. Lengths are compared with those of the search without
labels: the exit code is 1 if one differs by more than 1e-9 cells. Times are of the processor, the
least of some runs, of kernels alone.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from benchmarks.common import NEEDED_DATA, OFFICE, option, print_head, print_load, print_row, read
from benchmarks.subjects._study_maps import RAW_MAPS, ROS_MAPS
from hybridnav._base.moves import length_in_cells
from hybridnav.search.mesh import MeshSearch, build_mesh, shortest_paths
from hybridnav.search.mesh.kernels.hubs import query_hubs
from hybridnav.search.mesh.kernels.polyanya import WORK_FULL
from hybridnav.search.mesh.kernels.queries import many
from hybridnav.search.mesh.search import rounded_into
from hybridnav.search.octile import JumpSearch, build_jump_graph, contract_graph
from hybridnav.search.octile.kernels.hubs import hub_cost

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable

_SAME = 1e-9
COLUMNS = ("map", "metric", "corners", "entries", "side", "MB", "us a cell", "distance, us")
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
    print_head(*COLUMNS, "path, us", "without labels, us", "most off, cells")
    maps = [OFFICE, *(given.data / name for name in (*ROS_MAPS, *RAW_MAPS))]
    maps += sorted((given.data / "movingai" / "cities").glob("*.map"))
    MeshSearch(build_mesh(np.ones((2, 2), np.bool_))).label(1.0)  # compiles
    fit = [path for path in maps if given.only in str(path)]
    JumpSearch(build_jump_graph(np.ones((2, 2), np.bool_))).label(np.ones((2, 2), np.bool_), 1.0)
    return int(max(max(_measure(path, given), _octile(path, given)) for path in fit) > _SAME)


@numba.njit
def _costs(arrays: Any, ends: Any, work: Any, costs: Any) -> None:
    for k in range(len(ends)):
        costs[k] = hub_cost(arrays[0], arrays[1], arrays[2], (ends[k, 0], ends[k, 1]), work)


def _octile(path: Any, given: Namespace) -> float:
    """Print the row of octile distances; return the greatest difference of two lengths."""
    free = np.ascontiguousarray(read(path).enterable(allow_unexplored=False))
    search = JumpSearch(contract_graph(build_jump_graph(free)))
    graph = search.graph
    cells = np.random.default_rng(0).choice(np.argwhere(free), (2, given.pairs))
    lengths = search.many(*cells).length_cells
    cells, lengths = cells[:, np.isfinite(lengths)], lengths[np.isfinite(lengths)]
    ends = np.stack((cells - np.array(graph.origin)) @ np.array([graph.shape[1], 1]), axis=1)
    begun = time.process_time()
    is_made = search.label(free, given.mb)
    per_cell = f"{(time.process_time() - begun) / free.sum() * 1e6:.1f}"
    row = [f"{path.parent.name}/{path.stem}", "octile", str(graph.n_corners)]
    asked = np.concatenate(tuple(cells), axis=1)
    before = f"{_us(lambda: search._paths(asked), given, len(ends)):.1f}"  # noqa: SLF001
    if not is_made or search.labels is None:
        print_row(*row, "", "", f"> {given.mb:g}", per_cell, "", "", before, "")
        return 0.0
    labels, costs = search.labels, np.empty(len(ends), np.int64)
    arrays: Any = search.arrays[0], (graph.places, graph.component, labels.ranges), labels.arrays
    work = labels.room(graph.n_corners)
    distance = f"{_us(lambda: _costs(arrays, ends, work, costs), given, len(ends)):.1f}"
    off = np.abs(length_in_cells(costs) - lengths).max(initial=0.0)
    row += [f"{len(labels.entries) / max(1, graph.n_corners):.0f}", "4"]
    row += [f"{labels.n_bytes / 1e6:.0f}", per_cell, distance, "", before, f"{off:.0e}"]
    print_row(*row)
    return float(off)


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
    lengths = shortest_paths(plain, tuple(cells), tuple(ends)).length_cells
    joined = np.isfinite(lengths)
    cells, ends, lengths = cells[:, joined], ends[:, joined], lengths[joined]
    asked = (
        np.concatenate(tuple(cells), axis=1),
        np.ascontiguousarray(np.concatenate(tuple(ends), axis=1)[:, [1, 0, 3, 2]]),
    )
    row = [f"{path.parent.name}/{path.stem}", "any-angle", str(int(mesh.is_convex.sum()))]
    before = f"{_us(lambda: _paths(plain, asked), given, len(lengths)):.1f}"
    if not is_made:
        print_row(
            *row, "", "", f"> {given.mb:g}", f"{seconds / free.sum() * 1e6:.1f}", "", "", before, ""
        )
        return 0.0
    labels: Any
    labels, works = search.engine()
    with works.lent() as room:
        room.make_room()
        place = mesh.component, mesh.polygon_at
        rest = labels.arrays, place, asked, room.arrays
        length_us = _us(lambda: _lengths(search.arrays, *rest), given, len(lengths))
    path_us = _us(lambda: _paths(search, asked), given, len(lengths))
    found = shortest_paths(search, tuple(cells), tuple(ends)).length_cells
    off = np.abs(found - lengths).max(initial=0.0)
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


def _us(call: Callable[[], object], given: Namespace, count: int) -> float:
    """Return the least microseconds of processor time a pair."""
    call()  # compiles
    least = float("inf")
    for _ in range(given.runs):
        begun = time.process_time()
        call()
        least = min(least, time.process_time() - begun)
    return least / count * 1e6
