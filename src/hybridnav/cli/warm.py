"""Compile the kernels of first plans: `python -m hybridnav.cli.warm`, on all processors.

A command starts it beside itself, as a second process, and the user is informed.
"""

from __future__ import annotations

import contextlib
import logging
import os
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hybridnav as hn
from hybridnav._base.threads import cores, start_module
from hybridnav.cli.common import complain, stage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from hybridnav.planning import Preset

# The first start: a second process compiles, and the user is informed.

_LOG = logging.getLogger("hybridnav.kernels")
_PATIENCE_S = 2.0
"""Seconds of compiling after which a line informs the user."""
SEARCHES = ("shortest", "octile", "grid-astar", "paper")
"""Methods whose search can be compiled without a pyramid."""
SEARCH = "search-"
"""Beginning of the job of a search: a preset of the method's name is a job of its own."""
_FIRST = (
    "compiling kernels that this command needs, up to two minutes, once; others need others "
    "(all beforehand: python -m hybridnav.cli.warm)"
)
_NOT_MINE = " (those of this package are for another version of numba)"


class _Teller(logging.Handler):
    """A handler that reports once that the compiler takes long.

    Not where nothing can be kept: `CacheWarning` states that every start takes as long there.
    """

    def __init__(self) -> None:
        super().__init__()
        self._spent_s = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Add the seconds that a kernel took."""
        before, seconds = self._spent_s, record.__dict__.get("seconds", 0.0)
        self._spent_s += seconds if record.__dict__.get("is_kept") else 0.0
        if before < _PATIENCE_S <= self._spent_s:
            from hybridnav._base.shipped import is_for_another_numba  # noqa: PLC0415 - loads numba

            complain(_FIRST + _NOT_MINE * is_for_another_numba())


@contextmanager
def notice_of_compiling() -> Iterator[None]:
    """Inform the user when kernels are compiled for seconds."""
    teller, level = _Teller(), _LOG.level
    _LOG.addHandler(teller)
    _LOG.setLevel(logging.INFO)
    try:
        yield
    finally:
        _LOG.removeHandler(teller)
        _LOG.setLevel(level)


@contextmanager
def compiling_beside(preset: Preset) -> Iterator[Callable[[], None]]:
    """Compile the search of a preset in a second process while this one builds a pyramid.

    Only where neither was compiled before, there is a folder to keep it in, and a processor is
    free; else nothing happens.

    `preset`: the preset that will plan. The result waits until it is compiled.
    """
    job = preset.planner.underlying.method
    if job not in SEARCHES or cores() == 1 or not _is_cold(job):
        yield lambda: None
        return
    process = start(SEARCH + job)
    try:
        yield lambda: _wait_for(process)
    finally:
        if process is not None:
            process.kill()
            process.communicate()


def _wait_for(process: subprocess.Popen[bytes] | None) -> None:
    if process is not None:
        with stage("compiling the search", {}, "compile"):
            process.wait()


def _is_cold(job: str) -> bool:
    """Return whether neither the pyramid nor a search was compiled yet, and numba keeps what it
    compiles."""
    from hybridnav.pyramid import decimation  # noqa: PLC0415 - loads numba

    if _is_kept(decimation.KERNEL):
        return False
    home = {"shortest": "search.mesh.search", "octile": "search.octile.jumps"}.get(
        job, "search.grid_search"
    )
    return not _is_kept(import_module(f"hybridnav.{home}").KERNEL)


def _is_kept(kernel: Any) -> bool:
    """Return whether a kernel needs no compilation, or is compiled anew at every start."""
    return not hasattr(kernel, "is_warm") or kernel.is_warm()


def start(*jobs: str) -> subprocess.Popen[bytes] | None:
    """Start a process that compiles; it ends with this one, whose end of the pipe is closed."""
    pipes = {"stdin": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with contextlib.suppress(OSError):
        return start_module("hybridnav.cli.warm", *jobs, **pipes)
    return None


# What a model is prepared for: the first plan on it compiles nothing.


def rehearse(file: Path, presets: Iterable[Preset]) -> None:
    """Plan on a model that was written as `hybridnav plan` will: by each preset, and in words where
    it has rooms.

    Arrays of a file are of other types than those that were written, so kernels are compiled anew.
    """
    import numpy as np  # noqa: PLC0415 - help does without

    model = hn.load(file)
    free = np.argwhere(model.grid.enterable())
    if not len(free):
        return
    pairs = model.grid.frame.points_of(free[np.random.default_rng(0).integers(len(free), size=40)])
    for preset in presets:
        if preset.planner.method == "ompl":  # its process takes its time at every start
            continue
        planner = model.planner(preset, topology=model.grown(preset.pyramid, model.rooms))
        for start, goal in zip(pairs[::2], pairs[1::2], strict=True):
            result = planner.plan(start, goal)
            if result.solved:
                result.to_dict()
                if model.rooms is not None and model.rooms.names:
                    hn.plan_tour(planner, [start, model.rooms.names[0]]).words()
                break


# What is compiled.

PRESETS = ("shortest", "grid-astar", "octile", "paper", "robot")
"""Presets whose whole plans set-up compiles, what their searches have in common first."""
ROOMS = "rooms"
"""The job of what finds rooms."""
MODEL, HARNESS = "model", "harness"
"""The jobs of what builds a model and plans on it, and of what evaluates."""
_ENDPOINTS = ((2, 2), (60, 60))
_CHANGED = (1.0, 1.0, 2.0, 2.0)


def small_grid(size: int = 64) -> hn.OccupancyGrid:
    """Return a map with the parts of buildings: rooms, doors, posts, unexplored cells."""
    import numpy as np  # noqa: PLC0415 - help does without

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
    import numpy as np  # noqa: PLC0415

    from hybridnav.planning import planner_settings  # noqa: PLC0415 - loads pydantic
    from hybridnav.planning.methods import make_method  # noqa: PLC0415 - loads numba
    from hybridnav.planning.methods.grid import KnownMap  # noqa: PLC0415
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
    outcome = make_method(KnownMap(grid, None), settings).find(Query(_ENDPOINTS, (start, goal)))
    _ = outcome.cells


def compile_plan(preset: str) -> None:
    """Compile all kernels of a plan, by one on a small map; without one of `PRESETS` those of the
    pyramid alone."""
    import numpy as np  # noqa: PLC0415

    grid = small_grid()
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
    if preset in PRESETS:
        endpoints = grid.frame.points_of(np.array(_ENDPOINTS))
        planner = hn.HybridPlanner(topology, preset=preset)
        planner.plan(*endpoints).to_dict()
        line = [(8.5, 0.0), (8.5, 32.0)]  # across the map: with it, and against it
        for ends in (endpoints, endpoints[::-1]):
            planner.plan(*ends, one_way={"lines": [line]})
        if preset == "paper":
            _ = topology.level.through_m  # chooses among arcs that join the same two places
            # Fields below the places, which this map has none of by default.
            fine = hn.load_preset("paper", overrides=["planner.field_cells=4"])
            hn.HybridPlanner(topology, preset=fine).plan(*endpoints)
        if preset == "robot":
            path = planner.plan(*endpoints, smooth="line-of-sight").path
            assert path is not None  # noqa: S101 - the rooms have doors
            planner.plan(*endpoints, blocked={"cells": path.cells[len(path.cells) // 2][None]})
            planner.update(costs=hn.CostLayer(np.full(grid.shape, 9.0)), changed=_CHANGED)


def compile_rooms() -> None:
    """Compile what finds rooms, on cells small enough that it cuts along walls and merges."""
    from hybridnav.rooms.find import divide_rooms  # noqa: PLC0415 - loads scipy

    grid = replace(small_grid(), frame=hn.Frame(resolution_m=0.25))
    labels = hn.find_rooms(grid)
    divide_rooms(labels.label_of, {0: (0, 0)})
    rooms = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)).rooms
    assert rooms is not None  # noqa: S101 - they are given
    _ = rooms.listed_doors, rooms.point_of(rooms.names[0])


def compile_model() -> None:
    """Compile what builds a model with rooms, and what plans on it."""
    from hybridnav.planning import load_preset  # noqa: PLC0415 - loads pydantic

    grid = replace(small_grid(), frame=hn.Frame(resolution_m=0.25))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid)))
    presets = [load_preset(name) for name in ("shortest", "robot")]
    planners = [hn.HybridPlanner(topology, preset=preset) for preset in presets]
    for planner in planners:
        planner.prepare()
    with tempfile.TemporaryDirectory() as folder:
        hn.save(planners, Path(folder) / "small.hnm")
        rehearse(Path(folder) / "small.hnm", presets)


def compile_harness() -> None:
    """Compile what evaluates presets and the package's own baselines, and judges paths."""
    from hybridnav.harness import RunSettings, write_records  # noqa: PLC0415 - on demand
    from hybridnav.harness.names import BASELINES  # noqa: PLC0415

    own = (name for name, (path, _) in BASELINES.items() if path.startswith("hybridnav."))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "small.map"
        file.write_text("type octile\nheight 3\nwidth 5\nmap\n.....\n.@.@.\n...@.\n")
        settings = RunSettings(maps=(str(file),), presets=("paper",), baselines=tuple(own), pairs=9)
        write_records(settings, Path(folder) / "run")
    hn.judge(small_grid(), [(1.0, 1.0), (4.0, 9.0)])


