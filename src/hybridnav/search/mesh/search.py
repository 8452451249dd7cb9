"""Shortest any-angle paths on a convex mesh, exact, with a bound at any time."""

from __future__ import annotations

import math
import threading
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.moves import FAR
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.threads import Pool, behind
from hybridnav._base.trig import hypots
from hybridnav.search.mesh.build import (
    MANY_CORNERS,
    CornerHierarchy,
    add_landmarks,
    contract_corners,
    find_edges,
)
from hybridnav.search.mesh.kernels import polyanya
from hybridnav.search.mesh.kernels.queries import answer

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.search.mesh.build import ConvexMesh, CornerGraph


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


class _Work:
    """Work arrays of one query, of any kind."""

    def __init__(self, mesh: ConvexMesh) -> None:
        self.endpoints = np.empty(mesh.n_polygons, np.int32), np.empty(mesh.n_polygons, np.int32)
        self.counts = np.zeros(polyanya.N_COUNTS, dtype=np.int64)
        self.bounds = np.zeros(2)
        self.told = self.counts, self.bounds
        self.heap = np.empty(_ROOM), np.empty(_ROOM, np.int32)

    def make_room(self) -> None:
        """Make room for twice as many entries."""
        self.heap = _doubled(self.heap)


class _IntervalWork(_Work):
    """Work arrays of a query of intervals."""

    def __init__(self, mesh: ConvexMesh) -> None:
        super().__init__(mesh)
        n_blocks, n_corners = len(mesh.block_head), len(mesh.corners)
        self.opened = np.zeros(n_blocks, np.bool_), np.empty(n_blocks, np.int32)
        self.corners = np.full(n_corners, np.inf), np.empty(n_corners, np.int32)
        self.nodes = np.empty((_ROOM, 4), np.int32), np.empty((_ROOM, 5))

    def make_room(self) -> None:
        super().make_room()
        self.nodes = _doubled(self.nodes)

    @property
    def arrays(self) -> tuple[object, ...]:
        """The arrays in the order of `query`."""
        nodes = *self.nodes, *self.heap, *self.corners, self.counts, self.bounds
        return *self.endpoints, *self.opened, nodes


class _CornerWork(_Work):
    """Work arrays of a query of corners."""

    def __init__(self, mesh: ConvexMesh, n_landmarks: int) -> None:
        super().__init__(mesh)
        n = len(mesh.corners)
        self.views = np.empty((_ROOM, 2), np.int32), np.empty((_ROOM, 4)), np.empty(_ROOM, np.int32)
        costs, to_goal = np.full(n, np.inf), np.full(n, np.inf)
        self.corners = costs, np.empty(n), np.empty(n, np.int32), to_goal, np.empty(n, np.int32)
        self.goal_bounds = np.empty((2, n_landmarks))

    def make_room(self) -> None:
        super().make_room()
        self.views = _doubled(self.views)

    @property
    def arrays(self) -> tuple[object, ...]:
        """The arrays in the order of `query_corners`."""
        tail = self.goal_bounds, self.counts, self.bounds
        return *self.endpoints, self.views, self.corners, self.heap, *tail


