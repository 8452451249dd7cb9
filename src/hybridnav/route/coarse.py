"""The coarse planner: a search on the arcs of the topological map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.maps import CellClass
from hybridnav.route.arc_search import ArcSearch

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, LongArray
    from hybridnav.topology import TopologicalMap


@dataclass(frozen=True, eq=False)
class CoarseRoute:
    """Places and arcs of a coarse route, as dense indices, and the effort of the search."""

    places: LongArray
    arcs: LongArray
    expanded: int


class MaxDistanceSearch:
    """Cheapest routes by the max-distance attribute of arcs, the paper's own rule.

    A route costs the sum of `max_distance_m` over its arcs. The sum of `through_m` decides between
    routes of equal cost, such as those through two doors between the same rooms. Dijkstra's
    algorithm: an attribute is no path length, so no distance in the plane bounds it.

    Parameters
    ----------
    topology
        The map to search; both attributes are computed here, once.
    allow_unexplored
        Whether unexplored places may be passed.

    Examples
    --------
    >>> from hybridnav.route import MaxDistanceSearch
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(np.zeros((1, 30))))
    >>> topology = hn.TopologicalMap(pyramid)
    >>> MaxDistanceSearch(topology).search(0, topology.n_places - 1).places
    array([0, 1, 2, 3, 4, 5, 6])
    """

    def __init__(self, topology: TopologicalMap, *, allow_unexplored: bool = False) -> None:
        level = topology.level
        self.enterable: BoolArray = level.classes == CellClass.FREE
        if allow_unexplored:
            self.enterable = np.ones_like(self.enterable)
        self._search = ArcSearch(
            self.enterable,
            level.arcs,
            level.max_distance_m,
            level.through_m,
            kept=np.flatnonzero(~level.is_self_loop),
        )

    def search(self, start: int, goal: int) -> CoarseRoute | None:
        """Find a cheapest route between two places.

        Parameters
        ----------
        start, goal
            Dense indices of places that may be passed.

        Returns
        -------
        CoarseRoute | None
            None where no route joins them.
        """
        found = self._search.search(start, goal)
        if found.vertices is None:
            return None
        return CoarseRoute(found.vertices, found.arcs, found.expanded)
