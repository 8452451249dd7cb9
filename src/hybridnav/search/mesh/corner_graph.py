"""The graph of the corners of a mesh at which paths bend, with landmarks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav.search.contraction import contract, have_reverses
from hybridnav.search.mesh.kernels import polyanya as kernels
from hybridnav.search.mesh.kernels.hierarchy import arcs_of, classes_that_follow

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.search.mesh.build import ConvexMesh


_LANDMARKS, _MORE_LANDMARKS, _MANY_CORNERS = 8, 32, 200_000
"""Landmarks of a map, those of a map with many corners, and the least number of such corners. On 49
offices side by side, queries expand 40 % fewer corners with 32 of them than with 16, in 20 % less
time."""
_MOST_EDGES = 200
"""Mean number of edges a corner above which the graph is not worth its memory: real maps have 13 to
35."""


@copies_alike
@dataclass(frozen=True, eq=False)
class CornerGraph:
    """Corners that see each other, with segments at both of whose endpoints a path may bend.

    A shortest path bends at such corners alone, and every segment of it between two of them is an
    edge, or several on one line.
    """

    first: LongArray
    """int64 (2 n + 1,), the edges of corner i into one of the two quadrants beside its blocked cell
    are `first[2 i]` to `first[2 i + 1]`, those into the other `first[2 i + 1]` to
    `first[2 i + 2]`."""
    heads: IntArray
    """int32 (m,), the corner at which each edge ends; every edge occurs in both directions."""
    landmark_distances: FloatArray
    """float64 (n, landmarks), distances in the graph in cells, infinite if there is no path."""

    @property
    def arrays(self) -> tuple[LongArray, IntArray, FloatArray]:
        """The arrays in the order of the kernels."""
        return self.first, self.heads, self.landmark_distances


def find_edges(mesh: ConvexMesh, arrays: tuple[object, ...]) -> tuple[LongArray, IntArray] | None:
    """Find the edges between the corners of a mesh.

    Parameters
    ----------
    mesh
        The mesh.
    arrays
        Arrays for the kernel `successors`.

    Returns
    -------
    tuple or None
        See `CornerGraph`. None if there are too many edges, as on wide open maps, or if one has no
        reverse: searches rely on both.

    Notes
    -----
    S. Oh, H. W. Leong: Edge N-level sparse visibility graphs: fast optimal any-angle pathfinding
    using hierarchical taut paths, 2017.
    """
    first, heads = kernels.edges_of(arrays, mesh.component, _MOST_EDGES * len(mesh.corners))
    if first[-1] < 0 or not have_reverses(first[::2], heads):
        return None
    for array in (first, heads):
        array.flags.writeable = False
    return first, heads


def add_landmarks(
    mesh: ConvexMesh, arrays: tuple[object, ...], edges: tuple[LongArray, IntArray]
) -> CornerGraph:
    """Add landmarks to the edges between the corners of a mesh.

    Parameters
    ----------
    mesh
        The mesh.
    arrays
        Arrays for the kernel `successors`.
    edges
        Edges of `find_edges`.

    Notes
    -----
    A. V. Goldberg, C. Harrelson: Computing the shortest path: A* search meets graph theory, 2005
    (each landmark is the corner farthest from those before).
    """
    (first, heads), n = edges, len(mesh.corners)
    degrees = first[2::2] - first[:-2:2]
    number = _LANDMARKS if n < _MANY_CORNERS else _MORE_LANDMARKS
    table = np.empty((n, number if len(heads) else 0))
    if len(heads):
        # In the part of the map that has the most edges.
        part = np.zeros(n, dtype=np.int32)
        of_slot = mesh.component[mesh.polygon_of]
        part[mesh.begins[of_slot >= 0]] = of_slot[of_slot >= 0]
        inside = part == np.bincount(part, weights=degrees).argmax()
        source = int(np.where(inside, degrees, -1).argmax())
        kernels.landmarks_of(arrays[:2], (first, heads), source, table)
    table.flags.writeable = False
    return CornerGraph(first, heads, table)


# The contracted graph of the corners of a mesh, for queries on large maps.

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