class _HierarchyWork(_Work):
    """Work arrays of a query of the hierarchy of corners."""

    def __init__(self, mesh: ConvexMesh) -> None:
        super().__init__(mesh)
        n = len(mesh.corners)
        self.views = np.empty((_ROOM, 2), np.int32), np.empty((_ROOM, 4)), np.empty(_ROOM, np.int32)
        self.records, self.touched = np.full((n, 4), FAR), np.empty(n, np.int32)
        self.heaps = np.empty((_ROOM, 2), np.int64), np.empty((_ROOM, 2), np.int64)

    def make_room(self) -> None:
        self.heaps, self.views = _doubled(self.heaps), _doubled(self.views)

    @property
    def arrays(self) -> tuple[object, ...]:
        """The arrays in the order of `query_hierarchy`."""
        tail = self.heaps, self.counts, self.bounds
        return *self.endpoints, self.views, self.records, self.touched, *tail


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
        rows, cols = np.ascontiguousarray(mesh.corners.T, dtype=np.float64)
        sides = mesh.begins, mesh.finishes, mesh.twins, mesh.polygon_of
        self.arrays = cols, rows, mesh.kinds, mesh.first, *sides
        tree = mesh.block_head, mesh.block_up, mesh.component, mesh.depth
        self.blocks, self.place = (mesh.block_of, tree), (mesh.component, mesh.polygon_at)
        self.works: Pool[Any] = Pool(partial(_IntervalWork, mesh))
        self.corner_works: Pool[Any]
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
            edges = find_edges(self.mesh, self.arrays)
            progress(1, 2)
            graph: CornerGraph | CornerHierarchy | None = None
            if edges is not None:
                graph = contract_corners(self.mesh, self.arrays, edges)
                if graph is None:
                    graph = add_landmarks(self.mesh, self.arrays, edges)
            self.adopt(edges, graph)
            progress(2, 2)

    def adopt(
        self, edges: tuple[LongArray, IntArray] | None, graph: CornerGraph | CornerHierarchy | None
    ) -> None:
        """Use a graph of corners of the same mesh, with its edges, for all later queries.

        None stands for a graph that was found not to be worth its memory.
        """
        if isinstance(graph, CornerHierarchy):
            self.corner_works = Pool(partial(_HierarchyWork, self.mesh))
        elif graph is not None:
            n_landmarks = graph.landmark_distances.shape[1]
            self.corner_works = Pool(partial(_CornerWork, self.mesh, n_landmarks))
        self.edges, self._graph = edges, graph
        self.is_prepared = True

    def engine(self) -> tuple[CornerGraph | CornerHierarchy | None, Pool[Any]]:
        """Return what answers queries, None for the mesh itself, and its work arrays."""
        graph = self._graph
        return graph, self.works if graph is None else self.corner_works

    def path(
        self,
        cells: tuple[Cell, Cell],
        positions: tuple[Position, Position],
        *,
        epsilon: float = 0.0,
        budget_s: float | None = None,
        known: FloatArray | None = None,
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
        known
            float64 (n, 2), a path from start to goal in free space: the answer until the search
            finds a shorter one. With epsilon the search ends as soon as this path is proved good
            enough; without epsilon it saves little.

        Returns
        -------
        MeshPath
            A shortest path, unless epsilon or the budget ends the search earlier.
        """
        until = math.inf if budget_s is None else perf_counter() + budget_s
        if budget_s is None and self.is_worth_a_graph:
            if len(self.mesh.corners) < MANY_CORNERS:
                self.prepare()
            else:
                behind(self._begun, self.prepare)
        upper = math.inf
        if known is not None:
            first, last = (round_into(*end) for end in zip(cells, positions, strict=True))
            known = np.concatenate([[first], known[1:-1], [last]])
            upper = float(hypots(*np.diff(known, axis=0).T).sum())
        (row, col), (to_row, to_col) = positions
        ends = (*cells[0], *cells[1]), (col, row, to_col, to_row)
        graph, works = self.engine()
        arrays = self.blocks if graph is None else graph.arrays
        work, effort = works.take(), (upper, epsilon, until)
        _, path, length, bound, expanded = self._run(arrays, ends, work, effort)
        works.give(work)
        if graph is None and not self.is_prepared:
            self.expanded += expanded
        bound = length if bound >= length else bound * SURE
        return MeshPath(path if len(path) else known, length, bound, expanded)

    def _run(
        self,
        graph: tuple[Any, ...],
        ends: tuple[tuple[int, ...], tuple[float, ...]],
        work: Any,
        effort: tuple[float, float, float],
    ) -> tuple[int, FloatArray, float, float, int]:
        """Run a kernel in slices until it is done, or out of time; see `answer`."""
        upper, epsilon, until = effort
        step = NO_LIMIT if until == math.inf else SLICE
        limit = step if until else 0
        while True:
            left = upper, 1.0 + epsilon, limit
            found = answer(self.arrays, graph, self.place, ends, (work.arrays, work.told), left)
            status = found[0]
            if status == polyanya.DONE:
                return cast("tuple[int, FloatArray, float, float, int]", found)
            if status == polyanya.WORK_FULL:
                work.make_room()
            elif perf_counter() >= until:
                limit = -1
            else:
                limit += step


def _doubled(arrays: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return copies with room for twice as many rows."""
    return tuple(np.concatenate([array, array]) for array in arrays)


def round_into(cell: Cell, position: Position) -> Position:
    """Round a position, and move it into the closed square of its cell."""
    row, col = (round(value * GRAIN) / GRAIN for value in position)
    top, left = float(cell[0]), float(cell[1])
    return min(max(row, top), top + 1.0), min(max(col, left), left + 1.0)


def rounded_into(cells: LongArray, positions: FloatArray) -> FloatArray:
    """Round positions, and move each into the closed square of its cell; float64 (n, 2)."""
    rounded = np.round(positions * GRAIN) / GRAIN
    return np.clip(rounded, cells, cells + 1.0)
