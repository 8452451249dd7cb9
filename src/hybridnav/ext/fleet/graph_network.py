"""Routes over the floors of a graph that others have made, with the rides between them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hybridnav._base.trig import dist, hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.ext.fleet.building import Building
from hybridnav.ext.fleet.graph_match import AT_LINK_M, MatchedGraph, MatchedLink, rides_of
from hybridnav.ext.fleet.link_nodes import FloorGraph, Point, node_at
from hybridnav.graphs import attach
from hybridnav.maps import OccupancyGrid
from hybridnav.refine import Sight

Position = tuple[int, "FloatArray"]
"""Index of a floor in the building, and float64 (2,), (row, col) in grid units of its map."""


class Lane(NamedTuple):
    """A ride of a graph, from one of its nodes to one of another floor."""

    link: str
    """Name of the link in the graph."""
    cost: float
    """What the building charges, and the way from the nodes to the building's ends, in metres."""
    is_sound: bool
    """Whether the building has the ride."""


@dataclass(frozen=True, eq=False)
class GraphRoute:
    """A route over a graph."""

    floors: tuple[str, ...]
    """Name of each floor that it visits, in order."""
    lines: tuple[FloatArray, ...]
    """float64 (k, 2), the points `(x, y)` in metres that it passes on each."""
    rides: tuple[str, ...]
    """Name in the graph of the link of each ride."""
    cost: float
    """Metres driven, with the charges of rides."""
    fault: str
    """Why no robot can follow it; empty if one can."""
    expanded: int = 0
    """Number of nodes that the search has expanded."""


@dataclass(frozen=True, eq=False)
class PlacedFloor:
    """The graph of a floor on its map."""

    name: str
    graph: FloorGraph
    grid: OccupancyGrid
    free: BoolArray
    """bool (rows, cols), the cells that may be entered."""
    sight: Sight
    placed: attach.PlacedGraph
    is_clear: BoolArray
    """bool (m,), the edges that the robot can follow."""
    network: attach.Network
    """All edges that routes may use."""
    base: int
    """Number of its first node among those of all floors."""

    @classmethod
    def of(
        cls, building: Building, graph: FloorGraph, base: int, *, clear_edges_only: bool
    ) -> PlacedFloor:
        """Place a graph on the map of its floor."""
        grid = building.floor(graph.name).planner.grid
        free = np.ascontiguousarray(grid.enterable(allow_unexplored=False))
        sight = Sight(free)
        placed = attach.PlacedGraph.of(graph.graph, grid, free)
        is_clear = placed.clear_edges(sight)
        edges = placed.edges[is_clear] if clear_edges_only else placed.edges
        network = placed.network(sight, edges)
        return cls(graph.name, graph, grid, free, sight, placed, is_clear, network, base)

    def sees(self, node: int, point: Point) -> bool:
        """Return whether a robot can drive straight from a node to a point."""
        at, _, is_free = attach.placed_points(np.array([point]), self.grid, self.free)
        if not (self.placed.is_free[node] and is_free[0]):
            return False
        return bool(self.sight.clear(self.placed.positions[node, None], at)[0])


