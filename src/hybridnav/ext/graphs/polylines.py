"""Metadata of nodes and edges for files: what is known, and nothing that is null or infinite."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav.errors import InvalidValueError, brief
from hybridnav.ext.graphs.attach import adjacency, shortest_routes
from hybridnav.ext.graphs.waypoint_graph import RouteGraph, WaypointGraph
from hybridnav.maps.checks import checked_between, checked_type

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._base.typing import BoolArray, FloatArray, LongArray


def node_metadata(graph: RouteGraph, node: int) -> dict[str, Any]:
    """Return what is known of a node: `class`, `room`, `door`."""
    door = int(graph.doors[node])
    return _known({"class": graph.kinds[node], "room": graph.rooms[node], "door": door or None})


def edge_metadata(graph: RouteGraph, chain: Sequence[int]) -> dict[str, Any]:
    """Return what is known of an edge, or of a chain of edges as one.

    Parameters
    ----------
    graph
        The graph.
    chain
        Indices of edges, in the order passed: the room is that of the middle one, doors are those
        of all, measures the least.

    Returns
    -------
    dict
        `class` (door or free), `room`, `door`, `doors`, `lane`, and in metres `width_m`,
        `clearance_m`, `left_m`, `right_m`.
    """
    edges = list(chain)
    doors = list(dict.fromkeys(door for edge in edges for door in graph.edge_doors[edge]))
    room = graph.edge_rooms[edges[len(edges) // 2]]
    known = _known({"class": "door" if doors else "free", "room": room})
    known |= {"door": doors[0], "doors": doors} if doors else {}
    known |= {"lane": "right"} if graph.is_lane[edges].any() else {}
    return known | _known(
        {
            "width_m": float(graph.widths_m[edges].min()),
            "clearance_m": float(graph.clearances_m[edges].min()),
            "left_m": float(graph.left_m[edges].min()),
            "right_m": float(graph.right_m[edges].min()),
        }
    )


def _known(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values that are known and finite, measures in whole millimetres."""
    return {
        name: round(value, 3) if isinstance(value, float) else value
        for name, value in values.items()
        if value is not None and not (isinstance(value, float) and math.isinf(value))
    }


# Edges that bend: a graph of rooms, doors and places, with polylines instead of nodes at bends.

_LANDMARKS = frozenset({"room", "door", "place", "crossing", "end"})
_ROUNDING = 1e-9
"""Relative slack on the length of a route, which is a sum of rounded numbers."""
_AT_ONCE = 64
"""Nodes from which distances to all others are held at once."""


def merge_bends(graph: RouteGraph, *, stretch: float = 1.05) -> WaypointGraph:
    """Leave out the nodes of a route graph that only bend routes or cover space.

    Nodes at rooms, doors, places, crossings and ends of lanes stay. Two of them are joined by the
    shortest route over the nodes that are left out, where the way over other polylines is longer
    than `stretch` allows; so nodes are connected where they were. The cost of an edge is the length
    of that polyline in metres; its metadata are those of `export_nav2`, and where it bends
    `polyline`, with `x_values` and `y_values` in metres. A robot must follow the polyline: straight
    from node to node there may be walls, and Nav2's route server of its own accord does not read
    it.

    Parameters
    ----------
    graph
        The graph, without lanes.
    stretch
        At least 1: between two of its nodes, a route over polylines is at most this many times as
        long as a route on `graph`.

    Returns
    -------
    WaypointGraph
        The polylines are in `lines`, too.

    Raises
    ------
    InvalidValueError
        When the graph has lanes, or `stretch` is below 1.

    Examples
    --------
    >>> from hybridnav.ext.graphs import build_route_graph, merge_bends
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> graph = build_route_graph(topology)
    >>> merge_bends(graph).n_nodes < graph.n_nodes
    True
    """
    checked_type("graph", graph, RouteGraph)
    checked_between("stretch", stretch, 1, 1e6)
    if graph.is_lane.any():
        raise InvalidValueError(
            f"the graph of map {brief(graph.grid.name)} has lanes, whose edges are straight: merge "
            "bends of the graph without lanes"
        )
    kept = np.array([node for node, kind in enumerate(graph.kinds) if kind in _LANDMARKS])
    index = {node: at for at, node in enumerate(kept.tolist())}
    edges: list[tuple[int, int]] = []
    costs: list[float] = []
    lines: dict[int, FloatArray] = {}
    facts: dict[int, dict[str, Any]] = {}
    for chain in _chains(graph, kept, stretch):
        nodes = [*graph.edges[chain, 0].tolist(), int(graph.edges[chain[-1], 1])]
        metadata = edge_metadata(graph, chain)
        points = graph.points[nodes]
        if len(nodes) > 2:  # noqa: PLR2004 - it bends
            lines[len(edges)] = frozen(points)
            x_values, y_values = points.T.tolist()
            metadata["polyline"] = {"x_values": x_values, "y_values": y_values}
        facts[len(edges)] = {"metadata": metadata}
        costs.append(float(graph.lengths_m[chain].sum()))
        edges.append((index[nodes[0]], index[nodes[-1]]))
    return WaypointGraph(
        name=graph.grid.name,
        format="nav2",
        frame="",
        names=tuple(range(len(kept))),
        points=frozen(graph.points[kept]),
        edge_names=tuple(range(len(kept), len(kept) + len(edges))),
        edges=frozen(np.array(edges, dtype=np.int64).reshape(-1, 2)),
        costs=frozen(np.array(costs, dtype=np.float64)),
        lines=lines,
        node_facts={at: {"metadata": node_metadata(graph, node)} for node, at in index.items()},
        edge_facts=facts,
    )


