"""Routes from door to door: the room level with the lengths of paths inside each room.

Routes that differ are found as on road networks: a shortest one to every door, and from every door
(I. Abraham, D. Delling, A. V. Goldberg, R. F. Werneck: Alternative routes in road networks, 2013).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from hybridnav._base.moves import STRAIGHT, length_in_cells
from hybridnav._base.threads import keep_last
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.maps.costs import UNIT_BITS, CostLayer
from hybridnav.pyramid.cracks import endpoints_of, middle_sides, sides_of
from hybridnav.rooms import Rooms
from hybridnav.route.room_fields import RoomFields
from hybridnav.topology import TopologicalMap


@dataclass(frozen=True)
class DoorRoute:
    """A route on the room level that passes no room twice.

    Examples
    --------
    >>> from hybridnav.route import DoorRoute
    >>> DoorRoute(vertices=(0, 1), arcs=(0,), legs_m=(2.0, 1.0)).length_m
    3.0
    """

    vertices: tuple[int, ...]
    """Vertices of the room level, from that of the start to that of the goal."""
    arcs: tuple[int, ...]
    """Arcs of the room level between them, one fewer than vertices."""
    legs_m: tuple[float, ...]
    """Length inside each room, from the middle of one boundary to that of the next, in metres; on a
    graph by costs its cost."""

    @property
    def length_m(self) -> float:
        """Length of the route in metres, or its cost."""
        return sum(self.legs_m)


class _Legs(NamedTuple):
    """Paths inside one room."""

    leaving: LongArray
    """int64 (k,), the darts that leave the room."""
    cells: LongArray
    """int64 (k,), the flat cell in the room before each of them."""
    costs: LongArray
    """int64 (k, k), costs between these cells, -1 for no path."""


class _Links(NamedTuple):
    """Links from dart to dart, arrays of n, each inside one room and over its boundary."""

    tail: LongArray
    head: LongArray
    cost: LongArray


class DoorGraph:
    """The room level as a graph of darts, each an arc passed in one direction.

    A dart is linked to the darts that leave the room that it enters. The cost is that of the
    shortest path of cells inside the room, or of the cheapest one, between the cells in the middle
    of both boundaries. It is counted in whole numbers, never below that of the path and at most
    1e-10 of it above, so that no route costs less than the cheapest path.

    Parameters
    ----------
    rooms
        The rooms.
    allow_unexplored
        Whether unexplored parts may be passed.
    closed
        int64 (m,), flat cells that may not be entered, sorted, each once; None for none.
    opened
        The graph without closed cells, whose rooms are taken over where they meet none; None to
        measure all rooms.
    factors
        float64 (rows, cols), a factor of at least 1 for each cell, rounded down to multiples of
        2^-14, as those of a layer are; None for lengths.

    Examples
    --------
    >>> from hybridnav.route import DoorGraph
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    >>> [route.legs_m for route in DoorGraph(topology.rooms).routes(0, 3)]
    [(2.0, 1.0)]
    """

    def __init__(
        self,
        rooms: Rooms,
        *,
        allow_unexplored: bool = False,
        closed: LongArray | None = None,
        opened: DoorGraph | None = None,
        factors: FloatArray | None = None,
    ) -> None:
        level = rooms.level
        allowed = np.ones_like(rooms.is_free) if allow_unexplored else rooms.is_free
        edges, arc_of = level.boundary_table
        is_kept: BoolArray = ~level.is_self_loop & allowed[level.arcs].all(axis=1)
        edges, arc_of = edges[is_kept[arc_of]], arc_of[is_kept[arc_of]]
        self.arcs: LongArray = np.flatnonzero(is_kept)
        """int64 (n,), the arcs between parts that may be entered, ascending."""
        self.endpoints: IntArray = level.arcs[self.arcs]
        """int32 (n, 2), the vertices of the room level on both sides of each."""
        self._level, self._allow_unexplored = level, allow_unexplored
        self._rooms = rooms
        self._arc_of: LongArray = np.searchsorted(self.arcs, arc_of)
        cells = np.stack(endpoints_of(edges, rooms.grid.shape[1]), axis=1)
        lies_first = level.field_of.ravel()[cells[:, 0]] == self.endpoints[self._arc_of, 0]
        self._cells: LongArray = np.where(lies_first[:, None], cells, cells[:, ::-1])
        self._factors = factors
        units = None
        if factors is not None:
            units = np.floor(factors * (1 << UNIT_BITS)).astype(np.int64)
        self._units = units
        self._fields = RoomFields(rooms, closed, units)
        self._middle = self._middles(sides_of(edges, rooms.grid.shape[1]), closed)
        self._over = self._costs_over()
        self._tails = self.endpoints.ravel()  # of each dart
        self._by_tail = np.argsort(self._tails, kind="stable")
        self._legs: list[_Legs] = []
        met = None if closed is None else set(self._fields.vertices_of(closed).tolist())
        for vertex in range(level.n_vertices):
            is_known = opened is not None and met is not None and vertex not in met
            legs = opened._legs[vertex] if is_known and opened else self._measured(vertex)  # noqa: SLF001
            self._legs.append(legs)
        self._inner = _joined([_links_of(legs, self._over) for legs in self._legs])
        self._closed: dict[bytes, DoorGraph] = {}

    def cells_beside(self, arc: int, half: int) -> LongArray:
        """Return the flat cells on one half of the boundary of an arc.

        Parameters
        ----------
        arc
            Index into `arcs`.
        half
            0 for the cells in the field of `endpoints[arc, 0]`, 1 for those in the other.
        """
        low, high = np.searchsorted(self._arc_of, [arc, arc + 1])
        return np.unique(self._cells[low:high, half])

    def middles_of(self, arcs: LongArray) -> LongArray:
        """Return the flat cells on both sides of the middle of some arcs, int64 (n, 2).

        They are -1 if closed cells leave nothing of the boundary. `arcs` are indices into `arcs`.
        """
        return self._middle[arcs]

    def closed(self, flat: LongArray) -> DoorGraph:
        """Return the graph with some cells closed; those of the last closures are kept.

        Parameters
        ----------
        flat
            int64 (m,), flat cells, sorted, each once.
        """
        key = flat.tobytes()
        graph = self._closed.get(key)
        if graph is None:
            graph = DoorGraph(
                self._rooms,
                allow_unexplored=self._allow_unexplored,
                closed=flat,
                opened=self,
                factors=self._factors,
            )
            keep_last(self._closed, key, graph, _MOST_KEPT)
        return graph

    def routes(self, start: int, goal: int) -> Iterator[DoorRoute]:
        """Find routes that pass no room twice, the shortest first.

        Each is the shortest to one dart, a link to another dart, and the shortest from there: so
        there are at most as many as links.

        Parameters
        ----------
        start, goal
            Flat cells that may be entered.

        Yields
        ------
        DoorRoute
            Each once.
        """
        first, last = self._fields.vertices_of(np.array([start, goal])).tolist()
        origin = 2 * len(self.arcs)
        links = _joined([self._inner, *self._outer(start, goal, origin)])
        from_start, before = _shortest_from(origin, links, origin + 2)
        backwards = _Links(links.head, links.tail, links.cost)
        to_goal, behind = _shortest_from(origin + 1, backwards, origin + 2)
        total = from_start[links.tail] + links.cost + to_goal[links.head]
        # On a stretch that both trees share, every link stands for the same route.
        is_shared = (before[links.head] == links.tail) & (behind[links.tail] == links.head)
        via = np.flatnonzero(np.isfinite(total) & (~is_shared | (links.tail == origin)))
        seen = set()
        for link in via[np.argsort(total[via], kind="stable")].tolist():
            coming = _chain(before, int(links.tail[link]))[::-1]
            nodes = coming + _chain(behind, int(links.head[link]))
            darts = np.array(nodes[1:-1], dtype=np.int64)
            arcs, halves = darts >> 1, darts & 1
            vertices = (first, *self.endpoints[arcs, 1 - halves].tolist())
            if len(set(vertices)) < len(vertices) or tuple(nodes) in seen:
                continue
            seen.add(tuple(nodes))
            assert vertices[-1] == last  # noqa: S101 - links lead into the room of the goal
            along = np.append(from_start[coming], total[link] - to_goal[nodes[len(coming) :]])
            legs = np.diff(along)
            cells = length_in_cells(legs) if self._units is None else legs / (STRAIGHT * _ONE)
            legs_m = cells * self._rooms.grid.resolution_m
            yield DoorRoute(vertices, tuple(self.arcs[arcs].tolist()), tuple(legs_m.tolist()))

    def _middles(self, sides: FloatArray, closed: LongArray | None) -> LongArray:
        """Return the open cells on both sides of the middle of each arc, int64 (n, 2), or -1."""
        is_open: BoolArray = np.ones(len(self._cells), dtype=np.bool_)
        if closed is not None:
            is_open = np.asarray(~np.isin(self._cells, closed).any(axis=1))
        middle = np.full((len(self.arcs), 2), -1, dtype=np.int64)
        if is_open.any():
            arcs, dense = np.unique(self._arc_of[is_open], return_inverse=True)
            at = middle_sides(sides[is_open], dense.astype(np.int64), len(arcs))
            middle[arcs] = self._cells[is_open][at]
        return middle

    def _costs_over(self) -> LongArray:
        """Return the integer cost of the step over the boundary with each dart, int64 (2 n,)."""
        costs = np.full(2 * len(self.arcs), STRAIGHT, dtype=np.int64)
        if self._units is not None:  # a boundary that is closed is no part of any link
            costs = np.repeat(STRAIGHT * self._units.ravel()[self._middle].sum(axis=1), 2)
        return costs

    def _measured(self, vertex: int) -> _Legs:
        low, high = np.searchsorted(self._tails, [vertex, vertex + 1], sorter=self._by_tail)
        leaving = self._by_tail[low:high]
        leaving = leaving[self._middle.ravel()[leaving] >= 0]
        cells = self._middle.ravel()[leaving]
        costs = np.zeros((len(cells), len(cells)), dtype=np.int64)
        field = self._fields.window(vertex) if len(cells) > 1 else None
        for number, cell in enumerate(cells[:-1].tolist(), start=1):
            assert field is not None  # noqa: S101 - there are two cells
            reached = field.costs(cell, cells[number:])
            costs[number - 1, number:] = costs[number:, number - 1] = reached
        return _Legs(leaving, cells, costs)

    def _outer(self, start: int, goal: int, origin: int) -> Iterator[_Links]:
        first, last = self._fields.vertices_of(np.array([start, goal])).tolist()
        leaving, entering = self._legs[first], self._legs[last]
        ones = np.ones(1, dtype=np.int64)
        costs = self._fields.window(first).costs(start, np.append(leaving.cells, goal))
        if first == last:
            yield _links(origin * ones, (origin + 1) * ones, costs[-1:], 0 * ones)
        tails = np.full_like(leaving.leaving, origin)
        yield _links(tails, leaving.leaving, costs[:-1], self._over[leaving.leaving])
        costs = self._fields.window(last).costs(goal, entering.cells)
        heads = np.full_like(entering.leaving, origin + 1)
        yield _links(entering.leaving ^ 1, heads, costs, np.zeros_like(costs))


def _links(tails: LongArray, heads: LongArray, costs: LongArray, over: LongArray) -> _Links:
    """Return the links that a path exists for; `over` are the costs over the boundaries."""
    there = costs >= 0
    return _Links(tails[there], heads[there], costs[there] + over[there])


def _links_of(legs: _Legs, over: LongArray) -> _Links:
    """Return the links of all pairs of darts of one room."""
    count = len(legs.leaving)
    tail, head = np.nonzero(~np.eye(count, dtype=np.bool_))
    heads = legs.leaving[head]
    return _links(legs.leaving[tail] ^ 1, heads, legs.costs[tail, head], over[heads])


def _joined(parts: list[_Links]) -> _Links:
    return _Links(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _shortest_from(node: int, links: _Links, n_nodes: int) -> tuple[FloatArray, LongArray]:
    """Return the cost of the shortest path to each node, and the node before it, or a negative
    number."""
    from scipy.sparse import coo_array  # noqa: PLC0415 - most planners need no rooms
    from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415

    graph = coo_array((links.cost, (links.tail, links.head)), shape=(n_nodes, n_nodes)).tocsr()
    costs, before = dijkstra(graph, indices=np.array([node]), return_predecessors=True)
    return costs[0], before[0].astype(np.int64)


def _chain(before: LongArray, node: int) -> list[int]:
    """Return a node, the one before it, and so on to the first."""
    nodes = [node]
    while (node := int(before[node])) >= 0:
        nodes.append(node)
    return nodes


_ONE = 2 << UNIT_BITS
"""Units of both cells of a move over cells with a factor of 1."""
_MOST_KEPT = 4
_Kept = WeakKeyDictionary["TopologicalMap", dict[bool, DoorGraph]]
_KEPT: _Kept = WeakKeyDictionary()
_KEPT_BY_COSTS: WeakKeyDictionary[CostLayer, _Kept] = WeakKeyDictionary()


def door_graph(
    topology: TopologicalMap, *, allow_unexplored: bool = False, costs: CostLayer | None = None
) -> DoorGraph:
    """Return the graph of doors of a map with rooms, measured for the first query.

    It is kept as long as the map, and the costs.

    Parameters
    ----------
    topology
        A map with rooms.
    allow_unexplored
        As in `DoorGraph`.
    costs
        Factors of its cells, by which rooms are measured; None for lengths.

    Returns
    -------
    DoorGraph
        The same object for the same arguments.

    Examples
    --------
    >>> from hybridnav.route import door_graph
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    >>> door_graph(topology) is door_graph(topology)
    True
    """
    by_map = _KEPT if costs is None else _KEPT_BY_COSTS.setdefault(costs, WeakKeyDictionary())
    kept = by_map.setdefault(topology, {})
    graph = kept.get(allow_unexplored)
    if graph is None:
        graph = kept[allow_unexplored] = DoorGraph(
            topology.rooms,
            allow_unexplored=allow_unexplored,
            factors=None if costs is None else costs.factors.astype(np.float64),
        )
    return graph
