"""Kernels of segments of free space: their shapes, the sides between them, merging."""

import math
from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit


class SegmentState(NamedTuple):
    """Segments, and the pairs of them that touch; lengths in cells. Merging changes the arrays."""

    free: np.ndarray
    """float64 (n,), free cells."""
    moments: np.ndarray
    """float64 (n, 6), cells with their reach, sums of row, col, row², row col, col²."""
    rims: np.ndarray
    """float64 (n,), sides round the cells with their reach."""
    peaks: np.ndarray
    """float64 (n,), greatest clearance."""
    opened: np.ndarray
    """float64 (n,), sides that are open to other segments."""
    hull_areas: np.ndarray
    """float64 (n,), area of the convex hull."""
    diameters: np.ndarray
    """float64 (n,), greatest distance between two corners of the hull."""
    hull_begins: np.ndarray
    """int64 (n,), where the corners of the hull begin in `hulls`."""
    hull_sizes: np.ndarray
    """int64 (n,), number of these corners."""
    degrees: np.ndarray
    """int64 (n,), number of segments that touch this one."""
    first_half: np.ndarray
    """int64 (n,), the first half pair of each segment, -1 for none."""
    versions: np.ndarray
    """int64 (n,), grows with each merge, -1 once another segment has taken it."""
    endpoints: np.ndarray
    """int64 (m, 2), the two segments of each pair; the first is -1 once the pair is gone."""
    open_sides: np.ndarray
    """float64 (m,), sides between free cells of both segments."""
    border_sides: np.ndarray
    """float64 (m,), sides with the reach into walls."""
    widest: np.ndarray
    """float64 (m,), greatest clearance on the open sides."""
    clearances: np.ndarray
    """float64 (m,), sum of the clearance on the open sides."""
    head: np.ndarray
    """int64 (m,), first run of open sides of each pair, -1 for none."""
    tail: np.ndarray
    """int64 (m,), last run of open sides of each pair, -1 for none."""
    next_half: np.ndarray
    """int64 (2 m,), the half pair that follows at the same segment, -1 for none."""
    next_run: np.ndarray
    """int64 (m,), the run that follows in the same pair, -1 for none."""
    run_begins: np.ndarray
    """int64 (m,), first of the sides of each run."""
    run_ends: np.ndarray
    """int64 (m,), where the sides of each run end."""
    sides: np.ndarray
    """float64 (k, 3), row, col, and 1 where the side lies along the columns."""
    wall: np.ndarray
    """bool (rows, cols), walls and the cells beside them."""
    hulls: np.ndarray
    """float64 (c, 2), corners of hulls, (row, col); those after `hulls_used` are free."""
    hulls_used: np.ndarray
    """int64 (1,), number of corners in use."""
    mark: np.ndarray
    """int64 (n,), scratch, -1."""


@njit(cache=True, nogil=True)
def hull_of(points, count, corners):
    """Fill `corners` with the convex hull of the first points; return its size and area."""
    order = np.argsort(points[:count, 0] * 1e6 + points[:count, 1], kind="mergesort")
    size = 0
    least = 2
    for step in range(2 * count - 1):
        i = order[step] if step < count else order[2 * count - 2 - step]
        if step == count:
            least = size + 1
        while size >= least:
            a, b = corners[size - 2], corners[size - 1]
            turn = (b[0] - a[0]) * (points[i, 1] - a[1]) - (b[1] - a[1]) * (points[i, 0] - a[0])
            if turn > 0:
                break
            size -= 1
        corners[size] = points[i]
        size += 1
    size = max(1, size - 1)
    area = 0.0
    for i in range(size):
        j = (i + 1) % size
        area += corners[i, 0] * corners[j, 1] - corners[j, 0] * corners[i, 1]
    return size, abs(area) / 2


@njit(cache=True, nogil=True)
def diameter_of(corners, size):
    """Return the greatest distance between two corners."""
    most = 0.0
    for i in range(size):
        for j in range(i):
            apart = (corners[i, 0] - corners[j, 0]) ** 2 + (corners[i, 1] - corners[j, 1]) ** 2
            most = max(most, apart)
    return math.sqrt(most)


@njit(cache=True, nogil=True)
def union_hull(state, u, v):
    """Return corners, size and area of the convex hull of two segments."""
    a, b = state.hull_sizes[u], state.hull_sizes[v]
    points = np.empty((a + b, 2))
    points[:a] = state.hulls[state.hull_begins[u] : state.hull_begins[u] + a]
    points[a:] = state.hulls[state.hull_begins[v] : state.hull_begins[v] + b]
    corners = np.empty((2 * (a + b) + 2, 2))
    size, area = hull_of(points, a + b, corners)
    return corners, size, area


