"""Kernels that walk along the sides of cells: outlines of fields, lines of boundaries.

A corner is `(row, col)` in grid units, so that cell (r, c) has the corners (r, c) to (r + 1, c +
1). A walk goes from corner to corner with a heading, 0 east, 1 north, 2 west, 3 south, and the
field that it goes round lies on its left.
"""

from __future__ import annotations

import numpy as np

from hybridnav._jit import guarded, njit


@njit(cache=True, nogil=True)
def step(row, col, heading):
    """Return the corner one side further."""
    if heading == 0:
        return row, col + 1
    if heading == 1:
        return row + 1, col
    if heading == 2:
        return row, col - 1
    return row - 1, col


@njit(cache=True, nogil=True)
def field_left(field_of, row, col, heading):
    """Return the field of the cell to the left of the side along a heading, -1 for none."""
    if heading == 1 or heading == 2:
        col -= 1
    if heading == 2 or heading == 3:
        row -= 1
    if row < 0 or row >= field_of.shape[0] or col < 0 or col >= field_of.shape[1]:
        return np.int32(-1)
    return field_of[row, col]


@njit(cache=True, nogil=True)
def put(corners, at, row, col):
    """Write a corner, unless corners are only counted, and return the index of the next one."""
    if corners.size:
        corners[at, 0] = row
        corners[at, 1] = col
    return at + 1


@njit(cache=True, nogil=True)
def walk_ring(field_of, start, noded, visited, corners, at):
    """Write the corners of the ring that starts east along the lower side of a flat cell.

    The first corner is repeated at the end. Corners are written from index `at` on, unless
    `corners` is empty; the index behind the last one is returned. Where a field meets itself at a
    corner only, the walk crosses over: each ring stays simple, because the two cells are connected
    on one side of that corner, and another ring encloses the area between them.
    """
    first_row, first_col = divmod(start, field_of.shape[1])
    own = field_of[first_row, first_col]
    row, col, heading = first_row, first_col, 0
    at = put(corners, at, row, col)
    while True:
        if heading == 0:
            visited[row, col] = True
        right = field_left(field_of, row, col, (heading + 3) & 3)
        row, col = step(row, col, heading)
        ahead_left = field_left(field_of, row, col, heading)
        ahead_right = field_left(field_of, row, col, (heading + 3) & 3)
        if ahead_right == own:
            heading = (heading + 3) & 3
        elif ahead_left != own:
            heading = (heading + 1) & 3
        elif not noded or ahead_right == right:
            continue
        at = put(corners, at, row, col)
        if row == first_row and col == first_col and heading == 0:
            return at


@guarded
@njit(cache=True, nogil=True)
def find_rings(field_of, noded):
    """Return for each ring round a field: the flat cell above its start, the field, its corners.

    In the order of rows a ring starts at a turn, and the first ring of a field is its outer one.
    """
    rows, cols = field_of.shape
    visited = np.zeros((rows, cols), np.bool_)
    nothing = np.empty((0, 2), np.int32)
    starts, fields, sizes = [np.int64(0)], [np.int32(0)], [np.int64(0)]
    for row in range(rows):
        for col in range(cols):
            own = field_of[row, col]
            if own < 0 or visited[row, col] or (row > 0 and field_of[row - 1, col] == own):
                continue
            start = row * cols + col
            starts.append(start)
            fields.append(own)
            sizes.append(walk_ring(field_of, start, noded, visited, nothing, 0))
    return np.array(starts)[1:], np.array(fields)[1:], np.array(sizes)[1:]


@njit(cache=True, nogil=True)
def ring_corners(field_of, starts, offsets, noded):
    """Return the corners of rings, int32 (offsets[-1], 2)."""
    visited = np.empty(field_of.shape, np.bool_)
    corners = np.empty((offsets[-1], 2), np.int32)
    for i in range(starts.size):
        walk_ring(field_of, starts[i], noded, visited, corners, offsets[i])
    return corners