class BuildingNetwork:
    """The graph of a building, ready for routes between any positions of its floors.

    A route begins straight to the nearest node in sight of the start, takes the edges and rides
    that cost least to the nearest node in sight of the goal, and ends straight: the policy of
    `graphs.GraphMethod`, floor by floor. A ride costs what the building's link charges, and the
    straight way from the nodes of the graph to the ends of that link.

    `matched`: the graph, matched to its building; `stairs`: whether the robot takes stairs;
    `clear_edges_only`: whether edges and rides that the robot cannot follow are left out.
    """

    def __init__(
        self, matched: MatchedGraph, *, stairs: bool = True, clear_edges_only: bool = False
    ) -> None:
        self.building = matched.building
        self._speed_m_s = matched.building.speed_m_s
        self.floors: dict[int, PlacedFloor] = {}
        base = 0
        for index, floor in enumerate(matched.building.floors):
            graph = matched.floors.get(floor.name)
            if graph is not None:
                self.floors[index] = PlacedFloor.of(
                    matched.building, graph, base, clear_edges_only=clear_edges_only
                )
                base += graph.graph.n_nodes
        self.n_nodes = base
        self._of_name = {floor.name: floor for floor in self.floors.values()}
        self.lanes: dict[tuple[int, int], Lane] = {}
        """The cheapest ride from one node to another, by their numbers among all nodes."""
        for link in matched.links:
            chosen = link.drawn if link.own is None else link.own
            if chosen.admits(matched.building.robot_radius_m, stairs=stairs):
                self._add_lanes(link, clear_edges_only=clear_edges_only)
        self._graph = self._joined()
        self._blocked = {
            pair
            for floor in self.floors.values()
            for pair in map(tuple, (floor.placed.edges[~floor.is_clear] + floor.base).tolist())
        }

    def stop_fault(self, link: MatchedLink, floor: str) -> str:
        """Return why the end of a link on a floor is not that of the building; empty if it is."""
        end = None if link.own is None else link.own.end_on(floor)
        if end is None:
            return "the building's does not stop there"
        here = self._of_name[floor]
        away_m = dist(link.ends[floor], end.position_m)
        if away_m > AT_LINK_M:
            return f"{away_m:.2f} m from that of the building"
        if not here.sees(self._node(link, floor), end.position_m):
            return "a wall is between it and that of the building"
        return ""

    def edges(self) -> LongArray:
        """Return tail and head of all edges and rides, int64 (m, 2)."""
        edges = [floor.placed.edges + floor.base for floor in self.floors.values()]
        rides = np.array(list(self.lanes), dtype=np.int64).reshape(-1, 2)
        return np.concatenate([*edges, rides])

    def route(self, start: Position, goal: Position) -> GraphRoute | str:
        """Return the route between two free positions, or why there is none."""
        first, last = self.floors.get(start[0]), self.floors.get(goal[0])
        direct = np.stack([start[1], goal[1]])
        if first is not None and first is last and first.sight.clear(direct[:1], direct[1:])[0]:
            return self._found([(first, direct)], [], 0)
        ends = []
        for what, floor, (_, at) in (("start", first, start), ("goal", last, goal)):
            seen = None if floor is None else attach.nearest_only(floor.network.in_sight(at[None]))
            if floor is None or seen is None or not seen[0][-1]:
                return f"no node in sight of the {what}"
            offsets, near, away = seen  # with numbers among all nodes, and in metres
            ends.append((offsets, near + floor.base, away * floor.grid.resolution_m))
        costs, (nodes,), expanded = attach.shortest_routes(self._graph, ends[0], ends[1])
        if not math.isfinite(costs[0]):
            return ""
        legs, rides = self._legs(nodes.tolist())
        floor, leg = legs[0]
        legs[0] = floor, leg[_n_passed(floor, leg, start[1]) :]
        floor, leg = legs[-1]
        legs[-1] = floor, leg[: len(leg) - _n_passed(floor, leg[::-1], goal[1])]
        lines = [floor.placed.positions[np.array(leg) - floor.base] for floor, leg in legs]
        lines[0] = np.concatenate([start[1][None], lines[0]])
        lines[-1] = np.concatenate([lines[-1], goal[1][None]])
        driven = [(floor, line) for (floor, _), line in zip(legs, lines, strict=True)]
        return self._found(driven, rides, int(expanded[0]), self._fault(legs, rides))

    def _legs(self, nodes: list[int]) -> tuple[list[tuple[PlacedFloor, list[int]]], list[Lane]]:
        legs = [(self._floor_of(nodes[0]), [nodes[0]])]
        rides = []
        for one, other in itertools.pairwise(nodes):
            floor = self._floor_of(other)
            if floor is legs[-1][0]:
                legs[-1][1].append(other)
            else:
                rides.append(self.lanes[one, other])
                legs.append((floor, [other]))
        return legs, rides

    def _fault(self, legs: list[tuple[PlacedFloor, list[int]]], rides: list[Lane]) -> str:
        """Return why no robot can follow a route; empty if one can."""
        for ride in rides:
            if not ride.is_sound:
                return f"its ride by {ride.link} is none of the building"
        for floor, nodes in legs:
            for pair in itertools.pairwise(nodes):
                if pair in self._blocked:
                    tail, head = (floor.graph.graph.names[node - floor.base] for node in pair)
                    return f"its edge from {tail} to {head} on floor {floor.name} is blocked"
        return ""

    def _found(
        self,
        lines: list[tuple[PlacedFloor, FloatArray]],
        rides: list[Lane],
        expanded: int,
        fault: str = "",
    ) -> GraphRoute:
        driven_m = sum(
            float(hypots(*np.diff(line, axis=0).T).sum()) * floor.grid.resolution_m
            for floor, line in lines
        )
        return GraphRoute(
            tuple(floor.name for floor, _ in lines),
            tuple(floor.grid.frame.points_of_grid(line) for floor, line in lines),
            tuple(ride.link for ride in rides),
            driven_m + sum(ride.cost for ride in rides),
            fault,
            expanded,
        )

    def node(self, number: int) -> tuple[PlacedFloor, int]:
        """Return the floor of a node, and the number that it has there."""
        floor = self._floor_of(number)
        return floor, number - floor.base

    def _floor_of(self, node: int) -> PlacedFloor:
        return next(f for f in reversed(self.floors.values()) if f.base <= node)

    def _node(self, link: MatchedLink, floor: str) -> int:
        node = node_at(self._of_name[floor].graph.graph, link.ends[floor])
        assert node is not None  # noqa: S101 - links are joined
        return node

    def _add_lanes(self, link: MatchedLink, *, clear_edges_only: bool) -> None:
        """Add the rides of a link, between any two of its ends."""
        faults = {floor: self.stop_fault(link, floor) for floor in link.ends}
        node = {floor: self._of_name[floor].base + self._node(link, floor) for floor in link.ends}
        for one, other, may in rides_of(link):
            is_sound = may and not (faults[one] or faults[other])
            if clear_edges_only and not is_sound:
                continue
            cost = self._charge(link, one, other)
            lane = self.lanes.get((node[one], node[other]))
            if lane is None or cost < lane.cost:
                self.lanes[node[one], node[other]] = Lane(link.drawn.name, cost, is_sound)

    def _charge(self, link: MatchedLink, one: str, other: str) -> float:
        """Return what a ride costs; by the graph where the building does not have it."""
        own, speed = link.own, self._speed_m_s
        ends = () if own is None else (own.end_on(one), own.end_on(other))
        if own is None or None in ends:
            return link.drawn.charge_m(link.floors[one], link.floors[other], speed_m_s=speed)
        away_m = sum(dist(link.ends[end.floor], end.position_m) for end in ends if end is not None)
        return own.charge_m(one, other, speed_m_s=speed) + away_m

    def _joined(self) -> tuple[LongArray, LongArray, FloatArray]:
        """Return the edges of all floors with the rides, ready for searches, in metres."""
        edges, lengths = [], []
        for floor in self.floors.values():
            _, head, length = floor.network.graph
            tails = np.repeat(
                np.arange(len(floor.placed.positions)), np.diff(floor.network.graph[0])
            )
            edges.append(np.stack([tails, head], axis=1) + floor.base)
            lengths.append(length * floor.grid.resolution_m)
        edges.append(np.array(list(self.lanes), dtype=np.int64).reshape(-1, 2))
        lengths.append(np.array([lane.cost for lane in self.lanes.values()], dtype=np.float64))
        return attach.adjacency(self.n_nodes, np.concatenate(edges), np.concatenate(lengths))


def _n_passed(floor: PlacedFloor, nodes: list[int], point: FloatArray) -> int:
    """Return how many nodes of a leg are left out at its start: one that was passed, or none."""
    here = np.array(nodes, dtype=np.int64) - floor.base
    return len(nodes) - len(floor.network.without_passed(point, here))
