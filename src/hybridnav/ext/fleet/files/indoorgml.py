"""IndoorGML 2.0 as JSON: cells and their boundaries, and the dual graph of both, in layers.

By the core schema of the draft of 2026, `indoorjson.core.schema.json`. Two of its facts are easy to
miss: cell names stand under `cellSpaceName:`, and an edge has two different ends.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.files import NewFile, printable
from hybridnav._base.trig import dist
from hybridnav._base.typing import LongArray, PathLike
from hybridnav._base.yaml_file import read_text
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.ext.fleet import BuildingGraph, FloorGraph
from hybridnav.ext.fleet.files.lif import links_between
from hybridnav.ext.fleet.files.rmf_read import list_of, mapping_of
from hybridnav.graphs import WaypointGraph
from hybridnav.graphs.files.json_graphs import finite, json_errors
from hybridnav.graphs.gather import Gathered, number_of, pair_of, shown
from hybridnav.maps import CellClass
from hybridnav.rooms import Door
from hybridnav.topology import TopologicalMap

if TYPE_CHECKING:
    import networkx as nx

    from hybridnav.ext.fleet import Building

Point = tuple[float, float]
Line = list[Point]
_DECIMALS = 6
_SHOWN = 5
"""Names in a line about what is left out."""
_MOST_BYTES, _MOST_VALUES = 2**27, 2**24
_NAMES = ("cellSpaceName:", "cellSpaceName")
"""The draft's key has a colon; files of others leave it out."""


@dataclass(frozen=True, eq=False)
class IndoorModel:
    """Cells, their boundaries and their dual graphs, as IndoorGML states them.

    Examples
    --------
    >>> from hybridnav.ext.fleet import export_indoorgml, load_indoorgml
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> _ = export_indoorgml(topology, "figure1.json")
    >>> model = load_indoorgml("figure1.json")
    >>> list(model.layers), model.layers["places"].number_of_nodes() == topology.n_places
    (['places'], True)
    """

    name: str
    """Id of the whole."""
    layers: dict[str, nx.MultiGraph[str]]
    """The dual graph of each layer, an `nx.MultiDiGraph` where it is directed. Nodes are ids of
    cells, with `kind`, `name`, `level`, `poi`, `point` (x, y) in metres and `polygon`, rings of
    points, as far as they are known. Keys of edges are their ids, with `weight`, and of their
    boundary `boundary`, its id, `kind`, `line`, points in metres, and `is_virtual`. Boundaries
    without an edge are in `graph["boundaries"]`, by id, with the `cells` that they bound."""
    connections: tuple[tuple[str, str, str], ...] = ()
    """Expression, such as CONTAINS, and the two cells that it connects."""


