"""Kernels of segments of free space: their shapes, merging, and the evidence on a boundary between
two."""

import math
from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.trig import atan2, cos, hypot, sin


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
    squares: np.ndarray
    """float64 (n,), sum of the squares of the clearance of free cells."""
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
    squares: np.ndarray
    """Sums of the squares of the clearance."""
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
def measure_segments(label_of, reaching, squares, n):
    """Measure free cells, peaks, moments and rims of segments, and their hulls one after the
    other. `squares`: int32, those of the clearance in cells."""
    rows, cols = label_of.shape

    # Areas and clearance are those of free cells. Shape and rim include the reach into walls, so
    # that segments on both sides of a thin wall touch.
    free, peaks, rims, sums = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    moments = np.zeros((n, 6))
    low, high = np.full(n, rows), np.full(n, -1)
    for row in range(rows):
        end = 0
        while end < cols:  # a run of cells of one segment
            begin, u = end, reaching[row, end]
            n_free, top, total = 0, np.int32(0), 0
            while end < cols and reaching[row, end] == u:
                if label_of[row, end] >= 0:
                    n_free, top = n_free + 1, max(top, squares[row, end])
                    total += squares[row, end]
                end += 1
            if u < 0:
                continue
            free[u] += n_free
            peaks[u] = max(peaks[u], top)
            sums[u] += total
            low[u], high[u] = min(low[u], row), row

            # Sums, not means: when two segments merge, theirs add up.
            count, along = end - begin, (end - begin) * (begin + end - 1) // 2
            at = moments[u]
            at[0] += count
            at[1] += row * count
            at[2] += along
            at[3] += row * row * count
            at[4] += row * along
            at[5] += ((end - 1) * end * (2 * end - 1) - (begin - 1) * begin * (2 * begin - 1)) // 6

            # A side counts where another segment, no segment or the end of the map is beyond it.
            rims[u] += 2
            for other in (row - 1, row + 1):
                if not 0 <= other < rows:
                    rims[u] += count
                    continue
                n_sides = 0
                for col in range(begin, end):
                    n_sides += reaching[other, col] != u
                rims[u] += n_sides

    # Only the first and the last cell of a segment in a row can be on its hull: one place for each
    # row.
    begins = np.zeros(n + 1, np.int64)
    for u in range(n):
        begins[u + 1] = begins[u] + max(0, high[u] - low[u] + 1)
    left, right = np.full(begins[n], cols), np.full(begins[n], -1)
    for row in range(rows):
        before = -1
        for col in range(cols):
            u = reaching[row, col]
            if u != before and u >= 0:
                k = begins[u] + row - low[u]
                left[k] = min(left[k], col)
            if u != before and before >= 0:
                right[begins[before] + row - low[before]] = col - 1
            before = u
        if before >= 0:
            right[begins[before] + row - low[before]] = cols - 1

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
    return (
        (free, moments, rims, np.sqrt(peaks), sums),
        (hull_begins, sizes),
        (areas, diameters, hulls[:used]),
    )


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
    state.squares[u] += state.squares[v]
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


@njit(cache=True, nogil=True, _nrt=False)
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


@njit(cache=True, nogil=True)
def is_wall(wall, row, col):
    """Return whether a point in cells lies in a wall."""
    r, c = math.floor(row), math.floor(col)
    return 0 <= r < wall.shape[0] and 0 <= c < wall.shape[1] and wall[r, c]


@njit(cache=True, nogil=True)
def flush(wall, end, outward, across, reach):
    """Return the share of an arm, square to an opening at its end, that runs on a wall.

    The arm has 3/4 of the reach."""
    arm, skip, deep = (3 * reach) // 4, max(1, reach // 7), max(2, reach // 7)
    met = 0
    for k in range(skip, arm + 1):
        for out in range(-2, deep + 1):
            row = end[0] + outward[0] * out + across[0] * k
            if is_wall(wall, row, end[1] + outward[1] * out + across[1] * k):
                met += 1
                break
    return met / (arm + 1 - skip)


