"""The first start: a second process compiles the kernels of a plan, and the user is informed."""

from __future__ import annotations

import contextlib
import logging
import os
import subprocess
import sys
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hybridnav.cli.common import complain, stage
from hybridnav.errors import CacheWarning

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from hybridnav.planner import Preset

_LOG = logging.getLogger("hybridnav.kernels")
_PATIENCE_S = 2.0
"""Seconds of compiling after which a line informs the user."""
SEARCHES = ("shortest", "octile", "grid-astar", "paper")
"""Methods whose search can be compiled without a pyramid."""
_PACKAGES = Path(__file__).parents[2]
_FIRST = "compiling kernels, each once, when a command first needs it; the next start is quick"


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
            complain(_FIRST)


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

    Parameters
    ----------
    preset
        The preset that will plan.

    Yields
    ------
    Callable
        Waits until it is compiled.
    """
    job = preset.planner.underlying.method
    if job not in SEARCHES or processors() == 1 or not _is_cold(job):
        yield lambda: None
        return
    process = start(job)
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


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _is_cold(job: str) -> bool:
    """Return whether neither the pyramid nor a search was compiled yet, and numba keeps what it
    compiles."""
    from hybridnav.pyramid import decimation  # noqa: PLC0415 - loads numba

    if _is_kept(decimation.KERNEL):
        return False
    home = {"mesh": "search.mesh.search", "jumps": "search.octile.search"}.get(
        job, "search.grid_search"
    )
    return not _is_kept(import_module(f"hybridnav.{home}").KERNEL)


def _is_kept(kernel: Any) -> bool:
    """Return whether a kernel needs no compilation, or is compiled anew at every start."""
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


def start(*jobs: str) -> subprocess.Popen[bytes] | None:
    """Start a process that compiles; it ends with this one, whose end of the pipe is closed."""
    quiet = ("-W", f"ignore:{CacheWarning.opening}")
    paths = [str(_PACKAGES), os.environ.get("PYTHONPATH", "")]
    with contextlib.suppress(OSError):
        return subprocess.Popen(  # noqa: S603 - this interpreter and a module of our own
            [sys.executable, "-P", *quiet, "-m", "hybridnav.cli.warm", *jobs],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # an interrupt from the keyboard is for this process
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
        )
    return None
