"""Arguments and options that several commands take, with what `--costs` and `--blocked` mean.

One declaration each: what a command makes of it stands in the command's own text.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

import hybridnav as hn
from hybridnav._base.extension import extension
from hybridnav._base.files import printable
from hybridnav.cli.common import UsageError
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.maps.names import read_point

if TYPE_CHECKING:
    from hybridnav.maps.costs.files import CostSpec

T = TypeVar("T")
"""What a command takes: one value or several, with a default or without."""
OneMap = Annotated[T, "one map"]
"""An option that means nothing for a building, which `check_options` refuses then."""
OfBuilding = Annotated[T, "a building"]
"""An option that means something for a building alone."""


def option(flags: str, text: str, **settings: Any) -> Any:
    """Return an option: `-o --out PATH`, names and what stands for a value, and its help."""
    words = flags.split(" ")
    names = [word for word in words if word.startswith("-")]
    value = " ".join(word for word in words if not word.startswith("-"))
    return typer.Option(*names, metavar=value or None, help=text, **settings)


MapArgument = Annotated[
    T, typer.Argument(metavar="MAP", help="ROS map (.yaml), MovingAI map (.map) or model (.hnm).")
]
MapOrBuildingArgument = Annotated[
    Path,
    typer.Argument(
        metavar="MAP",
        help="ROS map (.yaml), MovingAI map (.map) or model (.hnm), or a building of several "
        "floors (.yaml or .hnm).",
    ),
]
PresetOption = Annotated[
    T, option("--preset NAME|FILE", "A preset's name or its YAML file.", show_default="shortest")
]
SetOption = Annotated[
    list[str] | None, option("--set KEY=VALUE", "Override one key, e.g. planner.corridor=route.")
]
RadiusOption = Annotated[float | None, option("--robot-radius R", "Robot radius in metres.")]
SeedOption = Annotated[
    T,
    option(
        "--seed N",
        "Seed of random choices: pyramid, sampled pairs or noise; else the model's, the preset's "
        "or 0.",
    ),
]
OutOption = Annotated[T, option("-o --out PATH", "Where to write the result.")]
PlotOption = Annotated[Path | None, option("--plot FILE", "Draw a picture: .png, .pdf or .svg.")]
AnimationOption = Annotated[
    Path | None, option("--plot FILE", "Write an animation of places, rooms and doors: .gif.")
]
FramesOption = Annotated[int, option("--frames N", "Most frames of the animation.", min=2)]
JsonOption = Annotated[bool, option("--json", "Print one JSON object.")]
SmoothOption = Annotated[
    str | None,
    option(
        "--smooth HOW",
        "Shorten the path: none, line-of-sight, or by costs arcs; else the preset's.",
    ),
]
FreeOption = Annotated[
    float | None,
    option("--free-threshold P", "Occupancy up to which a cell is free; else the map's."),
]
OccupiedOption = Annotated[
    float | None,
    option("--occupied-threshold P", "Occupancy from which on a cell is occupied; else the map's."),
]
GraphFloorOption = Annotated[
    str | None,
    option(
        "--floor NAME",
        "Name of the floor in the graph's file: to read one of several, or to write it.",
    ),
]
NoStairsOption = Annotated[
    bool, option("--no-stairs", "For a building: the robot takes no stairs.")
]
ProfileOption = Annotated[
    str | None,
    option(
        "--profile NAME",
        "Who goes: visitor, staff, wheelchair, cart, or one of the building's file; heeds private "
        "rooms, costs of rooms, widths and stairs.",
    ),
]
ForceOption = Annotated[bool, option("--force", "Overwrite an existing file.")]
FrameOption = Annotated[T, option("--frame NAME", "Name of the map's frame in the file.")]
ResolutionOption = Annotated[
    T,
    option("--resolution R", "Side of a cell in metres, of the map of a log.", show_default="0.05"),
]
MergeDistanceOption = Annotated[T, option("--merge-distance U", "Size of places, U_d, in metres.")]
RegionsOption = Annotated[
    int | None, option("--regions N", "Also regions above places, of at most N cells.", min=1)
]
LeastIslandOption = Annotated[
    float,
    option(
        "--least-island A",
        "Leave out islands of free or unexplored cells below A square metres.",
        min=0,
    ),
]
MaxCellsOption = Annotated[
    int, option("--max-cells N", "The most cells that a map may have.", min=1)
]
RoomsOption = Annotated[
    Path | None, option("--rooms FILE", "Rooms as YAML, in place of a model's or of found ones.")
]

# The option `--costs`: clearance, and masks of Nav2.


CostsOption = Annotated[
    list[str] | None,
    option(
        "--costs WHAT",
        "Plan the cheapest path, by clearance[:KEY=VALUE,...], speed:FILE[,KEY=VALUE,...] or "
        "keepout:FILE[,KEY=VALUE,...] (masks of Nav2); may be repeated.",
    ),
]

PRESET = "robot"
"""The preset that plans by costs unless another is named."""


@dataclass(frozen=True)
class Costs:
    """What a command line states about costs."""

    overrides: tuple[str, ...] = ()
    """Settings of the preset."""
    masks: tuple[CostSpec, ...] = ()
    """Masks."""

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self.overrides or self.masks)

    def read(self, grid: hn.OccupancyGrid) -> hn.CostLayer | None:
        """Read the masks, on the cells of a map; None for no masks."""
        layers = [mask.layer(grid) for mask in self.masks]
        return reduce(or_, layers) if layers else None


def parsed_costs(specs: list[str] | None) -> Costs:
    """Return what the options `--costs` state.

    Raises `UsageError` when one of them has another form.
    """
    from hybridnav.maps.costs.files import parse_costs  # noqa: PLC0415 - loads numpy

    try:
        parsed = parse_costs(specs or ())
    except InvalidValueError as error:
        raise UsageError(f"--{error}") from None
    overrides: list[str] = []
    for spec in parsed:
        if spec.kind == "clearance":
            overrides.append("planner.costs.clearance={}")
            overrides += [
                f"planner.costs.clearance.{key}={spec.settings[key]!r}" for key in spec.settings
            ]
    return Costs(tuple(overrides), tuple(spec for spec in parsed if spec.kind != "clearance"))


# The option `--blocked`: closed doors and rooms, obstacles and keepout zones.


BlockedOption = Annotated[
    list[str] | None,
    option(
        "--blocked WHAT",
        "Close door:N, room:NAME, or the areas of a GeoJSON FILE or mask: obstacles, off which "
        "the robot keeps its radius. keepout:FILE[,x=X,y=Y,yaw=A] keeps out its centre alone, as "
        "Nav2 takes its masks. May be repeated.",
    ),
]
OneWayOption = Annotated[
    list[str] | None,
    option(
        "--one-way WHAT",
        "Pass in one direction alone: door:N=ROOM into that room, line:X,Y:X,Y from its left to "
        "its right, link:NAME=up, or the one-way edges of a graph:FILE. May be repeated.",
    ),
]


_KINDS = frozenset({"door", "room", "keepout", "one-way"})


def out_of_order(map_file: Path) -> list[str]:
    """Return what the journal beside a map closes, as `--blocked` takes it.

    Raises `MapError` when the journal cannot be read, or is that of a building.
    """
    if not map_file.with_name(f"{map_file.stem}.closed.yaml").exists():
        return []
    from hybridnav.closures import Journal  # noqa: PLC0415 - loads shapely

    journal = Journal(map_file)
    for item in journal.items():
        if item.link is not None or item.floor is not None:
            where = f"closed {printable(journal.path)}"
            raise MapError(f"{where}: {item.what} is of a building, and this is one map: open it")
    return [item.what for item in journal.items()]


@dataclass(frozen=True)
class Closing:
    """The closures of a command line."""

    texts: tuple[str, ...] = ()
    """As they were typed, printable."""
    doors: tuple[int, ...] = ()
    rooms: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    masks: tuple[CostSpec, ...] = ()
    """Files of zones for the centre of the robot."""
    one_way: tuple[hn.OneWayRule, ...] = ()
    """What is passed in one direction alone."""
    graphs: tuple[Path, ...] = ()
    """Files of graphs whose one-way edges are passed so."""

    @property
    def needs_rooms(self) -> bool:
        """Whether the closures make sense only on a map with rooms."""
        return bool(self.doors or self.rooms) or any(rule.door for rule in self.one_way)

    def to_dict(self) -> dict[str, Any]:
        """Return the closures as plain values for JSON: null for none."""
        return {"blocked": list(self.texts) or None}

    def read(self, grid: hn.OccupancyGrid) -> hn.Blocked | None:
        """Read the files and join all closures; return None for none."""
        if not self.texts:
            return None
        # They load shapely.
        from hybridnav.closures import Blocked, OneWay, load_blocked  # noqa: PLC0415

        rules = list(self.one_way)
        for file in self.graphs:
            from hybridnav.graphs import one_way_rules  # noqa: PLC0415 - loads numba

            rules += one_way_rules(extension("formats", "graph").load_graph(file), grid)
        one_way = OneWay.of(rules) if rules else None
        closed = Blocked(doors=self.doors, rooms=self.rooms, one_way=one_way)
        named = {printable(path): load_blocked(path, grid) for path in self.files}
        for mask in self.masks:
            name = f"keepout: {printable(mask.file)}"
            own = Blocked(named={name: load_blocked(mask.file, grid, keepout=True, pose=mask.pose)})
            closed |= own
        return closed | Blocked(named=named)


def parsed_point(text: str, flag: str) -> tuple[float, float]:
    """Return the point that an option states as X,Y.

    Raises `UsageError` when it is none.
    """
    point = read_point(text)
    if point is None or len(point) != 2 or not all(map(math.isfinite, point)):  # noqa: PLR2004
        raise UsageError(f"{flag} must be two finite numbers X,Y in metres, got {text!r:.80}")
    return point[0], point[1]


def closing_lines(figures: dict[str, Any]) -> list[str]:
    """Return the line of a summary about closures, if there are any."""
    closed = figures.get("blocked")
    return [f"blocked    {', '.join(closed)}"] if closed else []


def profile_lines(stated: dict[str, str] | None) -> list[str]:
    """Return the lines of a summary about a profile, and about what it forbids."""
    if stated is None:
        return []
    why = stated.get("forbids")
    return [
        f"profile    {stated['name']}: {stated['asks']}",
        *([f"reason     {why}"] if why else []),
    ]


def parsed_closing(texts: list[str] | None) -> Closing:
    """Read the values of the option.

    Raises `UsageError` when a door has no number, a room or a file no name, or a mask other
    settings.
    """
    doors, rooms, files, masks, rules, graphs = [], [], [], [], [], []
    for text in texts or ():
        kind, colon, name = text.partition(":")
        if not text or (colon and kind in _KINDS and not name.strip()):
            kinds = "door:N, room:NAME, keepout:FILE, one-way:RULE"
            raise UsageError(f"--blocked must be {kinds} or a file, got {text!r:.80}")
        if colon and kind == "door":
            doors.append(_number(name))
        elif colon and kind == "room":
            rooms.append(name)
        elif colon and kind == "keepout":
            masks.append(_mask(text))
        elif colon and kind == "one-way" and name.startswith("graph:"):
            graphs.append(Path(name.removeprefix("graph:")))
        elif colon and kind == "one-way":
            rules.append(_rule(name))
        else:
            files.append(Path(text))
    typed = tuple(map(printable, texts or ()))
    given = tuple(doors), tuple(rooms), tuple(files), tuple(masks), tuple(rules), tuple(graphs)
    return Closing(typed, *given)


def _rule(text: str) -> hn.OneWayRule:
    from hybridnav.maps import OneWayRule  # noqa: PLC0415 - loads numpy

    try:
        return OneWayRule.of(text)
    except InvalidValueError as error:
        raise UsageError(f"--one-way: {error}") from None


def _mask(text: str) -> CostSpec:
    from hybridnav.maps.costs.files import parse_costs  # noqa: PLC0415 - loads numpy

    try:
        (mask,) = parse_costs([text])
    except InvalidValueError as error:
        raise UsageError(f"--blocked: {str(error).removeprefix('costs ')}") from None
    if "multiplier" in mask.settings:
        raise UsageError(
            "--blocked keepout takes x, y and yaw, as closed cells have no cost, got multiplier: "
            "leave it out, or plan by --costs"
        )
    return mask


def _number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise UsageError(
            f"--blocked door: expected the number of a door, as hybridnav rooms MAP --plot draws "
            f"it, got {text!r:.80}"
        ) from None
