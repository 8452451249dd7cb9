"""Routes between points that are no nodes: how their ends join the graph."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.trig import hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.graphs.kernels import routes
from hybridnav.maps import OccupancyGrid
from hybridnav.refine import Sight

if TYPE_CHECKING:
    from scipy.spatial import KDTree

    from hybridnav.graphs.waypoint_graph import WaypointGraph

_CANDIDATES = 100
"""Nearest nodes of a point that are tested for sight."""
MANY_CANDIDATES = 1500
"""The same for the best node, which may be far where many nodes lie close together at corners: on
the map 9_16_15, routes are 1.2 % too long in the mean and 14.5 % at most with 300, 0.8 % and 7.7 %
with these."""

Offsets = tuple["LongArray", "LongArray", "FloatArray"]


@dataclass(frozen=True, eq=False)
class Network:
    """A graph ready for routes between any positions."""

    sight: Sight
    positions: FloatArray
    """float64 (n, 2), the nodes."""
    graph: tuple[LongArray, LongArray, FloatArray]
    """First edge of each node, head and length of each edge."""
    usable: LongArray
    """int64 (k,), the nodes that ends may join: those in free space."""
    candidates: int = _CANDIDATES
    """How many of the nearest nodes of a point are tested for sight."""

    @classmethod
    def of(
        cls, sight: Sight, positions: FloatArray, edges: LongArray, usable: LongArray | None = None
    ) -> Network:
        """Prepare a graph.

        `sight`: tests of segments; `positions`: float64 (n, 2), the nodes, (row, col) in grid
        units; `edges`: int64 (m, 2), tail and head of each edge; `usable`: int64 (k,), the nodes in
        free space; None for all.
        """
        usable = np.arange(len(positions)) if usable is None else usable
        steps = positions[edges[:, 1]] - positions[edges[:, 0]]
        lengths = hypots(steps[:, 0], steps[:, 1])
        return cls(sight, positions, adjacency(len(positions), edges, lengths), usable)

    @cached_property
    def _tree(self) -> KDTree:
        from scipy.spatial import KDTree  # noqa: PLC0415 - on demand

        return KDTree(self.positions[self.usable])

    def in_sight(self, points: FloatArray) -> Offsets:
        """Return the usable nodes in sight of points, among the nearest of each.

        `points`: float64 (p, 2), free positions. Returns int64 (p + 1,) offsets, int64 (k,) nodes,
        the nearest of each point first, and float64 (k,) distances to them.
        """
        near = min(self.candidates, len(self.usable))
        if not near:
            nothing = np.zeros(len(points) + 1, dtype=np.int64)
            return nothing, np.empty(0, dtype=np.int64), np.empty(0)
        away, found = self._tree.query(points, k=list(range(1, near + 1)))
        away, nodes = np.asarray(away), self.usable[np.asarray(found)]
        tails = np.repeat(points, near, axis=0)
        seen = self.sight.clear(tails, self.positions[nodes.ravel()]).reshape(nodes.shape)
        offsets = np.concatenate([[0], np.cumsum(seen.sum(axis=1))]).astype(np.int64)
        return offsets, nodes[seen].astype(np.int64), away[seen]

    def join(self, starts: FloatArray, goals: FloatArray) -> Attached:
        """Find the nodes in sight of pairs.

        `starts`, `goals`: float64 (p, 2), free positions.
        """
        return Attached(self, starts, goals, self.in_sight(starts), self.in_sight(goals))

    @cached_property
    def _is_usable(self) -> BoolArray:
        found = np.zeros(len(self.positions), dtype=np.bool_)
        found[self.usable] = True
        return found

    def without_passed(self, point: FloatArray, nodes: LongArray) -> LongArray:
        """Return the nodes of a route without the first, if a robot at a point has passed it, and
        sees the next one.

        `point`: float64 (2,), where the robot is; `nodes`: int64 (k,), the nodes; those in walls or
        outside the map are never seen.
        """
        if len(nodes) < 2 or not self._is_usable[nodes[1]]:  # noqa: PLR2004
            return nodes
        first, second = self.positions[nodes[:2]]
        if ((second - first) * (point - first)).sum() <= 0:
            return nodes
        is_seen = self.sight.clear(point[None], second[None])[0]
        return nodes[1:] if is_seen else nodes


@dataclass(frozen=True, eq=False)
class Attached:
    """Pairs of positions, with the nodes in sight of each end."""

    network: Network
    starts: FloatArray
    goals: FloatArray
    from_start: Offsets
    """Offsets, nodes in sight, and distances to them, the nearest first."""
    from_goal: Offsets

    @cached_property
    def direct(self) -> BoolArray:
        """The pairs whose ends see each other, bool (p,)."""
        return self.network.sight.clear(self.starts, self.goals)

    def best(self) -> FloatArray:
        """Return the length of the best route over any nodes in sight of the ends.

        Ends that see each other have the segment between them. Float64 (p,) in cells, infinite for
        none.
        """
        lengths, _, _ = shortest_routes(self.network.graph, self.from_start, self.from_goal)
        steps = self.goals - self.starts
        straight = np.where(self.direct, hypots(steps[:, 0], steps[:, 1]), np.inf)
        return np.minimum(lengths, straight)

    def nearest(self) -> FloatArray:
        """Return the lengths of the routes of `nearest_lines`, float64 (p,) in cells, infinite for
        none."""
        lines, _ = self.nearest_lines()
        return np.array(
            [np.inf if line is None else hypots(*np.diff(line, axis=0).T).sum() for line in lines]
        )

    def nearest_lines(self) -> tuple[list[FloatArray | None], LongArray]:
        """Return the routes from the nearest node in sight of the start to the nearest one in sight
        of the goal.

        As in Nav2, the robot leaves out the first edge if it has passed its first node, and the
        last one likewise; here only if the next node is in sight. Ends that see each other need no
        graph.

        Returns for each pair float64 (k, 2), the positions from start to goal, or None; and int64
        (p,), the number of nodes that the search has expanded.
        """
        starts, goals = nearest_only(self.from_start), nearest_only(self.from_goal)
        lengths, passed, expanded = shortest_routes(self.network.graph, starts, goals)
        lines: list[FloatArray | None] = []
        for pair, is_direct in enumerate(self.direct.tolist()):
            inner = np.empty((0, 2)) if is_direct else None
            if not is_direct and np.isfinite(lengths[pair]):
                nodes = self.network.without_passed(self.starts[pair], passed[pair])
                nodes = self.network.without_passed(self.goals[pair], nodes[::-1])[::-1]
                inner = self.network.positions[nodes]
            ends = self.starts[pair, None], self.goals[pair, None]
            line = None if inner is None else np.concatenate([ends[0], inner, ends[1]])
            lines.append(line)
        return lines, expanded


def adjacency(
    n_nodes: int, edges: LongArray, lengths: FloatArray
) -> tuple[LongArray, LongArray, FloatArray]:
    """Return the first edge of each node, and head and length of each edge, by their tails.

    `n_nodes`: number of nodes; `edges`: int64 (m, 2), tail and head of each edge; `lengths`:
    float64 (m,), length of each edge.
    """
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges = edges[order]
    first = np.searchsorted(edges[:, 0], np.arange(n_nodes + 1)).astype(np.int64)
    return first, np.ascontiguousarray(edges[:, 1]), lengths[order]


def nearest_only(seen: Offsets) -> Offsets:
    """Return only the nearest node in sight of each point."""
    offsets, nodes, away = seen
    has = offsets[1:] > offsets[:-1]
    kept = offsets[:-1][has]
    return np.concatenate([[0], np.cumsum(has)]).astype(np.int64), nodes[kept], away[kept]


def shortest_routes(
    graph: tuple[LongArray, LongArray, FloatArray], starts: Offsets, goals: Offsets
) -> tuple[FloatArray, list[LongArray], LongArray]:
    """Return the shortest routes between ends and the nodes that they join.

    `graph`: first edge of each node, head and length of each edge, as `adjacency` returns them;
    `starts`, `goals`: the nodes that each end joins, as `Network.in_sight` returns them. Returns
    float64 (p,) lengths, infinite for none; the nodes of each route from first to last; int64 (p,)
    number of expanded nodes.
    """
    room = 64 * len(starts[0])
    while True:
        passed = np.empty(room, dtype=np.int64)
        costs, offsets, expanded = routes(graph, starts, goals, passed)
        if offsets[-1] >= 0:
            parts = np.split(passed[: offsets[-1]], offsets[1:-1])
            return costs, [part[::-1] for part in parts], expanded
        room *= 2


# A waypoint graph on a map: where its nodes lie, and which edges a robot can follow.


@dataclass(frozen=True, eq=False)
class PlacedGraph:
    """The nodes of a graph in grid units, and the cells that they lie in."""

    edges: LongArray
    """int64 (m, 2), tail and head of each edge."""
    positions: FloatArray
    """float64 (n, 2), (row, col), rounded."""
    cells: LongArray
    """int64 (n, 2), the cell that the node lies in, -1 for nodes outside the map."""
    is_inside: BoolArray
    """bool (n,), nodes on the map."""
    is_free: BoolArray
    """bool (n,), nodes in cells that may be entered."""
    lines: dict[int, FloatArray]
    """float64 (k, 2), positions of the edges that are not straight."""
    free: BoolArray
    """bool (rows, cols), the cells that may be entered."""

    @classmethod
    def of(
        cls,
        graph: WaypointGraph,
        grid: OccupancyGrid,
        free: BoolArray,
        *,
        along_lines: bool = False,
    ) -> PlacedGraph:
        """Place a graph on a map.

        `free`: bool (rows, cols), the cells that may be entered; `along_lines`: whether edges run
        along their lines, instead of straight.
        """
        positions, cells, is_free = placed_points(graph.points, grid, free)
        lines = graph.lines if along_lines else {}
        along = {edge: _rounded(grid, line) for edge, line in lines.items()}
        return cls(graph.edges, positions, cells, cells[:, 0] >= 0, is_free, along, free)

    def clear_edges(self, sight: Sight) -> BoolArray:
        """Return which edges stay in free space, bool (m,), by exact tests.

        `sight`: tests of segments of the same free cells.
        """
        clear = np.asarray(self.is_free[self.edges].all(axis=1), dtype=np.bool_)
        tails, heads = (self.positions[self.edges[clear, end]] for end in (0, 1))
        clear[clear] = sight.clear(tails, heads)
        for edge, line in self.lines.items():
            clear[edge] = self.is_free[self.edges[edge]].all() and self._is_clear(line, sight)
        return clear

    def line_of(self, edge: int) -> FloatArray:
        """Return the positions that an edge passes, float64 (k, 2)."""
        if edge in self.lines:
            return self.lines[edge]
        return self.positions[self.edges[edge]]

    def _is_clear(self, line: FloatArray, sight: Sight) -> bool:
        """Return whether a polyline stays in free space."""
        if not ((line >= 0) & (line < self.free.shape)).all():
            return False
        is_free = self.free[tuple(line.astype(np.int64).T)].all()
        return bool(is_free and sight.clear(line[:-1], line[1:]).all())

    def network(self, sight: Sight, edges: LongArray) -> Network:
        """Return the graph with some of its edges, ready for routes.

        `sight`: tests of segments of the same free cells; `edges`: int64 (k, 2), the edges to use.
        """
        return Network.of(sight, self.positions, edges, np.flatnonzero(self.is_free))


def placed_points(
    points: FloatArray, grid: OccupancyGrid, free: BoolArray
) -> tuple[FloatArray, LongArray, BoolArray]:
    """Place points on a map.

    `points`: float64 (n, 2), `(x, y)` in metres; `free`: bool (rows, cols), the cells that may be
    entered. Returns float64 (n, 2) positions, rounded; int64 (n, 2) the cell that each lies in, by
    the rule of `Frame.cells_of`, -1 outside the map; bool (n,), whether it is free.
    """
    cells = grid.frame.cells_of(points)
    is_inside = ((cells >= 0) & (cells < free.shape)).all(axis=1)
    cells[~is_inside] = -1
    is_free = np.asarray(is_inside, dtype=np.bool_)
    is_free[is_inside] = free[tuple(cells[is_inside].T)]
    return _rounded(grid, points), cells, is_free


def _rounded(grid: OccupancyGrid, points: FloatArray) -> FloatArray:
    """Return points as positions in grid units that exact tests of segments can use."""
    return np.round(grid.frame.positions_of(points) * GRAIN) / GRAIN
