"""Reader of VDMA's Layout Interchange Format, version 1. Public: `export_lif`."""

import itertools
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime, timezone
from typing import Any

from hybridnav._base.files import NewFile
from hybridnav._base.typing import PathLike
from hybridnav._version import __version__
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.ext.fleet import BuildingGraph, FloorGraph, Link, LinkEnd, LinkKind, join_links
from hybridnav.ext.fleet.files import rmf_read as rmf
from hybridnav.ext.fleet.files.rmf_write import speed_limit_of
from hybridnav.ext.fleet.link_nodes import rides_between
from hybridnav.ext.fleet.links import DIRECTIONS
from hybridnav.graphs import WaypointGraph
from hybridnav.graphs.files.json_graphs import json_errors
from hybridnav.graphs.gather import Gathered, pair_of, shown
from hybridnav.maps.checks import checked_type

Point = tuple[float, float]
_MOST_BYTES, _MOST_VALUES = 3 * 2**24, 2**22
"""Most characters of a file, and most values, counted by its commas and brackets: it is read as a
whole."""
_KINDS: tuple[LinkKind, ...] = ("lift", "stairs", "ramp")


def is_lif(text: str) -> bool:
    """Return whether a text of JSON has the keys of a layout."""
    return '"metaInformation"' in text and '"layouts"' in text


def read_lif(text: str, where: str, name: str) -> BuildingGraph:
    """Read layouts: one floor for each `layoutLevelId`, or for each layout that has none.

    `where`: what messages begin with; `name`: name of a building that has none. Returns floors in
    the order of the file, in its one frame. Edges between two floors become links between their
    nodes: those of one `edgeName` one link, of the kind with which that begins, or else a lift, one
    way if none of them leads back. Times are not stated. Raises `MapError` when it is not of this
    form.
    """
    data = _parsed(text, where)
    floors: dict[str, Gathered] = {}
    floor_of: dict[str, str] = {}
    point_of: dict[str, Point] = {}
    layouts = _layouts(data, where)
    for at, floor, layout in layouts:
        gathered = floors.setdefault(floor, Gathered(f"{where}, level {shown(floor)}"))
        if len(floors) > rmf.MOST_FLOORS:
            raise MapError(f"{where}: more than {rmf.MOST_FLOORS} levels are not read")
        stations = _stations(layout, at)
        for node in _entries(layout, "nodes", at):
            node_id = _text(node, "nodeId", at)
            point = pair_of(node.get("nodePosition"))
            facts = {key: value for key, value in node.items() if key != "nodePosition"}
            facts |= _id_in(node_id, f"{floor}/")
            if node_id in stations:
                facts["stations"] = stations[node_id]
            if isinstance(node.get("nodeName"), str):
                facts["name"] = node["nodeName"]
            gathered.add_node(node_id, point, facts)
            floor_of[node_id] = floor
            if point is not None:
                point_of[node_id] = point
    crossing = _add_edges(layouts, floors, floor_of)
    kept = {floor: gathered for floor, gathered in floors.items() if gathered.has_nodes}
    if not kept:
        raise MapError(f"{where}: no layout has a node with x and y in metres")
    graphs = [
        FloorGraph(name=floor, graph=WaypointGraph(**gathered.fields("lif", floor)))
        for floor, gathered in kept.items()
    ]
    meta = rmf.mapping_of(data.get("metaInformation"), where, "metaInformation")
    title = str(meta.get("projectIdentification") or name)
    links = links_between(crossing, floor_of, point_of, list(kept))
    rmf.check_link_count(len(links), where)
    return BuildingGraph(name=title, floors=tuple(graphs), links=tuple(links))


def _parsed(text: str, where: str) -> dict[str, Any]:
    if len(text) > _MOST_BYTES:
        raise MapError(f"{where}: a layout of more than {_MOST_BYTES} bytes is not read")
    with json_errors(text, where, _MOST_VALUES):
        data = json.loads(text)
    if isinstance(data, dict) and "origins" in data:
        meta = data.get("metaInformation")
        version = meta.get("lifVersion") if isinstance(meta, dict) else None
        raise MapError(
            f"{where}: LIF {shown(str(version or '2.0.0'))} is not read, 1.0.0 is: export the "
            "layout in that version"
        )
    if not isinstance(data, dict) or "layouts" not in data:
        raise MapError(f"{where}: expected a layout in the Layout Interchange Format, 'layouts'")
    return data


def _layouts(data: dict[str, Any], where: str) -> list[tuple[str, str, dict[str, Any]]]:
    """Return each layout, after what messages about it begin with, and its floor."""
    layouts = []
    for number, entry in enumerate(rmf.list_of(data.get("layouts"), where, "layouts")):
        at = f"{where}, layout {number}"
        layout = rmf.mapping_of(entry, at, "the layout")
        floor = str(layout.get("layoutLevelId", layout.get("layoutId", number)))
        layouts.append((at, floor, layout))
    return layouts


