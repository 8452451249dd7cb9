"""Writer of VDMA's Layout Interchange Format, version 1.0.0."""

from __future__ import annotations

import itertools
import json
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from hybridnav._version import __version__
from hybridnav.building import BuildingGraph, join_links
from hybridnav.building.link_nodes import nodes_of_link
from hybridnav.errors import InvalidValueError
from hybridnav.grid.checks import checked_type
from hybridnav.io.new_file import NewFile
from hybridnav.io.rmf_out import speed_limit_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hybridnav._typing import PathLike
    from hybridnav.building import FloorGraph

LIF_VERSION = "1.0.0"
_DECIMALS = 6


def export_lif(
    building: BuildingGraph,
    path: PathLike,
    *,
    vehicle_types: Sequence[str],
    exported_at: datetime | None = None,
) -> tuple[str, ...]:
    """Write a layout for a master control that speaks VDA 5050.

    The file is that of the guideline "LIF - Layout Interchange Format", version 1.0.0 of March
    2024 (VDMA), as the schema of ConstantinUp/LIF_Schema has it: a layout for each floor, with
    `layoutLevelId`; a node for each node, with the floor as `mapId` and its name as `nodeName`; an
    edge for each edge. A link is edges from floor to floor, both ways, whose `edgeName` is its kind
    and name: "the end node can be located in another layout". Rooms are no stations, and there are
    none.

    Parameters
    ----------
    building
        The floors and links, all floors in one frame. Ids are "FLOOR/NODE".
    path
        The file, ending in .json or .lif; one that exists is replaced.
    vehicle_types
        Types of vehicles that may use all nodes and edges, each "MANUFACTURER.SERIES": to a master
        control, nodes and edges are for the types that they name.
    exported_at
        Time that the file states, with a time zone; None for now.

    Returns
    -------
    tuple of str
        What the file does not hold, one line each.

    Raises
    ------
    InvalidValueError
        When this is no building graph, no vehicle type is given, or the time has no zone.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> import networkx as nx
    >>> from hybridnav.building import BuildingGraph, FloorGraph
    >>> plain = nx.Graph()
    >>> plain.add_node("dock", x=0.5, y=1.0)
    >>> plain.add_node("gate", x=3.5, y=5.0)
    >>> plain.add_edge("dock", "gate")
    >>> floor = FloorGraph(name="0", graph=hn.WaypointGraph.from_networkx(plain))
    >>> building = BuildingGraph(name="house", floors=(floor,))
    >>> hn.export_lif(building, "house.lif.json", vehicle_types=["Maker.Carrier"])
    ()
    """
    checked_type("building", building, BuildingGraph)
    file = NewFile.named(path, "layout", "a layout", (".json", ".lif"))
    if isinstance(vehicle_types, str) or not vehicle_types or not all(map(_is_type, vehicle_types)):
        raise InvalidValueError(
            f"vehicle_types is {vehicle_types!r:.80}, expected one or more texts, such as "
            "'MANUFACTURER.SERIES'"
        )
    exported_at = datetime.now(UTC) if exported_at is None else exported_at
    if exported_at.tzinfo is None:
        raise InvalidValueError(f"exported_at is {exported_at}, expected a time with a time zone")
    layouts = _layouts(join_links(building), list(dict.fromkeys(vehicle_types)))
    meta = {
        "projectIdentification": building.name,
        "creator": f"hybridnav {__version__}",
        "exportTimestamp": f"{exported_at.astimezone(UTC):%Y-%m-%dT%H:%M:%S.%f}"[:-4] + "Z",
        "lifVersion": LIF_VERSION,
    }
    head = f'{{"metaInformation": {json.dumps(meta)}, "layouts": [\n'
    text = head + ",\n".join(map(_lines, layouts)) + "\n]}\n"
    file.write(text.encode())
    return tuple(_left_out(building))


def _is_type(name: Any) -> bool:
    return isinstance(name, str) and bool(name)


