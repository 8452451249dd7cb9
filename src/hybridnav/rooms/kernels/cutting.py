"""Kernels over cells: floods, connected parts, cuts along walls, growth and numbers of labels, and
the sides between them."""

import math
from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import find
from hybridnav._base.trig import cos, hypot, sin


@njit(cache=True, nogil=True)
def large_parts(cells, least, none=0):
    """Number the parts of equal cells, connected along sides, of at least some cells, in the order
    of their first cells; int32 (rows, cols), -1 elsewhere.

    `cells`: a mask, or labels; `none`: what cells are that belong to no part.
    """
    rows, cols = cells.shape
    n_runs = 0
    for row in range(rows):
        n_runs += cells[row, 0] != none
        for col in range(1, cols):
            n_runs += cells[row, col] != none and cells[row, col] != cells[row, col - 1]
    part_of = np.full((rows, cols), np.int32(-1), np.int32)
    root, areas = np.arange(n_runs), np.zeros(n_runs, np.int64)
    join_runs(cells, none, part_of, root, areas)

    # The root of a run is one before it, so that one pass finds all roots.
    number = np.full(n_runs, np.int32(-1), np.int32)
    for run in range(n_runs):
        root[run] = root[root[run]]
        if root[run] != run:
            areas[root[run]] += areas[run]
    n_parts = 0
    for run in range(n_runs):
        if root[run] == run and areas[run] >= least:
            number[run] = n_parts
            n_parts += 1
        number[run] = number[root[run]]
    for row in range(rows):
        for col in range(cols):
            if part_of[row, col] >= 0:
                part_of[row, col] = number[part_of[row, col]]
    return part_of


@njit(cache=True, nogil=True)
def join_runs(cells, none, part_of, root, areas):
    """Number the runs of equal cells along rows, count their cells, and give those that touch one
    root, the first of them."""
    run = -1
    for row in range(cells.shape[0]):
        was_joined = False
        for col in range(cells.shape[1]):
            here = cells[row, col]
            if here == none:
                continue
            if col == 0 or cells[row, col - 1] != here:
                run += 1
                was_joined = False
            part_of[row, col] = run
            areas[run] += 1
            is_joined = row > 0 and cells[row - 1, col] == here
            if is_joined and not was_joined:
                one, other = find(root, np.int64(part_of[row - 1, col])), find(root, run)
                root[max(one, other)] = min(one, other)
            was_joined = is_joined


