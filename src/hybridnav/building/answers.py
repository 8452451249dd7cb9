"""From the routes that a search has chosen to plans."""

from __future__ import annotations

import itertools
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from hybridnav.building.floors import ROUNDED
from hybridnav.building.network import START
from hybridnav.building.plan import BuildingPlan, Ride, cost_of, stats_of
from hybridnav.building.words import GuidedRoute
from hybridnav.planner.itinerary import waypoint_text
from hybridnav.result import PlanStatus

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.building.floors import Floor
    from hybridnav.building.network import LinkNetwork, Part
    from hybridnav.building.search import Endpoint, LinkSearch
    from hybridnav.result import PlanResult, PlanStats


class Answers:
    """Makes the plans of a building.

    Parameters
    ----------
    floors
        Its floors.
    network
        The links that may be used.
    speed_m_s
        Metres per second that the robot drives.
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

        Parameters
        ----------
        search
            The search of a query.
        endpoints
            Its start and goal.
        limits
            Most routes, and cost of one over that of the first, at most.
        began
            When the query began, by `time.perf_counter`.
        """
        count, stretch = limits
        if count == 1:
            best = search.best()
            chosen = [] if best is None else [best]
        else:
            ranked = search.ranked(lambda cost: stretch * cost / ROUNDED)
            chosen = list(itertools.islice(ranked, count))
        bound = search.bound()
        results = [tuple(search.drafts[part].result() for part in one.parts) for one in chosen]
        stats = stats_of([draft.stats for draft in search.planned], time.perf_counter() - began)
        if not chosen:
            metrics = [draft.result().metric for draft in search.planned[:1]]
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
        """Return the plan of one route, of its parts and their results."""
        parts, results = route
        rides = tuple(itertools.starmap(self._ride, itertools.pairwise(parts)))
        floors = [self._floors[self._floor_of(part, endpoints)] for part in parts]
        start, goal = (self._named(end) for end in endpoints)
        guided = GuidedRoute(
            tuple(floor.planner.guide for floor in floors),
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
            instruction_source=guided,
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
