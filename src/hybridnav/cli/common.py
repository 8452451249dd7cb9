"""Shared parts of commands: reading settings and maps, and talking to the user."""

from __future__ import annotations

import io
import os
import sys
import time
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import hybridnav as hn
from hybridnav._files import MODEL_SUFFIX, check_replaceable, printable, without_controls
from hybridnav._progress import no_progress
from hybridnav.cli.errors import UsageError
from hybridnav.grid import DEFAULT_MAX_CELLS, MAX_CELLS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from hybridnav._progress import Progress
    from hybridnav.cli.blocked import Closing
    from hybridnav.config import Preset

_SMOOTH = ("none", "line-of-sight", "arcs")
_PICTURES = (".pdf", ".png", ".svg")


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
    """Time a stage, with a spinner on stderr if that is a terminal."""
    began = time.perf_counter()
    with _spinner(text) if sys.stderr.isatty() else nullcontext():
        yield
    seconds[key] = round(time.perf_counter() - began, 6)


@contextmanager
def progress_bar(text: str) -> Iterator[Progress]:
    """Draw a bar on stderr where that is a terminal.

    Returns
    -------
    Iterator
        What to call with the number of steps done and of all.
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


def _spinner(text: str) -> AbstractContextManager[object]:
    from rich.console import Console  # noqa: PLC0415 - on demand
    from rich.text import Text  # noqa: PLC0415

    return Console(stderr=True).status(Text(text))


def read_preset(source: str) -> Preset:
    """Read a preset by name or file: an unknown name is wrong usage, a bad file unreadable
    input."""
    try:
        return hn.load_preset(source)
    except hn.PresetNotFoundError as error:
        from hybridnav.config.preset import is_preset_name  # noqa: PLC0415 - loads pydantic

        if is_preset_name(source):
            raise UsageError(str(error)) from None
        raise


def read_settings(
    preset: str | None,
    overrides: list[str] | None,
    radius_m: float | None,
    seed: int | None,
    *,
    smooth: str | None = None,
    map_file: Path | None = None,
) -> Preset:
    """Return a preset with the settings of the command line, which win over it, and over a model
    that holds the map's pyramid.

    An error in a preset file is the file's; one in an override is the caller's.
    """
    if map_file is not None and is_model_file(map_file):
        from hybridnav.io.models import open_model  # noqa: PLC0415

        load_numba()
        given = None if preset is None else read_preset(preset)
        plain = open_model(map_file, max_cells=MAX_CELLS).fitted(given)
    else:
        plain = read_preset("shortest" if preset is None else preset)
    return overridden(plain, overrides, radius_m, seed, smooth=smooth)


def overridden(
    plain: Preset,
    overrides: list[str] | None,
    radius_m: float | None,
    seed: int | None,
    *,
    smooth: str | None = None,
) -> Preset:
    """Return a preset with the settings of the command line."""
    settings = list(overrides or ())
    if radius_m is not None:
        settings.append(f"pyramid.robot_radius_m={radius_m!r}")
    if seed is not None:
        settings.append(f"pyramid.seed={seed}")
    if smooth is not None:
        if smooth not in _SMOOTH:
            raise UsageError(f"--smooth must be one of {', '.join(_SMOOTH)}, got {smooth!r:.80}")
        settings.append(f"planner.smooth={smooth}")
    try:
        return hn.load_preset(plain, overrides=settings)
    except hn.PresetError as error:
        raise UsageError(str(error)) from None


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


@dataclass(frozen=True)
class Reading:
    """How a command reads its map."""

    free_threshold: float | None = None
    occupied_threshold: float | None = None
    least_island_m2: float = 0.0
    max_cells: int = DEFAULT_MAX_CELLS


def load_numba() -> None:
    """Load numba without the linear algebra of scipy, for which it looks at its first kernel.

    That takes longer than the rest of that kernel, and none of ours multiplies matrices. Whoever
    does in this process still can: numba looks again when it compiles such a product.
    """
    blas = "scipy.linalg.cython_blas"
    if blas in sys.modules:
        return
    sys.modules[blas] = None  # type: ignore[assignment]
    try:
        import numba.np.arraymath  # noqa: F401, PLC0415 - it looks
    finally:
        del sys.modules[blas]


def load_model(path: Path, preset: Preset, seconds: dict[str, float], reading: Reading) -> hn.Model:
    """Load a model or a map, inflated as a preset states, without the islands that the user
    drops."""
    with stage(f"reading {path}", seconds, "load"):
        load_numba()
        model = hn.load(
            path,
            robot_radius_m=preset.pyramid.robot_radius_m,
            free_threshold=reading.free_threshold,
            occupied_threshold=reading.occupied_threshold,
            max_cells=reading.max_cells,
        )
        allowed = preset.planner.allow_unexplored
        whole, model = model, model.remade(least_island_m2=reading.least_island_m2 or None)
        grid = model.grid
    if is_model_file(path) and not model.is_filed:
        complain(f"{printable(path)} was made with other settings: of it the map alone is used")
    if model is whole:
        return model
    before, after = (each.enterable(allow_unexplored=allowed).any() for each in (whole.grid, grid))
    if before and not after:
        raise UsageError(
            f"--least-island {reading.least_island_m2:g} leaves no free cell on "
            f"{printable(grid.name)}: give a smaller area"
        )
    return model


def is_model_file(path: Path) -> bool:
    """Return whether a path names a model, without loading the modules that read it."""
    return path.suffix.lower() == MODEL_SUFFIX


def extent_line(grid: hn.OccupancyGrid) -> str:
    """Return the summary's line on the extent of a map."""
    from hybridnav.grid.occupancy import extent  # noqa: PLC0415 - loads numpy

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


