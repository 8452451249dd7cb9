"""What is made of a graph that was built: descriptions, and one-way lanes. Public: `keep_right`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.rows import unique_rows
from hybridnav._base.trig import hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.graphs.free_space import RIM_CELLS, FreeSpace
from hybridnav.graphs.joining import Nodes
from hybridnav.graphs.kernels import least_along, least_widths
from hybridnav.graphs.one_way import against
from hybridnav.graphs.waypoint_graph import LANE, RouteGraph, WaypointGraph
from hybridnav.maps import CellClass
from hybridnav.maps.checks import checked_between, checked_type
from hybridnav.maps.geometry import cells_of_line
from hybridnav.rooms import Rooms
from hybridnav.rooms.doors import measured_clearance_m
from hybridnav.topology import TopologicalMap


def waypoint_graph_of(graph: RouteGraph) -> WaypointGraph:
    """Return a route graph as one of others, with what is known of nodes and edges as the fact
    `metadata`."""
    edges = range(graph.n_edges)
    return WaypointGraph(
        name=graph.grid.name,
        format="hybridnav",
        frame="",
        names=tuple(graph.ids[0].tolist()),
        points=graph.points,
        edge_names=tuple(graph.ids[1].tolist()),
        edges=graph.edges,
        costs=graph.lengths_m,
        node_facts={node: {"metadata": _of_node(graph, node)} for node in range(graph.n_nodes)},
        edge_facts={edge: {"metadata": edge_metadata(graph, [edge])} for edge in edges},
    )


def _of_node(graph: RouteGraph, node: int) -> dict[str, Any]:
    """Return what is known of a node: `class`, `name`, `room`, `door`."""
    door = int(graph.doors[node]) or None
    known = {"class": graph.kinds[node], "name": graph.names[node]}
    return _known(known | {"room": graph.rooms[node], "door": door})


def edge_metadata(graph: RouteGraph, chain: Sequence[int]) -> dict[str, Any]:
    """Return what is known of an edge, or of a chain of edges as one.

    `chain`: indices of edges, in the order passed: the room is that of the middle one, doors are
    those of all, measures the least. Returns `class` (door or free), `room`, `door`, `doors`,
    `lane`, and in metres `width_m`, `clearance_m`, `left_m`, `right_m`.
    """
    edges = list(chain)
    doors = list(dict.fromkeys(door for edge in edges for door in graph.edge_doors[edge]))
    room = graph.edge_rooms[edges[len(edges) // 2]]
    known = _known({"class": "door" if doors else "free", "room": room})
    known |= {"door": doors[0], "doors": doors} if doors else {}
    known |= {"lane": "right"} if graph.is_lane[edges].any() else {}
    return known | _known(
        {
            "width_m": float(graph.widths_m[edges].min()),
            "clearance_m": float(graph.clearances_m[edges].min()),
            "left_m": float(graph.left_m[edges].min()),
            "right_m": float(graph.right_m[edges].min()),
        }
    )


def _known(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values that are known and finite, measures in whole millimetres."""
    return {
        name: round(value, 3) if isinstance(value, float) else value
        for name, value in values.items()
        if value is not None and not (isinstance(value, float) and math.isinf(value))
    }


# What is known of the nodes and edges of a route graph: rooms, doors, widths.

FARTHEST_M = 10.0
"""Distance in metres up to which free space beside an edge is measured."""


