"""Cracks, the sides between two cells, as base edges: 2 * flat cell, + 1 where it leads north."""

from __future__ import annotations

import numpy as np

from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray
from hybridnav.pyramid.kernels.fields import crack_classes, edges_to_rim

__all__ = [
    "boundaries_of",
    "cell_pairs",
    "endpoints_of",
    "find_cracks",
    "line_of_loop",
    "middle_sides",
    "middles_of",
    "sides_of",
]


def find_cracks(field_of: IntArray, rows: int, cols: int) -> tuple[LongArray, LongArray]:
    """Return the base edges between cells of different fields, ascending, and the class of each.

    Two cracks belong to one class when they lie in the same full 2x2 block that holds exactly two
    cracks; the class is the position of one of its cracks.
    """
    fields = field_of.reshape(rows, cols)
    is_crack = np.zeros((rows, cols, 2), np.bool_)
    is_crack[:, :-1, 0] = fields[:, :-1] != fields[:, 1:]
    is_crack[:-1, :, 1] = fields[:-1] != fields[1:]
    is_crack[fields < 0] = False
    is_crack[:, :-1, 0] &= fields[:, 1:] >= 0
    is_crack[:-1, :, 1] &= fields[1:] >= 0
    cracks = np.flatnonzero(is_crack)
    return cracks, crack_classes(cracks, field_of, rows, cols)


def endpoints_of(base_edges: LongArray, cols: int) -> tuple[LongArray, LongArray]:
    """Return the two flat cells of each base edge, the lower one first."""
    first = base_edges >> 1
    return first, first + np.where(base_edges & 1, cols, 1)


def cell_pairs(base_edges: LongArray, cols: int) -> LongArray:
    """Return the two cells of each base edge, int64 (n, 2, 2), (row, col)."""
    flat = np.stack(endpoints_of(base_edges, cols), axis=1)
    return np.stack(divmod(flat, cols), axis=-1)


def sides_of(base_edges: LongArray, cols: int) -> FloatArray:
    """Return the middle of the side that each base edge crosses, float64 (n, 2), in cells.

    The centre of cell (0, 0) is (0.5, 0.5).
    """
    return cell_pairs(base_edges, cols).mean(axis=1) + 0.5


def middle_sides(sides: FloatArray, boundary: LongArray, count: int) -> LongArray:
    """Return the side in the middle of each boundary.

    `sides`: float64 (n, 2), middles of sides; `boundary`: int64 (n,), the boundary of each side;
    every one from 0 to count - 1 has a side; `count`: number of boundaries. Returns int64 (count,),
    the side nearest the mean of all sides of its boundary, so that its middle lies on the boundary;
    ties go to the first side.
    """
    sizes = np.bincount(boundary, minlength=count)
    sums = [np.bincount(boundary, weights=w, minlength=count) for w in sides.T]
    mean = np.stack(sums, axis=1) / sizes[:, None]
    squared = ((sides - mean[boundary]) ** 2).sum(axis=1)
    order = np.lexsort((squared, boundary))
    return order[np.cumsum(sizes) - sizes]


def middles_of(sides: FloatArray, boundary: LongArray, count: int) -> FloatArray:
    """Return the middle of the side that `middle_sides` returns, float64 (count, 2)."""
    return sides[middle_sides(sides, boundary, count)]


def line_of_loop(
    base_edge: int, level: tuple[IntArray, ByteArray, int, int], came: ByteArray
) -> LongArray:
    """Return the base edges of the line of a self-loop's dual edge through its field.

    The line leads to the face on either side.

    `base_edge`: the base edge that represents the self-loop; `level`: vertex of each flat cell,
    `edge_end` of the record, the index of the level, and the columns of the grid; `came`: scratch,
    uint8 (rows * cols + cols,), zeros.
    """
    field_of, _, _, cols = level
    cell = base_edge >> 1
    faces = cell, cell - (1 if base_edge & 1 else cols)
    parts = [edges_to_rim(face, field_of[cell], *level, came) for face in faces]
    return np.concatenate([*parts, [base_edge]])


def boundaries_of(
    base_edges: LongArray, is_self_loop: BoolArray, level: tuple[IntArray, ByteArray, int, int]
) -> tuple[LongArray, LongArray]:
    """Return the base edges of all boundaries of a level, and the arc of each, sorted by arc.

    `base_edges`: int64 (n_arcs,), the base edge that represents each arc; `is_self_loop`: bool
    (n_arcs,); `level`: see `line_of_loop`.
    """
    field_of, _, _, cols = level
    cracks, classes = find_cracks(field_of, len(field_of) // cols, cols)
    arc_of_class = np.full(len(cracks), -1, dtype=np.int64)
    plain = np.flatnonzero(~is_self_loop)
    arc_of_class[classes[np.searchsorted(cracks, base_edges[plain])]] = plain
    edges, arcs = [cracks], [arc_of_class[classes]]
    loops = np.flatnonzero(is_self_loop)
    came = np.zeros(len(field_of) + cols if len(loops) else 0, np.uint8)
    for loop in loops:
        line = line_of_loop(int(base_edges[loop]), level, came)
        edges.append(line)
        arcs.append(np.full(len(line), loop))
    edge, arc = np.concatenate(edges), np.concatenate(arcs)
    order = np.lexsort((edge, arc))
    return edge[order], arc[order]
