"""What is wrong with a graph that others have made, on its map."""

from dataclasses import dataclass

import numpy as np

from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.graphs.attach import PlacedGraph
from hybridnav.graphs.free_space import FreeSpace
from hybridnav.graphs.gather import MOST_EXAMPLES, Finding, Findings, Point, shown
from hybridnav.graphs.lanes import DoorsPassed
from hybridnav.graphs.one_way import against
from hybridnav.graphs.waypoint_graph import WaypointGraph, add_components
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.maps.geometry import cells_of_line, walks_clear
from hybridnav.refine import Sight
from hybridnav.rooms import Rooms
from hybridnav.rooms.listing import FOUND_NAME
from hybridnav.topology import TopologicalMap

_PAIRS = 2000
"""Random free points; the share that sees a node is counted."""
_HALVINGS = 24
"""Steps in which the point where an edge is blocked is found: to a millionth of its length."""


@dataclass(frozen=True, eq=False)
class GraphCheck:
    """A graph on its map, and its faults. Made by `check_graph`.

    Examples
    --------
    >>> from hybridnav.graphs import WaypointGraph, check_graph
    >>> import networkx as nx
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> plain = nx.Graph()
    >>> plain.add_node("a", x=2.5, y=5.0)
    >>> graph = WaypointGraph.from_networkx(plain)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> check = check_graph(topology, graph)
    >>> check.count, check.in_sight
    (0, 1.0)
    """

    grid: OccupancyGrid
    graph: WaypointGraph
    findings: tuple[Finding, ...]
    """The findings, empty if nothing is wrong."""
    is_free: BoolArray
    """bool (n,), nodes where the robot fits."""
    is_clear: BoolArray
    """bool (m,), edges that the robot can follow."""
    doors: tuple[int, int]
    """Number of doors that edges pass, and of all that the robot fits through."""
    rooms: tuple[int, int]
    """Number of rooms with a node, and of all that the robot fits in."""
    in_sight: float
    """Share of free points that see one of their 100 nearest nodes, of 2,000 random ones."""
    along_lines: bool
    """Whether edges run along their lines, instead of straight from node to node."""

    @property
    def count(self) -> int:
        """Number of all cases of all findings."""
        return sum(found.count for found in self.findings)


def check_graph(
    topology: TopologicalMap, graph: WaypointGraph, *, along_lines: bool = False
) -> GraphCheck:
    """Find the faults of a graph on a map.

    Edges are straight from node to node, as Nav2 drives them, unless stated otherwise. Tests
    against the cells are exact, for a disc of the map's robot radius; a point lies in the cell of
    `Frame.cells_of`. The edges of a graph of Nav2 are tried by the walk of its collision monitor
    too. `graphs.KINDS` lists all kinds of findings.

    Parameters
    ----------
    topology
        The map; with rooms, doors that no edge passes and rooms without nodes are found too.
    graph
        The graph.
    along_lines
        Whether the robot follows the lines of edges, as their file draws them.

    Raises
    ------
    InvalidValueError
        When the map allows corner cutting.

    Examples
    --------
    >>> from hybridnav.graphs import WaypointGraph, check_graph
    >>> import networkx as nx
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> plain = nx.Graph()
    >>> plain.add_node("a", x=2.5, y=5.0)
    >>> plain.add_node("b", x=50.0, y=5.0)
    >>> plain.add_edge("a", "b")
    >>> graph = WaypointGraph.from_networkx(plain)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> [found.kind for found in check_graph(topology, graph).findings]
    ['node-outside', 'edge-through-wall']
    """
    checked_type("topology", topology, TopologicalMap)
    checked_type("graph", graph, WaypointGraph)
    grid = topology.grid
    space = FreeSpace.of(grid)
    placed = PlacedGraph.of(graph, grid, space.free, along_lines=along_lines)
    is_clear = placed.clear_edges(space.sight)
    findings = Findings()
    findings.add_all(graph.findings)
    component = np.full(graph.n_nodes, -1, dtype=np.int64)
    component[placed.is_free] = space.component_of[tuple(placed.cells[placed.is_free].T)]
    rooms = topology.room_labels
    is_beyond = (component >= 0) & space.outside(rooms)[component]
    _add_nodes(findings, graph, placed, grid, component)
    _add_edges(findings, topology, (graph, placed), space, is_clear)
    is_kept = space.kept(None if rooms is None else topology.rooms)
    add_components(findings, graph, component, is_beyond)
    _add_parts(findings, space, is_kept, component)
    met = add_rooms_and_doors(findings, topology, placed, is_clear, space, is_kept)
    return GraphCheck(
        grid=grid,
        graph=graph,
        findings=findings.collected(),
        is_free=placed.is_free,
        is_clear=is_clear,
        doors=met[0],
        rooms=met[1],
        in_sight=_share_in_sight(space, placed, space.outside(rooms)),
        along_lines=along_lines,
    )


