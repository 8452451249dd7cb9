"""Kernels of the room segmentation: floods, cuts along walls, growth of labels, and the evidence on
a boundary between two segments with the forest that judges it.
"""

import math
from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.arrays import find
from hybridnav._base.trig import atan2, cos, exp, hypot, sin
from hybridnav.rooms.kernels.merging import union_hull


@njit(cache=True, nogil=True)
def flood_basins(clearance, order, cols, ratio, broad):
    """Return the basin of each flat cell, -1 outside `order`, by a flood from the clearest cells
    down.

    `order` holds flat cells by falling clearance, none on the rim of the grid. Where two basins
    meet they merge, unless the clearance there is below `ratio` times that of the lower peak and
    below `broad`.
    """
    basin = np.full(clearance.size, np.int32(-1), np.int32)
    root = np.empty(order.size, np.int64)
    peak = np.empty(order.size, np.float64)
    count = 0
    steps = (1, -1, cols, -cols)
    for k in range(order.size):
        cell = order[k]
        here = clearance[cell]
        mine = -1
        for step in steps:
            if basin[cell + step] < 0:
                continue
            other = find(root, np.int64(basin[cell + step]))
            if mine < 0:
                mine = other
            elif other != mine and here >= min(broad, ratio * min(peak[mine], peak[other])):
                if peak[other] > peak[mine]:
                    mine, other = other, mine
                root[other] = mine
        if mine < 0:
            mine = count
            root[mine] = mine
            peak[mine] = here
            count += 1
        basin[cell] = mine
    for k in range(order.size):
        basin[order[k]] = find(root, np.int64(basin[order[k]]))
    return basin


@njit(cache=True, nogil=True)
def grow_labels(label_of, region, most_steps):
    """Spread labels by steps along sides, each cell taking the nearest, in place.

    Steps go only between cells of one region, none into region -1, and at most `most_steps` from
    where a label begins.
    """
    rows, cols = label_of.shape
    queue = np.empty(rows * cols, np.int64)
    head = tail = 0
    for row in range(rows):
        for col in range(cols):
            if label_of[row, col] < 0:
                continue
            for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):  # others spread to nothing
                r, c = row + step[0], col + step[1]
                if 0 <= r < rows and 0 <= c < cols and label_of[r, c] < 0:
                    queue[tail] = row * cols + col
                    tail += 1
                    break
    for _ in range(most_steps):
        if head == tail:
            break
        for at in range(head, tail):  # the cells that the last step labelled
            row, col = queue[at] // cols, queue[at] % cols
            for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                to_row, to_col = row + step[0], col + step[1]
                if not (0 <= to_row < rows and 0 <= to_col < cols):
                    continue
                here = region[to_row, to_col]
                if label_of[to_row, to_col] < 0 and 0 <= here == region[row, col]:
                    label_of[to_row, to_col] = label_of[row, col]
                    queue[tail] = to_row * cols + to_col
                    tail += 1
            head += 1


@njit(cache=True, nogil=True)
def sharpness(rows, cols, angles):
    """Measure how sharp the projections of points on two square axes are at each angle."""
    found = np.zeros(len(angles))
    side = int(hypot(np.abs(rows).max(), np.abs(cols).max())) + 2
    one, other = np.zeros(2 * side + 1, np.int64), np.zeros(2 * side + 1, np.int64)
    for k in range(len(angles)):
        cosine, sine = cos(angles[k]), sin(angles[k])
        one[:] = 0
        other[:] = 0
        for i in range(len(rows)):
            one[side + math.floor(rows[i] * cosine - cols[i] * sine)] += 1
            other[side + math.floor(cols[i] * cosine + rows[i] * sine)] += 1
        for b in range(2 * side):
            found[k] += float(one[b] + one[b + 1]) ** 2 + float(other[b] + other[b + 1]) ** 2
    return found


class GapLengths(NamedTuple):
    """Lengths of gaps between walls, in cells."""

    longest: int
    """The longest gap that is looked for."""
    door: int
    """A gap that needs no least wall on either side."""
    window: int
    """What is looked at beside a gap."""
    side: int
    """The least wall in it on either side."""
    both: int
    """The least wall on both sides together."""


@njit(cache=True, nogil=True)
def cut_along(wall, free, slope, within, lengths, share, cut):
    """Set the cells of the gaps between walls that continue each other on a line.

    Lines rise by a slope, one through each cell.

    Parameters
    ----------
    wall, free
        bool (rows, cols).
    slope
        Rows a column.
    within
        bool (rows, cols), cells of which at least half of a gap consists.
    lengths
        `GapLengths`.
    share
        Least share of free cells in the gap.
    cut
        bool (rows, cols), filled in.
    """
    window = lengths.window
    rows, cols = wall.shape
    shift = np.empty(cols, np.int64)
    for col in range(cols):
        shift[col] = round(slope * col)
    walls = np.zeros(cols + 1, np.int64)
    for line in range(-shift.max(), rows - shift.min()):
        for col in range(cols):
            row = line + shift[col]
            walls[col + 1] = walls[col] + (0 <= row < rows and wall[row, col])
        if walls[cols] == 0:
            continue
        last = -1
        for col in range(cols):
            if walls[col + 1] == walls[col]:
                continue
            gap = col - last - 1
            before = walls[last + 1] - walls[max(0, last + 1 - window)]
            behind = walls[min(cols, col + window)] - walls[col]
            held = gap <= lengths.door or min(before, behind) >= lengths.side
            is_gap = last >= 0 and 0 < gap <= lengths.longest
            if is_gap and held and before + behind >= lengths.both:
                n_free = n_within = 0
                for at in range(last + 1, col):
                    n_free += free[line + shift[at], at]
                    n_within += within[line + shift[at], at]
                if n_free >= share * gap and 2 * n_within >= gap:
                    for at in range(last + 1, col):
                        cut[line + shift[at], at] = True
            last = col


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


@njit(cache=True, nogil=True)
def probabilities(evidence, features, thresholds, leaves, base):
    """Return the probability of each row by a forest of complete trees, stored level by level."""
    inner = features.shape[1]
    found = np.empty(len(evidence))
    for k in range(len(evidence)):
        total = base
        for tree in range(len(features)):
            node = 0
            while node < inner:
                right = evidence[k, features[tree, node]] > thresholds[tree, node]
                node = 2 * node + 1 + right
            total += leaves[tree, node - inner]
        found[k] = 1 / (1 + exp(-total))
    return found
