"""Shortest any-angle paths round closed cells."""

from __future__ import annotations

import math
from time import perf_counter
from typing import TYPE_CHECKING

from hybridnav._copies import copies_alike
from hybridnav.mesh import _closure_kernels as kernels
from hybridnav.mesh.cut import renew_mesh
from hybridnav.mesh.search import MeshPath, MeshSearch

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, LongArray
    from hybridnav.mesh.build import ConvexMesh
    from hybridnav.mesh.many import MeshPaths

Cell = tuple[int, int]
Position = tuple[float, float]


@copies_alike
class DetourSearch:
    """Exact shortest any-angle paths round closed cells; threads may share it.

    The closed cells are cut out of the mesh, by the first query that needs it.

    Parameters
    ----------
    mesh
        The mesh of the map with these cells open.
    free
        bool (rows, cols), its free cells.
    closed
        int64 (m,), flat cells that are closed, sorted, each once; those that are not free change
        nothing.

    Examples
    --------
    >>> from hybridnav.mesh import DetourSearch, build_mesh
    >>> free = np.ones((3, 5), dtype=bool)
    >>> detour = DetourSearch(build_mesh(free), free, np.array([2, 7]))
    >>> detour.path(((0, 0), (0, 4)), ((0.5, 0.5), (0.5, 4.5))).positions
    array([[0.5, 0.5],
           [2. , 2. ],
           [2. , 3. ],
           [0.5, 4.5]])
    """

    def __init__(self, mesh: ConvexMesh, free: BoolArray, closed: LongArray) -> None:
        self._mesh, self._free = mesh, free
        self._closed = closed[free.ravel()[closed]]
        self._closure = kernels.closure_of(self._closed, free.shape[1])
        self._search: MeshSearch | None = None

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
        return bool(kernels.path_crosses(self._closure, self._free, path.positions))

    def are_met_by(self, paths: MeshPaths) -> BoolArray:
        """Return which of many shortest paths meet the closed cells, bool (n,); see `is_met_by`."""
        along = paths.positions, paths.path_start
        met: BoolArray = kernels.paths_cross(self._closure, self._free, *along)
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
        # Without a lock: two threads may cut the same mesh, and an interrupt leaves no lock held.
        if self._search is None:
            free = self._free.copy()
            free.ravel()[self._closed] = False
            self._search = MeshSearch(renew_mesh(self._mesh, free, self._closed))
        left_s = None if budget_s is None else max(until - perf_counter(), 0.0)
        return self._search.path(cells, positions, epsilon=epsilon, budget_s=left_s)
