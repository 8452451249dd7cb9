"""Shortest any-angle paths on a convex mesh, exact, with a bound at any time."""

from __future__ import annotations

import math
import threading
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.kernels.places import places_of
from hybridnav._base.moves import FAR
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.threads import Pool, behind
from hybridnav.search.mesh.build import MANY_CORNERS, add_landmarks, contract_corners, find_edges
from hybridnav.search.mesh.kernels.intervals import DIRECTED
from hybridnav.search.mesh.kernels.queries import answer, answer_climbing
from hybridnav.search.mesh.kernels.state import (
    DONE,
    EXPANDED,
    GROWING,
    N_COUNTS,
    WORK_FULL,
    CornerWork,
    Heap,
    Hierarchy,
    HierarchyWork,
    IntervalWork,
    MeshBlocks,
    ViewRoom,
)

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.search.mesh.build import ConvexMesh, CornerGraph, CornerHierarchy
    from hybridnav.search.mesh.kernels.state import Corners

    Graph = MeshBlocks | Corners | Hierarchy
    Work = IntervalWork | CornerWork | HierarchyWork


KERNEL = answer
"""The kernel whose compiled form shows that a search was run before."""
Cell = tuple[int, int]
Position = tuple[float, float]

_ROOM = 4096
"""Initial room for nodes of a query."""
SLICE = 256
"""Nodes that a query with a budget expands between looks at the clock, some 0.2 ms."""
NO_LIMIT = 1 << 62
"""More nodes than any query expands."""
SURE = 1.0 - 1e-12
"""Factor on the lower bound of a stopped search, because sums of lengths are rounded."""
_WORTH = 20_000
"""Least number of intervals that queries expand before the graph of corners is built."""


class MeshPath(NamedTuple):
    """The shortest path found between two positions; its positions are None if none was found."""

    positions: FloatArray | None
    """float64 (n, 2), (row, col) in grid units: the start, the corners at which it turns, the
    goal."""
    length_cells: float
    """Length of the path, infinite for none."""
    lower_bound_cells: float
    """No path is shorter: equal to the length of a path that is proved shortest, infinite if it is
    proved that there is no path."""
    expanded: int
    """Intervals, or corners, that the search expanded."""


def _works_for(mesh: ConvexMesh, graph: Graph) -> tuple[Work, LongArray | None]:
    """Return the work arrays of one query, whose places nobody has asked for."""
    return _work_for(mesh, graph), None


def _work_for(mesh: ConvexMesh, graph: Graph) -> Work:
    n, n_polygons = len(mesh.corners), mesh.n_polygons
    heap = Heap(np.empty(_ROOM), np.empty(_ROOM, np.int32))
    counts, bounds = np.zeros(N_COUNTS, np.int64), np.zeros(2)
    every = np.empty(n_polygons, np.int32), np.empty(n_polygons, np.int32), counts, bounds
    if (mesh.kinds >= DIRECTED).any():
        n += len(mesh.begins)
    touched = np.empty(n, np.int32)
    if isinstance(graph, MeshBlocks):
        is_open, marked = np.zeros(len(graph.head), np.bool_), np.empty(len(graph.head), np.int32)
        nodes, best = (np.empty((_ROOM, 4), np.int32), np.empty((_ROOM, 5))), np.full(n, np.inf)
        return IntervalWork(*every, is_open, marked, *nodes, heap, best, touched)
    room = ViewRoom(np.empty((_ROOM, 2), np.int32), np.empty((_ROOM, 4)), np.empty(_ROOM, np.int32))
    if isinstance(graph, Hierarchy):
        heaps = np.empty((_ROOM, 2), np.int64), np.empty((_ROOM, 2), np.int64)
        return HierarchyWork(*every, room, np.full((n, 4), FAR), touched, *heaps)
    costs, to_goal = np.full(n, np.inf), np.full(n, np.inf)
    corners = costs, np.empty(n), np.empty(n, np.int32), to_goal, touched
    goal_bounds = np.empty((2, graph.landmark_distances.shape[1]))
    return CornerWork(*every, room, *corners, heap, goal_bounds)


def doubled(room: Any) -> Any:
    """Return work arrays, or a part of them, with room for twice as many entries."""
    if isinstance(room, np.ndarray):
        return np.concatenate([room, room])
    grown = {name: doubled(getattr(room, name)) for name in GROWING.intersection(room._fields)}
    return room._replace(**grown)


