"""Writer of route graphs for Nav2's route server: GeoJSON."""

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from hybridnav._base.files import NewFile
from hybridnav._base.typing import PathLike
from hybridnav.errors import InvalidValueError, brief
from hybridnav.graphs import RouteGraph, WaypointGraph
from hybridnav.graphs.files import nav2_rules as rules
from hybridnav.graphs.lanes import waypoint_graph_of
from hybridnav.maps.checks import checked_type


def export_nav2(graph: RouteGraph | WaypointGraph, path: PathLike, *, frame: str = "map") -> None:
    """Write a route graph as Nav2's route server reads it, a GeoJSON file.

    A node is a `Point`, an edge a `LineString` in one direction; coordinates are metres in the map
    frame. Ids are those of `graph.ids`, unique over nodes and edges. The `cost` of an edge is its
    length in metres. The `metadata` of nodes are `class`, and `room` and `door` where there is one.
    Edges have `class` (door or free), `room`, `door` (the first that it passes), `doors`,
    `width_m`, `clearance_m`, `left_m` and `right_m`. Lanes have `lane` (right). Nothing is null:
    unknown or infinite values are left out.

    A `WaypointGraph` keeps its own ids, costs, lines and facts; ids that occur twice or that Nav2
    cannot hold are replaced by free ones. Facts of a graph that is not from Nav2 become `metadata`,
    with the id as `name`, and a `speed_limit` in m/s becomes `abs_speed_limit`, as TimeScorer reads
    it. Nav2's loader and scorers take all that is written: lists of lists or objects become JSON in
    a text, and numbers that scorers read have a point.

    Parameters
    ----------
    graph
        The graph, from the map or from a file.
    path
        The file, ending in .geojson or .json; one that exists is replaced.
    frame
        Name of the map frame, for nodes that state none.

    Raises
    ------
    InvalidValueError
        When this is no graph, or the graph has no edge, which Nav2 refuses, or more nodes and edges
        than Nav2 has ids. When the frame has no name, or a fact contains itself.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph, export_nav2
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> export_nav2(build_lane_graph(topology), "graph.geojson")
    """
    if isinstance(graph, WaypointGraph):
        name = graph.name
    else:
        name = checked_type("graph", graph, RouteGraph).grid.name
    file = NewFile.named(path, "route graph", "a route graph of Nav2", (".geojson", ".json"))
    file.write(nav2_bytes(name, nav2_features(graph, frame)))


def nav2_features(graph: RouteGraph | WaypointGraph, frame: str) -> list[dict[str, Any]]:
    """Return the features of a route graph for Nav2, nodes first; see `export_nav2`.

    Raises `InvalidValueError` when Nav2 would refuse the graph, or the frame has no name.
    """
    name = graph.name if isinstance(graph, WaypointGraph) else graph.grid.name
    if not frame:
        raise InvalidValueError("frame must be the name of the map frame, got an empty text")
    if not graph.n_edges:
        raise InvalidValueError(
            f"the route graph {brief(name)} has no edge, and Nav2 refuses such a file: "
            "build it by build_lane_graph, with a smaller spacing_m (--spacing)"
        )
    if graph.n_nodes + graph.n_edges > rules.MOST_ID:
        raise InvalidValueError(
            f"the route graph has {graph.n_nodes + graph.n_edges} nodes and edges, more than the "
            f"{rules.MOST_ID} ids of Nav2: build it with fewer nodes"
        )
    if isinstance(graph, RouteGraph):  # its facts are such as Nav2 has them
        graph = replace(waypoint_graph_of(graph), format="nav2")
    return _features_of(graph, frame)


def nav2_bytes(name: str, features: Sequence[dict[str, Any]]) -> bytes:
    """Return the content of a GeoJSON file, one feature a line, so that people can read and compare
    files."""
    dump = json.JSONEncoder(allow_nan=False, ensure_ascii=False).encode
    head = f'{{"type": "FeatureCollection", "name": {dump(name)}, "features": ['
    lines = ",\n".join(map(dump, features))
    # Half a letter, which Nav2's parser refuses, becomes a question mark.
    return f"{head}\n{lines}\n]}}\n".encode(errors="replace")


def _feature(properties: dict[str, Any], geometry: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": geometry}


# Features of a GeoJSON file for Nav2, of a graph that others have made.


def _features_of(graph: WaypointGraph, frame: str) -> list[dict[str, Any]]:
    """Return the features of a graph.

    Facts of a graph that is from Nav2 stay where they are; those of others go to `metadata`, with
    the id as `name`. They are such that Nav2's loader and scorers take them: see `nav2_rules`.

    `frame`: name of the frame of nodes that state none. Raises `InvalidValueError` when a fact is
    nested deeper than 64 levels, as one that contains itself.
    """
    used: set[int] = set()
    nodes = _ids(graph.names, used)
    edges = _ids(graph.edge_names, used)
    features = []
    for node, point in enumerate(graph.points.tolist()):
        facts = _properties(graph, graph.node_facts.get(node, {}), graph.names[node])
        geometry = {"type": "Point", "coordinates": point}
        features.append(_feature({"id": nodes[node], "frame": frame} | facts, geometry))
    points, costs = graph.points, graph.costs.tolist()
    for edge, (tail, head) in enumerate(graph.edges.tolist()):
        known = graph.edge_facts.get(edge, {})
        facts = _properties(graph, known, graph.edge_names[edge], is_edge=True)
        ends = {"id": edges[edge], "startid": nodes[tail], "endid": nodes[head]}
        cost = {} if math.isnan(costs[edge]) else {"cost": costs[edge]}
        if not costs[edge] > 0:  # Nav2 plans with such a cost only where scorers override it
            facts.pop("overridable", None)
        line = graph.lines.get(edge, points[[tail, head]])
        geometry = {"type": "LineString", "coordinates": line.tolist()}
        features.append(_feature(ends | cost | facts, geometry))
    return features + [rules.plain(other) for other in graph.others if rules.is_drawn(other)]


def _ids(names: Sequence[int | str | None], used: set[int]) -> list[int]:
    """Return an id for each name, the name itself where it is an id that nothing else has."""
    ids: list[int] = []
    wanted = {name for name in names if isinstance(name, int) and 0 <= name <= rules.MOST_ID}
    following = 0
    for name in names:
        if isinstance(name, int) and name in wanted and name not in used:
            chosen = name
        else:
            while following in used or following in wanted:
                following += 1
            chosen = following
        used.add(chosen)
        ids.append(chosen)
    return ids


def _properties(
    graph: WaypointGraph, facts: dict[str, Any], name: int | str | None, *, is_edge: bool = False
) -> dict[str, Any]:
    if graph.format == "nav2":
        return rules.held_properties(facts, is_edge=is_edge)
    known = ({"name": name} if isinstance(name, str) else {}) | facts
    if is_edge and "speed_limit" in known:
        # In m/s, as in other formats; Nav2's key of this name is in per cent.
        known["abs_speed_limit"] = known.pop("speed_limit")
    held = rules.held_metadata(known, is_edge=is_edge)
    return {"metadata": held} if held else {}
