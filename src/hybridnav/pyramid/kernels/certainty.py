"""Kernels that grow the fields of places cell by cell, the most certain cells first."""

import numpy as np

from hybridnav._base.jit import guarded, njit


@njit(cache=True, nogil=True)
def _root(parent, parity, cell):
    """Return the root of a cell's tree, and how often, modulo 2, lines lie on the path to it."""
    odd = parity[cell]
    while parent[cell] != cell:
        cell = parent[cell]
        odd ^= parity[cell]
    return cell, odd


@njit(cache=True, nogil=True)
def _join(forest, cell, other, line, key):
    """Join the trees of two adjacent cells; a second path round a line makes the tree odd."""
    parent, parity, joined, size, is_odd = forest
    one, odd = _root(parent, parity, cell)
    two, odd_two = _root(parent, parity, other)
    odd ^= odd_two ^ line
    if one == two:
        is_odd[one] |= odd
        return
    if size[one] < size[two]:
        one, two = two, one
    parent[two], parity[two], joined[two] = one, odd, key
    size[one] += size[two]
    is_odd[one] |= is_odd[two]


@guarded
@njit(cache=True, nogil=True)
def grow_cores(order, keys, field_of, most, crossed, forest, asked, cols):
    """Return when cells join the cores of their fields, and when cores close round their lines.

    Cells are taken in ascending order of keys. The core of a field is the connected component
    that holds more than half of its cells. Trees are joined by size and not shortened, so that the
    keys at which they were joined ascend towards the root.

    Parameters
    ----------
    order
        int64, flat cells by ascending key, in whole fields.
    keys
        float64 (rows * cols,), key of each cell.
    field_of
        int32 (rows * cols,), field of each cell.
    most
        int64 (n_fields,), cells that are more than half of each field.
    crossed
        uint8 (2 * rows * cols,), 1 for base edges that lie across the line of their field.
    forest
        Scratch, an array of rows * cols each: int64 parents, uint8 parities of the paths to them,
        float64 keys at which trees were joined, int64 sizes, and uint8 whether trees are odd.
    asked
        int64 (n,), flat cells in `order`.
    cols
        Columns of the grid.

    Returns
    -------
    tuple
        float64 (n,), the key at which each cell asked for is part of its field's core; float64
        (n_fields,), the key at which the core holds a closed path that crosses the line an odd
        number of times, infinite if it never does.
    """
    n_cells = keys.size
    parent, parity, joined, size, is_odd = forest
    for cell in order:
        parent[cell], parity[cell], joined[cell] = -1, 0, -np.inf
        size[cell], is_odd[cell] = 1, 0
    whole = np.full(most.size, np.inf)
    closed = np.full(most.size, np.inf)
    for cell in order:
        parent[cell] = cell
        for side in range(4):
            other = cell + (1, cols, -1, -cols)[side]
            column = cell % cols
            if (side == 0 and column == cols - 1) or (side == 2 and column == 0):
                continue
            if other < 0 or other >= n_cells or parent[other] < 0:
                continue
            if field_of[other] != field_of[cell]:
                continue
            line = crossed[2 * min(cell, other) + (side & 1)]
            _join(forest, cell, other, line, keys[cell])
        v = field_of[cell]
        root, _ = _root(parent, parity, cell)
        if size[root] >= most[v]:
            whole[v] = min(whole[v], keys[cell])
            if is_odd[root] != 0:
                closed[v] = min(closed[v], keys[cell])
    times = np.empty(asked.size)
    for i in range(asked.size):
        cell, times[i] = asked[i], whole[field_of[asked[i]]]
        while parent[cell] != cell:
            times[i] = max(times[i], joined[cell])
            cell = parent[cell]
    return times, closed
