"""What is known of the nodes and edges of a route graph: rooms, doors, widths."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.graphs._width_kernels import least_along, least_widths
from hybridnav.graphs.route_graph import RouteGraph
from hybridnav.grid import CellClass
from hybridnav.grid.lines import cells_of_line
from hybridnav.topology.doors import measured_clearance_m

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.graphs.nodes import Nodes
    from hybridnav.topology import Rooms, TopologicalMap

FARTHEST_M = 10.0
"""Distance in metres up to which free space beside an edge is measured."""


def described(topology: TopologicalMap, nodes: Nodes, edges: LongArray) -> RouteGraph:
    """Make a route graph, with all that is known of its nodes and edges.

    Parameters
    ----------
    topology
        The map.
    nodes
        The nodes.
    edges
        int64 (m, 2), tail and head of each edge.
    """
    grid = topology.grid
    edges = edges[np.lexsort((edges[:, 1], edges[:, 0]))]
    positions = nodes.positions
    rooms = topology.rooms if topology.pyramid.rooms is not None else None
    clearance = rooms.clearance_m if rooms is not None else measured_clearance_m(grid)
    free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
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
        edges=edges,
        edge_rooms=tuple(_room_of(rooms, middles)),
        edge_doors=tuple(
            passes.passed(cells_of_line(free, positions[edge])) if passes else () for edge in edges
        ),
        widths_m=sides[:, 2],
        clearances_m=clearances,
        left_m=sides[:, 0],
        right_m=sides[:, 1],
    )
    for array in vars(graph).values():
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
