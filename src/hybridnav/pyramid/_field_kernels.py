"""Kernels on receptive fields: labels, hulls, boundaries, and the darts of any level.

A level is rebuilt from the record of the decimation: `vertex_end` (0: no vertex, 255: survives to
the apex, else the level at which the cell stops being a surviving cell), `vertex_parent` (the
surviving cell it was contracted into) and `edge_end` (0: no edge, 255: alive at the apex, else
twice the level at which the edge goes, plus one where it is removed and not contracted).
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit


@guarded
@njit(cache=True, nogil=True)
def label_fields(vertex_end, vertex_parent, level):
    """Dense vertex of each flat cell at a level (-1: no vertex) and the surviving cells."""
    n_cells = vertex_end.size
    field_of = np.full(n_cells, np.int32(-1), np.int32)
    count = 0
    for cell in range(n_cells):
        if vertex_end[cell] > level:
            field_of[cell] = count
            count += 1
    survivors = np.empty(count, np.int64)
    for cell in range(n_cells):
        if vertex_end[cell] > level:
            survivors[field_of[cell]] = cell
        elif vertex_end[cell] > 0:
            root = vertex_parent[cell]
            while vertex_end[root] <= level and root > cell:
                root = vertex_parent[root]
            field_of[cell] = field_of[root]  # a survivor, or a cell before this one: labelled
    return field_of, survivors


@guarded
@njit(cache=True, nogil=True)
def field_extents(field_of, cols, n_vertices):
    """Cells per field and their bounding boxes (least row, least column, greatest row, column)."""
    areas = np.zeros(n_vertices, np.int64)
    boxes = np.empty((n_vertices, 4), np.int32)
    for cell in range(field_of.size):
        v = field_of[cell]
        if v < 0:
            continue
        row, col = cell // cols, cell % cols
        if areas[v] == 0:
            boxes[v, 0] = boxes[v, 2] = row
            boxes[v, 1] = boxes[v, 3] = col
        areas[v] += 1
        boxes[v, 1] = min(boxes[v, 1], col)
        boxes[v, 2] = row
        boxes[v, 3] = max(boxes[v, 3], col)
    return areas, boxes


@njit(cache=True, nogil=True)
def turn(points, i, j, row, col):
    """Cross product of the steps i -> j and j -> (row, col); positive is counter-clockwise."""
    ax = np.int64(points[j, 1] - points[i, 1])
    ay = np.int64(points[j, 0] - points[i, 0])
    bx = np.int64(col - points[j, 1])
    by = np.int64(row - points[j, 0])
    return ax * by - ay * bx


@njit(cache=True, nogil=True)
def chain(rows, cols, count, side, points, start):
    """Append one side of the hull of points sorted by row (monotone chain, Andrew 1979)."""
    end = start
    for i in range(count):
        while end - start >= 2 and side * turn(points, end - 2, end - 1, rows[i], cols[i]) <= 0:
            end -= 1
        points[end, 0] = rows[i]
        points[end, 1] = cols[i]
        end += 1
    return end


@guarded
@njit(cache=True, nogil=True)
def field_hulls(field_of, cols, boxes):
    """Convex hulls of connected fields, from the first and last cell of each of their rows."""
    n_vertices = boxes.shape[0]
    first_row = np.zeros(n_vertices + 1, np.int64)
    for v in range(n_vertices):
        first_row[v + 1] = first_row[v] + boxes[v, 2] - boxes[v, 0] + 1
    left = np.full(first_row[n_vertices], np.int32(-1), np.int32)
    right = np.empty(first_row[n_vertices], np.int32)
    for cell in range(field_of.size):
        v = field_of[cell]
        if v >= 0:
            at = first_row[v] + cell // cols - boxes[v, 0]
            if left[at] < 0:
                left[at] = cell % cols
            right[at] = cell % cols
    start = np.zeros(n_vertices + 1, np.int64)
    points = np.empty((2 * first_row[n_vertices], 2), np.int32)
    end = 0
    for v in range(n_vertices):
        low, high = first_row[v], first_row[v + 1]
        rows = np.arange(boxes[v, 0], boxes[v, 2] + 1)
        end = chain(rows, left[low:high], high - low, -1, points, end)
        end = chain(rows, right[low:high], high - low, 1, points, end)
        start[v + 1] = end
    return start, points[:end].copy()


@guarded
@njit(cache=True, nogil=True)
def merge_hulls(start, points, parent, new_vertex, n_survivors):
    """Hulls of the next level from those of the stars that were contracted."""
    size = np.zeros(n_survivors + 1, np.int64)
    for v in range(parent.size):
        size[new_vertex[parent[v]] + 1] += start[v + 1] - start[v]
    offset = np.cumsum(size)
    filled = offset[:-1].copy()
    order = np.empty(points.shape[0], np.int64)
    for v in range(parent.size):
        w = new_vertex[parent[v]]
        for i in range(start[v], start[v + 1]):
            order[filled[w]] = i
            filled[w] += 1
    merged_start = np.zeros(n_survivors + 1, np.int64)
    merged = np.empty((2 * points.shape[0], 2), np.int32)
    end = 0
    for w in range(n_survivors):
        members = order[offset[w] : offset[w + 1]]
        key = np.empty(members.size, np.int64)
        for i in range(members.size):
            key[i] = np.int64(points[members[i], 0]) << 32 | np.int64(points[members[i], 1])
        key.sort()
        rows, cols = key >> 32, key & 0xFFFFFFFF
        count = members.size
        # Only the first and the last point of a row belong to the left and the right chain.
        first = np.empty(count, np.int64)
        n_first = n_last = 0
        last = np.empty(count, np.int64)
        for i in range(count):
            if i == 0 or rows[i] != rows[i - 1]:
                first[n_first] = i
                n_first += 1
            if i == count - 1 or rows[i] != rows[i + 1]:
                last[n_last] = i
                n_last += 1
        end = chain(rows[first[:n_first]], cols[first[:n_first]], n_first, -1, merged, end)
        end = chain(rows[last[:n_last]], cols[last[:n_last]], n_last, 1, merged, end)
        merged_start[w + 1] = end
    return merged_start, merged[:end].copy()


@njit(cache=True, nogil=True)
def hull_distances(start, points, arcs):
    """Largest squared distance between a cell of one field and a cell of the other, per arc."""
    squared = np.zeros(arcs.shape[0], np.int64)
    for a in range(arcs.shape[0]):
        u, v = arcs[a, 0], arcs[a, 1]
        for i in range(start[u], start[u + 1]):
            for j in range(start[v], start[v + 1]):
                rows = np.int64(points[i, 0] - points[j, 0])
                cols = np.int64(points[i, 1] - points[j, 1])
                squared[a] = max(squared[a], rows * rows + cols * cols)
    return squared


@njit(cache=True, nogil=True)
def find(root, i):
    """Representative of i in a union-find forest, halving the path."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


