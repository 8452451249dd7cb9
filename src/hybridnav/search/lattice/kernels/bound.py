"""Kernels of a lower bound on the cost of all paths between two positions.

Positions are (row, col) in grid units. A *corner* is a lattice point where four cells meet. Where
only two of these are free, and meet in it alone, no path leads from one to the other: such a corner
is *split* into two, one for each cell. So there are two numbers for each lattice point. Each cell
is cut into four triangles by its middle; the corners of a cell are numbered 0 to 3, row by
row, and its *sides* as in `_SIDES`.
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, grow_rows, pop, push, total

UNITS = 2.0**20
"""Units of a cell in costs, which are rounded down."""
_FAR = 1 << 61
"""Cost of what is not reached; twice as much is a number still."""
_DOWN = np.array([0, 0, -1, 1, -1, -1, 1, 1], np.int64)
_ACROSS = np.array([-1, 1, 0, 0, -1, 1, -1, 1], np.int64)
_STRAIGHT = 4
"""The first so many moves run along the side of two cells, the others through one cell."""
_SIDES = np.array([[0, 1], [2, 3], [0, 2], [1, 3]], np.int64)
"""Corners of the sides of a cell: above, below, left, right."""
_SWEEPS = 3
_STEP, _FORCE = 0.5 / math.sqrt(26.0), 2.0 / math.sqrt(26.0)
"""Step lengths of the iteration; with 20 for 26 it diverges on maps of buildings."""
_ROUND = 16
"""Iterations from one look at all cells, and at the bound, to the next."""
_SLACK = 0.98
"""Part of its factor up to which a cell without force is left out until the next look."""
_LONGEST = math.sqrt(2.0) * (1 + 1e-12)


@njit(cache=True, nogil=True)
def corner_of(free, row, col, cell_row):
    """Return the number of the corner at a lattice point for a free cell beside it, by its row."""
    rows, cols = free.shape
    number = 2 * (row * (cols + 1) + col)
    if row == 0 or row == rows or col == 0 or col == cols:
        return number
    above = free[row - 1, col - 1] != 0, free[row - 1, col] != 0
    below = free[row, col - 1] != 0, free[row, col] != 0
    is_split = above[0] != above[1] and below[0] != below[1] and above[0] != below[0]
    # A cell above has the first number, one below the second.
    return number + 1 if is_split and cell_row == row else number


@njit(cache=True, nogil=True)
def _move_from(free, factors, corner, move):
    """Return the corner that a move from a corner leads to, and the factor of the move.

    Along a side the cheaper of its two cells counts; without a free cell, the factor is infinite.
    """
    rows, cols = free.shape
    row, col = corner // 2 // (cols + 1), corner // 2 % (cols + 1)
    down, across = _DOWN[move], _ACROSS[move]
    factor, to = np.inf, np.int64(0)
    for k in range(2 if move < _STRAIGHT else 1):
        # The cell below and right of a corner has its row and column.
        cell_row = row - (k if down == 0 else down < 0)
        cell_col = col - (k if across == 0 else across < 0)
        if not (0 <= cell_row < rows and 0 <= cell_col < cols) or free[cell_row, cell_col] == 0:
            continue
        if corner_of(free, row, col, cell_row) != corner:
            continue
        if factors[cell_row, cell_col] < factor:
            factor = factors[cell_row, cell_col] + 0.0
            to = corner_of(free, row + down, col + across, cell_row)
    return to, factor


@njit(cache=True, nogil=True)
def _left(known, at, goal, cols):
    """Return a bound on the cost from a corner to the goal: a known one, or the octile distance."""
    if known.size > 0:
        return known[at]
    at, goal = at // 2, goal // 2
    down, across = abs(at // cols - goal // cols), abs(at % cols - goal % cols)
    straight, diagonal = np.int64(UNITS), np.int64(UNITS * math.sqrt(2.0))
    return abs(down - across) * straight + min(down, across) * diagonal


@guarded
@njit(cache=True, nogil=True)
def costs_over_corners(free, factors, start, goal, most, known):
    """Return the costs of paths over corners from one of them, in units of 2^-20, rounded down.

    A* whose open list is emptied up to a limit. Costs are exact where they and the cost left add up
    to the limit or less; elsewhere they are exact or too high.

    `free`: uint8 (rows, cols), 1 where a cell may be entered; `factors`: float32 (rows, cols), >=
    1; `start`, `goal`: numbers of the corners, see `corner_of`; `most`: the limit, in units;
    `known`: int64 (corners,), such costs from the goal to the same limit, which are the cost left;
    empty for the octile distance.
    """
    cols = free.shape[1] + 1
    cost = np.full(2 * (free.shape[0] + 1) * cols, _FAR, np.int64)
    heap, size = np.empty((1024, 2), np.int64), 1
    cost[start] = 0
    heap[0, 0], heap[0, 1] = 0, start
    while size > 0:
        key = heap[0, 0]
        at = pop(heap, size)
        size -= 1
        if key > cost[at] + _left(known, at, goal, cols):  # reached more cheaply since
            continue
        if key > most:
            break
        if size + _DOWN.size > heap.shape[0]:
            heap = grow_rows(heap)
        for move in range(_DOWN.size):
            to, factor = _move_from(free, factors, at, move)
            if factor == np.inf:
                continue
            length = 1.0 if move < _STRAIGHT else math.sqrt(2.0)
            whole = cost[at] + np.int64(factor * length * UNITS)
            if whole < cost[to]:
                over = whole + _left(known, to, goal, cols)
                if over <= most:
                    cost[to] = whole
                    push(heap, size, over, to)
                    size += 1
    return cost


@guarded
@njit(cache=True, nogil=True)
def band_of(free, forth, back, most):
    """Return the free cells with a corner over which a path may cost less than a limit.

    `free`: uint8 (rows, cols), 1 where a cell may be entered; `forth`, `back`: int64 (corners,),
    costs over corners from start and goal, exact up to the limit; `most`: the limit, in the units
    of the costs. Returns int64 (n,), the flat cells, ascending; int64 (n, 4), their corners,
    numbered from 0; and int64 (n_corners,), the flat corner of each number.
    """
    rows, cols = free.shape
    number = np.full(forth.size, -1, np.int64)
    cells, corners = np.empty(1024, np.int64), np.empty((1024, 4), np.int64)
    flat, own = np.empty(4096, np.int64), np.empty(4, np.int64)
    n_cells, n_corners = 0, 0
    for row in range(rows):
        for col in range(cols):
            if free[row, col] == 0:
                continue
            least = most
            for k in range(4):
                own[k] = corner_of(free, row + k // 2, col + k % 2, row)
                least = min(least, forth[own[k]] + back[own[k]])
            if least >= most:
                continue
            if n_cells == cells.size:
                cells, flat = grow(cells), grow(flat)
                corners = np.concatenate((corners, np.empty_like(corners)))
            cells[n_cells] = row * cols + col
            for k in range(4):
                if number[own[k]] < 0:
                    number[own[k]], flat[n_corners] = n_corners, own[k]
                    n_corners += 1
                corners[n_cells, k] = number[own[k]]
            n_cells += 1
    return cells[:n_cells].copy(), corners[:n_cells].copy(), flat[:n_corners].copy()


@guarded
@njit(cache=True, nogil=True)
def march(corners, factors, order, costs):
    """Find the costs of corners from one end, about: the upwind scheme of fast marching.

    `corners`: int64 (n, 4), corners of the cells; `factors`: float64 (n,), factors of the cells;
    `order`: int64 (n,), the cells as a wave from the end reaches them; `costs`: float64
    (n_corners,), those of the corners of the cell of the end, infinite elsewhere; written.
    """
    for _ in range(_SWEEPS):
        for cell in order:
            factor = factors[cell]
            for k in range(4):
                # Over the two corners beside it, or straight through the cell.
                first, second = costs[corners[cell, k ^ 1]], costs[corners[cell, k ^ 2]]
                found = costs[corners[cell, k ^ 3]] + math.sqrt(2.0) * factor
                apart = abs(first - second)
                if apart < factor:
                    over = 0.5 * (first + second + math.sqrt(2 * factor * factor - apart * apart))
                else:  # infinite less infinite too
                    over = min(first, second) + factor
                found = min(found, over)
                if found < costs[corners[cell, k]]:
                    costs[corners[cell, k]] = found


@njit(cache=True, nogil=True)
def _value(potential, middles, corners, end):
    """Return a potential at one end: its cell, side, and the weights of three corners."""
    cell, side = int(end[0]), int(end[1])
    value = end[2] * middles[cell]
    for k in range(2):
        value += end[3 + k] * potential[corners[cell, _SIDES[side, k]]]
    return value


@njit(cache=True, nogil=True)
def _steepest(corners, factors, potential, middles, steepness):
    """Find how steep a potential is in each cell, as a part of the factor; return the most."""
    most = 0.0
    for cell in range(factors.size):
        squared = 0.0
        for side in range(4):
            first = potential[corners[cell, _SIDES[side, 0]]]
            second = potential[corners[cell, _SIDES[side, 1]]]
            along, inward = second - first, 2 * middles[cell] - first - second
            squared = max(squared, along * along + inward * inward)
        steepness[cell] = math.sqrt(squared) / factors[cell]
        most = max(most, steepness[cell])
    return most


@njit(cache=True, nogil=True)
def _proved(factors, steepness, most, rise):
    """Return the bound that a potential proves, whichever share of it proves most.

    A potential that is nowhere steeper than the factor bounds the cost of all paths by its rise
    from start to goal. Where it is, the excess counts for the longest line in the cell: a cheapest
    path spends no more in a cell than a straight line through it would cost.
    """
    # The bound is concave in the share: thirds close in on its maximum.
    low, high = 0.9 / max(most, 1e-9), 1.1
    best = 0.0
    for _ in range(24):
        shares = (2 * low + high) / 3, (low + 2 * high) / 3
        spent = np.zeros(2)
        for cell in range(factors.size):
            for k in range(2):
                spent[k] += max(shares[k] * steepness[cell] - 1, 0.0) * factors[cell]
        first = shares[0] * rise - _LONGEST * spent[0]
        second = shares[1] * rise - _LONGEST * spent[1]
        best = max(best, first, second)
        if first < second:
            low = shares[0]
        else:
            high = shares[1]
    return best


@njit(cache=True, nogil=True)
def _push_back(corners, factors, cells, middles, ahead, ahead_middles, force, pull):
    """Let each triangle that is too steep push back: the forces grow, and pull at the corners.

    Middles are moved at once, corners by what `pull` says afterwards.

    Parameters
    ----------
    corners, factors
        As in `raise_potential`.
    cells
        int64 (k,), the cells to look at.
    middles
        float64 (n,), the potential of the middles of cells; written.
    ahead, ahead_middles
        The potential, one step further ahead; that of middles is written.
    force
        float64 (n, 4, 2), the force along and across the side of each triangle; written.
    pull
        float64 (n_corners,), written: how much forces pull at each corner.
    """
    pull[:] = 0.0
    for cell in cells:
        limit = _FORCE * factors[cell]
        pull_middle = 0.0
        for side in range(4):
            # The slope along the side, and from the side to the middle.
            first, second = corners[cell, _SIDES[side, 0]], corners[cell, _SIDES[side, 1]]
            along = ahead[second] - ahead[first]
            inward = 2 * ahead_middles[cell] - ahead[first] - ahead[second]
            along = force[cell, side, 0] + _FORCE * along
            inward = force[cell, side, 1] + _FORCE * inward
            squared = along * along + inward * inward
            if squared <= limit * limit:
                force[cell, side, 0] = force[cell, side, 1] = 0.0
                continue
            # What exceeds the factor pushes back.
            share = 1 - limit / math.sqrt(squared)
            along, inward = share * along, share * inward
            force[cell, side, 0], force[cell, side, 1] = along, inward
            pull[second] += along - inward
            pull[first] -= along + inward
            pull_middle += 2 * inward
        moved = middles[cell] - _STEP * pull_middle
        ahead_middles[cell], middles[cell] = 2 * moved - middles[cell], moved


@guarded
@njit(cache=True, nogil=True)
def raise_potential(corners, factors, potential, ends, iterations, enough):
    """Return the greatest bound that a potential proves while it is improved.

    The potential is linear on each triangle. Primal-dual iteration: raise it at the goal and lower
    it at the start, and push back wherever it is steeper than the factor of its cell.

    Parameters
    ----------
    corners
        int64 (n, 4), corners of the cells.
    factors
        float64 (n,), factors of the cells.
    potential
        float64 (n_corners,), to begin with; written.
    ends
        float64 (2, 5), of start and goal: cell, side of the triangle, weights of its middle and of
        the corners of the side.
    iterations
        Most of them.
    enough
        A bound that ends them.

    Notes
    -----
    A. Chambolle, T. Pock: A first-order primal-dual algorithm for convex problems, 2011.
    """
    n = factors.size
    middles = np.empty(n)
    for cell in range(n):
        whole = 0.0
        for k in range(4):
            whole += potential[corners[cell, k]]
        middles[cell] = 0.25 * whole
    force = np.zeros((n, 4, 2))
    ahead, ahead_middles = potential.copy(), middles.copy()
    pull = np.empty(potential.size)
    steepness, steep = np.empty(n), np.empty(n, np.int64)
    n_steep, best = 0, 0.0
    for iteration in range(iterations):
        # Now and then a look at all cells: what is proved, and which of them are steep.
        if iteration % _ROUND == 0:
            most = _steepest(corners, factors, potential, middles, steepness)
            rise = _value(potential, middles, corners, ends[1])
            rise -= _value(potential, middles, corners, ends[0])
            best = max(best, _proved(factors, steepness, most, rise))
            if best >= enough:
                break
            n_steep = 0
            for cell in range(n):
                if steepness[cell] > _SLACK or total(force[cell].ravel() != 0.0) > 0:
                    steep[n_steep] = cell
                    n_steep += 1
        cells = steep[:n_steep]
        _push_back(corners, factors, cells, middles, ahead, ahead_middles, force, pull)
        # Up at the goal, down at the start.
        for k in range(2):
            cell, side = int(ends[k, 0]), int(ends[k, 1])
            up = 1.0 if k == 1 else -1.0
            middles[cell] += up * _STEP * ends[k, 2]
            ahead_middles[cell] += 2 * up * _STEP * ends[k, 2]
            for other in range(2):
                pull[corners[cell, _SIDES[side, other]]] -= up * ends[k, 3 + other]
        # Corners move, and are looked at one step further ahead.
        for corner in range(potential.size):
            moved = potential[corner] - _STEP * pull[corner]
            ahead[corner], potential[corner] = 2 * moved - potential[corner], moved
    return best
