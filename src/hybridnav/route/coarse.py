"""The coarse planner: Dijkstra's algorithm on the arcs of a graph, parallel arcs allowed, and the
search of the topological map by it; and the corridor along its route.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.maps import CellClass
from hybridnav.route.kernels import arcs as _kernels
from hybridnav.route.route import Corridor
from hybridnav.topology import TopologicalMap

Beside = Literal["route", "joined", "neighbours"]
"""Which places beside a route belong to its corridor; see `corridor_of`."""


@dataclass(frozen=True, eq=False)
class ArcWalk:
    """Outcome of a search: vertices in the order passed, and the arcs between them.

    Both are None if no walk joins start and goal.
    """

    vertices: LongArray | None
    arcs: LongArray
    expanded: int


@copies_alike
class ArcSearch:
    """Search of an undirected graph for the cheapest walks.

    `allowed`: bool (n_vertices,), the vertices that walks may pass; `arcs`: int (n_arcs, 2), the
    vertices that each arc joins; `costs`, `ties`: float64 (n_arcs,), the cost of an arc, and a
    second cost that decides between walks of equal cost; >= 0, any unit; `kept`: indices of the
    arcs that walks may use; None for all.
    """

    def __init__(
        self,
        allowed: BoolArray,
        arcs: IntArray | LongArray,
        costs: FloatArray,
        ties: FloatArray,
        *,
        kept: LongArray | None = None,
    ) -> None:
        used = np.arange(len(arcs)) if kept is None else kept
        tail = np.concatenate([arcs[used, 0], arcs[used, 1]])
        order = np.argsort(tail, kind="stable")
        self._first = np.searchsorted(tail[order], np.arange(len(allowed) + 1))
        head = np.concatenate([arcs[used, 1], arcs[used, 0]])
        self._neighbour = head[order].astype(np.int64)
        self._arc = np.tile(used, 2)[order]
        self._arcs = arcs
        self._costs, self._ties = costs, ties
        self.allowed: BoolArray = allowed
        """bool (n_vertices,), the vertices that walks may pass."""

    @property
    def n_vertices(self) -> int:
        """Number of vertices, including those that may not be passed."""
        return len(self.allowed)

    def search(self, start: int, goal: int) -> ArcWalk:
        """Find the cheapest walk between two vertices that may be passed."""
        arcs, reached, expanded = _kernels.cheapest_arcs(
            self._first,
            self._neighbour,
            self._arc,
            self._costs,
            self._ties,
            self.allowed,
            start,
            goal,
        )
        if not reached:
            return ArcWalk(None, arcs, int(expanded))
        vertices = [start]
        for u, v in self._arcs[arcs].tolist():
            vertices.append(v if u == vertices[-1] else u)
        return ArcWalk(np.array(vertices, dtype=np.int64), arcs, int(expanded))


@dataclass(frozen=True, eq=False)
class CoarseRoute:
    """Places and arcs of a coarse route, as dense indices, and the effort of the search."""

    places: LongArray
    arcs: LongArray
    expanded: int


class MaxDistanceSearch:
    """Cheapest routes by the max-distance attribute of arcs, our reading of the source paper.

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
        route = self._search.search(start, goal)
        if route.vertices is None:
            return None
        return CoarseRoute(route.vertices, route.arcs, route.expanded)


def corridor_of(
    topology: TopologicalMap,
    places: LongArray,
    *,
    beside: Beside = "route",
    enterable: BoolArray | None = None,
) -> Corridor:
    """Return the receptive fields of the places of a route, and those of some places beside it.

    Parameters
    ----------
    topology
        The map of the route.
    places
        Dense indices of the route's places, in their order.
    beside
        `"route"`: none. `"joined"`: the places beside the first and the last one, and places that
        two arcs join to the route, so that a path can leave it there and come back. `"neighbours"`:
        all that an arc joins to it.
    enterable
        bool (n_places,), the places that may be entered; None for all.

    Examples
    --------
    >>> from hybridnav.route import corridor_of
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(np.zeros((1, 30))))
    >>> topology = hn.TopologicalMap(pyramid)
    >>> corridor_of(topology, np.array([0, 1])).n_cells
    10
    >>> corridor_of(topology, np.array([0, 1]), beside="joined").n_cells
    13
    """
    allowed = np.ones(topology.n_places, dtype=np.bool_) if enterable is None else enterable
    inside = along(topology.arcs, places, beside, allowed)
    return Corridor(topology.level.field_of, inside, int(topology.level.areas[inside].sum()))


def along(
    arcs: IntArray | LongArray, walk: LongArray, beside: Beside, allowed: BoolArray
) -> BoolArray:
    """Return the vertices of a walk and those beside it, bool (n_vertices,); see `corridor_of`."""
    weight = np.zeros(len(allowed), dtype=np.int8)
    weight[walk], weight[walk[[0, -1]]] = 1, 2
    inside: BoolArray = weight > 0
    if beside != "route":
        inside |= allowed & _kernels.joined_to(arcs, weight, 2 if beside == "joined" else 1)
    return inside
