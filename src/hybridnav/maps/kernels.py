"""Kernels of positions on a grid: centres of cells, as `Frame` converts them, and the cells that a
polyline passes.
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.trig import hypot


@njit(cache=True, nogil=True)
def centres(cells, frame):
    """Return the centres of cells in the map frame, float64 (n, 2), those of `Frame.points_of`.

    `cells` are (row, col), int64 (n, 2), and `frame` is `Frame.for_kernels`.
    """
    resolution, cosine, sine = frame.resolution, frame.cosine, frame.sine
    points = np.empty((cells.shape[0], 2), np.float64)
    for i in range(cells.shape[0]):
        x, y = (cells[i, 1] + 0.5) * resolution, (cells[i, 0] + 0.5) * resolution
        points[i, 0] = frame.x + cosine * x - sine * y
        points[i, 1] = frame.y + sine * x + cosine * y
    return points


@guarded
@njit(cache=True, nogil=True)
def points_at(positions, frame):
    """Return the points of positions in grid units, float64 (n, 2), as `Frame.points_of_grid`."""
    resolution, cosine, sine = frame.resolution, frame.cosine, frame.sine
    points = np.empty((positions.shape[0], 2), np.float64)
    for i in range(positions.shape[0]):
        x, y = positions[i, 1] * resolution, positions[i, 0] * resolution
        points[i, 0] = frame.x + cosine * x - sine * y
        points[i, 1] = frame.y + sine * x + cosine * y
    return points


@guarded
@njit(cache=True)
def line_between(positions, ends, frame):
    """Return the points of positions with ends of their own, float64 (n, 2), and their length.

    `ends` are `(x, y)` of both in metres. The GIL is kept: this is over before another thread is
    awake.
    """
    points = points_at(positions, frame)
    points[0, 0], points[0, 1] = ends[0], ends[1]
    points[-1, 0], points[-1, 1] = ends[2], ends[3]
    return points, polyline_length(points)


@guarded
@njit(cache=True)
def classes_at(ends, classes, frame):
    """Return where two points are: for each its class, -1 outside the grid, its cell, as that of
    `Frame.cell_of`, and its position.

    `ends` are `(x, y)` of both in metres, finite; the GIL is kept, as in `line_between`.
    """
    return _class_at(ends[0], ends[1], classes, frame), _class_at(ends[2], ends[3], classes, frame)


@njit(cache=True)
def _class_at(x, y, classes, frame):
    """Return where one point is."""
    at = position_of(x, y, frame)
    row, col = at[0] + 1e-9, at[1] + 1e-9  # compared as numbers, which may be infinite
    if 0 <= row < classes.shape[0] and 0 <= col < classes.shape[1]:
        cell = int(row), int(col)
        return int(classes[cell]), cell, at
    return -1, (0, 0), at


@guarded
@njit(cache=True, nogil=True)
def position_of(x, y, frame):
    """Return a point as (row, col) in grid units, that of `Frame.position_of` for near points.

    `x` and `y` are in metres, map frame, and `frame` is `Frame.for_kernels`.
    """
    along, across = x - frame.x, y - frame.y
    row = (frame.cosine * across - frame.sine * along) / frame.resolution
    return row, (frame.cosine * along + frame.sine * across) / frame.resolution


@guarded
@njit(cache=True, nogil=True)
def positions_on_grain(points, frame, rows, cols):
    """Return points as positions on the grain of exact tests, those beyond the map on its rim.

    `points`: float64 (n, 2), `(x, y)` in metres, map frame; `frame` is `Frame.for_kernels`; `rows`,
    `cols`: the size of the map. Returns float64 (n, 2), (row, col) in grid units.
    """
    line = np.empty((points.shape[0], 2))
    for i in range(points.shape[0]):
        row, col = position_of(points[i, 0], points[i, 1], frame)
        line[i, 0] = min(max(np.rint(row * GRAIN) / GRAIN, 0.0), rows + 0.0)
        line[i, 1] = min(max(np.rint(col * GRAIN) / GRAIN, 0.0), cols + 0.0)
    return line


_SLIVER_CELLS = 1e-9
"""Shorter segments of a line are rounding: the line passes the corner of a cell."""


@njit(cache=True, nogil=True)
def _is_free(free, row, col):
    """Return whether a cell is on the grid and free."""
    return 0 <= row < free.shape[0] and 0 <= col < free.shape[1] and free[row, col]


@njit(cache=True, nogil=True)
def _free_cell_at(free, row, col):
    """Return a free cell that contains a position.

    If the position lies on lines of the lattice, the cells beside it are tried in turn.
    """
    above, right = math.floor(row), math.floor(col)
    below, left = math.ceil(row) - 1, math.ceil(col) - 1
    # Most positions lie inside one cell; a look at it would fetch another row of the map.
    if above == below and right == left:
        return above, right
    if _is_free(free, above, right):
        return above, right
    if _is_free(free, above, left):
        return above, left
    if _is_free(free, below, right):
        return below, right
    return below, left


@njit(cache=True, nogil=True)
def _next_cut(start, reach, line):
    """Return the share of a segment at which it meets a line of the lattice; 2 if it does not."""
    return 2.0 if reach == 0.0 else (line - start) / reach


@guarded
@njit(cache=True, nogil=True)
def passed_cells(free, positions):
    """Return the cells that a polyline passes, int64 (m, 2); see `cells_of_line`."""
    room = 2
    for k in range(len(positions) - 1):
        for axis in range(2):
            room += int(abs(positions[k + 1, axis] - positions[k, axis])) + 2
    cells = np.empty((room, 2), np.int64)
    cells[0, 0], cells[0, 1] = _free_cell_at(free, positions[0, 0], positions[0, 1])
    n = 1
    for k in range(len(positions) - 1):
        row, col = positions[k, 0], positions[k, 1]
        down, across = positions[k + 1, 0] - row, positions[k + 1, 1] - col
        length = hypot(down, across)
        # The next line of the lattice in each direction, and where the segment meets it.
        down_step, across_step = math.copysign(1.0, down), math.copysign(1.0, across)
        line_row = math.floor(row) + 1.0 if down > 0.0 else math.ceil(row) - 1.0
        line_col = math.floor(col) + 1.0 if across > 0.0 else math.ceil(col) - 1.0
        by_row, by_col = _next_cut(row, down, line_row), _next_cut(col, across, line_col)
        here = 0.0
        while here < 1.0:
            there = min(by_row, by_col, 1.0)
            if (there - here) * length > _SLIVER_CELLS:
                middle = (here + there) / 2
                cell = _free_cell_at(free, row + middle * down, col + middle * across)
                if cell[0] != cells[n - 1, 0] or cell[1] != cells[n - 1, 1]:
                    cells[n, 0], cells[n, 1] = cell
                    n += 1
            if by_row <= there:
                line_row += down_step
                by_row = _next_cut(row, down, line_row)
            if by_col <= there:
                line_col += across_step
                by_col = _next_cut(col, across, line_col)
            here = there
    cell = _free_cell_at(free, positions[-1, 0], positions[-1, 1])
    if cell[0] != cells[n - 1, 0] or cell[1] != cells[n - 1, 1]:
        cells[n, 0], cells[n, 1] = cell
        n += 1
    return cells[:n].copy()


@guarded
@njit(cache=True, nogil=True)
def least_along(values, positions):
    """Return the least value of the cells that each segment touches, float64 (n - 1,).

    A cell counts if the segment meets its closed square, or passes it by 1e-9 of a cell; outside of
    the grid values are infinite. In each row of cells a segment covers one range of columns.

    `values`: float64 (rows, cols); `positions`: float64 (n, 2), n >= 1, (row, col) on the lattice
    of the cells' corners.
    """
    least = np.full(len(positions) - 1, np.inf)
    for i in range(len(least)):
        row, col = positions[i, 0], positions[i, 1]
        down, across = positions[i + 1, 0] - row, positions[i + 1, 1] - col
        low, high = min(row, row + down) - _SLIVER_CELLS, max(row, row + down) + _SLIVER_CELLS
        for r in range(max(math.floor(low), 0), min(math.floor(high) + 1, values.shape[0])):
            first, last = 0.0, 1.0  # shares of the segment at which it enters and leaves the row
            if down != 0.0:
                one, other = (r - _SLIVER_CELLS - row) / down, (r + 1 + _SLIVER_CELLS - row) / down
                first, last = max(first, min(one, other)), min(last, max(one, other))
            one, other = col + first * across, col + last * across
            left, right = min(one, other) - _SLIVER_CELLS, max(one, other) + _SLIVER_CELLS
            for c in range(max(math.floor(left), 0), min(math.floor(right) + 1, values.shape[1])):
                least[i] = min(least[i], values[r, c])
    return least


@guarded
@njit(cache=True, nogil=True)
def walks_clear(free, tails, heads):
    """Return which walks from cell to cell meet free cells only, bool (n,).

    The walk is that of Nav2's collision monitor, Bresenham's line as its `LineIterator` visits it:
    one cell for each step along the longer axis. Backwards it may visit others.

    `free`: bool (rows, cols); `tails`, `heads`: int64 (n, 2), cells of the grid.
    """
    clear = np.ones(len(tails), np.bool_)
    for i in range(len(tails)):
        row, col = tails[i, 0], tails[i, 1]
        down, across = abs(heads[i, 0] - row), abs(heads[i, 1] - col)
        up, right = (1 if heads[i, 0] >= row else -1), (1 if heads[i, 1] >= col else -1)
        steps = max(down, across, 1)
        for k in range(max(down, across) + 1):
            here = row + up * ((steps // 2 + k * down) // steps)
            if not free[here, col + right * ((steps // 2 + k * across) // steps)]:
                clear[i] = False
                break
    return clear


@njit(cache=True, nogil=True)
def polyline_length(points):
    """Return the length of a line through points, float64 (n, 2)."""
    length = 0.0
    for k in range(len(points) - 1):
        length += hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
    return length


@njit(cache=True, nogil=True)
def polyline_lengths(points, starts):
    """Return the lengths of many lines, float64 (n,).

    Line k is `points[starts[k]:starts[k + 1]]`; a line without points is infinitely long.
    """
    lengths = np.full(len(starts) - 1, np.inf)
    for k in range(len(lengths)):
        if starts[k + 1] > starts[k]:
            lengths[k] = polyline_length(points[starts[k] : starts[k + 1]])
    return lengths


# Widest paths: cells join in order of clearance.


@njit(cache=True, nogil=True)
def _top_of(top, cell):
    """Return the root of a cell's set, and shorten the way to it."""
    while top[cell] != cell:
        top[cell] = top[top[cell]]
        cell = top[cell]
    return cell