@njit(cache=True, nogil=True)
def edge_ends(base_edge, cols):
    """The two flat cells of a base edge, lower one first."""
    cell = base_edge >> 1
    return cell, cell + (cols if base_edge & 1 else 1)


@njit(cache=True, nogil=True)
def other_crack(field_of, cols, corner, base_edge):
    """The other crack of a full 2x2 block that holds exactly two, -1 where it does not."""
    a, b, c, d = corner, corner + 1, corner + cols, corner + cols + 1
    if field_of[a] < 0 or field_of[b] < 0 or field_of[c] < 0 or field_of[d] < 0:
        return -1
    count = 0
    other = -1
    for edge in (2 * a, 2 * c, 2 * a + 1, 2 * b + 1):
        u, v = edge_ends(edge, cols)
        if field_of[u] != field_of[v]:
            count += 1
            if edge != base_edge:
                other = edge
    return other if count == 2 else -1


@guarded
@njit(cache=True, nogil=True)
def find_cracks(field_of, rows, cols):
    """Base edges whose cells lie in different fields, ascending, and the class of each.

    Two cracks belong to one class when they lie in the same full 2x2 block that holds exactly two
    cracks; the class is the position of one of its cracks.
    """
    count = 0
    for pass_ in range(2):
        if pass_ == 1:
            cracks = np.empty(count, np.int64)
            count = 0
        for cell in range(rows * cols):
            if field_of[cell] < 0:
                continue
            if (cell + 1) % cols != 0:
                other = field_of[cell + 1]
                if other >= 0 and other != field_of[cell]:
                    if pass_ == 1:
                        cracks[count] = 2 * cell
                    count += 1
            if cell + cols < rows * cols:
                other = field_of[cell + cols]
                if other >= 0 and other != field_of[cell]:
                    if pass_ == 1:
                        cracks[count] = 2 * cell + 1
                    count += 1
    root = np.arange(count)
    for i in range(count):
        cell = cracks[i] >> 1
        # The blocks whose lower-left cell is this one see every pair of cracks at least once.
        for back in range(2):
            corner = cell
            if back == 1:
                if cracks[i] & 1:
                    if cell % cols == 0:
                        continue
                    corner = cell - 1
                else:
                    if cell < cols:
                        continue
                    corner = cell - cols
            if (corner + 1) % cols == 0 or corner + cols >= rows * cols:
                continue
            other = other_crack(field_of, cols, corner, cracks[i])
            if other >= 0:
                j = np.searchsorted(cracks, other)
                a, b = find(root, i), find(root, j)
                root[max(a, b)] = min(a, b)
    for i in range(count):
        root[i] = find(root, i)
    return cracks, root