@njit(cache=True, nogil=True)
def opening_of(state, pair, reach, found):
    """Fill `found` with what the open sides of a pair look like along their main axis.

    Span, deviation, sides along the axis, lower and higher jamb, share of wall inside, direction,
    longest run, lower, higher and mean share of walls that run on square to it.
    """
    # First and second moments of the middles of the sides; how many lie along the columns.
    wall = state.wall
    n, upright = 0, 0.0
    row = col = rr = rc = cc = 0.0
    run = state.head[pair]
    while run >= 0:
        for i in range(state.run_begins[run], state.run_ends[run]):
            x, y = state.sides[i, 0], state.sides[i, 1]
            n += 1
            upright += state.sides[i, 2]
            row, col, rr, rc, cc = row + x, col + y, rr + x * x, rc + x * y, cc + y * y
        run = state.next_run[run]
    row, col = row / n, col / n
    rr, rc, cc = rr / n - row * row, rc / n - row * col, cc / n - col * col

    # Eigenvalues of the covariance: the spread along and across the main axis, whose direction is
    # the eigenvector of the greater one.
    half = math.sqrt(max(0.0, (rr - cc) ** 2 / 4 + rc * rc))
    major, minor = (rr + cc) / 2 + half, max(0.0, (rr + cc) / 2 - half)
    by_row, by_col = rc, major - rr
    norm = hypot(by_row, by_col)

    # Few or close sides have no clear main axis: the direction of most decides. The vector vanishes
    # where the axis is that of the rows.
    if n < 3 or major < 0.3:
        by_row, by_col, norm = (0.0, 1.0, 1.0) if 2 * upright >= n else (1.0, 0.0, 1.0)
    elif norm < 1e-9:
        by_row, by_col, norm = (1.0, 0.0, 1.0) if rr >= cc else (0.0, 1.0, 1.0)
    by_row, by_col = by_row / norm, by_col / norm

    # From end to end along the axis; a side is one cell long, hence the one added.
    low, high = np.inf, -np.inf
    run = state.head[pair]
    while run >= 0:
        for i in range(state.run_begins[run], state.run_ends[run]):
            at = (state.sides[i, 0] - row) * by_row + (state.sides[i, 1] - col) * by_col
            low, high = min(low, at), max(high, at)
        run = state.next_run[run]
    span = high - low + 1.0

    # Sides in the same place along the axis count once: a ragged border is no wider opening.
    covered = np.zeros(int(span) + 2, np.bool_)
    run = state.head[pair]
    while run >= 0:
        for i in range(state.run_begins[run], state.run_ends[run]):
            at = (state.sides[i, 0] - row) * by_row + (state.sides[i, 1] - col) * by_col
            covered[int(at - low)] = True
        run = state.next_run[run]

    # Wall in line with the opening: beyond both ends, as beside a door, and between them.
    before = behind = inside = 0
    for k in range(1, reach + 1):
        before += is_wall(wall, row + by_row * (low - k), col + by_col * (low - k))
        behind += is_wall(wall, row + by_row * (high + k), col + by_col * (high + k))
    for k in range(int(span)):
        at = low + k + 0.5
        inside += is_wall(wall, row + by_row * at, col + by_col * at)

    # Runs of covered places are the openings of which the border consists.
    total = runs = longest = length = 0
    for k in range(len(covered)):
        length = length + 1 if covered[k] else 0
        total += covered[k]
        runs += length == 1
        longest = max(longest, length)

    # Walls that run on square to the opening, by end and hand. A hand is flush only where both ends
    # have such a wall: the lesser arm counts.
    arms = np.empty((2, 2))
    for end in range(2):
        at, sign = (low, -1.0) if end == 0 else (high, 1.0)
        point = (row + by_row * at, col + by_col * at)
        out = (sign * by_row, sign * by_col)
        arms[end, 0] = flush(wall, point, out, (-by_col, by_row), reach)
        arms[end, 1] = flush(wall, point, out, (by_col, -by_row), reach)
    one, other = min(arms[0, 0], arms[1, 0]), min(arms[0, 1], arms[1, 1])
    found[0], found[1], found[2] = span, math.sqrt(minor), total
    found[3], found[4] = min(before, behind) / reach, max(before, behind) / reach
    found[5] = inside / max(1, int(span))
    found[6], found[7], found[8], found[9] = by_row, by_col, runs, longest
    found[10], found[11], found[12] = min(one, other), max(one, other), arms.mean()


@guarded
@njit(cache=True, nogil=True)
def widest_openings(state, pairs):
    """Return the breadth of the widest opening of each pair, float64 (n,), in cells.

    An opening consists of sides that touch: a corridor meets another one at both of its ends.
    """
    breadths = np.zeros(len(pairs))
    for k in range(len(pairs)):
        n, run = 0, state.head[pairs[k]]
        sides = np.empty((int(state.open_sides[pairs[k]]), 2))
        while run >= 0:
            for i in range(state.run_begins[run], state.run_ends[run]):
                sides[n] = state.sides[i, :2]
                n += 1
            run = state.next_run[run]

        # `order` has the sides of this opening up to `end`, and those that are not met behind it.
        order, end = np.arange(n), 0
        while end < n:
            at, end = end, end + 1
            low, high = sides[order[at]].copy(), sides[order[at]].copy()
            while at < end:
                row, col = sides[order[at]]
                low[0], high[0] = min(low[0], row), max(high[0], row)
                low[1], high[1] = min(low[1], col), max(high[1], col)
                for other in range(end, n):
                    there = sides[order[other]]
                    if abs(there[0] - row) <= 1 and abs(there[1] - col) <= 1:
                        order[end], order[other] = order[other], order[end]
                        end += 1
                at += 1
            breadths[k] = max(breadths[k], hypot(high[0] - low[0], high[1] - low[1]) + 1)
    return breadths