def export_indoorgml(
    source: TopologicalMap | Building | IndoorModel, path: PathLike
) -> tuple[str, ...]:
    """Write the dual graph of a map or building as IndoorGML 2.0, in JSON.

    The layer `places` has a cell for each place and an edge for each arc, whose dual is the line of
    its boundary; its weight is the metres through it. If the map has rooms, the layer `rooms` has
    them and their doors, and each room CONTAINS its places. Floors are the `level` of cells. A link
    is a `TransferSpace` at each of its ends, with an edge from floor to floor. Edges lead both
    ways. A boundary inside one place, round what the place encloses, has no edge: an edge has two
    different ends.

    Parameters
    ----------
    source
        The map, as floor 0, the building, each floor in the frame of its own map, or a model.
    path
        The file, ending in .json; one that exists is replaced.

    Returns
    -------
    tuple of str
        Facts left out of the file, one line each.

    Raises
    ------
    InvalidValueError
        When this is no map, building or model.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.ext.fleet import export_indoorgml
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> export_indoorgml(topology, "figure1.json")
    ()
    """
    from hybridnav.ext.fleet import Building  # noqa: PLC0415 - readers of graphs need none of it

    file = NewFile.named(path, "indoor model", "IndoorGML", (".json",))
    split: list[str] = []
    left_out: list[str] = []
    floors = {"0": source} if isinstance(source, TopologicalMap) else {}
    if isinstance(source, TopologicalMap):
        model = _model_of(source.grid.name, floors, split)
    elif isinstance(source, Building):
        floors = {floor.name: floor.planner.topology for floor in source.floors}
        model = _model_of(Path(path).stem, floors, split)
        left_out = list(_add_links(model.layers["places"], source))
    elif isinstance(source, IndoorModel):
        model = source
    else:
        raise InvalidValueError(
            f"source is {type(source).__name__}, expected a TopologicalMap, a Building or an "
            "IndoorModel"
        )
    labels = [floor.room_labels for floor in floors.values()]
    if n_rules := sum(len(each.one_way) for each in labels if each is not None):
        left_out.append(f"directions of {n_rules} one-way doors and lines")
    if split:
        names = ", ".join(split[:_SHOWN]) + ", ..." * (len(split) > _SHOWN)
        left_out.append(f"all but the largest part of the outlines of {names}")
    head = {"id": model.name or "indoor", "featureType": "IndoorFeatures"}
    text = json.dumps(head, allow_nan=False)[:-1] + ', "layers": [\n'
    text += ",\n".join(_layer_text(name, layer) for name, layer in model.layers.items())
    joined = ",\n".join(json.dumps(each) for each in _connections(model))
    file.write(f'{text}\n], "layerConnections": [\n{joined}\n]}}\n'.encode(errors="replace"))
    return tuple(left_out)


# From a map to the model.


def _model_of(name: str, floors: dict[str, TopologicalMap], split: list[str]) -> IndoorModel:
    import networkx as nx  # noqa: PLC0415 - on demand

    layers: dict[str, nx.MultiGraph[str]] = {"places": nx.MultiGraph(boundaries={})}
    contains: list[tuple[str, str, str]] = []
    for number, (floor, topology) in enumerate(floors.items()):
        _add_places(layers["places"], topology, number, floor)
        if topology.has_rooms:
            rooms = layers.setdefault("rooms", nx.MultiGraph(boundaries={}))
            contains += _add_rooms(rooms, layers["places"], topology, (number, floor), split)
    return IndoorModel(name, layers, tuple(contains))


def _add_places(
    layer: nx.MultiGraph[str], topology: TopologicalMap, number: int, floor: str
) -> None:
    level, points = topology.level, topology.positions.round(_DECIMALS).tolist()
    polygons = _polygons(topology)
    is_free = topology.classes == CellClass.FREE
    names = [f"P{number}.{place}" for place in topology.place_ids.tolist()]
    for place, cell in enumerate(names):
        kind = "NavigableSpace" if is_free[place] else "NonNavigableSpace"
        facts = {"kind": kind, "level": floor, "poi": False, "point": tuple(points[place])}
        layer.add_node(cell, polygon=polygons[place], **facts)
    weights = level.through_m.round(_DECIMALS).tolist()
    for arc, (one, other) in enumerate(level.arcs.tolist()):
        common = {
            "kind": "NavigableBoundary" if is_free[one] and is_free[other] else "CellBoundary",
            "line": _line_of(topology, level.boundary(arc)),
            "is_virtual": True,
        }
        boundary = f"A{number}.{int(topology.arc_ids[arc])}"
        if one == other:
            layer.graph["boundaries"][boundary] = common | {"cells": [names[one]]}
        else:
            facts = {"weight": weights[arc], "boundary": boundary} | common
            layer.add_edge(names[one], names[other], f"{boundary}.edge", **facts)


def _polygons(topology: TopologicalMap) -> list[list[Line]]:
    """Return the rings of each place, its outer one first."""
    import shapely  # noqa: PLC0415 - on demand

    fields = np.pad(topology.level.field_of.reshape(topology.grid.shape), 1, constant_values=-1)
    upright = np.argwhere(fields[1:-1, 1:] != fields[1:-1, :-1])
    level = np.argwhere(fields[1:, 1:-1] != fields[:-1, 1:-1])
    ends = np.concatenate([upright + np.array([1, 0]), level + np.array([0, 1])])
    merged = _merged(np.stack([np.concatenate([upright, level]), ends], axis=1))
    polygons: list[list[Line]] = [[] for _ in range(topology.n_places)]
    areas = shapely.polygonize([merged])
    for area in shapely.orient_polygons(areas, exterior_cw=True).geoms:  # rows run along y
        row, col = (int(each) for each in area.representative_point().coords[0])
        place = int(fields[row + 1, col + 1])
        if place >= 0:
            rings = [area.exterior, *area.interiors]
            polygons[place] = [_in_metres(topology, ring.simplify(0).coords) for ring in rings]
    return polygons


