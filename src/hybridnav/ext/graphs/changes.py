"""What changed from one graph to the next, and whether a route still holds."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hybridnav._base.files import printable
from hybridnav.errors import InvalidValueError, brief
from hybridnav.ext.graphs.judge import FreeSpace
from hybridnav.ext.graphs.waypoint_graph import RouteGraph, WaypointGraph

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.maps import OccupancyGrid

_MOVED_M = 1e-3
"""Distance in metres above which a node has moved: files are written in more digits."""
_SHOWN = 8
"""Ids in a line of a summary."""

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
        `moved` by more than 1 mm; an edge moves with a node, or to other ones.

    Examples
    --------
    >>> from hybridnav.ext.graphs import WaypointGraph, graph_changes
    >>> import networkx as nx
    >>> plain = nx.DiGraph()
    >>> plain.add_node(1, pos=(0.0, 0.0))
    >>> before = WaypointGraph.from_networkx(plain)
    >>> plain.add_node(2, pos=(1.0, 0.0))
    >>> graph_changes(before, WaypointGraph.from_networkx(plain))["nodes"]
    {'added': [2], 'gone': [], 'moved': []}
    """
    old, new = _by_id(before), _by_id(after)
    moved = {
        name: math.dist(old[0][name], new[0][name]) > _MOVED_M for name in old[0] if name in new[0]
    }
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


def change_lines(changes: dict[str, dict[str, list[Any]]]) -> list[str]:
    """Return the lines of a summary about changes, none where no graph was given."""
    lines = []
    for kind, ids in changes.items():
        for what, names in ids.items():
            more = ", ..." if len(names) > _SHOWN else ""
            listed = ", ".join(printable(str(name)) for name in names[:_SHOWN]) + more
            lines += [f"{what:<10} {len(names):,} {kind}: {listed}"] if names else []
    return lines or ["changed    nothing"] * bool(changes)


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
        What the ids are: `"nodes"` or `"edges"`.

    Returns
    -------
    int or None
        The place of the edge in the route, from 0: it leads from node `route[i]` to the next, or is
        the edge `route[i]`. None where the whole route is there and free for the robot. An edge
        that does not begin where the one before ends is broken; so is a node alone that is gone.

    Raises
    ------
    InvalidValueError
        When the graph is from a file and there is no map, or `by` is another word.

    Examples
    --------
    >>> from hybridnav.ext.graphs import build_lane_graph, first_broken_edge
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
    points, ends = _by_id(graph)
    if by == "nodes":
        joined = set(ends.values())
        pairs = [pair if pair in joined else None for pair in itertools.pairwise(route)]
        if len(route) == 1 and route[0] not in points:
            return 0
    else:
        pairs = [ends.get(edge) for edge in route]
    space = FreeSpace.of(grid)
    last = None
    for at, pair in enumerate(pairs):
        if pair is None or last not in {None, pair[0]}:
            return at
        if not _is_free(space, [points[node] for node in pair]):
            return at
        last = pair[1]
    return None


def _is_free(space: FreeSpace, line: Sequence[tuple[float, float]]) -> bool:
    """Return whether the robot can drive a straight line on the map now."""
    tail, head = space.grid.frame.positions_of(np.array(line, dtype=np.float64))
    cells = space.cells_at(np.array([tail, head]))
    if not ((cells >= 0) & (cells < space.free.shape)).all():
        return False
    return bool(space.free[tuple(cells.T)].all() and space.joins(tail[None], head[None])[0])


def _by_id(graph: Graph) -> tuple[dict[Any, tuple[float, float]], dict[Any, tuple[Any, Any]]]:
    """Return the points of nodes and the ends of edges, by their ids."""
    if isinstance(graph, RouteGraph):
        nodes, edges = (each.tolist() for each in graph.ids)
    else:
        nodes, edges = list(graph.names), list(graph.edge_names)
    points = dict(zip(nodes, map(tuple, graph.points.tolist()), strict=True))
    pairs = [(nodes[tail], nodes[head]) for tail, head in graph.edges.tolist()]
    return points, dict(zip(edges, pairs, strict=True))