def _chains(graph: RouteGraph, kept: LongArray, stretch: float) -> list[list[int]]:
    """Return the edges of each polyline, those of both directions one after the other."""
    tails, heads = kept[_joined(_distances(graph, kept), stretch)].T
    offsets, nothing = np.arange(len(tails) + 1), np.zeros(len(tails))
    network = adjacency(graph.n_nodes, graph.edges, graph.lengths_m)
    _, routes, _ = shortest_routes(network, (offsets, tails, nothing), (offsets, heads, nothing))
    keys = graph.edges[:, 0] * graph.n_nodes + graph.edges[:, 1]  # ascending
    chains: list[list[int]] = []
    for nodes in routes[: len(tails)]:
        for line in (nodes, nodes[::-1]):
            found = np.searchsorted(keys, line[:-1] * graph.n_nodes + line[1:])
            chains.append(found.tolist())
    return chains


def _joined(away: FloatArray, stretch: float) -> LongArray:
    """Choose pairs of nodes so that a route over chosen ones joins every pair.

    Parameters
    ----------
    away
        float64 (n, n), the distance of each pair, infinite for none.
    stretch
        Most by which a route is longer than the distance.

    Returns
    -------
    LongArray
        int64 (k, 2), lower node first, sorted. A pair is chosen when it is the nearest one without
        a route that is short enough, of both its nodes: so no other node lies on the way.
    """
    count = len(away)
    chosen = np.zeros((count, count), dtype=np.bool_)
    waiting = np.arange(count)
    while True:
        lengths = _lengths(chosen, away, waiting)
        rest = np.where(lengths > stretch * (1 + _ROUNDING) * away[waiting], away[waiting], np.inf)
        waits = np.isfinite(rest).any(axis=1)
        waiting, rest = waiting[waits], rest[waits]
        if not len(waiting):
            return np.argwhere(np.triu(chosen)).astype(np.int64)
        nearest = np.full(count, -1, dtype=np.int64)
        nearest[waiting] = rest.argmin(axis=1)
        both = waiting[nearest[nearest[waiting]] == waiting]
        chosen[both, nearest[both]] = True


def _lengths(chosen: BoolArray, away: FloatArray, nodes: LongArray) -> FloatArray:
    """Return the lengths of the shortest routes over chosen pairs from some nodes to all, float64
    (k, n)."""
    from scipy.sparse import csr_array  # noqa: PLC0415 - on demand
    from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415

    tails, heads = np.nonzero(chosen)
    lengths: FloatArray = away[tails, heads]
    matrix = csr_array((lengths, (tails, heads)), shape=away.shape)
    found: FloatArray = dijkstra(matrix, indices=nodes)
    return found


def _distances(graph: RouteGraph, kept: LongArray) -> FloatArray:
    """Return the lengths of the shortest routes between some nodes, float64 (k, k), infinite for
    none."""
    from scipy.sparse import csr_array  # noqa: PLC0415 - on demand
    from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415

    shape = (graph.n_nodes, graph.n_nodes)
    matrix = csr_array((graph.lengths_m, (graph.edges[:, 0], graph.edges[:, 1])), shape=shape)
    away = np.empty((len(kept), len(kept)))
    for first in range(0, len(kept), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        away[some] = dijkstra(matrix, indices=kept[some])[:, kept]
    # Rounding differs by direction: pairs need one distance.
    found: FloatArray = np.minimum(away, away.T)
    return found
