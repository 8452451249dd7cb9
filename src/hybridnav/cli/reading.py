"""How commands read maps and presets, and the group of options for it."""

from __future__ import annotations

import functools
import inspect
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

import typer

import hybridnav as hn
from hybridnav._base.extension import extension, extensions
from hybridnav._base.files import MODEL_SUFFIX, printable
from hybridnav.cli import options
from hybridnav.cli.common import UsageError, check_writable, complain, stage
from hybridnav.maps import DEFAULT_MAX_CELLS, MAX_CELLS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from hybridnav.cli.options import Closing
    from hybridnav.planning import Preset

_SMOOTH = ("none", "line-of-sight", "arcs")


@dataclass(frozen=True)
class MapOptions:
    """How a command reads its map, and the preset that it takes for it: one group of options."""

    preset: options.PresetOption[str | None] = None
    overrides: options.SetOption = None
    robot_radius_m: options.RadiusOption = None
    seed: options.SeedOption[int | None] = None
    free_threshold: options.FreeOption = None
    occupied_threshold: options.OccupiedOption = None
    least_island_m2: options.LeastIslandOption = 0.0
    max_cells: options.MaxCellsOption = DEFAULT_MAX_CELLS

    def settings(
        self,
        map_file: Path,
        *,
        preset: str | None = None,
        overrides: tuple[str, ...] = (),
        smooth: str | None = None,
    ) -> Preset:
        """Return the preset with the settings of the command line, which win over it.

        `map_file`: a map, or a model, which holds a preset; `preset`: the preset where the command
        line names none; `overrides`: settings beside those of the command line, which win over
        them; `smooth`: how to shorten the path; None as in the preset.
        """
        return read_settings(
            preset if self.preset is None else self.preset,
            [*overrides, *(self.overrides or ())],
            self.robot_radius_m,
            self.seed,
            smooth=smooth,
            map_file=map_file,
        )


def with_map(
    *,
    before: str = "plot",
    without: tuple[str, ...] = (),
    over_floors: Callable[[], Callable[..., None]] | None = None,
    reads: tuple[str, ...] = ("preset", "overrides", "robot_radius_m", "max_cells"),
    alone: tuple[str, ...] = (),
) -> Callable[[Any], Any]:
    """Give a command the options of `MapOptions`, which it takes as its argument `reading`.

    `before`: the parameter of the command before which the help lists them; they are last if it has
    none; `without`: options that the command has itself; `over_floors`: returns what runs the
    command if its map is a building: its parameters are the options that mean something then. None
    for a command that takes no buildings. `reads`: options of `MapOptions` that mean something
    then; `alone`: options that mean something for buildings alone.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        group = get_type_hints(MapOptions, include_extras=True)
        added = [each for each in fields(MapOptions) if each.name not in without]

        # `get_type_hints` of Python 3.10 hides what is annotated where the default is None.
        own = [
            each.replace(kind=inspect.Parameter.KEYWORD_ONLY)
            for name, each in inspect.signature(command, eval_str=True).parameters.items()
            if name != "reading"
        ]

        @functools.wraps(command)
        def run(**given: Any) -> None:
            runs = command
            if over_floors is not None:
                ctx = given.pop("ctx")
                # Here one floor and several part: what people are told of a route, a graph or a
                # model goes by rooms and doors on one map, by floors and links over several.
                is_building = is_building_file(given["map_file"])
                runs = over_floors() if is_building else command
                known = {*inspect.signature(runs).parameters, *reads} if is_building else alone
                _check_options(ctx, known, is_building=is_building)
            taken = {each.name: given.pop(each.name) for each in added}
            named = inspect.signature(runs).parameters
            runs(
                **{name: value for name, value in given.items() if name in named},
                reading=MapOptions(**taken),
            )

        shared = [
            inspect.Parameter(
                each.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=each.default,
                annotation=group[each.name],
            )
            for each in added
        ]
        if over_floors is not None:
            kind = inspect.Parameter.KEYWORD_ONLY
            own.insert(0, inspect.Parameter("ctx", kind, annotation=typer.Context))
        names = [each.name for each in own]
        at = names.index(before) if before in names else len(names)
        parameters = [*own[:at], *shared, *own[at:]]
        run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {each.name: each.annotation for each in parameters}
        return run

    return decorate


def is_building_file(path: Path) -> bool:
    """Return whether a file describes a building, and what reads buildings is installed."""
    reads = "building" in extensions("formats")
    return reads and bool(extension("formats", "building").is_building_file(path))


def _check_options(ctx: typer.Context, names: Collection[str], *, is_building: bool) -> None:
    """Refuse options for a building that are none of `names`, or for a map that are some."""
    one, other = ("one map", "a building") if is_building else ("a building", "one map")
    for parameter in ctx.command.params:
        name = parameter.name or ""
        source = ctx.get_parameter_source(name)
        is_given = source is not None and source.name != "DEFAULT"
        if is_given and (name in names) != is_building:
            option = max(parameter.opts, key=len)
            raise UsageError(f"{option} is for {one}, and this is {other}: leave it out")


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
    except hn.errors.PresetError as error:
        raise UsageError(str(error)) from None


def load_model(
    path: Path, preset: Preset, seconds: dict[str, float], reading: MapOptions
) -> hn.Model:
    """Load a model or a map, inflated as a preset states, without the islands that the user
    drops."""
    with stage(f"reading {path}", seconds, "load"):
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
    waypoints: Sequence[str | tuple[float, ...]] = (),
    closing: Closing | None = None,
) -> hn.TopologicalMap:
    """Build the pyramid of a map with the settings of a preset, unless the model has it.

    Its rooms are those of a file, those of the model or, if asked for, found. Refuse names of
    waypoints and closed rooms that these lack before, and numbers of closed doors after.
    """
    grid, rooms = model.grid, model.rooms
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
    return hn.PlanResult(status, settings=record, start=start, goal=goal)
