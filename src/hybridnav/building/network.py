"""The ends of the links of a building, the rides between them, and the cheapest ways over both."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hybridnav.building.floors import FloorTable
    from hybridnav.building.links import Link

Part = tuple[int, int]
"""A path on one floor: from the start, or the end of a link, to an end, or the goal."""


class End(NamedTuple):
    """The end of a link in the network."""

    link: int
    """Index of the link."""
    floor: int
    """Index of the floor."""
    at: int
    """Its row in the table of the floor."""


class ChosenParts(NamedTuple):
    """A route, or a part of one: its parts in order, between which rides lead."""

    cost: float
    """Costs of its parts, and charges of its rides, in metres."""
    parts: tuple[Part, ...]
    """Its paths on floors."""


Crossings = list[tuple[int, int, ChosenParts]]
"""The end where a first ride begins, that where a last one ends, and what lies between."""


class LinkNetwork:
    """The ends of the links of a building, and the rides between them.

    Parameters
    ----------
    links
        The links that may be used.
    floor_of
        Index of each floor, by its name.
    rows
        Row in its floor's table of each end, by link and floor.
    speed_m_s
        Metres per second, by which rides are charged.
    """

    def __init__(
        self,
        links: Sequence[Link],
        floor_of: dict[str, int],
        rows: dict[tuple[str, str], int],
        speed_m_s: float,
    ) -> None:
        self.links = tuple(links)
        self.ends = [
            End(number, floor_of[end.floor], rows[link.name, end.floor])
            for number, link in enumerate(links)
            for end in link.ends
        ]
        self.on_floor: list[list[int]] = [[] for _ in floor_of]
        of_link: list[list[int]] = [[] for _ in links]
        for number, end in enumerate(self.ends):
            self.on_floor[end.floor].append(number)
            of_link[end.link].append(number)
        names = [end.floor for link in links for end in link.ends]
        self.rides: list[list[tuple[int, float]]] = [
            [
                (other, link.charge_m(names[number], names[other], speed_m_s=speed_m_s))
                for other in of_link[end.link]
                if other != number
            ]
            for number, end in enumerate(self.ends)
            for link in (links[end.link],)
        ]
        self._between: dict[tuple[int, int, bool], tuple[tuple[int, ...], Crossings]] = {}

    def between(
        self, floors: tuple[int, int], tables: Sequence[FloorTable], *, lower: bool
    ) -> Crossings:
        """Return the cheapest way from each end on a floor to each end on another one, by what the
        tables know; it is kept until they know more.

        Parameters
        ----------
        floors
            Where the first ride begins, and where the last one ends.
        tables
            The table of each floor.
        lower
            Whether parts of routes cost their lower bounds, also where their costs are known.
        """
        versions = tuple(table.version for table in tables)
        kept = self._between.get((*floors, lower))
        if kept is None or kept[0] != versions:

            def cost_of(part: Part) -> float:
                one, other = self.ends[part[0]], self.ends[part[1]]
                table = tables[one.floor]
                cost = math.nan if lower else table.cost[one.at][other.at]
                return table.lower[one.at][other.at] if math.isnan(cost) else cost

            kept = versions, self.crossings(floors, cost_of)
            self._between[*floors, lower] = kept
        return kept[1]

    def crossings(self, floors: tuple[int, int], cost_of: Callable[[Part], float]) -> Crossings:
        """Return the cheapest way from each end on a floor, by which one leaves it, to each end on
        another one, by which one arrives, by Dijkstra's algorithm."""
        found = []
        for first in self.on_floor[floors[0]]:
            least = self._ways_from(first, cost_of)
            reached = [end for end in self.on_floor[floors[1]] if end in least]
            found += [(first, end, ChosenParts(*least[end])) for end in reached]
        return found

    def _ways_from(
        self, first: int, cost_of: Callable[[Part], float]
    ) -> dict[int, tuple[float, tuple[Part, ...]]]:
        """Return the least cost from an end where a ride begins to the ends where rides end, and
        the parts between."""
        least: dict[int, tuple[float, tuple[Part, ...]]] = {}
        heap: list[tuple[float, int, tuple[Part, ...]]]
        heap = [(charge, other, ()) for other, charge in self.rides[first]]
        heapq.heapify(heap)
        while heap:
            cost, node, parts = heapq.heappop(heap)
            if node in least:
                continue
            least[node] = cost, parts
            for end in self.on_floor[self.ends[node].floor]:
                arrived = cost + cost_of((node, end)) if end != node else math.inf
                if not arrived < math.inf:
                    continue
                for other, charge in self.rides[end]:
                    if other not in least:
                        passed = (*parts, (node, end))
                        heapq.heappush(heap, (arrived + charge, other, passed))
        return least
