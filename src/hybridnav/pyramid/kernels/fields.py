"""Kernels on receptive fields: labels, boundaries, the darts of any level, and what each level has.

A level is rebuilt from the record of the decimation: `vertex_end` (0: no vertex, 255: survives to
the apex, else the level at which the cell stops being a surviving cell), `vertex_parent` (the
surviving cell it was contracted into) and `edge_end` (0: no edge, 255: alive at the apex, else
twice the level at which the edge goes, plus one where it is removed and not contracted).
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import find, grow
from hybridnav.pyramid.kernels.darts import base_sigma, next_at_cell, protect_faces


@guarded
@njit(cache=True, nogil=True)
def label_fields(vertex_end, vertex_parent, level):
    """Return the vertex of each flat cell at a level (-1: none), and the surviving cells."""
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
            field_of[cell] = field_of[root]  # labelled: a survivor or an earlier cell
    return field_of, survivors


@guarded
@njit(cache=True, nogil=True)
def field_extents(field_of, cols, n_vertices):
    """Return the areas of fields in cells and their boxes: least and greatest rows and columns."""
    areas = np.zeros(n_vertices, np.int64)
    boxes = np.empty((n_vertices, 4), np.int32)
    for row in range(field_of.size // cols):  # a division of each cell would take longer
        for col in range(cols):
            v = field_of[row * cols + col]
            if v < 0:
                continue
            if areas[v] == 0:
                boxes[v, 0] = boxes[v, 2] = row
                boxes[v, 1] = boxes[v, 3] = col
            areas[v] += 1
            boxes[v, 1] = min(boxes[v, 1], col)
            boxes[v, 2] = row
            boxes[v, 3] = max(boxes[v, 3], col)
    return areas, boxes


@njit(cache=True, nogil=True)
def edge_endpoints(base_edge, cols):
    """Return the two flat cells of a base edge, the lower one first."""
    cell = base_edge >> 1
    return cell, cell + (cols if base_edge & 1 else 1)


@njit(cache=True, nogil=True)
def other_crack(field_of, cols, corner, base_edge):
    """Return the other crack of a full 2x2 block that holds exactly two, else -1."""
    a, b, c, d = corner, corner + 1, corner + cols, corner + cols + 1
    if field_of[a] < 0 or field_of[b] < 0 or field_of[c] < 0 or field_of[d] < 0:
        return -1
    count = 0
    other = -1
    for edge in (2 * a, 2 * c, 2 * a + 1, 2 * b + 1):
        u, v = edge_endpoints(edge, cols)
        if field_of[u] != field_of[v]:
            count += 1
            if edge != base_edge:
                other = edge
    return other if count == 2 else -1


@njit(cache=True, nogil=True)
def place_of(edges, edge):
    """Return the index of an edge in an ascending array that contains it."""
    low, high = 0, edges.size - 1
    while low < high:
        middle = (low + high) >> 1
        if edges[middle] < edge:
            low = middle + 1
        else:
            high = middle
    return low


@njit(cache=True, nogil=True)
def crack_classes(cracks, field_of, rows, cols):
    """Return the class of each base edge between cells of different fields; see `find_cracks`."""
    count = cracks.size
    # Only two fields meet in a block with two cracks, and their border runs on through it: the
    # cracks of one stretch of border become one class.
    root = np.empty(count, np.int64)
    for i in range(count):
        root[i] = i
    for i in range(count):
        cell = cracks[i] >> 1
        for back in range(2):
            # A crack borders on two blocks: that whose lower-left cell is its first cell, and the
            # one west or south of that.
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
            # Beyond the east and the north rim of the map there is no block.
            if (corner + 1) % cols == 0 or corner + cols >= rows * cols:
                continue
            other = other_crack(field_of, cols, corner, cracks[i])
            if other >= 0:
                a, b = find(root, i), find(root, place_of(cracks, other))
                # The least position is the root: the class does not depend on the order of unions.
                root[max(a, b)] = min(a, b)
    for i in range(count):
        root[i] = find(root, i)
    return root


@njit(cache=True, nogil=True)
def base_protected(dart, vertex_end, rows, cols):
    """Return whether the base face on the right of a dart is anything but a full 2x2 block."""
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
    """Return sigma, origin and protection of the darts of a level, from walks through the base.

    The walk goes from a dart to its successor in the base; from a removed dart to the next one, and
    from a contracted dart to the one after its other half. The base corners on the way make up one
    corner of the level: a face is protected when one of them is.

    Parameters
    ----------
    edges
        int32 (n,), the base edges of the level, ascending.
    edge_end, vertex_end
        uint8 (2 n_cells,) and (n_cells,), the record.
    field_of
        int32 (n_cells,), the vertex of each flat cell.
    level
        Number of the level.
    rows, cols
        Shape of the grid.
    """
    n_edges = edges.size
    sigma = np.empty(2 * n_edges, np.int32)
    origin = np.empty(2 * n_edges, np.int32)
    protected = np.zeros(2 * n_edges, np.bool_)
    alive = 2 * level + 2
    for e in range(n_edges):
        first, second = edge_endpoints(edges[e], cols)
        origin[2 * e] = field_of[first]
        origin[2 * e + 1] = field_of[second]
        for half in range(2):
            dart = 2 * edges[e] + half
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
            sigma[2 * e + half] = 2 * place_of(edges, dart >> 1) + (dart & 1)
            if is_protected:
                protected[2 * e + (1 - half)] = True
    protect_faces(sigma, protected)
    return sigma, origin, protected


@guarded
@njit(cache=True, nogil=True)
def sweeps(survivors, edge_end, level, cols):
    """Return the integral of x dy from each field's surviving cell to its cells, int32 (n_cells,).

    The way leads along contracted edges, which span the field as a tree; the integral is modulo
    2^32. `survivors`, int64 (n_vertices,), are flat cells; `edge_end`, uint8 (2 n_cells,), is the
    record of the `level`.
    """
    n_cells = edge_end.size // 2
    sweep = np.zeros(n_cells, np.int32)
    stack, left = np.empty((n_cells, 2), np.int32), n_cells
    for root in survivors:
        stack[0, 0], stack[0, 1] = root, -1
        size = 1
        while size > 0:
            size -= 1
            cell, came_by = stack[size]
            for edge in (2 * cell, 2 * cell + 1, 2 * (cell - 1), 2 * (cell - cols) + 1):
                if edge < 0 or edge == came_by:
                    continue
                end = edge_end[edge]
                if end == 0 or end & 1 or end >= 2 * level + 2:
                    continue
                first, second = edge_endpoints(edge, cols)
                beyond = second if first == cell else first
                rise = (beyond - cell) // cols if edge & 1 else 0
                sweep[beyond] = sweep[cell] + rise * (cell % cols)
                # Contracted edges are a forest, in which each cell is met once.
                left -= 1
                if left <= 0:
                    return sweep
                stack[size, 0], stack[size, 1] = beyond, edge
                size += 1
    return sweep


@njit(cache=True, nogil=True)
def edges_to_rim(start, inside, field_of, edge_end, level, cols, came):
    """Return the base edges from a face in a field to the nearest rim, int64, the last one first.

    The rim is a face that is not ordinary or a block that holds a crack. The search follows removed
    edges inside the field. A face is named by its lower left cell.

    Parameters
    ----------
    start
        A face.
    inside
        The vertex of the field.
    field_of, edge_end, level, cols
        See `level_darts`.
    came
        uint8 (n_cells + cols,), scratch, zero.
    """
    n_cells = field_of.size
    queue = np.empty(64, np.int64)
    queue[0], came[start + cols] = start, 5
    at, size = 0, 1
    corner = start
    while at < size:
        corner = queue[at]
        at += 1
        a, b, c, d = corner, corner + 1, corner + cols, corner + cols + 1
        if corner < 0 or b % cols == 0 or c >= n_cells:
            break
        if (
            field_of[a] != inside
            or field_of[b] != inside
            or field_of[c] != inside
            or field_of[d] != inside
        ):
            break
        if size + 4 > queue.size:
            queue = grow(queue)
        for k in range(4):
            edge, beyond = edge_and_face_beyond(corner, k, cols)
            end = edge_end[edge]
            if end & 1 and end < 2 * level + 2 and came[beyond + cols] == 0:
                came[beyond + cols] = k + 1
                queue[size] = beyond
                size += 1
    steps = np.empty(size, np.int64)
    count = 0
    while came[corner + cols] < 5:
        # Back against the step that led here: south for north.
        edge, corner = edge_and_face_beyond(corner, (came[corner + cols] - 1) ^ 1, cols)
        steps[count] = edge
        count += 1
    for i in range(size):
        came[queue[i] + cols] = 0
    return steps[:count].copy()


@njit(cache=True, nogil=True)
def edge_and_face_beyond(corner, k, cols):
    """Return the base edge between a face and one beside it, 0 south to 3 east, and that face."""
    if k == 0:
        return 2 * corner, corner - cols
    if k == 1:
        return 2 * (corner + cols), corner + cols
    if k == 2:
        return 2 * corner + 1, corner - 1
    return 2 * (corner + 1) + 1, corner + 1


@njit(cache=True, nogil=True)
def darts_at_corners(cells, direction, edges, edge_end, level, cols):
    """Return a dart of the face that a direction at each cell points into, -1 where there is none.

    `direction` is 0 east to 3 south, and no vertex lies there: the corner belongs to one face of
    the base. The walk goes on counter-clockwise round the vertex of the level to the dart that
    follows the corner, and that dart bounds the same face.
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
            found[i] = 2 * place_of(edges, dart >> 1) + (dart & 1)
    return found


