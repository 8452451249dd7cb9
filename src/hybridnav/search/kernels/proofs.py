"""Kernels of proofs: the tree of shortest paths that bounds all others, and walls round an area."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow_rows, pop, push
from hybridnav._base.kernels.moves import COL_STEP, FAR, ROW_STEP
from hybridnav._base.trig import hypot

ONE = 2**14
"""The factor 1 in units."""
_FINE = 2**40
ROOT, OUTSIDE = 8, 9
"""Marks of the start of a tree, and of cells that are not in it."""


@njit(cache=True, nogil=True)
def _least(rows, cols, moves):
    """Return the cost of the shortest path of an offset without obstacles."""
    rows, cols = abs(rows), abs(cols)
    return 2 * ONE * (moves[0] * abs(rows - cols) + moves[1] * min(rows, cols))


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
def tree_of(costs, barred, start, goal, limit, moves):
    """Return the tree of cheapest paths from a node of a grid.

    It covers the nodes over which a path to the goal may be cheaper than a limit, as far as the way
    on an empty grid tells.

    `costs`: int64 (4, rows, cols), the costs of moves in the first four directions, 0 where there
    is none. Moves stay in the grid. `barred`: uint8 (rows, cols), bit k for a move in direction k
    that directions forbid. `start`, `goal`: (row, col); `limit`: cost of a path that is
    not of interest; `moves`: the least cost of a straight move and of a diagonal one, in halves of
    `ONE`. Returns uint8 (rows, cols), the direction from each node to the one before it, `ROOT` at
    the start and `OUTSIDE` elsewhere; and int64 (rows, cols), the least cost of each node of the
    tree.
    """
    # The least known cost of each node, its way back, and the open list by cost and way ahead.
    rows, cols = costs.shape[1:]
    cost = np.full((rows, cols), np.int64(FAR))
    tree = np.full((rows, cols), np.uint8(OUTSIDE))
    back = np.full((rows, cols), np.uint8(ROOT))
    heap = np.empty((4096, 2), np.int64)
    size = 1
    cost[start] = 0
    heap[0] = _least(start[0] - goal[0], start[1] - goal[1], moves), start[0] * cols + start[1]

    # A*: as the heuristic is consistent, a node has its least cost when it is taken.
    while size > 0 and heap[0, 0] < limit:
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
            if barred[row, col] >> k & 1:
                continue
            cost[to_row, to_col] = cost[row, col] + step
            back[to_row, to_col] = (k + 4) & 7
            if size == len(heap):
                heap = grow_rows(heap)
            ahead = _least(to_row - goal[0], to_col - goal[1], moves)
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
    return tree, cost


@njit(cache=True, nogil=True)
def walls_round(area, row, col):
    """Return the cells along the border of an area, (row, col) of a closed chain of 8-neighbours.

    `area`: bool (rows, cols), a 4-connected set none of which lies on the rim; the cells round it
    that hang together by sides and corners are the other side; `row`, `col`: a cell of the area
    whose neighbour at row - 1 lies on the other side. Returns int64 (n, 2); from each cell to the
    next one, and from the last to the first, is a move to an 8-neighbour or none.
    """
    chain = np.empty((1024, 2), np.int64)
    n = 0
    # The walker stands in the area and looks along `ahead`, the other side to its right.
    first_row, first_col, ahead = row, col, 0
    while True:
        beside = (ahead + 6) & 7
        if n + 2 > len(chain):
            chain = grow_rows(chain)
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


@njit(cache=True, nogil=True)
def _bend(walls, row, col, up):
    """Return on which side strings go round the wall at a corner and on above it, or below.

    1 to the right, -1 to the left, and whether the wall lies there; 0 where there is no corner.
    """
    left, right = walls[row - 1, col - 1], walls[row - 1, col]
    over_left, over_right = walls[row, col - 1], walls[row, col]
    if int(left) + int(right) + int(over_left) + int(over_right) != 1:
        return 0, False
    return up * (1 if over_left or right else -1), (over_left or over_right) == (up > 0)


@njit(cache=True, nogil=True)
def _sector(walls, row, col, string, up):
    """Return the two directions between which a string goes on, taut, above a corner or below."""
    bend, is_beyond = _bend(walls, row, col, up)
    down, across = up * string[0], string[1]
    if down < 0 or across * bend < 0:
        return 0, 0, 0, 0
    wall = (1, 0) if is_beyond else (0, bend)
    if is_beyond == (bend > 0):
        return wall[0], wall[1], down, across
    return down, across, wall[0], wall[1]


@njit(cache=True, nogil=True)
def _clipped(shaft, sides, heights):
    """Return a shaft of light between the sides of a run that it enters at a height and leaves at
    another one."""
    low, low_col, high, high_col = shaft
    height = heights[0] if sides[0] > 0 else heights[1]
    if sides[0] * low > low_col * height:
        low, low_col = height, sides[0]
    height = heights[0] if sides[1] < 0 else heights[1]
    if sides[1] * high < high_col * height:
        high, high_col = height, sides[1]
    return low, low_col, high, high_col


@njit(cache=True, nogil=True)
def _runs_of(walls):
    """Return the first column of the run of free cells of each cell, and the one after its last."""
    rows, cols = walls.shape
    runs = np.empty((rows, cols, 2), np.int32)
    for row in range(rows):
        begin, end = 0, 0
        for col in range(cols):
            if walls[row, col]:
                begin = col + 1
            runs[row, col, 0] = begin
        for col in range(cols - 1, -1, -1):
            if walls[row, col]:
                end = col
            runs[row, col, 1] = end
    return runs


@guarded
@njit(cache=True, nogil=True)
def strings_of(walls, grain, ends, points, limit):
    """Return the lengths of taut strings from a point to all corners that a short path may pass.

    These are corners over which a path to another point may be shorter than a limit, as far as the
    straight way on tells.

    The search is A*. What a corner sees is swept row by row of cells: shafts of light, each with
    two directions, fall through runs of free cells.

    `walls`: bool (rows, cols), with a rim of walls; `grain`: parts of a cell in which coordinates
    are counted; `ends`: float64 (2, 2), (row, col) of the points, where cell (0, 0) is the first of
    the rim; `points`: int64 (2, 2), the same in parts of a cell; `limit`: length in cells. Returns
    float64 (n, 3), (row, col) of each corner, and the length of the string to it.
    """
    rows, cols = walls.shape
    # By corner: the string's length and the corner before it; those found, in a heap.
    runs = _runs_of(walls)
    length = np.full((rows, cols), np.inf)
    before = np.full((rows, cols), np.int64(-1))
    is_done = np.zeros((rows, cols), np.bool_)
    heights = np.empty((1024, 3))
    count = 0
    heap, size = np.empty((1024, 2), np.int64), 0
    shafts = np.empty((1024, 5), np.int64)
    corner_row, corner_col = np.int64(-1), np.int64(-1)
    while True:
        # The start is looked from first, and then the corner of the least length.
        if corner_row < 0:
            row, col = points[0, 0], points[0, 1]
            y, x, so_far, name = ends[0, 0], ends[0, 1], 0.0, np.int64(-1)
        else:
            row, col = corner_row * grain, corner_col * grain
            y, x, so_far = float(corner_row), float(corner_col), length[corner_row, corner_col]
            name = np.int64(corner_row * cols + corner_col)
        # Up and down, between two directions: the start sees all, a corner what is behind it.
        for up in (1, -1):
            if corner_row < 0:
                sector = 0, -1, 0, 1
            else:
                back = before[corner_row, corner_col]
                last = points[0, 0], points[0, 1]
                if back >= 0:
                    last = back // cols * grain, back % cols * grain
                string = row - last[0], col - last[1]
                sector = _sector(walls, corner_row, corner_col, string, up)
            # The first shaft, unless the sector is empty.
            left = 0
            if corner_row < 0 or sector[3] * sector[0] > sector[1] * sector[2]:
                shafts[0] = row // grain if up > 0 else -(-row // grain) - 1, *sector
                left = 1
            # Each shaft in one row of cells: the columns between its directions there.
            while left > 0:
                left -= 1
                at, low, low_col, high, high_col = shafts[left]
                base = max(up * (at * grain - row) - (0 if up > 0 else grain), 0)
                top = up * (at * grain - row) + (grain if up > 0 else 0)
                at_col = -(-(col + low_col * base // max(low, 1)) // grain) - 1
                last_col = (col - -(high_col * base) // max(high, 1)) // grain
                # Through each run of free cells that it falls on.
                while at_col <= last_col:
                    if walls[at, at_col]:
                        at_col += 1
                        continue
                    begin, end = runs[at, at_col]
                    at_col = end + 1
                    # The shaft goes on between the ends of the run, as it enters and leaves it.
                    shaft = _clipped(
                        (low, low_col, high, high_col),
                        (begin * grain - col, end * grain - col),
                        (base, top),
                    )
                    if shaft[3] * shaft[0] <= shaft[1] * shaft[2]:
                        continue
                    line = at + (up > 0)
                    right = (col * shaft[2] + shaft[3] * top) // (shaft[2] * grain)
                    # All corners in the light at its upper side are seen.
                    for to in range(
                        -(-(col * shaft[0] + shaft[1] * top) // (shaft[0] * grain)), right + 1
                    ):
                        if _bend(walls, line, to, up)[0] == 0:
                            continue
                        # A string over it is worth a look if the rest may be straight.
                        over = so_far + hypot(line - y, to - x)
                        whole = over + hypot(line - ends[1, 0], to - ends[1, 1])
                        if whole < limit and over < length[line, to]:
                            length[line, to], before[line, to] = over, name
                            if size == len(heap):
                                heap = grow_rows(heap)
                            push(heap, size, int(whole * _FINE), line * cols + to)
                            size += 1
                    # It goes on where a path over its best point is short enough.
                    if left == len(shafts):
                        shafts = grow_rows(shafts)
                    ahead = abs(line - ends[1, 0])
                    height = abs(line - y)
                    best = (x * ahead + ends[1, 1] * height) / (ahead + height)
                    best = max(best, (col + shaft[1] * top / shaft[0]) / grain)
                    best = min(best, (col + shaft[3] * top / shaft[2]) / grain)
                    whole = hypot(height, best - x) + hypot(ahead, best - ends[1, 1])
                    if so_far + whole < limit:
                        shafts[left] = at + up, *shaft
                        left += 1
        # Along its row a point sees the next corner, where a row of cells beside it is free.
        if row % grain == 0:
            line = row // grain
            for across in (1, -1):
                to = -(-col // grain) if across > 0 else col // grain
                if corner_row >= 0:
                    to += across
                over_free = under_free = True
                beside = (col // grain) if across > 0 else -(-col // grain) - 1
                while True:
                    # From the last column to this one.
                    while (beside < to) if across > 0 else (beside >= to):
                        over_free &= not walls[line, beside]
                        under_free &= not walls[line - 1, beside]
                        beside += across
                    if not (over_free or under_free):
                        break
                    # No corner lies in between.
                    if _bend(walls, line, to, 1)[0] != 0:
                        over = so_far + abs(to - x)
                        whole = over + hypot(line - ends[1, 0], to - ends[1, 1])
                        if whole < limit and over < length[line, to]:
                            length[line, to], before[line, to] = over, name
                            if size == len(heap):
                                heap = grow_rows(heap)
                            push(heap, size, int(whole * _FINE), line * cols + to)
                            size += 1
                        break
                    to += across
        # The next corner to look from.
        corner_row = -1
        while size > 0 and corner_row < 0:
            flat = pop(heap, size)
            size -= 1
            if not is_done[flat // cols, flat % cols]:
                corner_row, corner_col = flat // cols, flat % cols
        if corner_row < 0:
            return heights[:count]
        if count == len(heights):
            heights = grow_rows(heights)
        heights[count, 0], heights[count, 1] = corner_row - 1, corner_col - 1
        heights[count, 2] = length[corner_row, corner_col]
        count += 1
        is_done[corner_row, corner_col] = True