def check_room_to_be(grid: hn.OccupancyGrid, *, allow_unexplored: bool = False) -> None:
    """Refuse a robot radius that leaves no cell of a map free."""
    was_free = (grid.measured == hn.CellClass.FREE).any()
    if was_free and not grid.enterable(allow_unexplored=allow_unexplored).any():
        raise UsageError(
            f"a robot radius of {grid.robot_radius_m:g} m leaves no free cell on "
            f"{printable(grid.name)}: give a smaller one with --robot-radius"
        )


def grow_topology(
    model: hn.Model,
    preset: Preset,
    seconds: dict[str, float],
    *,
    rooms_file: Path | None = None,
    find_rooms: bool = False,
    waypoints: Sequence[str | tuple[float, ...]] = (),
    closing: Closing | None = None,
) -> hn.TopologicalMap:
    """Build the pyramid of a map with the settings of a preset, unless the model has it, and the
    rooms of a file, of the model or, if asked for, those that are found. Refuse names of waypoints
    and closed rooms that these lack before, and numbers of closed doors after."""
    grid, rooms = model.grid, model.rooms
    if rooms_file is not None:
        with stage(f"reading {rooms_file}", seconds, "rooms"):
            rooms = hn.load_rooms(rooms_file, grid)
    elif find_rooms and rooms is None:
        with stage("finding rooms", seconds, "rooms"):
            rooms = hn.find_rooms(grid)
    if rooms is not None:
        from hybridnav.planner.named import check_waypoints  # noqa: PLC0415 - loads numba

        check_waypoints(rooms, grid, waypoints)
        for name in closing.rooms if closing is not None else ():
            rooms.index(name)
    with stage("building the pyramid", seconds, "pyramid"):
        topology = model.grown(preset.pyramid, rooms)
    for number in closing.doors if closing is not None else ():
        topology.rooms.listed_door(number)
    return topology


def outside(
    grid: hn.OccupancyGrid, waypoints: Sequence[str | tuple[float, ...]]
) -> hn.PlanStatus | None:
    """Return the status that a planner would return for points outside the map, None if both are on
    it; no planner is needed."""
    for number, waypoint in enumerate(waypoints):
        if isinstance(waypoint, str):
            continue
        row, col = grid.frame.cells_of(waypoint[:2]).tolist()
        if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
            return hn.PlanStatus.GOAL_OUTSIDE if number else hn.PlanStatus.START_OUTSIDE
    return None


def refused_result(
    status: hn.PlanStatus, settings: Preset, waypoints: Sequence[str | tuple[float, ...]]
) -> hn.PlanResult:
    """Return the result that a planner would return with a status; no planner is needed."""
    start, goal = (
        None if isinstance(waypoint, str) else tuple(waypoint)
        for waypoint in (waypoints[0], waypoints[-1])
    )
    record = {
        "preset": settings.name,
        "planner": settings.planner.model_dump(),
        "pyramid": settings.pyramid.model_dump(),
    }
    return hn.PlanResult(status, settings=record, start=start, goal=goal)


def timings(seconds: dict[str, float]) -> str:
    """Return the seconds per stage on one line, and their sum."""
    stages = ", ".join(f"{stage} {s:.3f}" for stage, s in seconds.items())
    return f"{sum(seconds.values()):.3f}: {stages}"