@njit(cache=True, nogil=True)
def next_at_cell(cell, direction, edge_end, cols):
    """First dart of a base cell counter-clockwise after a direction (0 east to 3 south), else -1.

    Darts of the base are 2 * base edge + side; the full turn ends with the direction itself.
    """
    for i in range(1, 5):
        turned = (direction + i) & 3
        if turned == 0:
            dart = 4 * cell
        elif turned == 1:
            dart = 4 * cell + 2
        elif turned == 2:
            dart = 4 * (cell - 1) + 1
        else:
            dart = 4 * (cell - cols) + 3
        if dart >= 0 and edge_end[dart >> 1] != 0:
            return dart
    return -1


@njit(cache=True, nogil=True)
def base_sigma(dart, edge_end, cols):
    """Next dart counter-clockwise in the base."""
    edge = dart >> 1
    cell = edge >> 1
    direction = edge & 1  # 0 east, 1 north of the lower cell
    if dart & 1:
        cell += cols if direction else 1
        direction += 2
    return next_at_cell(cell, direction, edge_end, cols)


@njit(cache=True, nogil=True)
def base_protected(dart, vertex_end, rows, cols):
    """Whether the base face on the right of a dart is anything but a full 2x2 block."""
    edge = dart >> 1
    corner = edge >> 1
    if edge & 1:
        corner -= dart & 1  # the face lies east of a step north, west of a step south
    elif dart & 1 == 0:
        corner -= cols  # and south of a step east
    if edge & 1 and dart & 1 and (edge >> 1) % cols == 0:
        return True
    if corner < 0 or (corner + 1) % cols == 0 or corner + cols >= rows * cols:
        return True
    return (
        vertex_end[corner] == 0
        or vertex_end[corner + 1] == 0
        or vertex_end[corner + cols] == 0
        or vertex_end[corner + cols + 1] == 0
    )


