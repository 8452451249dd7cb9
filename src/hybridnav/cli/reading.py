"""How commands read maps, presets and models, and grow pyramids on them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import hybridnav as hn
from hybridnav._base.files import MODEL_SUFFIX, printable
from hybridnav.cli.common import UsageError, check_writable, stage
from hybridnav.maps import MAX_CELLS

if TYPE_CHECKING:
    from hybridnav.cli.options import Closing
    from hybridnav.planning import Preset

_SMOOTH = ("none", "line-of-sight", "arcs")


def read_preset(source: str) -> Preset:
    """Read a preset by name or file: an unknown name is wrong usage, a bad file unreadable
    input."""
    try:
        return hn.load_preset(source)
    except hn.errors.PresetNotFoundError as error:
        from hybridnav.planning.preset import is_preset_name  # noqa: PLC0415 - loads pydantic

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
        from hybridnav.models.model import open_model  # noqa: PLC0415

        named = None if preset is None else read_preset(preset)
        plain = open_model(map_file, max_cells=MAX_CELLS).fitted(named)
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
    except hn.errors.PresetError as error:
        raise UsageError(str(error)) from None


def is_model_file(path: Path) -> bool:
    """Return whether a path names a model, without loading the modules that read it."""
    return path.suffix.lower() == MODEL_SUFFIX


def check_model(out: Path) -> None:
    """Refuse files that can be no models."""
    if not is_model_file(out):
        raise UsageError(f"--out must end in {MODEL_SUFFIX}, got '{printable(out)}'")
    check_writable(out, "--out")


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
    map_file: Path | None = None,
    waypoints: Sequence[str | tuple[float, ...]] = (),
    closing: Closing | None = None,
) -> hn.TopologicalMap:
    """Build the pyramid of a map with the settings of a preset, unless the model has it.

    Its rooms are those of a file, those of the model, those of rooms.yaml beside `map_file` (if
    rooms are asked for, or it has directions) or, if asked for, found. Refuse names of waypoints
    and closed rooms that these lack before, and numbers of closed doors after.
    """
    grid, rooms = model.grid, model.rooms
    if rooms_file is None and rooms is None and map_file is not None:
        beside = map_file.with_name("rooms.yaml")
        if beside.is_file() and (find_rooms or b"\none_way:" in beside.read_bytes()):
            rooms_file = beside
    if rooms_file is not None:
        with stage(f"reading {rooms_file}", seconds, "rooms"):
            rooms = hn.load_rooms(rooms_file, grid)
    elif find_rooms and rooms is None:
        with stage("finding rooms", seconds, "rooms"):
            rooms = hn.find_rooms(grid)
    if rooms is not None:
        from hybridnav.planning.named import check_waypoints  # noqa: PLC0415 - loads numba

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
    return hn.PlanResult(status, settings_source=record, start=start, goal=goal)
