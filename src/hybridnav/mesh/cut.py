"""A convex mesh with closed cells cut out of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.mesh import _cut_kernels as kernels
from hybridnav.mesh._block_kernels import blocks_of
from hybridnav.mesh._corner_kernels import MANY, NO_CORNER
from hybridnav.mesh._merge_kernels import are_free, merge_triangles, select_triangles
from hybridnav.mesh.build import ConvexMesh, triangulate

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, IntArray, LongArray


def cut_mesh(mesh: ConvexMesh, free: BoolArray, closed: LongArray) -> ConvexMesh:
    """Cut closed cells out of a mesh.

    The polygons that share a point with a closed cell are triangulated and merged anew; all others
    stay, so that the work grows with what is closed, but for the blocks, which are found anew.

    Parameters
    ----------
    mesh
        Of the map's free space.
    free
        bool (rows, cols), the free cells without the closed ones.
    closed
        int64 (m,), flat cells that are closed.

    Returns
    -------
    ConvexMesh
        The polygons that were cut are still there, walled in, with -1 as their `component`; those
        in their place come last. `polygon_at` is that of `mesh`.
    """
    closed = closed[mesh.polygon_at.ravel()[closed] >= 0]
    if not len(closed):
        return mesh
    sides = mesh.first, mesh.begins, mesh.twins, mesh.polygon_of
    is_cut, cut = kernels.touched_polygons(mesh.corners, sides, mesh.polygon_at, closed)
    rim = kernels.rim_of(sides, is_cut, cut)
    slots = np.concatenate([np.arange(*mesh.first[number : number + 2]) for number in cut])
    wide = free.shape[1] + 1
    point_of = mesh.corners[:, 0].astype(np.int64) * wide + mesh.corners[:, 1]

    # Vertices: the corners of the polygons, and where walls turn now.
    old = np.unique(mesh.begins[slots])
    old = old[np.argsort(point_of[old])]
    at, kinds_at = kernels.corners_of_cells(free, closed)
    turning = at[kinds_at != NO_CORNER]
    made = np.setdiff1d(turning, point_of[old])
    points = np.union1d(point_of[old], made)
    number_of = np.empty(len(points), np.int32)
    number_of[np.searchsorted(points, point_of[old])] = old
    number_of[np.searchsorted(points, made)] = len(mesh.corners) + np.arange(len(made))
    corners = np.concatenate([mesh.corners, np.stack(np.divmod(made, wide), axis=1)])
    corners = corners.astype(np.int32)
    kinds = np.concatenate([mesh.kinds, np.full(len(made), MANY, np.uint8)])
    known = np.isin(at, points)
    kinds[number_of[np.searchsorted(points, at[known])]] = np.minimum(kinds_at[known], MANY)

    local = corners[number_of]
    walls = np.concatenate(
        [
            kernels.pieces_of_rim(sides, rim, point_of, points, wide),
            kernels.walls_of_closed(free, closed, points),
        ]
    )

    vertices, neighbours = triangulate(local, walls)
    kept = are_free(local, vertices, free)
    triples = local[vertices[kept]].sum(axis=1, dtype=np.int64)
    kept[kept] = kernels.are_inside(mesh.corners, mesh.first, mesh.begins, cut, triples)
    anew = merge_triangles(local, *select_triangles(vertices, neighbours, kept))
    first, begins, twins, polygon_of = anew[0], number_of[anew[1]], anew[2], anew[3]
    count, n_slots = mesh.n_polygons, len(mesh.begins)
    all_twins = np.concatenate([mesh.twins, np.where(twins >= 0, twins + n_slots, -1)])
    all_twins[slots] = -1
    joined = _joined(mesh, rim[mesh.twins[rim] >= 0], (first, begins, twins))
    all_twins[joined[0]], all_twins[n_slots + joined[1]] = n_slots + joined[1], joined[0]
    polygons = (
        np.concatenate([mesh.first, n_slots + first[1:]]),
        np.concatenate([mesh.begins, begins]),
        all_twins.astype(np.int32),
        np.concatenate([mesh.polygon_of, count + polygon_of]).astype(np.int32),
    )
    blocks = blocks_of(polygons[0], *polygons[2:])
    blocks[3][cut] = -1  # of no component
    arrays = (corners, kinds, *polygons, mesh.polygon_at, *blocks)
    for array in arrays:
        array.flags.writeable = False
    return ConvexMesh(*arrays)


def _joined(
    mesh: ConvexMesh, doors: LongArray, anew: tuple[IntArray, IntArray, IntArray]
) -> tuple[IntArray, LongArray]:
    """Slots of the rest of a mesh, and the slots in new polygons that take their twins' place."""
    first, begins, twins = anew
    after = np.arange(1, len(begins) + 1)
    after[first[1:] - 1] = first[:-1]
    rim = np.flatnonzero(twins < 0)
    n = np.int64(len(mesh.corners) + len(begins))
    keys = begins[rim] * n + begins[after[rim]]
    # The slot on the far side of a door runs the other way.
    beyond = mesh.twins[doors]
    wanted = mesh.stops[beyond] * n + mesh.begins[beyond]
    order = np.argsort(keys)
    place = np.searchsorted(keys, wanted, sorter=order)
    return beyond, rim[order[place]].astype(np.int64)
