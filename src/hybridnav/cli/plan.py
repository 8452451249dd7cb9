"""`hybridnav plan`: from a map file to a route."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._files import printable
from hybridnav.cli.blocked import BlockedOption, parsed_closing, told_closing
from hybridnav.cli.common import (
    Reading,
    answer,
    check_picture,
    check_room_to_be,
    extent_line,
    grow_topology,
    islands_figures,
    islands_line,
    outside,
    read_settings,
    refused_result,
    stage,
    timings,
    told_bound,
)
from hybridnav.cli.compiling import compiling_beside
from hybridnav.cli.errors import EXIT_NOT_SOLVED, UsageError
from hybridnav.cli.keep import KeepInOption, KeepOption, Source
from hybridnav.cli.options import (
    FreeOption,
    JsonOption,
    LeastIslandOption,
    MapArgument,
    MaxCellsOption,
    OccupiedOption,
    PlotOption,
    PresetOption,
    RadiusOption,
    RoomsOption,
    SeedOption,
    SetOption,
    SmoothOption,
)
from hybridnav.cli.tour import Errand, parsed_stop, run_errand
from hybridnav.grid import DEFAULT_MAX_CELLS
from hybridnav.grid.names import read_point

if TYPE_CHECKING:
    from pathlib import Path

    from hybridnav.planner.named import At

Point = tuple[float, ...]


def _point(text: str) -> Point:
    point = read_point(text)
    if point is None:
        raise typer.BadParameter(f"expected X,Y in metres, or X,Y,YAW, got {text!r}")
    if not all(map(math.isfinite, point)):
        raise typer.BadParameter(f"expected finite numbers of metres and radians, got {text!r}")
    return point


StartOption = Annotated[
    Any,
    typer.Option(metavar="X,Y", parser=_point, help="Start in metres; ,YAW in radians for OMPL."),
]
GoalOption = Annotated[
    Any,
    typer.Option(metavar="X,Y", parser=_point, help="Goal in metres; ,YAW in radians for OMPL."),
]
FromOption = Annotated[
    str | None, typer.Option("--from", metavar="ROOM|X,Y", help="Start in a room, or at a point.")
]
ToOption = Annotated[
    str | None, typer.Option("--to", metavar="ROOM|X,Y", help="Go to a room, or to a point.")
]
ViaOption = Annotated[
    list[str] | None,
    typer.Option("--via", metavar="ROOM|X,Y", help="Stop there on the way; may be repeated."),
]
AtOption = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="WHERE",
        help="Where in a room: anywhere (the nearest cell), or its point (with --alternatives).",
    ),
]
AlternativesOption = Annotated[
    int,
    typer.Option(
        "--alternatives",
        metavar="N",
        min=1,
        max=20,
        help="Up to N routes by other doors or on other sides of obstacles.",
    ),
]
LeastHoleOption = Annotated[
    float,
    typer.Option(
        "--least-hole",
        metavar="A",
        min=0,
        help="Square metres of an obstacle whose two sides make two routes.",
    ),
]
CompareOption = Annotated[
    bool,
    typer.Option("--compare", help="Also plan on the whole grid; for octile paths print the loss."),
]


def plan(
    map_file: MapArgument,
    start: StartOption = None,
    goal: GoalOption = None,
    origin: FromOption = None,
    to: ToOption = None,
    via: ViaOption = None,
    at: AtOption = None,
    rooms_file: RoomsOption = None,
    alternatives: AlternativesOption = 1,
    least_hole_m2: LeastHoleOption = 1.0,
    blocked: BlockedOption = None,
    preset: PresetOption = None,
    overrides: SetOption = None,
    robot_radius_m: RadiusOption = None,
    seed: SeedOption = None,
    smooth: SmoothOption = None,
    free_threshold: FreeOption = None,
    occupied_threshold: OccupiedOption = None,
    least_island_m2: LeastIslandOption = 0.0,
    max_cells: MaxCellsOption = DEFAULT_MAX_CELLS,
    keep: KeepOption = False,
    keep_in: KeepInOption = None,
    compare: CompareOption = False,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a route on MAP, from a point or room to another.

    Exits with 0 when it is solved, 1 when it is not, 2 on wrong usage, 3 on unreadable input.
    """
    check_picture(plot)
    where = _checked_at(at, alternatives)
    _check_least_hole(least_hole_m2)
    settings = read_settings(
        preset, overrides, robot_radius_m, seed, smooth=smooth, map_file=map_file
    )
    reading = Reading(free_threshold, occupied_threshold, least_island_m2, max_cells)
    source = Source(map_file, settings, reading, keep, keep_in)
    closing = parsed_closing(blocked)
    ends = _one_of("start", start, "from", origin), _one_of("goal", goal, "to", to)
    if via and alternatives > 1:
        raise UsageError("--alternatives does not go with --via")
    if settings.planner.refine == "ompl" and alternatives > 1:
        raise UsageError(f"--alternatives needs a preset without OMPL, not {settings.name}")
    if (
        via
        or alternatives > 1
        or rooms_file is not None
        or closing.needs_rooms
        or any(isinstance(end, str) for end in ends)
    ):
        if compare:
            raise UsageError("--compare goes with --start and --goal alone, and files as --blocked")
        stops = [ends[0], *map(parsed_stop, via or ()), ends[1]]
        errand = Errand(
            source,
            rooms_file,
            stops,
            where,
            plot,
            as_json,
            alternatives,
            least_hole_m2,
            closing,
        )
        if not run_errand(errand):
            raise typer.Exit(EXIT_NOT_SOLVED)
        return
    start, goal = ends
    seconds: dict[str, float] = {}
    model, key = source.load(seconds)
    grid = model.grid
    check_room_to_be(grid, allow_unexplored=settings.planner.allow_unexplored)
    closed = closing.read(grid)
    status = outside(grid, ends) if plot is None else None
    if status is not None:
        refused = refused_result(status, settings, ends)
        figures = _figures(map_file, refused, seconds) | islands_figures(grid) | closing.to_dict()
        figures |= _whole_grid(refused, None, asked=compare)
        _answer(grid, ends, figures, as_json=as_json)
        raise typer.Exit(EXIT_NOT_SOLVED)
    with compiling_beside(settings) as compiled:
        topology = grow_topology(model, settings, seconds)
        compiled()
    with stage("preparing the planner", seconds, "prepare"):
        planner = model.planner(settings, topology=topology)
    with stage("planning", {}, "plan"):  # the result has the seconds of its stages
        result = planner.plan(start, goal, blocked=closed)
    source.keep(planner, key)
    figures = _figures(map_file, result, seconds) | islands_figures(grid) | closing.to_dict()
    if compare:
        figures |= _compare(topology, settings, (start, goal), result, closed)
    _answer(grid, (start, goal), figures, as_json=as_json)
    if plot is not None:
        optimum_m = figures["optimum_m"] if figures.get("loss") is not None else None
        _draw(topology, result, (start, goal), optimum_m, plot)
    if not result.solved:
        raise typer.Exit(EXIT_NOT_SOLVED)


