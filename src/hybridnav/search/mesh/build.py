"""The convex mesh of free space: polygons, their neighbours, and the blocks that they form; and the
graph of its corners at which paths bend, with landmarks.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np
import pythoncdt

from hybridnav._base.copies import copies_alike
from hybridnav.search.contraction import contract, have_reverses
from hybridnav.search.mesh.kernels import corner_graph as kernels
from hybridnav.search.mesh.kernels.blocks import (
    WALL,
    are_free,
    blocks_of,
    merge_across,
    polygons_of_cells,
    sides_of_triangles,
)
from hybridnav.search.mesh.kernels.corners import MANY, NO_CORNER, kinds_of, walls_of
from hybridnav.search.mesh.kernels.state import Corners, Hierarchy, Mesh, MeshBlocks
from hybridnav.search.mesh.kernels.views import arcs_of, classes_that_follow

if TYPE_CHECKING:
    from hybridnav._base.typing import (
        AnyArray,
        BoolArray,
        ByteArray,
        FloatArray,
        IntArray,
        LongArray,
    )

_BLOCK_CELLS = 64
"""Side of the squares by which corners and polygons are ordered."""


@copies_alike
@dataclass(frozen=True, eq=False)
class ConvexMesh:
    """Convex polygons that cover free space, without a gap and without overlap.

    Free space is the union of the closed squares of the free cells, without the passages between
    two blocked cells that meet at a corner. A *slot* is a side of a polygon, counter-clockwise with
    columns to the right and rows upwards.
    """

    corners: IntArray
    """int32 (n, 2), (row, col) in grid units: every vertex is a lattice corner of free space."""
    kinds: ByteArray
    """uint8 (n,), the one blocked cell of four at a corner: bit 1 for the upper row, bit 0 for the
    upper column. 4 at corners that no path bends round."""
    first: IntArray
    """int32 (p + 1,), polygon i has the slots `first[i]` to `first[i + 1]`."""
    begins: IntArray
    """int32 (s,), the corner at which each side begins."""
    twins: IntArray
    """int32 (s,), the same side seen from the polygon behind it, -1 for a wall."""
    polygon_of: IntArray
    """int32 (s,), the polygon of each slot."""
    polygon_at: IntArray
    """int32 (rows, cols), a polygon with the centre of each free cell, -1 elsewhere."""
    block_of: IntArray
    """int32 (s,), the block of the graph of polygons that each side belongs to, -1 for a wall."""
    block_head: IntArray
    """int32 (b,), the polygon that joins each block to its parent."""
    block_up: IntArray
    """int32 (p,), the block that joins each polygon to its parent, -1 for none."""
    component: IntArray
    """int32 (p,), the connected part of free space that each polygon belongs to."""
    depth: IntArray
    """int32 (p,), blocks between each polygon and the first one of its component."""

    @property
    def finishes(self) -> IntArray:
        """int32 (s,), the corner at which each side ends."""
        finishes: IntArray = np.roll(self.begins, -1)
        finishes[self.first[1:] - 1] = self.begins[self.first[:-1]]
        return finishes

    @property
    def arrays(self) -> Mesh:
        """The mesh as kernels take it."""
        rows, cols = np.ascontiguousarray(self.corners.T, dtype=np.float64)
        sides = self.begins, self.finishes, self.twins, self.polygon_of
        return Mesh(cols, rows, self.kinds, self.first, *sides, self.component, self.twins)

    @property
    def blocks(self) -> MeshBlocks:
        """The blocks as kernels take them."""
        up = self.block_up
        return MeshBlocks(self.block_of, self.block_head, up, self.component, self.depth)

    @property
    def is_convex(self) -> BoolArray:
        """bool (n,), whether paths bend round each corner."""
        return self.kinds < MANY

    @property
    def n_polygons(self) -> int:
        """Number of polygons."""
        return len(self.first) - 1


def build_mesh(free: BoolArray) -> ConvexMesh:
    """Build the convex mesh of free cells.

    The mesh is the constrained Delaunay triangulation of the corners and walls, with triangles
    merged while their union is convex.

    Parameters
    ----------
    free
        bool (rows, cols); cells outside are blocked.

    Returns
    -------
    ConvexMesh
        Without polygons if no cell is free. Work and memory are linear in cells, except for the
        triangulation's n log n in corners.

    Notes
    -----
    S. Hertel, K. Mehlhorn: Fast triangulation of simple polygons, 1983 (merging). J. Hopcroft,
    R. Tarjan: Algorithm 447, efficient algorithms for graph manipulation, 1973 (blocks).

    Examples
    --------
    >>> from hybridnav.search.mesh import build_mesh
    >>> free = np.ones((4, 6), dtype=bool)
    >>> free[1:3, 2:4] = False
    >>> build_mesh(free).n_polygons
    4
    """
    cells = np.ascontiguousarray(free)
    kinds = kinds_of(cells)
    kind_of = kinds[kinds != NO_CORNER]
    corners, walls = walls_of(cells, kinds, len(kind_of))
    # Neighbours on the map are near in memory too: on large maps, queries take 25 % less time.
    order = np.lexsort(tuple((corners // _BLOCK_CELLS).T[::-1]))
    corners, kind_of = corners[order], kind_of[order]
    walls = np.argsort(order, kind="stable").astype(np.int32)[walls]
    vertices, neighbours = triangulate(corners, walls)
    kept = are_free(corners, vertices, cells)
    polygons = merge_triangles(corners, *select_triangles(vertices, neighbours, kept))
    polygon_at = polygons_of_cells(*polygons[:2], corners, cells.shape)
    blocks = chain(*blocks_of(polygons[0], *polygons[2:]))
    arrays = (corners, kind_of, *polygons, polygon_at, *blocks)
    for array in arrays:
        array.flags.writeable = False
    return ConvexMesh(*arrays)


def count_corners(free: BoolArray) -> int:
    """Return how many corners the mesh of free cells, bool (rows, cols), will have."""
    return int(np.count_nonzero(kinds_of(np.ascontiguousarray(free)) != NO_CORNER))


def triangulate(corners: IntArray, walls: IntArray) -> tuple[AnyArray, AnyArray]:
    """Triangulate corners so that walls are sides of triangles.

    `corners`: int32 (n, 2), (row, col); `walls`: int (m, 2), pairs of corners; none passes a third.
    Result: (t, 3) corners counter-clockwise; (t, 3) the triangle across the side from corner k to k
    + 1, at least t for none.
    """
    if len(corners) == 0:
        return np.empty((0, 3), np.uint32), np.empty((0, 3), np.uint32)
    made = pythoncdt.Triangulation(
        pythoncdt.VertexInsertionOrder.AUTO, pythoncdt.IntersectingConstraintEdges.DONT_CHECK, 0.0
    )
    made.insert_vertices(corners[:, ::-1].astype(np.float64))  # type: ignore[call-overload]
    made.insert_edges(walls.astype(np.uint32))  # type: ignore[call-overload]
    made.erase_super_triangle()
    found = made.triangles_array()
    return found["vertices"], found["neighbors"]


# Triangles merged into convex polygons.

# Sort with numpy: a sort in a kernel takes more than a second to compile.


def select_triangles(
    vertices: AnyArray, neighbours: AnyArray, is_kept: BoolArray
) -> tuple[IntArray, IntArray]:
    """Select some triangles, in the order of their first corners.

    `vertices`, `neighbours`: (m, 3) corners of all triangles, and the triangle across the side from
    corner k to k + 1, at least m for none; `is_kept`: bool (m,); a wall separates kept triangles
    from the others. Returns int32 (f, 3) corners, int32 (f, 3) the triangle across each side,
    `WALL` for none.
    """
    kept = np.flatnonzero(is_kept)
    kept = kept[np.argsort(vertices[kept, 0], kind="stable")]
    number = np.full(len(vertices) + 1, WALL, np.int32)
    number[kept] = np.arange(len(kept))
    across: IntArray = number[np.minimum(neighbours[kept], len(vertices))]
    return vertices[kept].astype(np.int32), across


def merge_triangles(
    corners: IntArray, triangles: IntArray, neighbours: IntArray
) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Merge triangles into convex polygons, longest common sides first.

    Two parts merge as long as their union is convex (S. Hertel, K. Mehlhorn, 1983).

    `corners`: int32 (n, 2); `triangles`: int32 (n, 3), corners counter-clockwise; `neighbours`:
    int32 (n, 3), the triangle across the side from corner k to k + 1, -1 for a wall. Returns int32
    (p + 1,) first slot of each polygon; int32 (s,) corner at which each slot's side begins; int32
    (s,) twin slot, -1 for a wall; int32 (s,) polygon of each slot.
    """
    *sides, squared = sides_of_triangles(corners, triangles, neighbours)
    common = np.flatnonzero(squared)
    order = common[np.argsort(-squared[common], kind="stable")]
    return merge_across(corners, triangles.ravel(), tuple(sides), order)


