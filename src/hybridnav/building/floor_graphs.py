"""Graphs of several floors, joined by links, as fleets and map editors exchange them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from hybridnav._copies import copies_alike
from hybridnav.building.links import Link
from hybridnav.errors import InvalidValueError
from hybridnav.grid.checks import checked_type
from hybridnav.grid.names import place_of_name

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray
    from hybridnav.graphs import WaypointGraph

Point = tuple[float, float]

SAME_POINT_M = 0.01
"""Distance in metres up to which a node of a graph counts as lying at the end of a link."""


@dataclass(frozen=True)
class DoorLine:
    """A door or opening of a floor: the line that a robot crosses.

    Examples
    --------
    >>> from hybridnav.building import DoorLine
    >>> DoorLine("1/7", ((2.0, 0.0), (2.0, 0.9)), ("kitchen", "hall")).name
    '1/7'
    """

    name: str
    """Name, unlike those of other doors of the building."""
    ends: tuple[Point, Point]
    """Two points `(x, y)` in metres, in the frame of the floor."""
    rooms: tuple[str | None, str | None] = (None, None)
    """The rooms on both sides; None for what lies in no room, or where the file does not say."""
    is_opening: bool = False
    """Whether it is no door that could be shut."""


@dataclass(frozen=True, eq=False)
class FloorArea:
    """A room or corridor of a floor: one closed outline.

    Examples
    --------
    >>> from hybridnav.building import FloorArea
    >>> FloorArea("hall", "corridor", np.array([[0, 0], [4, 0], [4, 1], [0, 1.0]])).kind
    'corridor'
    """

    name: str
    """Name."""
    kind: Literal["room", "corridor"]
    """What it is."""
    outline: FloatArray
    """float64 (k, 2), corners `(x, y)` in metres, each once."""


@copies_alike
@dataclass(frozen=True, eq=False, kw_only=True)
class FloorGraph:
    """The graph of one floor, with its doors and areas where these are known.

    Made by `floor_graph` from a map, and by `load_building_graph` from a file.

    Examples
    --------
    >>> import networkx as nx
    >>> from hybridnav.building import FloorGraph
    >>> plain = nx.DiGraph()
    >>> plain.add_node("dock", x=0.5, y=1.0)
    >>> floor = FloorGraph(name="2", graph=hn.WaypointGraph.from_networkx(plain), elevation_m=3.5)
    >>> floor.name, floor.graph.n_nodes
    ('2', 1)
    """

    name: str
    """Name of the floor."""
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
    >>> import networkx as nx
    >>> from hybridnav.building import BuildingGraph, FloorGraph, Link, LinkEnd
    >>> plain = nx.DiGraph()
    >>> plain.add_node("dock", x=0.5, y=1.0)
    >>> graph = hn.WaypointGraph.from_networkx(plain)
    >>> floors = [FloorGraph(name=name, graph=graph) for name in ("1", "2")]
    >>> ends = LinkEnd("1", (0.5, 1.0)), LinkEnd("2", (0.5, 1.0))
    >>> lift = Link(name="lift", kind="lift", ends=ends, ride_s=5)
    >>> building = BuildingGraph(name="house", floors=tuple(floors), links=(lift,))
    >>> building.floor("2").graph.n_nodes
    1
    """

    name: str
    """Name of the building."""
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
        known = set(names)
        links = [checked_type("links", link, Link) for link in self.links]
        if len({link.name for link in links}) < len(links):
            raise InvalidValueError(
                f"building {self.name!r:.60} has two links of one name, expected different names"
            )
        for link in links:
            for end in link.ends:
                if end.floor not in known:
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
        known = tuple(floor.name for floor in self.floors)
        return self.floors[place_of_name(name, known, "floor")]