def _figures(map_file: Path, result: hn.PlanResult, seconds: dict[str, float]) -> dict[str, Any]:
    figures = result.to_dict() | {"map": str(map_file)}
    figures["seconds"] = seconds | figures["seconds"]
    return figures


def _answer(
    grid: hn.OccupancyGrid, ends: tuple[Point, Point], figures: dict[str, Any], *, as_json: bool
) -> None:
    answer(json.dumps(figures, allow_nan=False) + "\n" if as_json else summary(grid, ends, figures))


def _one_of(option: str, point: Any, other: str, text: str | None) -> Any:
    """An end of the way, from one of the two options that may give it."""
    if (point is None) == (text is None):
        what = "missing option" if point is None else "only one is taken, of"
        raise UsageError(f"{what} '--{option}' or '--{other}'; see hybridnav plan --help")
    return parsed_stop(text) if text is not None else point


def _checked_at(at: str | None, alternatives: int) -> At:
    if at is None:
        return "anywhere" if alternatives == 1 else "point"
    if at == "anywhere":
        return "anywhere"
    if at == "point":
        return "point"
    raise UsageError(f"--at must be anywhere or point, got {at!r:.80}")


def _check_least_hole(area_m2: float) -> None:
    if not math.isfinite(area_m2):
        raise UsageError(f"--least-hole must be a finite number of m² >= 0, got {area_m2}")


