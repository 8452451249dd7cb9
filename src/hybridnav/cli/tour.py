"""`hybridnav plan` between named rooms: the way in words."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hybridnav as hn
from hybridnav._files import printable
from hybridnav.cli.blocked import Closing, told_closing
from hybridnav.cli.common import (
    answer,
    check_room_to_be,
    complain,
    extent_line,
    grow_topology,
    islands_figures,
    islands_line,
    outside,
    refused_result,
    stage,
    timings,
    told_bound,
)
from hybridnav.cli.errors import UsageError
from hybridnav.cli.keep import Source
from hybridnav.grid.names import read_point

if TYPE_CHECKING:
    from hybridnav.planner.named import At

Stop = str | tuple[float, ...]


@dataclass(frozen=True)
class Errand:
    """What a command line asks for."""

    source: Source
    rooms_file: Path | None
    stops: list[Stop]
    at: At
    plot: Path | None
    as_json: bool
    alternatives: int = 1
    least_hole_m2: float = 1.0
    closing: Closing = field(default_factory=Closing)

    @property
    def settings(self) -> hn.Preset:
        """The preset."""
        return self.source.settings


def run_errand(errand: Errand) -> bool:
    """Plan a way between rooms and points, print it, and return whether it is solved."""
    seconds: dict[str, float] = {}
    rooms_file = errand.rooms_file or _beside(errand.source.map_file)
    model, key = errand.source.load(seconds, rooms_file=rooms_file, needs_rooms=True)
    grid = model.grid
    check_room_to_be(grid, allow_unexplored=errand.settings.planner.allow_unexplored)
    closed = errand.closing.read(grid)
    status = outside(grid, errand.stops) if errand.plot is None else None
    if status is not None:
        refused = refused_result(status, errand.settings, errand.stops)
        figures = _figures(errand, hn.Tour((refused,), ()))
        if errand.alternatives > 1:
            figures |= {"alternatives": [], "alternatives_complete": True}
        _answer(errand, grid, figures, seconds)
        return False
    if model.rooms is not None and (errand.rooms_file is None or model.key is not None):
        rooms_file = None  # the model has them
    elif rooms_file is None:
        complain(
            "no rooms.yaml lies beside the map, so rooms are found; see hybridnav rooms --help"
        )
    topology = grow_topology(
        model,
        errand.settings,
        seconds,
        rooms_file=rooms_file,
        find_rooms=True,
        stops=errand.stops,
        closing=errand.closing,
    )
    with stage("preparing the planner", seconds, "prepare"):
        planner = model.planner(errand.settings, topology=topology)
    with stage("planning", seconds, "plan"):
        tour = hn.plan_tour(planner, errand.stops, at=errand.at, blocked=closed)
    errand.source.keep(planner, key)
    figures, found = _figures(errand, tour), None
    counted = sum(figures["seconds"].values())
    seconds["plan"] = round(max(seconds["plan"] - counted, 0.0), 6)  # what no stage below counts
    if errand.alternatives > 1:
        with stage("finding alternatives", seconds, "alternatives"):
            found = _found(errand, planner, closed)
            figures |= _alternatives(topology, found)
    _answer(errand, grid, figures, seconds)
    if errand.plot is not None:
        # Loads matplotlib.
        from hybridnav.viz import plot_alternatives, plot_tour, save_figure  # noqa: PLC0415

        ax = plot_alternatives(topology, found) if found else plot_tour(topology, tour)
        save_figure(ax, errand.plot)
    return tour.solved


def _answer(
    errand: Errand, grid: hn.OccupancyGrid, figures: dict[str, Any], seconds: dict[str, float]
) -> None:
    figures = figures | {"seconds": seconds | figures["seconds"]} | islands_figures(grid)
    whole = json.dumps(figures, allow_nan=False) + "\n"
    answer(whole if errand.as_json else _summary(grid, figures))


def _beside(map_file: Path) -> Path | None:
    """The file of rooms in the map's folder, None where there is none."""
    path = map_file.parent / "rooms.yaml"
    return path if path.is_file() else None


