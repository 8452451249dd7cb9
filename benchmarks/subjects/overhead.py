"""What plans, distances, batches and tables cost beside their searches.

Least times of many repeats, for each pair of ends, which other programs on the machine change
little: of `planner.plan`, of the kernel inside it, and what `plan` and `distance` take beside it.
Then what a second core can bring: the CPU time of a batch of all pairs and of a table, over that of
the caller's thread plus half of the other threads'. And how many times more plans and distances,
one at a time, four threads get in a second than one: wall time, the best of repeats that alternate.
It counts on a quiet machine alone: on a busy one, more threads get a larger share of it.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.common import (
    DATA,
    OFFICE,
    SEED,
    largest_part,
    maps_of,
    option,
    prepared,
    print_head,
    print_load,
    print_row,
    read,
)
from hybridnav.search.mesh import search as mesh_search
from hybridnav.search.octile.kernels import queries as octile_kernels

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable

    import hybridnav as hn

KERNELS = {"shortest": (mesh_search, "answer"), "octile": (octile_kernels, "paths")}
COLUMNS = (
    "map",
    "preset",
    "plan, us",
    "kernel",
    "plan beside",
    "distance beside",
    "batch",
    "table",
    "threads: plan",
    "distance",
)
OPTIONS = (
    DATA,
    option("--map", action="append", default=[], metavar="GLOB"),
    option("--pairs", type=int, default=200),
    option("--repeats", type=int, default=9),
    SEED,
)


class _Timed:
    """A kernel that counts its seconds."""

    def __init__(self, kernel: Callable[..., Any]) -> None:
        self._kernel, self.seconds = kernel, 0.0

    def __call__(self, *arguments: Any) -> Any:
        """Call the kernel."""
        began = time.perf_counter()
        found = self._kernel(*arguments)
        self.seconds += time.perf_counter() - began
        return found


def least(ask: Callable[..., Any], kernel: _Timed, ends: Any, repeats: int) -> Any:
    """Return the least seconds of each query, beside its kernel and of that, float64 (2, n)."""
    found = np.full((2, len(ends)), np.inf)
    for _ in range(repeats):
        for at, pair in enumerate(ends):
            kernel.seconds = 0.0
            began = time.perf_counter()
            ask(*pair)
            whole = time.perf_counter() - began
            found[:, at] = np.minimum(found[:, at], (whole - kernel.seconds, kernel.seconds))
    return found


def two_cores(ask: Callable[[], Any], repeats: int) -> float:
    """Return how many times faster two cores can be than one, by CPU times."""
    best = (np.inf, 0.0)
    for _ in range(repeats):
        whole, own = time.process_time(), time.thread_time()
        ask()
        whole, own = time.process_time() - whole, time.thread_time() - own
        best = min(best, (whole, 2 * whole / (whole + own)))
    return best[1]


def four_threads(ask: Callable[..., Any], ends: Any, repeats: int) -> float:
    """Return how many times more queries four threads get answered than one, by wall time."""
    seconds = {1: np.inf, 4: np.inf}

    def share(number: int, count: int) -> None:
        for pair in ends[number::count]:
            ask(*pair)

    for count in [1, 4] * repeats:
        with ThreadPoolExecutor(count) as pool:
            list(pool.map(share, range(count), [count] * count))  # starts the threads
            began = time.perf_counter()
            list(pool.map(share, range(count), [count] * count))
            seconds[count] = min(seconds[count], time.perf_counter() - began)
    return seconds[1] / seconds[4]


def measure(planner: hn.HybridPlanner, points: Any, repeats: int) -> list[str]:
    """Return the figures of one planner."""
    home, name = KERNELS[planner.preset.name]
    own = getattr(home, name)
    kernel, ends = _Timed(own), [tuple(map(tuple, pair)) for pair in points.tolist()]
    setattr(home, name, kernel)
    try:
        beside, inside = least(planner.plan, kernel, ends, repeats)
        alone, _ = least(planner.distance, kernel, ends, repeats)
    finally:
        setattr(home, name, own)
    starts, goals = points.repeat(10, axis=0).transpose(1, 0, 2)
    shares = [
        two_cores(lambda: planner.plan_many(starts, goals), repeats),
        two_cores(lambda: planner.distances(starts[::4], goals[::4]), repeats),
    ]
    asked = planner.plan, planner.distance
    shares += [four_threads(ask, ends * 5, repeats) for ask in asked]
    times = [np.median(one) * 1e6 for one in (beside + inside, inside, beside, alone)]
    return [f"{one:.1f}" for one in times] + [f"{one:.2f}" for one in shares]


def main(given: Namespace) -> None:
    """Print the table."""
    print_load()
    print_head(*COLUMNS)
    files = {"office": OFFICE}
    if given.data is not None and given.map:
        files |= {name: given.data / name for name in maps_of(given.data, given.map)}
    for name, file in files.items():
        grid = read(file)
        rng = np.random.default_rng(given.seed)
        picked = rng.choice(largest_part(grid.enterable()), (given.pairs, 2))
        for preset in KERNELS:
            planner = prepared(grid, preset)
            figures = measure(planner, grid.frame.points_of(picked), given.repeats)
            print_row(name, preset, *figures)
