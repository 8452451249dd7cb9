"""Kernels that cut closed cells out of a mesh: the polygons that they touch, and the rest.

Points are (row, col) in grid units, as for `merge_triangles`.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.mesh._corner_kernels import MANY, NO_CORNER


@njit(cache=True, nogil=True)
def _cross(a_row, a_col, b_row, b_col, row, col):
    """Return twice the signed area of a, b and a point, positive if the point lies to the left."""
    return (np.int64(b_col) - a_col) * (np.int64(row) - a_row) - (np.int64(b_row) - a_row) * (
        np.int64(col) - a_col
    )


@njit(cache=True, nogil=True)
def _touches_cell(corners, begins, low, high, row, col):
    """Return whether a convex polygon has a point in common with the closed square of a cell."""
    bottom = left = np.int64(1) << 40
    top = right = -bottom
    for slot in range(low, high):
        r, c = corners[begins[slot], 0], corners[begins[slot], 1]
        bottom, top = min(bottom, r), max(top, r)
        left, right = min(left, c), max(right, c)
    if top < row or bottom > row + 1 or right < col or left > col + 1:
        return False
    for slot in range(low, high):
        a = begins[slot]
        b = begins[low if slot + 1 == high else slot + 1]
        most = np.int64(-1)
        for k in range(4):
            side = _cross(
                corners[a, 0], corners[a, 1], corners[b, 0], corners[b, 1],
                row + (k & 1), col + (k >> 1),
            )  # fmt: skip
            most = max(most, side)
        if most < 0:
            return False
    return True


@guarded
@njit(cache=True, nogil=True)
def touched_polygons(corners, sides, polygon_at, closed):
    """Return the polygons that share a point with a closed cell, reached from inside it.

    Parameters
    ----------
    corners
        int32 (n, 2).
    sides
        Arrays first, begins, twins, polygon_of of the mesh.
    polygon_at
        int32 (rows, cols), the polygon at the centre of each cell, -1 for none.
    closed
        int64 (m,), flat cells.

    Returns
    -------
    tuple
        bool (p,) whether each polygon is touched, int32 their numbers.
    """
    first, begins, twins, polygon_of = sides
    n = len(first) - 1
    is_touched = np.zeros(n, np.bool_)
    touched = np.empty(n, np.int32)
    seen = np.full(n, -1, np.int64)
    waiting = np.empty(n, np.int32)
    count = 0
    for cell in closed:
        row, col = cell // polygon_at.shape[1], cell % polygon_at.shape[1]
        inner = polygon_at[row, col]
        if inner < 0:
            continue
        waiting[0], size = inner, 1
        seen[inner] = cell
        while size:
            size -= 1
            polygon = waiting[size]
            if not is_touched[polygon]:
                is_touched[polygon] = True
                touched[count] = polygon
                count += 1
            for slot in range(first[polygon], first[polygon + 1]):
                if twins[slot] < 0:
                    continue
                other = polygon_of[twins[slot]]
                if seen[other] == cell:
                    continue
                seen[other] = cell
                if _touches_cell(corners, begins, first[other], first[other + 1], row, col):
                    waiting[size] = other
                    size += 1
    return is_touched, touched[:count].copy()


@njit(cache=True, nogil=True)
def kind_at(free, row, col):
    """Return the kind of a lattice point, as in `kinds_of`."""
    rows, cols = free.shape
    a = row > 0 and col > 0 and free[row - 1, col - 1]
    b = row > 0 and col < cols and free[row - 1, col]
    c = row < rows and col > 0 and free[row, col - 1]
    d = row < rows and col < cols and free[row, col]
    n = int(a) + int(b) + int(c) + int(d)
    if n == 3:
        return 0 if not a else 1 if not b else 2 if not c else 3
    return MANY if n == 1 or (n == 2 and a == d) else NO_CORNER


@guarded
@njit(cache=True, nogil=True)
def corners_of_cells(free, closed):
    """Return the lattice points at closed cells, each once, int64 (n,), and their kinds, uint8
    (n,)."""
    cols = free.shape[1]
    found = np.empty(4 * len(closed), np.int64)
    for k in range(len(closed)):
        row, col = closed[k] // cols, closed[k] % cols
        for m in range(4):
            found[4 * k + m] = (row + (m & 1)) * (cols + 1) + col + (m >> 1)
    found = np.unique(found)
    kinds = np.empty(len(found), np.uint8)
    for k in range(len(found)):
        kinds[k] = kind_at(free, found[k] // (cols + 1), found[k] % (cols + 1))
    return found, kinds


@guarded
@njit(cache=True, nogil=True)
def walls_of_closed(free, closed, points):
    """Return the walls between closed cells and free ones, from vertex to vertex.

    Parameters
    ----------
    free
        bool (rows, cols), without the closed cells.
    closed
        int64 (m,), flat cells that are closed.
    points
        int64 (n,), flat lattice points that are vertices, sorted.

    Returns
    -------
    IntArray
        int64 (w, 2), indices of `points`.
    """
    rows, cols = free.shape
    wide = cols + 1
    walls = np.empty((4 * len(closed), 2), np.int64)
    n = 0
    for cell in closed:
        row, col = cell // cols, cell % cols
        for side in range(4):
            # The other cell of the side, and the two endpoints of the side.
            down = row - 1 if side == 0 else row + 1 if side == 1 else row
            across = col - 1 if side == 2 else col + 1 if side == 3 else col
            if not (0 <= down < rows and 0 <= across < cols and free[down, across]):
                continue
            at = (row + (side == 1)) * wide + col + (side == 3)
            step = 1 if side < 2 else wide
            begin = np.searchsorted(points, at)
            if begin == len(points) or points[begin] != at:
                continue  # a straight wall continues here
            end = at + step
            stop = np.searchsorted(points, end)
            while stop == len(points) or points[stop] != end:
                end += step
                stop = np.searchsorted(points, end)
            walls[n, 0], walls[n, 1] = begin, stop
            n += 1
    return walls[:n].copy()


@guarded
@njit(cache=True, nogil=True)
def rim_of(sides, is_touched, touched):
    """Return the slots of touched polygons that are walls or lead to other polygons, int64."""
    first, _, twins, polygon_of = sides
    n = 0
    for polygon in touched:
        n += first[polygon + 1] - first[polygon]
    rim = np.empty(n, np.int64)
    n = 0
    for polygon in touched:
        for slot in range(first[polygon], first[polygon + 1]):
            if twins[slot] < 0 or not is_touched[polygon_of[twins[slot]]]:
                rim[n] = slot
                n += 1
    return rim[:n].copy()


@guarded
@njit(cache=True, nogil=True)
def segments_of_rim(sides, rim, point_of, points, wide):
    """Return the sides of a rim, divided at vertices, int64 (w, 2), indices of `points`.

    Parameters
    ----------
    sides
        Arrays first, begins, twins, polygon_of of the mesh.
    rim
        Slots of `rim_of`. Walls run along rows or columns; no other side passes a vertex.
    point_of
        int64 (n,), flat lattice point of each corner of the mesh.
    points
        int64 (k,), flat lattice points that are vertices, sorted.
    wide
        Lattice points in a row.
    """
    first, begins, twins, polygon_of = sides
    segments = np.empty((len(rim) + 2 * len(points), 2), np.int64)
    n = 0
    for slot in rim:
        polygon = polygon_of[slot]
        after = first[polygon] if slot + 1 == first[polygon + 1] else slot + 1
        at, end = point_of[begins[slot]], point_of[begins[after]]
        here = np.searchsorted(points, at)
        if twins[slot] >= 0:
            segments[n, 0], segments[n, 1] = here, np.searchsorted(points, end)
            n += 1
            continue
        step = wide if abs(end - at) >= wide else 1
        if end < at:
            step = -step
        while at != end:
            at += step
            there = np.searchsorted(points, at)
            if there < len(points) and points[there] == at:
                segments[n, 0], segments[n, 1] = here, there
                n += 1
                here = there
    return segments[:n].copy()


@guarded
@njit(cache=True, nogil=True)
def are_inside(corners, first, begins, touched, triples):
    """Return whether the middle of each triangle lies in one of some polygons.

    Parameters
    ----------
    corners, first, begins
        Arrays of the mesh.
    touched
        int32, numbers of the polygons.
    triples
        int64 (t, 2), the sum of the three corners of each triangle.
    """
    inside = np.zeros(len(triples), np.bool_)
    for k in range(len(triples)):
        row, col = triples[k]
        for polygon in touched:
            low, high = first[polygon], first[polygon + 1]
            holds = True
            for slot in range(low, high):
                a = begins[slot]
                b = begins[low if slot + 1 == high else slot + 1]
                holds = holds and (
                    _cross(
                        3 * corners[a, 0], 3 * corners[a, 1], 3 * corners[b, 0], 3 * corners[b, 1],
                        row, col,
                    )
                    >= 0
                )  # fmt: skip
                if not holds:
                    break
            if holds:
                inside[k] = True
                break
    return inside
