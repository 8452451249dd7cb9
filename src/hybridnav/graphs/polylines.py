"""Edges that bend: a graph of rooms, doors and places, with polylines instead of nodes at bends."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._copies import frozen
from hybridnav.errors import InvalidValueError
from hybridnav.graphs.metadata import edge_metadata, node_metadata
from hybridnav.graphs.route_graph import RouteGraph
from hybridnav.graphs.waypoint_graph import WaypointGraph
from hybridnav.grid.checks import checked_type

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, IntArray, LongArray

_LANDMARKS = frozenset({"room", "door", "place"})


def merge_bends(graph: RouteGraph) -> WaypointGraph:
    """Leave out the nodes of a route graph that only bend routes or cover space.

    Nodes at rooms, doors and places stay. Two of them are joined where some node between is nearest
    to the one, and the next to the other, by the shortest route over the nodes that are left out;
    so nodes are connected where they were. The cost of an edge is the length of that polyline in
    metres; its metadata are those of `export_nav2`, and where it bends `polyline`, with `x_values`
    and `y_values` in metres. A robot must follow the polyline: straight from node to node there may
    be walls, and Nav2's route server of its own accord does not read it.

    Parameters
    ----------
    graph
        The graph, without lanes.

    Returns
    -------
    WaypointGraph
        The polylines are in `lines`, too.

    Raises
    ------
    InvalidValueError
        When the graph has lanes.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> graph = hn.build_route_graph(topology)
    >>> hn.merge_bends(graph).n_nodes < graph.n_nodes
    True
    """
    checked_type("graph", graph, RouteGraph)
    if graph.is_lane.any():
        raise InvalidValueError(
            f"the graph of map {graph.grid.name!r} has lanes, whose edges are straight: merge "
            "bends of the graph without lanes"
        )
    kept = np.array([node for node, kind in enumerate(graph.kinds) if kind in _LANDMARKS])
    index = {node: at for at, node in enumerate(kept.tolist())}
    edges: list[tuple[int, int]] = []
    costs: list[float] = []
    lines: dict[int, FloatArray] = {}
    facts: dict[int, dict[str, Any]] = {}
    for chain in _chains(graph, kept):
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


def _chains(graph: RouteGraph, kept: LongArray) -> list[list[int]]:
    """Return the edges of each polyline, those of both directions one after the other."""
    away, before, owner = _nearest(graph, kept)
    tails, heads = graph.edges.T
    meets = (owner[tails] >= 0) & (owner[tails] < owner[heads])
    tails, heads, lengths = tails[meets], heads[meets], graph.lengths_m[meets]
    through = away[tails] + lengths + away[heads]
    pairs = owner[tails].astype(np.int64) * graph.n_nodes + owner[heads]
    order = np.lexsort((through, pairs))
    _, first = np.unique(pairs[order], return_index=True)
    keys = graph.edges[:, 0] * graph.n_nodes + graph.edges[:, 1]  # ascending
    chains: list[list[int]] = []
    for at in order[first].tolist():
        nodes = [*_back(before, int(tails[at]))[::-1], *_back(before, int(heads[at]))]
        for line in (np.array(nodes), np.array(nodes[::-1])):
            found = np.searchsorted(keys, line[:-1] * graph.n_nodes + line[1:])
            chains.append(found.tolist())
    return chains


def _back(before: IntArray, node: int) -> list[int]:
    """Return a node and those before it, up to the one that is kept."""
    nodes = [node]
    while before[nodes[-1]] >= 0:
        nodes.append(int(before[nodes[-1]]))
    return nodes


def _nearest(graph: RouteGraph, kept: LongArray) -> tuple[FloatArray, IntArray, IntArray]:
    """Return for each node the distance to the nearest kept one, the node before on the route from
    it, and that one; negative for none."""
    from scipy.sparse import csr_array  # noqa: PLC0415 - on demand
    from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415

    shape = (graph.n_nodes, graph.n_nodes)
    matrix = csr_array((graph.lengths_m, (graph.edges[:, 0], graph.edges[:, 1])), shape=shape)
    found: Any = dijkstra(matrix, indices=kept, min_only=True, return_predecessors=True)
    away, before, owner = found
    return away, before, owner
