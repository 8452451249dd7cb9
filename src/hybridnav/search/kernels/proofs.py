"""Kernels of proofs: the tree of shortest paths that bounds all others, and walls round an area."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push
from hybridnav._base.kernels.moves import COL_STEP, FAR, ROW_STEP

STRAIGHT, DIAGONAL = 195025, 275807
"""What moves cost: their ratio is below sqrt 2 by 7e-12 of it, so that a bound in these numbers is
one in lengths."""
ONE = 2**14
"""The factor 1 in units."""
ROOT, OUTSIDE = 8, 9
"""Marks of the start of a tree, and of cells that are not in it."""


@njit(cache=True, nogil=True)
def _least(rows, cols):
    """Return the cost of the shortest path of an offset without obstacles."""
    rows, cols = abs(rows), abs(cols)
    return 2 * ONE * (STRAIGHT * abs(rows - cols) + DIAGONAL * min(rows, cols))


@njit(cache=True, nogil=True)
def _cost_of(costs, row, col, k):
    """Return the cost of a move from a node in direction k, 0 where there is none."""
    if k < 4:
        return costs[k, row, col]
    row, col = row + ROW_STEP[k], col + COL_STEP[k]
    if row < 0 or col < 0 or row >= costs.shape[1] or col >= costs.shape[2]:
        return 0
    return costs[k - 4, row, col]


@guarded
@njit(cache=True, nogil=True)
def tree_of(costs, start, goal, limit):
    """Return the tree of cheapest paths from a node of a grid, over the nodes over which a path to
    the goal may be cheaper than a limit, as far as the way on an empty grid tells.

    Parameters
    ----------
    costs
        int64 (4, rows, cols), the costs of moves in the first four directions, 0 where there is
        none; no less than `STRAIGHT`, or `DIAGONAL`, times 2 `ONE`. Moves stay in the grid.
    start, goal
        (row, col).
    limit
        Cost of a path that is not of interest.

    Returns
    -------
    tuple
        uint8 (rows, cols), the direction from each node to the one before it, `ROOT` at the start
        and `OUTSIDE` elsewhere; and the least cost of the goal, or the limit if it is not below.
    """
    # The least known cost of each node, its way back, and the open list by cost and way ahead.
    rows, cols = costs.shape[1:]
    cost = np.full((rows, cols), np.int64(FAR))
    tree = np.full((rows, cols), np.uint8(OUTSIDE))
    back = np.full((rows, cols), np.uint8(ROOT))
    heap = np.empty((4096, 2), np.int64)
    size = 1
    cost[start] = 0
    heap[0] = _least(start[0] - goal[0], start[1] - goal[1]), start[0] * cols + start[1]

    # A*: as the heuristic is consistent, a node has its least cost when it is taken.
    while size > 0 and heap[0, 0] < min(limit, cost[goal]):
        node = pop(heap, size)
        size -= 1
        row, col = node // cols, node % cols
        if tree[row, col] != OUTSIDE:
            continue
        tree[row, col] = back[row, col]
        # Neighbours that are cheaper over this node wait with it as the way back.
        for k in range(8):
            step = _cost_of(costs, row, col, k)
            to_row, to_col = row + ROW_STEP[k], col + COL_STEP[k]
            if step == 0 or cost[row, col] + step >= cost[to_row, to_col]:
                continue
            cost[to_row, to_col] = cost[row, col] + step
            back[to_row, to_col] = (k + 4) & 7
            if size == len(heap):
                larger = np.empty((2 * size, 2), np.int64)
                larger[:size] = heap
                heap = larger
            ahead = _least(to_row - goal[0], to_col - goal[1])
            push(heap, size, cost[to_row, to_col] + ahead, to_row * cols + to_col)
            size += 1

    # Among equally good directions those of the nodes beside and below are chosen: alike, they
    # take less room in a file.
    for row in range(rows):
        for col in range(cols):
            if tree[row, col] >= ROOT:
                continue
            # Costs are whole numbers, so equally good is equal.
            for k in (tree[row, col - 1], tree[row - 1, col]):
                step = _cost_of(costs, row, col, k) if k < ROOT else 0
                to_row, to_col = row + ROW_STEP[k & 7], col + COL_STEP[k & 7]
                if step > 0 and cost[to_row, to_col] + step == cost[row, col]:
                    if tree[to_row, to_col] != OUTSIDE:
                        tree[row, col] = k
                        break
    return tree, min(limit, cost[goal])


@njit(cache=True, nogil=True)
def walls_round(area, row, col):
    """Return the cells along the border of an area, (row, col) of a closed chain of 8-neighbours.

    Parameters
    ----------
    area
        bool (rows, cols), a 4-connected set none of which lies on the rim; the cells round it that
        hang together by sides and corners are the other side.
    row, col
        A cell of the area whose neighbour at row - 1 lies on the other side.

    Returns
    -------
    NDArray
        int64 (n, 2); from each cell to the next one, and from the last to the first, is a move to
        an 8-neighbour or none.
    """
    chain = np.empty((1024, 2), np.int64)
    n = 0
    # The walker stands in the area and looks along `ahead`, the other side to its right.
    first_row, first_col, ahead = row, col, 0
    while True:
        beside = (ahead + 6) & 7
        if n + 2 > len(chain):
            larger = np.empty((2 * len(chain), 2), np.int64)
            larger[:n] = chain[:n]
            chain = larger
        chain[n] = row + ROW_STEP[beside], col + COL_STEP[beside]
        n += 1
        next_row, next_col = row + ROW_STEP[ahead], col + COL_STEP[ahead]
        corner_row, corner_col = next_row + ROW_STEP[beside], next_col + COL_STEP[beside]
        if not area[next_row, next_col]:
            ahead = (ahead + 2) & 7
        elif area[corner_row, corner_col]:
            row, col = corner_row, corner_col
            ahead = beside
        else:
            row, col = next_row, next_col
        if row == first_row and col == first_col and ahead == 0:
            return chain[:n]
