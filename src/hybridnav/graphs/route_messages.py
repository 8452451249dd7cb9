"""Routes over a graph that robots follow: messages, changes, and whether they still hold. Public:
`first_broken_edge`.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from hybridnav._base.poses import Motion
from hybridnav._base.trig import dist
from hybridnav.errors import InvalidValueError, brief
from hybridnav.graphs.attach import placed_points
from hybridnav.graphs.free_space import FreeSpace
from hybridnav.graphs.waypoint_graph import RouteGraph, WaypointGraph
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.messages import MOST_ID, header_message, path_message


def route_messages(
    graph: Graph,
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
        The graph of a map, or of a file.
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
        When there is no node, or no edge joins two nodes that follow each other. When an id is no
        whole number from 0 to 65,535, or another value is out of range.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph, route_messages
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=12.0)
    >>> graph = build_lane_graph(hn.TopologicalMap(pyramid))
    >>> route = route_messages(graph, graph.edges[0].tolist())["route"]
    >>> [edge["edgeid"] - graph.n_nodes for edge in route["edges"]]
    [0]
    """
    if not isinstance(graph, WaypointGraph):
        checked_type("graph", graph, RouteGraph)
    passed = [_checked_node(node, graph.n_nodes) for node in nodes]
    if not passed:
        raise InvalidValueError("a route needs at least one node, got none")
    edges = [_edge_of(graph, *pair) for pair in pairwise(passed)]
    node_ids, edge_ids = (
        [ids[at] for at in rows] for ids, rows in zip(ids_of(graph), (passed, edges), strict=True)
    )
    for number in [*node_ids, *edge_ids]:
        if not isinstance(number, int) or not 0 <= number <= MOST_ID:
            raise InvalidValueError(
                f"the route has the id {brief(number)}, and messages of Nav2 hold whole numbers "
                f"from 0 to {MOST_ID}: build the graph with fewer nodes"
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


def _edge_of(graph: Graph, tail: int, head: int) -> int:
    found = np.flatnonzero((graph.edges == (tail, head)).all(axis=1))
    if not len(found):
        raise InvalidValueError(f"no edge leads from node {tail} to node {head}")
    return int(found[0])


# What changed from one graph to the next, and whether a route still holds.

_MOVED_M = 1e-3
"""Distance in metres above which a node has moved: files are written in more digits."""

Graph = RouteGraph | WaypointGraph


def graph_changes(before: Graph, after: Graph) -> dict[str, dict[str, list[Any]]]:
    """Return what changed from a graph to another with the ids of the first, by `--keep`.

    Parameters
    ----------
    before, after
        Graphs of one map, from the map or from a file.

    Returns
    -------
    dict
        `nodes` and `edges`, each with the ids that were `added`, are `gone`, or stay and have
        `moved` by more than 1 mm. An edge moves with a node, or to other ones.

    Examples
    --------
    >>> from hybridnav.graphs import WaypointGraph, graph_changes
    >>> import networkx as nx
    >>> plain = nx.DiGraph()
    >>> plain.add_node(1, pos=(0.0, 0.0))
    >>> before = WaypointGraph.from_networkx(plain)
    >>> plain.add_node(2, pos=(1.0, 0.0))
    >>> graph_changes(before, WaypointGraph.from_networkx(plain))["nodes"]
    {'added': [2], 'gone': [], 'moved': []}
    """
    old, new = (_by_id(graph) for graph in (before, after))
    moved = {name: dist(old[0][name], new[0][name]) > _MOVED_M for name in old[0] if name in new[0]}
    kept = [(name, ends, new[1][name]) for name, ends in old[1].items() if name in new[1]]
    follows = [name for name, was, now in kept if was != now or any(moved.get(n) for n in now)]
    return {
        kind: {
            "added": [name for name in new[at] if name not in old[at]],
            "gone": [name for name in old[at] if name not in new[at]],
            "moved": [name for name, has in moved.items() if has] if at == 0 else follows,
        }
        for at, kind in enumerate(("nodes", "edges"))
    }


def first_broken_edge(
    graph: Graph,
    route: Sequence[int | str],
    grid: OccupancyGrid | None = None,
    *,
    by: Literal["nodes", "edges"] = "nodes",
) -> int | None:
    """Return the first edge of a route that a graph has no longer, or that is not free now.

    Parameters
    ----------
    graph
        The graph now.
    route
        Ids of its nodes in order, or of its edges.
    grid
        The map now; a graph from a file needs it, for others the default is their own.
    by
        The kind of the ids: `"nodes"` or `"edges"`.

    Returns
    -------
    int or None
        The place of the edge in the route, from 0: it leads from node `route[i]` to the next, or is
        the edge `route[i]`. None where the whole route is there and free for the robot. An edge
        that does not begin where the one before ends is broken.

    Raises
    ------
    InvalidValueError
        When the graph is from a file and there is no map, or `by` is another word.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph, first_broken_edge
    >>> cells = np.ones((24, 120))
    >>> cells[2:-2, 2:-2] = 0.0
    >>> grid = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.2)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))
    >>> graph = build_lane_graph(topology)
    >>> route = [int(graph.ids[0][node]) for node in graph.edges[0]]
    >>> first_broken_edge(graph, route) is None
    True
    >>> cells[:, :60] = 1.0
    >>> shut = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.2)
    >>> first_broken_edge(graph, route, shut)
    0
    """
    if by not in {"nodes", "edges"}:
        raise InvalidValueError(f"by must be 'nodes' or 'edges', got {brief(by)}")
    if grid is None:
        if not isinstance(graph, RouteGraph):
            raise InvalidValueError("a graph from a file knows no map: give grid, the map now")
        grid = graph.grid
    (nodes, edges), ends = ids_of(graph), [*map(tuple, graph.edges.tolist())]
    edge_of = dict(zip(edges, ends, strict=True))
    if by == "nodes":
        edge_of = {(nodes[tail], nodes[head]): (tail, head) for tail, head in ends}
    pairs = [edge_of.get(each) for each in (pairwise(route) if by == "nodes" else route)]
    space = FreeSpace.of(grid)
    positions, _, is_free = placed_points(graph.points, grid, space.free)
    last = None
    for at, pair in enumerate(pairs):
        if pair is None or last not in {None, pair[0]} or not is_free[[*pair]].all():
            return at
        if not space.joins(positions[[pair[0]]], positions[[pair[1]]])[0]:
            return at
        last = pair[1]
    return None


def ids_of(graph: Graph) -> tuple[list[Any], list[Any]]:
    """Return the ids of nodes and edges."""
    if isinstance(graph, RouteGraph):
        return graph.ids[0].tolist(), graph.ids[1].tolist()
    return graph.ids


def _by_id(graph: Graph) -> tuple[dict[Any, tuple[float, float]], dict[Any, tuple[Any, Any]]]:
    """Return the points of nodes and the ends of edges, by their ids."""
    nodes, edges = ids_of(graph)
    points = dict(zip(nodes, map(tuple, graph.points.tolist()), strict=True))
    pairs = [(nodes[tail], nodes[head]) for tail, head in graph.edges.tolist()]
    return points, dict(zip(edges, pairs, strict=True))
