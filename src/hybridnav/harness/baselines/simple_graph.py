"""The pyramid's places on a simple graph: parallel arcs merged, self-loops dropped."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav.harness.baselines.regions import CUT_CORNERS, RegionPlanner, free_fields
from hybridnav.maps import CellClass
from hybridnav.maps.islands import unique_rows
from hybridnav.route.coarse import ArcSearch

if TYPE_CHECKING:
    from hybridnav._base.typing import IntArray, LongArray
    from hybridnav.harness.baselines.regions import Cell, MethodResult
    from hybridnav.pyramid import Level
    from hybridnav.topology import TopologicalMap


@copies_alike
class SimpleGraphPyramid:
    """The topological map reduced to a simple graph: two places share at most one edge.

    Regular and irregular pyramids of simple graphs (P. Meer: Stochastic image pyramids, 1989; J.-M.
    Jolion, A. Montanvert: The adaptive pyramid, 1992) keep one edge for two regions with any number
    of common boundaries. The places are those of the topological map. An edge costs the
    `max_distance_m` of its arcs, which is the same for all of them; ties are decided by the
    `through_m` of the arc with the lowest index, since a simple graph keeps the first arc that it
    meets and ignores the others. (`Level.to_simple_graph` is kinder: it keeps the shortest.) The
    path is the shortest inside the fields of the route. If corners may be cut, a missing route
    proves nothing, and the method gives up.

    Parameters
    ----------
    topology
        The map whose free places are planned on.
    """

    def __init__(self, topology: TopologicalMap) -> None:
        level = topology.level
        free = level.classes == CellClass.FREE
        kept = first_arcs(level)
        kept = kept[free[level.arcs[kept]].all(axis=1)]  # arcs join places of two classes, too
        self.name = "simple-graph"
        self.region_of: IntArray = free_fields(topology)
        self.n_nodes = int(free.sum())
        self.n_edges = len(kept)
        graph = ArcSearch(free, level.arcs, level.max_distance_m, level.through_m, kept=kept)
        self._corner_cutting = topology.grid.corner_cutting
        self._planner = RegionPlanner(self.region_of, graph, corner_cutting=self._corner_cutting)
        self.memory_bytes = self._planner.memory_bytes

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells; nodes are dense indices of places. See `RegionPlanner`."""
        answer = self._planner.solve(start, goal)
        if self._corner_cutting and not answer.is_path:
            return replace(answer, gave_up=CUT_CORNERS)
        return answer


def first_arcs(level: Level) -> LongArray:
    """Return the arcs that a simple graph keeps, the lowest index between each two vertices."""
    plain = np.flatnonzero(~level.is_self_loop)
    endpoints = np.sort(level.arcs[plain], axis=1)
    first = unique_rows(endpoints).first
    return np.sort(plain[first])
