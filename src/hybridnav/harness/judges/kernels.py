"""Kernels of the judge: exact tests of segments against the cells of a grid, and shortest paths.

Positions are (row, col) in grid units: cell (r, c) spans [r, r + 1] x [c, c + 1], its corners are
whole numbers. `free_of` states for each cell class whether it is free, so that no kernel needs a
copy of the map. The tests are exact for coordinates that are multiples of 2^-24 below 2^28:
differences of such numbers fit a float64, and products are compared with their rounding errors.
"""

import heapq
import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.exact import compare_products
from hybridnav._base.trig import hypot

CLEAR, OUTSIDE, BLOCKED, BETWEEN, SEAM = 0, 1, 2, 3, 4
"""Codes of a segment: it stays in the free space, leaves the map, enters a cell that is not free,
passes between two such cells that meet at a corner, runs along a side that two of them share."""

ACROSS = math.sqrt(2)
"""Longest way from a position to a corner of its cell, in cells."""

OCTILE_RATIO = math.sqrt(4 - 2 * math.sqrt(2))
"""Largest ratio of an octile length to the straight one, 1.0824."""


@njit(cache=True, nogil=True)
def _is_free(classes, free_of, row, col):
    """Return whether a cell is in the map and free."""
    if row < 0 or col < 0 or row >= classes.shape[0] or col >= classes.shape[1]:
        return False
    return free_of[classes[row, col]]


@njit(cache=True, nogil=True)
def crossing_at(classes, free_of, row, col):
    """Return whether two free and two blocked cells face each other across a corner of the lattice.

    Return 0 for no, 1 if the free cells are the south-west and north-east ones, -1 for the other
    two.
    """
    south_west = _is_free(classes, free_of, row - 1, col - 1)
    south_east = _is_free(classes, free_of, row - 1, col)
    if south_west == south_east:
        return 0
    if south_west != _is_free(classes, free_of, row, col):
        return 0
    if south_east != _is_free(classes, free_of, row, col - 1):
        return 0
    return 1 if south_west else -1


@njit(cache=True, nogil=True)
def _point_code(classes, free_of, row, col):
    """Return `CLEAR` if a point touches the closed square of a free cell, else `BLOCKED`."""
    for r in range(math.ceil(row) - 1, math.floor(row) + 1):
        for c in range(math.ceil(col) - 1, math.floor(col) + 1):
            if _is_free(classes, free_of, r, c):
                return CLEAR
    return BLOCKED


@njit(cache=True, nogil=True)
def _level_code(classes, free_of, fixed, low, high, along_row):
    """Judge a segment along a row (or column) of the lattice at `fixed`, from `low` to `high`."""
    line = math.floor(fixed)
    on_line = line == fixed
    first = math.floor(low)
    for step in range(first, math.ceil(high)):
        if along_row:
            upper = _is_free(classes, free_of, line, step)
            lower = on_line and _is_free(classes, free_of, line - 1, step)
            crossing = on_line and step > low and crossing_at(classes, free_of, line, step) != 0
        else:
            upper = _is_free(classes, free_of, step, line)
            lower = on_line and _is_free(classes, free_of, step, line - 1)
            crossing = on_line and step > low and crossing_at(classes, free_of, step, line) != 0
        if not upper and not lower:
            return SEAM if on_line else BLOCKED
        if crossing:
            return BETWEEN
    return CLEAR


@njit(cache=True, nogil=True)
def segment_code(classes, free_of, row0, col0, row1, col1):
    """Return the code of a segment's first fault, 0 for none; its endpoints count as touched only.

    The walk visits the cells whose interior the segment enters (J. Amanatides, A. Woo: A fast voxel
    traversal algorithm for ray tracing, 1987) with exact comparisons of the crossings.
    """
    rows, cols = classes.shape
    if min(row0, row1) < 0 or max(row0, row1) > rows or min(col0, col1) < 0:
        return OUTSIDE
    if max(col0, col1) > cols:
        return OUTSIDE
    if row0 == row1:
        if col0 == col1:
            return _point_code(classes, free_of, row0, col0)
        return _level_code(classes, free_of, row0, min(col0, col1), max(col0, col1), True)
    if col0 == col1:
        return _level_code(classes, free_of, col0, min(row0, row1), max(row0, row1), False)
    if col1 < col0:
        row0, col0, row1, col1 = row1, col1, row0, col0
    width, height = col1 - col0, abs(row1 - row0)
    up = row1 > row0
    col = math.floor(col0)
    row = math.floor(row0) if up else math.ceil(row0) - 1
    last_col = math.ceil(col1) - 1
    last_row = math.ceil(row1) - 1 if up else math.floor(row1)
    turn = 1 if up else -1
    while True:
        if not free_of[classes[row, col]]:
            return BLOCKED
        if row == last_row and col == last_col:
            return CLEAR
        to_line = row + 1 - row0 if up else row0 - row
        order = compare_products(col + 1 - col0, height, to_line, width)
        if order == 0:
            # Through a corner: never through one of the endpoints, since a cell is still to come.
            if not free_of[classes[row, col + 1]] and not free_of[classes[row + turn, col]]:
                return BETWEEN
            row += turn
            col += 1
        elif order < 0:
            col += 1
        else:
            row += turn


