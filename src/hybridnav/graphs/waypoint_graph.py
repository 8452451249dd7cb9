"""Graphs that others have made: nodes at points, directed edges, and their components."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.trig import hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.graphs.gather import Finding, Findings, Gathered, edge_text, point_of, shown
from hybridnav.maps import OccupancyGrid

if TYPE_CHECKING:
    import networkx as nx


Name = int | str


@copies_alike
@dataclass(frozen=True, eq=False, kw_only=True)
class WaypointGraph:
    """Nodes at points and directed edges between them, as another program or a person made them.

    Made by `load_graph` or `WaypointGraph.from_networkx`. Nothing is known about the map: nodes may
    lie in walls and edges pass through them, which `check_graph` finds. A passage in both
    directions is two edges.

    Examples
    --------
    >>> from hybridnav.graphs import WaypointGraph
    >>> import networkx as nx
    >>> plain = nx.DiGraph()
    >>> plain.add_node("dock", x=0.5, y=1.0)
    >>> plain.add_node("gate", x=3.5, y=5.0)
    >>> plain.add_edge("dock", "gate")
    >>> graph = WaypointGraph.from_networkx(plain)
    >>> graph.n_nodes, graph.edges.tolist(), graph.lengths_m.tolist()
    (2, [[0, 1]], [5.0])
    """

    name: str
    format: str
    """Where it is from: nav2, strands, strands-text, tmap2, graphml, gml, node-link, networkx, rmf,
    osm, lif, indoorgml, or hybridnav for the graph of a map."""
    frame: str
    """Name of the frame of the points; empty if the file has none."""
    names: tuple[Name, ...]
    """Id of each node."""
    points: FloatArray
    """float64 (n, 2), `(x, y)` of each node in metres."""
    edge_names: tuple[Name | None, ...]
    """Id of each edge; None if it has none."""
    edges: LongArray
    """int64 (m, 2), tail and head of each edge, as indices of nodes."""
    costs: FloatArray
    """float64 (m,), cost of each edge as stated, in any unit; NaN for none."""
    lines: dict[int, FloatArray] = field(default_factory=dict)
    """float64 (k, 2), points in metres of the edges that are not drawn straight from node to node.
    Nav2 does not read them, and nothing here plans along them."""
    node_facts: dict[int, dict[str, Any]] = field(default_factory=dict)
    """All else that the file states about a node, nested as it is there."""
    edge_facts: dict[int, dict[str, Any]] = field(default_factory=dict)
    """All else that the file states about an edge."""
    others: tuple[dict[str, Any], ...] = ()
    """Features of a GeoJSON file that are neither nodes nor edges, such as polygons."""
    findings: tuple[Finding, ...] = ()
    """Faults of the file itself."""

    @classmethod
    def from_networkx(cls, graph: nx.Graph[Any], *, name: str = "") -> WaypointGraph:
        """Return the graph of a networkx graph of any kind.

        Parameters
        ----------
        graph
            Each node has its point in metres in attributes: `x` and `y`, or one pair called
            `point`, `world`, `position`, `coordinates`, `pos` or `xy`, the first that is there. An
            undirected edge becomes two edges. The attribute `cost`, or else `weight`, is the cost.
        name
            Name of the graph; that of the networkx graph by default.

        Returns
        -------
        WaypointGraph
            Nodes without a point are left out, with their edges, and listed in `findings`.

        Raises
        ------
        InvalidValueError
            When no node has a point.

        Examples
        --------
        >>> from hybridnav.graphs import WaypointGraph
        >>> import networkx as nx
        >>> plain = nx.Graph()
        >>> plain.add_node(1, pos=(0.0, 0.0))
        >>> plain.add_node(2, pos=(1.0, 0.0))
        >>> plain.add_edge(1, 2, weight=7)
        >>> WaypointGraph.from_networkx(plain).costs
        array([7., 7.])
        """
        gathered = Gathered("networkx graph")
        for node, facts in graph.nodes(data=True):
            gathered.add_node(node, point_of(facts), facts)
        for tail, head, facts in graph.edges(data=True):
            gathered.add_link((tail, head), facts, directed=graph.is_directed())
        return cls(**gathered.fields("networkx", name or str(graph.name)))

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.points)

    @property
    def n_edges(self) -> int:
        """Number of edges; a passage in both directions counts twice."""
        return len(self.edges)

    @property
    def ids(self) -> tuple[list[Name], list[Name | None]]:
        """The ids of nodes and edges that stay from one export to the next. They are whole numbers
        that the facts hold as `id`, as files of Open-RMF, OpenStreetMap and LIF by hybridnav do;
        for others their names."""
        node_ids = [_kept_id(self.node_facts, at, name) for at, name in enumerate(self.names)]
        edge_ids = [_kept_id(self.edge_facts, at, name) for at, name in enumerate(self.edge_names)]
        return [name for name in node_ids if name is not None], edge_ids

    @property
    def lengths_m(self) -> FloatArray:
        """float64 (m,), distance between the two nodes of each edge in metres."""
        steps = self.points[self.edges[:, 1]] - self.points[self.edges[:, 0]]
        return hypots(steps[:, 0], steps[:, 1])

    @property
    def digest(self) -> str:
        """SHA-256 of the points and edges: all that routes depend on."""
        digest = hashlib.sha256(f"{self.points.shape} {self.edges.shape}".encode())
        digest.update(self.points.tobytes())
        digest.update(self.edges.tobytes())
        return digest.hexdigest()

    def edge_text(self, edge: int) -> str:
        """Return the words for an edge in messages.

        Parameters
        ----------
        edge
            Its index.
        """
        tail, head = self.edges[edge].tolist()
        return edge_text(self.edge_names[edge], self.names[tail], self.names[head])

    def to_networkx(self) -> nx.MultiDiGraph[Any]:
        """Return the graph with nodes by their ids, `x` and `y` and `length_m` in metres, and all
        facts.

        Where several nodes have one id, the last has the facts, and the edges of all.
        """
        import networkx as nx  # noqa: PLC0415 - on demand

        graph: nx.MultiDiGraph[Any] = nx.MultiDiGraph(name=self.name)
        for node, (x, y) in enumerate(self.points.tolist()):
            graph.add_node(self.names[node], **(self.node_facts.get(node, {}) | {"x": x, "y": y}))
        costs = self.costs.tolist()
        for edge, ((tail, head), length_m) in enumerate(
            zip(self.edges.tolist(), self.lengths_m.tolist(), strict=True)
        ):
            facts = self.edge_facts.get(edge, {}) | {"length_m": length_m}
            if not math.isnan(costs[edge]):
                facts["cost"] = costs[edge]
            graph.add_edge(self.names[tail], self.names[head], self.edge_names[edge], **facts)
        return graph


def _kept_id(facts_of: dict[int, dict[str, Any]], at: int, name: Name | None) -> Name | None:
    found = facts_of.get(at, {}).get("id")
    return found if isinstance(found, int) and not isinstance(found, bool) else name


# The route graph of a map: nodes, straight edges, and what is known of them.

LANE = "lane"
"""Kind of the nodes of lanes."""


@copies_alike
@dataclass(frozen=True, eq=False)
class RouteGraph:
    """Nodes in free space, and straight edges between them that are free for the robot.

    Edges have a direction: a passage in both directions is two edges. Made by `build_lane_graph`.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=12.0)
    >>> graph = build_lane_graph(hn.TopologicalMap(pyramid))
    >>> graph.n_nodes > 2, graph.kinds[0]
    (True, 'crossing')
    """

    grid: OccupancyGrid
    positions: FloatArray
    """float64 (n, 2), (row, col) of each node in grid units."""
    kinds: tuple[str, ...]
    """The kind of each node: room, door, point (a named one), crossing, end (of a lane), bend, or
    lane (of `keep_right`)."""
    rooms: tuple[str | None, ...]
    """The room of each node, None for no room."""
    doors: LongArray
    """int64 (n,), the number of the door that a node lies in, 0 for none."""
    names: tuple[str | None, ...]
    """The name of each node that is a named point, None for others."""
    edges: LongArray
    """int64 (m, 2), tail and head of each edge, sorted."""
    edge_rooms: tuple[str | None, ...]
    """The room in which the middle of each edge lies, None for no room."""
    edge_doors: tuple[tuple[int, ...], ...]
    """Numbers of the doors that each edge passes."""
    widths_m: FloatArray
    """float64 (m,), the free width across each edge where that is least, in metres."""
    clearances_m: FloatArray
    """float64 (m,), the least distance from the centre of a cell on each edge to an occupied cell,
    in metres; infinite where none is occupied."""
    left_m: FloatArray
    """float64 (m,), the least free distance to the left of each edge, in metres."""
    right_m: FloatArray
    """float64 (m,), the least free distance to the right."""
    ids: tuple[LongArray, LongArray]
    """int64 (n,) and (m,), the ids of nodes and edges in files and messages, each once. Nodes count
    from 0, edges after them, unless `build_lane_graph` has kept the ids of an earlier graph."""

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.positions)

    @property
    def n_edges(self) -> int:
        """Number of edges; a passage in both directions counts twice."""
        return len(self.edges)

    @cached_property
    def is_lane(self) -> BoolArray:
        """bool (m,), edges that are part of a lane, and so lead in one direction only."""
        lanes = np.array([kind == LANE for kind in self.kinds], dtype=np.bool_)
        return frozen(np.asarray(lanes[self.edges].any(axis=1), dtype=np.bool_))

    @cached_property
    def points(self) -> FloatArray:
        """float64 (n, 2), `(x, y)` of each node in metres, map frame."""
        return frozen(self.grid.frame.points_of_grid(self.positions))

    @cached_property
    def lengths_m(self) -> FloatArray:
        """float64 (m,), length of each edge in metres."""
        steps = self.positions[self.edges[:, 1]] - self.positions[self.edges[:, 0]]
        return frozen(hypots(steps[:, 0], steps[:, 1]) * self.grid.resolution_m)

    def to_networkx(self) -> nx.DiGraph[int]:
        """Return the graph, with `point`, `kind`, `room` and `door` of nodes, `length_m` of
        edges."""
        import networkx as nx  # noqa: PLC0415 - on demand

        graph: nx.DiGraph[int] = nx.DiGraph()
        for node, point in enumerate(self.points.tolist()):
            known = {"kind": self.kinds[node], "room": self.rooms[node]}
            graph.add_node(node, point=tuple(point), door=int(self.doors[node]), **known)
        for (tail, head), length_m in zip(
            self.edges.tolist(), self.lengths_m.tolist(), strict=True
        ):
            graph.add_edge(tail, head, length_m=length_m)
        return graph


# Components that no edge connects, and nodes without a route there and back.


def add_components(
    findings: Findings, graph: WaypointGraph, component: LongArray, is_beyond: BoolArray
) -> None:
    """Add nodes outside the building, components apart, and nodes that cannot be both reached and
    left.

    `component`: int64 (n,), the connected part of free space in which each node lies, -1 for none;
    `is_beyond`: bool (n,), nodes outside the building.
    """
    weak = components_of(graph.n_nodes, graph.edges, "weak")
    points = graph.points.tolist()
    for node in np.flatnonzero(is_beyond).tolist():
        findings.add("node-beyond", f"node {shown(graph.names[node])}", tuple(points[node]))
    inside = np.where(is_beyond, -1, component)
    for kind, found in (
        ("components", cut_off(component, weak)),
        ("island", islands(inside, weak)),
    ):
        for node, count, most in found:
            where = f"{count} nodes with node {shown(graph.names[node])}, apart from {most}"
            findings.add(kind, where, tuple(points[node]))
    add_one_way(findings, graph, one_way_nodes(graph.n_nodes, graph.edges))


def add_one_way(findings: Findings, graph: WaypointGraph, nodes: LongArray) -> None:
    """Add nodes of a graph that cannot be both reached and left."""
    points = graph.points.tolist()
    for node in nodes.tolist():
        findings.add("one-way", f"node {shown(graph.names[node])}", tuple(points[node]))


def one_way_nodes(n_nodes: int, edges: LongArray) -> LongArray:
    """Return the nodes without a route there and back, int64.

    Routes lead from and to the largest strong component of each weak one.

    `n_nodes`: number of nodes; `edges`: int64 (m, 2), tail and head of each edge.
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

    `part_of`: int64 (n,), the connected part of free space in which each node lies, -1 for none;
    `component`: int64 (n,), the component of each node. Yields the first node of a component, the
    number of its nodes in that part, and that of the largest one there.
    """
    size = np.bincount(component, minlength=1)
    for part in np.unique(part_of[part_of >= 0]).tolist():
        nodes = np.flatnonzero((part_of == part) & (size[component] > 1))
        _, first, count = np.unique(component[nodes], return_index=True, return_counts=True)
        for one in np.delete(np.arange(len(count)), count.argmax() if len(count) else []):
            yield int(nodes[first[one]]), int(count[one]), int(count.max())


def islands(part_of: LongArray, component: LongArray) -> Iterator[tuple[int, int, int]]:
    """Yield the components of a graph that neither edges nor free space join with the largest one;
    parameters and values as for `cut_off`."""
    lesser: set[int] = set()
    for part in np.unique(part_of[part_of >= 0]).tolist():
        count = np.bincount(component[part_of == part])
        lesser |= set(np.flatnonzero(count).tolist()) - {int(count.argmax())}
    inside = np.bincount(component, weights=part_of >= 0, minlength=1)
    lesser.add(int(inside.argmax()))
    size = np.bincount(component, minlength=1)
    for one in np.setdiff1d(np.flatnonzero(inside), [*lesser]).tolist():
        yield int((component == one).argmax()), int(size[one]), int(size[inside.argmax()])


def components_of(n_nodes: int, edges: LongArray, kind: Literal["weak", "strong"]) -> LongArray:
    """Return the component of each node of a graph, int64 (n,).

    `n_nodes`: number of nodes; `edges`: int64 (m, 2), tail and head of each edge; `kind`: whether
    the nodes of a component are joined whatever the directions of edges (weak), or each can be
    reached from each (strong).
    """
    from scipy.sparse import coo_array  # noqa: PLC0415 - on demand
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    ones = np.ones(len(edges))
    matrix = coo_array((ones, (edges[:, 0], edges[:, 1])), shape=(n_nodes, n_nodes))
    return connected_components(matrix, directed=True, connection=kind)[1].astype(np.int64)
