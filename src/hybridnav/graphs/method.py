"""Graphs of others as methods of the harness."""

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.extension import extension
from hybridnav._base.rows import unique_rows
from hybridnav._base.trig import hypots
from hybridnav.errors import InvalidValueError
from hybridnav.graphs.attach import PlacedGraph
from hybridnav.graphs.waypoint_graph import WaypointGraph
from hybridnav.harness.baselines import AnyAngleResult, MethodResult
from hybridnav.harness.baselines.regions import array_bytes
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.refine import Sight

Cell = tuple[int, int]


def checked_graph(given: str | WaypointGraph) -> WaypointGraph:
    """Return a graph, read from its file if that is given."""
    read = extension("formats", "graph").load_graph(given) if isinstance(given, str) else given
    return checked_type("graph", read, WaypointGraph)


class GraphMethod:
    """Routes on a graph of nodes and straight edges; see `baselines.Solver`.

    The policy: a route runs straight from the start to the nearest node in sight of it, over the
    edges that are shortest in metres to the nearest node in sight of the goal, and straight to the
    goal. Among the 100 nearest nodes one is in sight if the robot can drive there straight. As in
    Nav2 the robot leaves out the first edge if it has passed its first node, and the last one
    likewise, if the next node is in sight. Ends that see each other need no graph. Stated costs are
    not used: they may be in any unit. Without a node in sight of an end the method gives up; where
    edges do not lead from one node to the other it answers that there is no path.

    `graph`: the graph, taken as it is: an edge through a wall becomes part of paths, which the
    harness reports; `clear_edges_only`: whether edges that the robot cannot follow are left out
    instead. Raises `InvalidValueError` when the map allows corner cutting.
    """

    region_of = None

    def __init__(
        self, grid: OccupancyGrid, graph: WaypointGraph, *, clear_edges_only: bool = False
    ) -> None:
        if grid.corner_cutting:
            raise InvalidValueError(
                f"graph {graph.name}: its edges do not pass between two blocked cells that meet at "
                "a corner: leave corner cutting out"
            )
        free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
        sight = Sight(free)
        placed = PlacedGraph.of(graph, grid, free)
        edges = placed.edges
        if clear_edges_only:
            edges = edges[placed.clear_edges(sight)]
        self.name = graph.name
        self.n_nodes = graph.n_nodes
        self.n_edges = len(unique_rows(np.sort(edges, axis=1)).rows)
        self._frame, self._resolution_m = grid.frame, grid.resolution_m
        self._network = placed.network(sight, edges)
        self._free = free
        arrays = sum(array.nbytes for array in self._network.graph)
        self.memory_bytes = array_bytes(self._network) + arrays + free.nbytes

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        began = clock()
        ends = np.array([start, goal], dtype=np.float64) + 0.5
        pair = self._network.join(ends[:1], ends[1:])
        (line,), expanded = pair.nearest_lines()
        seconds = {"coarse": clock() - began}
        counted = int(expanded[0])
        if line is not None:
            points = self._frame.points_of_grid(line)
            length_m = float(hypots(*np.diff(line, axis=0).T).sum()) * self._resolution_m
            found = AnyAngleResult(points, length_m)
            return MethodResult(
                None,
                any_angle=found,
                plan_steps=len(line) - 1,
                expanded_nodes=counted,
                seconds=seconds,
            )
        unseen = [
            name
            for name, (offsets, _, _) in (("start", pair.from_start), ("goal", pair.from_goal))
            if not offsets[-1]
        ]
        reason = f"no node in sight of the {unseen[0]}" if unseen else ""
        return MethodResult(None, gave_up=reason, expanded_nodes=counted, seconds=seconds)
