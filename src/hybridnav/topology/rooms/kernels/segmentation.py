"""Kernels of the room segmentation: floods, gaps in walls, growth of labels."""

from __future__ import annotations

import math

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.arrays import find
from hybridnav._base.trig import cos, sin


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
def gaps_in_rows(wall, free, longest, short, window, side, both, share):
    """Return the cells of the gaps between walls that continue each other along a row.

    A gap counts when enough of its cells are free and there is enough wall on both sides.

    Parameters
    ----------
    wall, free
        bool (rows, cols).
    longest
        Cells of the longest gap.
    short
        Cells of a gap that needs only `both`, not `side`.
    window
        Cells looked at on either side of the gap.
    side, both
        Wall cells needed on each side, and on both together.
    share
        Least share of free cells in the gap.

    Returns
    -------
    ndarray
        bool (rows, cols).
    """
    rows, cols = wall.shape
    found = np.zeros((rows, cols), np.bool_)
    walls = np.zeros(cols + 1, np.int64)
    for row in range(rows):
        for col in range(cols):
            walls[col + 1] = walls[col] + wall[row, col]
        last = -1
        for col in range(cols):
            if not wall[row, col]:
                continue
            gap = col - last - 1
            if last >= 0 and 0 < gap <= longest:
                before = walls[last + 1] - walls[max(0, last + 1 - window)]
                behind = walls[min(cols, col + window)] - walls[col]
                held = gap <= short or min(before, behind) >= side
                if held and before + behind >= both:
                    n_free = 0
                    for i in range(last + 1, col):
                        n_free += free[row, i]
                    if n_free >= share * gap:
                        found[row, last + 1 : col] = True
            last = col
    return found


@njit(cache=True, nogil=True)
def grow_labels(label_of, region, most_steps):
    """Spread labels by steps along sides, each cell taking the nearest, in place.

    Steps go only between cells of one region, none into region -1, and at most `most_steps` from
    where a label begins.
    """
    rows, cols = label_of.shape
    queue = np.empty(rows * cols, np.int64)
    head = tail = 0
    for cell in range(rows * cols):
        if label_of[cell // cols, cell % cols] >= 0:
            queue[tail] = cell
            tail += 1
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
    side = int(math.hypot(np.abs(rows).max(), np.abs(cols).max())) + 2
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
        As of `gaps_in_rows`, in cells: the longest gap, a door, the window, the least wall on
        either side and on both.
    share
        Least share of free cells in the gap.
    cut
        bool (rows, cols), filled in.
    """
    longest, door, window, side, both = lengths
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
            held = gap <= door or min(before, behind) >= side
            if last >= 0 and 0 < gap <= longest and held and before + behind >= both:
                n_free = n_within = 0
                for at in range(last + 1, col):
                    n_free += free[line + shift[at], at]
                    n_within += within[line + shift[at], at]
                if n_free >= share * gap and 2 * n_within >= gap:
                    for at in range(last + 1, col):
                        cut[line + shift[at], at] = True
            last = col