@njit(cache=True, nogil=True)
def axes_of(moments):
    """Return the elongation of cells, and the angle of their main axis from the rows."""
    n = moments[0]
    row, col = moments[1] / n, moments[2] / n
    rr, rc = moments[3] / n - row * row, moments[4] / n - row * col
    cc = moments[5] / n - col * col
    half = math.sqrt(max(0.0, (rr - cc) ** 2 / 4 + rc * rc))
    major, minor = max(0.08, (rr + cc) / 2 + half), max(0.08, (rr + cc) / 2 - half)
    return math.sqrt(major / minor), 0.5 * atan2(2 * rc, rr - cc)


@njit(cache=True, nogil=True)
def fill_evidence(state, pairs, resolution, reach, jamb, evidence):
    """Fill the evidence of each pair, in the order of `EVIDENCE`, the smaller segment first."""
    found = np.empty(13)
    for k in range(len(pairs)):
        pair, row = pairs[k], evidence[k]
        u, v = state.endpoints[pair, 0], state.endpoints[pair, 1]

        # By size, as `EVIDENCE` asks: the numbers of segments must not change a judgement.
        if state.free[u] > state.free[v]:
            u, v = v, u
        opening_of(state, pair, jamb, found)

        # The border with the reach into walls, but at least the open sides: their share is at most
        # 1.
        n, border = state.open_sides[pair], max(state.border_sides[pair], state.open_sides[pair])
        _corners, _size, hull_area = union_hull(state, u, v)

        # Two parts of one convex room fill the hull of both.
        area_u, area_v = state.moments[u, 0], state.moments[v, 0]
        solid_u, solid_v = area_u / state.hull_areas[u], area_v / state.hull_areas[v]
        solid = (area_u + area_v) / hull_area
        long_u, axis_u = axes_of(state.moments[u])
        long_v, axis_v = axes_of(state.moments[v])
        long_both, _ = axes_of(state.moments[u] + state.moments[v])

        # Mean breadth: the area over the greatest length, without the reach into both walls.
        broad_u = max(1.0, area_u / max(1.0, state.diameters[u]) - 2 * reach)
        broad_v = max(1.0, area_v / max(1.0, state.diameters[v]) - 2 * reach)
        rim_u, rim_v = state.rims[u], state.rims[v]
        rim = max(1.0, rim_u + rim_v - 2 * border)
        widest, peak_u, peak_v = state.widest[pair], state.peaks[u], state.peaks[v]
        width, axis = found[2], atan2(found[7], found[6])

        # The opening. Lengths are in metres, so that maps of all resolutions share one forest.
        row[0], row[1], row[2] = width * resolution, found[0] * resolution, width / found[0]
        row[3], row[4] = found[1] * resolution, found[1] / found[0]
        row[5], row[6], row[7] = found[3], found[4], found[5]

        # Clearance on it, and against the clearest cells of both segments: a door is narrow for
        # both.
        row[8], row[9] = widest * resolution, state.clearances[pair] / n * resolution
        row[10] = widest / max(1.0, min(peak_u, peak_v))
        row[11] = widest / max(1.0, peak_u, peak_v)

        # How much of the border and of each rim it takes; how open both are now, and as one.
        row[12], row[13], row[14] = n / border, n / rim_u, n / rim_v
        row[15], row[16] = min(1.0, state.opened[u] / rim_u), min(1.0, state.opened[v] / rim_v)
        row[17] = min(1.0, (state.opened[u] + state.opened[v] - 2 * n) / rim)

        # How convex both are, and what merging gains over their mean by area.
        row[18], row[19], row[20] = solid_u, solid_v, solid
        row[21] = solid - (area_u * solid_u + area_v * solid_v) / (area_u + area_v)

        # Sizes, shapes and directions of both, and of the opening against them.
        row[22], row[23] = peak_u * resolution, peak_v * resolution
        row[24], row[25] = broad_u * resolution, broad_v * resolution
        row[26], row[27], row[28] = long_u, long_v, long_both
        row[29], row[30] = width / broad_u, width / broad_v
        row[31], row[32] = abs(cos(axis_u - axis_v)), abs(sin(axis - axis_u))
        row[33] = abs(sin(axis - axis_v))
        row[34], row[35] = state.degrees[u], state.degrees[v]

        # A divided or ragged opening is wider than the clearance on it allows. Then its parts, and
        # the walls flush with it.
        row[36] = width * resolution / max(0.3, 2 * widest * resolution)
        row[37], row[38] = found[8], found[9] * resolution
        row[39], row[40], row[41] = found[10], found[11], found[12]
