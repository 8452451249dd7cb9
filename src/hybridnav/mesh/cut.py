"""A convex mesh with closed cells cut out of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.mesh import _cut_kernels as kernels
from hybridnav.mesh._block_kernels import blocks_of
from hybridnav.mesh._corner_kernels import MANY, NO_CORNER
from hybridnav.mesh._merge_kernels import are_free
from hybridnav.mesh.build import ConvexMesh, triangulate
from hybridnav.mesh.merge import merge_triangles, select_triangles

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, ByteArray, IntArray, LongArray


def cut_mesh(mesh: ConvexMesh, free: BoolArray, closed: LongArray) -> ConvexMesh:
    """Cut closed cells out of a mesh.

    The polygons that share a point with a closed cell are triangulated and merged again; all others
    stay, so that the work grows with the closed area. Only the blocks are always found again.

    Parameters
    ----------
    mesh
        The mesh of the map's free space.
    free
        bool (rows, cols), the free cells without the closed ones.
    closed
        int64 (m,), flat cells that are closed.

    Returns
    -------
    ConvexMesh
        The polygons that were cut stay as walled-in ones, with -1 as their `component`; those in
        their place come last. `polygon_at` is that of `mesh`.

    Examples
    --------
    >>> from hybridnav.mesh import build_mesh, cut_mesh
    >>> free = np.ones((3, 4), dtype=bool)
    >>> mesh = build_mesh(free)
    >>> cut_mesh(mesh, free, np.array([5])).n_polygons
    2
    """
    closed = closed[mesh.polygon_at.ravel()[closed] >= 0]
    if not len(closed):
        return mesh
    sides = mesh.first, mesh.begins, mesh.twins, mesh.polygon_of
    is_cut, cut = kernels.touched_polygons(mesh.corners, sides, mesh.polygon_at, closed)
    hole = _Hole(cut, kernels.rim_of(sides, is_cut, cut))
    slots = np.concatenate([np.arange(*mesh.first[number : number + 2]) for number in cut])
    vertices = _vertices_of(mesh, slots, free, closed)
    anew = _polygons_in(mesh, hole, vertices, free, closed)
    polygons = _with_hole_filled(mesh, hole, slots, anew)
    blocks = blocks_of(polygons[0], *polygons[2:])
    blocks[3][cut] = -1  # without a component
    arrays = (vertices.corners, vertices.kinds, *polygons, mesh.polygon_at, *blocks)
    for array in arrays:
        array.flags.writeable = False
    return ConvexMesh(*arrays)


@dataclass(frozen=True, eq=False)
class _Hole:
    """Polygons that are removed, and their slots round the hole that remains."""

    polygons: IntArray
    rim: LongArray


@dataclass(frozen=True, eq=False)
class _Vertices:
    """Vertices of the polygons in a hole, and all corners of the mesh with their kinds, new ones
    last.

    The vertices are flat lattice points, sorted, with their corners.
    """

    points: LongArray
    number_of: IntArray
    corners: IntArray
    kinds: ByteArray


def _vertices_of(
    mesh: ConvexMesh, slots: LongArray, free: BoolArray, closed: LongArray
) -> _Vertices:
    """Return the corners of the removed polygons, and the points at which walls turn now."""
    wide = free.shape[1] + 1
    old = np.unique(mesh.begins[slots])
    known = mesh.corners[old] @ np.array([wide, 1], dtype=np.int64)
    order = np.argsort(known)
    old, known = old[order], known[order]
    at, kinds_at = kernels.corners_of_cells(free, closed)
    made = np.setdiff1d(at[kinds_at != NO_CORNER], known)
    points = np.union1d(known, made)
    number_of = np.empty(len(points), np.int32)
    number_of[np.searchsorted(points, known)] = old
    number_of[np.searchsorted(points, made)] = len(mesh.corners) + np.arange(len(made))
    corners = np.concatenate([mesh.corners, np.stack(np.divmod(made, wide), axis=1)])
    kinds = np.concatenate([mesh.kinds, np.full(len(made), MANY, np.uint8)])
    is_one = np.isin(at, points)
    kinds[number_of[np.searchsorted(points, at[is_one])]] = np.minimum(kinds_at[is_one], MANY)
    return _Vertices(points, number_of, corners.astype(np.int32), kinds)


def _polygons_in(
    mesh: ConvexMesh, hole: _Hole, vertices: _Vertices, free: BoolArray, closed: LongArray
) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Fill a hole; return first slots, corners, twins and polygons of slots of the new polygons."""
    sides = mesh.first, mesh.begins, mesh.twins, mesh.polygon_of
    wide = free.shape[1] + 1
    around = mesh.corners @ np.array([wide, 1], dtype=np.int64)
    rim = kernels.segments_of_rim(sides, hole.rim, around, vertices.points, wide)
    walls = np.concatenate([rim, kernels.walls_of_closed(free, closed, vertices.points)])
    local = vertices.corners[vertices.number_of]
    triangles, neighbours = triangulate(local, walls)
    kept = are_free(local, triangles, free)
    triples = local[triangles[kept]].sum(axis=1, dtype=np.int64)
    kept[kept] = kernels.are_inside(mesh.corners, mesh.first, mesh.begins, hole.polygons, triples)
    first, begins, twins, polygon_of = merge_triangles(
        local, *select_triangles(triangles, neighbours, kept)
    )
    return first, vertices.number_of[begins], twins, polygon_of


def _with_hole_filled(
    mesh: ConvexMesh,
    hole: _Hole,
    slots: LongArray,
    anew: tuple[IntArray, IntArray, IntArray, IntArray],
) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Return the polygons of a mesh, those in a hole last; the removed ones are walled in."""
    first, begins, twins, polygon_of = anew
    n_slots = len(mesh.begins)
    all_twins = np.concatenate([mesh.twins, np.where(twins >= 0, twins + n_slots, -1)])
    all_twins[slots] = -1
    doors = hole.rim[mesh.twins[hole.rim] >= 0]
    behind, before = _joined(mesh, doors, (first, begins, twins))
    all_twins[behind], all_twins[n_slots + before] = n_slots + before, behind
    return (
        np.concatenate([mesh.first, n_slots + first[1:]]),
        np.concatenate([mesh.begins, begins]),
        all_twins.astype(np.int32),
        np.concatenate([mesh.polygon_of, mesh.n_polygons + polygon_of]).astype(np.int32),
    )


def _joined(
    mesh: ConvexMesh, doors: LongArray, anew: tuple[IntArray, IntArray, IntArray]
) -> tuple[IntArray, LongArray]:
    """Return the slots of the rest of a mesh, and the slots of new polygons that replace their
    twins."""
    first, begins, twins = anew
    after = np.arange(1, len(begins) + 1)
    after[first[1:] - 1] = first[:-1]
    rim = np.flatnonzero(twins < 0)
    n = np.int64(len(mesh.corners) + len(begins))
    keys = begins[rim] * n + begins[after[rim]]
    # The slot on the far side of a door runs the other way.
    beyond = mesh.twins[doors]
    wanted = mesh.finishes[beyond] * n + mesh.begins[beyond]
    order = np.argsort(keys)
    place = np.searchsorted(keys, wanted, sorter=order)
    return beyond, rim[order[place]].astype(np.int64)
