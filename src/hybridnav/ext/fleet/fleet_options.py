"""Options of `hybridnav export`, and what it writes for fleets and as a bundle for Nav2."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli.common import UsageError, answer, complain, timings
from hybridnav.cli.options import option
from hybridnav.errors import MapError, brief

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray
    from hybridnav.ext.fleet import BuildingGraph
    from hybridnav.graphs import GraphReport, RouteGraph

ENDINGS = {"rmf": (".yaml", ".yml"), "osm": (".osm", ".xml"), "lif": (".json", ".lif")}
"""Endings of the file of each format."""
LOSS_PAIRS, _MOST_LOSS = 400, 0.1
"""Pairs by which the loss of a graph for a fleet is measured, and from where on it is a warning."""

KeepOption = Annotated[
    Path | None,
    option(
        "--keep FILE",
        "A graph of lanes of the map as it was, whose nodes keep their places and ids.",
    ),
]
PointsOption = Annotated[
    Path | None,
    option(
        "--points FILE",
        "YAML of named points, NAME: [x, y], or poses of geometry_msgs as in a bundle: lanes get "
        "a node with the name at each. Its section lifts: has points of lifts.",
    ),
]
LanesOption = Annotated[
    float | None,
    option(
        "--lanes APART",
        "Where two robots fit side by side, a lane on the right for each direction; APART is the "
        "distance in metres between the robots.",
    ),
]
ReportOption = Annotated[
    int | None,
    option(
        "--report N",
        "Compare the routes of N random pairs with shortest paths.",
        min=1,
        max=1_000_000,
    ),
]
AnchorOption = Annotated[
    str | None,
    option(
        "--anchor LAT,LON[,DEG]",
        "For osm: latitude and longitude of the origin of the map frame, and the direction of its "
        "y axis, clockwise from north.",
    ),
]
VehiclesOption = Annotated[
    list[str] | None,
    option(
        "--vehicle TYPE",
        "For lif: a type of vehicle, MANUFACTURER.SERIES; may be given several times.",
    ),
]
NoDoorsOption = Annotated[
    bool,
    option("--no-doors", "For rmf: name no doors, which robots would ask to open and wait for."),
]
BundleOption = Annotated[
    Path | None,
    option(
        "--bundle DIR",
        "Write all that Nav2 needs into a folder, in place of --out: graph, masks for costmap "
        "filters of rooms and of --costs, poses, parameters.",
    ),
]
OperationsOption = Annotated[
    bool, option("--operations", "With --bundle: edges through doors and to lifts call a service.")
]


class Bundle(NamedTuple):
    """The options of a bundle: masks as `costs`, whether edges have `operations`, and `lifts`."""

    costs: tuple[str, ...]
    operations: bool
    lifts: tuple[str, ...] = ()

    @classmethod
    def checked(cls, folder: Path | None, bundle: Bundle, others: dict[str, Any]) -> Bundle | None:
        """Return the options, None for no bundle. Refuse folders that hold other files, costs that
        are no masks, and options that do not go with a bundle, or without one.

        Raises `InvalidValueError` or `UsageError` when one of them is refused.
        """
        from hybridnav.graphs.bundle import check_bundle, checked_masks  # noqa: PLC0415

        for flag, value in others.items() if folder else bundle._asdict().items():
            if value:
                wrong = f"{flag} does not go with" if folder else f"--{flag} needs"
                raise UsageError(f"{wrong} --bundle: leave it out")
        if folder is None:
            return None
        checked_masks(bundle.costs)
        check_bundle(folder)
        return bundle


def draw(graph: RouteGraph, keepout: BoolArray | None, plot: Path | None) -> None:
    """Save the picture of a graph, if one is wanted."""
    if plot is not None:
        from hybridnav.viz import save_figure  # noqa: PLC0415 - on demand

        save_figure(hn.graphs.plot_route_graph(graph, keepout=keepout), plot)


def opened(graph: RouteGraph, robot: Bundle | None) -> tuple[RouteGraph, BoolArray | None]:
    """Return a graph as its bundle holds it, and the cells of keepout zones, None for no mask."""
    from hybridnav.graphs.bundle import checked_masks, without_keepout  # noqa: PLC0415

    specs = checked_masks(robot.costs) if robot else {}
    keepout = specs["keepout"].layer(graph.grid).keepout if "keepout" in specs else None
    return without_keepout(graph, specs), keepout


@dataclass(frozen=True)
class Fleet:
    """The options of one of these formats."""

    kind: str
    floor: str
    anchor: hn.ext.fleet.Anchor | None
    vehicles: tuple[str, ...]
    doors: bool

    @classmethod
    def read(
        cls,
        kind: str,
        floor: str | None,
        anchor: str | None,
        vehicles: list[str] | None,
        *,
        no_doors: bool,
    ) -> Fleet | None:
        """Return the options, None for a format that has none of them.

        Raises `UsageError` when an option is for another format, or one that the format needs is
        missing.
        """
        check_homes({"--floor": floor}, ENDINGS, f"--format {kind}")
        check_homes({"--anchor": anchor}, ("osm",), f"--format {kind}")
        check_homes({"--vehicle": vehicles or None}, ("lif",), f"--format {kind}")
        check_homes({"--no-doors": no_doors or None}, ("rmf",), f"--format {kind}")
        if kind not in ENDINGS:
            return None
        if kind == "osm" and anchor is None:
            raise UsageError("--format osm needs --anchor LAT,LON[,DEG]: where the map lies")
        if kind == "lif" and not vehicles:
            raise UsageError("--format lif needs --vehicle MANUFACTURER.SERIES: who drives")
        place = None if anchor is None else _anchor(anchor)
        own = "0" if floor is None else floor
        return cls(kind, own, place, tuple(vehicles or ()), not no_doors)

    def write(self, topology: hn.TopologicalMap, graph: RouteGraph, out: Path) -> tuple[str, ...]:
        """Write a file of one floor; return what it does not hold."""
        from hybridnav.ext.fleet import BuildingGraph  # noqa: PLC0415 - on demand

        floor = hn.ext.fleet.floor_graph(topology, graph, name=self.floor)
        return self.write_building(BuildingGraph(name=graph.grid.name, floors=(floor,)), out)

    def write_building(self, building: BuildingGraph, out: Path) -> tuple[str, ...]:
        """Write a file of a building; return what it does not hold."""
        if self.kind == "rmf":
            return hn.ext.fleet.export_rmf(building, out, doors=self.doors)
        if self.anchor is not None:
            return hn.ext.fleet.export_osm(building, out, anchor=self.anchor)
        return hn.ext.fleet.export_lif(building, out, vehicle_types=self.vehicles)


def respond(
    figures: dict[str, Any], lines: list[str], seconds: dict[str, float], *, as_json: bool
) -> None:
    """Print figures as JSON, or lines, with the seconds that it took."""
    whole = json.dumps(figures | {"seconds": seconds}, allow_nan=False)
    answer((whole if as_json else "\n".join([*lines, f"seconds    {timings(seconds)}"])) + "\n")


def read_points(path: Path) -> tuple[dict[str, tuple[float, float]], tuple[str, ...]]:
    """Return the named points of a YAML file, in metres, and which of them are lifts. Raises
    `UsageError` when it is no mapping of names to points or poses, or has a name twice."""
    from hybridnav._base.yaml_file import read_yaml  # noqa: PLC0415 - help needs no YAML

    entries, lifts = read_yaml(path, what="points", error=MapError), {}
    if isinstance(entries.get("lifts"), dict) and _pair(entries["lifts"]) is None:
        lifts = entries.pop("lifts")
    points: dict[str, tuple[float, float]] = {}
    for name, value in (*entries.items(), *lifts.items()):
        at = _pair(value)
        if at is None or str(name) in points:
            raise UsageError(
                f"points {printable(path)}: {brief(name)} must be [x, y] in metres or a pose with "
                f"a position, and be there once, got {brief(value)}"
            )
        points[str(name)] = at
    return points, tuple(map(str, lifts))


def _pair(value: Any) -> tuple[float, float] | None:
    """Return the point of a pair or pose, None for no such thing."""
    from hybridnav.graphs.gather import pair_of  # noqa: PLC0415 - on demand

    pose = value.get("pose", value) if isinstance(value, dict) else value
    return pair_of(pose.get("position", pose) if isinstance(pose, dict) else pose)


def check_homes(values: dict[str, Any], homes: Iterable[str], chosen: str) -> None:
    """Refuse options that are not None where what is chosen, as `--format rmf`, is no home."""
    what, _, got = chosen.partition(" ")
    for flag, value in values.items():
        if value is not None and got not in homes:
            raise UsageError(f"{flag} is for {what} {', '.join(homes)}, got {got}: leave it out")


def warn_of_loss(judged: dict[str, GraphReport]) -> None:
    """Print a warning for each map or floor whose graph makes routes much longer."""
    for name, report in judged.items():
        if report.nearest.mean > _MOST_LOSS:
            complain(
                f"warning: routes on the graph of {printable(name)} are {report.nearest.mean:.0%} "
                f"longer on average than shortest paths, above {_MOST_LOSS:.0%}: for shorter ones "
                "give a smaller --spacing"
            )


def _anchor(text: str) -> hn.ext.fleet.Anchor:
    try:
        return hn.ext.fleet.Anchor(*map(float, text.split(",")))
    except hn.errors.InvalidValueError as error:
        raise UsageError(f"--anchor: {error}") from None
    except (TypeError, ValueError):  # other than two or three, or no numbers
        raise UsageError(f"--anchor must be LAT,LON or LAT,LON,DEG, got {text!r:.80}") from None
