"""Kernels that pack the fields of a descent: sums, blocks, neighbours."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import find

_ROOT = 0.41421356237309515  # a diagonal is longer than a side by it


@njit(cache=True, nogil=True)
def field_sums(field_of, cols, units, n_fields):
    """Return the cells of each field, and the sums of their rows, columns and units, float64
    (n_fields, 4).

    `units`: int32 (n_cells,), factors of cells; None for none, whose sums are 0.
    """
    sums = np.zeros((n_fields, 4))
    for row in range(field_of.size // cols):
        for col in range(cols):
            v = field_of[row * cols + col]
            if v >= 0:
                sums[v, 0] += 1
                sums[v, 1] += row
                sums[v, 2] += col
                if units is not None:
                    sums[v, 3] += units[row * cols + col]
    return sums


@guarded
@njit(cache=True, nogil=True)
def join_in_blocks(cells, is_open, arcs, side):
    """Return the fields that arcs connect inside square blocks of cells: int64 (n_places,), the
    field of each place, -1 for one that is not open, and int64 (n_fields,), the place of each field
    that lies nearest to the middle of its block.

    `cells`: int64 (n_places, 2), surviving cells, (row, col); `is_open`: bool (n_places,); `arcs`:
    int32 (n, 2), between open places; `side`: of a block, in cells.
    """
    n = len(cells)
    root = np.arange(n)
    for i in range(len(arcs)):
        u, v = np.int64(arcs[i, 0]), np.int64(arcs[i, 1])
        in_row = cells[u, 0] // side == cells[v, 0] // side
        if in_row and cells[u, 1] // side == cells[v, 1] // side:
            u, v = find(root, u), find(root, v)
            root[max(u, v)] = min(u, v)
    of, nearest, least = np.full(n, -1), np.empty(n, np.int64), np.empty(n, np.int64)
    n_fields = 0
    for v in range(n):
        if not is_open[v]:
            continue
        off = abs(cells[v, 0] % side * 2 - side) + abs(cells[v, 1] % side * 2 - side)
        first = find(root, v)
        if first == v:
            of[v], least[n_fields], nearest[n_fields] = n_fields, off, v
            n_fields += 1
            continue
        k = of[v] = of[first]
        if off < least[k]:
            least[k], nearest[k] = off, v
    return of, nearest[:n_fields].copy()


@njit(cache=True, nogil=True)
def _fields_joined(arcs, of, may_pass):
    """Return the different fields that arcs join, int32 (m, 2), and how often fields before each
    are among them, int64 (n + 1,); for the parameters see `neighbours_of`."""
    n, m = may_pass.size, 0
    ends, first = np.empty((len(arcs), 2), np.int32), np.zeros(n + 1, np.int64)
    for i in range(len(arcs)):
        u, v = of[arcs[i, 0]], of[arcs[i, 1]]
        if u >= 0 and v >= 0 and u != v and may_pass[u] and may_pass[v]:
            ends[m, 0], ends[m, 1] = u, v
            first[u + 1] += 1
            first[v + 1] += 1
            m += 1
    for v in range(n):
        first[v + 1] += first[v]
    return ends[:m], first


@guarded
@njit(cache=True, nogil=True)
def neighbours_of(arcs, of, may_pass):
    """Return where the neighbours of each field begin, int64 (n + 1,), and these, int32 (m,), each
    once, ascending.

    `arcs`: int64 (k, 2), pairs of vertices; `of`: int64, the field of each vertex, -1 for none;
    `may_pass`: bool (n,), the fields that have neighbours.
    """
    # Two counting sorts, by heads and by tails, take a tenth of the time of numpy's.
    ends, first = _fields_joined(arcs, of, may_pass)
    n, m = may_pass.size, len(ends)
    at, by_head = first[:n].copy(), np.empty(2 * m, np.int32)
    for i in range(m):
        for side in range(2):
            head = ends[i, side]
            by_head[at[head]] = ends[i, 1 - side]
            at[head] += 1
    at[:] = first[:n]
    heads = np.empty(2 * m, np.int32)
    for head in range(n):  # symmetric: there are as many to each as from it
        for i in range(first[head], first[head + 1]):
            tail = by_head[i]
            heads[at[tail]] = head
            at[tail] += 1
    kept, low = 0, 0
    for v in range(n):
        high, before = first[v + 1], -1
        first[v] = kept
        for i in range(low, high):
            if heads[i] != before:
                before = heads[kept] = heads[i]
                kept += 1
        low = high
    first[n] = kept
    return first, heads[:kept].copy()


@njit(cache=True, nogil=True)
def octile_costs(first, heads, middle):
    """Return the octile distance between the middles of neighbours, float64 (m,), as `heads` of
    `neighbours_of`; `middle`: float64 (n, 2), row and column."""
    costs = np.empty(heads.size)
    for v in range(first.size - 1):
        for i in range(first[v], first[v + 1]):
            rows = abs(middle[v, 0] - middle[heads[i], 0])
            cols = abs(middle[v, 1] - middle[heads[i], 1])
            costs[i] = max(rows, cols) + _ROOT * min(rows, cols)
    return costs


@njit(cache=True, nogil=True)
def pairs_beside(holder, now, low_row, low_col):
    """Return pairs of vertices whose fields meet by a side, in or beside cells of a window.

    `holder`: int32 (rows, cols), see `MapCells`; `now`: bool, the cells of the window; `low_row`,
    `low_col`: its first cell. Result: int64 (n, 2), surviving cells, the lesser first.
    """
    rows, cols = holder.shape
    pairs, n = np.empty((1024, 2), np.int64), 0
    for i in range(now.shape[0]):
        for j in range(now.shape[1]):
            if not now[i, j]:
                continue
            row, col = low_row + i, low_col + j
            own = holder[row, col]
            for k in range(4):
                r, c = row + (k == 1) - (k == 3), col + (k == 0) - (k == 2)
                if r < 0 or r >= rows or c < 0 or c >= cols:
                    continue
                other = holder[r, c]
                if other < 0 or other == own:
                    continue
                if n == len(pairs):
                    longer = np.empty((2 * n, 2), np.int64)
                    longer[:n] = pairs
                    pairs = longer
                pairs[n, 0], pairs[n, 1] = min(own, other), max(own, other)
                n += 1
    return pairs[:n]
