"""`hybridnav export`: a route graph of a map, its rooms or its places, for other programs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import hybridnav as hn
from hybridnav._base.clock import clock
from hybridnav._base.files import printable
from hybridnav.cli import common, options
from hybridnav.cli.map_options import FloorOptions
from hybridnav.cli.options import OneMap, option
from hybridnav.cli.reading import check_room_to_be, grow_topology
from hybridnav.ext.fleet import fleet_options as targets
from hybridnav.ext.fleet.command import load_floors

if TYPE_CHECKING:
    from hybridnav.ext.fleet import Building
    from hybridnav.graphs import Excess, GraphReport, RouteGraph, WaypointGraph

_ENDINGS = {
    "nav2": (".geojson", ".json"),
    **targets.ENDINGS,
    "rooms": (".csv", ".geojson"),
    "places": (".csv", ".geojson"),
    "indoorgml": (".json",),
}
"""Endings of the file of each format."""
_PARTS = ("rooms", "places", "indoorgml")
"""Formats without a graph."""
_SHOWN = 8
"""Ids in a line about changes."""

FormatOption = Annotated[str, option("--format NAME", f"What to write: {', '.join(_ENDINGS)}.")]
SpacingOption = Annotated[
    float | None,
    option(
        "--spacing D",
        "Distance in metres between the lanes of a hall, by default 4, less in arenas.",
    ),
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ExportOptions(FloorOptions):
    """The options of `hybridnav export`."""

    out: options.OutOption[Path | None] = None
    force: options.ForceOption = False
    bundle: OneMap[targets.BundleOption] = None
    costs: OneMap[options.CostsOption] = None
    operations: OneMap[targets.OperationsOption] = False
    kind: FormatOption = "nav2"
    points: OneMap[targets.PointsOption] = None
    keep: OneMap[targets.KeepOption] = None
    spacing_m: SpacingOption = None
    lanes_m: OneMap[targets.LanesOption] = None
    frame: OneMap[options.FrameOption[str]] = "map"
    floor: OneMap[options.GraphFloorOption] = None
    anchor: targets.AnchorOption = None
    vehicles: targets.VehiclesOption = None
    no_doors: targets.NoDoorsOption = False
    report: OneMap[targets.ReportOption] = None
    rooms_file: OneMap[options.RoomsOption] = None
    as_json: options.JsonOption = False
    plot: OneMap[options.PlotOption] = None


def export(args: ExportOptions) -> None:
    """Write a graph of MAP for Nav2, Open-RMF, OSM or VDA 5050.

    It is a graph of free space, for Nav2's route server, Open-RMF, OpenStreetMap or VDA 5050; or
    MAP's rooms or places, or both as IndoorGML. The file ends in .geojson; for rmf in .yaml, for
    osm in .osm, for lif and indoorgml in .json; that of rooms and places in .geojson or .csv. In
    rmf, osm and lif the floor is called 0 without --floor. Without --rooms, rooms are those of
    rooms.yaml beside the map, if there.

    MAP may be a building; it is written for Open-RMF, OpenStreetMap or VDA 5050, or as IndoorGML.

    Example: hybridnav export maps/office/office.yaml -o graph.geojson --report 100
    """
    if args.is_building:
        _export_over_floors(args)
        return
    from hybridnav.graphs import cover  # noqa: PLC0415 - on demand

    kind = args.kind
    robot = targets.Bundle.checked(
        args.bundle,
        targets.Bundle(tuple(args.costs or ()), args.operations),
        {"--out": args.out, f"--format {kind}": kind != "nav2"},
    )
    out = args.bundle or _checked_out(args)
    common.check_picture(args.plot)
    fleet = targets.Fleet.read(kind, args.floor, args.anchor, args.vehicles, no_doors=args.no_doors)
    of_graphs = {
        "--points": args.points,
        "--keep": args.keep,
        "--spacing": args.spacing_m,
        "--lanes": args.lanes_m,
        "--report": args.report,
        "--plot": args.plot,
    }
    homes = [each for each in _ENDINGS if each not in _PARTS]
    targets.check_homes(of_graphs, homes, f"--format {kind}")
    named, lifts = targets.read_points(args.points) if args.points else ({}, ())
    settings = args.settings()
    seconds: dict[str, float] = {}
    model = args.load(settings, seconds)
    check_room_to_be(model.grid)
    file, finds = args.rooms_file, kind != "places"
    topology = grow_topology(
        model, settings, seconds, rooms_file=file, find_rooms=finds, map_file=args.map_file
    )
    if kind in _PARTS:
        with common.stage(f"writing {out}", seconds, "write"):
            parts = _write_parts(topology, kind, (out, args.map_file), args.frame)
        targets.respond(*parts, seconds, as_json=args.as_json)
        return
    graph, before = _built(args, topology, named, seconds)
    with common.stage(f"writing {out}", seconds, "write"):
        aim = fleet or (robot and robot._replace(lifts=lifts))
        missing = list(_write_graph(topology, graph, aim, out, args.frame))
        graph, keepout = targets.opened(graph, robot)  # as the file holds it
        missing += cover.left_out(topology, graph)
    pairs = targets.LOSS_PAIRS if args.report is None and fleet is not None else args.report
    judged = None
    if pairs is not None:
        with common.stage("comparing routes", seconds, "report"):
            judged = hn.graphs.judge_route_graph(graph, pairs=pairs, topology=topology)
    figures = _figures(graph, judged) | {"graph": str(out), "map": str(args.map_file)}
    ids = _ids_line(graph) if fleet is None else []
    lines = [*_summary(out, graph, judged), *_left_out_lines(missing), *ids]
    changes = {} if before is None else hn.graphs.graph_changes(before, graph)
    figures |= {"left_out": missing} | ({"changes": changes} if changes else {})
    targets.respond(figures, [*lines, *_change_lines(changes)], seconds, as_json=args.as_json)
    targets.warn_of_loss({graph.grid.name: judged} if judged is not None and fleet else {})
    targets.draw(graph, keepout, args.plot)


def _built(
    args: ExportOptions,
    topology: hn.TopologicalMap,
    points: dict[str, tuple[float, float]],
    seconds: dict[str, float],
) -> tuple[RouteGraph, WaypointGraph | None]:
    """Return the graph of a map, and the one of `--keep`, None without."""
    keep = args.keep
    own = keep is not None and keep.suffix in targets.ENDINGS.get(args.kind, ())
    before = (
        None if keep is None else hn.ext.fleet.load_graph(keep, floor=args.floor if own else None)
    )
    began = clock()
    with common.progress_bar("building the graph") as advance:
        graph = hn.graphs.build_lane_graph(
            topology, spacing_m=args.spacing_m, points=points, keep=before, progress=advance
        )
        if args.lanes_m is not None:
            graph = hn.graphs.keep_right(topology, graph, apart_m=args.lanes_m)
    seconds["graph"] = round(clock() - began, 6)
    return graph, before


def _export_over_floors(args: ExportOptions) -> None:
    """Write the graph of a building, and print a summary; see `export`."""
    out, kind = _checked_out(args), args.kind
    fleet = targets.Fleet.read(kind, None, args.anchor, args.vehicles, no_doors=args.no_doors)
    if fleet is None and kind != "indoorgml":
        raise common.UsageError(
            f"--format {kind} is for one map, and this is a building: take rmf, osm, lif or "
            "indoorgml"
        )
    from hybridnav.ext.fleet import align_floors  # noqa: PLC0415 - on demand
    from hybridnav.graphs import cover  # noqa: PLC0415

    seconds: dict[str, float] = {}
    building = load_floors(args, seconds)
    if fleet is None:
        with common.stage(f"writing {out}", seconds, "write"):
            parts = _write_indoorgml(building, out, args.map_file)
        targets.respond(*parts, seconds, as_json=args.as_json)
        return
    reports: list[GraphReport] = []
    bare: list[str] = []

    def judging(topology: hn.TopologicalMap) -> RouteGraph:
        built = hn.graphs.build_lane_graph(topology, spacing_m=args.spacing_m)
        bare.extend(f"{topology.grid.name}: {each}" for each in cover.left_out(topology, built))
        judged = hn.graphs.judge_route_graph(built, pairs=targets.LOSS_PAIRS, topology=topology)
        reports.append(judged)
        return built

    began = clock()
    with common.progress_bar("building the graphs") as advance:
        graph = hn.ext.fleet.building_graph(
            building, name=args.map_file.stem, build=judging, progress=advance
        )
    judged = dict(zip((floor.name for floor in graph.floors), reports, strict=True))
    seconds["graph"] = round(clock() - began, 6)
    with common.stage(f"writing {out}", seconds, "write"):
        left_out = [*fleet.write_building(align_floors(graph), out), *bare]
    figures = {
        "graph": str(out),
        "map": str(args.map_file),
        "floors": {
            floor.name: {"nodes": floor.graph.n_nodes, "edges": floor.graph.n_edges}
            for floor in graph.floors
        },
        "links": [link.name for link in graph.links],
        "left_out": left_out,
        "report": {name: asdict(each) for name, each in judged.items()},
    }
    lines = [f"graph      {printable(out)}"]
    for number, floor in enumerate(graph.floors):
        counts = f"{floor.graph.n_nodes:,} nodes, {floor.graph.n_edges:,} edges"
        lines.append(f"{'' if number else 'floors':<10} {printable(floor.name)}: {counts}")
        lines.append(f"{'nearest':>10} {_line(judged[floor.name].nearest)}")
    links = ", ".join(printable(link.name) for link in graph.links) or "none"
    lines += [f"links      {links}", f"robot      radius {building.robot_radius_m:g} m"]
    targets.respond(figures, [*lines, *_left_out_lines(left_out)], seconds, as_json=args.as_json)
    targets.warn_of_loss(judged)


def _change_lines(changes: dict[str, dict[str, list[Any]]]) -> list[str]:
    """Return the lines of a summary about changes, none where no graph was kept."""
    lines = []
    for kind, ids in changes.items():
        for what, names in ids.items():
            more = ", ..." if len(names) > _SHOWN else ""
            listed = ", ".join(printable(str(name)) for name in names[:_SHOWN]) + more
            lines += [f"{what:<10} {len(names):,} {kind}: {listed}"] if names else []
    return lines or ["changed    nothing"] * bool(changes)


def _left_out_lines(left_out: Iterable[str]) -> list[str]:
    return [f"left out   {printable(each)}" for each in left_out]


def _checked_out(args: ExportOptions) -> Path:
    """Refuse formats that are none, files of other ones, and to write over a file."""
    out, kind = args.out, args.kind
    if out is None:
        raise common.UsageError("--out is missing: give a file, or a folder with --bundle")
    if kind not in _ENDINGS:
        raise common.UsageError(f"--format must be one of {', '.join(_ENDINGS)}, got {kind!r:.80}")
    common.check_output(out, "--out", _ENDINGS[kind])
    if out.is_file() and not args.force:
        raise common.UsageError(f"{printable(out)} exists: add --force to write over it")
    return out


def _write_graph(
    topology: hn.TopologicalMap,
    graph: RouteGraph,
    aim: targets.Fleet | targets.Bundle | None,
    out: Path,
    frame: str,
) -> tuple[str, ...]:
    """Write a graph, or for Nav2 what has been made of it; return what the file does not hold."""
    if isinstance(aim, targets.Fleet):
        return aim.write(topology, graph, out)
    if aim is not None:
        return hn.graphs.export_bundle(topology, graph, out, frame=frame, **aim._asdict())
    hn.graphs.export_nav2(graph, out, frame=frame)
    return ()


def _write_parts(
    topology: hn.TopologicalMap, kind: str, files: tuple[Path, Path], frame: str
) -> tuple[dict[str, Any], list[str]]:
    """Write rooms or places, and return the figures and lines that are printed of them."""
    out, map_file = files
    if kind == "rooms":
        rooms = topology.rooms
        hn.export_rooms(rooms, out, frame=frame)
        counts = {"rooms": int(rooms.is_listed.sum()), "doors": len(rooms.listed_doors)}
    elif kind == "indoorgml":
        return _write_indoorgml(topology, *files)
    else:
        hn.export_places(topology, out, frame=frame)
        counts = {"places": topology.n_places, "arcs": topology.n_arcs}
    grid = topology.grid
    counted = ", ".join(f"{count:,} {name}" for name, count in counts.items())
    lines = [
        f"file       {printable(out)}, {counted}",
        f"map        {printable(grid.name)}, robot radius {grid.robot_radius_m:g} m",
    ]
    return counts | {"file": str(out), "map": str(map_file)}, lines


def _write_indoorgml(
    source: hn.TopologicalMap | Building, out: Path, map_file: Path
) -> tuple[dict[str, Any], list[str]]:
    """Write IndoorGML, and return the figures and lines that are printed of it."""
    left_out = hn.ext.fleet.export_indoorgml(source, out)
    layers = hn.ext.fleet.load_indoorgml(out).layers
    counts = {name: (len(each), each.number_of_edges()) for name, each in layers.items()}
    lines = [f"file       {printable(out)}"]
    lines += [f"{name:<10} {n:,} cells, {m:,} edges" for name, (n, m) in counts.items()]
    layers_of = {name: {"cells": n, "edges": m} for name, (n, m) in counts.items()}
    figures = {"file": str(out), "map": str(map_file), "layers": layers_of}
    return figures | {"left_out": list(left_out)}, [*lines, *_left_out_lines(left_out)]


def _summary(out: Path, graph: RouteGraph, judged: GraphReport | None) -> list[str]:
    grid, counts = graph.grid, _counts(graph)
    lines = [
        f"graph      {printable(out)}, {graph.n_nodes:,} nodes, {graph.n_edges:,} edges",
        f"map        {printable(grid.name)}, robot radius {grid.robot_radius_m:g} m",
        f"nodes      {', '.join(f'{count:,} {kind}' for kind, count in counts.items())}",
    ]
    if judged is not None:
        lines += [
            f"pairs      {judged.pairs:,}, {judged.in_sight:.1%} of them in sight of each other",
            f"best       {_line(judged.best)}",
            f"nearest    {_line(judged.nearest)}",
        ]
    return lines


def _ids_line(graph: RouteGraph) -> list[str]:
    """Return a line if Nav2's messages cannot hold all ids of a graph."""
    from hybridnav.messages import MOST_ID  # noqa: PLC0415 - on demand

    most = max(int(ids.max(initial=0)) for ids in graph.ids)
    if most <= MOST_ID:
        return []
    held = f"messages of ComputeRoute hold {MOST_ID:,}"
    return [f"ids        up to {most:,}; {held}: for these, give a larger --spacing"]


def _line(excess: Excess) -> str:
    return (
        f"routes longer by {excess.mean:.2%} on average, {excess.p95:.1%} at the 95th percentile, "
        f"{excess.greatest:.1%} at most; {excess.solved:.1%} solved"
    )


def _counts(graph: RouteGraph) -> dict[str, int]:
    return {kind: graph.kinds.count(kind) for kind in dict.fromkeys(graph.kinds)}


def _figures(graph: RouteGraph, judged: GraphReport | None) -> dict[str, Any]:
    report = None if judged is None else asdict(judged)
    return {
        "nodes": graph.n_nodes,
        "edges": graph.n_edges,
        "kinds": _counts(graph),
        "report": report,
    }
