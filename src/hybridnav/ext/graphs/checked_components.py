"""Components of a graph that no edge connects, and nodes without a route there and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from hybridnav.ext.graphs.gather import shown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._base.typing import LongArray
    from hybridnav.ext.graphs.findings import Findings
    from hybridnav.ext.graphs.waypoint_graph import WaypointGraph


def add_components(findings: Findings, graph: WaypointGraph, component: LongArray) -> None:
    """Add components that free space connects, and nodes that cannot be both reached and left.

    Parameters
    ----------
    findings
        What they are added to.
    graph
        The graph.
    component
        int64 (n,), the connected part of free space in which each node lies, -1 for none.
    """
    weak = components_of(graph.n_nodes, graph.edges, "weak")
    points = graph.points.tolist()
    for node, count, most in cut_off(component, weak):
        where = f"{count} nodes with node {shown(graph.names[node])}"
        findings.add("components", f"{where}, apart from {most}", tuple(points[node]))
    add_one_way(findings, graph, one_way_nodes(graph.n_nodes, graph.edges))


def add_one_way(findings: Findings, graph: WaypointGraph, nodes: LongArray) -> None:
    """Add nodes of a graph that cannot be both reached and left."""
    points = graph.points.tolist()
    for node in nodes.tolist():
        findings.add("one-way", f"node {shown(graph.names[node])}", tuple(points[node]))


def one_way_nodes(n_nodes: int, edges: LongArray) -> LongArray:
    """Return the nodes without a route there and back, int64.

    Routes lead from and to the largest strong component of each weak one.

    Parameters
    ----------
    n_nodes
        Number of nodes.
    edges
        int64 (m, 2), tail and head of each edge.
    """
    weak = components_of(n_nodes, edges, "weak")
    strong = components_of(n_nodes, edges, "strong")
    size, strong_size = np.bincount(weak, minlength=1), np.bincount(strong, minlength=1)
    largest = np.zeros(len(size), dtype=np.int64)
    np.maximum.at(largest, weak, strong_size[strong])
    leader = np.full(len(size), -1, dtype=np.int64)
    is_largest = strong_size[strong] == largest[weak]
    leader[weak[is_largest][::-1]] = strong[is_largest][::-1]
    return np.flatnonzero((size[weak] > 1) & (strong != leader[weak]))


def cut_off(part_of: LongArray, component: LongArray) -> Iterator[tuple[int, int, int]]:
    """Yield the components of a graph beside the largest one in each part of free space.

    Nodes without edges are left out.

    Parameters
    ----------
    part_of
        int64 (n,), the connected part of free space in which each node lies, -1 for none.
    component
        int64 (n,), the component of each node.

    Yields
    ------
    tuple
        The first node of a component, the number of its nodes in that part, and that of the largest
        one there.
    """
    size = np.bincount(component, minlength=1)
    for part in np.unique(part_of[part_of >= 0]).tolist():
        nodes = np.flatnonzero((part_of == part) & (size[component] > 1))
        _, first, count = np.unique(component[nodes], return_index=True, return_counts=True)
        for one in np.delete(np.arange(len(count)), count.argmax() if len(count) else []):
            yield int(nodes[first[one]]), int(count[one]), int(count.max())


def components_of(n_nodes: int, edges: LongArray, kind: Literal["weak", "strong"]) -> LongArray:
    """Return the component of each node of a graph, int64 (n,).

    Parameters
    ----------
    n_nodes
        Number of nodes.
    edges
        int64 (m, 2), tail and head of each edge.
    kind
        Whether the nodes of a component are joined whatever the directions of edges (weak), or each
        can be reached from each (strong).
    """
    from scipy.sparse import coo_array  # noqa: PLC0415 - on demand
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    ones = np.ones(len(edges))
    matrix = coo_array((ones, (edges[:, 0], edges[:, 1])), shape=(n_nodes, n_nodes))
    return connected_components(matrix, directed=True, connection=kind)[1].astype(np.int64)
