"""Kernels of the room segmentation: floods, gaps in walls, growth of labels."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.search.arrays import find


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
