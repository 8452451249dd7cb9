"""The answer of `hybridnav plan`: as text, as JSON, as a picture."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli.common import answer, extent_line, islands_line, timings
from hybridnav.cli.options import closing_lines, profile_lines
from hybridnav.planning.text import rounded_bound

Waypoint = str | tuple[float, ...]
"""A name, or `(x, y)` or `(x, y, yaw)` in metres and radians, map frame."""
_BY_COSTS = frozenset({"weighted", "any-angle-weighted"})
"""Metrics of paths by costs, which are metres as lengths are."""


def respond(
    grid: hn.OccupancyGrid, waypoints: Sequence[Waypoint], figures: dict[str, Any], *, as_json: bool
) -> None:
    """Print the figures of an answer on stdout, as one JSON object or as lines for a person."""
    whole = json.dumps(figures, allow_nan=False) + "\n" if as_json else None
    answer(whole or summary(grid, waypoints, figures))


def draw(
    path: Path,
    outcome: hn.PlanResult | hn.Tour | hn.Alternatives,
    waypoints: Sequence[Waypoint],
    optimum_m: float | None,
    *,
    on: tuple[hn.TopologicalMap, hn.Blocked | None, hn.CostLayer | None],
) -> None:
    """Save the picture of a plan between two points, of a tour, or of alternatives.

    `on`: the map, what is closed on it, and costs.
    """
    from hybridnav import viz  # noqa: PLC0415 - loads matplotlib

    topology, closed, costs = on
    query: Any = {"costs": costs, "blocked": closed}
    if isinstance(outcome, hn.PlanResult):
        start, goal = (waypoint[:2] for waypoint in waypoints)
        ax = viz.plot_plan(topology, outcome, start=start, goal=goal, optimum_m=optimum_m, **query)
    elif isinstance(outcome, hn.Tour):
        ax = viz.plot_tour(topology, outcome, **query)
    else:
        ax = viz.plot_alternatives(topology, outcome, **query)
    viz.save_figure(ax, path)


def query_of(waypoints: Sequence[Waypoint]) -> str:
    """Describe a query: its start, what lies between, its goal."""
    *before, last = (
        waypoint if isinstance(waypoint, str) else f"({', '.join(f'{n:.10g}' for n in waypoint)})"
        for waypoint in waypoints
    )
    return f"{' via '.join(before)} to {last}"


def summary(grid: hn.OccupancyGrid, waypoints: Sequence[Waypoint], figures: dict[str, Any]) -> str:
    """Return the lines that describe an answer to a person.

    `waypoints`: what was asked for; `figures`: those of a plan or, with `words`, of a tour, and of
    what was asked for beside it.
    """
    radius = f"robot radius {grid.robot_radius_m:g} m"
    lines = [
        f"query      {printable(grid.name)}, {query_of(waypoints)}, {radius}",
        *closing_lines(figures),
        *profile_lines(figures["settings"].get("profile")),
        preset_line(figures["settings"]["preset"], chosen=figures.get("by_costs", False)),
        f"status     {figures['status']}",
        *islands_line(grid),
    ]
    if "outside" in figures["status"]:
        lines.append(extent_line(grid))
    for number, line in enumerate((figures.get("why") or {"words": ()})["words"]):
        lines.append(f"{'' if number else 'why':<10} {line}")
    lines += _tour_lines(figures) if "words" in figures else _plan_lines(figures)
    lines.append(f"seconds    {timings(figures['seconds'])}")
    return "\n".join(lines) + "\n"


def preset_line(name: str, *, chosen: bool = False) -> str:
    """Return the line of a summary about the preset; `chosen`: whether costs have chosen it."""
    return f"preset     {printable(name)}{', which plans by costs' if chosen else ''}"


def _plan_lines(figures: dict[str, Any]) -> list[str]:
    """Describe one plan: its length and bound, places and arcs, what was expanded."""
    lines = []
    if figures["length_m"] is not None and figures["lower_bound"] is None:
        from hybridnav._base.trig import dist  # noqa: PLC0415 - help does without numpy

        short_m = dist(figures["points"][-1], figures["goal"][:2])
        stated = f"ends {short_m:.2f} m short of the goal after {figures['length_m']:.2f} m"
        lines.append(f"path       {stated}")
    elif figures["length_m"] is not None:
        by_costs = figures["metric"] in _BY_COSTS
        lines.append(
            f"length     {figures['length_m']:.2f} m{'' if by_costs else in_metric(figures)}"
        )
        lines += _duration_lines(figures)
        if by_costs:
            lines.append(f"cost       {figures['cost']:.2f} m{in_metric(figures)}")
        bound, stated = rounded_bound(figures["lower_bound"], figures["cost"])
        stated = stated.replace("long", "dear") if by_costs else stated
        lines.append(f"bound      {bound} m, the path is {stated}")
        lines += _end_lines(figures)
        if figures["grid_bound"] is not None:
            lines.append(_beside_cells(figures["grid_bound"], figures["grid_gap"]))
    if figures["steps"] is not None:
        lines.append(f"steps      {'; '.join(figures['steps'])}")
    if figures["places"] is not None:
        for key in ("places", "arcs"):
            ids = figures[key]
            lines.append(f"{key:<10} {len(ids)}: {' '.join(map(str, ids))}".rstrip(": "))
    by_lattice = figures["settings"].get("planner", {}).get("method") == "cheapest"
    counts = {
        "nodes" if by_lattice else "cells": figures["expanded"],
        "places": figures["expanded_places"],
        "intervals": figures["expanded_intervals"],
    }
    expanded = [f"{n:,} {what}" for what, n in counts.items() if n]
    if expanded:
        lines.append(f"expanded   {', '.join(expanded)}")
    return lines + _whole_grid_lines(figures)


def _end_lines(figures: dict[str, Any]) -> list[str]:
    """State what the path leaves at its start, and how far from the goal it ends."""
    lines = []
    if figures["leaves_m"] is not None:
        lines.append(
            f"leaves     {' and '.join(figures['leaves'])} over {figures['leaves_m']:.2f} m"
        )
    if figures["short_m"]:
        far = f"{figures['short_m']:.2f} m"
        lines.append(f"short      {far} of the goal, at the nearest point that can be reached")
    return lines


def _duration_lines(figures: dict[str, Any]) -> list[str]:
    """State how long the robot drives, if its limits are known."""
    seconds = figures["duration_s"]
    return [] if seconds is None else [f"duration   {seconds:.1f} s"]


def _beside_cells(bound_m: float, gap: float) -> str:
    """Describe how far an any-angle path is from all paths of cells, rounded to the safe side."""
    share = abs(math.ceil(gap * 1000) / 10)
    compared = f"at most {share:.1f} % dearer" if gap > 0 else f"at least {share:.1f} % cheaper"
    low = math.floor(bound_m * 100) / 100
    return f"cells      no path of cells costs less than {low:.2f} m, this one is {compared}"


def in_metric(figures: dict[str, Any]) -> str:
    """Return the metric of a plan, for the end of a line."""
    return f" ({figures['metric']})"


def _whole_grid_lines(figures: dict[str, Any]) -> list[str]:
    """Describe the plan on the whole grid, if it was asked for.

    Its length is the optimum of a path in the same metric, octile, and for any other path a length
    alone: a loss over another metric's optimum would mean nothing.
    """
    if "grid_expanded" not in figures:
        return []
    if figures["grid_length_m"] is None:
        return ["optimum    none, the whole grid has no path either"]
    cells, seconds = figures["grid_expanded"], figures["grid_seconds"]
    took = f"{cells:,} cells expanded on the whole map, {seconds:.3f} s"
    if figures["optimum_m"] is None:
        length = f"{figures['grid_length_m']:.2f} m"
        if figures["metric"] in _BY_COSTS:
            return [f"grid       {length}, cost {figures['grid_cost']:.2f} m (weighted), {took}"]
        return [f"grid       {length} (octile), {took}"]
    loss = f", loss {figures['loss'] * 100:.2f} %" if figures["loss"] is not None else ""
    return [f"optimum    {figures['optimum_m']:.2f} m{loss}", f"grid       {took}"]


def _tour_lines(figures: dict[str, Any]) -> list[str]:
    """Describe a tour: its length and bound, the rooms and doors, the alternatives."""
    lines = _measured(figures) if figures["length_m"] is not None else []
    for number, line in enumerate(figures["words"]):
        lines.append(f"{'' if number else 'words':<10} {line}")
    for number, other in enumerate(figures.get("alternatives", ()), start=1):
        rooms = f", by {', '.join(other['rooms'])}" if other["rooms"] else ""
        shared = f", {other['overlap']:.0%} in common" if number > 1 else ""
        cost = f", cost {other['cost']:.2f} m" if other["metric"] in _BY_COSTS else ""
        length = f"{other['length_m']:.2f} m{cost} ({other['metric']})"
        lines.append(f"route {number:<4} {length}{shared}{rooms}")
    if figures.get("alternatives_note"):
        lines.append(f"routes     {figures['alternatives_note']}")
    return lines


def _measured(figures: dict[str, Any]) -> list[str]:
    """Describe the length, the cost if the metric weighs the length, and the bound."""
    length_m, metric = figures["length_m"], figures["metric"]
    by_costs = metric in _BY_COSTS
    if by_costs:
        cost = f"cost       {figures['cost']:.2f} m ({metric})"
        lines = [f"length     {length_m:.2f} m", cost]
    elif figures["cost"] == length_m:
        lines = [f"length     {length_m:.2f} m ({metric})"]
    else:
        lines = [f"length     {length_m:.2f} m", f"cost       {figures['cost']:.2f} ({metric})"]
    lines += _duration_lines(figures)
    least, stated = rounded_bound(figures["lower_bound"], figures["cost"])
    stated = stated.replace("long", "dear") if by_costs else stated
    unit = "m " if by_costs or figures["cost"] == length_m else ""
    return [
        *lines,
        f"bound      {least} {unit}({metric}), this path is {stated} between its waypoints",
    ]