def _compare(
    topology: hn.TopologicalMap,
    settings: hn.Preset,
    ends: tuple[Point, Point],
    result: hn.PlanResult,
    closed: hn.Blocked | None,
) -> dict[str, Any]:
    """Plan on the whole grid too and set the result against it."""
    whole = settings.planner.model_copy(
        update={
            "coarse": "none",
            "smooth": "none",
            "refine": "grid-astar",
            "ompl": None,
            "epsilon": None,
        }
    )
    baseline = settings.model_copy(update={"name": "grid-astar", "planner": whole})
    planner = hn.HybridPlanner(topology, preset=baseline)
    grid_result = planner.plan(ends[0][:2], ends[1][:2], blocked=closed)
    return _whole_grid(grid_result, result)


def _whole_grid(
    grid_result: hn.PlanResult, result: hn.PlanResult | None, *, asked: bool = True
) -> dict[str, Any]:
    """What a plan on the whole grid came to, and a result's loss against it, if asked for."""
    if not asked:
        return {}
    length_m, loss = grid_result.cost if grid_result.solved else None, None
    alike = result is None or result.metric == grid_result.metric
    if length_m is not None and result is not None and result.solved and alike:
        loss = result.cost / length_m - 1 if length_m > 0 else 0.0
    return {
        "optimum_m": length_m if alike else None,
        "loss": loss,
        "grid_length_m": length_m,
        "grid_expanded": grid_result.stats.expanded,
        "grid_seconds": round(sum(grid_result.stats.seconds.values()), 6),
    }


def _draw(
    topology: hn.TopologicalMap,
    result: hn.PlanResult,
    ends: tuple[Point, Point],
    optimum_m: float | None,
    path: Path,
) -> None:
    from hybridnav.viz import plot_plan, save_figure  # noqa: PLC0415 - matplotlib on demand

    ax = plot_plan(topology, result, start=ends[0][:2], goal=ends[1][:2], optimum_m=optimum_m)
    save_figure(ax, path)


def summary(grid: hn.OccupancyGrid, ends: tuple[Point, Point], figures: dict[str, Any]) -> str:
    """What a plan's figures say, line by line."""
    start, goal = (f"({', '.join(f'{value:.10g}' for value in end)})" for end in ends)
    radius = f"robot radius {grid.robot_radius_m:g} m"
    lines = [
        f"query      {printable(grid.name)}, {start} to {goal}, {radius}",
        *told_closing(figures),
        f"status     {figures['status']}",
    ]
    lines += islands_line(grid)
    if "outside" in figures["status"]:
        lines.append(extent_line(grid))
    if figures["length_m"] is not None and figures["lower_bound"] is None:
        short_m = math.dist(figures["points"][-1], ends[1][:2])
        told = f"ends {short_m:.2f} m short of the goal after {figures['length_m']:.2f} m"
        lines.append(f"path       {told}")
    elif figures["length_m"] is not None:
        lines.append(f"length     {figures['length_m']:.2f} m ({figures['metric']})")
        bound, told = told_bound(figures["lower_bound"], figures["gap"])
        lines.append(f"bound      {bound} m, the path is {told}")
    if figures["steps"] is not None:
        lines.append(f"steps      {'; '.join(figures['steps'])}")
    if figures["places"] is not None:
        for key in ("places", "arcs"):
            ids = figures[key]
            lines.append(f"{key:<10} {len(ids)}: {' '.join(map(str, ids))}".rstrip(": "))
    expanded = [
        f"{n:,} {what}"
        for what in ("cells", "places", "gates", "intervals")
        if (n := figures["expanded" if what == "cells" else f"expanded_{what}"])
    ]
    if expanded:
        lines.append(f"expanded   {', '.join(expanded)}")
    lines += _comparison(figures)
    lines.append(f"seconds    {timings(figures['seconds'])}")
    return "\n".join(lines) + "\n"


def _comparison(figures: dict[str, Any]) -> list[str]:
    """Lines on the whole grid: its optimum where the path has the same metric, octile, and else
    its length alone, for a loss over another metric's optimum would mean nothing."""
    if "grid_expanded" not in figures:
        return []
    if figures["grid_length_m"] is None:
        return ["optimum    none, the whole grid has no path either"]
    cells, seconds = figures["grid_expanded"], figures["grid_seconds"]
    took = f"{cells:,} cells expanded on the whole map, {seconds:.3f} s"
    if figures["optimum_m"] is None:
        return [f"grid       {figures['grid_length_m']:.2f} m (octile), {took}"]
    loss = f", loss {figures['loss'] * 100:.2f} %" if figures["loss"] is not None else ""
    return [f"optimum    {figures['optimum_m']:.2f} m{loss}", f"grid       {took}"]
