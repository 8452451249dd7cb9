"""The search of routes over floors, which plans on a floor only where the best route may lead."""

import heapq
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.typing import FloatArray, IntArray
from hybridnav.ext.fleet.floors import ROUNDED, Floor, FloorTable
from hybridnav.ext.fleet.links import GOAL, START, ChosenParts, Endpoint, LinkNetwork, Part, Ride
from hybridnav.ext.fleet.plan import COUNTS, BuildingPlan, GuidedRoute, cost_of
from hybridnav.guide.words.itinerary import guide_of, waypoint_text
from hybridnav.planning import HybridPlanner, PlanResult, PlanStats, PlanStatus
from hybridnav.planning.named import At
from hybridnav.search.found import ClosedCells

_MOST_LABELS = 20_000
"""Labels after which the search for one more route ends."""


@dataclass(frozen=True)
class _Costs:
    """Lower bounds on the costs of parts, and the costs of those that were planned, else NaN."""

    lower: FloatArray
    known: FloatArray

    @property
    def expected(self) -> FloatArray:
        """The costs where they are known, else the bounds."""
        return np.where(np.isnan(self.known), self.lower, self.known)


def _parts(planner: HybridPlanner, closed: ClosedCells | None) -> IntArray:
    """Return the part that each open cell lies in, int32 (rows, cols), 0 for other cells. Cells
    that touch are in one part, for a point on a corner may lie in both."""
    from scipy import ndimage  # noqa: PLC0415 - most queries need none

    allowed = planner.preset.planner.allow_unexplored
    is_open = planner.grid.enterable(allow_unexplored=allowed).copy()
    if closed is not None:
        is_open.ravel()[closed.flat] = False
    labels, _ = ndimage.label(is_open, np.ones((3, 3)))
    return labels.astype(np.int32, copy=False)


