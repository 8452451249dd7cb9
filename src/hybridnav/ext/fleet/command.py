"""`hybridnav plan` and `hybridnav build` for a building of several floors."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import typer

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli import common
from hybridnav.cli.closed import change_closed, list_closed
from hybridnav.cli.options import closing_lines, parsed_closing, profile_lines
from hybridnav.cli.plan import checked_at, one_of
from hybridnav.cli.reading import MapOptions, check_model, read_settings
from hybridnav.cli.rendering import in_metric, preset_line, rounded_bound
from hybridnav.guide.words import check_language
from hybridnav.maps.names import place_of_name, read_point

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from hybridnav.ext.fleet import BuildingAlternatives


def is_building_file(path: Path) -> bool:
    """Return whether a file describes a building; most maps do not need the modules for it."""
    from hybridnav.ext.fleet.files.kind import is_building  # noqa: PLC0415 - on demand

    return is_building(path)


def preset_of_floors(reading: MapOptions) -> hn.Preset | None:
    """Return the preset with what overrides it, None if the building has its own."""
    if reading.preset is None and not reading.overrides:
        return None
    return read_settings(reading.preset, reading.overrides, None, None)


def load_floors(
    file: Path, reading: MapOptions, seconds: dict[str, float]
) -> hn.ext.fleet.Building:
    """Load a building as the options say."""
    preset = preset_of_floors(reading)
    with common.stage(f"reading {file}", seconds, "load"):
        return hn.ext.fleet.load_building(
            file, robot_radius_m=reading.robot_radius_m, preset=preset, max_cells=reading.max_cells
        )


def plan_over_floors(
    *,
    map_file: Path,
    start: Any,
    goal: Any,
    origin: str | None,
    to: str | None,
    via: Sequence[str] | None,
    at: str,
    alternatives: int,
    max_stretch: float | None,
    blocked: Sequence[str] | None,
    no_stairs: bool,
    profile: str | None,
    why: bool,
    plot: Path | None,
    language: str,
    as_json: bool,
    reading: MapOptions,
) -> None:
    """Plan a route over floors, print the answer, and draw it; see `hybridnav plan`."""
    # They load numpy, which help can do without.
    from hybridnav.ext.fleet.building import legs_of, tightest  # noqa: PLC0415

    common.check_picture(plot)
    how: dict[str, Any] = {"stairs": not no_stairs, "at": checked_at(at), "profile": profile}
    check_language(language)
    if max_stretch is not None and alternatives == 1:
        raise common.UsageError(
            "--max-stretch is for alternatives: add --alternatives N, or leave it out"
        )
    if via and alternatives > 1:
        raise common.UsageError("--alternatives does not go with --via")
    ends = _typed("start", start, "from", origin), _typed("goal", goal, "to", to)
    typed = [ends[0], *(via or ()), ends[1]]
    seconds: dict[str, float] = {}
    building = load_floors(map_file, reading, seconds)
    waypoints = [_endpoint(text, building) for text in typed]
    how["closed_links"], how["blocked"] = _closures(building, blocked or ())
    shut = [item.what for item in building.journal.items()] if building.journal else []
    others: BuildingAlternatives | None = None
    with common.stage("planning", {}, "plan"):
        if alternatives == 1:
            plans: Sequence[hn.ext.fleet.BuildingPlan] = legs_of(building, waypoints, how)
        else:
            how["max_stretch"] = 2.0 if max_stretch is None else max_stretch
            plans = others = building.alternatives(waypoints[0], waypoints[1], alternatives, **how)
    legs = plans if others is None else plans[:1]
    figures = _tour_figures(legs, waypoints, at, language) if via else legs[0].to_dict()
    figures |= {
        "building": str(map_file),
        "preset": _preset_of(building, plans[0]),
        "words": [line for leg in legs for line in leg.words(language)],
        "query": " via ".join(typed[:-1]) + f" to {typed[-1]}",
        "blocked": [printable(text) for text in [*(blocked or ()), *shut]] or None,
    }
    if not legs[-1].solved:
        figures["why"] |= {"words": list(legs[-1].reasons.get(language, ()))}
    elif why:
        figures["why"] = {"words": tightest(building, legs, how["blocked"], language)}
    if profile is not None:
        asks = next(one.described for one in building.profiles if one.name == profile)
        figures["asks"] = asks
    if others is not None:
        solved = [other for other in others if other.solved]
        figures["alternatives"] = [
            other.to_dict() | {"words": other.words(language)} for other in solved
        ]
        figures["alternatives_complete"] = others.complete
        figures["alternatives_note"] = others.note
    figures["seconds"] = seconds | figures["seconds"]
    whole = json.dumps(figures, allow_nan=False) + "\n" if as_json else None
    common.answer(whole or _summary(map_file, building, figures))
    if plot is not None:
        # They load matplotlib.
        from hybridnav.ext.fleet.plot import plot_building  # noqa: PLC0415
        from hybridnav.viz import save_figure  # noqa: PLC0415

        save_figure(plot_building(building, plans)[0], plot)
    if not legs[-1].solved:
        raise typer.Exit(common.EXIT_NOT_SOLVED)


def _tour_figures(
    legs: Sequence[hn.ext.fleet.BuildingPlan], waypoints: Sequence[Any], at: str, language: str
) -> dict[str, Any]:
    """Return the figures of a tour, with those of its legs.

    Bounds add up where no stop leaves a choice: else the tour has none, and each leg its own.
    """
    each = [leg.to_dict() | {"words": leg.words(language)} for leg in legs]
    solved = legs[-1].solved
    sums = ("length_m", "charge_m", "cost", "travel_s")
    figures = each[-1] | {name: sum(leg[name] for leg in each) if solved else None for name in sums}
    for name in ("floors", "rides", "results", "instructions"):
        figures[name] = [item for leg in each for item in leg[name]]
    is_fixed = at == "point" or not any(_is_name(stop) for stop in waypoints[1:-1])
    bound = sum(leg.lower_bound for leg in legs) if solved and is_fixed else None
    gap = None if bound is None else figures["cost"] / bound - 1 if bound else 0.0
    seconds: dict[str, float] = {}
    for leg in each:
        for stage, spent in leg["seconds"].items():
            seconds[stage] = seconds.get(stage, 0.0) + spent
    own = {"start": each[0]["start"], "legs": each, "seconds": seconds}
    return figures | own | {"lower_bound": bound, "gap": gap}


def _is_name(stop: Any) -> bool:
    return isinstance(stop, str) or isinstance(stop[1], str)


def _preset_of(building: hn.ext.fleet.Building, plan: hn.ext.fleet.BuildingPlan) -> str:
    """Return the name of the preset that a plan is by, which a profile may have chosen."""
    for result in plan.results:
        return str(result.settings["preset"])
    return building.floors[0].planner.preset.name


def _typed(option: str, point: Any, other: str, text: str | None) -> str:
    """Return the text of a start or a goal."""
    given = one_of(option, point, other, text)
    return given if isinstance(given, str) else ",".join(f"{number:g}" for number in given)


def _closures(
    building: hn.ext.fleet.Building, blocked: Sequence[str]
) -> tuple[list[str], dict[str, hn.Blocked]]:
    """Return the closed links, and what is closed on each floor."""
    # Loads numpy, which help can do without.
    from hybridnav.ext.fleet.links import ClosedLink  # noqa: PLC0415

    links: list[str] = []
    texts: dict[str, list[str]] = {}
    for text in blocked:
        kind, colon, rest = text.partition(":")
        if not colon or not rest.strip():
            raise common.UsageError(
                "--blocked must be link:NAME, link:NAME@FLOOR, or FLOOR: and a thing there, as "
                f"2:door:7, got {text!r:.80}"
            )
        if kind == "link":
            ClosedLink.of(rest, building.links)
            links.append(rest)
        else:
            texts.setdefault(building.floor(kind).name, []).append(rest)
    closed_on = {}
    for name, given in texts.items():
        grid = building.floor(name).planner.grid
        closed = parsed_closing(given).read(grid)
        if closed is not None:
            closed_on[name] = closed
    return links, closed_on


def _summary(file: Path, building: hn.ext.fleet.Building, figures: dict[str, Any]) -> str:
    """Return the lines that describe the answer to a person."""
    radius = f"robot radius {building.robot_radius_m:g} m"
    name = printable(file.name)
    lines = [f"query      {name}, {figures['query']}, {radius}"]
    lines += closing_lines(figures)
    if "profile" in figures:
        stated = {"name": figures["profile"], "asks": figures["asks"], "forbids": figures["note"]}
        lines += profile_lines(stated)
    lines += [preset_line(figures["preset"]), f"status     {figures['status']}"]
    for number, line in enumerate((figures["why"] or {"words": ()})["words"]):
        lines.append(f"{'' if number else 'why':<10} {line}")
    if figures["cost"] is not None:
        lines += _route_lines(figures)
    for number, line in enumerate(figures["words"]):
        lines.append(f"{'' if number else 'words':<10} {line}")
    for number, other in enumerate(figures.get("alternatives", ()), start=1):
        by = ", ".join(ride["link"] for ride in other["rides"]) or "no link"
        cost = f"cost {other['cost']:.2f} m, {other['travel_s']:.0f} s"
        lines.append(f"route {number:<4} {cost}, by {by}")
    if figures.get("alternatives_note"):
        lines.append(f"routes     {figures['alternatives_note']}")
    lines.append(f"seconds    {common.timings(figures['seconds'])}")
    return "\n".join(lines) + "\n"


def _route_lines(figures: dict[str, Any]) -> list[str]:
    """Describe a route: its length, its rides, its cost and its bound."""
    lines = [f"length     {figures['length_m']:.2f} m{in_metric(figures)}"]
    for number, ride in enumerate(figures["rides"]):
        floors = f"from floor {ride['from_floor']} to floor {ride['to_floor']}"
        worth = f"{ride['seconds']:.0f} s, charged {ride['charge_m']:.2f} m"
        lines.append(f"{'' if number else 'rides':<10} {ride['link']} {floors}, {worth}")
    cost = f"cost       {figures['cost']:.2f} m, {figures['travel_s']:.0f} s"
    for number, leg in enumerate(figures.get("legs", ()), start=1):
        on = rounded_bound(leg["lower_bound"], leg["cost"])[0]
        lines.append(f"leg {number:<6} cost {leg['cost']:.2f} m, bound {on} m")
    if figures["lower_bound"] is None:
        note = "none for the tour: each leg begins where the one before it ended"
        return [*lines, cost, f"bound      {note}"]
    bound, stated = rounded_bound(figures["lower_bound"], figures["cost"])
    stated = stated.replace("long", "dear")
    return [
        *lines,
        cost,
        f"bound      {bound} m, the route is {stated}",
    ]


def _endpoint(text: str, building: hn.ext.fleet.Building) -> Any:
    """Return the start or goal that a text names: `FLOOR:X,Y`, `FLOOR:NAME`, or a name."""
    floors = tuple(floor.name for floor in building.floors)
    # The longest name first: one floor may be called as another one with a colon.
    for name in sorted(floors, key=len, reverse=True):
        if text.startswith(f"{name}:"):
            rest = text[len(name) + 1 :]
            point = read_point(rest)
            if point is None:
                return name, rest
            if len(point) != 2 or not all(map(math.isfinite, point)):  # noqa: PLR2004
                raise common.UsageError(
                    f"expected FLOOR:X,Y, finite numbers of metres, got {text!r:.80}"
                )
            return name, point
    if read_point(text) is not None:
        raise common.UsageError(
            f"a point of a building needs its floor, as {floors[0]}:{text}, got {text!r:.80}"
        )
    floor, colon, _ = text.partition(":")
    if colon:
        place_of_name(floor, floors, "floor")
    return text


def close_over_floors(
    *,
    map_file: Path,
    close: Sequence[str] | None,
    open_again: Sequence[str] | None,
    why: str | None,
    as_json: bool,
    reading: MapOptions,
) -> None:
    """Close and open links, doors and rooms of a building; see `hybridnav closed`."""
    loaded: list[hn.ext.fleet.Building] = []

    def check(item: hn.OutOfOrder) -> None:
        """Refuse what is not in the building, which is read once."""
        loaded.append(loaded[0] if loaded else load_floors(map_file, reading, {}))
        from hybridnav.ext.fleet.checks import check_closing  # noqa: PLC0415 - loads numpy

        check_closing(item, loaded[0].floors, loaded[0].links)

    change_closed(map_file, close or (), open_again or (), why, check=check)
    list_closed(map_file, as_json=as_json)


def build_over_floors(
    *, map_file: Path, out: Path, preset: Sequence[str] | None, compress: bool, reading: MapOptions
) -> None:
    """Prepare a building for planning, write it to a model, and print a summary."""
    check_model(out)
    if len(preset or ()) > 1:
        raise common.UsageError("--preset is taken once for a building: its floors have one")
    seconds: dict[str, float] = {}
    reading = replace(reading, preset=preset[0] if preset else None)
    building = load_floors(map_file, reading, seconds)
    with (
        common.stage("preparing", seconds, "prepare"),
        common.progress_bar("preparing floors") as advance,
    ):
        building.prepare(progress=advance)
    with common.stage(f"writing {out}", seconds, "write"):
        hn.save(building, out, compress=compress)
    names = ", ".join(printable(floor.name) for floor in building.floors)
    links = ", ".join(printable(link.name) for link in building.links) or "none"
    lines = [
        f"model      {printable(out)}, {out.stat().st_size / 1e6:.2f} MB",
        f"floors     {len(building.floors)}: {names}",
        f"links      {len(building.links)}: {links}",
        f"robot      radius {building.robot_radius_m:g} m",
        f"seconds    {common.timings(seconds)}",
    ]
    common.answer("\n".join(lines) + "\n")
