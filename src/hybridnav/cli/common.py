"""Shared parts of commands: exit codes, errors of a command line, and talking to the user."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from pathlib import Path
from threading import Timer
from typing import Any

import hybridnav as hn
from hybridnav._base.clock import clock
from hybridnav._base.files import check_replaceable, printable, replace_file, without_controls
from hybridnav._base.progress import Progress, no_progress
from hybridnav.errors import HybridNavError, MapError, PresetError

EXIT_SOLVED = 0
EXIT_NOT_SOLVED = 1
EXIT_USAGE = 2
EXIT_UNREADABLE = 3


class UsageError(HybridNavError):
    """The command line itself asks for something impossible."""


def exit_code(error: HybridNavError) -> int:
    """Return the exit code of a command that ended in this error."""
    return EXIT_UNREADABLE if isinstance(error, (MapError, PresetError)) else EXIT_USAGE


# What a command writes, and checks of where it writes.


_SMOOTH = ("none", "line-of-sight", "arcs")
_PICTURES = (".pdf", ".png", ".svg")
_PATIENCE_S = 10.0
"""Seconds of a stage, as of compiling, after which a bar shows that it goes on."""


def complain(message: str) -> None:
    """Print one line on stderr."""
    sys.stderr.write(without_controls(f"hybridnav: {' '.join(message.split())}\n"))


def answer(text: str) -> None:
    """Print a result on stdout; a reader that has left, as `head` does, is no error."""
    if isinstance(sys.stdout, io.TextIOWrapper):  # file names may hold what no encoding can
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        sys.stdout.write(without_controls(text))
        sys.stdout.flush()
    except OSError as error:
        # What is still buffered goes nowhere: at exit Python would try, and complain, again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            raise UsageError(f"cannot write the result: {error.strerror}") from None


@contextmanager
def stage(text: str, seconds: dict[str, float], key: str) -> Iterator[None]:
    """Time a stage, with a spinner, then a bar on stderr if that is a terminal."""
    began = clock()
    with _spinner(text) if sys.stderr.isatty() else nullcontext():
        yield
    seconds[key] = round(clock() - began, 6)


@contextmanager
def progress_bar(text: str) -> Iterator[Progress]:
    """Draw a bar on stderr where that is a terminal.

    Returns what to call with the number of steps done and of all.
    """
    if not sys.stderr.isatty():
        yield no_progress
        return
    from rich.console import Console  # noqa: PLC0415 - on demand
    from rich.progress import (  # noqa: PLC0415
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    parts = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()
    with Progress(TextColumn("{task.description}"), *parts, console=Console(stderr=True)) as bar:
        task = bar.add_task(text, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def _spinner(text: str) -> Iterator[None]:
    """Draw a spinner on stderr, and after some seconds a bar with the time that went by."""
    from rich.console import Console  # noqa: PLC0415 - on demand
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn  # noqa: PLC0415

    parts = SpinnerColumn(), TextColumn("{task.description}", markup=False)
    with Progress(*parts, console=Console(stderr=True), transient=True) as shown:
        shown.add_task(text, total=None)
        bar = (*parts, BarColumn(), TimeElapsedColumn())
        later = Timer(_PATIENCE_S, setattr, (shown, "columns", bar))
        later.daemon = True
        later.start()
        try:
            yield
        finally:
            later.cancel()


def check_picture(path: Path | None) -> None:
    """Refuse a picture that could not be saved, before anything is computed for it."""
    check_output(path, "--plot", _PICTURES)


def check_output(path: Path | None, option: str, endings: Sequence[str]) -> None:
    """Refuse a file that could not be written, or ends in something else; None is no file."""
    if path is None:
        return
    if path.suffix.lower() not in endings:
        raise UsageError(f"{option} must end in {', '.join(endings)}, got '{printable(path)}'")
    try:
        in_folder, is_folder = path.parent.is_dir(), path.is_dir()
    except OSError as error:  # a name that is too long
        raise UsageError(f"{option} '{printable(path)}': {error.strerror}") from None
    if not in_folder:
        raise UsageError(f"{option}: there is no folder '{printable(path.parent)}'")
    if is_folder:
        raise UsageError(f"{option} must name a file, '{printable(path)}' is a folder")
    check_writable(path, option)


def check_new(path: Path, option: str) -> None:
    """Refuse a file or folder that exists, or whose folder does not."""
    try:
        is_taken, in_folder = path.exists(), path.parent.is_dir()
    except OSError as error:  # a name that is too long
        raise UsageError(f"{option} '{printable(path)}': {error.strerror}") from None
    if is_taken:
        raise UsageError(f"{option}: '{printable(path)}' exists, expected a new name")
    if not in_folder:
        raise UsageError(f"{option}: there is no folder '{printable(path.parent)}'")


def check_writable(path: Path, option: str) -> None:
    """Refuse a file that could not be written, by trying; nothing is left, nothing changed."""
    try:
        check_replaceable(path)
    except OSError as error:
        raise UsageError(f"{option}: cannot write '{printable(path)}': {error.strerror}") from None


def write_out(path: Path, text: str) -> None:
    """Write the file that `--out` names."""
    try:
        replace_file(path, text.encode())
    except OSError as error:
        raise UsageError(f"--out: cannot write '{printable(path)}': {error.strerror}") from None


def extent_line(grid: hn.OccupancyGrid) -> str:
    """Return the summary's line on the extent of a map."""
    from hybridnav.maps.occupancy import extent  # noqa: PLC0415 - loads numpy

    return f"extent     {extent(grid)}"


def islands_line(grid: hn.OccupancyGrid) -> list[str]:
    """Return the summary's line on islands, an empty text unless the user drops them."""
    dropped = grid.dropped
    if dropped is None:
        return []
    free = f"{dropped.free:,} free ({dropped.free_cells:,} cells)"
    unexplored = f"{dropped.unexplored:,} unexplored ({dropped.unexplored_cells:,} cells)"
    return [f"islands    below {grid.least_island_m2:g} m² dropped: {free}, {unexplored}"]


def islands_figures(grid: hn.OccupancyGrid) -> dict[str, Any]:
    """Return the figures on islands for JSON: null unless the user drops them."""
    if grid.dropped is None:
        return {"dropped_islands": None}
    return {"dropped_islands": {"least_area_m2": grid.least_island_m2, **asdict(grid.dropped)}}


def timings(seconds: dict[str, float]) -> str:
    """Return the seconds per stage on one line, and their sum."""
    stages = ", ".join(f"{stage} {s:.3f}" for stage, s in seconds.items())
    return f"{sum(seconds.values()):.3f}: {stages}"
