"""Kernels of convex hulls of receptive fields, as cells, and of distances between fields."""

import numpy as np

from hybridnav._base.jit import guarded, njit


@njit(cache=True, nogil=True)
def turn(points, i, j, row, col):
    """Return the cross product of the steps i -> j and j -> (row, col); positive to the left."""
    ax = np.int64(points[j, 1] - points[i, 1])
    ay = np.int64(points[j, 0] - points[i, 0])
    bx = np.int64(col - points[j, 1])
    by = np.int64(row - points[j, 0])
    return ax * by - ay * bx


@njit(cache=True, nogil=True)
def chain(rows, cols, count, hand, points, start):
    """Append one half of the hull of points sorted by row (monotone chain, Andrew 1979)."""
    end = start
    for i in range(count):
        while end - start >= 2 and hand * turn(points, end - 2, end - 1, rows[i], cols[i]) <= 0:
            end -= 1
        points[end, 0] = rows[i]
        points[end, 1] = cols[i]
        end += 1
    return end


@guarded
@njit(cache=True, nogil=True)
def field_hulls(field_of, cols, boxes):
    """Return the convex hulls of connected fields, from the first and last cell of each row."""
    n_vertices = boxes.shape[0]
    first_row = np.zeros(n_vertices + 1, np.int64)
    for v in range(n_vertices):
        first_row[v + 1] = first_row[v] + boxes[v, 2] - boxes[v, 0] + 1
    left = np.full(first_row[n_vertices], np.int64(-1), np.int64)
    right = np.empty(first_row[n_vertices], np.int64)
    for row in range(field_of.size // cols):
        for col in range(cols):
            v = field_of[row * cols + col]
            if v >= 0:
                at = first_row[v] + row - boxes[v, 0]
                if left[at] < 0:
                    left[at] = col
                right[at] = col
    start = np.zeros(n_vertices + 1, np.int64)
    rows = np.empty(first_row[n_vertices], np.int64)
    points = np.empty((2 * first_row[n_vertices], 2), np.int32)
    end = 0
    for v in range(n_vertices):
        low, high = first_row[v], first_row[v + 1]
        for i in range(low, high):
            rows[i - low] = boxes[v, 0] + i - low
        end = chain(rows, left[low:high], high - low, -1, points, end)
        end = chain(rows, right[low:high], high - low, 1, points, end)
        start[v + 1] = end
    return start, points[:end].copy()


@guarded
@njit(cache=True, nogil=True)
def hulls_of_points(offset, points):
    """Return the convex hulls of the sets `points[offset[v]:offset[v + 1]]`.

    The points of a set are sorted by row and then by column.
    """
    start = np.zeros(offset.size, np.int64)
    hulls = np.empty((2 * points.shape[0], 2), np.int32)
    rows = np.empty(points.shape[0], np.int64)
    cols = np.empty(points.shape[0], np.int64)
    end = 0
    for v in range(offset.size - 1):
        low, high = offset[v], offset[v + 1]
        # Only the first and the last point of a row belong to the left and the right chain.
        for hand in (-1, 1):
            count = 0
            for i in range(low, high):
                beside = i + hand
                if beside < low or beside >= high or points[i, 0] != points[beside, 0]:
                    rows[count], cols[count] = points[i, 0], points[i, 1]
                    count += 1
            end = chain(rows, cols, count, hand, hulls, end)
        start[v + 1] = end
    return start, hulls[:end].copy()


@njit(cache=True, nogil=True)
def hull_distances(start, points, arcs):
    """Return for each arc the largest squared distance between cells of its two fields."""
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
def far_corner(cells, u, boxes, v):
    """Return the squared distance from the surviving cell of u to the far corner of v's box."""
    row, col = cells[u, 0], cells[u, 1]
    rows = np.int64(max(row - boxes[v, 0], boxes[v, 2] - row))
    cols = np.int64(max(col - boxes[v, 1], boxes[v, 3] - col))
    return rows * rows + cols * cols


@njit(cache=True, nogil=True)
def field_within(cells, u, hull_start, hull_points, v, limit):
    """Return whether the field of v lies nearer to the surviving cell of u than the limit."""
    for i in range(hull_start[v], hull_start[v + 1]):
        rows = np.int64(hull_points[i, 0] - cells[u, 0])
        cols = np.int64(hull_points[i, 1] - cells[u, 1])
        if rows * rows + cols * cols >= limit:
            return False
    return True


@njit(cache=True, nogil=True)
def near_enough(u, v, hull_start, hull_points, limit):
    """Return whether every two cells of two fields lie nearer to each other than the limit."""
    for i in range(hull_start[u], hull_start[u + 1]):
        for j in range(hull_start[v], hull_start[v + 1]):
            rows = np.int64(hull_points[i, 0] - hull_points[j, 0])
            cols = np.int64(hull_points[i, 1] - hull_points[j, 1])
            if rows * rows + cols * cols >= limit:
                return False
    return True
