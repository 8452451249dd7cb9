"""Alternatives by sequences of doors: each is planned by the preset, with other doors closed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeGuard

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from hybridnav._base.rows import connected_parts
from hybridnav._base.typing import BoolArray, LongArray
from hybridnav.guide.tour import Tour, tour_of
from hybridnav.guide.words.bends import Leg
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.costs import CostLayer, cost_along
from hybridnav.planning import PlanResult
from hybridnav.planning.planner import HybridPlanner
from hybridnav.rooms import Door
from hybridnav.route import DoorGraph, DoorRoute, RouteFinder, door_graph
from hybridnav.search.found import ClosedCells


def _least_bound(whole: PlanResult, cost_m: float) -> float:
    """Return the bound of a plan for a dearer path between the same endpoints."""
    return min(whole.lower_bound, cost_m)


# How much of a path another one shares.

LegKey = tuple[int | None, str | None, int | None]
"""Number of the door before a leg, name of its room, number of the door behind; None for none."""

_ROUNDING_M = 1e-9


def keys_of_legs(legs: tuple[Leg, ...]) -> list[LegKey]:
    """Return the room of each leg with the doors at both ends, as a person knows it."""
    doors = [None if leg.door is None else leg.door.number for leg in legs]
    return list(zip([None, *doors[:-1]], [leg.room for leg in legs], doors, strict=True))


class Track:
    """The line of a tour, for comparisons with others.

    `tour`: a solved tour of one plan; `near_m`: distance up to which two paths count as one, in
    metres; `costs`: the map and the costs of its cells, by which the tour was planned: then shares
    are of its cost. None for lengths.
    """

    def __init__(
        self, tour: Tour, near_m: float, *, costs: tuple[OccupancyGrid, CostLayer] | None = None
    ) -> None:
        self._costs = costs
        path = tour.results[0].path
        assert path is not None  # noqa: S101 - the tour is solved
        points = path.points if len(path.points) > 1 else path.points.repeat(2, axis=0)
        self._line = shapely.LineString(shapely.LineString(points).simplify(_ROUNDING_M).coords)
        self._beside = self._line.buffer(near_m)
        self._keys = keys_of_legs(tour.legs)
        self._lengths_m = [leg.length_m for leg in tour.legs]
        self.cost_m = tour.length_m if costs is None else tour.cost
        """Length of the tour, or its cost, in metres."""

    def share(self, other: Track) -> float:
        """Return the share of this path that it has in common with another one, from 0 to 1: of its
        length, or of its cost.

        That is what lies near the other path, and the whole of each leg between the same two doors
        of one room.
        """
        if self.cost_m <= 0:
            return 1.0
        other_keys = set(other._keys)
        begin, common_m, apart = 0.0, 0.0, []
        for key, length_m in zip(self._keys, self._lengths_m, strict=True):
            end = begin + length_m
            if key in other_keys:
                common_m += length_m if self._costs is None else self._between(begin, end)
            else:
                apart.append(substring(self._line, begin, end))
            begin = end
        rest = apart if self._keys else [self._line]
        common_m += sum(self._measured(part.intersection(other._beside)) for part in rest)
        return float(min(common_m / self.cost_m, 1.0))

    def _between(self, begin: float, end: float) -> float:
        """Return the cost between two lengths along the path."""
        return self._measured(substring(self._line, begin, end))

    def _measured(self, line: BaseGeometry) -> float:
        if self._costs is None:
            return float(line.length)
        parts = (shapely.get_coordinates(part) for part in np.atleast_1d(shapely.get_parts(line)))
        return sum(cost_along(*self._costs, points) for points in parts if len(points))


_MOST_PLANNED = 4
"""Sequences of doors that are planned for each alternative that is asked for, at most."""


@dataclass(frozen=True)
class RouteLimits:
    """What alternatives must keep to."""

    count: int
    """Most alternatives, the first included."""
    max_overlap: float
    """Most that a path shares with a shorter one, from 0 to 1."""
    max_stretch: float
    """Greatest length, or cost, over that of the first."""


@dataclass(frozen=True, eq=False)
class Chosen:
    """A tour that keeps to the limits."""

    tour: Tour
    overlap: float = 0.0
    """Greatest share that it has in common with one before it."""


class DoorTours:
    """The search for tours by other doors than those of a first one.

    `planner`: planner of each; its map has rooms; `first`: the plain plan, solved; `waypoints`:
    start and goal, as the caller named them; `closed`: cells closed for the query; None for none.
    """

    def __init__(
        self,
        planner: HybridPlanner,
        first: Tour,
        waypoints: Sequence[ArrayLike | str],
        closed: ClosedCells | None,
    ) -> None:
        self._planner, self._first = planner, first
        self._waypoints, self._closed = waypoints, closed
        self._rooms = planner.topology.rooms
        grid = planner.grid
        graph = door_graph(
            planner.topology,
            allow_unexplored=planner.preset.planner.allow_unexplored,
            costs=planner.costs,
        )
        self._graph: DoorGraph = graph if closed is None else graph.closed(closed.flat)
        path = first.results[0].path
        assert path is not None  # noqa: S101 - the plan is solved
        cols = grid.shape[1]
        self._endpoints = [int(row) * cols + int(col) for row, col in path.cells[[0, -1]]]
        self._route_finder = RouteFinder(self._rooms)
        self.near_m = max(2 * grid.robot_radius_m, grid.resolution_m)
        """Distance up to which two paths count as one, in metres: a robot's diameter."""
        self.n_planned = 0
        """Number of sequences of doors that were planned."""
        self.is_complete = True
        """Whether `find` has found as many as asked for, or all that there are."""

    @property
    def is_in_one_room(self) -> bool:
        """Whether start and goal lie in one part of one room."""
        first, last = self._rooms.level.field_of.ravel()[self._endpoints].tolist()
        return bool(first == last)

    def find(self, limits: RouteLimits) -> list[Chosen]:
        """Find tours, the first one first, then by length, or by cost if the planner does."""
        first = self._track(self._first)
        planned = [(Chosen(self._first), first)]
        chosen = planned
        for route in self._candidates(limits):
            if len(chosen) == limits.count:
                break
            if any(self._share(route, one.tour) > limits.max_overlap for one, _ in chosen):
                continue
            if self.n_planned == _MOST_PLANNED * limits.count:
                self.is_complete = False
                break
            tour = self._planned(route)
            track = None if tour is None else self._track(tour)
            if tour is None or track is None or track.cost_m > limits.max_stretch * first.cost_m:
                continue
            planned.append((Chosen(tour), track))
            chosen = admissible(planned, limits)
        return [one for one, _ in chosen]

    def _track(self, tour: Tour) -> Track:
        layer = self._planner.costs
        costs = None if layer is None else (self._planner.grid, layer)
        return Track(tour, self.near_m, costs=costs)

    def _closed_round(self, vertices: Sequence[int], arcs: Sequence[int]) -> LongArray | None:
        """Return the cells that leave some arcs as the only ones between some rooms.

        Rooms from which no path leads back, other than through the boundary by which it came, stay
        open: no shortest path passes them.

        `vertices`, `arcs`: of the room level. Returns int64 (n,), flat cells, sorted, each once;
        None if they would close an endpoint or an arc that is to stay open.
        """
        graph = self._graph
        inside = np.zeros(self._rooms.level.n_vertices, dtype=np.bool_)
        inside[list(vertices)] = True
        n_inside = inside[graph.endpoints].sum(axis=1)
        is_used = self._used(arcs)
        kept = graph.middles_of(np.flatnonzero(is_used)).ravel()
        kept = np.union1d(kept, self._endpoints)
        shut = [np.empty(0, dtype=np.int64) if self._closed is None else self._closed.flat]
        for arc in np.flatnonzero((n_inside == 2) & ~is_used).tolist():  # noqa: PLR2004
            halves = sorted((graph.cells_beside(arc, half) for half in (0, 1)), key=self._breadth)
            spared = [cells for cells in halves if not np.isin(cells, kept).any()]
            if not spared:
                return None
            shut.append(spared[0])
        leaving = np.flatnonzero(n_inside == 1)
        halves = np.argmin(inside[graph.endpoints[leaving]], axis=1)
        beyond = self._parts(n_inside == 0)[graph.endpoints[leaving, halves]]
        leads_back = np.bincount(beyond)[beyond] > 1
        for arc, half in zip(
            leaving[leads_back].tolist(), halves[leads_back].tolist(), strict=True
        ):
            shut.append(graph.cells_beside(arc, half))
        return np.unique(np.concatenate(shut))

    def _planned(self, route: DoorRoute) -> Tour | None:
        """Plan by the doors of a route; None without a path by them.

        The bound is that of the first tour: it holds for every path between these endpoints.
        """
        shut = self._closed_round(route.vertices, route.arcs)
        if shut is None:
            return None
        whole = self._first.results[0]
        assert whole.start is not None  # noqa: S101 - the plan is solved
        assert whole.goal is not None  # noqa: S101
        self.n_planned += 1
        one_way = None if self._closed is None else self._closed.one_way
        blocked = ClosedCells(shut, one_way=one_way)
        result = self._planner.plan(whole.start, whole.goal, blocked=blocked)
        if not result.solved:
            return None
        result = replace(result, lower_bound_source=partial(_least_bound, whole, result.cost))
        return tour_of(self._planner, [result], self._waypoints)

    def _candidates(self, limits: RouteLimits) -> Iterator[DoorRoute]:
        """Return routes by sequences of doors, gaps aside, each sequence once."""
        tried = {tuple(leg.door.number for leg in self._first.legs if _is_counted(leg.door))}
        most_m = None
        for route in self._graph.routes(*self._endpoints):
            most_m = most_m or limits.max_stretch * route.length_m
            if route.length_m > most_m:
                return
            doors = [self._rooms.door_of_arc.get(arc) for arc in route.arcs]
            sequence = tuple(door.number for door in doors if _is_counted(door))
            if sequence not in tried:
                tried.add(sequence)
                yield route

    def _share(self, route: DoorRoute, tour: Tour) -> float:
        """Return the share of a route's legs that a tour has too."""
        doors = [self._rooms.door_of_arc.get(arc) for arc in route.arcs]
        numbers = [None, *(None if door is None else door.number for door in doors), None]
        labels = self._rooms.label_of_vertex[list(route.vertices)].tolist()
        names = map(self._rooms.name_of, labels)
        tour_keys = set(keys_of_legs(tour.legs))
        keys = zip(numbers, names, numbers[1:], strict=False)
        common = (leg for key, leg in zip(keys, route.legs_m, strict=True) if key in tour_keys)
        return sum(common) / route.length_m if route.length_m > 0 else 1.0

    def _used(self, arcs: Sequence[int]) -> BoolArray:
        """Return which arcs of the graph lie on the doors of some arcs, between the same rooms."""
        graph, doors = self._graph, self._rooms.door_of_arc
        chosen = np.isin(graph.arcs, list(arcs))
        pairs = np.sort(graph.endpoints, axis=1)
        used = {
            (*pairs[at].tolist(), doors[arc].number)
            for at, arc in zip(np.flatnonzero(chosen).tolist(), graph.arcs[chosen], strict=True)
            if arc in doors
        }
        return chosen | np.array(
            [
                arc in doors and (*pair, doors[arc].number) in used
                for arc, pair in zip(graph.arcs.tolist(), pairs.tolist(), strict=True)
            ],
            dtype=np.bool_,
        )

    def _breadth(self, cells: LongArray) -> float:
        """Return the sum of the clearance of some cells: least between the posts of a door."""
        return float(self._rooms.clearance_m.ravel()[cells].sum())

    def _parts(self, is_outside: BoolArray) -> LongArray:
        """Return the connected part of each vertex of the room level, joined by some arcs."""
        return connected_parts(self._graph.endpoints[is_outside], self._rooms.level.n_vertices)


def admissible(
    planned: list[tuple[Chosen, Track]], limits: RouteLimits
) -> list[tuple[Chosen, Track]]:
    """Return the tours that do not share too much with a shorter one, by length, or by cost, after
    the first.

    `planned`: tours with their tracks, the first one first; `limits`: what they must keep to.
    """
    chosen = planned[:1]
    for one, track in sorted(planned[1:], key=lambda pair: pair[1].cost_m):
        overlap = max(track.share(other) for _, other in chosen)
        if overlap <= limits.max_overlap and len(chosen) < limits.count:
            chosen.append((replace(one, overlap=overlap), track))
    return chosen


def _is_counted(door: Door | None) -> TypeGuard[Door]:
    return door is not None and not door.is_gap