# --- the graph of its corners ---------------------------------------------------------------------

MANY_CORNERS = 100_000
"""Least number of corners for which a thread builds their graph: queries do not wait for it."""
_LANDMARKS, _MORE_LANDMARKS = 8, 32
"""Landmarks of a map, and those of a map with many corners. On 49 offices side by side, queries
expand 40 % fewer corners with 32 of them than with 16, in 20 % less time."""
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
    """float64 (n, landmarks), distances in free space in cells, infinite if there is no path."""

    @property
    def arrays(self) -> Corners:
        """The graph as kernels take it."""
        return Corners(self.first, self.heads, self.landmark_distances)


def find_edges(mesh: Mesh) -> tuple[LongArray, IntArray] | None:
    """Find the edges between the corners of a mesh, `ConvexMesh.arrays`; see `CornerGraph`.

    None if there are too many, as on wide open maps, or if one has no reverse: searches rely on
    both.

    Notes
    -----
    S. Oh, H. W. Leong: Edge N-level sparse visibility graphs: fast optimal any-angle pathfinding
    using hierarchical taut paths, 2017.
    """
    first, heads = kernels.edges_of(mesh, _MOST_EDGES * len(mesh.kinds))
    if first[-1] < 0 or not have_reverses(first[::2], heads):
        return None
    for array in (first, heads):
        array.flags.writeable = False
    return first, heads


