"""A convex mesh of changed cells: only the polygons beside them are cut anew. Public:
`DetourSearch`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.search.mesh.build import ConvexMesh, merge_triangles, select_triangles, triangulate
from hybridnav.search.mesh.kernels import corners as _corner_kernels
from hybridnav.search.mesh.kernels.blocks import are_free, blocks_of
from hybridnav.search.mesh.kernels.corners import MANY, NO_CORNER
from hybridnav.search.mesh.kernels.state import MeshBlocks

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray


def renew_mesh(mesh: ConvexMesh, free: BoolArray, changed: LongArray) -> ConvexMesh:
    """Return the mesh of free cells after some of them have changed.

    The polygons that share a point with a closed cell, or with a cell beside a freed one, are
    triangulated and merged again together with the freed cells. All others stay, with their
    numbers. Only the blocks are always found again.

    Parameters
    ----------
    mesh
        The mesh of the free cells before; unchanged.
    free
        bool (rows, cols), the free cells now.
    changed
        int64 (m,), flat cells that were free and are not, or are free and were not.

    Returns
    -------
    ConvexMesh
        The polygons that were removed stay as walled-in ones, with -1 as their `component`; those
        in their place come last. `polygon_at` is that of `mesh`: a search looks for cells of
        removed polygons, and for freed ones, among the last polygons. The mesh itself if nothing
        has changed.

    Examples
    --------
    >>> from hybridnav.search.mesh import build_mesh, renew_mesh
    >>> free = np.ones((3, 4), dtype=bool)
    >>> free[1, 2] = False
    >>> mesh = build_mesh(free)
    >>> free[1, 2] = True
    >>> renewed = renew_mesh(mesh, free, np.array([6]))
    >>> mesh.n_polygons, int((renewed.component >= 0).sum())
    (4, 1)
    """
    if not len(changed):
        return mesh
    freed, beside = _corner_kernels.freed_cells(free, changed)
    sides = mesh.first, mesh.begins, mesh.twins, mesh.polygon_of
    looked = np.concatenate([changed[~free.ravel()[changed]], beside])
    place = mesh.polygon_at, mesh.component
    is_cut, cut = _corner_kernels.touched_polygons(mesh.corners, sides, place, looked)
    hole = _Hole(cut, _corner_kernels.doors_of(sides, is_cut, cut), freed)
    slots = np.concatenate(
        [np.empty(0, np.int64), *(np.arange(*mesh.first[number : number + 2]) for number in cut)]
    )
    vertices = _vertices_of(mesh, slots, free, changed)
    anew = _polygons_in(mesh, hole, vertices, free)
    polygons = _with_hole_filled(mesh, hole, slots, anew)
    blocks = MeshBlocks(*chain(*blocks_of(polygons[0], *polygons[2:])))
    is_gone = np.concatenate([mesh.component < 0, np.zeros(len(anew[0]) - 1, np.bool_)])
    is_gone[cut] = True
    blocks.component[is_gone] = -1
    arrays = (vertices.corners, vertices.kinds, *polygons, mesh.polygon_at, *blocks)
    for array in arrays:
        array.flags.writeable = False
    return ConvexMesh(*arrays)


@dataclass(frozen=True, eq=False)
class _Hole:
    """Polygons that are removed, their slots that lead to others, and freed cells."""

    polygons: IntArray
    doors: LongArray
    freed: LongArray


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
    mesh: ConvexMesh, slots: LongArray, free: BoolArray, changed: LongArray
) -> _Vertices:
    """Return the corners in a hole: those at which walls turn now, as in a fresh mesh.

    Points at changed cells where walls have begun to run straight on are left out. No other polygon
    has them: all free cells round them belong to the hole.
    """
    wide = free.shape[1] + 1
    at, kinds_at = _corner_kernels.corners_of_cells(free, changed)
    turns = kinds_at != NO_CORNER
    old = np.unique(mesh.begins[slots])
    known = mesh.corners[old] @ np.array([wide, 1], dtype=np.int64)
    is_straight = np.isin(known, at[~turns])
    made = np.setdiff1d(at[turns], known)
    points = np.concatenate([known[~is_straight], made])
    number_of = np.concatenate([old[~is_straight], len(mesh.corners) + np.arange(len(made))])
    order = np.argsort(points, kind="stable")
    points, number_of = points[order], number_of[order].astype(np.int32)
    corners = np.concatenate([mesh.corners, np.stack(np.divmod(made, wide), 1).astype(np.int32)])
    kinds = np.concatenate([mesh.kinds, np.full(len(made), MANY, np.uint8)])
    kinds[old[is_straight]] = MANY
    kinds[number_of[np.searchsorted(points, at[turns])]] = kinds_at[turns]
    return _Vertices(points, number_of, corners, kinds)


def _polygons_in(
    mesh: ConvexMesh, hole: _Hole, vertices: _Vertices, free: BoolArray
) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Fill a hole; return first slots, corners, twins and polygons of slots of the new polygons."""
    ends = np.stack([mesh.begins[hole.doors], mesh.finishes[hole.doors]], axis=1)
    around = mesh.corners[ends] @ np.array([free.shape[1] + 1, 1], dtype=np.int64)
    doors = np.searchsorted(vertices.points, around)
    walls = np.concatenate([doors, _corner_kernels.walls_between(free, vertices.points)])
    local = vertices.corners[vertices.number_of]
    triangles, neighbours = triangulate(local, walls)
    kept = are_free(local, triangles, free)
    triples = local[triangles[kept]].sum(axis=1, dtype=np.int64)
    inside = _corner_kernels.are_inside(
        mesh.corners, mesh.first, mesh.begins, hole.polygons, triples
    )
    middles = triples // 3 @ np.array([free.shape[1], 1])
    kept[kept] = inside | np.isin(middles, hole.freed)
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
    behind, before = _joined(mesh, hole.doors, (first, begins, twins))
    all_twins[behind], all_twins[n_slots + before] = n_slots + before, behind
    return (
        np.concatenate([mesh.first, n_slots + first[1:]]),
        np.concatenate([mesh.begins, begins]),
        all_twins.astype(np.int32, copy=False),
        np.concatenate([mesh.polygon_of, mesh.n_polygons + polygon_of]).astype(
            np.int32, copy=False
        ),
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
    order = np.argsort(keys, kind="stable")
    place = np.searchsorted(keys, wanted, sorter=order)
    return beyond, rim[order[place]].astype(np.int64)
