"""`hybridnav check`: what is wrong with a graph that others have made."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._files import printable, replace_file
from hybridnav.cli.common import (
    Reading,
    answer,
    check_output,
    check_picture,
    check_room_to_be,
    grow_topology,
    load_model,
    read_settings,
    stage,
    timings,
)
from hybridnav.cli.errors import EXIT_NOT_SOLVED, UsageError
from hybridnav.cli.options import (
    FreeOption,
    GraphFloorOption,
    JsonOption,
    LeastIslandOption,
    MapArgument,
    MaxCellsOption,
    OccupiedOption,
    PlotOption,
    PresetOption,
    RadiusOption,
    RoomsOption,
)
from hybridnav.grid import DEFAULT_MAX_CELLS

if TYPE_CHECKING:
    from hybridnav.graphs import Finding, GraphCheck

_SHOWN = 5
"""Cases of a kind in the summary."""

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


def check(
    map_file: MapArgument,
    graph_file: GraphArgument,
    out: PageOption = None,
    floor: GraphFloorOption = None,
    ignore: IgnoreOption = None,
    along_lines: LinesOption = False,
    rooms_file: RoomsOption = None,
    preset: PresetOption = None,
    robot_radius_m: RadiusOption = None,
    free_threshold: FreeOption = None,
    occupied_threshold: OccupiedOption = None,
    least_island_m2: LeastIslandOption = 0.0,
    max_cells: MaxCellsOption = DEFAULT_MAX_CELLS,
    as_json: JsonOption = False,
    plot: PlotOption = None,
) -> None:
    """Find what is wrong with GRAPH on MAP: edges through walls, nodes in walls, parts that are not
    connected, doors that no edge passes, damaged entries.

    Exits with 1 when something is wrong.
    """
    from hybridnav.graphs import KINDS  # noqa: PLC0415 - loads numpy

    unknown = [kind for kind in ignore or () if kind not in KINDS]
    if unknown:
        raise UsageError(f"--ignore must be one of {', '.join(KINDS)}, got {unknown[0]!r:.80}")
    check_output(out, "--out", (".html",))
    check_picture(plot)
    settings = read_settings(preset, None, robot_radius_m, None, map_file=map_file)
    seconds: dict[str, float] = {}
    with stage(f"reading {graph_file}", seconds, "graph"):
        graph = hn.load_graph(graph_file, floor=floor)
    reading = Reading(free_threshold, occupied_threshold, least_island_m2, max_cells)
    model = load_model(map_file, settings, seconds, reading)
    check_room_to_be(model.grid)
    topology = grow_topology(model, settings, seconds, rooms_file=rooms_file, find_rooms=True)
    with stage("checking", seconds, "check"):
        found = hn.check_graph(topology, graph, along_lines=along_lines)
    wrong = [each for each in found.findings if each.kind not in (ignore or ())]
    lines = [*_summary(found, wrong), f"seconds    {timings(seconds)}"]
    whole = json.dumps(_figures(found, wrong) | {"seconds": seconds}, allow_nan=False)
    answer((whole if as_json else "\n".join(lines)) + "\n")
    _write(found, out, plot)
    if wrong:
        raise typer.Exit(EXIT_NOT_SOLVED)


def _write(found: GraphCheck, out: Path | None, plot: Path | None) -> None:
    if out is not None:
        from hybridnav.harness.check_page import render_check  # noqa: PLC0415 - on demand

        try:
            replace_file(out, render_check(found).encode())
        except OSError as error:
            raise UsageError(f"--out: cannot write {str(out)!r}: {error.strerror}") from None
    if plot is not None:
        from hybridnav.viz import plot_graph_check, save_figure  # noqa: PLC0415 - on demand

        save_figure(plot_graph_check(found), plot)


def _summary(found: GraphCheck, wrong: list[Finding]) -> list[str]:
    from hybridnav.harness.check_page import check_facts  # noqa: PLC0415 - on demand

    lines = [f"{name:<10} {printable(text)}" for name, text in check_facts(found)]
    for each in wrong:
        lines.append(f"found      {each.count:,} {each.text} ({each.kind})")
        lines += [f"           {printable(example.where)}" for example in each.examples[:_SHOWN]]
        if each.count > _SHOWN:
            lines.append(f"           and {each.count - _SHOWN:,} more")
    return lines if wrong else [*lines, "found      nothing"]


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
        "findings": {
            each.kind: {
                "count": each.count,
                "text": each.text,
                "cases": [
                    {"where": example.where, "points": example.points} for example in each.examples
                ],
            }
            for each in wrong
        },
    }
