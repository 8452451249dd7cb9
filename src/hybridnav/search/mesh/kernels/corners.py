"""Kernels that read corners and walls off free cells.

Points are (row, col) in grid units: cell (r, c) spans [r, r + 1] x [c, c + 1], corners are whole
numbers.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit

NO_CORNER = 6
MANY = 4
"""Kind of a corner that no path bends round: the number of blocked cells of four is not one."""


@njit(cache=True, nogil=True)
def _kind(a, b, c, d):
    """Return the kind of a lattice point, as in `kinds_of`, by which of its cells are free: two of
    the lower row, two of the upper one."""
    n = int(a) + int(b) + int(c) + int(d)
    if n == 3:
        return 0 if not a else 1 if not b else 2 if not c else 3
    return MANY if n == 1 or (n == 2 and a == d) else NO_CORNER


@njit(cache=True, nogil=True)
def kinds_of(free):
    """Return the kind of each lattice point, uint8 (rows + 1, cols + 1).

    0 to 3 if one cell of four is blocked: bit 1 for the upper row, bit 0 for the upper column;
    `MANY` if three are, or two that meet there alone; else `NO_CORNER`. Cells outside the map are
    blocked.
    """
    rows, cols = free.shape
    kinds = np.empty((rows + 1, cols + 1), np.uint8)
    for row in range(rows + 1):
        below, above = row > 0, row < rows
        a = c = False
        for col in range(cols + 1):
            b = below and col < cols and free[row - 1, col]
            d = above and col < cols and free[row, col]
            kinds[row, col] = _kind(a, b, c, d)
            a, c = b, d
    return kinds


@guarded
@njit(cache=True, nogil=True)
def walls_of(free, kinds, n_corners):
    """Return the corners, and the walls between them.

    A wall is a straight run of sides between free and blocked cells, from a corner to the next.

    `free`: bool (rows, cols); `kinds`: kinds of `kinds_of`; `n_corners`: number of corners among
    them. Returns int32 (n, 2) corners (row, col) in the order of rows; int32 (m, 2) walls, as their
    indices.
    """
    rows, cols = free.shape
    corners = np.empty((n_corners, 2), np.int32)
    walls = np.empty((2 * n_corners, 2), np.int32)
    below = np.empty(cols + 1, np.int32)
    count = n_walls = 0
    for row in range(rows + 1):
        before = -1
        for col in range(cols + 1):
            if kinds[row, col] == NO_CORNER:
                continue
            corners[count, 0], corners[count, 1] = row, col
            # A side between two classes that starts at a corner leads to another corner.
            if col > 0:
                down = row > 0 and free[row - 1, col - 1]
                up = row < rows and free[row, col - 1]
                if down != up:
                    walls[n_walls, 0], walls[n_walls, 1] = before, count
                    n_walls += 1
            if row > 0:
                left = col > 0 and free[row - 1, col - 1]
                right = col < cols and free[row - 1, col]
                if left != right:
                    walls[n_walls, 0], walls[n_walls, 1] = below[col], count
                    n_walls += 1
            before, below[col] = count, count
            count += 1
    return corners, walls[:n_walls]


# Kernels that renew a mesh where cells changed: the polygons beside them, and the rest.
#
# Points are (row, col) in grid units, as for `merge_triangles`.


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
def touched_polygons(corners, sides, place, cells):
    """Return the polygons that share a point with a cell, reached from inside it.

    `corners`: int32 (n, 2); `sides`: arrays first, begins, twins, polygon_of of the mesh; `place`:
    int32 (rows, cols), the polygon at the centre of each cell before the mesh was renewed, -1 for
    none; int32 (p,), component of each polygon, -1 for removed ones; `cells`: int64 (m,), flat
    cells; those that were not free touch nothing. Returns bool (p,) whether each polygon is
    touched, int32 their numbers.
    """
    first, begins, twins, polygon_of = sides
    polygon_at, component = place
    n = len(first) - 1
    near, is_near_known = np.empty(0, np.int32), False
    is_touched = np.zeros(n, np.bool_)
    touched = np.empty(n, np.int32)
    seen = np.full(n, -1, np.int64)
    waiting = np.empty(n, np.int32)
    count = 0
    for cell in cells:
        row, col = cell // polygon_at.shape[1], cell % polygon_at.shape[1]
        inner = polygon_at[row, col]
        if inner < 0 or component[inner] < 0:
            # In place of a removed polygon: all polygons are looked through, once.
            if not is_near_known:
                near = _polygons_near(corners, sides, component, cells, polygon_at.shape[1])
                is_near_known = True
            inner = _polygon_with((corners, first, begins), near, 2, 2 * row + 1, 2 * col + 1)
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
def _polygons_near(corners, sides, component, cells, n_cols):
    """Return the polygons whose bounds meet those of some cells, without removed ones."""
    first, begins, _, _ = sides
    bottom = left = np.int64(1) << 40
    top = right = -bottom
    for cell in cells:
        bottom, top = min(bottom, cell // n_cols), max(top, cell // n_cols + 1)
        left, right = min(left, cell % n_cols), max(right, cell % n_cols + 1)
    near = np.empty(len(first) - 1, np.int32)
    n = 0
    for polygon in range(len(first) - 1):
        if component[polygon] < 0:
            continue
        below = above = before = behind = True
        for slot in range(first[polygon], first[polygon + 1]):
            row, col = corners[begins[slot], 0], corners[begins[slot], 1]
            below, above = below and row < bottom, above and row > top
            before, behind = before and col < left, behind and col > right
        if not (below or above or before or behind):
            near[n] = polygon
            n += 1
    return near[:n]


@njit(cache=True, nogil=True)
def _polygon_with(mesh, polygons, parts, row, col):
    """Return the one of some polygons with a point, -1 for none; `row` and `col` count parts of a
    cell, `parts` of them each."""
    corners, first, begins = mesh
    for polygon in polygons:
        low, high = first[polygon], first[polygon + 1]
        holds = True
        for slot in range(low, high):
            a = begins[slot]
            b = begins[low if slot + 1 == high else slot + 1]
            side = _cross(
                parts * corners[a, 0], parts * corners[a, 1],
                parts * corners[b, 0], parts * corners[b, 1],
                row, col,
            )  # fmt: skip
            holds = side >= 0
            if not holds:
                break
        if holds:
            return polygon
    return -1


@guarded
@njit(cache=True, nogil=True)
def freed_cells(free, changed):
    """Return the changed cells that are free, and the free cells beside them, also at their
    corners, that were free before; int64, flat, each once."""
    rows, cols = free.shape
    freed = np.empty(len(changed), np.int64)
    n = 0
    for cell in changed:
        if free[cell // cols, cell % cols]:
            freed[n] = cell
            n += 1
    freed = np.sort(freed[:n])
    found = np.empty(8 * n, np.int64)
    n = 0
    for cell in freed:
        row, col = cell // cols, cell % cols
        for k in range(9):
            r, c = row + k // 3 - 1, col + k % 3 - 1
            if 0 <= r < rows and 0 <= c < cols and free[r, c]:
                at = np.searchsorted(freed, r * cols + c)
                if at == len(freed) or freed[at] != r * cols + c:
                    found[n] = r * cols + c
                    n += 1
    return freed, np.unique(found[:n])


@njit(cache=True, nogil=True)
def kind_at(free, row, col):
    """Return the kind of a lattice point, as in `kinds_of`."""
    rows, cols = free.shape
    a = row > 0 and col > 0 and free[row - 1, col - 1]
    b = row > 0 and col < cols and free[row - 1, col]
    c = row < rows and col > 0 and free[row, col - 1]
    d = row < rows and col < cols and free[row, col]
    return _kind(a, b, c, d)


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
def walls_between(free, points):
    """Return the walls from one of some corners to the next corner, if that is one of them too.

    `free`: bool (rows, cols), the free cells now; `points`: int64 (n,), flat lattice points at
    which walls turn, sorted. Returns int64 (w, 2), indices of `points`.
    """
    rows, cols = free.shape
    wide = cols + 1
    walls = np.empty((2 * len(points), 2), np.int64)
    n = 0
    for begin in range(len(points)):
        row, col = points[begin] // wide, points[begin] % wide
        for step in (1, wide):
            if not _is_wall(free, row, col, step):
                continue
            # A wall ends at a corner, at the latest on the rim of the map.
            end = points[begin] + step
            for _ in range(rows + cols):
                if kind_at(free, end // wide, end % wide) != NO_CORNER:
                    break
                end += step
            stop = np.searchsorted(points, end)
            if stop < len(points) and points[stop] == end:
                walls[n, 0], walls[n, 1] = begin, stop
                n += 1
    return walls[:n].copy()


@njit(cache=True, nogil=True)
def _is_wall(free, row, col, step):
    """Return whether one cell of two is free beside the side from a lattice point, along the row
    with a step of 1, else along the column."""
    rows, cols = free.shape
    if step == 1:
        below = row > 0 and col < cols and free[row - 1, col]
        return below != (row < rows and col < cols and free[row, col])
    before = row < rows and col > 0 and free[row, col - 1]
    return before != (row < rows and col < cols and free[row, col])


@guarded
@njit(cache=True, nogil=True)
def doors_of(sides, is_touched, touched):
    """Return the slots of touched polygons that lead to polygons which are not, int64."""
    first, _, twins, polygon_of = sides
    n = 0
    for polygon in touched:
        n += first[polygon + 1] - first[polygon]
    doors = np.empty(n, np.int64)
    n = 0
    for polygon in touched:
        for slot in range(first[polygon], first[polygon + 1]):
            if twins[slot] >= 0 and not is_touched[polygon_of[twins[slot]]]:
                doors[n] = slot
                n += 1
    return doors[:n].copy()


@guarded
@njit(cache=True, nogil=True)
def are_inside(corners, first, begins, touched, triples):
    """Return whether the middle of each triangle lies in one of some polygons.

    `corners`, `first`, `begins`: arrays of the mesh; `touched`: int32, numbers of the polygons;
    `triples`: int64 (t, 2), the sum of the three corners of each triangle.
    """
    inside, mesh = np.zeros(len(triples), np.bool_), (corners, first, begins)
    for k in range(len(triples)):
        inside[k] = _polygon_with(mesh, touched, 3, triples[k, 0], triples[k, 1]) >= 0
    return inside