class LinkSearch:
    """One query over floors.

    A part of a route costs at least its lower bound, a straight line or better, until it is
    planned. Routes are searched by these numbers, and the first part of the best one that is not
    planned yet is planned, until all parts of the best one are.

    `network`: the links that may be used; `tables`: the table of each floor; `endpoints`: start and
    goal; `closed`: closed cells of floors, by index, in place of those of their tables; `at`: where
    in a room a path starts or ends.

    Notes
    -----
    C. Dellin, S. Srinivasa: A unifying formalism for shortest path problems with expensive edge
    evaluations via lazy best-first search over paths with edge selectors (LazySP), 2016.
    """

    def __init__(
        self,
        network: LinkNetwork,
        tables: Sequence[FloorTable],
        endpoints: tuple[Endpoint, Endpoint],
        closed: dict[int, ClosedCells],
        at: At,
    ) -> None:
        self._network, self._tables, self._closed, self._at = network, tables, closed, at
        self._start, self._goal = endpoints
        self.results: dict[Part, PlanResult] = {}
        """The plans of parts that were asked for."""
        self.planned: list[PlanResult] = []
        """Those made for this query."""
        self.is_complete = True
        """Whether `ranked` has looked at all routes that keep to the limit."""
        self._of_floor: dict[int, _Costs] = {}
        self._divided: set[int] = set()
        start, goal = endpoints
        n = len(network.ends)
        self._first, self._last = (
            _Costs(np.full(n, np.inf), np.full(n, np.nan)) for _ in endpoints
        )
        for end, costs in ((start, self._first), (goal, self._last)):
            on_floor = network.on_floor[end.floor]
            rows = [network.ends[number].at for number in on_floor]
            costs.lower[on_floor] = tables[end.floor].straight_m(end.waypoint)[rows]
        direct_m = math.inf
        if start.floor == goal.floor:
            direct_m = tables[start.floor].straight_between_m(start.waypoint, goal.waypoint)
        self._direct = _Costs(np.array([direct_m]), np.array([math.nan]))

    def best(self) -> ChosenParts | None:
        """Return the cheapest route, all of whose parts are planned; None if there is none."""
        while True:
            route = self._least(lower=False)
            if route is None or self._has_planned(route.parts):
                return route

    def bound(self) -> float:
        """Return the least sum of lower bounds and charges over all routes, infinite for none."""
        route = self._least(lower=True)
        return math.inf if route is None else route.cost

    def reason(self) -> PlanStatus:
        """Return why there is no route, after one was searched."""
        statuses = []
        for (start, goal), result in self.results.items():
            status = result.status
            if status.name.startswith("START") and start == START:
                return status
            if status.name.startswith("GOAL") and goal == GOAL:
                return status
            statuses.append(status)
        late = {PlanStatus.TIMEOUT, PlanStatus.APPROXIMATE}
        return PlanStatus.TIMEOUT if late.intersection(statuses) else PlanStatus.NO_PATH

    def ranked(self, max_cost: Callable[[float], float]) -> Iterator[ChosenParts]:
        """Yield the cheapest route of each sequence of links, by cost; no link occurs twice.

        `max_cost`: cost that no route exceeds, by that of the first one.
        """
        sequences: set[tuple[int, ...]] = set()
        most = math.inf
        while True:
            route = self._least_other(sequences, most)
            if route is None:
                return
            if self._has_planned(route.parts):
                if not sequences:
                    most = max_cost(route.cost)
                sequences.add(self._links_of(route.parts))
                yield route

    def _has_planned(self, parts: Sequence[Part]) -> bool:
        """Plan the parts that were not, until one costs more than expected; return whether none
        does. Those come first whose cost is not known, as they may rule the route out."""
        for part in sorted(parts, key=self._is_known):
            if part not in self.results:
                before = self._expected(part)
                self._plan(part)
                if self.results[part].status is PlanStatus.NO_PATH:
                    self._divide(self._floor_of(part))
                if not self._expected(part) <= before / ROUNDED:
                    return False
        return True

    def _is_known(self, part: Part) -> bool:
        """Return whether a part was planned, now or for a query before."""
        costs, key = self._slot(part)
        return not math.isnan(costs.known[key])

    def _plan(self, part: Part) -> None:
        """Plan one part, and take over its cost and its bound."""
        start, goal = part
        floor = self._floor_of(part)
        table, closed = self._tables[floor], self._closed_on(floor)
        if start != START and goal != GOAL and floor not in self._closed:
            rows = self._network.ends[start].at, self._network.ends[goal].at
            result, was_kept = table.between(*rows)
        else:
            result, was_kept = self._between(table, part, closed), False
            costs, key = self._slot(part)
            costs.known[key] = result.cost
            costs.lower[key] = max(costs.lower[key], result.lower_bound)
            if floor not in self._closed and (start == START) != (goal == GOAL):
                self._compare(table, part, result)
        self.results[part] = result
        if not was_kept:
            self.planned.append(result)

    def _closed_on(self, floor: int) -> ClosedCells | None:
        """Return the closed cells of a floor: those of the query, or those of its table."""
        return self._closed.get(floor, self._tables[floor].closed)

    def _floor_of(self, part: Part) -> int:
        return self._start.floor if part[0] == START else self._network.ends[part[0]].floor

    def _divide(self, floor: int) -> None:
        """Rule out all paths between connected parts of a floor, once one path was not found.

        The search would ask for each, and behind a shut door there are as many as ends.
        """
        if floor in self._divided:
            return
        self._divided.add(floor)
        table = self._tables[floor]
        part_of = _parts(table.floor.planner, self._closed_on(floor))
        frame = table.floor.planner.grid.frame
        own = part_of[tuple(frame.cells_of(table.positions_m).T)]
        costs = self._costs_on(floor)
        for bounds in (costs.lower, table.expected)[: 1 if floor in self._closed else 2]:
            bounds[own[:, None] != own] = np.inf
        on_floor = np.array(self._network.on_floor[floor], dtype=np.int64)
        rows = [self._network.ends[number].at for number in on_floor]
        for end, outer in ((self._start, self._first), (self._goal, self._last)):
            if end.floor == floor and not isinstance(end.waypoint, str):
                x, y = np.asarray(end.waypoint, dtype=np.float64)[:2].tolist()
                outer.lower[on_floor[own[rows] != part_of[frame.cell_of(x, y)]]] = np.inf

    def _between(self, table: FloorTable, part: Part, closed: ClosedCells | None) -> PlanResult:
        start, goal = (
            end.waypoint if number == of else table.positions_m[self._network.ends[number].at]
            for number, of, end in zip(part, (START, GOAL), (self._start, self._goal), strict=True)
        )
        return table.floor.planner.plan(start, goal, blocked=closed, at=self._at)

    def _compare(self, table: FloorTable, part: Part, result: PlanResult) -> None:
        """Raise the bounds of other parts from the start, or to the goal, by the triangle
        inequality; a name is not one point, and has none."""
        end = self._start if part[0] == START else self._goal
        if isinstance(end.waypoint, str):
            return
        is_first = part[0] == START
        number = part[1] if is_first else part[0]
        others = [other for other in self._network.on_floor[end.floor] if other != number]
        row, rows = (self._network.ends[number].at, [self._network.ends[o].at for o in others])
        to, back = table.cost[row, rows], table.cost[rows, row]
        is_directed = table.is_directed
        away = (back if is_first else to) if is_directed else np.fmin(to, back)
        least = np.zeros(len(others))
        is_near = away < np.inf
        least[is_near] = result.lower_bound - away[is_near]
        if result.cost < math.inf and not is_directed:
            least = np.maximum(least, table.lower[row, rows] - result.cost)
        lower = (self._first if is_first else self._last).lower
        lower[others] = np.maximum(lower[others], least * ROUNDED)

    def _slot(self, part: Part) -> tuple[_Costs, int | tuple[int, int]]:
        """Return where the cost and the bound of a part are kept."""
        start, goal = part
        if start == START:
            return (self._direct, 0) if goal == GOAL else (self._first, goal)
        if goal == GOAL:
            return self._last, start
        one, other = self._network.ends[start], self._network.ends[goal]
        return self._costs_on(one.floor), (one.at, other.at)

    def _costs_on(self, floor: int) -> _Costs:
        """Return the costs between the ends on a floor: those of its table, or, where cells are
        closed, its bounds, and the costs of this query."""
        if floor not in self._of_floor:
            table = self._tables[floor]
            is_closed = floor in self._closed
            cost = np.full_like(table.cost, np.nan) if is_closed else table.cost
            self._of_floor[floor] = _Costs(table.lower.copy() if is_closed else table.lower, cost)
        return self._of_floor[floor]

    def _expected(self, part: Part) -> float:
        costs, key = self._slot(part)
        return float((costs.known if self._is_known(part) else costs.lower)[key])

    def _expected_on(self, floor: int) -> FloatArray:
        """Return the costs between the ends on a floor where they are known, else the bounds."""
        if floor not in self._closed:
            return self._tables[floor].expected
        return self._costs_on(floor).expected

    def _parts_from(self, start: int) -> list[Part]:
        """Return the parts that leave the start, or an end at which a ride has ended."""
        floor = self._start.floor if start == START else self._network.ends[start].floor
        parts = [(start, end) for end in self._network.on_floor[floor] if end != start]
        if floor == self._goal.floor:
            parts.append((start, GOAL))
        return parts

    def _least(self, *, lower: bool) -> ChosenParts | None:
        """Return the cheapest route, by the costs of parts where they are known and not `lower`,
        else by lower bounds."""
        outer = self._first, self._last, self._direct
        first, last, direct = (costs.lower if lower else costs.expected for costs in outer)
        on = (lambda floor: self._costs_on(floor).lower) if lower else self._expected_on
        route = self._network.cheapest(first, last, on)
        direct_m = float(direct[0])
        if direct_m < math.inf and (route is None or direct_m <= route.cost):
            return ChosenParts(direct_m, ((START, GOAL),))
        return route

    def _least_other(self, sequences: set[tuple[int, ...]], most: float) -> ChosenParts | None:
        """Return the cheapest route with a sequence of links that is not known."""
        ahead = self._to_goal()
        ends, rides = self._network.ends, self._network.rides
        done: set[tuple[int, tuple[int, ...]]] = set()
        heap: list[tuple[float, float, int, tuple[int, ...], tuple[Part, ...]]]
        heap = [(0.0, 0.0, START, (), ())]
        while heap and len(done) < _MOST_LABELS:
            least, cost, node, links, parts = heapq.heappop(heap)
            if least > most:
                return None
            if node == GOAL and links not in sequences:
                return ChosenParts(cost, parts)
            if node == GOAL or (node, links) in done:
                continue
            done.add((node, links))
            for part in self._parts_from(node):
                arrived = cost + self._expected(part)
                if not arrived < math.inf:
                    continue
                if part[1] == GOAL:
                    heapq.heappush(heap, (arrived, arrived, GOAL, links, (*parts, part)))
                    continue
                link = ends[part[1]].link
                for other, charge in rides[part[1]] if link not in links else ():
                    total = arrived + charge
                    if total + ahead.get(other, math.inf) < math.inf:
                        passed = (*parts, part)
                        label = total + ahead[other], total, other, (*links, link), passed
                        heapq.heappush(heap, label)
        self.is_complete = not heap
        return None

    def _to_goal(self) -> dict[int, float]:
        backward: dict[int, list[tuple[int, float]]] = {}
        for node in range(len(self._network.ends)):
            for part in self._parts_from(node):
                cost = self._expected(part)
                if part[1] == GOAL:
                    backward.setdefault(GOAL, []).append((node, cost))
                    continue
                for other, charge in self._network.rides[part[1]]:
                    backward.setdefault(other, []).append((node, cost + charge))
        least, heap = {GOAL: 0.0}, [(0.0, GOAL)]
        while heap:
            cost, node = heapq.heappop(heap)
            if cost > least[node]:
                continue
            for other, step in backward.get(node, ()):
                if cost + step < least.get(other, math.inf):
                    least[other] = cost + step
                    heapq.heappush(heap, (cost + step, other))
        return least

    def _links_of(self, parts: Sequence[Part]) -> tuple[int, ...]:
        return tuple(self._network.ends[part[1]].link for part in parts if part[1] != GOAL)


