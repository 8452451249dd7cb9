"""`hybridnav export` for a building of several floors."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any

import hybridnav as hn
from hybridnav._base.files import printable
from hybridnav.cli.common import answer, progress_bar, stage, timings
from hybridnav.cli.errors import UsageError
from hybridnav.ext.fleet.command import BuildingSource

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hybridnav.ext.graphs.fleet_options import Fleet

EXPORT_OPTIONS = frozenset(
    {
        *("map_file", "out", "kind", "nodes", "spacing_m", "stretch", "anchor", "vehicles"),
        *("no_doors", "preset", "robot_radius_m", "seed", "max_cells", "as_json"),
    }
)
"""Parameters of `hybridnav export` that mean something for a building."""


def export_building(fleet: Fleet | None, given: Mapping[str, Any]) -> None:
    """Write the graph of a building, and print a summary.

    Parameters
    ----------
    fleet
        Options of the format; None for a format of one map.
    given
        The values of the parameters of `hybridnav export` by their names.
    """
    if fleet is None:
        raise UsageError(
            f"--format {given['kind']} is for one map, and this is a building: take rmf, osm or lif"
        )
    from hybridnav.ext.fleet import align_floors  # noqa: PLC0415 - on demand

    seconds: dict[str, float] = {}
    building = BuildingSource.of({**given, "overrides": ()}).load(seconds)
    began = time.perf_counter()
    with progress_bar("building the graphs") as advance:
        graph = hn.building_graph(
            building,
            name=given["map_file"].stem,
            nodes=given["nodes"],
            spacing_m=given["spacing_m"],
            stretch=given["stretch"],
            seed=given["seed"] or 0,
            progress=advance,
        )
    seconds["graph"] = round(time.perf_counter() - began, 6)
    out = given["out"]
    with stage(f"writing {out}", seconds, "write"):
        left_out = fleet.write_building(align_floors(graph), out)
    figures = {
        "graph": str(out),
        "map": str(given["map_file"]),
        "floors": {
            floor.name: {"nodes": floor.graph.n_nodes, "edges": floor.graph.n_edges}
            for floor in graph.floors
        },
        "links": [link.name for link in graph.links],
        "left_out": list(left_out),
    }
    if given["as_json"]:
        answer(json.dumps(figures | {"seconds": seconds}, allow_nan=False) + "\n")
        return
    lines = [f"graph      {printable(out)}"]
    for number, floor in enumerate(graph.floors):
        counts = f"{floor.graph.n_nodes:,} nodes, {floor.graph.n_edges:,} edges"
        lines.append(f"{'' if number else 'floors':<10} {printable(floor.name)}: {counts}")
    links = ", ".join(printable(link.name) for link in graph.links) or "none"
    lines += [f"links      {links}", f"robot      radius {building.robot_radius_m:g} m"]
    lines += [f"left out   {printable(each)}" for each in left_out]
    lines.append(f"seconds    {timings(seconds)}")
    answer("\n".join(lines) + "\n")
