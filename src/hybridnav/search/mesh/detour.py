"""`DetourSearch`: shortest any-angle paths round closed cells, on a mesh without them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.threads import Pool
from hybridnav.search.mesh.cut import renew_mesh
from hybridnav.search.mesh.kernels import closures as kernels
from hybridnav.search.mesh.kernels.state import MeshClosure
from hybridnav.search.mesh.search import MeshPath, MeshSearch

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, LongArray
    from hybridnav.search.mesh.batch import MeshPaths


@copies_alike
class DetourSearch:
    """Exact shortest any-angle paths round closed cells; threads may share it.

    The first query that needs it cuts the closed cells out of the mesh.

    Parameters
    ----------
    opened
        The search of the map with these cells open.
    free
        bool (rows, cols), its free cells.
    closed
        int64 (m,), flat cells that are closed, sorted, each once; cells that are not free change
        nothing.
    scratch
        Copies of `free` to close cells in and open them again; None to make one.

    Examples
    --------
    >>> from hybridnav.search.mesh import DetourSearch, MeshSearch, build_mesh
    >>> free = np.ones((3, 5), dtype=bool)
    >>> detour = DetourSearch(MeshSearch(build_mesh(free)), free, np.array([2, 7]))
    >>> detour.search.path(((0, 0), (0, 4)), ((0.5, 0.5), (0.5, 4.5))).positions
    array([[0.5, 0.5],
           [2. , 2. ],
           [2. , 3. ],
           [0.5, 4.5]])
    """

    def __init__(
        self,
        opened: MeshSearch,
        free: BoolArray,
        closed: LongArray,
        scratch: Pool[BoolArray] | None = None,
    ) -> None:
        self._open, self._free = opened, free
        self._scratch = Pool(partial(np.copy, free)) if scratch is None else scratch
        self._closed = closed[free.ravel()[closed]]
        self._closure = MeshClosure(*kernels.closure_of(self._closed, free.shape[1]))
        self._search: MeshSearch | None = None

    @property
    def search(self) -> MeshSearch:
        """The search of the mesh without the closed cells."""
        # Without a lock: two threads may cut the same mesh, and an interrupt leaves no lock held.
        if self._search is None:
            left = self._scratch.take()
            left.ravel()[self._closed] = False
            made = MeshSearch(renew_mesh(self._open.mesh, left, self._closed))
            left.ravel()[self._closed] = True
            self._scratch.give(left)
            self._search = made
        return self._search

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
        return kernels.paths_cross(self._closure, self._free, *along)
