"""Writer of route graphs for Nav2's route server: GeoJSON."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from hybridnav.errors import InvalidValueError, brief
from hybridnav.graphs import RouteGraph, WaypointGraph
from hybridnav.graphs.metadata import edge_metadata, node_metadata
from hybridnav.grid.checks import checked_type
from hybridnav.io.graph_json import MOST_ID
from hybridnav.io.nav2_given import features_of
from hybridnav.io.new_file import NewFile

if TYPE_CHECKING:
    from hybridnav._typing import PathLike


def export_nav2(graph: RouteGraph | WaypointGraph, path: PathLike, *, frame: str = "map") -> None:
    """Write a route graph as Nav2's route server reads it, a GeoJSON file.

    A node is a `Point`, an edge a `LineString` in one direction; coordinates are metres in the map
    frame. Ids are unique over nodes and edges: nodes from 0, edges after them. The `cost` of an
    edge is its length in metres. The `metadata` of nodes are `class`, and `room` and `door` where
    there is one; those of edges `class` (door or free), `room`, `door` (the first that it passes),
    `doors`, `width_m`, `clearance_m`, `left_m` and `right_m`, and of lanes `lane` (right). Nothing
    is null: what is not known or infinite is left out.

    A `WaypointGraph` keeps its own ids, costs, lines and facts; ids that occur twice or that Nav2
    cannot hold are replaced by free ones. Facts of a graph that is not from Nav2 become `metadata`,
    with the id as `name`.

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
        When this is no graph, the graph has no edge, which Nav2 refuses, or more nodes and edges
        than Nav2 has ids, the frame has no name, or a fact contains itself.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.graphs import build_route_graph
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> hn.export_nav2(build_route_graph(topology), "graph.geojson")
    """
    if isinstance(graph, WaypointGraph):
        name = graph.name
    else:
        name = checked_type("graph", graph, RouteGraph).grid.name
    file = NewFile.named(path, "route graph", "a route graph of Nav2", (".geojson", ".json"))
    if not frame:
        raise InvalidValueError("frame must be the name of the map frame, got an empty text")
    if not graph.n_edges:
        raise InvalidValueError(
            f"the route graph {brief(name)} has no edge, and Nav2 refuses such a file: give it "
            "more nodes"
        )
    if graph.n_nodes + graph.n_edges > MOST_ID:
        raise InvalidValueError(
            f"the route graph has {graph.n_nodes + graph.n_edges} nodes and edges, more than the "
            f"{MOST_ID} ids of Nav2: build it with fewer nodes"
        )
    if isinstance(graph, WaypointGraph):
        features = features_of(graph, frame)
    else:
        features = [*_nodes(graph, frame), *_edges(graph)]
    # One feature a line, so that people can read and compare files.
    lines = ",\n".join(json.dumps(feature, allow_nan=False) for feature in features)
    head = f'{{"type": "FeatureCollection", "name": {json.dumps(name)}, "features": ['
    file.write(f"{head}\n{lines}\n]}}\n".encode())


def _nodes(graph: RouteGraph, frame: str) -> list[dict[str, Any]]:
    return [
        _feature(
            {"id": node, "frame": frame, "metadata": node_metadata(graph, node)},
            {"type": "Point", "coordinates": point},
        )
        for node, point in enumerate(graph.points.tolist())
    ]


def _edges(graph: RouteGraph) -> list[dict[str, Any]]:
    points, lengths_m = graph.points.tolist(), graph.lengths_m.tolist()
    return [
        _feature(
            {
                "id": graph.n_nodes + edge,
                "startid": tail,
                "endid": head,
                "cost": lengths_m[edge],
                "metadata": edge_metadata(graph, [edge]),
            },
            {"type": "LineString", "coordinates": [points[tail], points[head]]},
        )
        for edge, (tail, head) in enumerate(graph.edges.tolist())
    ]


def _feature(properties: dict[str, Any], geometry: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": geometry}