def described(topology: TopologicalMap, nodes: Nodes, edges: LongArray) -> RouteGraph:
    """Make a route graph, with all that is known of its nodes and edges.

    `edges`: int64 (m, 2), tail and head of each edge.
    """
    grid = topology.grid
    edges = edges[np.lexsort((edges[:, 1], edges[:, 0]))]
    positions = nodes.positions
    free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
    edges = edges[~against(topology, positions[edges], free)]
    rooms = topology.rooms if topology.has_rooms else None
    clearance = rooms.clearance_m if rooms is not None else measured_clearance_m(grid)
    clearances, middles = least_along(free, np.ascontiguousarray(clearance), positions, edges)
    occupied = np.ascontiguousarray(grid.measured == CellClass.OCCUPIED)
    tails, heads = positions[edges[:, 0]], positions[edges[:, 1]]
    reach = FARTHEST_M / grid.resolution_m
    sides = least_widths(occupied, tails, heads, reach) * grid.resolution_m
    cells = nodes.space.cells_at(positions)
    passes = DoorsPassed(rooms) if rooms is not None else None
    graph = RouteGraph(
        grid=grid,
        positions=positions,
        kinds=tuple(nodes.kinds),
        rooms=tuple(_room_of(rooms, cells)),
        doors=np.array(nodes.doors, dtype=np.int64),
        names=(None,) * len(positions),
        edges=edges,
        edge_rooms=tuple(_room_of(rooms, middles)),
        edge_doors=tuple(
            passes.passed(cells_of_line(free, positions[edge])) if passes else () for edge in edges
        ),
        widths_m=sides[:, 2],
        clearances_m=clearances,
        left_m=sides[:, 0],
        right_m=sides[:, 1],
        ids=(np.arange(len(positions)), len(positions) + np.arange(len(edges))),
    )
    for array in (*vars(graph).values(), *graph.ids):
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return graph


def _room_of(rooms: Rooms | None, cells: LongArray) -> list[str | None]:
    if rooms is None or not len(cells):
        return [None] * len(cells)
    return [rooms.name_of(label) for label in rooms.labels.label_of[tuple(cells.T)].tolist()]


class DoorsPassed:
    """The doors beside each cell."""

    def __init__(self, rooms: Rooms) -> None:
        self._cols = rooms.grid.shape[1]
        self._labels = rooms.labels.label_of
        self._pair_of = {
            door.number: frozenset(-1 if n is None else rooms.labels.index(n) for n in door.rooms)
            for door in rooms.doors
        }
        self._beside: dict[int, list[int]] = {}
        for door in rooms.doors:
            if door.passable:
                for cell in rooms.cells_beside(door.number).tolist():
                    self._beside.setdefault(cell, []).append(door.number)

    def passed(self, cells: LongArray) -> tuple[int, ...]:
        """Return the numbers of the doors between the cells of a line, in order, each once."""
        labels = self._labels[tuple(cells.T)]
        flat = cells @ np.array([self._cols, 1])
        found: dict[int, None] = {}
        for k in np.flatnonzero(labels[1:] != labels[:-1]).tolist():
            pair = frozenset(labels[k : k + 2].tolist())
            one, other = (self._beside.get(int(flat[at]), []) for at in (k, k + 1))
            of_pair = [n for n in (*one, *other) if self._pair_of[n] == pair]
            found |= dict.fromkeys(sorted(set(of_pair), key=lambda n: (-of_pair.count(n), n))[:1])
        return tuple(found)


# Lanes: where two robots pass each other, each direction of an edge keeps to the right.

_SHORTEST = 4.0
"""Least length of an edge with lanes, in distances of a lane from the edge: one to enter, one to
leave, and two side by side."""
_LEAST_CELLS = 2.0**-10
"""Least distance of nodes of lanes from the sides of their cell."""


