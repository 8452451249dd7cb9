"""Nodes at the ends of links: found, or added and joined to the graph of the floor. Public:
`DoorLine` and `to_networkx`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.trig import hypots
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.links import Link
from hybridnav.graphs.gather import free_name
from hybridnav.maps.checks import checked_type
from hybridnav.maps.names import place_of_name

if TYPE_CHECKING:
    import networkx as nx

    from hybridnav.graphs import WaypointGraph

# Graphs of several floors, joined by links, as fleets and map editors exchange them.

Point = tuple[float, float]

SAME_POINT_M = 0.01
"""Distance in metres up to which a node of a graph counts as lying at the end of a link."""


@dataclass(frozen=True)
class DoorLine:
    """A door or opening of a floor: the line that a robot crosses.

    Examples
    --------
    >>> from hybridnav.ext.fleet import DoorLine
    >>> DoorLine("1/7", ((2.0, 0.0), (2.0, 0.9)), ("kitchen", "hall")).name
    '1/7'
    """

    name: str
    """Name, unlike those of other doors of the building."""
    ends: tuple[Point, Point]
    """Two points `(x, y)` in metres, in the frame of the floor."""
    rooms: tuple[str | None, str | None] = (None, None)
    """The rooms on both sides; None for nameless space, or where the file does not say."""
    is_opening: bool = False
    """Whether it is no door that could be shut."""


@dataclass(frozen=True, eq=False)
class FloorArea:
    """A room or corridor of a floor: one closed outline.

    Examples
    --------
    >>> from hybridnav.ext.fleet import FloorArea
    >>> FloorArea("hall", "corridor", np.array([[0, 0], [4, 0], [4, 1], [0, 1.0]])).kind
    'corridor'
    """

    name: str
    kind: Literal["room", "corridor"]
    outline: FloatArray
    """float64 (k, 2), corners `(x, y)` in metres, each once."""


@copies_alike
@dataclass(frozen=True, eq=False, kw_only=True)
class FloorGraph:
    """The graph of one floor, with its doors and areas where these are known.

    Made by `floor_graph` from a map, and by `load_building_graph` from a file.

    Examples
    --------
    >>> from hybridnav.ext.fleet import floor_graph
    >>> from hybridnav.graphs import build_lane_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floor_graph(topology, build_lane_graph(topology), name="2", elevation_m=3.5).name
    '2'
    """

    name: str
    graph: WaypointGraph
    """Nodes and edges, in the frame of the floor. Facts that writers know: of nodes `name`, of
    edges `door_name` and `speed_limit` in m/s."""
    elevation_m: float | None = None
    """Height of the floor in metres over any common zero; None if it is not known."""
    doors: tuple[DoorLine, ...] = ()
    """Doors and openings."""
    areas: tuple[FloorArea, ...] = ()
    """Rooms and corridors."""


@copies_alike
@dataclass(frozen=True, eq=False, kw_only=True)
class BuildingGraph:
    """The graphs of the floors of a building, and the links between them.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in "12"]
    >>> building_graph(Building(floors), name="house").floor("2").name
    '2'
    """

    name: str
    floors: tuple[FloorGraph, ...]
    """One or more, from the lowest to the highest where that is known."""
    links: tuple[Link, ...] = ()
    """Lifts, stairs and ramps."""

    def __post_init__(self) -> None:
        """Refuse floors and links that do not fit together."""
        names = [checked_type("floors", floor, FloorGraph).name for floor in self.floors]
        if not names or len(set(names)) < len(names):
            raise InvalidValueError(
                f"building {self.name!r:.60} has the floors {', '.join(names)[:200] or 'none'}, "
                "expected one or more of different names"
            )
        floor_names = set(names)
        links = [checked_type("links", link, Link) for link in self.links]
        if len({link.name for link in links}) < len(links):
            raise InvalidValueError(
                f"building {self.name!r:.60} has two links of one name, expected different names"
            )
        for link in links:
            for end in link.ends:
                if end.floor not in floor_names:
                    raise InvalidValueError(
                        f"link {link.name!r:.60} has an end on floor {end.floor!r:.60}, expected "
                        f"one of {', '.join(names)[:200]}"
                    )

    def floor(self, name: str) -> FloorGraph:
        """Return the floor with a name.

        Raises
        ------
        InvalidValueError
            When there is none; the message suggests the nearest ones.
        """
        names = tuple(floor.name for floor in self.floors)
        return self.floors[place_of_name(name, names, "floor")]


Stub = tuple[str, tuple[float, float], int]
"""Name of a link, its end in metres, and the node that it is joined to."""
Stop = tuple[FloorGraph, int]
"""A floor that a link stops at, and the node at its end there."""


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
    >>> from hybridnav.ext.fleet import Building, BuildingGraph, Floor, Link, LinkEnd
    >>> from hybridnav.ext.fleet import building_graph, join_links
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in "12"]
    >>> drawn = building_graph(Building(floors)).floors
    >>> lift = Link(name="lift", kind="lift", ends=(LinkEnd("1", (3, 4)), LinkEnd("2", (3, 4))))
    >>> joined = join_links(BuildingGraph(name="house", floors=drawn, links=(lift,)))
    >>> joined.floors[1].graph.names[-1]
    'link lift'
    """
    checked_type("building", building, BuildingGraph)
    floors = []
    for floor in building.floors:
        stubs: list[Stub] = []
        for link in building.links:
            end = link.end_on(floor.name)
            if end is None or node_at(floor.graph, end.position_m) is not None:
                continue
            away = hypots(*(floor.graph.points - end.position_m).T)
            stubs.append((link.name, end.position_m, int(np.argmin(away))))
        floors.append(replace(floor, graph=with_stubs(floor.graph, stubs)) if stubs else floor)
    same = all(one is other for one, other in zip(floors, building.floors, strict=True))
    return building if same else replace(building, floors=tuple(floors))


