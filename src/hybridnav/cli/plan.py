"""`hybridnav plan`: from a map file to a route."""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav.cli.common import grow_topology, read_settings, stage
from hybridnav.cli.errors import EXIT_NOT_SOLVED
from hybridnav.cli.options import (
    JsonOption,
    MapArgument,
    PlotOption,
    PresetOption,
    RadiusOption,
    SeedOption,
    SetOption,
)

if TYPE_CHECKING:
    from pathlib import Path

Point = tuple[float, float]


def _point(text: str) -> Point:
    parts = text.split(",")
    try:
        x, y = (float(part) for part in parts)
    except ValueError:
        raise typer.BadParameter(f"expected X,Y in metres, got {text!r}") from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise typer.BadParameter(f"expected two finite numbers of metres, got {text!r}")
    return x, y


StartOption = Annotated[
    Any, typer.Option(metavar="X,Y", parser=_point, help="Start in metres, map frame.")
]
GoalOption = Annotated[
    Any, typer.Option(metavar="X,Y", parser=_point, help="Goal in metres, map frame.")
]
CompareOption = Annotated[
    bool, typer.Option("--compare", help="Also plan on the whole grid, and tell the loss.")
]


def plan(
    map_file: MapArgument,
    start: StartOption,
    goal: GoalOption,
    preset: PresetOption = "paper",
    overrides: SetOption = None,
    robot_radius_m: RadiusOption = None,
    seed: SeedOption = None,
    compare: CompareOption = False,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a route on MAP from START to GOAL.

    Exits with 0 when it is solved, 1 when it is not, 2 on wrong usage, 3 on unreadable input.
    """
    settings = read_settings(preset, overrides, robot_radius_m, seed)
    seconds: dict[str, float] = {}
    topology = grow_topology(map_file, settings, seconds)
    with stage("preparing the planner", seconds, "prepare"):
        planner = hn.HybridPlanner(topology, preset=settings)
    with stage("planning", seconds, "plan"):
        result = planner.plan(start, goal)
    answer = result.to_dict()
    answer["map"] = str(map_file)
    answer["seconds"] = {**seconds, **answer["seconds"]}
    optimum_m = None
    if compare:
        optimum_m = _compare(topology, settings, (start, goal), answer)
    if plot is not None:
        _draw(topology, result, (start, goal), optimum_m, plot)
    sys.stdout.write(json.dumps(answer) + "\n" if as_json else _summary(answer))
    if not result.solved:
        raise typer.Exit(EXIT_NOT_SOLVED)


def _compare(
    topology: hn.TopologicalMap,
    settings: hn.Preset,
    ends: tuple[Point, Point],
    answer: dict[str, Any],
) -> float | None:
    """Plan on the whole grid too, write its figures into the answer, give the optimum."""
    whole = settings.planner.model_copy(update={"coarse": "none"})
    baseline = settings.model_copy(update={"name": "grid-astar", "planner": whole})
    grid_result = hn.HybridPlanner(topology, preset=baseline).plan(*ends)
    solved = grid_result.path is not None
    answer["optimum_m"] = grid_result.cost if solved else None
    answer["grid_expanded"] = grid_result.stats.expanded
    answer["grid_seconds"] = round(sum(grid_result.stats.seconds.values()), 6)
    answer["loss"] = None
    if grid_result.path is not None and answer["length_m"] is not None:
        optimum = grid_result.cost
        answer["loss"] = answer["length_m"] / optimum - 1 if optimum > 0 else 0.0
    return grid_result.cost if solved else None


def _draw(
    topology: hn.TopologicalMap,
    result: hn.PlanResult,
    ends: tuple[Point, Point],
    optimum_m: float | None,
    path: Path,
) -> None:
    from hybridnav.viz import plot_plan, save_figure  # noqa: PLC0415 - matplotlib on demand

    ax = plot_plan(topology, result, start=ends[0], goal=ends[1], optimum_m=optimum_m)
    save_figure(ax, path)


def _summary(answer: dict[str, Any]) -> str:
    lines = [f"status     {answer['status']}"]
    if answer["length_m"] is not None:
        lines.append(f"length     {answer['length_m']:.2f} m ({answer['metric']})")
        lines.append(
            f"bound      {answer['lower_bound_m']:.2f} m, at most {answer['gap']:.1%} too long"
        )
    if answer["places"] is not None:
        lines.append(f"places     {' '.join(map(str, answer['places']))}")
        lines.append(f"arcs       {' '.join(map(str, answer['arcs']))}")
    lines.append(f"expanded   {answer['expanded']} cells, {answer['expanded_places']} places")
    if answer.get("loss") is not None:
        lines.append(f"optimum    {answer['optimum_m']:.2f} m, loss {answer['loss']:.2%}")
    if "grid_expanded" in answer:
        lines.append(
            f"grid       {answer['grid_expanded']} cells expanded, {answer['grid_seconds']:.4f} s"
        )
    stages = ", ".join(f"{stage} {s:.3f}" for stage, s in answer["seconds"].items())
    lines.append(f"seconds    {stages}")
    return "\n".join(lines) + "\n"