def _add_nodes(
    findings: Findings,
    graph: WaypointGraph,
    placed: PlacedGraph,
    grid: OccupancyGrid,
    component: LongArray,
) -> None:
    """Add nodes where no robot fits, at one point, or without edges."""
    points = graph.points.tolist()

    def add(kind: str, nodes: LongArray) -> None:
        for node in nodes.tolist():
            findings.add(kind, f"node {shown(graph.names[node])}", tuple(points[node]))

    add("node-outside", np.flatnonzero(~placed.is_inside))
    within = np.flatnonzero(placed.is_inside & ~placed.is_free)
    unexplored = grid.classes[tuple(placed.cells[within].T)] == CellClass.UNEXPLORED
    add("node-in-wall", within[~unexplored])
    add("node-unexplored", within[unexplored])
    first = unique_rows(placed.positions).first
    add("same-point", np.delete(np.arange(graph.n_nodes), first))
    has_edge = np.zeros(graph.n_nodes, dtype=np.bool_)
    has_edge[graph.edges[graph.edges[:, 0] != graph.edges[:, 1]].ravel()] = True
    # One node in a part of free space needs no edge.
    count = np.bincount(component[component >= 0], minlength=1)
    is_only = np.where(component >= 0, count[component] == 1, False)
    add("alone", np.flatnonzero(~has_edge & ~is_only))


def _add_edges(
    findings: Findings,
    topology: TopologicalMap,
    known: tuple[WaypointGraph, PlacedGraph],
    space: FreeSpace,
    is_clear: BoolArray,
) -> None:
    """Add edges that the robot cannot follow, that Nav2 cannot, against a one-way door or line of
    the rooms, and loops and repeated ones."""
    graph, placed = known
    points, edges = graph.points.tolist(), graph.edges

    def add(kind: str, which: LongArray, where: list[str]) -> None:
        for k, edge in enumerate(which.tolist()):
            tail, head = edges[edge].tolist()
            more = where[k] if k < len(where) else ""
            findings.add(
                kind, f"{graph.edge_text(edge)}{more}", tuple(points[tail]), tuple(points[head])
            )

    blocked = np.flatnonzero(~is_clear)
    enterable = space.free | (space.grid.classes == CellClass.UNEXPLORED)
    whole = is_clear
    if len(blocked) and not np.array_equal(enterable, space.free):
        along = bool(placed.lines)
        others = PlacedGraph.of(graph, space.grid, enterable, along_lines=along)
        whole = others.clear_edges(Sight(enterable))
    for kind, which in (
        ("edge-through-wall", blocked[~whole[blocked]]),
        ("edge-unexplored", blocked[whole[blocked]]),
    ):
        add(kind, which, _blocked_at(placed, space, which[:MOST_EXAMPLES]))
    if graph.format == "nav2":
        driven = np.setdiff1d(np.flatnonzero(is_clear), list(placed.lines))
        ends = (placed.cells[edges[driven, end]] for end in (0, 1))
        add("edge-walk", driven[~walks_clear(space.free, *ends)], [])
    clear = np.flatnonzero(is_clear)
    add(
        "edge-against",
        clear[against(topology, map(placed.line_of, clear.tolist()), placed.free)],
        [],
    )
    is_loop = edges[:, 0] == edges[:, 1]
    add("loop", np.flatnonzero(is_loop), [])
    keys = edges[:, 0] * graph.n_nodes + edges[:, 1]
    _, first = np.unique(keys, return_index=True)
    is_again = np.ones(len(edges), dtype=np.bool_)
    is_again[first] = False
    add("repeated-edge", np.flatnonzero(is_again & ~is_loop), [])


def _blocked_at(placed: PlacedGraph, space: FreeSpace, which: LongArray) -> list[str]:
    """Return words for the points at which edges leave free space, seen from their tails."""
    tails, heads = (placed.positions[placed.edges[which, end]] for end in (0, 1))
    begins = placed.is_free[placed.edges[which, 0]]
    low, high = np.zeros(len(which)), np.ones(len(which))
    high[~begins] = 0.0
    ends = np.clip(heads, 0.0, space.free.shape)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        to = np.round((tails + middle[:, None] * (ends - tails)) * GRAIN) / GRAIN
        seen = np.zeros(len(which), dtype=np.bool_)
        seen[begins] = _sees(space, tails[begins], to[begins])
        low, high = np.where(seen, middle, low), np.where(seen, high, middle)
    at = tails + high[:, None] * (ends - tails)
    points = space.grid.frame.points_of_grid(at).tolist()
    return [
        "" if edge in placed.lines else f", blocked at {x:.2f}, {y:.2f}"
        for edge, (x, y) in zip(which.tolist(), points, strict=True)
    ]


