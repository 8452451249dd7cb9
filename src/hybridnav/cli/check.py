"""`hybridnav check`: what is wrong with a graph that others have made."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._files import printable
from hybridnav.cli.building import check_options, is_building_file, refused_options
from hybridnav.cli.building_check import (
    CHECK_OPTIONS,
    ONLY_BUILDINGS,
    AlignOption,
    BuildingOptions,
    MatchOption,
    NoStairsOption,
    PairsOption,
    check_building,
)
from hybridnav.cli.common import answer, check_output, check_picture, stage, timings
from hybridnav.cli.errors import EXIT_NOT_SOLVED, UsageError
from hybridnav.cli.findings import (
    FAIL_ON,
    FailOnOption,
    check_level,
    count_line,
    fails,
    found_figures,
    found_lines,
    write_page,
)
from hybridnav.cli.options import (
    GraphFloorOption,
    JsonOption,
    MapOrBuildingArgument,
    PlotOption,
    RoomsOption,
)
from hybridnav.cli.reading import (
    MapOptions,
    check_room_to_be,
    grow_topology,
    load_model,
    with_map,
)

if TYPE_CHECKING:
    from hybridnav.graphs import Finding, GraphCheck

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
        from hybridnav.harness.check_page import render_check  # noqa: PLC0415 - on demand

        write_page(render_check(found), out)
    if plot is not None:
        from hybridnav.viz import plot_graph_check, save_figure  # noqa: PLC0415 - on demand

        save_figure(plot_graph_check(found), plot)
    if fails(wrong, fail_on):
        raise typer.Exit(EXIT_NOT_SOLVED)


def _check_kinds(ignored: list[str] | None, *, is_building: bool) -> None:
    from hybridnav.graphs import BUILDING_KINDS, KINDS  # noqa: PLC0415 - loads numpy

    known = KINDS | BUILDING_KINDS if is_building else KINDS
    unknown = [kind for kind in ignored or () if kind not in known]
    if unknown:
        raise UsageError(f"--ignore must be one of {', '.join(known)}, got {unknown[0]!r:.80}")


def _summary(found: GraphCheck, wrong: list[Finding]) -> list[str]:
    from hybridnav.harness.check_page import check_facts  # noqa: PLC0415 - on demand

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
