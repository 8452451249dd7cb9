"""`hybridnav check`: what is wrong with a graph that others have made."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli import common, options
from hybridnav.cli.map_options import FloorOptions
from hybridnav.cli.options import OfBuilding, OneMap, option
from hybridnav.cli.reading import check_room_to_be, grow_topology
from hybridnav.ext.fleet import findings_report as telling
from hybridnav.ext.fleet.command import load_floors
from hybridnav.ext.fleet.fleet_options import respond

if TYPE_CHECKING:
    from hybridnav.ext.fleet import BuildingGraphCheck, BuildingGraphReport
    from hybridnav.graphs import Finding, GraphCheck

AlignOption = Annotated[
    bool,
    option(
        "--align",
        "For a building: move the floors of the graph so that its links stop where those of the "
        "building do.",
    ),
]
MatchOption = Annotated[
    list[str] | None,
    option(
        "--match NAME=FLOOR",
        "For a building: the graph calls FLOOR otherwise; may be given several times.",
    ),
]
PairsOption = Annotated[
    int,
    option(
        "--pairs N",
        "For a building: pairs of points whose routes are compared.",
        min=0,
        max=1_000_000,
    ),
]


def _check_over_floors(args: CheckOptions) -> None:
    """Check the graph of a building, and print a summary; see `check`."""
    from hybridnav.ext.fleet import check_building_graph, judge_building_graph, match_graph  # noqa: PLC0415 - on demand
    from hybridnav.ext.fleet.link_nodes import SAME_POINT_M  # noqa: PLC0415
    from hybridnav.graphs import BUILDING_KINDS, KINDS  # noqa: PLC0415

    _check_options(args, KINDS | BUILDING_KINDS)
    seconds: dict[str, float] = {}
    names = _names_of(args.match or ())
    with common.stage(f"reading {args.graph_file}", seconds, "graph"):
        graph = hn.ext.fleet.load_building_graph(args.graph_file)
    building = load_floors(args, seconds)
    with common.stage("checking", seconds, "check"):
        matched = match_graph(building, graph, floors=names, align=args.align)
        check = check_building_graph(matched)
    report = None
    if args.pairs:
        with common.stage("comparing routes", seconds, "routes"):
            report = judge_building_graph(matched, pairs=args.pairs, stairs=not args.no_stairs)
    from hybridnav.ext.fleet.findings_report import building_facts, render_building_check  # noqa: PLC0415

    cases = () if report is None else report.contradictions
    whole = {"": check.findings} | {name: floor.findings for name, floor in check.floors.items()}
    wrong = _counted(whole, args.ignore)
    facts = [(name, _line(text)) for name, text in building_facts(check, report)]
    lines = _summary(facts, wrong)
    lines += [
        f"{'' if n else 'routes':<10} {_line(text)}"
        for n, text in enumerate(cases[: telling.SHOWN])
    ]
    if not args.align and matched.away_m > SAME_POINT_M:
        away = f"links stop up to {matched.away_m:.2f} m from those of the building"
        lines.append(f"hint       {away}: --align, if floors have other frames than their maps")
    respond(_building_figures(check, report, wrong), lines, seconds, as_json=args.as_json)
    if args.out is not None:
        common.write_out(args.out, render_building_check(check, report))
    # An answer that the building contradicts is an error.
    _end(wrong, args.fail_on, is_refuted=bool(cases))


def _names_of(texts: Sequence[str]) -> dict[str, str]:
    """Return the building's name of floors, by the graph's."""
    names = {}
    for text in texts:
        name, equals, own = text.rpartition("=")
        if not equals or not name or not own:
            raise common.UsageError(f"--match must be NAME=FLOOR, got {text!r:.80}")
        if name in names:
            raise common.UsageError(
                f"--match has floor {name!r:.80} of the graph twice, expected once"
            )
        names[name] = own
    return names


def _building_figures(
    check: BuildingGraphCheck,
    report: BuildingGraphReport | None,
    wrong: Mapping[str, list[Finding]],
) -> dict[str, Any]:
    return {
        "graph": check.matched.name,
        "robot_radius_m": check.matched.building.robot_radius_m,
        "floors": {
            name: _sizes(floor) | {"findings": telling.found_figures(wrong[name])}
            for name, floor in check.floors.items()
        },
        "links": {
            link.drawn.name: None if link.own is None else link.own.name
            for link in check.matched.links
        },
        "findings": telling.found_figures(wrong[""]),
        "routes": None
        if report is None
        else {name: counts.to_dict() for name, counts in report.counts.items()},
        "contradictions": [] if report is None else list(report.contradictions),
    }


def _line(text: str) -> str:
    """Return a text, escaped if names in it would break the line."""
    return text if text.isprintable() else repr(text)


# `hybridnav check`: what is wrong with a graph that others have made.

GraphArgument = Annotated[
    Path,
    typer.Argument(
        metavar="GRAPH",
        help="Route graph of Nav2 (.geojson), topological map of STRANDS or LCAS, GraphML, "
        "node-link JSON, or a file of Open-RMF, OpenStreetMap or VDMA's LIF.",
    ),
]
LinesOption = Annotated[
    bool, option("--along-lines", "Edges run along their lines, for robots that follow these.")
]
IgnoreOption = Annotated[
    list[str] | None,
    option("--ignore KIND", "Leave out findings of a kind; may be given several times."),
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class CheckOptions(FloorOptions):
    """The options of `hybridnav check`."""

    graph_file: GraphArgument
    out: options.OutOption[Path | None] = None
    floor: OneMap[options.GraphFloorOption] = None
    ignore: IgnoreOption = None
    fail_on: telling.FailOnOption = telling.FAIL_ON
    along_lines: OneMap[LinesOption] = False
    rooms_file: OneMap[options.RoomsOption] = None
    align: OfBuilding[AlignOption] = False
    match: OfBuilding[MatchOption] = None
    pairs: OfBuilding[PairsOption] = 400
    no_stairs: OfBuilding[options.NoStairsOption] = False
    as_json: options.JsonOption = False
    plot: OneMap[options.PlotOption] = None


def check(args: CheckOptions) -> None:
    """Find what is wrong with a route GRAPH on MAP.

    That is edges through walls, nodes in walls, parts that are not connected, doors that no edge
    passes, damaged entries. On a building, find that on all floors and links, and compare routes
    over all floors with the shortest ones. --out writes one page with a picture, .html. Without
    --rooms, rooms are those of rooms.yaml beside the map, if there.

    Exits with 0 when no error or warning is found, with 1 otherwise (--fail-on), with 2 when it is
    called wrongly, and with 3 when a file cannot be read.

    Example: hybridnav check maps/office/office.yaml graph.geojson --out check.html
    """
    if args.is_building:
        _check_over_floors(args)
        return
    from hybridnav.graphs import KINDS  # noqa: PLC0415 - loads numpy

    _check_options(args, KINDS)
    common.check_picture(args.plot)
    settings = args.settings()
    seconds: dict[str, float] = {}
    with common.stage(f"reading {args.graph_file}", seconds, "graph"):
        graph = hn.ext.fleet.load_graph(args.graph_file, floor=args.floor)
    model = args.load(settings, seconds)
    check_room_to_be(model.grid)
    file, map_file = args.rooms_file, args.map_file
    topology = grow_topology(
        model, settings, seconds, rooms_file=file, find_rooms=True, map_file=map_file
    )
    with common.stage("checking", seconds, "check"):
        checked = hn.graphs.check_graph(topology, graph, along_lines=args.along_lines)
    from hybridnav.ext.fleet.findings_report import check_facts, render_check  # noqa: PLC0415 - on demand

    wrong = _counted({"": checked.findings}, args.ignore)
    facts = [(name, printable(text)) for name, text in check_facts(checked)]
    respond(_figures(checked, wrong[""]), _summary(facts, wrong), seconds, as_json=args.as_json)
    if args.out is not None:
        common.write_out(args.out, render_check(checked))
    if args.plot is not None:
        from hybridnav.graphs import plot_graph_check  # noqa: PLC0415 - on demand
        from hybridnav.viz import save_figure  # noqa: PLC0415 - on demand

        save_figure(plot_graph_check(checked), args.plot)
    _end(wrong, args.fail_on)


def _check_options(args: CheckOptions, kinds: Collection[str]) -> None:
    telling.check_level(args.fail_on)
    common.check_output(args.out, "--out", (".html",))
    unknown = [kind for kind in args.ignore or () if kind not in kinds]
    if unknown:
        raise common.UsageError(
            f"--ignore must be one of {', '.join(kinds)}, got {unknown[0]!r:.80}"
        )


def _counted(
    all_findings: Mapping[str, Sequence[Finding]], ignored: list[str] | None
) -> dict[str, list[Finding]]:
    """Return the findings that count, by the name of their floor; those of the whole by ""."""
    return {
        name: [each for each in findings if each.kind not in (ignored or ())]
        for name, findings in all_findings.items()
    }


def _summary(facts: Sequence[tuple[str, str]], wrong: Mapping[str, list[Finding]]) -> list[str]:
    lines = [f"{name:<10} {text}" for name, text in facts]
    lines.append(telling.count_line(chain.from_iterable(wrong.values())))
    for name, findings in wrong.items():
        lines += telling.found_lines(findings, f" on floor {name}" if name else "")
    return lines


def _end(wrong: Mapping[str, list[Finding]], level: str, *, is_refuted: bool = False) -> None:
    """End the command with 1 where something is as bad as a level."""
    if (is_refuted and level != "never") or telling.fails(
        chain.from_iterable(wrong.values()), level
    ):
        raise typer.Exit(common.EXIT_NOT_SOLVED)


def _sizes(check: GraphCheck) -> dict[str, Any]:
    return {
        "nodes": check.graph.n_nodes,
        "edges": check.graph.n_edges,
        "free_nodes": int(check.is_free.sum()),
        "clear_edges": int(check.is_clear.sum()),
        "in_sight": check.in_sight,
    }


def _figures(check: GraphCheck, wrong: list[Finding]) -> dict[str, Any]:
    return {
        "graph": check.graph.name,
        "format": check.graph.format,
        "map": check.grid.name,
        "robot_radius_m": check.grid.robot_radius_m,
        **_sizes(check),
        "doors": {"passed": check.doors[0], "all": check.doors[1]},
        "rooms": {"with_node": check.rooms[0], "all": check.rooms[1]},
        "findings": telling.found_figures(wrong),
    }