@copies_alike
class MeshSearch:
    """Exact shortest any-angle paths on a mesh; threads may share it.

    The first queries search intervals of the mesh (Polyanya). Once these have taken about as long
    as the graph of corners takes to build, it is built, and contracted if that is quick. All later
    queries use it, up to ten times as fast, and in large buildings far more than that. The two may
    find different paths of equal length. From 100,000 corners on, a thread builds it, and queries
    do not wait for it.

    Parameters
    ----------
    mesh
        The mesh of the map's free space.

    Notes
    -----
    M. L. Cui, D. D. Harabor, A. Grastien: Compromise-free pathfinding on a navigation mesh, 2017
    (Polyanya).

    Examples
    --------
    >>> from hybridnav.search.mesh import MeshSearch, build_mesh
    >>> search = MeshSearch(build_mesh(np.ones((3, 4), dtype=bool)))
    >>> search.path(((0, 0), (2, 3)), ((0.5, 0.5), (2.5, 3.5))).length_cells
    3.605551275463989
    """

    def __init__(self, mesh: ConvexMesh) -> None:
        self.mesh = mesh
        self.arrays, self._polygon_at = mesh.arrays, mesh.polygon_at
        self._use(mesh.blocks)
        self.edges: tuple[LongArray, IntArray] | None = None
        """The edges between corners (see `CornerGraph`); None until they are found."""
        self._graph: CornerGraph | CornerHierarchy | None = None
        self.is_prepared = False
        """Whether the graph of corners is built, or found not to be worth its memory."""
        self._lock, self._begun = threading.Lock(), threading.Lock()
        self.expanded = 0
        """Number of intervals that queries have expanded so far."""

    @property
    def graph(self) -> CornerGraph | CornerHierarchy | None:
        """The graph of corners, contracted or not; None until it is built."""
        return self._graph

    @property
    def is_worth_a_graph(self) -> bool:
        """Whether queries of intervals have taken so long that they build the graph of corners."""
        return self.expanded >= max(_WORTH, len(self.mesh.corners))

    def prepare(self, progress: Progress = no_progress) -> None:
        """Build the graph of corners now, if it does not exist yet: up to a microsecond a cell.

        Parameters
        ----------
        progress
            Called after each step with the number of steps done and of all steps.
        """
        if self.is_prepared:
            return
        with self._lock:
            if self.is_prepared:
                return
            edges = find_edges(self.arrays)
            progress(1, 2)
            graph: CornerGraph | CornerHierarchy | None = None
            if edges is not None:
                n_free = int(np.count_nonzero(self.mesh.polygon_at >= 0))
                graph = contract_corners(self.arrays, edges, n_free)
                graph = graph or add_landmarks(self.arrays, edges)
            self.adopt(edges, graph)
            progress(2, 2)

    def adopt(
        self, edges: tuple[LongArray, IntArray] | None, graph: CornerGraph | CornerHierarchy | None
    ) -> None:
        """Use a graph of corners of the same mesh, with its edges, for all later queries.

        None stands for a graph that was found not to be worth its memory.
        """
        if graph is not None:
            self._use(graph.arrays)
        self.edges, self._graph = edges, graph
        self.is_prepared = True

    def _use(self, graph: Graph) -> None:
        # In one step, for the queries of other threads.
        self.engine = graph, Pool(partial(_works_for, self.mesh, graph))

    def path(
        self,
        cells: tuple[Cell, Cell],
        positions: tuple[Position, Position],
        *,
        epsilon: float = 0.0,
        budget_s: float | None = None,
    ) -> MeshPath:
        """Find a shortest path between two positions.

        Parameters
        ----------
        cells
            The free cells (row, col) of start and goal.
        positions
            Start and goal, (row, col) in grid units, in the closed squares of these cells.
        epsilon
            The search may end as soon as its path is at most 1 + epsilon times as long as the lower
            bound.
        budget_s
            Seconds after which the search ends with the best path so far, None for no limit.

        Returns
        -------
        MeshPath
            A shortest path, unless epsilon or the budget ends the search earlier.
        """
        until = math.inf if budget_s is None else perf_counter() + budget_s
        if budget_s is None and not self.is_prepared and self.is_worth_a_graph:
            if len(self.mesh.corners) < MANY_CORNERS:
                self.prepare()
            else:
                behind(self._begun, self.prepare)
        graph, works = self.engine
        work, places = works.take()
        limit = step = NO_LIMIT if until == math.inf else SLICE
        while True:
            effort = 1.0 + epsilon, limit
            if isinstance(graph, Hierarchy):
                if places is None:
                    places = places_of(self.arrays, self._polygon_at, graph, work)
                found = answer_climbing(places, cells, positions, effort)
            else:
                given = self.arrays, self._polygon_at, graph, cells, positions, work
                found = answer(*given, effort)
            status, path, length, bound = found
            if status == DONE:
                break
            if status == WORK_FULL:
                work, places = doubled(work), None
            else:
                limit = -1 if perf_counter() >= until else limit + step
        expanded = int(work.counts[EXPANDED])
        works.give((work, places))
        if not self.is_prepared:
            self.expanded += expanded
        bound = length if bound >= length else bound * SURE
        return MeshPath(path if len(path) else None, length, bound, expanded)


def rounded_into(cells: LongArray, positions: FloatArray) -> FloatArray:
    """Round positions, and move each into the closed square of its cell; float64 (n, 2)."""
    rounded = np.round(positions * GRAIN) / GRAIN
    return np.clip(rounded, cells, cells + 1.0)