_SURVIVES = 255


@guarded
@njit(cache=True, nogil=True)
def level_sizes(vertex_end, vertex_parent, edge_end, cols, n_levels):
    """Count the vertices, arcs and self-loops of each level of a record, int64 (n_levels, 3).

    An edge is a self-loop from the level at which its two cells have gone into the same one.
    """
    sizes = np.zeros((n_levels + 1, 3), np.int64)  # ends of runs of levels, summed below
    for cell in range(vertex_end.size):
        end = vertex_end[cell]
        if end > 0:
            sizes[n_levels - 1 if end == _SURVIVES else end - 1, 0] += 1
    for edge in range(edge_end.size):
        end = edge_end[edge]
        if end == 0:
            continue
        last = n_levels - 1 if end == _SURVIVES else end // 2 - 1
        sizes[last, 1] += 1
        u, v = edge >> 1, (edge >> 1) + (cols if edge & 1 else 1)
        joined = 0
        while u != v and joined <= last:
            if vertex_end[u] > vertex_end[v]:
                u, v = v, u
            joined = n_levels if vertex_end[u] == _SURVIVES else int(vertex_end[u])
            u = vertex_parent[u] if joined <= last else u
        if joined <= last:
            sizes[last, 2] += 1
            sizes[joined - 1, 2] -= 1
    for level in range(n_levels - 1, -1, -1):
        sizes[level] += sizes[level + 1]
    return sizes[:n_levels]
