"""`hybridnav plan`: from a map file to a route."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hybridnav._base.extension import extension
from hybridnav.cli import options
from hybridnav.cli.common import EXIT_NOT_SOLVED, UsageError, check_new, check_output, check_picture
from hybridnav.cli.reading import MapOptions, with_map
from hybridnav.cli.request import (
    AlternativesOption,
    OverlapOption,
    Request,
    StretchOption,
    wanted_of,
)
from hybridnav.errors import brief
from hybridnav.guide.words import check_language, languages
from hybridnav.maps.names import read_point

if TYPE_CHECKING:
    from hybridnav.cli.rendering import Waypoint
    from hybridnav.planning.named import At

Point = tuple[float, ...]


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


StartOption = Annotated[
    Any,
    typer.Option(
        metavar="X,Y[,YAW]",
        parser=_point,
        help="Start in metres; YAW in radians; FLOOR:X,Y in a building.",
    ),
]
GoalOption = Annotated[
    Any,
    typer.Option(
        metavar="X,Y[,YAW]",
        parser=_point,
        help="Goal in metres; YAW in radians; FLOOR:X,Y in a building.",
    ),
]
FromOption = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="ROOM|X,Y",
        help="Start in a room, or at a point; FLOOR:ROOM in a building.",
    ),
]
ToOption = Annotated[
    str | None,
    typer.Option(
        "--to", metavar="ROOM|X,Y", help="Go to a room, or to a point; FLOOR:ROOM in a building."
    ),
]
ViaOption = Annotated[
    list[str] | None,
    typer.Option(
        "--via", metavar="ROOM|X,Y", help="Waypoint between start and goal; may be repeated."
    ),
]
AtOption = Annotated[
    str,
    typer.Option(
        "--at", metavar="WHERE", help="Where in a room: anywhere (the nearest cell), or its point."
    ),
]
_POSES = (".csv", ".json", ".geojson")
"""Endings of files of poses."""
LanguageOption = Annotated[
    str,
    typer.Option(
        "--language", metavar="CODE", help=f"Language of the words: {', '.join(languages())}."
    ),
]
PosesOption = Annotated[
    Path | None,
    typer.Option(
        "--poses",
        metavar="FILE",
        help="Write poses every 5 cm: x, y in metres, yaw in radians, with limits speed and time; "
        ".csv or .json. Or the line: .geojson.",
    ),
]
BagOption = Annotated[
    Path | None,
    typer.Option(
        "--bag",
        metavar="NAME",
        help="Write path and map as a new bag of ROS: NAME.bag of ROS 1, else a folder of ROS 2.",
    ),
]
ProofOption = Annotated[
    Path | None,
    typer.Option(
        "--proof",
        metavar="FILE",
        help="Write a proof of the answer, .json, for hybridnav verify or check_proof.py.",
    ),
]
CompareOption = Annotated[
    bool,
    typer.Option("--compare", help="Also plan on the whole grid; for octile paths print the loss."),
]
WhyOption = Annotated[
    bool,
    typer.Option(
        "--why", help="Also print the widest robot that could go, and where it is tightest."
    ),
]

WithinOption = Annotated[
    float | None,
    typer.Option(
        "--within",
        metavar="M",
        help="If the goal cannot be reached, plan to the nearest point that can, at most so many "
        "metres from it.",
    ),
]
LeaveZoneOption = Annotated[
    bool,
    typer.Option(
        "--leave-zone",
        help="Let a start that --blocked or --costs close leave them by the shortest way.",
    ),
]


@with_map(
    before="compare",
    over_floors=lambda: extension("formats", "building").plan_over_floors,
    alone=("no_stairs",),
)
def plan(
    map_file: options.MapOrBuildingArgument,
    start: StartOption = None,
    goal: GoalOption = None,
    origin: FromOption = None,
    to: ToOption = None,
    via: ViaOption = None,
    at: AtOption = "anywhere",
    within: WithinOption = None,
    leave_zone: LeaveZoneOption = False,
    rooms_file: options.RoomsOption = None,
    alternatives: AlternativesOption = 1,
    max_overlap: OverlapOption = None,
    max_stretch: StretchOption = None,
    blocked: options.BlockedOption = None,
    no_stairs: options.NoStairsOption = False,
    profile: options.ProfileOption = None,
    costs: options.CostsOption = None,
    smooth: options.SmoothOption = None,
    compare: CompareOption = False,
    why: WhyOption = False,
    plot: options.PlotOption = None,
    poses: PosesOption = None,
    bag: BagOption = None,
    proof: ProofOption = None,
    language: LanguageOption = "en",
    as_json: options.JsonOption = False,
    *,
    reading: MapOptions,
) -> None:
    """Plan a route on MAP, or over the floors of a building, from a point or room to another.

    Without --rooms, rooms are those of rooms.yaml beside the map, if there. Things that `hybridnav
    closed` has closed stay closed.

    Exits with 0 when it is solved, or ends within --within of the goal, 1 when it is not, 2 on
    wrong usage, 3 on unreadable input.
    """
    del no_stairs  # of a building
    _check_files(plot, poses, bag)
    check_output(proof, "--proof", (".json",))
    where = checked_at(at)
    given = options.parsed_costs(costs)
    check_language(language)
    settings = reading.settings(
        map_file, preset=options.PRESET if given else None, overrides=given.overrides, smooth=smooth
    )
    closing = options.parsed_closing([*(blocked or ()), *options.out_of_order(map_file)])
    first, last = _end("start", start, "from", origin), _end("goal", goal, "to", to)
    if via and alternatives > 1:
        raise UsageError("--alternatives does not go with --via")
    wanted = wanted_of(alternatives, max_overlap, max_stretch)
    request = Request(
        map_file=map_file,
        settings=settings,
        reading=reading,
        waypoints=[first, *map(_parsed_waypoint, via or ()), last],
        closing=closing,
        profile=profile,
        costs=given,
        rooms_file=rooms_file,
        at=where,
        within_m=within,
        leave_zone=leave_zone,
        wanted=wanted,
        compare=compare,
        why=why,
        plot=plot,
        poses=poses,
        bag=bag,
        proof=proof,
        language=language,
        as_json=as_json,
    )
    _check_fits(request)
    if not request.run():
        raise typer.Exit(EXIT_NOT_SOLVED)


def _check_files(plot: Path | None, poses: Path | None, bag: Path | None) -> None:
    """Refuse files that cannot be written."""
    check_picture(plot)
    check_output(poses, "--poses", _POSES)
    if bag is not None:
        check_new(bag, "--bag")

        extension("formats", "bag").check_rosbags("--bag")


def _check_fits(request: Request) -> None:
    """Refuse files of one path for several, and comparisons of tours."""
    files = {"--poses": request.poses, "--bag": request.bag, "--proof": request.proof}
    for option, file in files.items():
        if file is not None and request.wanted.count > 1:
            raise UsageError(
                f"{option} writes one path, and --alternatives asks for more: leave one out"
            )
    if request.proof is not None and len(request.waypoints) > 2:  # noqa: PLR2004 - start and goal
        raise UsageError("--proof is of a path without --via: leave one out")
    if request.within_m is not None and not request.within_m >= 0:
        raise UsageError(f"--within must be metres, 0 or more, got {request.within_m:g}")
    if request.is_tour and request.within_m is not None:
        raise UsageError("--within goes with --start and --goal alone, and files as --blocked")
    if request.leave_zone and (request.is_tour or request.within_m is not None or request.compare):
        raise UsageError(
            "--leave-zone goes with --start, --goal and files as --blocked, without --within and "
            "--compare: leave one out"
        )
    if request.is_tour and request.compare:
        raise UsageError("--compare goes with --start and --goal alone, and files as --blocked")


def one_of(option: str, point: Any, other: str, text: str | None) -> Point | str:
    """Return the start or the goal, from the one of its two options that was used."""
    if (point is None) == (text is None):
        what = "missing option" if point is None else "only one is taken, of"
        raise UsageError(f"{what} '--{option}' or '--{other}'; see hybridnav plan --help")
    return point if text is None else text


def _end(option: str, point: Any, other: str, text: str | None) -> Waypoint:
    """Return the start or the goal on a map."""
    given = one_of(option, point, other, text)
    if isinstance(point, str):
        raise UsageError(f"--{option}: expected X,Y in metres, or X,Y,YAW, got {point!r:.80}")
    return _parsed_waypoint(given) if isinstance(given, str) else given


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