def add_landmarks(mesh: Mesh, edges: tuple[LongArray, IntArray]) -> CornerGraph:
    """Add landmarks to the edges between the corners of a mesh, results of `find_edges`.

    Notes
    -----
    A. V. Goldberg, C. Harrelson: Computing the shortest path: A* search meets graph theory, 2005
    (each landmark is the corner farthest from those before).
    """
    (first, heads), n = edges, len(mesh.kinds)
    degrees = first[2::2] - first[:-2:2]
    number = _LANDMARKS if n < MANY_CORNERS else _MORE_LANDMARKS
    table = np.empty((n, number if len(heads) else 0))
    if len(heads):
        # In the part of the map that has the most edges.
        part = np.zeros(n, dtype=np.int32)
        of_slot = mesh.component[mesh.polygon_of]
        part[mesh.begins[of_slot >= 0]] = of_slot[of_slot >= 0]
        inside = part == np.bincount(part, weights=degrees).argmax()
        source = int(np.where(inside, degrees, -1).argmax())
        kernels.landmarks_of(mesh, (first, heads), source, table)
    table.flags.writeable = False
    return CornerGraph(first, heads, table)


# The contracted graph of the corners of a mesh, for queries on large maps.

_SETTLED = 1
"""Most corners that a witness search settles, so that it sees single arcs. With 10 there are up to
2 % fewer shortcuts, in five times the time."""
_MOST_LOOKED, _MORE_LOOKED = 100, 400
"""Arcs per free cell that the contraction may examine before it is given up, and those on a map
with many corners: some 0.7 microseconds a cell for 100. Buildings need 20 to 100; side by side they
need more, some 85 on 16 million cells and 115 on 64; raw scans full of speckle would need 1,000."""
_LOOKED_AN_EDGE = 110
"""Expected number of arcs to examine per edge of the graph. If that exceeds the limit, contraction
does not begin: on five of the six real maps on which it would be given up."""


@copies_alike
@dataclass(frozen=True, eq=False)
class CornerHierarchy:
    """Corners at which paths bend, and arcs from each to corners that were contracted after it.

    A shortest path climbs from the corners that its start sees, and from corners that its goal
    sees, up to one where both meet.
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
    def arrays(self) -> Hierarchy:
        """The hierarchy as kernels take it."""
        return Hierarchy(self.first, self.arcs, self.middles, self.follow)


def contract_corners(
    mesh: Mesh, edges: tuple[LongArray, IntArray], n_free: int
) -> CornerHierarchy | None:
    """Contract the graph of the corners of a mesh, results of `find_edges`; so many cells are free.

    None if contraction takes too long because corners see too many others.

    Notes
    -----
    R. Geisberger, P. Sanders, D. Schultes, D. Delling: Contraction hierarchies: faster and simpler
    hierarchical routing in road networks, 2008. A shortcut is added only if a path may bend at both
    its corners; otherwise there are five times as many, in 60 times the time.
    """
    if _LOOKED_AN_EDGE * len(edges[1]) > _MOST_LOOKED * n_free:
        return None
    most = n_free * (_MOST_LOOKED if len(mesh.kinds) < MANY_CORNERS else _MORE_LOOKED)
    first, arcs = arcs_of(mesh, *edges)
    follow = classes_that_follow()
    found = contract(mesh.kinds, first, arcs, follow, (_SETTLED, most), np.empty(0, np.bool_))
    if len(arcs) and not len(found[1]):
        return None
    made = found[0], found[1], found[2], follow
    for array in made:
        array.flags.writeable = False
    return CornerHierarchy(*made)