@njit(cache=True, nogil=True)
def side_at(corner, heading, cols):
    """Return the base edge across the side that leads from a corner, given the cell south-west of
    it.

    A base edge is twice its lower flat cell, plus one where it goes north.
    """
    if heading == 0:
        return 2 * (corner + 1) + 1
    if heading == 1:
        return 2 * (corner + cols)
    if heading == 2:
        return 2 * corner + 1
    return 2 * corner


@njit(cache=True, nogil=True)
def is_crack(flat, cols, edge):
    """Return whether the cells of a base edge lie in different fields."""
    cell = edge >> 1
    return flat[cell] != flat[cell + (cols if edge & 1 else 1)]


@njit(cache=True, nogil=True)
def next_heading(field_of, row, col, heading, members):
    """Return the heading of a line beyond a corner, -1 where it ends.

    A line with members consists of these base edges, ascending; one without members follows the
    only other crack of a full 2x2 block. Where a cell of the block is no vertex, two more sides at
    the corner are cracks, so that a count is enough.
    """
    rows, cols = field_of.shape
    if row == 0 or row == rows or col == 0 or col == cols:
        return -1
    flat = field_of.ravel()
    corner = (row - 1) * cols + col - 1
    found = -1
    for turn in range(-1, 2):
        turned = (heading + turn) & 3
        edge = side_at(corner, turned, cols)
        if members.size:
            i = np.searchsorted(members, edge)
            goes_on = i < members.size and members[i] == edge
        else:
            goes_on = is_crack(flat, cols, edge)
        if goes_on:
            if found >= 0:
                return -1
            found = turned
    return found


@njit(cache=True, nogil=True)
def line_start(field_of, edge, members):
    """Return the corner and heading at which the line through a side starts, its lower cell left.

    A closed line starts at the first turn beyond the side.
    """
    cell = edge >> 1
    row, col = divmod(cell, field_of.shape[1])
    # Walk back first: the side north of the lower cell leads east, the side east of it south.
    col += 0 if edge & 1 else 1
    row += 1
    heading = 0 if edge & 1 else 3
    at_row, at_col, at_heading = row, col, heading
    while True:
        at_row, at_col = step(at_row, at_col, at_heading)
        turned = next_heading(field_of, at_row, at_col, at_heading, members)
        if turned < 0:
            return at_row, at_col, (at_heading + 2) & 3
        if at_row == row and at_col == col and turned == heading:
            break
        at_heading = turned
    at_heading = (heading + 2) & 3
    while True:
        turned = next_heading(field_of, at_row, at_col, at_heading, members)
        if turned != at_heading:
            return at_row, at_col, turned
        at_row, at_col = step(at_row, at_col, at_heading)


@njit(cache=True, nogil=True)
def walk_line(field_of, start, members, corners, at):
    """Write the corners of the line from its start on, as `walk_ring` does."""
    row, col, heading = start
    first_row, first_col, first_heading = start
    at = put(corners, at, row, col)
    while True:
        row, col = step(row, col, heading)
        turned = next_heading(field_of, row, col, heading, members)
        if turned == heading:
            continue
        at = put(corners, at, row, col)
        if turned < 0 or (row == first_row and col == first_col and turned == first_heading):
            return at
        heading = turned


@guarded
@njit(cache=True, nogil=True)
def boundary_corners(field_of, edges, members, bounds):
    """Return the offsets of the lines through given sides, and their corners.

    Line i is made of `members[bounds[i] : bounds[i + 1]]`, or of cracks where that is empty.
    """
    offsets = np.zeros(edges.size + 1, np.int64)
    corners = np.empty((0, 2), np.int32)
    for pass_ in range(2):
        if pass_ == 1:
            corners = np.empty((offsets[-1], 2), np.int32)
        for i in range(edges.size):
            own = members[bounds[i] : bounds[i + 1]]
            start = line_start(field_of, edges[i], own)
            end = walk_line(field_of, start, own, corners, offsets[i])
            offsets[i + 1] = end
    return offsets, corners