def _line_of(topology: TopologicalMap, pairs: LongArray) -> Line:
    """Return the line between the cell pairs of a boundary: its sides in one trail."""
    import networkx as nx  # noqa: PLC0415 - on demand
    import shapely  # noqa: PLC0415 - on demand

    first = pairs.max(axis=1)
    sides = np.stack([first, first + 1 - abs(pairs[:, 1] - pairs[:, 0])], axis=1)
    line = _merged(sides)
    if line.geom_type != "LineString":  # it touches itself at a corner
        plain: nx.Graph[Any] = nx.Graph()
        plain.add_edges_from((tuple(one), tuple(other)) for one, other in sides.tolist())
        trail = list(nx.eulerian_path(plain))
        line = shapely.LineString([trail[0][0], *(head for _, head in trail)])
    return _in_metres(topology, line.simplify(0).coords)


def _merged(sides: LongArray) -> Any:
    """Return lines of sides of cells, int64 (n, 2, 2), joined where two meet."""
    import shapely  # noqa: PLC0415 - on demand

    lines: Any = shapely.linestrings(sides)
    return shapely.line_merge(shapely.multilinestrings(lines))


def _in_metres(topology: TopologicalMap, positions: Iterable[Any]) -> Line:
    points = topology.grid.frame.points_of_grid(np.array(list(positions), dtype=np.float64))
    return [(x + 0.0, y + 0.0) for x, y in points.round(_DECIMALS).tolist()]


def _add_rooms(
    layer: nx.MultiGraph[str],
    places: nx.MultiGraph[str],
    topology: TopologicalMap,
    floor: tuple[int, str],
    split: list[str],
) -> Iterator[tuple[str, str, str]]:
    """Add the rooms of a floor and their doors; yield which places each room contains, and add to
    `split` the rooms whose outline has several parts."""
    import shapely  # noqa: PLC0415 - on demand

    rooms, number = topology.rooms, floor[0]
    room_of = rooms.labels.label_of[tuple(topology.level.cells.T)]
    # A room of occupied cells alone has no place, and is none here.
    labels = np.unique(room_of[room_of >= 0]).tolist()
    ids = {rooms.names[label]: f"R{number}.{label}" for label in labels}
    for label, (name, cell) in zip(labels, ids.items(), strict=True):
        own = [f"P{number}.{place}" for place in topology.place_ids[room_of == label].tolist()]
        rings = [places.nodes[place]["polygon"] for place in own]
        polygons = [shapely.Polygon(outer, inner) for outer, *inner in rings]
        area = shapely.union_all(polygons)
        parts = sorted(getattr(area, "geoms", [area]), key=lambda part: part.area)
        split += [name] * (len(parts) > 1)
        facts = {"kind": "NavigableSpace", "name": name, "level": floor[1], "poi": False}
        point = tuple(round(each, _DECIMALS) for each in rooms.point_of(name))
        largest = shapely.orient_polygons(parts[-1]).simplify(0)
        polygon = [[*ring.coords] for ring in (largest.exterior, *largest.interiors)]
        layer.add_node(cell, point=point, polygon=polygon, **facts)
        yield from (("CONTAINS", cell, place) for place in own)
    for door in rooms.doors:
        if not door.is_gap:
            _add_door(layer, door, rooms.door_ends(door.number), (ids, number))


