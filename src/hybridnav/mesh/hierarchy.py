"""The contracted graph of the corners of a mesh, for queries on large maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.mesh._hierarchy_kernels import arcs_of, classes_that_follow
from hybridnav.search.contraction import contract

if TYPE_CHECKING:
    from hybridnav._typing import IntArray, LongArray
    from hybridnav.mesh.build import ConvexMesh

_SETTLED = 1
"""Most corners that a witness search settles, so that it sees single arcs. With 10 there are up to
2 % fewer shortcuts, in five times the time."""
_MOST_LOOKED = 100
"""Arcs per free cell that the contraction may examine before it is given up: some 0.7 microseconds
a cell. Buildings need 20 to 100; raw scans full of speckle would need 1,000."""
_LOOKED_AN_EDGE = 110
"""Expected number of arcs to examine per edge of the graph. If that exceeds the limit, contraction
does not begin: on five of the six real maps on which it would be given up."""


@copies_alike
@dataclass(frozen=True, eq=False)
class CornerHierarchy:
    """Corners at which paths bend, and arcs from each to those that were contracted after it.

    A shortest path climbs from the corners that its start sees, and from those that its goal sees,
    up to one where both meet.
    """

    first: IntArray
    """int32 (n + 1,), offsets of the arcs of each corner."""
    arcs: LongArray
    """int64 (u, 2), cost in 2^-34 of a cell; head and classes, see `pack` in the kernels."""
    middles: LongArray
    """int64 (u,), the corner that a shortcut leads past and two of its arcs, see `contract` in the
    kernels; -1 for an edge of the graph of corners."""
    follow: LongArray
    """int64 (4, 64), the classes that may follow each class on a shortest path."""

    @property
    def arrays(self) -> tuple[IntArray, LongArray, LongArray, LongArray]:
        """The arrays in the order of the kernels."""
        return self.first, self.arcs, self.middles, self.follow


def contract_corners(
    mesh: ConvexMesh, arrays: tuple[object, ...], edges: tuple[LongArray, IntArray]
) -> CornerHierarchy | None:
    """Contract the graph of the corners of a mesh.

    Parameters
    ----------
    mesh
        The mesh.
    arrays
        Arrays for the kernel `successors`.
    edges
        Edges of the kernel `edges_of`.

    Returns
    -------
    CornerHierarchy or None
        None if contraction takes too long because corners see too many others.

    Notes
    -----
    R. Geisberger, P. Sanders, D. Schultes, D. Delling: Contraction hierarchies: faster and simpler
    hierarchical routing in road networks, 2008. A shortcut is added only if a path may bend at both
    its corners; otherwise there are five times as many, in 60 times the time.
    """
    most = _MOST_LOOKED * np.count_nonzero(mesh.polygon_at >= 0)
    if _LOOKED_AN_EDGE * len(edges[1]) > most:
        return None
    first, arcs = arcs_of(arrays, *edges)
    follow = classes_that_follow()
    found = contract(mesh.kinds, first, arcs, follow, (_SETTLED, most))
    if len(arcs) and not len(found[1]):
        return None
    kept = CornerHierarchy(found[0], found[1], found[2], follow)
    for array in kept.arrays:
        array.flags.writeable = False
    return kept
