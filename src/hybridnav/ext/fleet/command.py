"""`hybridnav plan` and `hybridnav build` for a building of several floors."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli.blocked import parsed_closing
from hybridnav.cli.common import answer, progress_bar, stage, timings
from hybridnav.cli.errors import UsageError
from hybridnav.cli.reading import load_numba, read_settings
from hybridnav.cli.rendering import in_metric, rounded_bound
from hybridnav.maps.names import place_of_name, read_point
from hybridnav.planner.guide import check_language

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from pathlib import Path

    from hybridnav.ext.fleet import BuildingAlternatives
    from hybridnav.planner.named import At

PLAN_OPTIONS = frozenset(
    {
        *("map_file", "start", "goal", "origin", "to", "at", "alternatives", "max_stretch"),
        *("blocked", "no_stairs", "preset", "overrides", "robot_radius_m", "max_cells"),
        *("plot", "language", "as_json"),
    }
)
"""Parameters of `hybridnav plan` that mean something for a building."""
BUILD_OPTIONS = frozenset(
    {"map_file", "out", "preset", "overrides", "robot_radius_m", "max_cells", "compress"}
)
"""Those of `hybridnav build`."""


def is_building_file(path: Path) -> bool:
    """Return whether a file describes a building; most maps do not need the modules for it."""
    from hybridnav.ext.fleet.files.kind import is_building  # noqa: PLC0415 - on demand

    return is_building(path)


def refused_options(ctx: Any, known: Collection[str]) -> list[str]:
    """Return the options that were given and mean nothing for a building.

    Parameters
    ----------
    ctx
        The context of the command.
    known
        Names of its parameters that are taken.
    """
    found = []
    for parameter in ctx.command.params:
        source = ctx.get_parameter_source(parameter.name)
        if parameter.name not in known and source is not None and source.name != "DEFAULT":
            found.append(max(parameter.opts, key=len))
    return found


def check_options(refused: Sequence[str]) -> None:
    """Refuse options that mean nothing for a building."""
    if refused:
        raise UsageError(f"{refused[0]} is for one map, and this is a building: leave it out")


def plan_in_building(given: Mapping[str, Any], at: At, refused: Sequence[str]) -> bool:
    """Plan a route over floors, and return whether there is one.

    Parameters
    ----------
    given
        The values of the parameters of `hybridnav plan` by their names.
    at
        Where in a room the path starts or ends.
    refused
        Options that were given and mean nothing here.
    """
    check_options(refused)
    check_language(given["language"])
    if given["max_stretch"] is not None and given["alternatives"] == 1:
        raise UsageError("--max-stretch is for alternatives: add --alternatives N, or leave it out")
    request = BuildingRequest(
        source=BuildingSource.of(given),
        waypoints=(
            _typed("start", given["start"], "from", given["origin"]),
            _typed("goal", given["goal"], "to", given["to"]),
        ),
        at=at,
        blocked=given["blocked"] or (),
        stairs=not given["no_stairs"],
        count=given["alternatives"],
        max_stretch=given["max_stretch"],
        plot=given["plot"],
        language=given["language"],
        as_json=given["as_json"],
    )
    return request.run()


def _typed(option: str, point: Any, other: str, text: str | None) -> str:
    """Return the text of a start or a goal, from the one of its two options that was used."""
    if (point is None) == (text is None):
        what = "missing option" if point is None else "only one is taken, of"
        raise UsageError(f"{what} '--{option}' or '--{other}'; see hybridnav plan --help")
    if text is not None:
        return text
    return point if isinstance(point, str) else ",".join(f"{number:g}" for number in point)


@dataclass(frozen=True)
class BuildingSource:
    """A building, and how it is read."""

    file: Path
    preset: str | None
    overrides: Sequence[str]
    robot_radius_m: float | None
    max_cells: int

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Self:
        """Return the building that the parameters of a command name."""
        preset = given["preset"]
        if isinstance(preset, list | tuple):
            if len(preset) > 1:
                raise UsageError("--preset is taken once for a building: its floors have one")
            preset = preset[0] if preset else None
        return cls(
            given["map_file"],
            preset,
            given["overrides"] or (),
            given["robot_radius_m"],
            given["max_cells"],
        )

    @property
    def settings(self) -> hn.Preset | None:
        """The preset with what overrides it, None if the building has its own."""
        if self.preset is None and not self.overrides:
            return None
        return read_settings(self.preset, list(self.overrides), None, None)

    def load(self, seconds: dict[str, float]) -> hn.Building:
        """Load it."""
        preset = self.settings
        load_numba()
        with stage(f"reading {self.file}", seconds, "load"):
            return hn.load_building(
                self.file,
                robot_radius_m=self.robot_radius_m,
                preset=preset,
                max_cells=self.max_cells,
            )


@dataclass(frozen=True)
class BuildingRequest:
    """What a command line asks of a building."""

    source: BuildingSource
    waypoints: tuple[str, str]
    """Start and goal as they were typed."""
    at: At
    blocked: Sequence[str]
    stairs: bool
    count: int
    max_stretch: float | None
    plot: Path | None
    language: str
    as_json: bool

    def run(self) -> bool:
        """Plan, print the answer, draw it, and return whether there is a route."""
        seconds: dict[str, float] = {}
        building = self.source.load(seconds)
        start, goal = (_endpoint(text, building) for text in self.waypoints)
        closed_links, blocked = self._closures(building)
        how: dict[str, Any] = {
            "blocked": blocked,
            "closed_links": closed_links,
            "stairs": self.stairs,
            "at": self.at,
        }
        spent: dict[str, float] = {}
        with stage("planning", spent, "plan"):
            if self.count == 1:
                plans: Sequence[hn.BuildingPlan] = (building.plan(start, goal, **how),)
                others = None
            else:
                stretch = 2.0 if self.max_stretch is None else self.max_stretch
                others = building.alternatives(start, goal, self.count, max_stretch=stretch, **how)
                plans = others
        figures = self._figures(plans[0], others)
        figures["seconds"] = seconds | figures["seconds"]
        whole = json.dumps(figures, allow_nan=False) + "\n" if self.as_json else None
        answer(whole or self._summary(building, figures))
        if self.plot is not None:
            # They load matplotlib.
            from hybridnav.ext.fleet.plot import plot_building  # noqa: PLC0415
            from hybridnav.viz import save_figure  # noqa: PLC0415

            save_figure(plot_building(building, plans)[0], self.plot)
        return plans[0].solved

    def _closures(self, building: hn.Building) -> tuple[list[str], dict[str, hn.Blocked]]:
        """Return the closed links, and what is closed on each floor."""
        links: list[str] = []
        texts: dict[str, list[str]] = {}
        for text in self.blocked:
            kind, colon, rest = text.partition(":")
            if not colon or not rest.strip():
                raise UsageError(
                    "--blocked must be link:NAME, or FLOOR: and what is closed there, as 2:door:7, "
                    f"got {text!r:.80}"
                )
            if kind == "link":
                links.append(building.link(rest).name)
            else:
                texts.setdefault(building.floor(kind).name, []).append(rest)
        blocked = {}
        for name, given in texts.items():
            grid = building.floor(name).planner.topology.grid
            closed = parsed_closing(given).read(grid)
            if closed is not None:
                blocked[name] = closed
        return links, blocked

    def _figures(
        self, plan: hn.BuildingPlan, others: BuildingAlternatives | None
    ) -> dict[str, Any]:
        """Return the figures of the first plan, and those of all if more were asked for."""
        figures = plan.to_dict() | {
            "building": str(self.source.file),
            "words": plan.words(self.language),
            "query": f"{self.waypoints[0]} to {self.waypoints[1]}",
            "blocked": [printable(text) for text in self.blocked] or None,
        }
        if others is not None:
            solved = [other for other in others if other.solved]
            figures["alternatives"] = [
                other.to_dict() | {"words": other.words(self.language)} for other in solved
            ]
            figures["alternatives_complete"] = others.complete
            figures["alternatives_note"] = others.note
        return figures

    def _summary(self, building: hn.Building, figures: dict[str, Any]) -> str:
        """Return the lines that describe the answer to a person."""
        radius = f"robot radius {building.robot_radius_m:g} m"
        name = printable(self.source.file.name)
        lines = [f"query      {name}, {figures['query']}, {radius}"]
        if figures["blocked"]:
            lines.append(f"blocked    {', '.join(figures['blocked'])}")
        lines.append(f"status     {figures['status']}")
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
        lines.append(f"seconds    {timings(figures['seconds'])}")
        return "\n".join(lines) + "\n"


def _route_lines(figures: dict[str, Any]) -> list[str]:
    """Describe a route: its length, its rides, its cost and its bound."""
    lines = [f"length     {figures['length_m']:.2f} m{in_metric(figures)}"]
    for number, ride in enumerate(figures["rides"]):
        floors = f"from floor {ride['from_floor']} to floor {ride['to_floor']}"
        worth = f"{ride['seconds']:.0f} s, charged {ride['charge_m']:.2f} m"
        lines.append(f"{'' if number else 'rides':<10} {ride['link']} {floors}, {worth}")
    bound, stated = rounded_bound(figures["lower_bound"], figures["gap"])
    stated = stated.replace("long", "dear")
    return [
        *lines,
        f"cost       {figures['cost']:.2f} m, {figures['travel_s']:.0f} s",
        f"bound      {bound} m, the route is {stated}",
    ]


def _endpoint(text: str, building: hn.Building) -> Any:
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
                raise UsageError(f"expected FLOOR:X,Y, finite numbers of metres, got {text!r:.80}")
            return name, point
    if read_point(text) is not None:
        raise UsageError(
            f"a point of a building needs its floor, as {floors[0]}:{text}, got {text!r:.80}"
        )
    floor, colon, _ = text.partition(":")
    if colon:
        place_of_name(floor, floors, "floor")
    return text


def build_building(source: BuildingSource, out: Path, *, compress: bool) -> None:
    """Prepare a building for planning, write it to a model, and print a summary.

    Parameters
    ----------
    source
        The building.
    out
        The file.
    compress
        Whether the maps are deflated.
    """
    seconds: dict[str, float] = {}
    building = source.load(seconds)
    with stage("preparing", seconds, "prepare"), progress_bar("preparing floors") as advance:
        building.prepare(progress=advance)
    with stage(f"writing {out}", seconds, "write"):
        hn.save(building, out, compress=compress)
    names = ", ".join(printable(floor.name) for floor in building.floors)
    links = ", ".join(printable(link.name) for link in building.links) or "none"
    lines = [
        f"model      {printable(out)}, {out.stat().st_size / 1e6:.2f} MB",
        f"floors     {len(building.floors)}: {names}",
        f"links      {len(building.links)}: {links}",
        f"robot      radius {building.robot_radius_m:g} m",
        f"seconds    {timings(seconds)}",
    ]
    answer("\n".join(lines) + "\n")