def _add_door(
    layer: nx.MultiGraph[str], door: Door, ends: Any, floor_ids: tuple[dict[str, str], int]
) -> None:
    ids, number = floor_ids
    cells = [ids[name] for name in door.rooms if name in ids]
    boundary = f"D{number}.{door.number}"
    facts: dict[str, Any] = {
        "kind": "NavigableBoundary" if door.passable else "CellBoundary",
        "line": [tuple(round(each, _DECIMALS) for each in end) for end in ends],
        "is_virtual": door.is_opening,
    }
    if len(set(cells)) < 2:  # noqa: PLR2004 - an edge has two ends
        layer.graph["boundaries"][boundary] = facts | {"cells": cells}
        return
    apart = dist(*(layer.nodes[cell]["point"] for cell in cells))
    facts |= {"weight": round(apart, _DECIMALS), "boundary": boundary}
    layer.add_edge(cells[0], cells[1], f"{boundary}.edge", **facts)


def _add_links(layer: nx.MultiGraph[str], building: Building) -> Iterator[str]:
    """Add the links of a building; yield what is left out."""
    numbers = {floor.name: number for number, floor in enumerate(building.floors)}
    for at, link in enumerate(building.links):
        stops = []
        for end in link.ends:
            topology = building.floors[numbers[end.floor]].planner.topology
            place = topology.place_at(topology.grid.frame.cell_of(*end.position_m))
            cell = f"L{at}.{numbers[end.floor]}"
            facts = {"kind": "TransferSpace", "level": end.floor, "poi": False}
            point = tuple(round(each, _DECIMALS) for each in end.position_m)
            layer.add_node(cell, name=f"{link.kind} {link.name}", point=point, **facts)
            beside = f"P{numbers[end.floor]}.{place}"
            apart = dist(point, layer.nodes[beside]["point"])
            layer.add_edge(beside, cell, f"{cell}.edge", weight=round(apart, _DECIMALS))
            stops.append((cell, end.floor))
        for (one, below), (other, above) in pairwise(stops):
            cost = link.charge_m(below, above, speed_m_s=building.speed_m_s)
            layer.add_edge(one, other, f"{one}-{other}.edge", weight=round(cost, _DECIMALS))
        if link.one_way:
            yield f"{link.kind} {link.label}: its direction"
        if math.isfinite(link.max_radius_m):
            yield f"{link.kind} {link.name}: the largest robot that fits in"
    if any(floor.elevation_m for floor in building.floors):
        yield "elevations of floors"


# From the model to the file.


def _layer_text(name: str, layer: nx.MultiGraph[str]) -> str:
    """Return a layer with one member a line, so that people can read and compare files."""
    bounds: dict[str, list[str]] = {cell: [] for cell in layer}
    connects: dict[str, list[str]] = {cell: [] for cell in layer}
    boundaries = dict(layer.graph.get("boundaries", {}))
    edges = []
    for one, other, key, facts in layer.edges(keys=True, data=True):
        ends = [layer.nodes[end].get("point") for end in (one, other)]
        edge = {"id": key, "featureType": "Edge", "weight": facts["weight"]}
        edge |= {"connects": [f"{one}.node", f"{other}.node"]}
        if None not in ends:
            edge["geometry"] = {"type": "LineString", "coordinates": ends}
        if "boundary" in facts:
            edge["duality"] = facts["boundary"]
            boundaries[facts["boundary"]] = facts | {"cells": [one, other], "duality": key}
        edges.append(edge)
        connects[one].append(key)
        connects[other].append(key)
    for boundary, facts in boundaries.items():
        for cell in facts["cells"]:
            bounds[cell].append(boundary)
    cells = [_cell(cell, facts, bounds[cell]) for cell, facts in layer.nodes(data=True)]
    nodes = [_node(cell, facts, connects[cell]) for cell, facts in layer.nodes(data=True)]
    lines = [_boundary(boundary, facts) for boundary, facts in boundaries.items()]
    theme = {"id": name, "featureType": "ThematicLayer", "semanticExtension": True}
    primal = {"id": f"{name}.primal", "featureType": "PrimalSpaceLayer"}
    dual = {"id": f"{name}.dual", "featureType": "DualSpaceLayer", "isLogical": False}
    dual["isDirected"] = layer.is_directed()
    return (
        f'{json.dumps(theme | {"theme": "Physical"})[:-1]}, "primalSpace": '
        f"{_members(primal, cellSpaceMember=cells, cellBoundaryMember=lines)},\n"
        f'"dualSpace": {_members(dual, nodeMember=nodes, edgeMember=edges)}}}'
    )