def _entries(layout: dict[str, Any], key: str, where: str) -> Iterable[dict[str, Any]]:
    for number, entry in enumerate(rmf.list_of(layout.get(key), where, key)):
        yield rmf.mapping_of(entry, f"{where}, {key} {number}", f"an entry of {key}")


def _stations(layout: dict[str, Any], where: str) -> dict[str, list[str]]:
    stations: dict[str, list[str]] = {}
    for station in _entries(layout, "stations", where):
        name = str(station.get("stationName") or _text(station, "stationId", where))
        for node in rmf.list_of(station.get("interactionNodeIds"), where, "interactionNodeIds"):
            stations.setdefault(str(node), []).append(name)
    return stations


def _text(entry: dict[str, Any], key: str, where: str) -> str:
    value = entry.get(key)
    if not isinstance(value, str):
        raise MapError(f"{where}: expected {key} as a text, got {value!r:.60}")
    return value


def _add_edges(
    layouts: list[tuple[str, str, dict[str, Any]]],
    floors: dict[str, Gathered],
    floor_of: dict[str, str],
) -> list[tuple[str, str, str]]:
    """Add the edges inside floors; return name, start and end of the others."""
    crossing = []
    for at, own, layout in layouts:
        for edge in _entries(layout, "edges", at):
            ends = _text(edge, "startNodeId", at), _text(edge, "endNodeId", at)
            on = [floor_of.get(end) for end in ends]
            if on[0] is not None and on[1] is not None and on[0] != on[1]:
                crossing.append((str(edge.get("edgeName", edge.get("edgeId", ""))), *ends))
                continue
            facts = {key: value for key, value in edge.items() if not key.endswith("NodeId")}
            facts |= _speed(edge) | _id_in(edge.get("edgeId"), f"{own}/", "/edge")
            floors[on[0] or own].add_edge(ends, facts, name=edge.get("edgeId"))
    return crossing


def _id_in(text: Any, before: str, after: str = "") -> dict[str, int]:
    """Return the whole number that an id holds as `export_lif` writes it, as the fact `id`."""
    if not isinstance(text, str) or not (text.startswith(before) and text.endswith(after)):
        return {}
    return rmf.id_fact(text[len(before) : len(text) - len(after)])


def _speed(edge: dict[str, Any]) -> dict[str, Any]:
    kinds = edge.get("vehicleTypeEdgeProperties")
    limits = [
        limit
        for kind in (kinds if isinstance(kinds, list) else [])
        if isinstance(kind, dict)
        for limit in [kind.get("maxSpeed")]
        if isinstance(limit, int | float) and not isinstance(limit, bool) and limit > 0
    ]
    return {"speed_limit": min(limits)} if limits else {}


def links_between(
    crossing: list[tuple[str, str, str]],
    floor_of: dict[str, str],
    point_of: dict[str, Point],
    floors: list[str],
) -> list[Link]:
    """Return a link for the edges of each name."""
    place = {floor: at for at, floor in enumerate(floors)}
    stops: dict[str, dict[str, Point]] = {}
    is_up: dict[str, set[bool]] = {}
    for name, *ends in crossing:
        known = [end for end in ends if floor_of[end] in place and end in point_of]
        for end in known:
            stops.setdefault(name, {}).setdefault(floor_of[end], point_of[end])
        if len(known) > 1:
            tail, head = (place[floor_of[end]] for end in known)
            is_up.setdefault(name, set()).add(tail < head)
    stops = {name: points_on for name, points_on in stops.items() if len(points_on) > 1}
    own_names = _own_names(list(stops))
    links = []
    for name, points_on in stops.items():
        ordered = sorted(points_on, key=place.__getitem__)
        stopped = tuple(LinkEnd(floor, points_on[floor]) for floor in ordered)
        kind, ways = _split(name)[0] or "lift", is_up.get(name, set())
        one_way = DIRECTIONS[ways == {False}] if len(ways) == 1 else None
        links.append(Link(name=own_names[name], kind=kind, ends=stopped, one_way=one_way))
    return links


def _split(name: str) -> tuple[LinkKind | None, str]:
    """Return the kind with which the name of edges begins, if it is one, and what follows."""
    word, _, rest = name.partition(" ")
    kind = next((kind for kind in _KINDS if kind == word and rest), None)
    return kind, name if kind is None else rest


def _own_names(names: list[str]) -> dict[str, str]:
    """Return the name of each link without its kind, where no other link is called so."""
    rest = {name: _split(name)[1] for name in names}
    count = Counter(rest.values())
    own = {name: rest[name] if count[rest[name]] == 1 else name for name in names}
    return own if len(set(own.values())) == len(names) else {name: name for name in names}


