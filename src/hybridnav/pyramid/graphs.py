"""A level as a graph of other kinds: combinatorial map, dual, simple graph, networkx.

Each is made from the arrays of a `Level`. Those of networkx are for views and files, never for a
hot path.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.rows import connected_parts, unique_rows
from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray
from hybridnav.maps import CellClass, OccupancyGrid

if TYPE_CHECKING:
    import networkx as nx


@copies_alike
@dataclass(frozen=True, eq=False)
class CombinatorialMap:
    """A plane graph and its dual, both held by one permutation of darts.

    Edge e has the darts 2e and 2e + 1, each the other's half: `alpha(d) = d ^ 1`, not stored. The
    dual needs no array of its own: its rotation is `phi = sigma o alpha`.
    """

    sigma: IntArray
    """int32 (2 n_edges,), next dart counter-clockwise round the vertex."""
    origin: IntArray
    """int32 (2 n_edges,), vertex at which each dart starts."""
    protected: BoolArray
    """bool (2 n_edges,), whether the face on the right of the dart is protected: anything but an
    ordinary one, which at the base is a full 2x2 block of vertices."""
    base_edge: IntArray
    """int32 (n_edges,), id of each edge in the base: 2 * flat cell, plus 1 for a step north."""
    n_vertices: int
    """Vertices, those without an edge included."""

    def __post_init__(self) -> None:
        for array in (self.sigma, self.origin, self.protected, self.base_edge):
            array.flags.writeable = False

    @property
    def n_edges(self) -> int:
        """Edges, self-loops included."""
        return len(self.base_edge)

    @property
    def phi(self) -> IntArray:
        """int32 (2 n_edges,), next dart round the face, which lies on the right of its darts."""
        return self.sigma[np.arange(len(self.sigma)) ^ 1]

    def faces(self) -> LongArray:
        """Label the faces: for each dart the number of its orbit under phi, dense from 0."""
        steps = np.stack([np.arange(len(self.sigma)), self.phi], axis=1)
        return connected_parts(steps, len(steps))


class FaceKind(IntEnum):
    """Meaning of a dual vertex."""

    ORDINARY = 0
    """A meeting point of boundaries, or a boundary that closes into a ring."""
    PROTECTED = 1
    """A hole: occupied cells, with all that they wall off."""
    OUTSIDE = 2
    """The surroundings of a component of the graph; every component has one."""


@copies_alike
@dataclass(frozen=True, eq=False)
class DualGraph:
    """Dual of one level.

    Dual vertices are faces, numbered in the order of their first darts; dual edge a crosses arc a.
    """

    face_of: LongArray
    """int64 (2 n_arcs,), face on the right of each dart."""
    kinds: ByteArray
    """uint8 (n_faces,), `FaceKind`."""

    def __post_init__(self) -> None:
        self.face_of.flags.writeable = False
        self.kinds.flags.writeable = False

    @property
    def n_faces(self) -> int:
        """Faces; those of vertices without an arc are not counted."""
        return len(self.kinds)

    @property
    def edges(self) -> LongArray:
        """int64 (n_arcs, 2), the faces on the right of darts 2a and 2a + 1: the endpoints of the
        dual edge that crosses arc a."""
        return self.face_of.reshape(-1, 2)

    @classmethod
    def of_map(cls, darts: CombinatorialMap, outer_darts: LongArray) -> DualGraph:
        """Label the faces of a map.

        Parameters
        ----------
        darts
            The map.
        outer_darts
            One dart on the outer face of each component that has an arc.
        """
        face_of = darts.faces()
        kinds = np.full(int(face_of.max(initial=-1)) + 1, FaceKind.ORDINARY, dtype=np.uint8)
        kinds[face_of[darts.protected]] = FaceKind.PROTECTED
        kinds[face_of[outer_darts]] = FaceKind.OUTSIDE
        return cls(face_of, kinds)


Node = tuple[int, dict[str, Any]]


def multigraph(
    about: dict[str, Any],
    nodes: Iterable[Node],
    endpoints: IntArray | LongArray,
    **columns: list[Any],
) -> nx.MultiGraph[int]:
    """Return a multigraph with an edge for each arc, parallel arcs and self-loops included.

    `about`: attributes of the graph; `nodes`: nodes with their attributes; `endpoints`: int
    (n_arcs, 2), the nodes that each arc joins; the key of an edge is the index of its arc;
    `columns`: attributes of the edges, a value for each arc.
    """
    from networkx import MultiGraph  # noqa: PLC0415 - only who looks at graphs pays

    graph: nx.MultiGraph[int] = MultiGraph(**about)
    graph.add_nodes_from(nodes)
    for arc, (pair, *values) in enumerate(zip(endpoints.tolist(), *columns.values(), strict=True)):
        graph.add_edge(pair[0], pair[1], key=arc, **dict(zip(columns, values, strict=True)))
    return graph


def vertices_with_attributes(
    grid: OccupancyGrid, cells: LongArray, classes: ByteArray, areas: LongArray
) -> Iterator[Node]:
    """Yield each vertex with the attributes of its node in `Level.to_networkx`.

    `cells`: int64 (n, 2), the surviving cells; `classes`: uint8 (n,), their `CellClass`; `areas`:
    int64 (n,), cells of the receptive fields.
    """
    columns = zip(
        cells.tolist(),
        grid.frame.points_of(cells).tolist(),
        classes.tolist(),
        (areas * np.float64(grid.cell_area_m2)).tolist(),
        strict=True,
    )
    for vertex, (cell, position, cell_class, area_m2) in enumerate(columns):
        yield (
            vertex,
            {
                "cell": cell,
                "position": position,
                "class": CellClass(cell_class).name.lower(),
                "area_m2": area_m2,
            },
        )


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

    `about`: attributes of the graph; `nodes`: vertices with their attributes; `arcs`: int (n_arcs,
    2), the vertices that each arc joins; `max_distance_m`, `through_m`: float64 (n_arcs,), as in
    `Level`. Returns the graph, and a report of the arcs that it drops.
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

    `arcs`: int (n_arcs, 2), the vertices that each arc joins; `n_vertices`: vertices of the graph.
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