class SegmentShapes(NamedTuple):
    """SegmentShapes of segments; see `SegmentState`."""

    free: np.ndarray
    """Free cells of each."""
    moments: np.ndarray
    """Sums of rows, columns and their products over the cells."""
    rims: np.ndarray
    """Sides of cells at walls and at other segments."""
    peaks: np.ndarray
    """The greatest clearance."""
    hull_begins: np.ndarray
    """Offsets of the hulls in `hulls`."""
    hull_sizes: np.ndarray
    """How many corners each hull has."""
    hull_areas: np.ndarray
    """Areas inside the hulls, cells."""
    diameters: np.ndarray
    """Greatest distances of two corners, cells."""
    hulls: np.ndarray
    """float64 (m, 2), corners of the hulls, one after the other."""


@guarded
@njit(cache=True, nogil=True)
def measure_segments(label_of, reaching, clearance, n):
    """Measure free cells, peaks, moments and rims of segments, and their hulls one after the
    other."""
    rows, cols = label_of.shape

    # Areas and clearance are those of free cells. Shape and rim include the reach into walls, so
    # that segments on both sides of a thin wall touch.
    free, peaks, rims = np.zeros(n), np.zeros(n), np.zeros(n)
    moments = np.zeros((n, 6))
    low, high = np.full(n, rows), np.full(n, -1)
    for row in range(rows):
        for col in range(cols):
            u = label_of[row, col]
            if u >= 0:
                free[u] += 1
                peaks[u] = max(peaks[u], clearance[row, col])
            u = reaching[row, col]
            if u < 0:
                continue

            # Sums, not means: when two segments merge, theirs add up.
            at = moments[u]
            at[0] += 1
            at[1] += row
            at[2] += col
            at[3] += row * row
            at[4] += row * col
            at[5] += col * col
            low[u] = min(low[u], row)
            high[u] = row

            # A side counts where another segment, no segment or the end of the map is beyond it.
            for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                r, c = row + step[0], col + step[1]
                if not (0 <= r < rows and 0 <= c < cols) or reaching[r, c] != u:
                    rims[u] += 1

    # Only the first and the last cell of a segment in a row can be on its hull: one place for each
    # row.
    begins = np.zeros(n + 1, np.int64)
    for u in range(n):
        begins[u + 1] = begins[u] + max(0, high[u] - low[u] + 1)
    left, right = np.full(begins[n], cols), np.full(begins[n], -1)
    for row in range(rows):
        for col in range(cols):
            u = reaching[row, col]
            if u >= 0:
                k = begins[u] + row - low[u]
                left[k] = min(left[k], col)
                right[k] = col

    # A hull has at most as many corners as points go in, four a row.
    hulls = np.empty((4 * begins[n] + 16, 2))
    hull_begins, sizes = np.zeros(n, np.int64), np.zeros(n, np.int64)
    areas, diameters = np.zeros(n), np.zeros(n)
    used = 0
    for u in range(n):
        points = np.empty((4 * (begins[u + 1] - begins[u]), 2))
        count = 0
        for k in range(begins[u], begins[u + 1]):
            if right[k] < 0:
                continue
            row = low[u] + k - begins[u]

            # The corners of both cells, not their centres: a hull then holds the area of its cells.
            for up in range(2):
                points[count] = float(row + up), float(left[k])
                points[count + 1] = float(row + up), float(right[k] + 1)
                count += 2

        # The hulls lie one behind the other, as `merge_pair` appends further ones.
        corners = np.empty((2 * count + 2, 2))
        sizes[u], areas[u] = hull_of(points, count, corners)
        hulls[used : used + sizes[u]] = corners[: sizes[u]]
        hull_begins[u] = used
        used += sizes[u]
        diameters[u] = diameter_of(corners, sizes[u])
    return (free, moments, rims, peaks), (hull_begins, sizes), (areas, diameters, hulls[:used])


@guarded
@njit(cache=True, nogil=True)
def sides_between(label_of, clearance):
    """Find sides between cells of two segments: both segments, middle and direction, clearance."""
    rows, cols = label_of.shape
    n = 0
    for fill in range(2):
        if fill:
            pairs = np.empty((n, 2), np.int64)
            sides = np.empty((n, 3))
            clear = np.empty(n)
            n = 0
        for row in range(rows):
            for col in range(cols):
                u = label_of[row, col]
                if u < 0:
                    continue
                for k in range(2):
                    r, c = row + k, col + 1 - k
                    if r >= rows or c >= cols or label_of[r, c] < 0 or label_of[r, c] == u:
                        continue
                    if fill:
                        pairs[n] = min(u, label_of[r, c]), max(u, label_of[r, c])
                        sides[n] = (row + r) / 2 + 0.5, (col + c) / 2 + 0.5, float(k)
                        clear[n] = min(clearance[row, col], clearance[r, c])
                    n += 1
    return pairs, sides, clear


