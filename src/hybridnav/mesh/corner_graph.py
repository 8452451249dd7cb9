"""The graph of the corners of a mesh at which paths bend, with landmarks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.mesh import _corner_graph_kernels as kernels
from hybridnav.search.contraction import have_reverses

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, IntArray, LongArray
    from hybridnav.mesh.build import ConvexMesh

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
