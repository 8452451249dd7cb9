"""The graph of a floor as its map has it: nodes, doors, rooms, and the ends of links."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav._base.progress import Progress, no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet import Building, BuildingGraph, DoorLine, FloorArea, FloorGraph, Link
from hybridnav.ext.fleet.link_nodes import Stub, node_at, with_stubs
from hybridnav.graphs import RouteGraph, WaypointGraph, build_lane_graph
from hybridnav.graphs.attach import Network, placed_points
from hybridnav.graphs.lanes import waypoint_graph_of
from hybridnav.maps.checks import checked_type
from hybridnav.refine import Sight
from hybridnav.rooms import Door, Rooms
from hybridnav.rooms.find import outside_of
from hybridnav.topology import TopologicalMap


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