@njit(cache=True, nogil=True)
def segment_codes(classes, free_of, positions):
    """Return the code of each segment of a polyline; a single point has one code."""
    n = positions.shape[0]
    codes = np.zeros(max(n - 1, 1), np.int8)
    for i in range(codes.size):
        j = min(i + 1, n - 1)
        codes[i] = segment_code(
            classes, free_of, positions[i, 0], positions[i, 1], positions[j, 0], positions[j, 1]
        )
    return codes


@njit(cache=True, nogil=True)
def crossed_joints(classes, free_of, positions):
    """Return for each point whether the polyline crosses a corner there between two free cells.

    Repeated points count once, as the last of them.
    """
    n = positions.shape[0]
    crossed = np.zeros(n, np.bool_)
    before = 0
    for i in range(1, n - 1):
        row, col = positions[i]
        if positions[i + 1, 0] == row and positions[i + 1, 1] == col:
            continue
        came_row, came_col = positions[before, 0] - row, positions[before, 1] - col
        before = i
        if row != math.floor(row) or col != math.floor(col) or (came_row == 0 and came_col == 0):
            continue
        crossing = crossing_at(classes, free_of, int(row), int(col))
        if crossing == 0:
            continue
        # The two free cells lie on opposite sides of the other diagonal through the corner.
        came = came_row + crossing * came_col
        goes = positions[i + 1, 0] - row + crossing * (positions[i + 1, 1] - col)
        crossed[i] = (came > 0) != (goes > 0)
    return crossed


@guarded
@njit(cache=True, nogil=True)
def octile_lengths(classes, free_of, start_row, start_col, goal_row, goal_col):
    """Return the lengths of octile paths from each corner of the lattice to a goal, and from a
    start. They are infinite where there is no path, and at corners too far away for a shortest
    path.

    Such a path runs along sides and diagonals of free cells, and turns at corners where no two
    blocked cells meet alone: it is legal at any angle. A legal segment between two corners has an
    octile path in the cells that it passes, at most `OCTILE_RATIO` times as long.
    """
    rows, cols = classes.shape
    lengths = np.full((rows + 1, cols + 1), np.inf)
    done = np.zeros(lengths.shape, np.bool_)
    heap = [(np.inf, 0, 0)]
    for row, col, away in _corners_round(classes, free_of, goal_row, goal_col):
        lengths[row, col] = away
        heapq.heappush(heap, (away, row, col))
    from_start = np.full(lengths.shape, np.inf)
    for row, col, away in _corners_round(classes, free_of, start_row, start_col):
        from_start[row, col] = away
    best = np.inf
    while heap:
        length, row, col = heapq.heappop(heap)
        if length > OCTILE_RATIO * (best + ACROSS) + ACROSS:  # see `lower_bounds`
            break
        if length == np.inf or done[row, col]:
            continue
        done[row, col] = True
        best = min(best, length + from_start[row, col])
        for up in range(-1, 2):
            for right in range(-1, 2):
                if not _is_step(classes, free_of, row, col, up, right):
                    continue
                total = length + hypot(up, right)
                if total < lengths[row + up, col + right]:
                    lengths[row + up, col + right] = total
                    heapq.heappush(heap, (total, row + up, col + right))
    return np.where(done, lengths, np.inf), best


@njit(cache=True, nogil=True)
def _corners_round(classes, free_of, row, col):
    """Return the corners of the free cells that a position touches, each with its distance; none
    where two free cells meet alone."""
    corners = [(0, 0, np.inf)][:0]
    for r in range(math.ceil(row) - 1, math.floor(row) + 1):
        for c in range(math.ceil(col) - 1, math.floor(col) + 1):
            if not _is_free(classes, free_of, r, c):
                continue
            for there_row in range(r, r + 2):
                for there_col in range(c, c + 2):
                    if crossing_at(classes, free_of, there_row, there_col) == 0:
                        away = hypot(there_row - row, there_col - col)
                        corners.append((there_row, there_col, away))
    return corners


