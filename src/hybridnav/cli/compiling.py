"""The first start: a second process compiles what a plan will need, and the user is told.

`python -m hybridnav.cli.compiling` compiles what the first plans need, in all processors.
"""

from __future__ import annotations

import contextlib
import logging
import os
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import hybridnav as hn
from hybridnav.cli.common import complain, stage
from hybridnav.config import load_preset
from hybridnav.errors import CacheWarning

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from hybridnav.config import Preset

_LOG = logging.getLogger("hybridnav.kernels")
_PATIENCE_S = 2.0
"""Seconds of compiling after which the user is told what takes so long."""
_PACKAGES = Path(__file__).parents[2]
_FIRST = "compiling kernels, which a new installation does once; the next start is quick"


class _Teller(logging.Handler):
    """Tells the user, once, that it is the compiler that takes so long."""

    def __init__(self) -> None:
        super().__init__()
        self._spent_s = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Add the seconds that a kernel took."""
        before, seconds = self._spent_s, record.__dict__.get("seconds", 0.0)
        self._spent_s += seconds
        if before < _PATIENCE_S <= self._spent_s:
            complain(_FIRST)


@contextmanager
def told_of_compiling() -> Iterator[None]:
    """Tell the user when kernels are compiled for seconds."""
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

    Parameters
    ----------
    preset
        The preset that will plan.

    Yields
    ------
    Callable
        Waits until it is compiled.
    """
    job = preset.planner.coarse
    if job not in _SEARCHES or _processors() == 1 or not _is_cold(job):
        yield lambda: None
        return
    process = _start(job)
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


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _is_cold(job: str) -> bool:
    """Whether neither the pyramid nor a search was compiled yet and what is compiled is kept."""
    from hybridnav.pyramid._kernels import select_stars  # noqa: PLC0415 - loads numba

    if _is_kept(select_stars):
        return False
    from hybridnav.jumps._query_kernels import paths  # noqa: PLC0415
    from hybridnav.mesh._query_kernels import query  # noqa: PLC0415
    from hybridnav.search._kernels import astar  # noqa: PLC0415

    return not _is_kept({"mesh": query, "jumps": paths}.get(job, astar))


def _is_kept(kernel: Any) -> bool:
    """Whether a kernel need not be compiled, or is compiled anew at every start."""
    stats = getattr(kernel, "stats", None)
    if stats is None or stats.cache_path is None:
        return True
    source = Path(kernel.py_func.__code__.co_filename)
    begun = f"{source.stem}.{kernel.__name__}-*.nbi"
    try:
        changed = source.stat().st_mtime
        return any(index.stat().st_mtime >= changed for index in Path(stats.cache_path).glob(begun))
    except OSError:
        return True


def _start(*jobs: str) -> subprocess.Popen[bytes] | None:
    """Start a process that compiles; it ends with this one, whose end of the pipe is closed."""
    quiet = ("-W", f"ignore:{CacheWarning.opening}")
    paths = [str(_PACKAGES), os.environ.get("PYTHONPATH", "")]
    with contextlib.suppress(OSError):
        return subprocess.Popen(  # noqa: S603 - this interpreter and a module of our own
            [sys.executable, "-P", *quiet, "-m", "hybridnav.cli.compiling", *jobs],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # an interrupt from the keyboard is for this process
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
        )
    return None


# --- what is compiled ---------------------------------------------------------------------------

_SEARCHES = {"mesh": "shortest", "jumps": "octile", "none": "grid-astar", "max-distance": "paper"}
"""A preset for each kind of search that can be compiled without a pyramid."""
_PLANS = ("shortest", "grid-astar", "octile", "paper")
"""Presets whose whole plans set-up compiles, what their searches have in common first."""
_ENDS = ((2, 2), (60, 60))


def small_grid() -> hn.OccupancyGrid:
    """Return a map that needs what buildings need: rooms, doors, posts, unexplored cells."""
    side, room = 64, 16
    probability = np.zeros((side, side), np.float32)
    probability[::room] = probability[:, ::room] = 1.0
    for door in range(room // 2, side, room):
        probability[room::room, door - 1 : door + 2] = 0.0
        probability[door - 1 : door + 2, room::room] = 0.0
    probability[20:23, 20:23] = 1.0
    probability[11::room, 11::room] = 0.5  # a place round each of these has a self-loop
    return hn.OccupancyGrid(probability, frame=hn.Frame(resolution_m=0.5), robot_radius_m=0.25)


def compile_search(coarse: str) -> None:
    """Compile a kind of search, by a search of a small map."""
    from hybridnav.jumps import JumpSearch, build_jump_graph, contract_graph  # noqa: PLC0415
    from hybridnav.planner.cell_plans import WholeMap  # noqa: PLC0415 - loads numba
    from hybridnav.planner.mesh_plans import OverMesh  # noqa: PLC0415
    from hybridnav.refine import GridRefiner  # noqa: PLC0415

    grid, settings = small_grid(), load_preset(_SEARCHES[coarse]).planner
    refiner = GridRefiner(grid)
    if coarse == "mesh":
        OverMesh(grid, refiner, settings).plan(*_ENDS)
    elif coarse == "jumps":
        graph = build_jump_graph(grid.enterable())
        JumpSearch(contract_graph(graph)).path(*_ENDS)  # as on maps of buildings
    else:
        WholeMap(refiner).plan(*_ENDS)


def compile_plan(preset: str) -> None:
    """Compile all that a plan needs, by one on a small map; of no preset the pyramid alone."""
    grid = small_grid()
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
    if preset in _PLANS:
        ends = grid.frame.points_of(np.array(_ENDS))
        hn.HybridPlanner(topology, preset=preset).plan(*ends).to_dict()


def _end_with_parent() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


def compile_all() -> None:
    """Compile what the first plans need, a process for each processor, with a bar on stderr."""
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
                while waiting and len(running) < _processors():
                    running.append(_start(waiting.pop(0)))
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
        compile_search(job) if job in _SEARCHES else compile_plan(job)


if __name__ == "__main__":
    main(sys.argv[1:])