def _lines(layout: dict[str, Any]) -> str:
    """Return a layout with one node or edge a line, so that people can compare files."""
    parts = {key: value for key, value in layout.items() if key not in {"nodes", "edges"}}
    text = json.dumps(parts)[:-1]
    for key in ("nodes", "edges"):
        entries = ",\n".join(json.dumps(entry, allow_nan=False) for entry in layout[key])
        text += f', "{key}": [\n{entries}\n]' if entries else f', "{key}": []'
    return text + "}"


def _layouts(building: BuildingGraph, types: list[str]) -> list[dict[str, Any]]:
    layouts: list[dict[str, Any]] = []
    for floor in building.floors:
        nodes = [_node(floor, node, types) for node in range(floor.graph.n_nodes)]
        layouts.append(
            {
                "layoutId": floor.name,
                "layoutName": f"{building.name} {floor.name}",
                "layoutVersion": "1",
                "layoutLevelId": floor.name,
                "nodes": nodes,
                "edges": list(_edges(floor, types)),
                "stations": [],
            }
        )
    at = {floor.name: number for number, floor in enumerate(building.floors)}
    for link in building.links:
        stops = nodes_of_link(building, link)
        pairs = list(itertools.pairwise(stops))
        for one, other in [*pairs, *(pair[::-1] for pair in pairs)]:
            ends = _node_id(*one), _node_id(*other)
            edge = {"edgeId": f"{link.kind}/{link.name}/{one[0].name}/{other[0].name}"}
            edge |= {"edgeName": f"{link.kind} {link.name}"}
            layouts[at[one[0].name]]["edges"].append(edge | _between(ends, types, None))
    return layouts


def _node_id(floor: FloorGraph, node: int) -> str:
    return f"{floor.name}/{node}"


def _node(floor: FloorGraph, node: int, types: list[str]) -> dict[str, Any]:
    x, y = floor.graph.points[node].round(_DECIMALS).tolist()
    name = floor.graph.node_facts.get(node, {}).get("name")
    return {
        "nodeId": _node_id(floor, node),
        **({"nodeName": name} if isinstance(name, str) and name else {}),
        "mapId": floor.name,
        "nodePosition": {"x": x + 0.0, "y": y + 0.0},
        "vehicleTypeNodeProperties": [{"vehicleTypeId": name} for name in types],
    }


def _edges(floor: FloorGraph, types: list[str]) -> Iterator[dict[str, Any]]:
    for edge, (tail, head) in enumerate(floor.graph.edges.tolist()):
        facts = floor.graph.edge_facts.get(edge, {})
        door = facts.get("door_name")
        ends = _node_id(floor, tail), _node_id(floor, head)
        known = {"edgeDescription": f"door {door}"} if isinstance(door, str) and door else {}
        yield (
            {"edgeId": f"{floor.name}/{edge}/edge"}
            | known
            | _between(ends, types, speed_limit_of(facts))
        )


def _between(nodes: tuple[str, str], types: list[str], speed: float | None) -> dict[str, Any]:
    limit = {} if speed is None else {"maxSpeed": speed}
    properties = [{"vehicleTypeId": name, "rotationAllowed": True} | limit for name in types]
    start, end = nodes
    return {"startNodeId": start, "endNodeId": end, "vehicleTypeEdgeProperties": properties}


def _left_out(building: BuildingGraph) -> Iterator[str]:
    for link in building.links:
        if link.wait_s or link.ride_s or link.cost_m:
            yield f"{link.kind} {link.name}: its waiting time, ride time and cost"
    n_doors = sum(len(floor.doors) for floor in building.floors)
    if n_doors:
        yield f"lines of {n_doors} doors and openings: an edge through a door has its name as text"
    n_areas = sum(len(floor.areas) for floor in building.floors)
    if n_areas:
        yield f"outlines of {n_areas} rooms"
    if any(floor.elevation_m is not None for floor in building.floors):
        yield "elevations of floors"
    bent = sum(len(floor.graph.lines) for floor in building.floors)
    if bent:
        yield f"lines of {bent} edges: edges are straight"
