"""The convex mesh of free space: polygons, their neighbours, and the blocks that they form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pythoncdt

from hybridnav._base.copies import copies_alike
from hybridnav.search.mesh.kernels.blocks import (
    WALL,
    are_free,
    blocks_of,
    merge_across,
    polygons_of_cells,
    sides_of_triangles,
)
from hybridnav.search.mesh.kernels.corners import MANY, NO_CORNER, kinds_of, walls_of

if TYPE_CHECKING:
    from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, IntArray


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
    upper column; 4 at corners that no path bends round."""
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
    arrays = (corners, kind_of, *polygons, polygon_at, *blocks_of(polygons[0], *polygons[2:]))
    for array in arrays:
        array.flags.writeable = False
    return ConvexMesh(*arrays)


def triangulate(corners: IntArray, walls: IntArray) -> tuple[AnyArray, AnyArray]:
    """Triangulate corners so that walls are sides of triangles.

    Parameters
    ----------
    corners
        int32 (n, 2), (row, col).
    walls
        int (m, 2), pairs of corners; none passes a third.

    Returns
    -------
    tuple
        (t, 3) corners counter-clockwise; (t, 3) the triangle across the side from corner k to
        k + 1, at least t for none.
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

    Parameters
    ----------
    vertices, neighbours
        (m, 3) corners of all triangles, and the triangle across the side from corner k to k + 1, at
        least m for none.
    is_kept
        bool (m,); a wall separates kept triangles from the others.

    Returns
    -------
    tuple
        int32 (f, 3) corners, int32 (f, 3) the triangle across each side, `WALL` for none.
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

    Parameters
    ----------
    corners
        int32 (n, 2).
    triangles
        int32 (n, 3), corners counter-clockwise.
    neighbours
        int32 (n, 3), the triangle across the side from corner k to k + 1, -1 for a wall.

    Returns
    -------
    tuple
        int32 (p + 1,) first slot of each polygon; int32 (s,) corner at which each slot's side
        begins; int32 (s,) twin slot, -1 for a wall; int32 (s,) polygon of each slot.
    """
    *sides, squared = sides_of_triangles(corners, triangles, neighbours)
    common = np.flatnonzero(squared)
    order = common[np.argsort(-squared[common], kind="stable")]
    polygons: tuple[IntArray, IntArray, IntArray, IntArray] = merge_across(
        corners, triangles.ravel(), tuple(sides), order
    )
    return polygons