# Writer of VDMA's Layout Interchange Format, version 1.0.0.

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

    The file is that of the guideline "LIF - Layout Interchange Format", version 1.0.0 of March 2024
    (VDMA), as the schema of ConstantinUp/LIF_Schema has it. There is a layout for each floor, with
    `layoutLevelId`, and a node for each node, with the floor as `mapId` and its name as `nodeName`.
    Each edge is an edge. A link is edges from floor to floor, as it leads, whose `edgeName` is its
    kind and name: "the end node can be located in another layout". Rooms are no stations, and there
    are none.

    Parameters
    ----------
    building
        The floors and links, all floors in one frame. Ids are "FLOOR/NODE" and "FLOOR/EDGE/edge",
        by the ids of the graph where these are unique on the floor, else by their places.
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
        Facts left out of the file, one line each.

    Raises
    ------
    InvalidValueError
        When this is no building graph, no vehicle type is given, or the time has no zone.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph, export_lif
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor("0", hn.HybridPlanner(topology))])
    >>> export_lif(building_graph(house), "house.lif.json", vehicle_types=["Maker.Carrier"])
    ('elevations of floors',)
    """
    checked_type("building", building, BuildingGraph)
    file = NewFile.named(path, "layout", "a layout", (".json", ".lif"))
    if isinstance(vehicle_types, str) or not vehicle_types or not all(map(_is_type, vehicle_types)):
        raise InvalidValueError(
            f"vehicle_types is {vehicle_types!r:.80}, expected one or more texts, such as "
            "'MANUFACTURER.SERIES'"
        )
    exported_at = datetime.now(timezone.utc) if exported_at is None else exported_at
    if exported_at.tzinfo is None:
        raise InvalidValueError(f"exported_at is {exported_at}, expected a time with a time zone")
    layouts = _lif_out_layouts(join_links(building), list(dict.fromkeys(vehicle_types)))
    meta = {
        "projectIdentification": building.name,
        "creator": f"hybridnav {__version__}",
        "exportTimestamp": f"{exported_at.astimezone(timezone.utc):%Y-%m-%dT%H:%M:%S.%f}"[:-4]
        + "Z",
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


def _lif_out_layouts(building: BuildingGraph, types: list[str]) -> list[dict[str, Any]]:
    layouts: list[dict[str, Any]] = []
    ids = {floor.name: _floor_ids(floor) for floor in building.floors}
    for floor in building.floors:
        node_ids = ids[floor.name][0]
        nodes = [_node(floor, node, node_ids[node], types) for node in range(floor.graph.n_nodes)]
        layouts.append(
            {
                "layoutId": floor.name,
                "layoutName": f"{building.name} {floor.name}",
                "layoutVersion": "1",
                "layoutLevelId": floor.name,
                "nodes": nodes,
                "edges": list(_edges(floor, ids[floor.name], types)),
                "stations": [],
            }
        )
    at = {floor.name: number for number, floor in enumerate(building.floors)}
    for link in building.links:
        for one, other in rides_between(building, link):
            ends = ids[one[0].name][0][one[1]], ids[other[0].name][0][other[1]]
            edge = {"edgeId": f"{link.kind}/{link.name}/{one[0].name}/{other[0].name}"}
            edge |= {"edgeName": f"{link.kind} {link.name}"}
            layouts[at[one[0].name]]["edges"].append(edge | _between(ends, types, None))
    return layouts


def _floor_ids(floor: FloorGraph) -> tuple[list[str], list[str]]:
    nodes, edges = (list(map(str, _unique(ids))) for ids in floor.graph.ids)
    return [f"{floor.name}/{node}" for node in nodes], [f"{floor.name}/{e}/edge" for e in edges]


def _unique(ids: Sequence[Any]) -> Sequence[Any]:
    """Return whole numbers as they are, and free ones for others; places where two are equal."""
    numbers = [each for each in ids if type(each) is int]
    if len(set(numbers)) < len(numbers):
        return range(len(ids))
    free = itertools.count(max(numbers, default=-1) + 1)
    return [each if type(each) is int else next(free) for each in ids]


def _node(floor: FloorGraph, node: int, node_id: str, types: list[str]) -> dict[str, Any]:
    x, y = floor.graph.points[node].round(_DECIMALS).tolist()
    name = floor.graph.node_facts.get(node, {}).get("name")
    return {
        "nodeId": node_id,
        **({"nodeName": name} if isinstance(name, str) and name else {}),
        "mapId": floor.name,
        "nodePosition": {"x": x + 0.0, "y": y + 0.0},
        "vehicleTypeNodeProperties": [{"vehicleTypeId": name} for name in types],
    }


def _edges(
    floor: FloorGraph, ids: tuple[list[str], list[str]], types: list[str]
) -> Iterator[dict[str, Any]]:
    for edge, (tail, head) in enumerate(floor.graph.edges.tolist()):
        facts = floor.graph.edge_facts.get(edge, {})
        door = facts.get("door_name")
        ends = ids[0][tail], ids[0][head]
        door_text = {"edgeDescription": f"door {door}"} if isinstance(door, str) and door else {}
        yield ({"edgeId": ids[1][edge]} | door_text | _between(ends, types, speed_limit_of(facts)))


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
