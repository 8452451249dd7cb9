"""Compile the kernels of first plans: `python -m hybridnav.cli.warm`, on all processors."""

from __future__ import annotations

import os
import sys
import threading
import time
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from hybridnav.cli.compiling import SEARCHES, processors, start

if TYPE_CHECKING:
    import subprocess

_PLANS = ("shortest", "grid-astar", "octile", "paper", "robot")
"""Presets whose whole plans set-up compiles, what their searches have in common first."""
_ENDPOINTS = ((2, 2), (60, 60))
_LARGE = 160
"""Rows of a map on which the overlay has all that those of buildings have."""
_CHANGED = (1.0, 1.0, 2.0, 2.0)


def small_grid(size: int = 64) -> hn.OccupancyGrid:
    """Return a map with the parts of buildings: rooms, doors, posts, unexplored cells."""
    room = 16
    probability = np.zeros((size, size), np.float32)
    probability[::room] = probability[:, ::room] = 1.0
    for door in range(room // 2, size, room):
        probability[room::room, door - 1 : door + 2] = 0.0
        probability[door - 1 : door + 2, room::room] = 0.0
    probability[20:23, 20:23] = 1.0
    probability[11::room, 11::room] = 0.5  # a place round each of these has a self-loop
    return hn.OccupancyGrid(probability, frame=hn.Frame(resolution_m=0.5), robot_radius_m=0.25)


def compile_search(method: str) -> None:
    """Compile the search of a method, by a search of a small map."""
    from hybridnav.planner import planner_settings  # noqa: PLC0415 - loads pydantic
    from hybridnav.planner.methods import make_method  # noqa: PLC0415 - loads numba
    from hybridnav.planner.methods.grid import KnownMap  # noqa: PLC0415
    from hybridnav.search.found import Query  # noqa: PLC0415
    from hybridnav.search.octile import JumpSearch, build_jump_graph, contract_graph  # noqa: PLC0415

    grid = small_grid()
    if method == "octile":
        graph = build_jump_graph(grid.enterable())
        JumpSearch(contract_graph(graph)).path(*_ENDPOINTS)  # as on maps of buildings
        return
    # On the cells alone, as `paper` searches inside its corridor.
    settings = planner_settings("grid-astar" if method == "paper" else method)
    start, goal = grid.frame.points_of(np.array(_ENDPOINTS))
    found = make_method(KnownMap(grid, None), settings).find(Query(_ENDPOINTS, (start, goal)))
    _ = found.cells


def compile_plan(preset: str) -> None:
    """Compile all kernels of a plan, by one on a small map; without a preset those of the pyramid
    alone."""
    grid = small_grid(_LARGE if preset == "robot" else 64)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
    if preset in _PLANS:
        endpoints = grid.frame.points_of(np.array(_ENDPOINTS))
        planner = hn.HybridPlanner(topology, preset=preset)
        planner.plan(*endpoints).to_dict()
        if preset == "robot":  # whose first plans need no overlay
            planner.prepare()
            path = planner.plan(*endpoints, smooth="line-of-sight").path
            assert path is not None  # noqa: S101 - the rooms have doors
            planner.plan(*endpoints, blocked={"cells": path.cells[len(path.cells) // 2][None]})
            planner.update(costs=hn.CostLayer(np.full(grid.shape, 9.0)), changed=_CHANGED)


def _end_with_parent() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


def compile_all() -> None:
    """Compile the kernels of the first plans, a process for each processor, with a bar on
    stderr."""
    from rich.console import Console  # noqa: PLC0415 - on demand
    from rich.progress import Progress  # noqa: PLC0415

    # What all plans share first: processes that compile the same do it twice.
    waves = (("mesh", "pyramid", "jumps", "none"), _PLANS)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("compiling kernels", total=sum(map(len, waves)))
        for wave in waves:
            waiting = list(wave)
            running: list[subprocess.Popen[bytes] | None] = []
            while waiting or running:
                while waiting and len(running) < processors():
                    running.append(start(waiting.pop(0)))
                for process in running.copy():
                    if process is None or process.poll() is not None:
                        running.remove(process)
                        progress.advance(bar)
                time.sleep(0.1)


def main(jobs: list[str]) -> None:
    """Compile jobs, kinds of search or presets, or everything."""
    if not jobs:
        compile_all()
        return
    threading.Thread(target=_end_with_parent, daemon=True).start()
    for job in jobs:
        compile_search(job) if job in SEARCHES else compile_plan(job)


if __name__ == "__main__":
    main(sys.argv[1:])