@njit(cache=True, nogil=True)
def _is_step(classes, free_of, row, col, up, right):
    """Return whether an octile path on corners may step by one side or diagonal of a cell."""
    if up == 0 and right == 0:
        return False
    low, left = row + min(up, 0), col + min(right, 0)
    free = _is_free(classes, free_of, low, left)
    if up == 0:
        free = free or _is_free(classes, free_of, low - 1, left)
    if right == 0:
        free = free or _is_free(classes, free_of, low, left - 1)
    return free and crossing_at(classes, free_of, row + up, col + right) == 0


@njit(cache=True, nogil=True)
def shortest_chain(classes, free_of, nodes, blocked, to_goal, most):
    """Return the nodes on a shortest path from the last but one to the last, in order; empty if no
    path is at most `most` long.

    The search is A*, and tests only then whether two nodes see each other when their segment is the
    next to be taken: the first segment to a node that passes the test is on a shortest path to it.
    A shortest path bends round the blocked cell at each corner, so other segments are left out.

    `nodes`, float64 (n, 2), are the corners that may be on the path, the start and the goal;
    `blocked`, int64 (n, 2), the signs of the direction to the blocked cell of each, 0 at both ends;
    `to_goal`, float64 (n,), lower bounds on the ways to the goal. All lengths are in cells.
    """
    n = nodes.shape[0]
    lengths = np.zeros(n)
    came = np.full(n, -1, np.int64)

    # The start is reached from itself: then it counts as reached, and no segment leads to it.
    heap = [(0.0, n - 2, n - 2)]
    while heap and came[n - 1] < 0:
        _, node, before = heapq.heappop(heap)
        if came[node] >= 0:
            continue
        row, col = nodes[node]
        from_row, from_col = row - nodes[before, 0], col - nodes[before, 1]
        if node != before:
            code = segment_code(classes, free_of, nodes[before, 0], nodes[before, 1], row, col)
            if code != CLEAR:
                continue
        came[node] = before
        lengths[node] = lengths[before] + hypot(from_row, from_col)
        # The blocked cell lies to the left or right of the path that arrives, by this sign.
        side = from_row * blocked[node, 1] - from_col * blocked[node, 0]
        for head in range(n):
            if came[head] >= 0:
                continue
            to_row, to_col = nodes[head, 0] - row, nodes[head, 1] - col
            # A shortest path leaves on a tangent to the blocked cell: neither into the quadrant
            # of that cell nor into the opposite one. So it arrives at the next corner, too.
            if to_row * to_col * blocked[node, 0] * blocked[node, 1] > 0:
                continue
            if to_row * to_col * blocked[head, 0] * blocked[head, 1] > 0:
                continue
            if side != 0.0:
                # Round a corner it turns towards the blocked cell, by a right angle at most.
                turn = compare_products(from_row, to_col, from_col, to_row)
                if turn * side < 0 or from_row * to_row + from_col * to_col < 0:
                    continue
            # Longer paths are of no use to the caller, and the heap stays small without them.
            estimate = lengths[node] + hypot(to_row, to_col) + to_goal[head]
            if estimate <= most:
                heapq.heappush(heap, (estimate, head, node))

    # From the goal back to the start; without a path the chain is empty.
    chain = np.empty(n, np.int64)
    size, node = 0, n - 1
    while came[n - 1] >= 0 and size < n:
        chain[size] = node
        size += 1
        if node == n - 2:
            break
        node = came[node]
    return chain[:size][::-1]


# The judge's own Dijkstra: costs of paths of cells, in floating point.


