"""Kernels of the searches on the whole grid: Dijkstra, weighted A*.

Marks instead of clearing: `mark` holds 2 * generation for a cell that is open in the search of this
generation, 2 * generation + 1 for one that is closed, less for one not yet seen.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, grow_rows, pop, push
from hybridnav._base.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT, octile_cost


@guarded
@njit(cache=True, nogil=True)
def dijkstra(moves, cols, start, goal, cost_of, came, mark, generation):
    """Return whether there is a path between two flat cells, and the expansions up to the goal's.

    Buckets as wide as a straight step make the search label-setting (Dinic 1978): no cell can be
    improved from its own bucket, and three buckets that take turns hold all open cells.

    Parameters
    ----------
    moves
        uint8 (n_cells,), the legal moves of each flat cell.
    cols
        Columns of the grid.
    start, goal
        Flat cells.
    cost_of
        int64 (n_cells,), work array of integer costs.
    came
        uint8 (n_cells,), receives the direction by which a shortest path reaches each closed cell.
    mark, generation
        One entry a cell: 2 * `generation` if open in this search, one more if closed.
    """
    is_open, is_closed = 2 * generation, 2 * generation + 1
    waiting = np.empty((3, 1024), np.int32)
    count = np.zeros(3, np.int64)
    cost_of[start] = 0
    mark[start] = is_open
    waiting[0, 0] = start
    count[0] = 1
    turn = expanded = 0
    while count[0] + count[1] + count[2] > 0:
        slot = turn % 3
        while count[slot] > 0:
            count[slot] -= 1
            cell = np.int64(waiting[slot, count[slot]])
            if mark[cell] == is_closed:
                continue
            if cell == goal:
                return True, expanded
            mark[cell] = is_closed
            expanded += 1
            mask = moves[cell]
            for k in range(8):
                if not mask >> k & 1:
                    continue
                to = cell + ROW_STEP[k] * cols + COL_STEP[k]
                cost = cost_of[cell] + (DIAGONAL if k & 1 else STRAIGHT)
                if mark[to] >= is_open and cost_of[to] <= cost:
                    continue
                cost_of[to] = cost
                came[to] = k
                mark[to] = is_open
                into = cost // STRAIGHT % 3
                if count[into] == waiting.shape[1]:
                    waiting = np.concatenate((waiting, waiting), axis=1)
                waiting[into, count[into]] = to
                count[into] += 1
        turn += 1
    return False, expanded


@guarded
@njit(cache=True, nogil=True)
def weighted_astar(moves, cols, start, goal, weight, cost_of, came, mark, generation):
    """Return a lower bound on the cost of a shortest path, -1 for none, and the expansions.

    Cells are expanded in order of g + weight * h, once each. A closed cell that is reached at less
    cost keeps the better path, which its successors learn only through `came`, and is put aside.
    The first cell of a shortest path that was not expanded at its least cost was reached at its
    least cost, and is open, put aside, or the goal: the least g + h of these bounds the optimum.

    Parameters
    ----------
    moves, cols, start, goal, cost_of, came, mark, generation
        See `dijkstra`.
    weight
        Factor of the estimate, >= 1.
    """
    is_open, is_closed = 2 * generation, 2 * generation + 1
    goal_row, goal_col = goal // cols, goal % cols
    heap = np.empty((1024, 2))  # keys and cells
    aside = np.empty(256, np.int32)
    n_aside = expanded = 0
    heap[0, 0], heap[0, 1] = 0.0, start
    size = 1
    cost_of[start] = 0
    mark[start] = is_open

    # The first path to the goal is the result. Weighted keys are no lower bounds, so a cheaper
    # path may still be open; what it costs at least is computed below.
    while size > 0:
        cell = np.int64(heap[0, 1])
        if cell == goal:
            break
        pop(heap, size)
        size -= 1
        # An entry with a smaller key came before, when the cell was expanded.
        if mark[cell] == is_closed:
            continue
        mark[cell] = is_closed
        expanded += 1
        row, col = cell // cols, cell % cols
        mask = moves[cell]
        for k in range(8):
            if not mask >> k & 1:
                continue
            to = cell + ROW_STEP[k] * cols + COL_STEP[k]
            cost = cost_of[cell] + (DIAGONAL if k & 1 else STRAIGHT)
            if mark[to] >= is_open and cost_of[to] <= cost:
                continue
            cost_of[to] = cost
            came[to] = k
            # A cell is expanded once, by design; aside, its better cost still counts for the bound.
            if mark[to] == is_closed:
                if n_aside == aside.size:
                    aside = grow(aside)
                aside[n_aside] = to
                n_aside += 1
                continue
            mark[to] = is_open
            if size == len(heap):
                heap = grow_rows(heap)
            estimate = octile_cost(row + ROW_STEP[k] - goal_row, col + COL_STEP[k] - goal_col)
            push(heap, size, cost + weight * estimate, to)
            size += 1

    # The heap is empty, and the goal was never reached.
    if mark[goal] < is_open:
        return np.int64(-1), expanded

    # The least g + h of the cells that the docstring names, with the path that was found.
    bound = cost_of[goal]
    for i in range(size + n_aside):
        cell = np.int64(heap[i, 1] if i < size else aside[i - size])
        # Closed cells in the heap are older entries; one that was improved later is aside as well.
        if i < size and mark[cell] == is_closed:
            continue
        estimate = octile_cost(cell // cols - goal_row, cell % cols - goal_col)
        bound = min(bound, cost_of[cell] + estimate)
    return bound, expanded