def _members(head: dict[str, Any], **members: list[dict[str, Any]]) -> str:
    text = json.dumps(head)[:-1]
    for key, each in members.items():
        listed = ",\n".join(json.dumps(one, allow_nan=False) for one in each)
        text += f', "{key}": [\n{listed}\n]'
    return text + "}"


def _cell(cell: str, facts: dict[str, Any], boundaries: list[str]) -> dict[str, Any]:
    entry = {"id": cell, "featureType": facts.get("kind", "CellSpace")}
    entry |= {"poi": facts.get("poi", False), "duality": f"{cell}.node"}
    entry |= {_NAMES[0]: facts["name"]} if "name" in facts else {}
    entry |= {"level": facts["level"]} if "level" in facts else {}
    if facts.get("polygon"):
        area = {"type": "Polygon", "coordinates": facts["polygon"]}
        entry["cellSpaceGeom"] = {"geometry2D": area}
    return entry | ({"boundedBy": boundaries} if boundaries else {})


def _node(cell: str, facts: dict[str, Any], edges: list[str]) -> dict[str, Any]:
    entry = {"id": f"{cell}.node", "featureType": "Node", "duality": cell, "connects": edges}
    point = {"type": "Point", "coordinates": facts.get("point")}
    return entry | ({"geometry": point} if "point" in facts else {})


def _boundary(boundary: str, facts: dict[str, Any]) -> dict[str, Any]:
    entry = {"id": boundary, "featureType": facts.get("kind", "CellBoundary")}
    entry["isVirtual"] = facts.get("is_virtual", False)
    entry |= {"duality": facts["duality"]} if "duality" in facts else {}
    if facts.get("line"):
        line = {"type": "LineString", "coordinates": facts["line"]}
        entry["cellBoundaryGeom"] = {"geometry2D": line}
    return entry


def _connections(model: IndoorModel) -> Iterator[dict[str, Any]]:
    home = {cell: name for name, layer in model.layers.items() for cell in layer}
    for at, (expression, one, other) in enumerate(model.connections):
        yield {
            "id": f"C{at}",
            "featureType": "InterLayerConnection",
            "typeOfTopoExpression": expression,
            "connectedLayers": [home[one], home[other]],
            "connectedCells": [one, other],
            "connectedNodes": [f"{one}.node", f"{other}.node"],
        }


# From the file to the model.


def load_indoorgml(path: PathLike) -> IndoorModel:
    """Read a file of IndoorGML 2.0 in JSON.

    References are ids, also behind `#` or a path, as `TL-1:DS-1:N1`. Geometry in three dimensions
    is not read.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    MapNotFoundError
        When there is no such file.
    MapError
        When it is no IndoorGML, too large, or a reference leads nowhere.

    Examples
    --------
    >>> from hybridnav.ext.fleet import export_indoorgml, load_indoorgml
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> _ = export_indoorgml(topology, "figure1.json")
    >>> load_indoorgml("figure1.json").layers["places"].nodes["P0.0"]["level"]
    '0'
    """
    text = read_text(
        path, what="graph", error=MapError, missing=MapNotFoundError, max_bytes=_MOST_BYTES,
        kind="JSON",
    )  # fmt: skip
    return read_indoorgml(text, f"graph {printable(path)}")


def is_indoorgml(text: str) -> bool:
    """Return whether a text of JSON has the keys of IndoorGML."""
    return '"IndoorFeatures"' in text and '"layers"' in text