# From the routes that a search has chosen to plans.


class Answers:
    """Makes the plans of a building.

    `network`: the links that may be used; `speed_m_s`: metres per second that the robot drives.
    """

    def __init__(self, floors: Sequence[Floor], network: LinkNetwork, speed_m_s: float) -> None:
        self._floors, self._network, self._speed_m_s = floors, network, speed_m_s

    def refused(self, status: PlanStatus, endpoints: tuple[Endpoint, Endpoint]) -> BuildingPlan:
        """Return the plan of a query without a route."""
        start, goal = (self._named(end) for end in endpoints)
        return BuildingPlan(status, "octile", start, goal, speed_m_s=self._speed_m_s)

    def found(
        self,
        search: LinkSearch,
        endpoints: tuple[Endpoint, Endpoint],
        limits: tuple[int, float],
        began: float,
    ) -> tuple[BuildingPlan, ...]:
        """Search routes, and return them as plans.

        `search`: the search of a query; `endpoints`: its start and goal; `limits`: most routes, and
        cost of one over that of the first, at most; `began`: when the query began, by
        `clock`.
        """
        count, stretch = limits
        if count == 1:
            best = search.best()
            chosen = [] if best is None else [best]
        else:
            ranked = search.ranked(lambda cost: stretch * cost / ROUNDED)
            chosen = list(itertools.islice(ranked, count))
        bound = search.bound()
        results = [tuple(search.results[part] for part in one.parts) for one in chosen]
        stats = stats_of([result.stats for result in search.planned], clock() - began)
        if not chosen:
            metrics = [result.metric for result in search.planned[:1]]
            refused = self.refused(search.reason(), endpoints)
            metric = metrics[0] if metrics else refused.metric
            return (replace(refused, metric=metric, lower_bound=bound, stats=stats),)
        return tuple(
            self._plan(endpoints, (one.parts, of_parts), bound, stats)
            for one, of_parts in zip(chosen, results, strict=True)
        )

    def _plan(
        self,
        endpoints: tuple[Endpoint, Endpoint],
        route: tuple[tuple[Part, ...], tuple[PlanResult, ...]],
        bound: float,
        stats: PlanStats,
    ) -> BuildingPlan:
        parts, results = route
        rides = tuple(itertools.starmap(self._ride, itertools.pairwise(parts)))
        floors = [self._floors[self._floor_of(part, endpoints)] for part in parts]
        start, goal = (self._named(end) for end in endpoints)
        guided = GuidedRoute(
            tuple(guide_of(floor.planner) for floor in floors),
            results,
            rides,
            waypoint_text(endpoints[1].waypoint),
        )
        cost = cost_of(results, rides)
        return BuildingPlan(
            PlanStatus.SOLVED,
            results[0].metric,
            start,
            goal,
            results,
            tuple(floor.name for floor in floors),
            rides,
            # Sums are rounded: a bound that differs from the cost by that alone is the cost.
            lower_bound=cost if bound >= cost * ROUNDED else bound,
            speed_m_s=self._speed_m_s,
            stats=stats,
            instructions_source=guided,
        )

    def _floor_of(self, part: Part, endpoints: tuple[Endpoint, Endpoint]) -> int:
        return endpoints[0].floor if part[0] == START else self._network.ends[part[0]].floor

    def _ride(self, before: Part, after: Part) -> Ride:
        """Return the ride between two parts of a route."""
        entered, left = self._network.ends[before[1]], self._network.ends[after[0]]
        charges = dict(self._network.rides[before[1]])
        from_floor, to_floor = self._floors[entered.floor].name, self._floors[left.floor].name
        return Ride(self._network.links[entered.link], from_floor, to_floor, charges[after[0]])

    def _named(self, end: Endpoint) -> tuple[str, tuple[float, ...] | str]:
        name, waypoint = self._floors[end.floor].name, end.waypoint
        if isinstance(waypoint, str):
            return name, waypoint
        x, y = (float(number) for number in waypoint)  # type: ignore[union-attr, arg-type]
        return name, (x, y)


def stats_of(planned: list[PlanStats], seconds: float) -> PlanStats:
    """Return the effort of a query.

    `planned`: the effort of each plan that was made for it; `seconds`: wall-clock seconds of all;
    what the stages of the plans leave is called `links`.
    """
    stages: dict[str, float] = {}
    for stats in planned:
        for stage, spent in stats.seconds.items():
            stages[stage] = stages.get(stage, 0.0) + spent
    stages["links"] = max(seconds - sum(stages.values()), 0.0)
    sums = {name: sum(getattr(stats, name) for stats in planned) for name in COUNTS}
    return PlanStats(**sums, seconds=stages)
