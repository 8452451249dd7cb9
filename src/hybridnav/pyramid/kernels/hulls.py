"""Kernels of convex hulls of receptive fields, as cells, and of distances between fields."""

import numpy as np

from hybridnav._base.jit import guarded, njit


@njit(cache=True, nogil=True, _nrt=False)
def turn(points, i, j, row, col):
    """Return the cross product of the steps i -> j and j -> (row, col); positive to the left."""
    ax = np.int64(points[j, 1] - points[i, 1])
    ay = np.int64(points[j, 0] - points[i, 0])
    bx = np.int64(col - points[j, 1])
    by = np.int64(row - points[j, 0])
    return ax * by - ay * bx


@njit(cache=True, nogil=True, _nrt=False)
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
    first_row, left, right = rows_of(boxes)
    for row in range(field_of.size // cols):
        for col in range(cols):
            v = field_of[row * cols + col]
            if v >= 0:
                at = first_row[v] + row - boxes[v, 0]
                left[at] = min(left[at], col)
                right[at] = col
    return hulls_of_rows(boxes, first_row, left, right)


@guarded
@njit(cache=True, nogil=True)
def block_rows(blocks, field_of, boxes):
    """Return the rows of connected fields that are made of blocks.

    `blocks`: int32 (n_blocks, 4), `field_of`: int32 (n_blocks,), the box of each block and its
    field; `boxes`: int32 (n_vertices, 4), of the fields. Returns where the rows of each field
    begin, (n_vertices + 1,); blocks of one row, from its first cell to the last one; their fields.
    """
    first_row, left, right = rows_of(boxes)
    for i in range(field_of.size):
        v = field_of[i]
        for row in range(blocks[i, 0], blocks[i, 2] + 1):
            at = first_row[v] + row - boxes[v, 0]
            left[at] = min(left[at], blocks[i, 1])
            right[at] = max(right[at], blocks[i, 3])
    rows, of_row = np.empty((left.size, 4), np.int32), np.empty(left.size, np.int32)
    for v in range(boxes.shape[0]):
        for i in range(first_row[v], first_row[v + 1]):
            rows[i, 0] = rows[i, 2] = boxes[v, 0] + i - first_row[v]
            rows[i, 1], rows[i, 3], of_row[i] = left[i], right[i], v
    return first_row, rows, of_row


@guarded
@njit(cache=True, nogil=True)
def rows_of(boxes):
    """Return where the rows of each field begin, and arrays for the first and last cell of each."""
    n_vertices = boxes.shape[0]
    first_row = np.zeros(n_vertices + 1, np.int64)
    for v in range(n_vertices):
        first_row[v + 1] = first_row[v] + boxes[v, 2] - boxes[v, 0] + 1
    n_rows = first_row[n_vertices]
    left = np.full(n_rows, np.int32(0x7FFFFFFF), np.int32)
    return first_row, left, np.full(n_rows, np.int32(-1), np.int32)


@guarded
@njit(cache=True, nogil=True)
def hulls_of_rows(boxes, first_row, left, right):
    """Return the convex hulls of fields from the first and last cell of their rows (`rows_of`)."""
    n_vertices = boxes.shape[0]
    start = np.zeros(n_vertices + 1, np.int64)
    rows = np.empty(left.size, np.int32)
    points = np.empty((2 * left.size, 2), np.int32)
    end = 0
    for v in range(n_vertices):
        low, high = first_row[v], first_row[v + 1]
        for i in range(low, high):
            rows[i - low] = boxes[v, 0] + i - low
        end = chain(rows, left[low:high], high - low, -1, points, end)
        end = chain(rows, right[low:high], high - low, 1, points, end)
        start[v + 1] = end
    return start, points[:end].copy()


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


@njit(cache=True, nogil=True, _nrt=False)
def far_corner(cells, u, boxes, v):
    """Return the squared distance from the surviving cell of u to the far corner of v's box."""
    row, col = cells[u, 0], cells[u, 1]
    rows = np.int64(max(row - boxes[v, 0], boxes[v, 2] - row))
    cols = np.int64(max(col - boxes[v, 1], boxes[v, 3] - col))
    return rows * rows + cols * cols


@njit(cache=True, nogil=True, _nrt=False)
def field_within(cells, u, hull_start, hull_points, v, limit):
    """Return whether the field of v lies nearer to the surviving cell of u than the limit."""
    for i in range(hull_start[v], hull_start[v + 1]):
        rows = np.int64(hull_points[i, 0] - cells[u, 0])
        cols = np.int64(hull_points[i, 1] - cells[u, 1])
        if rows * rows + cols * cols >= limit:
            return False
    return True


@njit(cache=True, nogil=True, _nrt=False)
def near_enough(u, v, hull_start, hull_points, limit):
    """Return whether every two cells of two fields lie nearer to each other than the limit."""
    for i in range(hull_start[u], hull_start[u + 1]):
        for j in range(hull_start[v], hull_start[v + 1]):
            rows = np.int64(hull_points[i, 0] - hull_points[j, 0])
            cols = np.int64(hull_points[i, 1] - hull_points[j, 1])
            if rows * rows + cols * cols >= limit:
                return False
    return True