def keep_right(topology: TopologicalMap, graph: RouteGraph, *, apart_m: float) -> RouteGraph:
    """Give each direction of an edge a lane of its own, where two robots fit side by side.

    A lane runs parallel to the edge, on its right by half of `apart_m` and a 64th of a cell, so
    that its nodes lie inside cells. It leaves the first node
    and joins the second one at 45 degrees, by two nodes of its own, and is free for the robot by
    exact tests. Edges between walls that are too near, and edges shorter than twice `apart_m`, stay
    as they are: a graph with few nodes, or with a large `spacing_m`, gets more lanes. Where nodes
    are connected, they stay connected in both directions. At the nodes lanes meet: who goes first
    there is for a fleet manager.

    Parameters
    ----------
    topology
        The map that the graph was built from.
    graph
        The graph.
    apart_m
        Distance in metres between the centres of two robots that pass each other, at least twice
        the robot's radius.

    Returns
    -------
    RouteGraph
        The graph with nodes of the kind "lane".

    Raises
    ------
    InvalidValueError
        When `apart_m` is out of range, or the graph was built from another map.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph, keep_right
    >>> grid = hn.OccupancyGrid(np.zeros((20, 80)), hn.Frame(0.1), robot_radius_m=0.2)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))
    >>> graph = keep_right(topology, build_lane_graph(topology), apart_m=0.6)
    >>> "lane" in graph.kinds
    True
    """
    grid = checked_type("topology", topology, TopologicalMap).grid
    checked_type("graph", graph, RouteGraph)
    checked_between("apart_m", apart_m, max(2 * grid.robot_radius_m, 1e-3), 100)
    if graph.grid is not grid:
        raise InvalidValueError(
            f"the graph is one of map {brief(graph.grid.name)}, expected one that was built from "
            f"this topology of {brief(grid.name)}: build it again"
        )
    space = FreeSpace.of(grid)
    # Nodes of lanes along rows and columns would often lie on sides of cells.
    off = apart_m / 2 / grid.resolution_m + RIM_CELLS
    edges, positions = graph.edges, graph.positions
    first, second = _lane(positions, edges, off)
    fits = _fits(space, positions, edges, (first, second), off)
    there = _opposite(edges, graph.n_nodes)
    fits &= (there >= 0) & fits[there]
    lanes = np.flatnonzero(fits)
    # Two lanes may have a node in common.
    new, _, place, _ = unique_rows(np.concatenate([first[lanes], second[lanes]]))
    entries, exits = (graph.n_nodes + place).reshape(2, -1)
    parts = [
        edges[~fits],
        np.stack([edges[lanes, 0], entries], axis=1),
        np.stack([entries, exits], axis=1),
        np.stack([exits, edges[lanes, 1]], axis=1),
    ]
    chosen = unique_rows(np.concatenate(parts)).rows.astype(np.int64)
    nodes = Nodes(
        space,
        np.concatenate([positions, new]),
        [*graph.kinds, *[LANE] * len(new)],
        [*graph.doors.tolist(), *[0] * len(new)],
    )
    found = described(topology, nodes, chosen)
    return replace(found, names=(*graph.names, *[None] * len(new)))


def _lane(positions: FloatArray, edges: LongArray, off: float) -> tuple[FloatArray, FloatArray]:
    """Return the first and last positions of the lane of each edge, float64 (m, 2)."""
    tails, heads = positions[edges[:, 0]], positions[edges[:, 1]]
    steps = heads - tails
    along = steps / np.maximum(hypots(steps[:, 0], steps[:, 1]), 1e-9)[:, None]
    # Rows run upwards: the right of (down, across) is (-across, down).
    right = np.stack([-along[:, 1], along[:, 0]], axis=1)
    first, second = tails + off * (right + along), heads + off * (right - along)
    return np.round(first * GRAIN) / GRAIN, np.round(second * GRAIN) / GRAIN


def _fits(
    space: FreeSpace,
    positions: FloatArray,
    edges: LongArray,
    lane: tuple[FloatArray, FloatArray],
    off: float,
) -> BoolArray:
    """Return the edges whose lane is free, bool (m,)."""
    tails, heads = positions[edges[:, 0]], positions[edges[:, 1]]
    steps = heads - tails
    fits = np.asarray(hypots(steps[:, 0], steps[:, 1]) >= _SHORTEST * off, dtype=np.bool_)
    for end in lane:
        inside = (end > 0) & (end < space.free.shape) & (abs(end % 1 - 0.5) < 0.5 - _LEAST_CELLS)
        fits &= inside.all(axis=1)
        fits[fits] = space.free[tuple(space.cells_at(end[fits]).T)]
    for one, other in ((tails, lane[0]), lane, (lane[1], heads)):
        fits[fits] = space.joins(one[fits], other[fits])
    return fits


def _opposite(edges: LongArray, n_nodes: int) -> LongArray:
    """Return the index of each edge's opposite, -1 for none: for edges that lead one way."""
    keys, wanted = edges @ np.array([n_nodes, 1]), edges[:, ::-1] @ np.array([n_nodes, 1])
    order = np.argsort(keys, kind="stable")
    found = order[np.searchsorted(keys[order], wanted).clip(max=max(len(order) - 1, 0))]
    return np.where(keys[found] == wanted, found, -1)