@guarded
@njit(cache=True, nogil=True)
def joined_in_order(order, shape, diagonal):
    """Return the tree of sets of cells that join, as two int32 (rows * cols,).

    Cells are entered in the order given, int64 (m,), and join the sets of their neighbours: the
    four beside them, with `diagonal` also the four at their corners. When two sets join, the root
    of the smaller gets the other as its parent, and the place in the order as its time. So no cell
    is more than log2(m) steps below its root. A root is its own parent; a cell that never enters
    has the parent -1. Times of cells without another parent are m.
    """
    rows, cols = shape
    parent = np.full(rows * cols, -1, np.int32)
    time = np.full(rows * cols, len(order), np.int32)
    top = parent.copy()
    size = np.ones(rows * cols, np.int32)
    for k in range(len(order)):
        cell = order[k]
        parent[cell] = top[cell] = cell
        row, col = cell // cols, cell % cols
        for down in range(-1, 2):
            for across in range(-1, 2):
                if (down == 0) == (across == 0) and not (diagonal and down != 0):
                    continue
                if not (0 <= row + down < rows and 0 <= col + across < cols):
                    continue
                near = cell + down * cols + across
                if parent[near] < 0:
                    continue
                one, other = _top_of(top, cell), _top_of(top, near)
                if one == other:
                    continue
                if size[one] < size[other]:
                    one, other = other, one
                parent[other] = top[other] = one
                size[one] += size[other]
                time[other] = k
    return parent, time


