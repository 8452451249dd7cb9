"""Routes over a route graph as the messages of Nav2's route server."""

from __future__ import annotations

import operator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.messages import MOST_ID, header_message, path_message
from hybridnav._base.poses import Motion
from hybridnav.errors import InvalidValueError
from hybridnav.ext.graphs.waypoint_graph import RouteGraph
from hybridnav.maps.checks import checked_type

if TYPE_CHECKING:
    from collections.abc import Sequence


def route_messages(
    graph: RouteGraph,
    nodes: Sequence[int],
    *,
    frame_id: str = "map",
    spacing_m: float = 0.05,
    stamp_ns: int = 0,
) -> dict[str, Any]:
    """Return a route as the `route` and `path` of Nav2's action ComputeRoute, in plain values.

    Parameters
    ----------
    graph
        The graph.
    nodes
        The nodes of the route in order, as indices into `graph.points`. Messages have the ids of
        `graph.ids`, as the file of `export_nav2`.
    frame_id
        Name of the map frame.
    spacing_m
        Most metres between two poses of the path; see `Path.poses`.
    stamp_ns
        Time in nanoseconds since 1970.

    Returns
    -------
    dict
        `route`, a `nav2_msgs/Route` whose cost is the length in metres, and `path`, a
        `nav_msgs/Path`.

    Raises
    ------
    InvalidValueError
        When there is no node, no edge joins two nodes that follow each other, an id is above
        65,535, or another value is out of range.

    Examples
    --------
    >>> from hybridnav.ext.graphs import build_route_graph, route_messages
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=12.0)
    >>> graph = build_route_graph(hn.TopologicalMap(pyramid))
    >>> route = route_messages(graph, graph.edges[0].tolist())["route"]
    >>> [edge["edgeid"] - graph.n_nodes for edge in route["edges"]]
    [0]
    """
    checked_type("graph", graph, RouteGraph)
    passed = [_checked_node(node, graph.n_nodes) for node in nodes]
    if not passed:
        raise InvalidValueError("a route needs at least one node, got none")
    edges = [_edge_of(graph, *pair) for pair in pairwise(passed)]
    node_ids, edge_ids = graph.ids[0][passed].tolist(), graph.ids[1][edges].tolist()
    most = max([*node_ids, *edge_ids])
    if most > MOST_ID:
        raise InvalidValueError(
            f"the route has the id {most}, and messages of Nav2 hold at most {MOST_ID}: build the "
            "graph with fewer nodes"
        )
    points = graph.points[passed]
    places = [{"x": x, "y": y, "z": 0.0} for x, y in points.tolist()]
    poses = Motion(points, None, curved=False).spread(spacing_m).poses
    return {
        "route": {
            "header": header_message(frame_id, stamp_ns),
            "route_cost": float(graph.lengths_m[edges].sum()),
            "nodes": [
                {"nodeid": node, "position": place}
                for node, place in zip(node_ids, places, strict=True)
            ],
            "edges": [
                {"edgeid": edge, "start": start, "end": end}
                for edge, start, end in zip(edge_ids, places, places[1:], strict=False)
            ],
        },
        "path": path_message(poses, frame_id, stamp_ns),
    }


def _checked_node(node: Any, n_nodes: int) -> int:
    try:
        index = operator.index(node)
    except TypeError:
        index = -1
    if not 0 <= index < n_nodes:
        raise InvalidValueError(f"there is no node {node!r:.80}, nodes are 0 to {n_nodes - 1}")
    return index


def _edge_of(graph: RouteGraph, tail: int, head: int) -> int:
    found = np.flatnonzero((graph.edges == (tail, head)).all(axis=1))
    if not len(found):
        raise InvalidValueError(f"no edge leads from node {tail} to node {head}")
    return int(found[0])
