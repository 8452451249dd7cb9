"""`DetourSearch`: shortest any-angle paths round closed cells, and across directed sides in their
direction, on a mesh that is cut along them.
"""

from __future__ import annotations

from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.threads import Pool
from hybridnav.search.mesh.cut import renew_mesh
from hybridnav.search.mesh.kernels import closures as kernels
from hybridnav.search.mesh.kernels import slits
from hybridnav.search.mesh.kernels.state import MeshClosure
from hybridnav.search.mesh.search import MeshPath, MeshSearch
from hybridnav.search.mesh.slits import directed_search, slits_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._base.typing import BoolArray, IntArray, LongArray
    from hybridnav.search.mesh.batch import MeshPaths


@copies_alike
class DetourSearch:
    """Exact shortest any-angle paths round closed cells and across directed sides.

    Threads may share it. The first query that needs it cuts the mesh. Paths of the map without them
    are a lower bound.

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
    sides
        int (n, 4), cells (row, col) from which, and to which, each side may be crossed, and not
        back. Between other than two open cells they change nothing. None for none.

    Examples
    --------
    >>> from hybridnav.search.mesh import DetourSearch, MeshSearch, build_mesh
    >>> free = np.ones((3, 5), dtype=bool)
    >>> opened, closed = MeshSearch(build_mesh(free)), np.array([2, 7])
    >>> detour = DetourSearch(opened, free, closed)
    >>> detour.search.path(((0, 0), (0, 4)), ((0.5, 0.5), (0.5, 4.5))).positions
    array([[0.5, 0.5],
           [2. , 2. ],
           [2. , 3. ],
           [0.5, 4.5]])
    >>> sides = np.array([[0, 2, 0, 1], [1, 2, 1, 1]])
    >>> search = DetourSearch(opened, free, closed[:0], sides=sides).search
    >>> search.path(((0, 0), (0, 4)), ((0.5, 0.5), (0.5, 4.5))).positions
    array([[0.5, 0.5],
           [2. , 2. ],
           [0.5, 4.5]])
    >>> search.path(((0, 4), (0, 0)), ((0.5, 4.5), (0.5, 0.5))).length_cells
    4.0
    """

    def __init__(
        self,
        opened: MeshSearch,
        free: BoolArray,
        closed: LongArray,
        scratch: Pool[BoolArray] | None = None,
        sides: IntArray | None = None,
    ) -> None:
        self._open, self._free = opened, free
        self._scratch = Pool(partial(np.copy, free)) if scratch is None else scratch
        self._closed = closed[free.ravel()[closed]]
        self._closure = MeshClosure(*kernels.closure_of(self._closed, free.shape[1]))
        self._search: MeshSearch | None = None
        self._slits, self._seams = None, None
        if sides is not None:
            with self.open_cells() as left:
                self._slits, self._seams = slits_of(left, sides)

    @contextmanager
    def open_cells(self) -> Iterator[BoolArray]:
        """Lend the free cells without the closed ones."""
        left = self._scratch.take()
        left.ravel()[self._closed] = False
        yield left
        left.ravel()[self._closed] = True
        self._scratch.give(left)

    @property
    def search(self) -> MeshSearch:
        """The search of the mesh that is cut."""
        # Without a lock: two threads may cut the same mesh, and an interrupt leaves no lock held.
        if self._search is None:
            with self.open_cells() as left:
                mesh = renew_mesh(self._open.mesh, left, self._closed, self._seams)
            if self._slits is None or self._seams is None:
                self._search = MeshSearch(mesh)
            else:
                self._search = directed_search(mesh, self._slits, self._seams.ends)
        return self._search

    @property
    def is_directed(self) -> bool:
        """Whether distances there and back may differ."""
        return self._slits is not None

    def is_met_by(self, path: MeshPath) -> bool:
        """Return whether a shortest path between open cells is illegal with these cells closed, and
        sides directed.

        The result is also True if the path alone does not decide: if an end or a bend of it is a
        corner of a closed cell. The same holds if it runs along directed sides, or ends at one.

        Parameters
        ----------
        path
            A path of the search with these cells open, between ends that stay open.
        """
        if path.positions is None:
            return False
        if self._slits is not None and slits.path_is_barred(self._slits, path.positions):
            return True
        return bool(kernels.path_crosses(self._closure, self._free, path.positions))

    def are_met_by(self, paths: MeshPaths) -> BoolArray:
        """Return which of many shortest paths are, or may be, illegal, bool (n,); see
        `is_met_by`."""
        along = paths.positions, paths.path_start
        met: BoolArray = kernels.paths_cross(self._closure, self._free, *along)
        return met if self._slits is None else met | slits.paths_are_barred(self._slits, *along)