def read_indoorgml(text: str, where: str) -> IndoorModel:
    """Read a text; see `load_indoorgml`. `where`: what messages begin with."""
    with json_errors(text, where, _MOST_VALUES):
        data = json.loads(text, parse_float=finite, parse_constant=finite)
    if not isinstance(data, dict) or data.get("featureType") != "IndoorFeatures":
        raise MapError(f"{where}: expected IndoorGML 2.0 in JSON, featureType IndoorFeatures")
    layers: dict[str, nx.MultiGraph[str]] = {}
    cells: dict[str, str] = {}
    for number, entry in enumerate(list_of(data.get("layers"), where, "layers")):
        at = f"{where}, layer {number}"
        layer = mapping_of(entry, at, "the layer")
        name = str(layer.get("id", number))
        layers[name], nodes = _read_layer(layer, at)
        cells |= {cell: cell for cell in layers[name]} | nodes
    connections = []
    for entry in list_of(data.get("layerConnections", []), where, "layerConnections"):
        one = mapping_of(entry, where, "a connection")
        ends = one.get("connectedCells") or one.get("connectedNodes") or []
        first, second = _two(ends, cells, f"{where}, connection {one.get('id')!r:.60}")
        expression = str(one.get("typeOfTopoExpression", "OTHERS")).upper()
        connections.append((expression, first, second))
    return IndoorModel(str(data.get("id", "")), layers, tuple(connections))


def read_indoor_floors(text: str, where: str, name: str) -> BuildingGraph:
    """Read the first layer whose nodes have points as the graph of a building.

    `where`: what messages begin with; `name`: name of a building that has none. Edges
    between two levels become links, those of cells of one name one link.
    """
    model = read_indoorgml(text, where)
    layers = [each for each in model.layers.values() if any(p for _, p in each.nodes("point"))]
    if not layers:
        raise MapError(f"{where}: no node has a point, expected a Point as its geometry")
    layer = layers[0]
    floors: dict[str, Gathered] = {}
    facts_of: dict[str, dict[str, Any]] = {cell: layer.nodes[cell] for cell in layer}
    level_of = {cell: str(facts.get("level", "0")) for cell, facts in facts_of.items()}
    points = {cell: facts["point"] for cell, facts in facts_of.items() if "point" in facts}
    for cell, facts in facts_of.items():
        floor = level_of[cell]
        gathered = floors.setdefault(floor, Gathered(f"{where}, level {shown(floor)}"))
        own = {key: each for key, each in facts.items() if key in {"kind", "name", "poi"}}
        gathered.add_node(cell, points.get(cell), own)
    crossing: list[tuple[str, str, str]] = []
    for one, other, key, facts in layer.edges(keys=True, data=True):
        names = {facts_of[end].get("name", key) for end in (one, other)}
        if level_of[one] != level_of[other]:
            crossing.append((str(names.pop() if len(names) == 1 else key), one, other))
            continue
        own = {"weight": facts["weight"]}
        gathered, is_directed = floors[level_of[one]], layer.is_directed()
        gathered.add_link((one, other), own, directed=is_directed, name=key)
    kept = {floor: each for floor, each in floors.items() if each.has_nodes}
    links = links_between(crossing, level_of, points, list(kept))
    graphs = tuple(
        FloorGraph(name=floor, graph=WaypointGraph(**each.fields("indoorgml", floor)))
        for floor, each in kept.items()
    )
    return BuildingGraph(name=model.name or name, floors=graphs, links=tuple(links))