@njit(cache=True, nogil=True)
def by_falling_square(squares, free):
    """Return free cells by falling square, then in their order: their indices in a grid with a rim
    of one cell, int32."""
    rows, cols = free.shape
    top, count = np.int32(0), 0
    for row in range(rows):
        for col in range(cols):
            top, count = max(top, squares[row, col] * free[row, col]), count + free[row, col]
    if top > 4 * free.size:  # far from all walls, there are few cells for each of many squares
        cells = np.flatnonzero(free)
        cells = cells[np.argsort(-squares.ravel()[cells], kind="mergesort")]
        return ((cells // cols + 1) * (cols + 2) + cells % cols + 1).astype(np.int32)
    order, begins = np.empty(count, np.int32), np.zeros(top + 2, np.int32)
    for row in range(rows):
        for col in range(cols):
            if free[row, col]:
                begins[top - squares[row, col] + 1] += 1
    for k in range(top + 1):
        begins[k + 1] += begins[k]
    for row in range(rows):
        for col in range(cols):
            if free[row, col]:
                k = top - squares[row, col]
                order[begins[k]] = (row + 1) * (cols + 2) + col + 1
                begins[k] += 1
    return order


@njit(cache=True, nogil=True)
def flood_basins(squares, free, ratio, broad):
    """Return the basin of each free cell, int32 (rows, cols), -1 elsewhere, by a flood from the
    clearest cells down.

    Where two basins meet they merge, unless the clearance there is below `ratio` times that of the
    lower peak and below `broad`. `squares`: int32, the squares of the clearance in cells.
    """
    rows, cols = free.shape
    n_peaks = 0  # no more than cells that are clearest in their row
    for row in range(rows):
        for col in range(cols):
            if free[row, col]:
                here = squares[row, col]
                rises = col == 0 or not free[row, col - 1] or squares[row, col - 1] < here
                falls = col + 1 == cols or not free[row, col + 1] or squares[row, col + 1] <= here
                n_peaks += rises and falls
    rimmed = np.full((rows + 2, cols + 2), np.int32(-1), np.int32)
    root, peak = np.empty(n_peaks, np.int32), np.empty(n_peaks, np.int32)
    count = flood(by_falling_square(squares, free), squares, rimmed, root, peak, (ratio, broad))
    for k in range(count):
        root[k] = find(root, np.int32(k))
    for row in range(1, rows + 1):
        for col in range(1, cols + 1):
            if rimmed[row, col] >= 0:
                rimmed[row, col] = root[rimmed[row, col]]
    return rimmed[1:-1, 1:-1]


@njit(cache=True, nogil=True)
def flood(order, squares, rimmed, root, peak, limits):
    """Let cells in an order join the basins beside them, or begin one; return how many began.
    `limits`: the ratio and the breadth of `flood_basins`."""
    width = rimmed.shape[1]
    basin, (ratio, broad) = rimmed.reshape(rimmed.size), limits
    count = np.int32(0)
    for cell in order:
        mine = np.int32(-1)
        for step in (1, -1, width, -width):
            if basin[cell + step] < 0:
                continue
            other = find(root, basin[cell + step])
            if mine < 0:
                mine = other
            elif other != mine:
                here = math.sqrt(squares[cell // width - 1, cell % width - 1])
                low = math.sqrt(min(peak[mine], peak[other]))
                if here >= min(broad, ratio * low):
                    if peak[other] > peak[mine]:
                        mine, other = other, mine
                    root[other] = mine
        if mine < 0:
            mine = count
            root[mine] = mine
            peak[mine] = squares[cell // width - 1, cell % width - 1]
            count += np.int32(1)
        basin[cell] = mine
    return count


@njit(cache=True, nogil=True)
def transposed(cells):
    """Return the transpose of an array, copied in blocks that the processor's cache holds."""
    rows, cols = cells.shape
    found = np.empty((cols, rows), cells.dtype)
    for top in range(0, rows, 64):
        for left in range(0, cols, 64):
            for col in range(left, min(left + 64, cols)):
                for row in range(top, min(top + 64, rows)):
                    found[col, row] = cells[row, col]
    return found


@njit(cache=True, nogil=True)
def cross(label_of, basin_of):
    """Number the pairs of a label and a basin that cells have, by the first and then the second, in
    place; -1 where one of both is."""
    rows, cols = label_of.shape
    most, n_runs = -1, 0
    for row in range(rows):
        for col in range(cols):
            label, basin = label_of[row, col], basin_of[row, col]
            most = max(most, label)
            n_runs += col == 0 or label != label_of[row, col - 1] or basin != basin_of[row, col - 1]

    # The pairs of each label are a linked list; most cells have the pair of the cell before.
    first = np.full(most + 1, -1)
    pairs, following = np.empty((n_runs, 2), np.int64), np.empty(n_runs, np.int64)
    count = 0
    for row in range(rows):
        before, basin_before, at = -1, -1, -1
        for col in range(cols):
            label, basin = label_of[row, col], basin_of[row, col]
            if label < 0 or basin < 0:
                label_of[row, col] = -1
                continue
            if label != before or basin != basin_before:
                before, basin_before, at = label, basin, first[label]
                while at >= 0 and pairs[at, 1] != basin:
                    at = following[at]
                if at < 0:
                    at, pairs[count, 0], pairs[count, 1] = count, label, basin
                    following[count], first[label] = first[label], count
                    count += 1
            label_of[row, col] = at

    # Numbers by label and then by basin.
    many = pairs[:count, 1].max() + 1 if count else 1
    order = np.argsort(pairs[:count, 0] * many + pairs[:count, 1])
    number = np.empty(count, np.int32)
    for k in range(count):
        number[order[k]] = k
    for row in range(rows):
        for col in range(cols):
            if label_of[row, col] >= 0:
                label_of[row, col] = number[label_of[row, col]]


@njit(cache=True, nogil=True)
def number_from_above(label_of, least):
    """Number labels of at least some cells by their first cells from the last row down, in place;
    the others become -1."""
    most = -1
    for label in label_of.flat:
        most = max(most, label)
    areas, order, n_found = np.zeros(most + 1, np.int64), np.empty(most + 1, np.int64), 0
    for row in range(label_of.shape[0] - 1, -1, -1):
        for col in range(label_of.shape[1]):
            label = label_of[row, col]
            if label >= 0:
                if areas[label] == 0:
                    order[n_found] = label
                    n_found += 1
                areas[label] += 1
    number = 0
    for label in order[:n_found]:
        large = areas[label] >= least
        areas[label] = number if large else -1
        number += large
    for row in range(label_of.shape[0]):
        for col in range(label_of.shape[1]):
            if label_of[row, col] >= 0:
                label_of[row, col] = areas[label_of[row, col]]


@njit(cache=True, nogil=True, _nrt=False)
def take_nearest(label_of, wanted, offsets, found):
    """Give each wanted cell the label of the first offset (row, col) at which there is one."""
    rows, cols = label_of.shape
    for row in range(rows):
        for col in range(cols):
            if not wanted[row, col]:
                continue
            for k in range(len(offsets)):
                r, c = row + offsets[k, 0], col + offsets[k, 1]
                if 0 <= r < rows and 0 <= c < cols and label_of[r, c] >= 0:
                    found[row, col] = label_of[r, c]
                    break


@njit(cache=True, nogil=True, _nrt=False)
def grow_labels(label_of, region, queue, tail, most_steps):
    """Spread labels from the first cells of a queue by steps along sides, in place.

    `queue`: int64, flat indices of the cells that labels begin from, `tail` of them, and room for
    the cells that they reach; for the others see `cutting.spread`.
    """
    rows, cols = label_of.shape
    head = 0
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
    rows, cols = wall.shape

    # How far lines have risen at each column, and the column where they rise next.
    shift, after = np.empty(cols, np.int64), np.full(cols, cols)
    for col in range(cols):
        shift[col] = round(slope * col)
    for col in range(cols - 2, -1, -1):
        after[col] = after[col + 1] if shift[col] == shift[col + 1] else col + 1
    at = np.empty(cols, np.int64)
    for line in range(-shift.max(), rows - shift.min()):
        # The columns of walls on the line.
        n = end = 0
        while end < cols:
            begin, row, end = end, line + shift[end], after[end]
            if 0 <= row < rows:
                for col in range(begin, end):
                    if wall[row, col]:
                        at[n] = col
                        n += 1

        # Gaps between two of them.
        for k in range(1, n):
            last, col = at[k - 1], at[k]
            gap = col - last - 1
            if not 0 < gap <= lengths.longest:
                continue
            before = behind = 0
            while before < k and at[k - 1 - before] > last - lengths.window:
                before += 1
            while behind < n - k and at[k + behind] < col + lengths.window:
                behind += 1
            held = gap <= lengths.door or min(before, behind) >= lengths.side
            if held and before + behind >= lengths.both:
                n_free = n_within = 0
                for c in range(last + 1, col):
                    n_free += free[line + shift[c], c]
                    n_within += within[line + shift[c], c]
                if n_free >= share * gap and 2 * n_within >= gap:
                    for c in range(last + 1, col):
                        cut[line + shift[c], c] = True


@guarded
@njit(cache=True, nogil=True)
def sides_between(label_of, squares):
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
                        clear[n] = math.sqrt(min(squares[row, col], squares[r, c]))
                    n += 1
    return pairs, sides, clear
