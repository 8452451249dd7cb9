"""A level as a simple graph, and the arcs that this loses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.maps.islands import unique_rows

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import networkx as nx

    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.pyramid.export import Node

_LISTED = 8


@dataclass(frozen=True)
class ArcGroup:
    """All arcs between the same two vertices, or all self-loops of one."""

    vertices: tuple[int, int]
    """The two vertices, the smaller index first; twice the same for self-loops."""
    arcs: tuple[int, ...]
    """Indices of the arcs, ascending."""


@dataclass(frozen=True)
class SimpleGraphReport:
    """Arcs that a simple graph drops: those beyond the first between two vertices, self-loops."""

    n_vertices: int
    """Vertices; a simple graph keeps them all."""
    n_arcs: int
    """Arcs of the level, self-loops included."""
    parallel: tuple[ArcGroup, ...]
    """Pairs of vertices joined by two arcs or more, with all of these."""
    self_loops: tuple[ArcGroup, ...]
    """Vertices with self-loops, with all of these."""

    @property
    def n_parallel_dropped(self) -> int:
        """Arcs beyond the first between the same two vertices."""
        return sum(len(group.arcs) - 1 for group in self.parallel)

    @property
    def n_self_loops_dropped(self) -> int:
        """Self-loops: a simple graph has none."""
        return sum(len(group.arcs) for group in self.self_loops)

    @property
    def n_edges(self) -> int:
        """Edges that are left."""
        return self.n_arcs - self.n_parallel_dropped - self.n_self_loops_dropped

    def __str__(self) -> str:
        head = (
            f"{self.n_vertices} vertices, {self.n_arcs} arcs; a simple graph keeps "
            f"{self.n_edges} and drops {_counted(self.n_parallel_dropped, 'parallel arc')} and "
            f"{_counted(self.n_self_loops_dropped, 'self-loop')}"
        )
        pairs = [
            f"  between {low} and {high}: arcs {_joined(group.arcs)}, one of them is kept"
            for group in self.parallel
            for low, high in [group.vertices]
        ]
        loops = [
            f"  at {group.vertices[0]}: {'self-loops' if len(group.arcs) > 1 else 'self-loop'} "
            f"{_joined(group.arcs)}"
            for group in self.self_loops
        ]
        return "\n".join([head, *_listed(pairs), *_listed(loops)])


@dataclass(frozen=True, eq=False)
class SimpleGraph:
    """A simple graph of a level, with a report of the arcs that were dropped."""

    graph: nx.Graph[int]
    """Nodes are the vertices, with the attributes of `to_networkx`. Edges join adjacent vertices:
    `max_distance_m`, the same for all arcs that an edge stands for, and `through_m` and the index
    (`arc`) of the one with the least `through_m`."""
    dropped: SimpleGraphReport


def simple_graph(
    about: dict[str, Any],
    nodes: Iterable[Node],
    arcs: IntArray,
    max_distance_m: FloatArray,
    through_m: FloatArray,
) -> SimpleGraph:
    """Return a graph with at most one edge between two vertices and no self-loop.

    Parameters
    ----------
    about
        Attributes of the graph.
    nodes
        Vertices with their attributes.
    arcs
        int (n_arcs, 2), the vertices that each arc joins.
    max_distance_m, through_m
        float64 (n_arcs,), as in `Level`.

    Returns
    -------
    SimpleGraph
        The graph, and a report of the arcs that it drops.
    """
    from networkx import Graph  # noqa: PLC0415 - only who looks at graphs pays

    graph: nx.Graph[int] = Graph(**about)
    graph.add_nodes_from(nodes)
    plain = np.flatnonzero(arcs[:, 0] != arcs[:, 1])
    # Stable: among arcs with an equal through_m, the lowest index is kept.
    by_length = plain[np.argsort(through_m[plain], kind="stable")]
    pairs, first, _, _ = unique_rows(np.sort(arcs[by_length], axis=1))
    for (low, high), arc in zip(pairs.tolist(), by_length[first].tolist(), strict=True):
        graph.add_edge(
            low,
            high,
            arc=arc,
            max_distance_m=float(max_distance_m[arc]),
            through_m=float(through_m[arc]),
        )
    return SimpleGraph(graph, report_of(arcs, len(graph)))


def report_of(arcs: IntArray, n_vertices: int) -> SimpleGraphReport:
    """Report the arcs of a graph that a simple graph drops.

    Parameters
    ----------
    arcs
        int (n_arcs, 2), the vertices that each arc joins.
    n_vertices
        Vertices of the graph.
    """
    loops: BoolArray = arcs[:, 0] == arcs[:, 1]
    parallel = tuple(group for group in _groups(arcs, ~loops) if len(group.arcs) > 1)
    return SimpleGraphReport(n_vertices, len(arcs), parallel, tuple(_groups(arcs, loops)))


def _groups(arcs: IntArray, mask: BoolArray) -> list[ArcGroup]:
    """Return the arcs of a mask in groups with the same two endpoints, in the order of the
    endpoints."""
    index: LongArray = np.flatnonzero(mask)
    pairs, _, group_of, counts = unique_rows(np.sort(arcs[index], axis=1))
    order = np.argsort(group_of, kind="stable")
    bounds = np.cumsum(counts)[:-1]
    members = np.split(index[order], bounds) if len(pairs) else []
    return [
        ArcGroup((low, high), tuple(group.tolist()))
        for (low, high), group in zip(pairs.tolist(), members, strict=True)
    ]


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _joined(arcs: Sequence[int]) -> str:
    return ", ".join(map(str, arcs))


def _listed(lines: list[str]) -> list[str]:
    """Return the first lines, and how many more there are."""
    more = len(lines) - _LISTED
    return [*lines[:_LISTED], f"  and {more} more"] if more > 0 else lines
