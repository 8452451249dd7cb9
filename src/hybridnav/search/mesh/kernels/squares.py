"""Kernels of squares: the corners that see something of each square of a map.

A corner is listed for each square that its view may meet: some are listed that see nothing there,
none is left out.
"""

import math

import numpy as np
from numba.extending import overload

from hybridnav._base.jit import guarded, njit
from hybridnav.search.mesh.kernels.views import axes, has_target, see_from_corner, view_room

_SHIFT = 0.25
"""Offset of the lines between squares, in cells: points that are centres or corners of cells lie on
none of them."""
_WIDER = 1e-6
"""Widening of views, against rounding."""
_STRAIGHT = 2e-5
"""Sine of a turn that counts as none. A path that turns by more to the slack side is longer than a
shortest one by a hundred times the rounding of labels, so that no hub is missed."""


@njit(cache=True, nogil=True)
def line_before(value, side):
    """Return the number of the row or column of squares in which a coordinate lies."""
    return math.floor((value - _SHIFT) / side) + 1


@njit(cache=True, nogil=True)
def quarter_of(row, col):
    """Return the bit of a quarter of a square, by its row and column among all quarters."""
    return 1 << (2 * (row & 1) + (col & 1))


@njit(cache=True, nogil=True)
def corner_of_square(square, side, n_across):
    """Return the least row and column coordinate in a square."""
    return (square // n_across - 1) * side + _SHIFT, (square % n_across - 1) * side + _SHIFT


@guarded
@njit(cache=True, nogil=True)
def squares_of_polygons(mesh, side, n_across):
    """Return the squares that each polygon meets.

    `mesh`: see `successors`; `side`: side of the squares in cells; `n_across`: number of squares in
    a row. Returns int64 (p + 1,) offsets, int32 squares.
    """
    cx, cy, _, first, begins, finishes, _, _ = mesh
    offset = np.zeros(len(first), np.int64)
    squares, n = np.empty(1024, np.int32), 0
    for polygon in range(len(first) - 1):
        low, high = first[polygon], first[polygon + 1]
        bottom, top = np.inf, -np.inf
        for slot in range(low, high):
            bottom, top = min(bottom, cy[begins[slot]]), max(top, cy[begins[slot]])
        for row in range(line_before(bottom, side), line_before(top, side) + 1):
            # The part of the polygon between the two lines of this row.
            under = (row - 1) * side + _SHIFT
            left, right = np.inf, -np.inf
            for slot in range(low, high):
                u, w = begins[slot], finishes[slot]
                if cy[u] > cy[w]:
                    u, w = w, u
                ax, ay, bx, by = cx[u], cy[u], cx[w], cy[w]
                if by < under or ay > under + side:
                    continue
                if ay < by:
                    slope = (bx - ax) / (by - ay)
                    bx = ax + min(by - ay, under + side - ay) * slope
                    ax += max(0.0, under - ay) * slope
                left, right = min(left, ax, bx), max(right, ax, bx)
            if left > right:
                continue
            begin, end = line_before(left - _WIDER, side), line_before(right + _WIDER, side)
            while n + end + 1 - begin > len(squares):
                squares = np.concatenate((squares, squares))
            for col in range(begin, end + 1):
                squares[n] = row * n_across + col
                n += 1
        offset[polygon + 1] = n
    return offset, squares[:n]


@njit(cache=True, nogil=True)
def _mark(target, polygon, x, y, rays):
    """Append the squares of a polygon that may meet the view between two rays, each once a stamp.

    `target`: results of `squares_of_polygons`; side of the squares and number in a row; int32 (n,
    2) stamps of all squares, and how many polygons of each are seen as far as they lie in it; int64
    the stamp, and the number of squares found, which goes on where there is no room; int32 room for
    them; `polygon`, `x`, `y`, `rays`: the polygon, the corner, and points on the left and the right
    ray.
    """
    offset, squares, (side, n_across), stamps, state, found = target
    lx, ly, rx, ry = rays
    left_x, left_y, right_x, right_y = lx - x, ly - y, rx - x, ry - y
    # What the best of a square's corners adds to the turn of its first one, and what the worst.
    best_right = side * (max(-right_y, 0.0) + max(right_x, 0.0))
    best_left = side * (min(-left_y, 0.0) + min(left_x, 0.0))
    worst_right = side * (right_x - right_y) - best_right
    worst_left = side * (left_x - left_y) - best_left
    for square in squares[offset[polygon] : offset[polygon + 1]]:
        up, across = corner_of_square(square, side, n_across)
        right = right_x * (up - y) - right_y * (across - x)
        left = left_x * (up - y) - left_y * (across - x)
        if right + best_right < -_WIDER or left + best_left > _WIDER:
            continue
        if stamps[square, 0] != state[0]:
            stamps[square, 0], stamps[square, 1] = state[0], 0
            if state[1] < len(found):
                found[state[1]] = square
            state[1] += 1
        # Coordinates are multiples of a quarter: these turns are exact.
        stamps[square, 1] += right + worst_right >= 0.0 and left + worst_left <= 0.0


@overload(has_target)
def _has_squares(target, polygon, x, y, rays):  # noqa: ARG001 - numba's rule
    """Return what stands for `has_target` for squares, which are all marked."""

    def mark(target, polygon, x, y, rays):
        _mark(target, polygon, x, y, rays)
        return False

    return mark if len(target) == 6 else None


@guarded
@njit(cache=True, nogil=True)
def squares_of_views(mesh, walls, squares, layout, found):
    """Return the squares that each corner sees something of, where a path may bend at the corner.

    `mesh`: see `successors`; `walls`: int32 (n,), the wall that begins at each corner, -1 for none;
    `squares`: results of `squares_of_polygons`; `layout`: side of the squares, float; squares in a
    row, squares in all; `found`: int32, room for the squares: twice their numbers, plus 1 if the
    corner sees all free space in the square. Returns int64 (n + 1,) offsets in `found`, as if there
    was room for all.
    """
    cx, cy, kinds, first, _, _, twins, polygon_of = mesh
    side, n_across, n_squares = layout
    state = np.zeros(2, np.int64)
    stamps, n_polygons = np.full((n_squares, 2), -1, np.int32), np.zeros(n_squares, np.int32)
    for square in squares[1]:
        n_polygons[square] += 1
    target = (*squares, (side, n_across), stamps, state, found)
    room = view_room(1024)
    offset = np.zeros(len(kinds) + 1, np.int64)
    for corner in range(len(kinds)):
        lobe = 0
        while lobe < 2 and kinds[corner] < 4 and walls[corner] >= 0:
            # A view that there was no room for begins anew, with a stamp of its own: what it has
            # marked must not count twice.
            if lobe == 0:
                state[0], state[1] = state[0] + 1, offset[corner]
            # All polygons round the corner, then what is seen behind them.
            x, y, slot = cx[corner], cy[corner], walls[corner]
            rx, ry, lx, ly = axes(kinds[corner], lobe)
            while slot >= 0:
                polygon = polygon_of[slot]
                _mark(target, polygon, x, y, (x + lx, y + ly, x + rx, y + ry))
                slot = twins[slot - 1 if slot > first[polygon] else first[polygon + 1] - 1]
            if see_from_corner(mesh, corner, walls[corner], lobe, target, room, 0) >= 0:
                lobe += 1
            else:
                room, lobe = view_room(2 * len(room[2])), 0
        offset[corner + 1] = state[1]
        for k in range(offset[corner], min(state[1], len(found))):
            square = found[k]
            found[k] = 2 * square + (stamps[square, 1] == n_polygons[square])
    return offset


@guarded
@njit(cache=True, nogil=True)
def corners_by_square(offset, found, n_across, layout):
    """Join quarters into squares, and return the corners of each.

    `offset`, `found`: results of `squares_of_views` for the quarters; `n_across`: number of
    quarters in a row; `layout`: number of squares in a row, and in all. Returns int32 (squares +
    1,) offsets; int32 corners with eight bits below, see `HubLabels.views`.
    """
    n_squares_across, n_squares = layout
    begin, last = np.zeros(n_squares + 1, np.int32), np.full(n_squares, -1, np.int32)
    at, corners = begin[:-1], np.empty(0, np.int32)
    # They are counted, then written.
    for turn in range(2):
        for corner in range(len(offset) - 1):
            for twice in found[offset[corner] : offset[corner + 1]]:
                row, col = (twice >> 1) // n_across, (twice >> 1) % n_across
                square = (row + 1 >> 1) * n_squares_across + (col + 1 >> 1)
                if last[square] != 2 * corner + turn:
                    last[square] = 2 * corner + turn
                    if turn == 0:
                        begin[square + 1] += 1
                    else:
                        corners[at[square]] = corner << 8
                        at[square] += 1
                if turn == 1:
                    corners[at[square] - 1] |= quarter_of(row, col) * (16 * (twice & 1) + 1)
        if turn == 0:
            for square in range(n_squares):
                begin[square + 1] += begin[square]
            at, corners = begin[:-1].copy(), np.empty(begin[-1], np.int32)
    return begin, corners


@guarded
@njit(cache=True, nogil=True)
def views_of_squares(mesh, parts, layout, begin, corners):
    """Return the corners of squares with the entries of their labels that a path may go on to.

    `mesh`: see `successors`; `parts`: offsets of the parts of labels by corner and lobe, and of the
    entries of each part; float32 (p, 2) the direction to the next corner, along the wall and away
    from it; `layout`: side of the squares in cells, number in a row; `begin`, `corners`: results of
    `corners_by_square`. Returns int32 (squares + 1,) offsets; int32 (v, 3) see `HubLabels`.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    first, offset, turns = parts
    side, n_across = layout
    views, n = np.empty((len(corners), 3), np.int32), 0
    kept = np.zeros(len(begin), np.int32)
    for square in range(len(begin) - 1):
        y, x = corner_of_square(square, side, n_across)
        for seen in corners[begin[square] : begin[square + 1]]:
            corner = seen >> 8
            ex = 1.0 if kinds[corner] & 1 else -1.0
            ey = 1.0 if kinds[corner] & 2 else -1.0
            low = high = -1
            for lobe in range(2):
                # The square as seen from the corner, in axes that point to where a path comes from.
                sign = 1.0 if lobe == 0 else -1.0
                u, w = (cx[corner] - x) * ex * sign, (y - cy[corner]) * ey * sign
                u_low, u_high = (u - side, u) if ex * sign > 0.0 else (u, u + side)
                w_low, w_high = (w, w + side) if ey * sign > 0.0 else (w - side, w)
                if u_high < 0.0 or w_high < 0.0:
                    continue
                if lobe == 1:
                    u_low, u_high, w_low, w_high = w_low, w_high, u_low, u_high
                near, far = max(u_low, 0.0), w_high
                slack = _STRAIGHT * (1.0 + u_high + w_high)
                part, last = first[2 * corner + lobe], first[2 * corner + lobe + 1]
                if low < 0:
                    low = offset[part]
                while part < last and turns[part, 1] * near - turns[part, 0] * far <= slack:
                    part += 1
                high = offset[part]
            if low < high:
                views[n, 0], views[n, 1], views[n, 2] = seen, low, high
                n += 1
        kept[square + 1] = n
    return kept, views[:n].copy()