@guarded
@njit(cache=True, nogil=True)
def nearest_distances(occupied):
    """Return the distance from each cell to the nearest occupied one, float64, infinite for none.

    First along columns, then along rows by the lower envelope of parabolas (P. Felzenszwalb,
    D. Huttenlocher: Distance transforms of sampled functions, 2012). Squares are whole numbers
    below 2^53, so results are those of any exact way.
    """
    rows, cols = occupied.shape
    found = np.empty((rows, cols))
    for row in range(rows):
        for col in range(cols):
            above = found[row - 1, col] + 1 if row > 0 else np.inf
            found[row, col] = 0.0 if occupied[row, col] else above
    below, squares = np.full(cols, np.inf), np.empty(cols)
    at, begin = np.empty(cols, np.int64), np.empty(cols, np.int64)
    for row in range(rows - 1, -1, -1):
        count = 0
        for col in range(cols):
            below[col] = min(found[row, col], below[col] + 1)
            squares[col] = below[col] * below[col]
            if squares[col] == np.inf:
                continue
            from_ = 0  # where this parabola becomes the lowest
            while count > 0:
                last = at[count - 1]
                rise = squares[col] - squares[last] + (col * col - last * last)
                from_ = np.int64(np.floor(rise / (2 * (col - last)))) + 1
                if from_ > begin[count - 1]:
                    break
                count -= 1
                from_ = 0
            at[count], begin[count] = col, from_
            count += 1
        k = 0
        for col in range(cols):
            while k + 1 < count and begin[k + 1] <= col:
                k += 1
            away = col - at[k]
            found[row, col] = np.sqrt(away * away + squares[at[k]]) if count > 0 else np.inf
    return found