@njit(cache=True, nogil=True)
def cheapest_cost(factors, cuts_corners, start, goal):
    """Return the cost of a cheapest path of cells between two cells, infinite for none.

    Buckets are one straight step of factor 1 wide, which no move costs less than: so no cell can be
    improved from its own bucket, and its cost is final when its bucket is opened (Dinic 1978).
    Buckets take turns; each is a chain of entries, and those left behind by a better cost are
    skipped.

    `factors`: float64 (rows, cols) with a rim of zeros: at least 1 in cells that may be entered,
    else 0; `cuts_corners`: whether a diagonal may pass a cell that may not be entered; `start`,
    `goal`: flat cells.
    """
    cols = factors.shape[1]
    factor = factors.ravel()
    diagonal = math.sqrt(2.0)

    # The dearest move must lead less than once round the ring, or buckets would mix costs.
    n_buckets = int(diagonal * factors.max()) + 2
    cost = np.full(factor.size, np.inf)
    first = np.full(n_buckets, -1, np.int64)

    # Entries of all chains share two arrays; those taken out form a chain too, and are used again.
    following = np.empty(1024, np.int64)
    cell_of = np.empty(1024, np.int64)
    unused = np.int64(-1)
    n_entries, left, turn = 0, 1, 0
    cost[start] = 0.0
    first[0], following[0], cell_of[0], n_entries = 0, -1, start, 1
    while left > 0:
        slot = turn % n_buckets
        # What is found from now on costs `turn` + 1 or more, so this is the least.
        if cost[goal] < turn + 1:
            return cost[goal]
        while first[slot] >= 0:
            entry = first[slot]
            first[slot] = following[entry]
            following[entry] = unused
            unused = entry
            left -= 1
            cell = cell_of[entry]
            # A better cost put the cell into an earlier bucket, where it was expanded.
            if int(cost[cell]) != turn:
                continue
            for k in range(9):
                up, right = k // 3 - 1, k % 3 - 1
                to = cell + up * cols + right
                # The middle of the nine is the cell itself; the rim of zeros keeps `to` on the map.
                if k == 4 or factor[to] == 0.0:
                    continue
                length = 1.0
                if up != 0 and right != 0:
                    length = diagonal
                    is_past = factor[cell + up * cols] == 0.0 or factor[cell + right] == 0.0
                    if is_past and not cuts_corners:
                        continue
                # Half of a move lies in each of its two cells, and pays the factor of that cell.
                new_cost = cost[cell] + length * (factor[cell] + factor[to]) / 2.0
                if new_cost >= cost[to]:
                    continue
                cost[to] = new_cost
                if unused < 0 and n_entries == cell_of.size:
                    following = np.append(following, np.empty_like(following))
                    cell_of = np.append(cell_of, np.empty_like(cell_of))
                # So room grows with the entries that wait, not with all that ever did.
                entry = unused
                if entry >= 0:
                    unused = following[entry]
                else:
                    entry = np.int64(n_entries)
                    n_entries += 1
                into = int(new_cost) % n_buckets
                cell_of[entry] = to
                following[entry] = first[into]
                first[into] = entry
                left += 1
        turn += 1
    return np.inf


# Where a line leaves the free space, how deep, and how far it stays off obstacles.

SMALL = 1e-9
"""Cells below which a piece between two lines of the lattice is what rounding leaves."""
FAR = 1 << 30
"""Column of no cell."""


@guarded
@njit(cache=True, nogil=True)
def faulty_spans(classes, free_of, positions, faulty):
    """Return the pieces of faulty segments that lie outside the free space, float64 (m, 3).

    Each is a segment, and the shares of it at which the piece begins and ends: the same share
    where it passes a corner between two blocked cells.

    `positions`: float64 (n, 2); `faulty`: bool (max(n - 1, 1),), the segments with a fault.
    """
    spans = [(0.0, 0.0, 0.0)][:0]
    for i in range(faulty.size):
        if not faulty[i]:
            continue
        row0, col0 = positions[i]
        row1, col1 = positions[min(i + 1, len(positions) - 1)]
        up, across = row1 - row0, col1 - col0
        length = hypot(up, across)

        # The lines of the lattice ahead; beyond the map there are none.
        row_line = _first_line(row0, up, classes.shape[0])
        col_line = _first_line(col0, across, classes.shape[1])
        n_before, share, begun, tiny = len(spans), 0.0, -1.0, 0.0
        while share < 1.0:
            # From one line to the next one of either kind.
            to_row = (row_line - row0) / up if 0 <= row_line <= classes.shape[0] else np.inf
            to_col = (col_line - col0) / across if 0 <= col_line <= classes.shape[1] else np.inf
            end = min(to_row, to_col, 1.0)
            if to_row <= end:
                row_line += math.copysign(1.0, up)
            if to_col <= end:
                col_line += math.copysign(1.0, across)

            # The middle of a piece decides on all of it.
            middle = (share + end) / 2
            if (end - share) * length <= SMALL < length:
                tiny = middle
            elif _point_code(classes, free_of, row0 + middle * up, col0 + middle * across) != CLEAR:
                begun = share if begun < 0 else begun
            elif begun >= 0:
                spans.append((float(i), begun, share))
                begun = -1.0

            # At a corner with two free cells it comes from the one into the other.
            row, col = row0 + end * up, col0 + end * across
            at_row, at_col = math.floor(row + 0.5), math.floor(col + 0.5)
            is_corner = abs(row - at_row) <= SMALL and abs(col - at_col) <= SMALL
            if is_corner and end < 1.0 and begun < 0:
                if crossing_at(classes, free_of, at_row, at_col) != 0:
                    spans.append((float(i), end, end))
            share = end

        # The last piece; without any, the segment enters a cell by less than rounding.
        if begun >= 0:
            spans.append((float(i), begun, 1.0))
        elif len(spans) == n_before:
            spans.append((float(i), tiny, tiny))
    found = np.empty((len(spans), 3))
    for k in range(len(spans)):
        found[k, 0], found[k, 1], found[k, 2] = spans[k]
    return found


