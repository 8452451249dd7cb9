"""Kernels of many exact tests of segments; positions are those of `refine.kernels.taut`."""

import math

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.exact import GRAIN, is_legal
from hybridnav._base.trig import hypot
from hybridnav.refine.kernels.taut import FREE, grown, tighten


@njit(cache=True, nogil=True)
def clear_segments(marks, tails, heads):
    """Return which segments stay in free space, bool (n,); a point alone does."""
    clear = np.empty(len(tails), np.bool_)
    for i in range(len(tails)):
        row, col, down, across = tails[i, 0], tails[i, 1], heads[i, 0], heads[i, 1]
        is_point = row == down and col == across
        clear[i] = is_point or is_legal(marks, row, col, down, across, FREE, FREE)
    return clear


# Kernel of the any-angle finish: from a cell path to a short string.
#
# Positions are those of `refine.kernels.taut`.


_STEPS, _STEPS_PER_CELL = 2000, 1
"""Steps of the walks round obstacles. On twenty small maps, strings that are only taut are 0.33 %
longer than the optimum, with these steps 0.13 %, with 3000 and 4 a cell 0.09 % (in 1.5 times the
time), without a limit 0.04 % (in five times the time)."""


@njit(cache=True, nogil=True)
def _finish(marks, string, n, budget, points, size):
    """Shorten a legal string and append its points to others, without repeated ones."""
    string[:n, 2] = 1.0
    string, n = tighten(marks, string, n)
    string, n = improve(marks, string, n, budget)
    if size + n > points.shape[0]:
        points = grown(points, size + n)
    for i in range(n):
        row, col = string[i, 0], string[i, 1]
        if size == 0 or points[size - 1, 0] != row or points[size - 1, 1] != col:
            points[size, 0], points[size, 1] = row, col
            size += 1
    return points, size


@njit(cache=True, nogil=True)
def shorten(marks, cells, metres, origin, per_metre, corner_cutting):
    """Return the any-angle path between two points, positions (m, 2), from a legal path of cells.

    `per_metre` holds, for rows and columns, the length of a metre along x and y in grid units.
    Return no positions if a point lies outside its cell; the same position twice if two different
    points round to the same one.

    A move across a corner with a blocked cell beside it is led through that corner. Between two
    blocked cells the string is cut there, and its parts are shortened one by one.
    """
    n = cells.shape[0]
    points, string, endpoints = np.empty((64, 2)), np.empty((64, 3)), np.empty((2, 2))
    for end in range(2):
        x, y = metres[end, 0] - origin[0], metres[end, 1] - origin[1]
        for k in range(2):
            low = cells[end * (n - 1), k]
            position = per_metre[k, 0] * x + per_metre[k, 1] * y
            if not low - 1e-6 <= position <= low + 1 + 1e-6:
                return points[:0]
            # Few enough digits for exact tests; a point outside the cell by rounding moves to its
            # rim.
            endpoints[end, k] = min(max(np.rint(position * GRAIN) / GRAIN, low), low + 1)
    string[0, :2] = endpoints[0]
    found, size = 0, 1
    for i in range(1, n):
        row, col = cells[i, 0], cells[i, 1]
        d_row, d_col = row - cells[i - 1, 0], col - cells[i - 1, 1]
        if size + 3 > string.shape[0]:
            string = grown(string, size + 3)
        if corner_cutting and d_row * d_col != 0:
            beside = int(marks[row - d_row, col] >= FREE) + int(marks[row, col - d_col] >= FREE)
            if beside < 2:
                string[size, 0], string[size, 1] = max(row, row - d_row), max(col, col - d_col)
                size += 1
            if beside == 0:
                points, found = _finish(marks, string, size, _STEPS, points, found)
                string = np.empty((64, 3))
                string[0, :2] = points[found - 1]
                size = 1
        # Centres on a straight run between two others hold no string.
        bends = i == 1 or i == n - 2
        if i < n - 1 and not bends:
            bends = cells[i + 1, 0] - row != d_row or cells[i + 1, 1] - col != d_col
        if i < n - 1 and bends:
            string[size, 0], string[size, 1] = row + 0.5, col + 0.5
            size += 1
    string[size, :2] = endpoints[1]
    budget = _STEPS + _STEPS_PER_CELL * n
    points, found = _finish(marks, string, size + 1, budget, points, found)
    if found == 1 and (metres[0, 0] != metres[1, 0] or metres[0, 1] != metres[1, 1]):
        points[1] = points[0]
        found = 2
    return points[:found].copy()