def _sees(space: FreeSpace, tails: FloatArray, heads: FloatArray) -> BoolArray:
    """Return which free positions see others, which need not be free."""
    cells = np.minimum(space.cells_at(heads), np.array(space.free.shape) - 1)
    seen: BoolArray = space.free[tuple(cells.T)]
    seen[seen] = space.sight.clear(tails[seen], heads[seen])
    return seen


def _add_parts(
    findings: Findings, space: FreeSpace, is_large: BoolArray, component: LongArray
) -> None:
    """Add parts of free space without nodes."""
    sizes = np.bincount(space.component_of[space.free], minlength=1)
    empty = np.setdiff1d(np.flatnonzero(is_large & (sizes > 0)), component)
    if not len(empty):
        return
    found, first = np.unique(space.component_of, return_index=True)
    for part in empty.tolist():
        cell = np.unravel_index(first[np.searchsorted(found, part)], space.free.shape)
        point: Point = tuple(space.grid.frame.points_of(np.array(cell)).tolist())
        area_m2 = sizes[part] * space.grid.cell_area_m2
        findings.add("missing-part", f"{area_m2:.1f} m²", point)


def _share_in_sight(space: FreeSpace, placed: PlacedGraph, outside: BoolArray) -> float:
    cells = np.argwhere(space.free)
    cells = cells[~outside[space.component_of[space.free]]]
    if not len(cells):
        return 0.0
    chosen = np.random.default_rng(0).integers(len(cells), size=min(_PAIRS, len(cells)))
    network = placed.network(space.sight, placed.edges)
    points = np.asarray(cells[chosen] + 0.5, dtype=np.float64)
    offsets, _, _ = network.in_sight(points)
    return float((np.diff(offsets) > 0).mean())


# Doors that no edge of a graph passes, and rooms in which no node lies.

Counts = tuple[int, int]


def add_rooms_and_doors(  # noqa: PLR0913, PLR0917 - one call, all of it needed
    findings: Findings,
    topology: TopologicalMap,
    placed: PlacedGraph,
    is_clear: BoolArray,
    space: FreeSpace,
    is_large: BoolArray,
) -> tuple[Counts, Counts]:
    """Add doors that no edge passes, and rooms without nodes.

    `topology`: the map; without rooms nothing is added; `placed`: the graph on the map; `is_clear`:
    bool (m,), the edges that the robot can follow; `space`: free space; `is_large`: bool
    (n_components,), the parts of free space that need nodes. Returns number of doors that edges
    pass and of all, of rooms with nodes and of all.
    """
    if not topology.has_rooms:
        return (0, 0), (0, 0)
    rooms = topology.rooms
    part_of = space.component_of.ravel()
    is_kept = (part_of >= 0) & is_large[part_of]
    passes = DoorsPassed(rooms)
    passed: set[int] = set()
    clear = np.flatnonzero(is_clear)
    # Both directions of a straight edge pass the same doors.
    first = unique_rows(np.sort(placed.edges[clear], axis=1)).first
    for edge in {*clear[first].tolist(), *placed.lines} & set(clear.tolist()):
        passed |= set(passes.passed(cells_of_line(space.free, placed.line_of(edge))))
    wanted = [
        door
        for door in rooms.listed_doors
        if door.passable and is_kept[rooms.cells_beside(door.number)].any()
    ]
    for door in wanted:
        if door.number not in passed:
            names = " and ".join("no room" if name is None else name for name in door.rooms)
            findings.add("missing-door", f"door {door.number} between {names}", door.position)
    met = sum(door.number in passed for door in wanted)
    return (met, len(wanted)), _add_rooms(findings, rooms, placed, is_kept)


def _add_rooms(findings: Findings, rooms: Rooms, placed: PlacedGraph, is_kept: BoolArray) -> Counts:
    label_of = rooms.labels.label_of
    visited = set(label_of[tuple(placed.cells[placed.is_free].T)].tolist())
    inside = np.zeros(len(rooms.names), dtype=np.bool_)
    labels = label_of.ravel()[is_kept]
    inside[labels[labels >= 0]] = True
    inside &= rooms.is_listed
    wanted = [name for name in rooms.names if inside[rooms.labels.index(name)]]
    missing = [name for name in wanted if rooms.labels.index(name) not in visited]
    for name in missing:
        kind = "missing-room" if FOUND_NAME.fullmatch(name) else "missing-named-room"
        findings.add(kind, f"room {name}", rooms.point_of(name))
    return len(wanted) - len(missing), len(wanted)
