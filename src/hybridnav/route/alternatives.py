"""Routes of different homotopy classes, shortest first."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.topology.homotopy import IDENTITY, HomotopyClasses, Word, product

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._typing import FloatArray
    from hybridnav.topology import TopologicalMap

_MOST_EXPANDED = 20_000
"""States expanded per search at most: with many holes there are ever more classes."""


@dataclass(frozen=True)
class ClassRoute:
    """A route and its class."""

    places: tuple[int, ...]
    """Dense indices of places."""
    arcs: tuple[int, ...]
    """Dense indices of the arcs between them."""
    word: Word
    """Reduced word of its class."""
    length_m: float
    """Sum of `through_m` over its arcs, metres."""


class AlternativeSearch:
    """Searches places together with the words of the ways to them.

    A* over pairs of a place and a reduced word, with the exact length of the way that is left as
    the heuristic, so that classes come out in the order of their shortest routes. Routes that pass
    a place twice are left out: a turn round a pillar is a class of its own, but no way to go.

    Parameters
    ----------
    topology
        The map.
    allow_unexplored
        Whether unexplored places may be passed.
    least_hole_m2
        Holes of a smaller area do not count.

    Raises
    ------
    InvalidValueError
        When the area is negative.
    """

    def __init__(
        self,
        topology: TopologicalMap,
        *,
        allow_unexplored: bool = False,
        least_hole_m2: float = 1.0,
    ) -> None:
        self.classes = HomotopyClasses(
            topology, allow_unexplored=allow_unexplored, least_hole_m2=least_hole_m2
        )
        level = topology.level
        self._through_m = level.through_m
        darts: list[list[tuple[int, int]]] = [[] for _ in range(level.n_vertices)]
        enterable = self.classes.enterable
        for arc, (tail, head) in enumerate(level.arcs.tolist()):
            if tail != head and enterable[tail] and enterable[head]:
                darts[tail].append((2 * arc, head))
                darts[head].append((2 * arc + 1, tail))
        self._darts = darts

    def routes(self, start: int, goal: int) -> Iterator[ClassRoute]:
        """Yield one route of each class, the shortest first.

        Parameters
        ----------
        start, goal
            Dense indices of places that may be entered.

        Yields
        ------
        ClassRoute
            Until there are no more, or 20,000 states have been expanded.
        """
        left_m = self._lengths_to(goal)
        if not np.isfinite(left_m[start]):
            return
        heap: list[tuple[float, int, int, Word, tuple[int, ...]]] = []
        heapq.heappush(heap, (float(left_m[start]), 0, start, IDENTITY, ()))
        closed: set[tuple[int, Word]] = set()
        pushed = 0
        while heap and len(closed) < _MOST_EXPANDED:
            bound, _, place, word, taken = heapq.heappop(heap)
            if (place, word) in closed:
                continue
            closed.add((place, word))
            passed = self._places(start, taken)
            if place == goal:
                arcs = tuple(dart >> 1 for dart in taken)
                yield ClassRoute(passed, arcs, word, bound)
                continue
            length = bound - float(left_m[place])
            for dart, head in self._darts[place]:
                if head in passed:
                    continue
                pushed += 1
                further = product(word, self.classes.word_of_dart(dart))
                whole = length + float(self._through_m[dart >> 1]) + float(left_m[head])
                heapq.heappush(heap, (whole, pushed, head, further, (*taken, dart)))

    def _places(self, start: int, darts: tuple[int, ...]) -> tuple[int, ...]:
        places = [start]
        for dart in darts:
            places.append(next(head for other, head in self._darts[places[-1]] if other == dart))
        return tuple(places)

    def _lengths_to(self, goal: int) -> FloatArray:
        """Length of the shortest route from each place, infinite where there is none."""
        lengths = np.full(len(self._darts), np.inf)
        lengths[goal] = 0.0
        heap = [(0.0, goal)]
        while heap:
            length, place = heapq.heappop(heap)
            if length > lengths[place]:
                continue
            for dart, head in self._darts[place]:
                further = length + float(self._through_m[dart >> 1])
                if further < lengths[head]:
                    lengths[head] = further
                    heapq.heappush(heap, (further, head))
        return lengths