@njit(cache=True, nogil=True)
def _first_line(start, ahead, most):
    """Return the first whole number from 0 to `most` that a coordinate comes to, -1 for none."""
    if ahead == 0:
        return -1.0
    if ahead > 0:
        return max(math.floor(start) + 1.0, 0.0)
    return min(math.ceil(start) - 1.0, float(most))


@njit(cache=True, nogil=True)
def neighbours_in_row(cells):
    """Return for each cell the column of the nearest one of some cells in its row, int32 (2, rows,
    cols): to the left, or its own, and to the right, or its own; `FAR` away for none.

    `cells`: bool (rows, cols).
    """
    rows, cols = cells.shape
    near = np.empty((2, rows, cols), np.int32)
    for row in range(rows):
        last = -FAR
        for col in range(cols):
            last = col if cells[row, col] else last
            near[0, row, col] = last
        last = FAR
        for col in range(cols - 1, -1, -1):
            last = col if cells[row, col] else last
            near[1, row, col] = last
    return near


@njit(cache=True, nogil=True)
def distance_to(near, row, col):
    """Return the distance from a position to the nearest closed square of some cells, in cells; at
    least `FAR` / 2 for none. `near`: see `neighbours_in_row`."""
    rows, cols = near.shape[1], near.shape[2]
    c = min(max(math.floor(col), 0), cols - 1)
    middle = min(max(math.floor(row), 0), rows - 1)
    best = float(FAR) * FAR
    for away in range(rows):
        # The rows above and below, until they alone are farther than what was found.
        is_done = True
        for r in (middle - away, middle + away):
            up = max(r - row, row - r - 1, 0.0)
            if r < 0 or r >= rows or up * up >= best:
                continue
            is_done = False
            left, right = near[0, r, c], near[1, r, c]
            across = max(col - left - 1, left - col, 0.0)
            across = min(across, max(right - col, col - right - 1, 0.0))
            best = min(best, up * up + across * across)
        if is_done:
            break
    return math.sqrt(best)


@guarded
@njit(cache=True, nogil=True)
def distances_to(near, positions):
    """Return `distance_to` of many positions, float64 (n,)."""
    found = np.empty(len(positions))
    for i in range(len(positions)):
        found[i] = distance_to(near, positions[i, 0], positions[i, 1])
    return found


@guarded
@njit(cache=True, nogil=True)
def farthest(near, starts, ends, sign, within):
    """Return for each of some segments where it is farthest from some cells, float64 (n, 2): the
    share of the segment, and the distance there; with sign -1 where it is nearest.

    A distance changes by at most one cell a cell: halves that cannot hold a better one are left
    out. `starts`, `ends`: float64 (n, 2); `within`: cells by which an answer may be off.
    """
    found = np.empty((len(starts), 2))
    waiting = np.empty((128, 4))
    for i in range(len(starts)):
        row, col = starts[i]
        up, across = ends[i, 0] - row, ends[i, 1] - col
        length = hypot(up, across)
        first, last = distance_to(near, row, col), distance_to(near, row + up, col + across)
        share, best = (0.0, first) if sign * first >= sign * last else (1.0, last)
        waiting[0, 0], waiting[0, 1], waiting[0, 2], waiting[0, 3] = 0.0, first, 1.0, last
        size = 1
        while size > 0:
            low, at_low, high, at_high = waiting[size - 1]
            hope = (sign * (at_low + at_high) + (high - low) * length) / 2
            middle = (low + high) / 2
            if hope <= sign * best + within or not low < middle < high:
                size -= 1
                continue
            here = distance_to(near, row + middle * up, col + middle * across)
            if sign * here > sign * best:
                share, best = middle, here
            waiting[size, 0], waiting[size, 1] = middle, here
            waiting[size, 2], waiting[size, 3] = high, at_high
            waiting[size - 1, 2], waiting[size - 1, 3] = middle, here
            size += 1
        found[i, 0], found[i, 1] = share, best
    return found
