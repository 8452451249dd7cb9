"""Triangles merged into convex polygons."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.mesh._merge_kernels import WALL, merge_across, sides_of_triangles

if TYPE_CHECKING:
    from hybridnav._typing import AnyArray, BoolArray, IntArray

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
