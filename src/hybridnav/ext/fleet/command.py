"""`hybridnav plan` and `hybridnav build` for a building of several floors."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli import common
from hybridnav.cli.map_options import FloorOptions, MapOptions
from hybridnav.cli.options import closing_lines, parsed_closing, profile_lines
from hybridnav.cli.query import PlanOptions, check_alternatives, checked_at, one_of
from hybridnav.cli.reading import check_model, read_settings
from hybridnav.cli.rendering import in_metric, preset_line
from hybridnav.ext.fleet.files.kind import is_building as is_building  # noqa: PLC0414 - for `cli`
from hybridnav.guide.words import check_language
from hybridnav.maps.names import place_of_name, read_point
from hybridnav.planning.text import rounded_bound

if TYPE_CHECKING:
    from hybridnav.cli.build import BuildOptions
    from hybridnav.ext.fleet import BuildingAlternatives


def load_floors(args: MapOptions, seconds: dict[str, float]) -> hn.ext.fleet.Building:
    """Load a building as the options say."""
    with common.stage(f"reading {args.map_file}", seconds, "load"):
        return hn.ext.fleet.load_building(
            args.map_file,
            robot_radius_m=args.robot_radius_m,
            preset=preset_of_floors(args),
            max_cells=args.max_cells,
        )


def preset_of_floors(args: MapOptions) -> hn.Preset | None:
    """Return the preset with what overrides it, None if the building has its own."""
    if args.preset is None and not args.overrides:
        return None
    return read_settings(args.preset, args.overrides, None, None)


def plan_over_floors(args: PlanOptions) -> None:
    """Plan a route over floors, print the answer, and draw it; see `hybridnav plan`."""
    # They load numpy, which help can do without.
    from hybridnav.ext.fleet.building import legs_of  # noqa: PLC0415

    common.check_picture(args.plot)
    at = checked_at(args.at)
    check_language(args.language)
    check_alternatives(args)
    start = one_of("start", args.start, "from", args.origin)
    typed = [_typed(start), *(args.via or ()), _typed(one_of("goal", args.goal, "to", args.to))]
    seconds: dict[str, float] = {}
    building = load_floors(args, seconds)
    waypoints = [_endpoint(text, building) for text in typed]
    links, blocked = _closures(building, args.shut)
    how: dict[str, Any] = {"stairs": not args.no_stairs, "at": at, "profile": args.profile}
    how |= {"closed_links": links, "blocked": blocked}
    routes: BuildingAlternatives | None = None
    with common.stage("planning", {}, "plan"):
        if args.alternatives == 1:
            plans: Sequence[hn.ext.fleet.BuildingPlan] = legs_of(building, waypoints, how)
        else:
            how["max_stretch"] = 2.0 if args.max_stretch is None else args.max_stretch
            plans = routes = building.alternatives(
                waypoints[0], waypoints[-1], args.alternatives, **how
            )
    legs = plans if routes is None else plans[:1]
    figures = _plan_figures(args, building, legs, waypoints, typed)
    figures |= _reasons(args, building, legs, blocked) | _alternatives_figures(args, routes)
    figures["seconds"] = seconds | figures["seconds"]
    text = json.dumps(figures, allow_nan=False) + "\n" if args.as_json else None
    common.answer(text or _summary(args.map_file, building, figures))
    if args.plot is not None:
        # They load matplotlib.
        from hybridnav.ext.fleet.plot import plot_building  # noqa: PLC0415
        from hybridnav.viz import save_figure  # noqa: PLC0415

        save_figure(plot_building(building, plans)[0], args.plot)
    if not legs[-1].solved:
        raise typer.Exit(common.EXIT_NOT_SOLVED)


def _plan_figures(
    args: PlanOptions,
    building: hn.ext.fleet.Building,
    legs: Sequence[hn.ext.fleet.BuildingPlan],
    waypoints: Sequence[Any],
    typed: list[str],
) -> dict[str, Any]:
    figures = _tour_figures(legs, waypoints, args) if args.via else legs[0].to_dict()
    shut = [item.what for item in building.journal.items()] if building.journal else []
    # A profile may have chosen another preset than that of the building.
    chosen = [result.settings["preset"] for result in legs[0].results]
    return figures | {
        "building": str(args.map_file),
        "preset": str((chosen or [building.floors[0].planner.preset.name])[0]),
        "words": [line for leg in legs for line in leg.words(args.language)],
        "query": " via ".join(typed[:-1]) + f" to {typed[-1]}",
        "blocked": [printable(text) for text in [*args.shut, *shut]] or None,
    }


def _reasons(
    args: PlanOptions,
    building: hn.ext.fleet.Building,
    legs: Sequence[hn.ext.fleet.BuildingPlan],
    blocked: dict[str, hn.Blocked],
) -> dict[str, Any]:
    """Return why there is no path or, if asked, where it is tightest; and what a profile asks."""
    # Loads numpy, which help can do without.
    from hybridnav.ext.fleet.building import tightest  # noqa: PLC0415

    reasons: dict[str, Any] = {}
    if not legs[-1].solved:
        words = list(legs[-1].reasons.get(args.language, ()))
        reasons["why"] = legs[-1].to_dict()["why"] | {"words": words}
    elif args.why:
        reasons["why"] = {"words": tightest(building, legs, blocked, args.language)}
    for profile in building.profiles:
        if profile.name == args.profile:
            reasons["asks"] = profile.described
    return reasons


def _alternatives_figures(args: PlanOptions, routes: BuildingAlternatives | None) -> dict[str, Any]:
    if routes is None:
        return {}
    return {
        "alternatives": [
            route.to_dict() | {"words": route.words(args.language)}
            for route in routes
            if route.solved
        ],
        "alternatives_complete": routes.complete,
        "alternatives_note": routes.note,
    }


def _tour_figures(
    legs: Sequence[hn.ext.fleet.BuildingPlan], waypoints: Sequence[Any], args: PlanOptions
) -> dict[str, Any]:
    """Return the figures of a tour, with those of its legs.

    Bounds add up where no stop leaves a choice: else the tour has none, and each leg its own.
    """
    each = [leg.to_dict() | {"words": leg.words(args.language)} for leg in legs]
    solved = legs[-1].solved
    sums = ("length_m", "charge_m", "cost", "travel_s")
    figures = each[-1] | {name: sum(leg[name] for leg in each) if solved else None for name in sums}
    for name in ("floors", "rides", "results", "instructions"):
        figures[name] = [item for leg in each for item in leg[name]]
    named = any(isinstance(stop, str) or isinstance(stop[1], str) for stop in waypoints[1:-1])
    is_fixed = args.at == "point" or not named
    bound = sum(leg.lower_bound for leg in legs) if solved and is_fixed else None
    gap = None if bound is None else figures["cost"] / bound - 1 if bound else 0.0
    seconds: dict[str, float] = {}
    for leg in each:
        for stage, spent in leg["seconds"].items():
            seconds[stage] = seconds.get(stage, 0.0) + spent
    own = {"start": each[0]["start"], "legs": each, "seconds": seconds}
    return figures | own | {"lower_bound": bound, "gap": gap}


def _typed(end: str | tuple[float, ...]) -> str:
    """Return the text of a start or a goal."""
    return end if isinstance(end, str) else ",".join(f"{number:g}" for number in end)


def _closures(
    building: hn.ext.fleet.Building, blocked: Sequence[str]
) -> tuple[list[str], dict[str, hn.Blocked]]:
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
    for name, things in texts.items():
        grid = building.floor(name).planner.grid
        closed = parsed_closing(things).read(grid)
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
    return [*lines, cost, f"bound      {bound} m, the route is {stated}"]


def _endpoint(text: str, building: hn.ext.fleet.Building) -> Any:
    """Return the start or goal that a text names: `FLOOR:X,Y`, `FLOOR:NAME`, or a name."""
    floors = tuple(floor.name for floor in building.floors)
    # The longest name first: one floor may be called as another one with a colon.
    for name in sorted(floors, key=len, reverse=True):
        if text.startswith(f"{name}:"):
            rest = text[len(name) + 1 :].strip()
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


def check_closing_over_floors(args: FloorOptions, items: Sequence[hn.OutOfOrder]) -> None:
    """Refuse things that are not in a building; see `hybridnav closed`."""
    from hybridnav.ext.fleet.checks import check_closing  # noqa: PLC0415 - loads numpy

    building = load_floors(args, {})
    for item in items:
        check_closing(item, building.floors, building.links)


def build_over_floors(args: BuildOptions) -> None:
    """Prepare a building for planning, write it to a model, and print a summary."""
    out = args.out
    check_model(out)
    seconds: dict[str, float] = {}
    building = load_floors(args, seconds)
    with (
        common.stage("preparing", seconds, "prepare"),
        common.progress_bar("preparing floors") as advance,
    ):
        building.prepare(progress=advance)
    with common.stage(f"writing {out}", seconds, "write"):
        hn.save(building, out, compress=args.compress)
    names = ", ".join(printable(floor.name) for floor in building.floors)
    links = ", ".join(printable(link.label) for link in building.links) or "none"
    lines = [
        f"model      {printable(out)}, {out.stat().st_size / 1e6:.2f} MB",
        f"floors     {len(building.floors)}: {names}",
        f"links      {len(building.links)}: {links}",
        f"robot      radius {building.robot_radius_m:g} m",
        f"seconds    {common.timings(seconds)}",
    ]
    common.answer("\n".join(lines) + "\n")
