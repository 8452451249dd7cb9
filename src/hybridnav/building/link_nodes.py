"""Nodes at the ends of links: found, or added and joined to the graph of the floor."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._copies import frozen
from hybridnav.building.floor_graphs import SAME_POINT_M, BuildingGraph, FloorGraph
from hybridnav.grid.checks import checked_type

if TYPE_CHECKING:
    from collections.abc import Sequence

    import networkx as nx

    from hybridnav.building.links import Link
    from hybridnav.graphs import WaypointGraph

Stub = tuple[str, tuple[float, float], int]
"""Name of a link, its end in metres, and the node that it is joined to."""


def join_links(building: BuildingGraph) -> BuildingGraph:
    """Return a building with a node at every end of every link.

    Where no node lies within 1 cm of an end, one is added there, named "link NAME", with an edge to
    the nearest node and one back. Nothing is known about walls here: `floor_graph` joins ends to
    nodes in sight.

    Parameters
    ----------
    building
        The building.

    Returns
    -------
    BuildingGraph
        The same if no node is missing.

    Examples
    --------
    >>> import networkx as nx
    >>> from hybridnav.building import BuildingGraph, FloorGraph, Link, LinkEnd, join_links
    >>> plain = nx.DiGraph()
    >>> plain.add_node("dock", x=0.0, y=0.0)
    >>> graph = hn.WaypointGraph.from_networkx(plain)
    >>> floors = tuple(FloorGraph(name=name, graph=graph) for name in ("1", "2"))
    >>> lift = Link(name="lift", kind="lift", ends=(LinkEnd("1", (3, 4)), LinkEnd("2", (3, 4))))
    >>> joined = join_links(BuildingGraph(name="house", floors=floors, links=(lift,)))
    >>> joined.floors[1].graph.names, joined.floors[1].graph.lengths_m.tolist()
    (('dock', 'link lift'), [5.0, 5.0])
    """
    checked_type("building", building, BuildingGraph)
    floors = []
    for floor in building.floors:
        stubs: list[Stub] = []
        for link in building.links:
            end = link.end_on(floor.name)
            if end is None or node_at(floor.graph, end.position_m) is not None:
                continue
            away = np.hypot(*(floor.graph.points - end.position_m).T)
            stubs.append((link.name, end.position_m, int(np.argmin(away))))
        floors.append(replace(floor, graph=with_stubs(floor.graph, stubs)) if stubs else floor)
    same = all(one is other for one, other in zip(floors, building.floors, strict=True))
    return building if same else replace(building, floors=tuple(floors))


def to_networkx(building: BuildingGraph) -> nx.MultiDiGraph[Any]:
    """Return one graph of all floors of a building, with nodes `(floor, id)`.

    Floors are as `WaypointGraph.to_networkx` returns them. The nodes at the ends of a link are
    joined from floor to floor, in both directions, with its name as `link`, `kind`, `ride_s` and
    `cost_m`.

    Parameters
    ----------
    building
        The building; ends of links without a node are joined as `join_links` does it.

    Returns
    -------
    networkx.MultiDiGraph
        Edges of floors have `length_m`; those of links do not.

    Examples
    --------
    >>> import networkx as nx
    >>> from hybridnav.building import BuildingGraph, FloorGraph, Link, LinkEnd, to_networkx
    >>> plain = nx.DiGraph()
    >>> plain.add_node("dock", x=0.0, y=0.0)
    >>> graph = hn.WaypointGraph.from_networkx(plain)
    >>> floors = tuple(FloorGraph(name=name, graph=graph) for name in ("1", "2"))
    >>> lift = Link(name="lift", kind="lift", ends=(LinkEnd("1", (0, 0)), LinkEnd("2", (0, 0))))
    >>> whole = to_networkx(BuildingGraph(name="house", floors=floors, links=(lift,)))
    >>> sorted(whole.edges())
    [(('1', 'dock'), ('2', 'dock')), (('2', 'dock'), ('1', 'dock'))]
    """
    import networkx as nx  # noqa: PLC0415 - on demand

    joined = join_links(building)
    whole: nx.MultiDiGraph[Any] = nx.MultiDiGraph(name=joined.name)
    for floor in joined.floors:
        plain = floor.graph.to_networkx()
        whole.add_nodes_from(((floor.name, node), facts) for node, facts in plain.nodes.items())
        for tail, head, facts in plain.edges(data=True):
            whole.add_edge((floor.name, tail), (floor.name, head), **facts)
    for link in joined.links:
        at = [(floor.name, floor.graph.names[node]) for floor, node in nodes_of_link(joined, link)]
        facts = {"link": link.name, "kind": link.kind, "ride_s": link.ride_s, "cost_m": link.cost_m}
        for pair in itertools.pairwise(at):
            whole.add_edge(*pair, **facts)
            whole.add_edge(*pair[::-1], **facts)
    return whole


def node_at(graph: WaypointGraph, point: tuple[float, float]) -> int | None:
    """Return the node nearest to a point, None if it lies farther than 1 cm away."""
    away = np.hypot(*(graph.points - point).T)
    nearest = int(np.argmin(away))
    return nearest if away[nearest] <= SAME_POINT_M else None


def nodes_of_link(building: BuildingGraph, link: Link) -> list[tuple[FloorGraph, int]]:
    """Return the floors that a link stops at, and the node at its end on each.

    Parameters
    ----------
    building
        A building with nodes at all ends, as `join_links` returns it.
    link
        One of its links.
    """
    found = []
    for end in link.ends:
        floor = building.floor(end.floor)
        node = node_at(floor.graph, end.position_m)
        assert node is not None  # noqa: S101 - links are joined
        found.append((floor, node))
    return found


def with_stubs(graph: WaypointGraph, stubs: Sequence[Stub]) -> WaypointGraph:
    """Return a graph with a node at the end of each of some links, joined in both directions.

    Parameters
    ----------
    graph
        The graph.
    stubs
        The ends, and the nodes that they are joined to.
    """
    n = graph.n_nodes
    points = np.concatenate([graph.points, [end for _, end, _ in stubs]])
    pairs = [pair for at, (_, _, to) in enumerate(stubs) for pair in ((to, n + at), (n + at, to))]
    edges = np.concatenate([graph.edges, np.array(pairs, dtype=np.int64)])
    taken = set(graph.names)
    names: list[int | str] = list(graph.names)
    for link, _, _ in stubs:
        wanted = f"link {link}"
        numbered = (f"{wanted} ({number})" for number in itertools.count(2))
        name = next(name for name in itertools.chain([wanted], numbered) if name not in taken)
        taken.add(name)
        names.append(name)
    facts = {n + at: {"link": link} for at, (link, _, _) in enumerate(stubs)}
    return replace(
        graph,
        names=tuple(names),
        points=frozen(points),
        edge_names=(*graph.edge_names, *[None] * len(pairs)),
        edges=frozen(edges),
        costs=frozen(np.concatenate([graph.costs, np.full(len(pairs), np.nan)])),
        node_facts=graph.node_facts | facts,
    )