# Kernels that lead parts of a taut string past the other sides of obstacles.
#
# Positions are those of `refine.kernels.taut`.

_ROUND = 2.0**20
_WIDEST = 8
"""Most segments of a part of a string that is led another way."""
_SLACK = 0.002
"""Share of its length by which a part of more than two segments must exceed the straight line to be
tried; a part of two is always tried, so that no superfluous point stays."""


@njit(cache=True, nogil=True)
def _cell_at(marks, u_row, u_col, w_row, w_col):
    """Return the free cell touched by u that lies nearest to w, (row, col); row -1 for none."""
    best, best_row, best_col = np.inf, -1, -1
    rows, cols = marks.shape
    for row in range(max(math.ceil(u_row) - 1, 0), min(math.floor(u_row) + 1, rows)):
        for col in range(max(math.ceil(u_col) - 1, 0), min(math.floor(u_col) + 1, cols)):
            distance = abs(row + 0.5 - w_row) + abs(col + 0.5 - w_col)
            if distance < best and (marks[row, col] >= FREE):
                best, best_row, best_col = distance, row, col
    return best_row, best_col


@njit(cache=True, nogil=True)
def _add(string, size, row, col):
    """Append a point that may give way, rounded."""
    string[size, 0], string[size, 1] = (
        np.rint(row * _ROUND) / _ROUND,
        np.rint(col * _ROUND) / _ROUND,
    )
    string[size, 2] = 1.0
    return size + 1


@njit(cache=True, nogil=True)
def _detour(marks, string, u_row, u_col, w_row, w_col, limit, hand):
    """Walk cells straight from u to w, and round obstacles always on one hand.

    After V. Lumelsky, A. Stepanov: Path-planning strategies for a point mobile automaton, 1987
    (Bug2). The walk ends outside the ellipse in which a path shorter than `limit` stays. The points
    where the walk leaves and meets the straight line are rounded, so the result must be tested.

    Parameters
    ----------
    marks
        uint8 (rows, cols), marks of corners and free cells.
    string
        float64 (n, 3), receives the positions of the walk, and 1 for each.
    u_row, u_col, w_row, w_col
        Positions u and w.
    limit
        Length in cells.
    hand
        1 or -1.

    Returns
    -------
    tuple
        Number of points, 0 for no walk, and of steps.
    """
    rows, cols = marks.shape
    row, col = _cell_at(marks, u_row, u_col, w_row, w_col)
    to_row, to_col = w_row - u_row, w_col - u_col
    distance = hypot(to_row, to_col)
    if row < 0 or distance == 0.0:
        return 0, 0
    string[0, 0], string[0, 1], string[0, 2] = u_row, u_col, 1.0

    # The line leaves row `row` at the share (row + row_ahead) * per_row of it; so with columns.
    per_row = 1 / to_row if to_row != 0.0 else np.inf
    per_col = 1 / to_col if to_col != 0.0 else np.inf
    row_ahead, col_ahead = (to_row > 0) - u_row, (to_col > 0) - u_col
    row_turn, col_turn = 1 if to_row > 0 else 3, 0 if to_col > 0 else 2

    # The line meets a cell if the cross product below, with the cell's centre, is `reach` at most.
    reach = (abs(to_row) + abs(to_col)) / 2

    # Two states: straight along the line, or, if `follows`, round an obstacle met at about `hit`.
    size, last, hit, follows, heading = 1, -1, 0.0, False, 0
    # The centre of a cell may lie a little outside an ellipse that contains the string.
    limit += 0.5
    n_steps = int(3 * limit) + 16
    for step in range(n_steps):
        if size + 6 > string.shape[0]:
            break
        if follows:
            d_row, d_col = row + 0.5 - u_row, col + 0.5 - u_col
            done = (to_row * d_row + to_col * d_col) / (distance * distance)
            # From round to straight: back on the line, and nearer to w than where it was left, so
            # that each obstacle brings the walk ahead (Bug2).
            if abs(to_row * d_col - to_col * d_row) <= reach and done > hit:
                follows = False
                size = _add(string, size, row + 0.5, col + 0.5)
                meet_row, meet_col = u_row + done * to_row, u_col + done * to_col
                meet_row = min(max(meet_row, float(row)), row + 1.0)
                meet_col = min(max(meet_col, float(col)), col + 1.0)
                size = _add(string, size, meet_row, meet_col)
        if follows:
            # Round an obstacle: look to its side first, so that it stays on the same hand.
            heading = (heading - hand) & 3
        else:
            # Share of the line at which it leaves the cell.
            at_row = (row + row_ahead) * per_row if to_row != 0.0 else np.inf
            at_col = (col + col_ahead) * per_col if to_col != 0.0 else np.inf
            at = min(at_row, at_col)
            if at >= 1.0 - 1e-12:
                string[size, 0], string[size, 1], string[size, 2] = w_row, w_col, 1.0
                return size + 1, step
            heading = row_turn if at_row < at_col else col_turn
        is_free = False
        for _ in range(4):
            n_row = row + (heading == 1) - (heading == 3)
            n_col = col + (heading == 0) - (heading == 2)
            if 0 <= n_row < rows and 0 <= n_col < cols and (marks[n_row, n_col] >= FREE):
                is_free = True
                break
            # From straight to round. Half a cell is added, as the line must be met farther ahead.
            if not follows:
                follows, hit, last = True, at + 0.5 / distance, -1
                hit_row = min(max(u_row + at * to_row, float(row)), row + 1.0)
                hit_col = min(max(u_col + at * to_col, float(col)), col + 1.0)
                size = _add(string, size, hit_row, hit_col)
            heading = (heading + hand) & 3
        if not is_free:
            return 0, step
        if follows:
            # Bends of the walk are enough: between them the centres lie on one line.
            if heading != last:
                size = _add(string, size, row + 0.5, col + 0.5)
                last = heading
            # Outside this ellipse with foci u and w no path is shorter than `limit`.
            from_row, from_col = n_row + 0.5 - u_row, n_col + 0.5 - u_col
            d_row, d_col = from_row - to_row, from_col - to_col
            near = math.sqrt(from_row * from_row + from_col * from_col)
            if near + math.sqrt(d_row * d_row + d_col * d_col) > limit:
                return 0, step
        row, col = n_row, n_col
    return 0, step


