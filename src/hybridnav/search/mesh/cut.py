"""A convex mesh of changed cells: only the polygons beside them are cut anew. Public:
`DetourSearch`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.search.mesh.build import ConvexMesh, merge_triangles, select_triangles, triangulate
from hybridnav.search.mesh.kernels import corners as _corner_kernels
from hybridnav.search.mesh.kernels.blocks import WALL, are_free, blocks_of
from hybridnav.search.mesh.kernels.corners import MANY, NO_CORNER
from hybridnav.search.mesh.kernels.state import MeshBlocks

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray


class Seams(NamedTuple):
    """Lines of sides between free cells, which are to be sides of polygons."""

    ends: LongArray
    """int64 (n, 2), flat lattice points at which each line ends; none passes that of another."""
    cells: LongArray
    """int64 (m,), flat cells beside them."""


def renew_mesh(
    mesh: ConvexMesh, free: BoolArray, changed: LongArray, seams: Seams | None = None
) -> ConvexMesh:
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
    seams
        Lines that are to be sides of polygons; None for none.

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
    if not len(changed) and seams is None:
        return mesh
    seams = seams or Seams(np.empty((0, 2), np.int64), changed[:0])
    freed, beside = _corner_kernels.freed_cells(free, changed)
    sides = mesh.first, mesh.begins, mesh.twins, mesh.polygon_of
    looked = np.concatenate([changed[~free.ravel()[changed]], beside, seams.cells])
    place = mesh.polygon_at, mesh.component
    is_cut, cut = _corner_kernels.touched_polygons(mesh.corners, sides, place, looked)
    hole = _Hole(cut, _corner_kernels.doors_of(sides, is_cut, cut), freed)
    slots = np.concatenate(
        [np.empty(0, np.int64), *(np.arange(*mesh.first[number : number + 2]) for number in cut)]
    )
    vertices = _vertices_of(mesh, slots, free, (changed, np.unique(seams.ends)))
    anew = _polygons_in(mesh, hole, vertices, free, seams.ends)
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
    mesh: ConvexMesh, slots: LongArray, free: BoolArray, changed: tuple[LongArray, LongArray]
) -> _Vertices:
    """Return the corners in a hole: those at which walls turn now, as in a fresh mesh, and those
    at which lines end; `changed`: flat cells, and these points.

    Points at changed cells where walls have begun to run straight on are left out. No other polygon
    has them: all free cells round them belong to the hole.
    """
    wide = free.shape[1] + 1
    at, kinds_at = _corner_kernels.corners_of_cells(free, changed[0])
    turns = kinds_at != NO_CORNER
    old = np.unique(mesh.begins[slots])
    known = mesh.corners[old] @ np.array([wide, 1], dtype=np.int64)
    is_straight = np.isin(known, np.setdiff1d(at[~turns], changed[1]))
    made = np.setdiff1d(np.concatenate([at[turns], changed[1]]), known)
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
    mesh: ConvexMesh, hole: _Hole, vertices: _Vertices, free: BoolArray, seams: LongArray
) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Fill a hole; return first slots, corners, twins and polygons of slots of the new polygons."""
    ends = np.stack([mesh.begins[hole.doors], mesh.finishes[hole.doors]], axis=1)
    around = mesh.corners[ends] @ np.array([free.shape[1] + 1, 1], dtype=np.int64)
    doors = np.searchsorted(vertices.points, around)
    seams = np.searchsorted(vertices.points, seams)
    walls = np.concatenate([doors, _corner_kernels.walls_between(free, vertices.points), seams])
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
        local, *_parted(seams, *select_triangles(triangles, neighbours, kept))
    )
    if len(seams):
        finishes = np.roll(begins, -1)
        finishes[first[1:] - 1] = begins[first[:-1]]
        one, other = (_slots_from(begins, finishes, way) for way in (seams, seams[:, ::-1]))
        twins[one], twins[other] = other, one
    return first, vertices.number_of[begins], twins, polygon_of


def _parted(seams: LongArray, triangles: IntArray, across: IntArray) -> tuple[IntArray, IntArray]:
    """Return triangles and those across their sides, as if seams were walls."""
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)]), axis=0).astype(np.int64)
    low, high = np.sort(seams, axis=1).T
    wide = triangles.max(initial=0) + 1
    is_seam = np.isin(ends[0] * wide + ends[1], low * wide + high)
    return triangles, np.where(is_seam, WALL, across).astype(np.int32)


def _slots_from(begins: IntArray, finishes: IntArray, sides: LongArray) -> LongArray:
    """Return the slots from some corners to others, (n, 2); each exists."""
    wide = np.int64(begins.max(initial=0)) + 1
    keys = begins * wide + finishes
    order = np.argsort(keys, kind="stable")
    wanted = np.searchsorted(keys, sides @ np.array([wide, 1]), sorter=order)
    found: LongArray = order[wanted]
    return found


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
