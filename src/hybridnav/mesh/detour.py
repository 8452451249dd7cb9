"""Shortest any-angle paths round closed cells."""

from __future__ import annotations

import math
from time import perf_counter
from typing import TYPE_CHECKING, Any

from hybridnav._copies import copies_alike
from hybridnav.mesh import _closure_kernels as closures
from hybridnav.mesh import _detour_kernels as kernels
from hybridnav.mesh._detour_search_kernels import UNSURE, query_round
from hybridnav.mesh._polyanya_kernels import DONE, EXPANDED, WORK_FULL
from hybridnav.mesh.cut import cut_mesh
from hybridnav.mesh.search import (
    MOST_MADE,
    NO_LIMIT,
    SLICE,
    SURE,
    MeshPath,
    MeshSearch,
    round_into,
)

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, LongArray
    from hybridnav.mesh.corner_graph import CornerGraph
    from hybridnav.mesh.many import MeshPaths

Cell = tuple[int, int]
Position = tuple[float, float]

_GROUPS = 4
"""Most groups of corners of closed cells: each costs a bound at every corner reached."""


@copies_alike
class DetourSearch:
    """Exact shortest any-angle paths round closed cells; threads may share it.

    Closed cells remove the edges of the graph of corners that meet them, and add corners of their
    own. So the graph is not rebuilt: the search tests edges as it reaches them, and the graph's
    landmarks still bound the rest. If the mesh has no such graph, the closed cells are cut out of
    it.

    Parameters
    ----------
    search
        The search of the map with these cells open.
    flat
        int64 (m,), the closed cells, sorted, each once.

    Examples
    --------
    >>> from hybridnav.mesh import DetourSearch, MeshSearch, build_mesh
    >>> search = MeshSearch(build_mesh(np.ones((3, 5), dtype=bool)))
    >>> closed = np.array([2, 7])  # flat cells
    >>> detour = DetourSearch(search, closed)
    >>> detour.path(((0, 0), (0, 4)), ((0.5, 0.5), (0.5, 4.5))).positions
    array([[0.5, 0.5],
           [2. , 2. ],
           [2. , 3. ],
           [0.5, 4.5]])
    """

    def __init__(self, search: MeshSearch, flat: LongArray) -> None:
        self._search = search
        self._flat = flat
        self._closure = closures.closure_of(flat, search.mesh.polygon_at)
        self._detour: tuple[Any, ...] | None = None
        self._cut: MeshSearch | None = None

    def is_met_by(self, path: MeshPath) -> bool:
        """Return whether a shortest path between open cells is illegal with these cells closed.

        The result is also True if the path alone does not decide: if an end of it, or a bend, is a
        corner of a closed cell.

        Parameters
        ----------
        path
            A path of the search with these cells open, between ends that stay open.
        """
        if path.positions is None:
            return False
        at = self._search.mesh.polygon_at
        return bool(closures.path_crosses(self._closure, at, path.positions))

    def are_met_by(self, paths: MeshPaths) -> BoolArray:
        """Return which of many shortest paths meet the closed cells, bool (n,); see `is_met_by`."""
        at = self._search.mesh.polygon_at
        met: BoolArray = closures.paths_cross(self._closure, at, paths.positions, paths.path_start)
        return met

    def path(
        self,
        cells: tuple[Cell, Cell],
        positions: tuple[Position, Position],
        *,
        epsilon: float = 0.0,
        budget_s: float | None = None,
    ) -> MeshPath:
        """Find a shortest path between two positions, as `MeshSearch.path` does."""
        until = math.inf if budget_s is None else perf_counter() + budget_s
        found = self._round(cells, positions, 1.0 + epsilon, until)
        if found is not None:
            return found
        # Without a lock: two threads may cut the same mesh, and an interrupt leaves no lock held.
        if self._cut is None:
            mesh = self._search.mesh
            free = mesh.polygon_at >= 0
            free.ravel()[self._flat] = False
            self._cut = MeshSearch(cut_mesh(mesh, free, self._flat))
        left_s = None if budget_s is None else max(until - perf_counter(), 0.0)
        return self._cut.path(cells, positions, epsilon=epsilon, budget_s=left_s)

    def _round(
        self,
        cells: tuple[Cell, Cell],
        positions: tuple[Position, Position],
        factor: float,
        until: float,
    ) -> MeshPath | None:
        """Return a shortest path in the graph of corners, or None.

        The result is None if there is no such graph, if closed cells make too many corners, or if
        an endpoint lies at a corner of a cell that is not free.
        """
        search = self._search
        landmarked = search.landmarked()
        if landmarked is None:
            return None
        graph, works = landmarked
        if self._detour is None:
            self._detour = _detour_of(search, graph, self._closure)
        if len(self._detour[1][0]) > MOST_MADE:
            return None
        limit = NO_LIMIT if math.isinf(until) else SLICE
        endpoints = tuple(round_into(*end) for end in zip(cells, positions, strict=True))
        points = endpoints[0][1], endpoints[0][0], endpoints[1][1], endpoints[1][0]
        mesh, edges = search.mesh, graph.arrays
        where = mesh.component, mesh.polygon_at, (*cells[0], *cells[1])
        with works.lent() as work:
            while True:
                status, path = query_round(
                    *(search.arrays, edges, self._detour, where, points, work.arrays),
                    (math.inf, factor, limit),
                )
                if status in (DONE, UNSURE):
                    break
                if status == WORK_FULL:
                    work.make_room()
                else:
                    limit = -1 if perf_counter() >= until else limit + SLICE
            length, bound = work.bounds.tolist()
            expanded = int(work.counts[EXPANDED])
        if status == UNSURE:
            return None
        bound = length if bound >= length else bound * SURE
        return MeshPath(path if len(path) else None, length, bound, expanded)


def _detour_of(search: MeshSearch, graph: CornerGraph, closure: Any) -> tuple[Any, ...]:
    """Return the arrays of closed cells for `query_round`, without edges if there are too many
    corners."""
    polygon_at, table = search.mesh.polygon_at, graph.landmark_distances
    made = closures.corners_of_closure(closure, polygon_at)
    if len(made[0]) > MOST_MADE:
        return closure, made
    edges = kernels.edges_of_closure(search.arrays, polygon_at, graph.arrays, closure, made)
    groups = kernels.groups_of_closure(search.arrays[:2], table, made, edges, _GROUPS)
    return closure, made, edges, groups