@guarded
@njit(cache=True, nogil=True)
def level_darts(edges, edge_end, vertex_end, field_of, level, rows, cols):
    """Sigma, origin and protection of the darts of a level, by walks through the base.

    After a dart comes its successor in the base; where that is removed, the next one, and where
    it is contracted, the one after its other half. The corners passed on the way are the base
    corners that make up one corner of the level: a face is protected when one of them is.
    """
    n_edges = edges.size
    sigma = np.empty(2 * n_edges, np.int32)
    origin = np.empty(2 * n_edges, np.int32)
    protected = np.zeros(2 * n_edges, np.bool_)
    alive = 2 * level + 2
    for e in range(n_edges):
        first, second = edge_ends(edges[e], cols)
        origin[2 * e] = field_of[first]
        origin[2 * e + 1] = field_of[second]
        for side in range(2):
            dart = 2 * edges[e] + side
            is_protected = False
            while True:
                if base_protected(dart ^ 1, vertex_end, rows, cols):
                    is_protected = True
                dart = base_sigma(dart, edge_end, cols)
                end = edge_end[dart >> 1]
                if end >= alive:
                    break
                if end & 1 == 0:
                    dart ^= 1
            sigma[2 * e + side] = 2 * np.searchsorted(edges, dart >> 1) + (dart & 1)
            if is_protected:
                protected[2 * e + (1 - side)] = True
    for d in range(2 * n_edges):
        follow = sigma[d ^ 1]
        while protected[d] and not protected[follow]:
            protected[follow] = True
            follow = sigma[follow ^ 1]
    return sigma, origin, protected


@njit(cache=True, nogil=True)
def loop_line(base_edge, field_of, edge_end, level, rows, cols):
    """Base edges of the line that the dual edge of a self-loop takes through its field.

    From the face on either side of the edge the search follows removed edges inside the field to
    the nearest block that is no ordinary face or that holds a crack.
    """
    n_cells = rows * cols
    inside = field_of[base_edge >> 1]
    line = np.empty(0, np.int64)
    for side in range(2):
        corner = base_edge >> 1
        if side == 1:
            corner -= 1 if base_edge & 1 else cols
        parent_edge = {corner: np.int64(base_edge)}
        parent_corner = {corner: np.int64(-1)}
        queue = [corner]
        at = 0
        while at < len(queue):
            corner = queue[at]
            at += 1
            a, b, c, d = corner, corner + 1, corner + cols, corner + cols + 1
            ordinary = corner >= 0 and b % cols != 0 and c < n_cells
            if not ordinary:
                break
            if not (
                field_of[a] == inside
                and field_of[b] == inside
                and field_of[c] == inside
                and field_of[d] == inside
            ):
                break
            for k in range(4):
                if k == 0:
                    edge, beyond = 2 * a, corner - cols
                elif k == 1:
                    edge, beyond = 2 * c, corner + cols
                elif k == 2:
                    edge, beyond = 2 * a + 1, corner - 1
                else:
                    edge, beyond = 2 * b + 1, corner + 1
                end = edge_end[edge]
                if end & 1 and end < 2 * level + 2 and beyond not in parent_edge:
                    parent_edge[beyond] = np.int64(edge)
                    parent_corner[beyond] = np.int64(corner)
                    queue.append(beyond)
        steps = np.empty(len(queue), np.int64)
        count = 0
        while parent_corner[corner] >= 0:
            steps[count] = parent_edge[corner]
            count += 1
            corner = parent_corner[corner]
        line = np.concatenate((line, steps[:count]))
    return np.concatenate((line, np.array([base_edge], np.int64)))


@njit(cache=True, nogil=True)
def darts_at_corners(cells, direction, edges, edge_end, level, cols):
    """Dart of a level on whose face a direction at each cell points, -1 where there is none.

    `direction` is 0 east to 3 south, and no vertex lies there: the corner it points into belongs
    to one face of the base. The walk goes on counter-clockwise round the vertex of the level to
    the dart that follows the corner, and that dart bounds the same face.
    """
    found = np.full(cells.size, np.int64(-1), np.int64)
    for i in range(cells.size):
        first = next_at_cell(cells[i], direction, edge_end, cols)
        dart = first
        while dart >= 0 and edge_end[dart >> 1] < 2 * level + 2:
            removed = edge_end[dart >> 1] & 1
            dart = base_sigma(dart if removed else dart ^ 1, edge_end, cols)
            if dart == first:
                dart = -1
        if dart >= 0:
            found[i] = 2 * np.searchsorted(edges, dart >> 1) + (dart & 1)
    return found