@njit(cache=True, nogil=True)
def _length(string, first, last):
    """Return the length of a part of a string."""
    total = 0.0
    for i in range(first, last):
        d_row, d_col = string[i + 1, 0] - string[i, 0], string[i + 1, 1] - string[i, 1]
        total += math.sqrt(d_row * d_row + d_col * d_col)
    return total


@njit(cache=True, nogil=True)
def improve(marks, string, n, budget):
    """Lead parts of a taut string past other sides of obstacles if that makes it shorter.

    Parts of two to `_WIDEST` segments, short ones first, until the budget of steps is used up.
    """
    room = np.empty((256, 3))

    # Short parts first: they are the cheapest to walk, and the budget may not last.
    for span in range(2, _WIDEST + 1):
        i = 0
        while i < n - span:
            j, i = i + span, i + 1
            length = _length(string, i - 1, j)
            u_row, u_col, w_row, w_col = (
                string[i - 1, 0],
                string[i - 1, 1],
                string[j, 0],
                string[j, 1],
            )
            # A part that is almost straight has too little to gain for a walk.
            if length - hypot(w_row - u_row, w_col - u_col) < _SLACK * length * (span > 2):
                continue
            for hand in (1, -1):
                if budget <= 0:
                    return string, n
                size, steps = _detour(marks, room, u_row, u_col, w_row, w_col, length, hand)
                # Each walk is charged for its steps and its start, each taut string for its
                # points: so the budget bounds the time.
                budget -= steps + 20
                if size == 0:
                    continue
                budget -= 10 * size
                detour, size = tighten(marks, room[:size].copy(), size)
                if _length(detour, 0, size - 1) > length - 1e-9:
                    continue
                # The walk rounds some of its points, so its string may cross a blocked cell.
                legal = True
                for k in range(size - 1):
                    legal = legal and is_legal(
                        marks,
                        detour[k, 0],
                        detour[k, 1],
                        detour[k + 1, 0],
                        detour[k + 1, 1],
                        FREE,
                        FREE,
                    )
                if not legal:
                    continue
                # All points may give way again: the new part can pull its ends off corners.
                larger = np.empty((n - span + size - 1, 3))
                larger[:i] = string[:i]
                larger[i : i - 1 + size] = detour[1:size]
                larger[i - 1 + size :] = string[j + 1 : n]
                larger[:, 2] = 1.0
                string, n = tighten(marks, larger, larger.shape[0])
                # Parts that begin a little before have changed too, so they are tried again.
                i = max(i - 3, 0)
                break
    return string, n
