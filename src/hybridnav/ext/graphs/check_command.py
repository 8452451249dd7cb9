"""`hybridnav check` for the graph of a building of several floors."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli.common import answer, check_output, check_picture, stage, timings
from hybridnav.cli.errors import EXIT_NOT_SOLVED, UsageError
from hybridnav.cli.options import (
    GraphFloorOption,
    JsonOption,
    MapOrBuildingArgument,
    PlotOption,
    RoomsOption,
)
from hybridnav.cli.reading import MapOptions, check_room_to_be, grow_topology, load_model, with_map
from hybridnav.ext.fleet.command import (
    BuildingSource,
    check_options,
    is_building_file,
    refused_options,
)
from hybridnav.ext.graphs.findings_text import (
    FAIL_ON,
    SHOWN,
    FailOnOption,
    check_level,
    count_line,
    fails,
    found_figures,
    found_lines,
    write_page,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from hybridnav.ext.fleet import BuildingGraphCheck, BuildingGraphReport
    from hybridnav.ext.graphs import Finding, GraphCheck


CHECK_OPTIONS = frozenset(
    {
        *(
            "map_file",
            "graph_file",
            "out",
            "ignore",
            "fail_on",
            "preset",
            "robot_radius_m",
            "max_cells",
        ),
        *("align", "match", "pairs", "no_stairs", "as_json"),
    }
)
"""Parameters of `hybridnav check` that mean something for a building."""
ONLY_BUILDINGS = frozenset({"align", "match", "pairs", "no_stairs"})
"""Those that mean nothing for one map."""

AlignOption = Annotated[
    bool,
    typer.Option(
        "--align",
        help="For a building: move the floors of the graph so that its links stop where those of "
        "the building do.",
    ),
]
MatchOption = Annotated[
    list[str] | None,
    typer.Option(
        "--match",
        metavar="NAME=FLOOR",
        help="For a building: the graph calls FLOOR otherwise; may be given several times.",
    ),
]
PairsOption = Annotated[
    int,
    typer.Option(
        "--pairs",
        metavar="N",
        min=0,
        max=1_000_000,
        help="For a building: pairs of points whose routes are compared.",
    ),
]
NoStairsOption = Annotated[
    bool, typer.Option("--no-stairs", help="For a building: the robot takes no stairs.")
]


@dataclass(frozen=True)
class BuildingOptions:
    """What `hybridnav check` takes for buildings alone."""

    align: bool
    match: Sequence[str]
    pairs: int
    stairs: bool


def check_building(given: Mapping[str, Any], how: BuildingOptions) -> bool:
    """Check the graph of a building, print a summary, and return whether that is a failure.

    Parameters
    ----------
    given
        The values of the parameters of `hybridnav check` by their names.
    how
        Those for buildings alone.
    """
    from hybridnav.ext.fleet import check_building_graph, judge_building_graph, match_graph  # noqa: PLC0415 - on demand
    from hybridnav.ext.fleet.link_nodes import SAME_POINT_M  # noqa: PLC0415

    seconds: dict[str, float] = {}
    file = given["graph_file"]
    names = _names_of(how.match)
    with stage(f"reading {file}", seconds, "graph"):
        graph = hn.load_building_graph(file)
    building = BuildingSource.of({**given, "overrides": ()}).load(seconds)
    with stage("checking", seconds, "check"):
        matched = match_graph(building, graph, floors=names, align=how.align)
        found = check_building_graph(matched)
    report = None
    if how.pairs:
        with stage("comparing routes", seconds, "routes"):
            report = judge_building_graph(matched, pairs=how.pairs, stairs=how.stairs)
    ignored = given["ignore"] or ()
    if given["as_json"]:
        figures = _building_check_figures(found, report, ignored) | {"seconds": seconds}
        answer(json.dumps(figures, allow_nan=False) + "\n")
    else:
        lines = _building_check_summary(found, report, ignored)
        if not how.align and matched.away_m > SAME_POINT_M:
            away = f"links stop up to {matched.away_m:.2f} m from those of the building"
            lines.append(f"hint       {away}: --align, if floors have other frames than their maps")
        lines.append(f"seconds    {timings(seconds)}")
        answer("\n".join(lines) + "\n")
    if given["out"] is not None:
        from hybridnav.ext.graphs.page import render_building_check  # noqa: PLC0415 - on demand

        write_page(render_building_check(found, report), given["out"])
    # An answer that the building contradicts is an error.
    is_refuted = report is not None and bool(report.contradictions)
    level = given["fail_on"]
    return (is_refuted and level != "never") or fails(_all(_wrong(found, ignored)), level)


def _names_of(texts: Sequence[str]) -> dict[str, str]:
    """Return the building's name of floors, by the graph's."""
    names = {}
    for text in texts:
        name, equals, own = text.rpartition("=")
        if not equals or not name or not own:
            raise UsageError(f"--match must be NAME=FLOOR, got {text!r:.80}")
        if name in names:
            raise UsageError(f"--match has floor {name!r:.80} of the graph twice, expected once")
        names[name] = own
    return names


def _wrong(found: BuildingGraphCheck, ignored: Collection[str]) -> dict[str, list[Finding]]:
    """Return the findings that count, by the name of their floor; those of the whole by ""."""
    whole = {"": found.findings} | {name: one.findings for name, one in found.floors.items()}
    return {
        name: [each for each in findings if each.kind not in ignored]
        for name, findings in whole.items()
    }


def _all(wrong: Mapping[str, list[Finding]]) -> list[Finding]:
    return [each for findings in wrong.values() for each in findings]


def _building_check_summary(
    found: BuildingGraphCheck, report: BuildingGraphReport | None, ignored: Collection[str]
) -> list[str]:
    from hybridnav.ext.graphs.page import building_facts  # noqa: PLC0415 - on demand

    lines = [f"{name:<10} {_line(text)}" for name, text in building_facts(found, report)]
    wrong = _wrong(found, ignored)
    lines.append(count_line(_all(wrong)))
    for name, findings in wrong.items():
        lines += found_lines(findings, f" on floor {name}" if name else "")
    cases = () if report is None else report.contradictions
    for number, text in enumerate(cases[:SHOWN]):
        lines.append(f"{'' if number else 'routes':<10} {_line(text)}")
    return lines


def _building_check_figures(
    found: BuildingGraphCheck, report: BuildingGraphReport | None, ignored: Collection[str]
) -> dict[str, Any]:
    wrong = _wrong(found, ignored)
    return {
        "graph": found.matched.name,
        "robot_radius_m": found.matched.building.robot_radius_m,
        "floors": {
            name: {
                "nodes": check.graph.n_nodes,
                "edges": check.graph.n_edges,
                "free_nodes": int(check.is_free.sum()),
                "clear_edges": int(check.is_clear.sum()),
                "in_sight": check.in_sight,
                "findings": found_figures(wrong[name]),
            }
            for name, check in found.floors.items()
        },
        "links": {
            link.drawn.name: None if link.own is None else link.own.name
            for link in found.matched.links
        },
        "findings": found_figures(wrong[""]),
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
PageOption = Annotated[
    Path | None,
    typer.Option("-o", "--out", metavar="FILE", help="Write one page with a picture, .html."),
]
LinesOption = Annotated[
    bool,
    typer.Option(
        "--along-lines", help="Edges run along their lines, for robots that follow these."
    ),
]
IgnoreOption = Annotated[
    list[str] | None,
    typer.Option(
        "--ignore", metavar="KIND", help="Leave out findings of a kind; may be given several times."
    ),
]


@with_map(before="align")
def check(
    ctx: typer.Context,
    map_file: MapOrBuildingArgument,
    graph_file: GraphArgument,
    out: PageOption = None,
    floor: GraphFloorOption = None,
    ignore: IgnoreOption = None,
    fail_on: FailOnOption = FAIL_ON,
    along_lines: LinesOption = False,
    rooms_file: RoomsOption = None,
    align: AlignOption = False,
    match: MatchOption = None,
    pairs: PairsOption = 400,
    no_stairs: NoStairsOption = False,
    as_json: JsonOption = False,
    plot: PlotOption = None,
    *,
    reading: MapOptions,
) -> None:
    """Find what is wrong with GRAPH on MAP: edges through walls, nodes in walls, parts that are not
    connected, doors that no edge passes, damaged entries. On a building, find that on all floors
    and links, and compare routes over all floors with the shortest ones.

    Exits with 0 when no error or warning is found, with 1 otherwise (--fail-on), with 2 when it is
    called wrongly, and with 3 when a file cannot be read.
    """
    check_level(fail_on)
    check_output(out, "--out", (".html",))
    check_picture(plot)
    if is_building_file(map_file):
        _check_kinds(ignore, is_building=True)
        check_options(refused_options(ctx, CHECK_OPTIONS))
        how = BuildingOptions(align, match or (), pairs, stairs=not no_stairs)
        if check_building(ctx.params, how):
            raise typer.Exit(EXIT_NOT_SOLVED)
        return
    _check_kinds(ignore, is_building=False)
    given = refused_options(ctx, [name for name in ctx.params if name not in ONLY_BUILDINGS])
    if given:
        raise UsageError(f"{given[0]} is for a building, and this is one map: leave it out")
    settings = reading.settings(map_file)
    seconds: dict[str, float] = {}
    with stage(f"reading {graph_file}", seconds, "graph"):
        graph = hn.load_graph(graph_file, floor=floor)
    model = load_model(map_file, settings, seconds, reading)
    check_room_to_be(model.grid)
    topology = grow_topology(model, settings, seconds, rooms_file=rooms_file, find_rooms=True)
    with stage("checking", seconds, "check"):
        found = hn.check_graph(topology, graph, along_lines=along_lines)
    wrong = [each for each in found.findings if each.kind not in (ignore or ())]
    lines = [*_summary(found, wrong), f"seconds    {timings(seconds)}"]
    whole = json.dumps(_figures(found, wrong) | {"seconds": seconds}, allow_nan=False)
    answer((whole if as_json else "\n".join(lines)) + "\n")
    if out is not None:
        from hybridnav.ext.graphs.page import render_check  # noqa: PLC0415 - on demand

        write_page(render_check(found), out)
    if plot is not None:
        from hybridnav.ext.graphs import plot_graph_check  # noqa: PLC0415 - on demand
        from hybridnav.viz import save_figure  # noqa: PLC0415 - on demand

        save_figure(plot_graph_check(found), plot)
    if fails(wrong, fail_on):
        raise typer.Exit(EXIT_NOT_SOLVED)


def _check_kinds(ignored: list[str] | None, *, is_building: bool) -> None:
    from hybridnav.ext.graphs import BUILDING_KINDS, KINDS  # noqa: PLC0415 - loads numpy

    known = KINDS | BUILDING_KINDS if is_building else KINDS
    unknown = [kind for kind in ignored or () if kind not in known]
    if unknown:
        raise UsageError(f"--ignore must be one of {', '.join(known)}, got {unknown[0]!r:.80}")


def _summary(found: GraphCheck, wrong: list[Finding]) -> list[str]:
    from hybridnav.ext.graphs.page import check_facts  # noqa: PLC0415 - on demand

    lines = [f"{name:<10} {printable(text)}" for name, text in check_facts(found)]
    return [*lines, count_line(wrong), *found_lines(wrong)]


def _figures(found: GraphCheck, wrong: list[Finding]) -> dict[str, Any]:
    graph = found.graph
    return {
        "graph": graph.name,
        "format": graph.format,
        "map": found.grid.name,
        "robot_radius_m": found.grid.robot_radius_m,
        "nodes": graph.n_nodes,
        "edges": graph.n_edges,
        "free_nodes": int(found.is_free.sum()),
        "clear_edges": int(found.is_clear.sum()),
        "in_sight": found.in_sight,
        "doors": {"passed": found.doors[0], "all": found.doors[1]},
        "rooms": {"with_node": found.rooms[0], "all": found.rooms[1]},
        "findings": found_figures(wrong),
    }
