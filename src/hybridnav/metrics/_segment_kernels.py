"""Kernels of the judge: exact tests of segments against the cells of a grid, and shortest paths.

Positions are (row, col) in grid units: cell (r, c) spans [r, r + 1] x [c, c + 1], its corners are
whole numbers. `free_of` states for each cell class whether it is free, so that no kernel needs a
copy of the map. The tests are exact for coordinates that are multiples of 2^-24 below 2^28:
differences of such numbers fit a float64, and products are compared with their rounding errors.
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from hybridnav._jit import njit
from hybridnav.search.exact import compare_products

CLEAR, OUTSIDE, BLOCKED, BETWEEN, SEAM = 0, 1, 2, 3, 4
"""Codes of a segment: it stays in the free space, leaves the map, enters a cell that is not free,
passes between two such cells that meet at a corner, runs along a side that two of them share."""


@njit(cache=True, nogil=True)
def _is_free(classes, free_of, row, col):
    """Return whether a cell is in the map and free."""
    if row < 0 or col < 0 or row >= classes.shape[0] or col >= classes.shape[1]:
        return False
    return free_of[classes[row, col]]


@njit(cache=True, nogil=True)
def crossing_at(classes, free_of, row, col):
    """Return whether two free and two blocked cells face each other across a corner of the lattice.

    Return 0 for no, 1 if the free cells are the south-west and north-east ones, -1 for the other
    two.
    """
    south_west = _is_free(classes, free_of, row - 1, col - 1)
    south_east = _is_free(classes, free_of, row - 1, col)
    if south_west == south_east:
        return 0
    if south_west != _is_free(classes, free_of, row, col):
        return 0
    if south_east != _is_free(classes, free_of, row, col - 1):
        return 0
    return 1 if south_west else -1


@njit(cache=True, nogil=True)
def _point_code(classes, free_of, row, col):
    """Return `CLEAR` if a point touches the closed square of a free cell, else `BLOCKED`."""
    for r in range(math.ceil(row) - 1, math.floor(row) + 1):
        for c in range(math.ceil(col) - 1, math.floor(col) + 1):
            if _is_free(classes, free_of, r, c):
                return CLEAR
    return BLOCKED


@njit(cache=True, nogil=True)
def _level_code(classes, free_of, fixed, low, high, along_row):
    """Judge a segment along a row (or column) of the lattice at `fixed`, from `low` to `high`."""
    line = math.floor(fixed)
    on_line = line == fixed
    first = math.floor(low)
    for step in range(first, math.ceil(high)):
        if along_row:
            upper = _is_free(classes, free_of, line, step)
            lower = on_line and _is_free(classes, free_of, line - 1, step)
            crossing = on_line and step > low and crossing_at(classes, free_of, line, step) != 0
        else:
            upper = _is_free(classes, free_of, step, line)
            lower = on_line and _is_free(classes, free_of, step, line - 1)
            crossing = on_line and step > low and crossing_at(classes, free_of, step, line) != 0
        if not upper and not lower:
            return SEAM if on_line else BLOCKED
        if crossing:
            return BETWEEN
    return CLEAR


@njit(cache=True, nogil=True)
def segment_code(classes, free_of, row0, col0, row1, col1):
    """Return the code of a segment's first fault, 0 for none; its endpoints count as touched only.

    The walk visits the cells whose interior the segment enters (J. Amanatides, A. Woo: A fast voxel
    traversal algorithm for ray tracing, 1987) with exact comparisons of the crossings.
    """
    rows, cols = classes.shape
    if min(row0, row1) < 0 or max(row0, row1) > rows or min(col0, col1) < 0:
        return OUTSIDE
    if max(col0, col1) > cols:
        return OUTSIDE
    if row0 == row1:
        if col0 == col1:
            return _point_code(classes, free_of, row0, col0)
        return _level_code(classes, free_of, row0, min(col0, col1), max(col0, col1), True)
    if col0 == col1:
        return _level_code(classes, free_of, col0, min(row0, row1), max(row0, row1), False)
    if col1 < col0:
        row0, col0, row1, col1 = row1, col1, row0, col0
    width, height = col1 - col0, abs(row1 - row0)
    up = row1 > row0
    col = math.floor(col0)
    row = math.floor(row0) if up else math.ceil(row0) - 1
    last_col = math.ceil(col1) - 1
    last_row = math.ceil(row1) - 1 if up else math.floor(row1)
    turn = 1 if up else -1
    while True:
        if not free_of[classes[row, col]]:
            return BLOCKED
        if row == last_row and col == last_col:
            return CLEAR
        to_line = row + 1 - row0 if up else row0 - row
        order = compare_products(col + 1 - col0, height, to_line, width)
        if order == 0:
            # Through a corner: never through one of the endpoints, since a cell is still to come.
            if not free_of[classes[row, col + 1]] and not free_of[classes[row + turn, col]]:
                return BETWEEN
            row += turn
            col += 1
        elif order < 0:
            col += 1
        else:
            row += turn


@njit(cache=True, nogil=True)
def segment_codes(classes, free_of, positions):
    """Return the code of each segment of a polyline; a single point has one code."""
    n = positions.shape[0]
    codes = np.zeros(max(n - 1, 1), np.int8)
    for i in range(codes.size):
        j = min(i + 1, n - 1)
        codes[i] = segment_code(
            classes, free_of, positions[i, 0], positions[i, 1], positions[j, 0], positions[j, 1]
        )
    return codes


@njit(cache=True, nogil=True)
def crossed_joints(classes, free_of, positions):
    """Return for each point whether the polyline crosses a corner there between two free cells.

    Repeated points count once, as the last of them.
    """
    n = positions.shape[0]
    crossed = np.zeros(n, np.bool_)
    before = 0
    for i in range(1, n - 1):
        row, col = positions[i]
        if positions[i + 1, 0] == row and positions[i + 1, 1] == col:
            continue
        came_row, came_col = positions[before, 0] - row, positions[before, 1] - col
        before = i
        if row != math.floor(row) or col != math.floor(col) or (came_row == 0 and came_col == 0):
            continue
        crossing = crossing_at(classes, free_of, int(row), int(col))
        if crossing == 0:
            continue
        # The two free cells lie on opposite sides of the other diagonal through the corner.
        came = came_row + crossing * came_col
        goes = positions[i + 1, 0] - row + crossing * (positions[i + 1, 1] - col)
        crossed[i] = (came > 0) != (goes > 0)
    return crossed


@njit(cache=True, nogil=True)
def _sees(classes, free_of, positions, i, j):
    """Return whether a segment between two of some positions is legal."""
    return (
        segment_code(
            classes, free_of, positions[i, 0], positions[i, 1], positions[j, 0], positions[j, 1]
        )
        == CLEAR
    )


@njit(cache=True, nogil=True)
def visible_pairs(classes, free_of, corners, slopes):
    """Return the pairs i < j of corners that see each other and can be adjacent on a shortest path.

    A shortest path bends round a corner, so no segment of it points into the blocked cell there
    or straight away from it: `slopes` is the sign of (row offset * col offset) of that cell.
    """
    n = corners.shape[0]
    pairs = np.empty((1024, 2), np.int32)
    n_pairs = 0
    for i in range(n):
        for j in range(i + 1, n):
            row, col = corners[j, 0] - corners[i, 0], corners[j, 1] - corners[i, 1]
            if row * col * slopes[i] > 0 or row * col * slopes[j] > 0:
                continue
            if not _sees(classes, free_of, corners, i, j):
                continue
            if n_pairs == pairs.shape[0]:
                larger = np.empty((2 * n_pairs, 2), np.int32)
                larger[:n_pairs] = pairs
                pairs = larger
            pairs[n_pairs, 0], pairs[n_pairs, 1] = i, j
            n_pairs += 1
    return pairs[:n_pairs]


@njit(cache=True, nogil=True)
def visible_from(classes, free_of, row, col, corners, slopes):
    """Return the distance from a position to each corner that it sees, infinite to the others."""
    distances = np.full(corners.shape[0], np.inf)
    for i in range(corners.shape[0]):
        there_row, there_col = corners[i]
        if (there_row - row) * (there_col - col) * slopes[i] > 0:
            continue
        if segment_code(classes, free_of, row, col, there_row, there_col) == CLEAR:
            distances[i] = math.hypot(there_row - row, there_col - col)
    return distances


@njit(cache=True, nogil=True)
def cheapest_corners(offsets, heads, lengths, from_start, to_goal, to_goal_bound):
    """Return the corners on a shortest path between two positions, in order; empty if none.

    The search is A* with the straight distance to the goal as its bound. A shortest path is empty
    too if it needs no corner.

    `offsets`, int64 (n + 1,), `heads` and `lengths`, float64, are the graph of n corners in CSR
    form; `from_start`, `to_goal` and `to_goal_bound`, float64 (n,), are distances, infinite where
    an end does not see the corner. All lengths are in cells.
    """
    n = from_start.size
    best = from_start.copy()
    came = np.full(n, -1, np.int32)
    done = np.zeros(n, np.bool_)
    heap = [(np.inf, np.int32(-1))]
    for i in range(n):
        if best[i] < np.inf:
            heapq.heappush(heap, (best[i] + to_goal_bound[i], np.int32(i)))
    total, last = np.inf, np.int32(-1)
    while heap:
        bound, node = heapq.heappop(heap)
        if bound >= total or node < 0:
            break
        if done[node]:
            continue
        done[node] = True
        if best[node] + to_goal[node] < total:
            total, last = best[node] + to_goal[node], node
        for k in range(offsets[node], offsets[node + 1]):
            head = heads[k]
            length = best[node] + lengths[k]
            if length < best[head]:
                best[head], came[head] = length, node
                heapq.heappush(heap, (length + to_goal_bound[head], head))
    path = np.empty(n, np.int32)
    size = 0
    while last >= 0:
        path[size] = last
        size += 1
        last = came[last]
    return path[:size][::-1]