def _end_with_parent() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


def compile_all() -> None:
    """Compile the kernels of the first plans, a process for each processor, with a bar on
    stderr."""
    from rich.console import Console  # noqa: PLC0415 - on demand
    from rich.progress import Progress  # noqa: PLC0415

    # What all plans share first: processes that compile the same do it twice.
    first = [SEARCH + "shortest", "pyramid", SEARCH + "octile", SEARCH + "grid-astar"]
    waves = first, (*PRESETS, ROOMS), (MODEL, HARNESS)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("compiling kernels", total=sum(map(len, waves)))
        for wave in waves:
            waiting = list(wave)
            running: list[subprocess.Popen[bytes] | None] = []
            while waiting or running:
                while waiting and len(running) < cores():
                    running.append(start(waiting.pop(0)))
                for process in running.copy():
                    if process is None or process.poll() is not None:
                        running.remove(process)
                        progress.advance(bar)
                time.sleep(0.1)


def compile_job(job: str) -> None:
    """Compile what a search, a preset, the pyramid, rooms, a model or the harness need."""
    others = {ROOMS: compile_rooms, MODEL: compile_model, HARNESS: compile_harness}
    if job in others:
        others[job]()
    elif job.startswith(SEARCH):
        compile_search(job.removeprefix(SEARCH))
    else:
        compile_plan(job)


def main(jobs: list[str]) -> None:
    """Compile jobs, or everything."""
    if not jobs:
        compile_all()
        return
    threading.Thread(target=_end_with_parent, daemon=True).start()
    for job in jobs:
        compile_job(job)


if __name__ == "__main__":
    main(sys.argv[1:])