def to_networkx(building: BuildingGraph) -> nx.MultiDiGraph[Any]:
    """Return one graph of all floors of a building, with nodes `(floor, id)`.

    Floors are as `WaypointGraph.to_networkx` returns them. The nodes at the ends of a link are
    joined from floor to floor, as it leads, with its name as `link`, `kind`, `ride_s` and `cost_m`.

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
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph, to_networkx
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in "12"]
    >>> list(to_networkx(building_graph(Building(floors))))[0]
    ('1', 0)
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
        facts = {"link": link.name, "kind": link.kind, "ride_s": link.ride_s, "cost_m": link.cost_m}
        for ends in rides_between(joined, link):
            tail, head = ((floor.name, floor.graph.names[node]) for floor, node in ends)
            whole.add_edge(tail, head, **facts)
    return whole


def node_at(graph: WaypointGraph, point: tuple[float, float]) -> int | None:
    """Return the node nearest to a point, None if it lies farther than 1 cm away."""
    away = hypots(*(graph.points - point).T)
    nearest = int(np.argmin(away))
    return nearest if away[nearest] <= SAME_POINT_M else None


def nodes_of_link(building: BuildingGraph, link: Link) -> list[Stop]:
    """Return the floors that a link stops at, and the node at its end on each.

    `building`: a building with nodes at all ends, as `join_links` returns it; `link`: one of its
    links.
    """
    stops = []
    for end in link.ends:
        floor = building.floor(end.floor)
        node = node_at(floor.graph, end.position_m)
        assert node is not None  # noqa: S101 - links are joined
        stops.append((floor, node))
    return stops


def rides_between(building: BuildingGraph, link: Link) -> list[tuple[Stop, Stop]]:
    """Return from where to where a link leads to its next floor; see `nodes_of_link`."""
    up = list(itertools.pairwise(nodes_of_link(building, link)))
    down = [(high, low) for low, high in up]
    return [pair for pair in [*up, *down] if link.leads(pair[0][0].name, pair[1][0].name)]


def with_stubs(graph: WaypointGraph, stubs: Sequence[Stub]) -> WaypointGraph:
    """Return a graph with a node at the end of each of some links, joined in both directions.

    `stubs`: the ends, and the nodes that they are joined to.
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
        names.append(free_name(itertools.chain([wanted], numbered), taken))
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
