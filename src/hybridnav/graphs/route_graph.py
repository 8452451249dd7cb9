"""The route graph of a map: nodes, straight edges, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike, frozen

if TYPE_CHECKING:
    import networkx as nx

    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.grid import OccupancyGrid

LANE = "lane"
"""Kind of the nodes of lanes."""


@copies_alike
@dataclass(frozen=True, eq=False)
class RouteGraph:
    """Nodes in free space, and straight edges between them that are free for the robot.

    Edges have a direction: a passage in both directions is two edges. Made by `build_route_graph`.

    Examples
    --------
    >>> from hybridnav.graphs import build_route_graph
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=12.0)
    >>> graph = build_route_graph(hn.TopologicalMap(pyramid))
    >>> graph.n_nodes > 2, graph.kinds[0]
    (True, 'place')
    """

    grid: OccupancyGrid
    """The map."""
    positions: FloatArray
    """float64 (n, 2), (row, col) of each node in grid units."""
    kinds: tuple[str, ...]
    """The kind of each node: room, door, place, bend (near a bend of shortest paths), cover (for
    points that would see no node nearby), lane (of a lane that `keep_right` makes)."""
    rooms: tuple[str | None, ...]
    """The room of each node, None for no room."""
    doors: LongArray
    """int64 (n,), the number of the door that a node lies in, 0 for none."""
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
        return frozen(np.hypot(steps[:, 0], steps[:, 1]) * self.grid.resolution_m)

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