def parsed_stop(text: str) -> Stop:
    """A point where the text is two numbers, or three with a heading, else a name."""
    point = read_point(text)
    if point is None:
        return text
    if not all(map(math.isfinite, point)):
        raise UsageError(f"expected a name, or finite numbers X,Y or X,Y,YAW, got {text!r:.90}")
    return point


def _told(stop: Stop) -> str:
    return stop if isinstance(stop, str) else f"({', '.join(f'{n:.10g}' for n in stop)})"


def _figures(errand: Errand, tour: hn.Tour) -> dict[str, Any]:
    return tour.to_dict() | {
        "map": str(errand.source.map_file),
        "stops": [stop if isinstance(stop, str) else list(stop) for stop in errand.stops],
        "query": " via ".join(map(_told, errand.stops[:-1])) + " to " + _told(errand.stops[-1]),
        **errand.closing.to_dict(),
    }


def _found(errand: Errand, planner: hn.HybridPlanner, closed: hn.Blocked | None) -> hn.Alternatives:
    """Routes of different classes between the two stops."""
    return hn.plan_alternatives(
        planner,
        errand.stops[0],
        errand.stops[-1],
        errand.alternatives,
        least_hole_m2=errand.least_hole_m2,
        at=errand.at,
        blocked=closed,
    )


def _alternatives(topology: hn.TopologicalMap, found: hn.Alternatives) -> dict[str, Any]:
    """Routes with the rooms and doors that they pass, and whether there may be more."""
    # Loads numba, which help and wrong usage can do without.
    from hybridnav.planner.itinerary import NOWHERE, Guide  # noqa: PLC0415

    guide = Guide(topology.rooms)
    routes = []
    for alternative in found:
        legs = guide.legs(alternative.path)
        passed = [
            f"{leg.room or NOWHERE}" + (f" (door {leg.door.number})" if leg.door else "")
            for leg in legs
        ]
        routes.append(
            {
                "metric": "octile",
                "length_m": alternative.path.length_m,
                "word": list(alternative.word),
                "rooms": passed,
                "points": alternative.path.points.round(6).tolist(),
            }
        )
    return {"alternatives": routes, "alternatives_complete": found.complete}


def _summary(grid: hn.OccupancyGrid, figures: dict[str, Any]) -> str:
    radius = f"robot radius {grid.robot_radius_m:g} m"
    lines = [
        f"query      {printable(grid.name)}, {figures['query']}, {radius}",
        *told_closing(figures),
        f"status     {figures['status']}",
    ]
    lines += islands_line(grid)
    if "outside" in figures["status"]:
        lines.append(extent_line(grid))
    if figures["length_m"] is not None:
        lines += _measured(figures)
    for number, line in enumerate(figures["words"]):
        lines.append(f"{'' if number else 'way':<10} {line}")
    for number, other in enumerate(figures.get("alternatives", ()), start=1):
        word = " ".join(f"{letter:+d}" for letter in other["word"]) or "-"
        rooms = f", by {', '.join(other['rooms'])}" if other["rooms"] else ""
        length = f"{other['length_m']:.2f} m ({other['metric']})"
        lines.append(f"route {number:<4} {length}, class {word}{rooms}")
    if not figures.get("alternatives_complete", True):
        lines.append("routes     the search gave up: there may be more")
    lines.append(f"seconds    {timings(figures['seconds'])}")
    return "\n".join(lines) + "\n"


def _measured(figures: dict[str, Any]) -> list[str]:
    """Length, cost where the metric weighs the length, and the bound, each with its metric."""
    length_m, metric = figures["length_m"], figures["metric"]
    if figures["cost"] == length_m:
        lines = [f"length     {length_m:.2f} m ({metric})"]
    else:
        lines = [f"length     {length_m:.2f} m", f"cost       {figures['cost']:.2f} ({metric})"]
    bound, gap = figures["lower_bound"], 0.0
    if bound > 0:
        gap = figures["cost"] / bound - 1
    least, told = told_bound(bound, gap)
    unit = "m " if figures["cost"] == length_m else ""
    return [*lines, f"bound      {least} {unit}({metric}), this way is {told} between its stops"]
