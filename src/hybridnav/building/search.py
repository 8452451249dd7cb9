"""The search of routes over floors, which plans on a floor only where the best route may lead."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hybridnav.building.floors import ROUNDED
from hybridnav.building.network import ChosenParts
from hybridnav.planner.drafts import PlanDraft
from hybridnav.result import PlanStatus

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import ArrayLike

    from hybridnav.building.floors import FloorTable
    from hybridnav.building.network import LinkNetwork, Part
    from hybridnav.planner.closed import ClosedCells
    from hybridnav.planner.named import At

START, GOAL = -1, -2
"""Where the first part of a route begins, and where its last one ends."""
_MOST_LABELS = 20_000
"""Labels after which the search for one more route ends."""


@dataclass(frozen=True)
class Endpoint:
    """Start or goal of a query: the index of its floor, and a point or a name on it."""

    floor: int
    waypoint: ArrayLike | str


class LinkSearch:
    """One query over floors.

    A part of a route costs at least its lower bound, a straight line or better, until it is
    planned. Routes are searched by these numbers, and the first part of the best one that is not
    planned yet is planned, until all parts of the best one are.

    Parameters
    ----------
    network
        The links that may be used.
    tables
        The table of each floor.
    endpoints
        Start and goal.
    closed
        Closed cells of floors, by index.
    at
        Where in a room a path starts or ends.

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
        self.drafts: dict[Part, PlanDraft] = {}
        """The plans of parts that were asked for."""
        self.planned: list[PlanDraft] = []
        """Those made for this query."""
        self.is_complete = True
        """Whether `ranked` has looked at all routes that keep to the limit."""
        self._lower: dict[Part, float] = {}
        self._cost: dict[Part, float] = {}
        start, goal = endpoints
        for end, of in ((start, START), (goal, GOAL)):
            straight = tables[end.floor].straight_m(end.waypoint)
            for number in network.on_floor[end.floor]:
                part = (START, number) if of == START else (number, GOAL)
                self._lower[part] = straight[network.ends[number].at]
        if start.floor == goal.floor:
            table = tables[start.floor]
            straight_m = table.straight_between_m(start.waypoint, goal.waypoint)
            self._lower[START, GOAL] = straight_m

    def best(self) -> ChosenParts | None:
        """Return the cheapest route, all of whose parts are planned; None if there is none."""
        while True:
            found = self._least(lower=False)
            if found is None or self._has_planned(found.parts):
                return found

    def bound(self) -> float:
        """Return the least sum of lower bounds and charges over all routes, infinite for none."""
        found = self._least(lower=True)
        return math.inf if found is None else found.cost

    def reason(self) -> PlanStatus:
        """Return why there is no route, after one was searched."""
        statuses = []
        for (start, goal), draft in self.drafts.items():
            status = draft.status
            if status.name.startswith("START") and start == START:
                return status
            if status.name.startswith("GOAL") and goal == GOAL:
                return status
            statuses.append(status)
        late = {PlanStatus.TIMEOUT, PlanStatus.APPROXIMATE}
        return PlanStatus.TIMEOUT if late.intersection(statuses) else PlanStatus.NO_PATH

    def ranked(self, max_cost: Callable[[float], float]) -> Iterator[ChosenParts]:
        """Yield the cheapest route of each sequence of links, by cost; no link occurs twice.

        Parameters
        ----------
        max_cost
            Cost that no route exceeds, by that of the first one.
        """
        known: set[tuple[int, ...]] = set()
        most = math.inf
        while True:
            found = self._least_other(known, most)
            if found is None:
                return
            if self._has_planned(found.parts):
                if not known:
                    most = max_cost(found.cost)
                known.add(self._links_of(found.parts))
                yield found

    def _has_planned(self, parts: Sequence[Part]) -> bool:
        """Plan the parts that were not, until one costs more than expected; return whether none
        does. Those come first whose cost is not known, as they may rule the route out."""
        for part in sorted(parts, key=self._is_known):
            if part not in self.drafts:
                before = self._expected(part)
                self._plan(part)
                if not self._expected(part) <= before / ROUNDED:
                    return False
        return True

    def _is_known(self, part: Part) -> bool:
        """Return whether the cost of a part is known."""
        return self._cost_of(part) is not None

    def _plan(self, part: Part) -> None:
        """Plan one part, and take over its cost and its bound."""
        start, goal = part
        floor = self._start.floor if start == START else self._network.ends[start].floor
        table, closed = self._tables[floor], self._closed.get(floor)
        if start != START and goal != GOAL and closed is None:
            rows = self._network.ends[start].at, self._network.ends[goal].at
            result, was_kept = table.between(*rows)
            found = PlanDraft.of(result)
        else:
            found, was_kept = self._between(table, part, closed), False
            self._cost[part] = found.cost
            self._lower[part] = max(self._bound_of(part), found.lower_bound)
            if closed is None and (start == START) != (goal == GOAL):
                self._compare(table, part, found)
        self.drafts[part] = found
        if not was_kept:
            self.planned.append(found)

    def _between(self, table: FloorTable, part: Part, closed: ClosedCells | None) -> PlanDraft:
        start, goal = (
            end.waypoint if number == of else table.positions_m[self._network.ends[number].at]
            for number, of, end in zip(part, (START, GOAL), (self._start, self._goal), strict=True)
        )
        return table.floor.planner.draft(start, goal, blocked=closed, at=self._at)

    def _compare(self, table: FloorTable, part: Part, found: PlanDraft) -> None:
        """Raise the bounds of other parts from the start, or to the goal, by the triangle
        inequality; a name is not one point, and has none."""
        end = self._start if part[0] == START else self._goal
        if isinstance(end.waypoint, str):
            return
        is_first = part[0] == START
        number = part[1] if is_first else part[0]
        ends = self._network.ends
        row = ends[number].at
        for other in self._network.on_floor[end.floor]:
            at = ends[other].at
            if other == number:
                continue
            costs = table.cost[row][at], table.cost[at][row]
            least = [found.lower_bound - cost for cost in costs if cost < math.inf]
            if found.cost < math.inf:
                least.append(table.lower[row][at] - found.cost)
            compared = (START, other) if is_first else (other, GOAL)
            bound = max(least, default=0.0) * ROUNDED
            self._lower[compared] = max(self._lower[compared], bound)

    def _bound_of(self, part: Part) -> float:
        """Return the lower bound of a part."""
        found = self._lower.get(part)
        if found is None:
            start, goal = self._network.ends[part[0]], self._network.ends[part[1]]
            found = self._tables[start.floor].lower[start.at][goal.at]
        return found

    def _cost_of(self, part: Part) -> float | None:
        """Return the cost of a part that was planned, now or for a query before; else None."""
        start, goal = part
        if start < 0 or goal < 0 or self._network.ends[start].floor in self._closed:
            return self._cost.get(part)
        one, other = self._network.ends[start], self._network.ends[goal]
        cost = self._tables[one.floor].cost[one.at][other.at]
        return None if math.isnan(cost) else cost

    def _expected(self, part: Part) -> float:
        """Return the cost of a part if it is known, else its lower bound."""
        cost = self._cost_of(part)
        return self._bound_of(part) if cost is None else cost

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
        cost_of = self._bound_of if lower else self._expected
        floors = self._start.floor, self._goal.floor
        if self._closed:
            crossings = self._network.crossings(floors, cost_of)
        else:
            crossings = self._network.between(floors, self._tables, lower=lower)
        on_floor, known = self._network.on_floor, {} if lower else self._cost
        bounds = self._lower
        first = {end: known.get((START, end), bounds[START, end]) for end in on_floor[floors[0]]}
        last = {end: known.get((end, GOAL), bounds[end, GOAL]) for end in on_floor[floors[1]]}
        best, least = None, math.inf
        for one, other, between in crossings:
            cost = first[one] + between.cost + last[other]
            if cost < least:
                least, best = cost, (one, between.parts, other)
        if floors[0] == floors[1] and cost_of((START, GOAL)) <= least:
            least = cost_of((START, GOAL))
            return ChosenParts(least, ((START, GOAL),)) if least < math.inf else None
        if best is None:
            return None
        one, parts, other = best
        return ChosenParts(least, ((START, one), *parts, (other, GOAL)))

    def _least_other(self, known: set[tuple[int, ...]], most: float) -> ChosenParts | None:
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
            if node == GOAL and links not in known:
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
        """Return the least cost to the goal from each end at which a ride has ended."""
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
