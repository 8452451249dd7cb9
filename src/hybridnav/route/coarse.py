"""The coarse planner: a search on the arcs of the topological map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.grid import CellClass
from hybridnav.search import _kernels

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, LongArray
    from hybridnav.topology import TopologicalMap


@dataclass(frozen=True, eq=False)
class CoarseRoute:
    """Places and arcs of a coarse route, as dense indices, and what the search took."""

    places: LongArray
    arcs: LongArray
    expanded: int


class MaxDistanceSearch:
    """Cheapest routes by the max-distance attribute of arcs, the paper's own rule.

    A route costs the sum of `max_distance_m` over its arcs; routes of equal cost, such as those
    through two doors between the same rooms, are told apart by the sum of `through_m`. Dijkstra's
    algorithm: an attribute is no path length, so no distance in the plane bounds it.

    Parameters
    ----------
    topology
        The map to search; both attributes are computed here, once.
    allow_unexplored
        Whether unexplored places may be passed.
    """

    def __init__(self, topology: TopologicalMap, *, allow_unexplored: bool = False) -> None:
        level = topology.level
        plain = np.flatnonzero(~level.is_self_loop)
        tail = np.concatenate([level.arcs[plain, 0], level.arcs[plain, 1]])
        head = np.concatenate([level.arcs[plain, 1], level.arcs[plain, 0]])
        order = np.argsort(tail, kind="stable")
        self._first = np.searchsorted(tail[order], np.arange(level.n_vertices + 1))
        self._neighbour = head[order].astype(np.int64)
        self._arc = np.concatenate([plain, plain])[order]
        self._arcs = level.arcs
        self._cost = level.max_distance_m
        self._tie = level.through_m
        self.enterable: BoolArray = level.classes == CellClass.FREE
        if allow_unexplored:
            self.enterable = np.ones_like(self.enterable)

    def search(self, start: int, goal: int) -> CoarseRoute | None:
        """Cheapest route between two places.

        Parameters
        ----------
        start, goal
            Dense indices of places that may be passed.

        Returns
        -------
        CoarseRoute | None
            None where no route joins them.
        """
        arcs, reached, expanded = _kernels.cheapest_arcs(
            self._first,
            self._neighbour,
            self._arc,
            self._cost,
            self._tie,
            self.enterable,
            start,
            goal,
        )
        if not reached:
            return None
        places = [start]
        for u, v in self._arcs[arcs]:
            places.append(int(v) if u == places[-1] else int(u))
        return CoarseRoute(np.array(places, dtype=np.int64), arcs, int(expanded))
