"""Components of a graph that no edge connects, and nodes without a route there and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from hybridnav.graphs.gather import shown

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.graphs.findings import Findings
    from hybridnav.graphs.waypoint_graph import WaypointGraph


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
    weak, strong = _components(graph, "weak"), _components(graph, "strong")
    size = np.bincount(weak, minlength=1)
    points = graph.points.tolist()
    for part in np.unique(component[component >= 0]).tolist():
        nodes = np.flatnonzero((component == part) & (size[weak] > 1))
        found, first, count = np.unique(weak[nodes], return_index=True, return_counts=True)
        for one in np.delete(np.arange(len(found)), count.argmax() if len(count) else []):
            node = int(nodes[first[one]])
            where = f"{count[one]} nodes with node {shown(graph.names[node])}"
            findings.add("components", f"{where}, apart from {count.max()}", tuple(points[node]))
    # The largest strong component of each weak one is where routes lead there and back.
    strong_size = np.bincount(strong, minlength=1)
    largest = np.zeros(len(size), dtype=np.int64)
    np.maximum.at(largest, weak, strong_size[strong])
    leader = np.full(len(size), -1, dtype=np.int64)
    is_largest = strong_size[strong] == largest[weak]
    leader[weak[is_largest][::-1]] = strong[is_largest][::-1]
    for node in np.flatnonzero((size[weak] > 1) & (strong != leader[weak])).tolist():
        findings.add("one-way", f"node {shown(graph.names[node])}", tuple(points[node]))


def _components(graph: WaypointGraph, kind: Literal["weak", "strong"]) -> LongArray:
    """Return the label of each node's component, int64 (n,)."""
    from scipy.sparse import coo_array  # noqa: PLC0415 - on demand
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    ones = np.ones(graph.n_edges)
    shape = (graph.n_nodes, graph.n_nodes)
    matrix = coo_array((ones, (graph.edges[:, 0], graph.edges[:, 1])), shape=shape)
    return connected_components(matrix, directed=True, connection=kind)[1].astype(np.int64)
