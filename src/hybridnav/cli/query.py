"""What `hybridnav plan` is asked: its options, and the query that they state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import typer

import hybridnav as hn
from hybridnav._base.extension import extension
from hybridnav.cli import options
from hybridnav.cli.common import UsageError, check_new, check_output, check_picture
from hybridnav.cli.map_options import FloorOptions, MapOptions
from hybridnav.cli.options import Closing, Costs, OfBuilding, OneMap, option
from hybridnav.errors import brief
from hybridnav.guide.words import check_language, languages
from hybridnav.maps.names import read_point

if TYPE_CHECKING:
    from hybridnav.cli.rendering import Waypoint
    from hybridnav.planning.named import At

Point = tuple[float, ...]
_POSES = (".csv", ".json", ".geojson")
"""Endings of files of poses."""


def _point(text: str) -> Point | str:
    point = read_point(text)
    if point is None and ":" in text:
        return text  # of a building: FLOOR:X,Y
    if point is None:
        raise typer.BadParameter(f"expected X,Y in metres, or X,Y,YAW, got {brief(text)}")
    if not all(map(math.isfinite, point)):
        raise typer.BadParameter(
            f"expected finite numbers of metres and radians, got {brief(text)}"
        )
    return point


FromOption = Annotated[
    str | None,
    option("--from ROOM|X,Y", "Start in a room, or at a point; FLOOR:ROOM in a building."),
]
ToOption = Annotated[
    str | None, option("--to ROOM|X,Y", "Go to a room, or to a point; FLOOR:ROOM in a building.")
]
StartOption = Annotated[
    Any,
    option("X,Y[,YAW]", "Start in metres; YAW in radians; FLOOR:X,Y in a building.", parser=_point),
]
GoalOption = Annotated[
    Any,
    option("X,Y[,YAW]", "Goal in metres; YAW in radians; FLOOR:X,Y in a building.", parser=_point),
]
ViaOption = Annotated[
    list[str] | None, option("--via ROOM|X,Y", "Waypoint between start and goal; may be repeated.")
]
AtOption = Annotated[
    str, option("--at WHERE", "Where in a room: anywhere (the nearest cell), or its point.")
]
WithinOption = Annotated[
    float | None,
    option(
        "--within M",
        "If the goal cannot be reached, plan to the nearest point that can, at most so many "
        "metres from it.",
    ),
]
AlternativesOption = Annotated[
    int,
    option(
        "--alternatives N", "Up to N routes by other doors, the plain plan first.", min=1, max=20
    ),
]
OverlapOption = Annotated[
    float | None,
    option(
        "--max-overlap SHARE",
        "Share that an alternative may have in common with a shorter one.",
        min=0,
        max=1,
        show_default="0.8",
    ),
]
StretchOption = Annotated[
    float | None,
    option(
        "--max-stretch FACTOR",
        "Length of an alternative over that of the first, at most.",
        min=1,
        show_default="2.0",
    ),
]
LeaveZoneOption = Annotated[
    bool,
    option(
        "--leave-zone",
        "Let a start that --blocked or --costs close leave them by the shortest way.",
    ),
]
CompareOption = Annotated[
    bool, option("--compare", "Also plan on the whole grid; for octile paths print the loss.")
]
WhyOption = Annotated[
    bool, option("--why", "Also print the widest robot that could go, and where it is tightest.")
]
PosesOption = Annotated[
    Path | None,
    option(
        "--poses FILE",
        "Write poses every 5 cm: x, y in metres, yaw in radians, with limits speed and time; .csv "
        "or .json. Or the line: .geojson.",
    ),
]
BagOption = Annotated[
    Path | None,
    option(
        "--bag NAME",
        "Write path and map as a new bag of ROS: NAME.bag of ROS 1, else a folder of ROS 2.",
    ),
]
ProofOption = Annotated[
    Path | None,
    option(
        "--proof FILE",
        "Write a proof of the answer, .json, for hybridnav verify or check_proof.py.",
    ),
]
LanguageOption = Annotated[
    str, option("--language CODE", f"Language of the words: {', '.join(languages())}.")
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PlanOptions(FloorOptions):
    """The options of `hybridnav plan`."""

    origin: FromOption = None
    to: ToOption = None
    start: StartOption = None
    goal: GoalOption = None
    plot: options.PlotOption = None
    via: ViaOption = None
    at: AtOption = "anywhere"
    within_m: OneMap[WithinOption] = None
    alternatives: AlternativesOption = 1
    max_overlap: OneMap[OverlapOption] = None
    max_stretch: StretchOption = None
    blocked: options.BlockedOption = None
    one_way: options.OneWayOption = None
    leave_zone: OneMap[LeaveZoneOption] = False
    profile: options.ProfileOption = None
    no_stairs: OfBuilding[options.NoStairsOption] = False
    costs: OneMap[options.CostsOption] = None
    smooth: OneMap[options.SmoothOption] = None
    compare: OneMap[CompareOption] = False
    why: WhyOption = False
    poses: OneMap[PosesOption] = None
    bag: OneMap[BagOption] = None
    proof: OneMap[ProofOption] = None
    language: LanguageOption = "en"
    as_json: options.JsonOption = False
    rooms_file: OneMap[options.RoomsOption] = None

    PANELS: ClassVar = {
        "Typed first": ("origin", "to", "start", "goal", "plot"),
        "Ends and routes": ("via", "at", "within_m", "alternatives", "max_overlap", "max_stretch"),
        "What is closed": ("blocked", "one_way", "leave_zone", "profile", "no_stairs"),
        "Costs": ("costs", "smooth", "compare"),
        "Output": ("why", "poses", "bag", "proof", "language", "as_json", "help"),
        "Map": ("rooms_file", *MapOptions.PANELS["Map"]),
    }

    @property
    def shut(self) -> list[str]:
        """What the query closes, and lets pass one way, as `--blocked` takes it."""
        closing = list(self.blocked or ())
        for text in self.one_way or ():
            floor, colon, rest = text.partition(":") if self.is_building else ("", "", text)
            closing.append(text if floor == "link" else f"{floor}{colon}one-way:{rest}")
        return closing


@dataclass(frozen=True)
class TypedQuery:
    """What a command line asks of one map: a plan between two points, or a tour in rooms."""

    args: PlanOptions
    settings: hn.Preset
    costs: Costs
    closing: Closing
    waypoints: list[Waypoint]
    """The start, what lies between, the goal."""

    @classmethod
    def read(cls, args: PlanOptions) -> TypedQuery:
        """Read and check the options; refuse files that cannot be written."""
        _check_files(args)
        checked_at(args.at)
        costs = options.parsed_costs(args.costs)
        check_language(args.language)
        settings = args.settings(
            options.PRESET if costs else None, overrides=costs.overrides, smooth=args.smooth
        )
        texts = [*args.shut, *options.out_of_order(args.map_file)]
        closing = options.parsed_closing(texts)
        start = _end("start", args.start, "from", args.origin)
        goal = _end("goal", args.goal, "to", args.to)
        check_alternatives(args)
        query = cls(
            args, settings, costs, closing, [start, *map(_parsed_waypoint, args.via or ()), goal]
        )
        query.check_fits()
        return query

    @property
    def is_tour(self) -> bool:
        """Whether rooms are needed, for the plan itself or to describe it."""
        names_rooms = (
            any(isinstance(waypoint, str) for waypoint in self.waypoints)
            or self.closing.needs_rooms
            or self.args.profile is not None
        )
        is_plain = len(self.waypoints) == 2 and self.args.alternatives == 1  # noqa: PLR2004 - start and goal
        return names_rooms or not is_plain or self.args.rooms_file is not None

    def check_fits(self) -> None:
        """Refuse files of one path for several, and comparisons of tours."""
        args = self.args
        for name, file in {"poses": args.poses, "bag": args.bag, "proof": args.proof}.items():
            if file is not None and args.alternatives > 1:
                raise UsageError(
                    f"--{name} writes one path, and --alternatives asks for more: leave one out"
                )
        if args.proof is not None and args.via:
            raise UsageError("--proof is of a path without --via: leave one out")
        if args.within_m is not None and not args.within_m >= 0:
            raise UsageError(f"--within must be metres, 0 or more, got {args.within_m:g}")
        if self.is_tour and args.within_m is not None:
            raise UsageError("--within goes with --start and --goal alone, and files as --blocked")
        if args.leave_zone and (self.is_tour or args.within_m is not None or args.compare):
            raise UsageError(
                "--leave-zone goes with --start, --goal and files as --blocked, without --within "
                "and --compare: leave one out"
            )
        if self.is_tour and args.compare:
            raise UsageError("--compare goes with --start and --goal alone, and files as --blocked")


def _check_files(args: PlanOptions) -> None:
    """Refuse files that cannot be written."""
    check_picture(args.plot)
    check_output(args.poses, "--poses", _POSES)
    if args.bag is not None:
        check_new(args.bag, "--bag")
        extension("formats", "bag").check_rosbags("--bag")
    check_output(args.proof, "--proof", (".json",))


def check_alternatives(args: PlanOptions) -> None:
    """Refuse stops on alternatives, and their options without them."""
    if args.via and args.alternatives > 1:
        raise UsageError("--alternatives does not go with --via")
    for name, value in {"overlap": args.max_overlap, "stretch": args.max_stretch}.items():
        if value is not None and args.alternatives == 1:
            raise UsageError(
                f"--max-{name} is for alternatives: add --alternatives N, or leave it out"
            )


def one_of(name: str, point: Any, other: str, text: str | None) -> Point | str:
    """Return the start or the goal, from the one of its two options that was used."""
    if (point is None) == (text is None):
        what = "missing option" if point is None else "only one is taken, of"
        raise UsageError(f"{what} '--{name}' or '--{other}'; see hybridnav plan --help")
    return point if text is None else text


def _end(name: str, point: Any, other: str, text: str | None) -> Waypoint:
    """Return the start or the goal on a map."""
    end = one_of(name, point, other, text)
    if isinstance(point, str):
        raise UsageError(f"--{name}: expected X,Y in metres, or X,Y,YAW, got {point!r:.80}")
    return _parsed_waypoint(end) if isinstance(end, str) else end


def _parsed_waypoint(text: str) -> Waypoint:
    """Return a point if the text is two numbers, or three with a heading, else a name."""
    point = read_point(text)
    if point is None:
        return text
    if not all(map(math.isfinite, point)):
        raise UsageError(f"expected a name, or finite numbers X,Y or X,Y,YAW, got {text!r:.80}")
    return point


def checked_at(at: str) -> At:
    """Return the place in a room that is meant."""
    if at == "anywhere":
        return "anywhere"
    if at == "point":
        return "point"
    raise UsageError(f"--at must be anywhere or point, got {at!r:.80}")
