"""Graphs of several floors: their files, whoever has made them, and those of our maps."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav._base.files import printable
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.typing import PathLike
from hybridnav._base.yaml_file import parse_document, read_text
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.ext.fleet import Building, BuildingGraph, DoorLine, FloorArea, FloorGraph, Link
from hybridnav.ext.fleet.files.indoorgml import is_indoorgml, read_indoor_floors
from hybridnav.ext.fleet.files.lif import is_lif, read_lif
from hybridnav.ext.fleet.files.osm_read import read_osm
from hybridnav.ext.fleet.files.osm_xml import Anchor, is_osm
from hybridnav.ext.fleet.files.rmf_editor import is_drawn, read_drawn
from hybridnav.ext.fleet.files.rmf_read import is_rmf, read_rmf
from hybridnav.ext.fleet.link_nodes import Stub, node_at, with_stubs
from hybridnav.graphs import RouteGraph, WaypointGraph, build_lane_graph
from hybridnav.graphs.attach import Network, placed_points
from hybridnav.graphs.files import graphml_yaml as graph_yaml
from hybridnav.graphs.files import json_graphs as graph_json
from hybridnav.graphs.lanes import waypoint_graph_of
from hybridnav.maps.checks import checked_type
from hybridnav.refine import Sight
from hybridnav.rooms import Door, Rooms
from hybridnav.rooms.find import outside_of
from hybridnav.topology import TopologicalMap

_MOST_XML = 2**26
"""Most bytes of GraphML, and of XML that turns out to be another format."""
JSON, XML = (".geojson", ".json", ".lif"), (".graphml", ".osm", ".xml")
GML = ".gml"


def load_building_graph(
    path: PathLike, *, anchor: Anchor | None = None, graph_index: int | None = None
) -> BuildingGraph:
    """Read a graph of one or several floors, with the links between them.

    Parameters
    ----------
    path
        A file of one of these formats:

        * `.yaml`, `.yml`: a navigation graph of Open-RMF, or a building map of its traffic editor;
        * `.osm`, `.xml`: OpenStreetMap's XML with indoor tags, or an area graph (osmAG);
        * `.json`, `.lif`: a layout in VDMA's Layout Interchange Format, or IndoorGML 2.0.
    anchor
        Place of the frame of a file of OpenStreetMap on the Earth. None for the node that is named
        root, or else the least latitude and longitude of the file.
    graph_index
        Which of the graphs of a building map, from 0 to 9; None for the first that has lanes.

    Returns
    -------
    BuildingGraph
        The floors, each with its graph, in the frame of the file, and the links. What can be read
        around is in the `findings` of the graph of each floor.

    Raises
    ------
    MapNotFoundError
        When there is no such file.
    MapError
        When it cannot be read: it is in none of these formats, too large, or has no node with a
        point.

    Examples
    --------
    >>> from hybridnav.ext.fleet import load_building_graph
    >>> from pathlib import Path
    >>> text = "levels: {L1: {vertices: [[0, 0, {name: dock}], [3, 4, {}]], lanes: [[0, 1, {}]]}}"
    >>> _ = Path("graph.yaml").write_text(text)
    >>> building = load_building_graph("graph.yaml")
    >>> building.floors[0].name, building.floors[0].graph.names
    ('L1', ('dock', 1))
    """
    where, suffix = f"graph {printable(path)}", Path(path).suffix.lower()
    text = read_graph_text(path)
    name = Path(path).name.split(".")[0]
    try:
        if suffix in XML:
            return read_osm(text, where, name, anchor=anchor)
        if suffix in JSON:
            read = read_indoor_floors if is_indoorgml(text) else read_lif
            return read(text, where, name)
        data = parse_document(text, where, MapError, graph_yaml.LIMITS)
        if not is_rmf(data):
            raise MapError(f"{where}: expected a file of Open-RMF, a mapping with 'levels'")
        return read_open_rmf(data, where, name, graph_index)
    except InvalidValueError as error:
        raise MapError(str(error)) from None


def read_graph_text(path: PathLike) -> str:
    """Return the text of a file of a graph, as long as its format may be."""
    suffix = Path(path).suffix.lower()
    kind, most = "YAML or text", graph_yaml.LIMITS.max_bytes
    if suffix in JSON:
        kind, most = "JSON", graph_json.MOST_BYTES
    elif suffix in XML:
        kind, most = "XML", _MOST_XML
    elif suffix == GML:
        kind, most = "GML", graph_yaml.MOST_GML
    return read_text(
        path, what="graph", error=MapError, missing=MapNotFoundError, max_bytes=most, kind=kind
    )


def read_open_rmf(
    data: dict[str, Any], where: str, name: str, graph_index: int | None = None
) -> BuildingGraph:
    """Read a file of Open-RMF, drawn or not."""
    if is_drawn(data):
        return read_drawn(data, where, name, graph_index=graph_index)
    return read_rmf(data, where, name)


def floor_in(building: BuildingGraph, floor: str | None, where: str) -> WaypointGraph:
    """Return the graph of a floor, or of the only one.

    Raises `MapError` when there are several and none is chosen.
    """
    if floor is None and len(building.floors) > 1:
        names = ", ".join(each.name for each in building.floors)
        raise MapError(f"{where}: it has the floors {names[:200]}: choose one")
    return (building.floors[0] if floor is None else building.floor(floor)).graph


def floors_of_text(text: str, suffix: str, where: str, name: str) -> BuildingGraph | None:
    """Return the building of a text of XML or JSON, None if it is of another format."""
    if suffix in XML and is_osm(text):
        return read_osm(text, where, name)
    if suffix in JSON and is_lif(text):
        return read_lif(text, where, name)
    if suffix in JSON and is_indoorgml(text):
        return read_indoor_floors(text, where, name)
    return None


# The graph of a floor as its map has it: nodes, doors, rooms, and the ends of links.


def floor_graph(  # noqa: PLR0913 - all but the first two are keywords
    topology: TopologicalMap,
    graph: RouteGraph,
    *,
    name: str,
    elevation_m: float | None = None,
    links: Sequence[Link] = (),
    tolerance_m: float = 0.05,
) -> FloorGraph:
    """Return the graph of a floor with all that its map knows, for `BuildingGraph`.

    Parameters
    ----------
    topology
        The map. With rooms, nodes in rooms have the room's name as `name`, edges that pass a door
        have it as `door_name`, and the floor has areas. It also has the listed doors and openings
        that an edge passes, none that are closed to the robot or lead nowhere. They are called
        "FLOOR_doorNUMBER" and "FLOOR_openingNUMBER".
    graph
        Its route graph, as `build_lane_graph` and `keep_right` make it.
    name
        Name of the floor.
    elevation_m
        Its height in metres; None if it is not known.
    links
        Links of the building. Their ends on this floor become nodes, joined to the nearest node in
        sight.
    tolerance_m
        Corners of outlines of rooms go that cut off less than a square of this side, in metres.

    Returns
    -------
    FloorGraph
        The outline of a room is that of its largest part, without holes.

    Raises
    ------
    InvalidValueError
        When the graph is of another map, the tolerance is not positive and finite, or an end of a
        link is not free or sees no node.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph
    >>> from hybridnav.ext.fleet import floor_graph
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> floor = floor_graph(topology, build_lane_graph(topology), name="1")
    >>> floor.graph.n_nodes > 2, floor.doors
    (True, ())
    """
    checked_type("topology", topology, TopologicalMap)
    checked_type("graph", graph, RouteGraph)
    if graph.grid is not topology.grid:
        raise InvalidValueError(
            f"the graph is of map {graph.grid.name!r:.60}, expected one of the topological map's"
        )
    if not 0 < tolerance_m < math.inf:
        raise InvalidValueError(f"tolerance_m must be positive and finite, got {tolerance_m}")
    rooms = topology.rooms if topology.has_rooms else None
    passed = {number for numbers in graph.edge_doors for number in numbers}
    listed = () if rooms is None else rooms.listed_doors
    doors = [door for door in listed if door.number in passed]
    plain = _plain(graph, {d.number: _named(d, name) for d in doors if not d.is_opening})
    stubs = _stubs(graph, plain, name, links)
    return FloorGraph(
        name=name,
        graph=with_stubs(plain, stubs) if stubs else plain,
        elevation_m=elevation_m,
        doors=() if rooms is None else tuple(_lines(rooms, doors, name)),
        areas=() if rooms is None else tuple(_areas(rooms, tolerance_m)),
    )


def building_graph(
    building: Building,
    *,
    name: str = "building",
    build: Callable[[TopologicalMap], RouteGraph] = build_lane_graph,
    progress: Progress = no_progress,
) -> BuildingGraph:
    """Return the graph of a building: a route graph of each floor, and the links between them.

    Parameters
    ----------
    building
        The building. Links that its robot does not fit in are left out.
    name
        Name of the building in files.
    build
        Makes the route graph of a floor, as `build_lane_graph` does.
    progress
        Called after each floor with the number of floors done and of all floors.

    Returns
    -------
    BuildingGraph
        Each floor in the frame of its own map; `align_floors` brings them into one.

    Raises
    ------
    InvalidValueError
        As `build` and `floor_graph` do.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd, building_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")]
    >>> ends = LinkEnd("1", (0.5, 0.5)), LinkEnd("2", (0.5, 0.5))
    >>> house = Building(floors, [Link(name="lift", kind="lift", ends=ends)])
    >>> graph = building_graph(house)
    >>> [floor.name for floor in graph.floors], [link.name for link in graph.links]
    (['1', '2'], ['lift'])
    """
    checked_type("building", building, Building)
    radius_m = building.robot_radius_m
    links = tuple(link for link in building.links if link.admits(radius_m, stairs=True))
    floors = []
    for number, floor in enumerate(building.floors, start=1):
        topology = floor.planner.topology
        graph = build(topology)
        height = floor.elevation_m
        floors.append(
            floor_graph(topology, graph, name=floor.name, elevation_m=height, links=links)
        )
        progress(number, len(building.floors))
    return BuildingGraph(name=name, floors=tuple(floors), links=links)


def _named(door: Door, floor: str) -> str:
    return f"{floor}_{door.kind}{door.number}"


def _plain(graph: RouteGraph, door_names: dict[int, str]) -> WaypointGraph:
    """Return a route graph with names of nodes and doors as facts; a room has its name at its first
    node, unless that is a named point."""
    plain = waypoint_graph_of(graph)
    named: set[str] = set()
    for node, facts in plain.node_facts.items():
        room = graph.rooms[node]
        if graph.names[node] is not None:
            facts["name"] = graph.names[node]
        elif graph.kinds[node] == "room" and room is not None and room not in named:
            named.add(room)
            facts["name"] = room
    for edge, facts in plain.edge_facts.items():
        names = [door_names[number] for number in graph.edge_doors[edge] if number in door_names]
        if names:
            facts["door_name"] = names[0]
    return plain


def _stubs(
    graph: RouteGraph, plain: WaypointGraph, floor: str, links: Sequence[Link]
) -> list[Stub]:
    ends = [(link.name, end.position_m) for link in links if (end := link.end_on(floor))]
    ends = [(name, end) for name, end in ends if node_at(plain, end) is None]
    if not ends:
        return []
    grid = graph.grid
    free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
    points = np.array([end for _, end in ends], dtype=np.float64)
    positions, _, is_free = placed_points(points, grid, free)
    for (name, (x, y)), can_stand in zip(ends, is_free.tolist(), strict=True):
        if not can_stand:
            raise InvalidValueError(
                f"link {name!r:.60}: its end ({x:g}, {y:g}) on floor {floor!r:.60} is not free for "
                f"a robot radius of {grid.robot_radius_m:g} m: move it"
            )
    network = Network.of(Sight(free), graph.positions, graph.edges)
    offsets, nodes, _ = network.in_sight(positions)
    stubs = []
    for at, (name, (x, y)) in enumerate(ends):
        if offsets[at] == offsets[at + 1]:
            if outside_of(grid)[grid.frame.cell_of(x, y)]:
                raise InvalidValueError(
                    f"link {name!r:.60}: its end ({x:g}, {y:g}) on floor {floor!r:.60} lies on "
                    "free ground outside the building, which no door joins with it: move it"
                )
            raise InvalidValueError(
                f"link {name!r:.60}: its end ({x:g}, {y:g}) on floor {floor!r:.60} sees no node of "
                "the graph: move it, or build the graph with more nodes"
            )
        stubs.append((name, (x, y), int(nodes[offsets[at]])))
    return stubs


def _lines(rooms: Rooms, doors: list[Door], floor: str) -> list[DoorLine]:
    return [
        DoorLine(_named(door, floor), rooms.door_ends(door.number), door.rooms, door.is_opening)
        for door in doors
    ]


def _areas(rooms: Rooms, tolerance_m: float) -> list[FloorArea]:
    import shapely  # noqa: PLC0415 - rooms alone need it

    from hybridnav.rooms.files.entries import Read  # noqa: PLC0415
    from hybridnav.rooms.files.outlines import outlines_of  # noqa: PLC0415 - loads scipy
    from hybridnav.rooms.files.read import check_rooms  # noqa: PLC0415

    check_rooms(
        Read(f"map {rooms.grid.name}", list(rooms.names)), rooms.labels.label_of, rooms.grid
    )
    outlines = outlines_of(rooms.labels.label_of, len(rooms.names), rooms.grid, tolerance_m)
    areas = []
    for name, rings in zip(rooms.names, outlines, strict=True):
        largest = max(rings, key=lambda ring: shapely.Polygon(ring).area)
        areas.append(FloorArea(name, "room", frozen(np.ascontiguousarray(largest))))
    return areas