def _read_layer(layer: dict[str, Any], where: str) -> tuple[nx.MultiGraph[str], dict[str, str]]:
    import networkx as nx  # noqa: PLC0415 - on demand

    primal = mapping_of(layer.get("primalSpace", {}), where, "primalSpace")
    dual = mapping_of(layer.get("dualSpace", {}), where, "dualSpace")
    is_directed = dual.get("isDirected") is True
    graph: nx.MultiGraph[str] = nx.MultiDiGraph() if is_directed else nx.MultiGraph()
    bounded: dict[str, list[str]] = {}
    for cell, entry in _entries(primal, "cellSpaceMember", where):
        name = next((entry[key] for key in _NAMES if isinstance(entry.get(key), str)), None)
        rings = _geometry(entry.get("cellSpaceGeom"), "geometry2D", "Polygon")
        facts = {"kind": entry.get("featureType"), "name": name, "level": entry.get("level")}
        facts |= {"poi": entry.get("poi") is True, "polygon": rings}
        graph.add_node(cell, **{key: each for key, each in facts.items() if each is not None})
        for boundary in list_of(entry.get("boundedBy") or [], where, "boundedBy"):
            bounded.setdefault(str(boundary), []).append(cell)
    nodes = {}
    for node, entry in _entries(dual, "nodeMember", where):
        nodes[node] = cell = _known(entry.get("duality"), graph, f"{where}, node {node:.60}")
        point = pair_of(_geometry(entry.get("geometry"), "", "Point"))
        graph.nodes[cell].update({} if point is None else {"point": point})
    lines = {}
    for boundary, entry in _entries(primal, "cellBoundaryMember", where):
        line = _geometry(entry.get("cellBoundaryGeom"), "geometry2D", "LineString")
        facts = {"kind": entry.get("featureType"), "is_virtual": entry.get("isVirtual") is True}
        lines[boundary] = facts | ({} if line is None else {"line": line})
    free = dict(lines)
    for edge, entry in _entries(dual, "edgeMember", where):
        at = f"{where}, edge {edge:.60}"
        one, other = _two(entry.get("connects"), nodes, at)
        weight = number_of(entry.get("weight"))
        if math.isnan(weight):
            raise MapError(
                f"{at}: expected a number as its weight, got {entry.get('weight')!r:.60}"
            )
        facts = {"weight": weight}
        if entry.get("duality") is not None:
            boundary = _known(entry["duality"], lines, at)
            facts |= {"boundary": boundary} | lines[boundary]
            free.pop(boundary, None)
        graph.add_edge(one, other, edge, **facts)
    cells_of: dict[str, list[str]] = {}
    for reference, own in bounded.items():
        boundary = _known(reference, lines, f"{where}, cell {own[0]:.60}")
        cells_of.setdefault(boundary, []).extend(own)
    graph.graph["boundaries"] = {
        boundary: facts | {"cells": cells_of.get(boundary, [])} for boundary, facts in free.items()
    }
    return graph, nodes


def _entries(space: dict[str, Any], key: str, where: str) -> Iterator[tuple[str, dict[str, Any]]]:
    seen = set()
    for number, given in enumerate(list_of(space.get(key, []), where, key)):
        entry = mapping_of(given, f"{where}, {key} {number}", f"an entry of {key}")
        label = entry.get("id")
        if not isinstance(label, str) or label in seen:
            raise MapError(f"{where}, {key} {number}: expected an id of its own, got {label!r:.60}")
        seen.add(label)
        yield label, entry


def _known(reference: Any, ids: Any, where: str) -> str:
    """Return the id that a reference means, also behind `#` or a path of colons."""
    text = reference if isinstance(reference, str) else ""
    tried = (text, text.rpartition("#")[2], text.rpartition(":")[2])
    meant = next((each for each in tried if each in ids), None)
    if meant is None:
        raise MapError(
            f"{where}: {reference!r:.60} is the id of nothing here, expected one that is"
        )
    return meant


def _two(references: Any, cells: dict[str, str], where: str) -> tuple[str, str]:
    if not isinstance(references, list) or len(references) != 2:  # noqa: PLR2004 - both ends
        raise MapError(f"{where}: expected two ends, got {references!r:.60}")
    one, other = (cells[_known(each, cells, where)] for each in references)
    return one, other


def _geometry(value: Any, key: str, kind: str) -> Any:
    """Return the coordinates of a geometry of a kind, points as pairs; None for none."""
    value = value.get(key, value) if isinstance(value, dict) else {}
    if value.get("type") != kind if isinstance(value, dict) else True:
        return None
    return _points(value.get("coordinates"), {"Point": 0, "LineString": 1}.get(kind, 2))


def _points(value: Any, depth: int) -> Any:
    if depth == 0:
        return pair_of(value)
    points = [_points(each, depth - 1) for each in value] if isinstance(value, list) else [None]
    return None if None in points else points