@njit(cache=True, nogil=True)
def pairs_of(state, segment):
    """Return the pairs of a segment."""
    found = np.empty(int(state.degrees[segment]), np.int64)
    n, half = 0, state.first_half[segment]
    while half >= 0:
        if state.endpoints[half >> 1, 0] >= 0:
            found[n] = half >> 1
            n += 1
        half = state.next_half[half]
    return found


@njit(cache=True, nogil=True)
def merge_pairs(state, pairs):
    """Merge the segments of each pair; return the one that is left and the one that is gone."""
    found = np.empty((len(pairs), 2), np.int64)
    for k in range(len(pairs)):
        found[k] = merge_pair(state, pairs[k])
    return found


@njit(cache=True, nogil=True)
def merge_pair(state, pair):
    """Let the larger segment of a pair take the other; return both."""
    endpoints = state.endpoints
    u, v = endpoints[pair, 0], endpoints[pair, 1]

    # The larger segment keeps its number.
    if state.free[u] < state.free[v]:
        u, v = v, u
    n, border = state.open_sides[pair], max(state.border_sides[pair], state.open_sides[pair])

    # The hull of both goes behind the others; the two old ones are not used any more.
    corners, size, area = union_hull(state, u, v)
    begin = state.hulls_used[0]
    state.hulls[begin : begin + size] = corners[:size]
    state.hulls_used[0] = begin + size
    state.hull_begins[u], state.hull_sizes[u] = begin, size
    state.hull_areas[u], state.diameters[u] = area, diameter_of(corners, size)

    # The sides between both counted once for each, and are inside now.
    state.opened[u] += state.opened[v] - 2 * n
    state.rims[u] += state.rims[v] - 2 * border
    state.free[u] += state.free[v]
    state.moments[u] += state.moments[v]
    state.peaks[u] = max(state.peaks[u], state.peaks[v])
    state.versions[u] += 1
    state.versions[v] = -1
    endpoints[pair, 0] = -1

    # Mark each segment that touches u with the pair: the sum of both ends less u is that segment.
    for other in pairs_of_both(state, u):
        state.mark[endpoints[other, 0] + endpoints[other, 1] - u] = other

    # Where both touch the same segment, two pairs become one; any other pair of v becomes one of u.
    # A half pair is twice its pair, plus 1 for the second end.
    half = state.first_half[v]
    while half >= 0:
        following, at = state.next_half[half], half >> 1
        if endpoints[at, 0] >= 0:
            far = endpoints[at, 1 - (half & 1)]
            same = state.mark[far]
            if same >= 0:
                join_pairs(state, same, at)
                endpoints[at, 0] = -1
                state.degrees[far] -= 1
            else:
                endpoints[at, half & 1] = u
                state.next_half[half] = state.first_half[u]
                state.first_half[u] = half
        half = following

    # All marked segments still touch u: this clears their marks for the next merge.
    left = pairs_of_both(state, u)
    state.degrees[u] = len(left)
    for other in left:
        state.mark[endpoints[other, 0] + endpoints[other, 1] - u] = -1
    return u, v


@njit(cache=True, nogil=True)
def pairs_of_both(state, segment):
    """Return the pairs of a segment whose degree does not count yet; drop those that are gone."""
    n, half, before = 0, state.first_half[segment], -1
    while half >= 0:
        following = state.next_half[half]
        if state.endpoints[half >> 1, 0] >= 0:
            n += 1
            before = half
        elif before >= 0:
            state.next_half[before] = following
        else:
            state.first_half[segment] = following
        half = following
    state.degrees[segment] = n
    return pairs_of(state, segment)


@njit(cache=True, nogil=True)
def join_pairs(state, kept, gone):
    """Add the sides of one pair to another one between the same segments."""
    state.border_sides[kept] += state.border_sides[gone]
    if state.open_sides[gone] == 0:
        return
    if state.open_sides[kept] == 0:
        state.head[kept] = state.head[gone]
    else:
        state.next_run[state.tail[kept]] = state.head[gone]
    state.tail[kept] = state.tail[gone]
    state.open_sides[kept] += state.open_sides[gone]
    state.widest[kept] = max(state.widest[kept], state.widest[gone])
    state.clearances[kept] += state.clearances[gone]
