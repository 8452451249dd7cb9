"""Kernels of taut strings: cell paths pulled tight, exactly, round blocked corners.

Positions are (row, col) in grid units: cell (r, c) spans [r, r + 1] x [c, c + 1], so corners are
whole numbers, centres are halves and only the two endpoints of a path can be anything else; they
are rounded to 2^-24 of a cell. Differences of such numbers fit a float64 on any map below 2^28
cells across, and products are compared with their rounding errors: every turn is decided exactly.
"""

import math

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.kernels.exact import turn_of

FREE = 128
"""Bit of a mark: the cell may be entered."""
_KINDS = 4
"""Number of kinds. The rest of a mark below it means that the lower corner of the cell can hold a
string; it then states which of the four cells there is blocked, bit 1 for the upper row, bit 0 for
the upper column."""
_LONGEST = FREE - _KINDS
"""Most columns to the next such corner, or to none, that the rest of a mark can hold."""


@njit(cache=True, nogil=True)
def marks_of(free):
    """Mark for each cell whether it is free, and the kind of its lower corner or columns to the
    next.

    A corner that can hold a string has exactly one blocked cell of four. The rim of the map is a
    wall, so no such corner lies on it, and one byte for each cell is enough.
    """
    rows, cols = free.shape
    marks = np.empty((rows, cols), np.uint8)
    for row in range(rows):
        ahead = _LONGEST
        for col in range(cols - 1, -1, -1):
            ahead = min(ahead + 1, _LONGEST)
            mark = _KINDS - 1 + ahead
            if row > 0 and col > 0:
                west, east = free[row, col - 1], free[row, col]
                below_west, below_east = free[row - 1, col - 1], free[row - 1, col]
                if int(west) + int(east) + int(below_west) + int(below_east) == 3:
                    ahead = 0
                    mark = 2 * int(below_west and below_east) + int(west and below_west)
            marks[row, col] = mark + FREE * int(free[row, col])
    return marks


@njit(cache=True, nogil=True)
def _faces(d_row, d_col, kind):
    """Return the hand of a direction, 1 for the left, on which the blocked cell of a touched corner
    lies."""
    left = d_row if kind & 1 else -d_row
    right = d_col if kind & 2 else -d_col
    return int(left > right) - int(left < right)


@njit(cache=True, nogil=True)
def grown(array, size):
    """Return an array with room for `size` rows."""
    larger = np.empty((max(2 * array.shape[0], size), array.shape[1]), array.dtype)
    larger[: array.shape[0]] = array
    return larger


@njit(cache=True, nogil=True)
def _insert(chain, size, hand, v_row, v_col, row, col):
    """Put a corner into the chain that holds a string from chain[0] to chain[size - 1].

    Parameters
    ----------
    chain
        float64 (m, 2) positions, convex towards v and ordered by angle as seen from there; changed.
    size
        Number of its points.
    hand
        1 or -1.
    v_row, v_col
        Position v.
    row, col
        The corner.

    Returns
    -------
    int
        The new size.
    """
    low, high, above = 0, size - 1, False
    while high - low > 1:
        middle = (low + high) // 2
        m_row, m_col = chain[middle, 0], chain[middle, 1]
        turn = turn_of(v_row, v_col, m_row, m_col, row, col)
        if turn == hand:
            low = middle
        elif turn != 0:
            high = middle
        elif abs(row - v_row) + abs(col - v_col) < abs(m_row - v_row) + abs(m_col - v_col):
            # One is behind the other as seen from v: the nearer one stays.
            low, high, above = middle - 1, middle, True
            break
        else:
            return size
    if not above and (
        turn_of(chain[low, 0], chain[low, 1], chain[high, 0], chain[high, 1], row, col) != hand
    ):
        return size
    while high < size - 1 and (
        turn_of(row, col, chain[high, 0], chain[high, 1], chain[high + 1, 0], chain[high + 1, 1])
        != -hand
    ):
        high += 1
    while low > 0 and (
        turn_of(chain[low - 1, 0], chain[low - 1, 1], chain[low, 0], chain[low, 1], row, col)
        != -hand
    ):
        low -= 1
    gap = high - low - 1
    if gap == 0:
        for k in range(size - 1, high - 1, -1):
            chain[k + 1] = chain[k]
    elif gap > 1:
        for k in range(high, size):
            chain[k - gap + 1] = chain[k]
    chain[low + 1, 0], chain[low + 1, 1] = row, col
    return size - gap + 1


@njit(cache=True, nogil=True)
def _relax(marks, chain, u_row, u_col, v_row, v_col, w_row, w_col):
    """Release the bend v between u and w; fill in the chain of points that then holds the string.

    The corners in the triangle are found row by row.

    Parameters
    ----------
    marks
        uint8 (rows, cols), marks of corners and free cells.
    chain
        float64 (m, 2), receives positions.
    u_row, u_col, v_row, v_col, w_row, w_col
        Positions u, v and w.

    Returns
    -------
    int
        Number of points of the chain, including u and w; 0 if v itself is a corner that holds the
        string, -1 if the chain has too little room.
    """
    # Without a corner in the triangle u, v, w the string runs straight from u to w.
    chain[0, 0], chain[0, 1] = u_row, u_col
    chain[1, 0], chain[1, 1] = w_row, w_col
    size = 2
    hand = turn_of(u_row, u_col, w_row, w_col, v_row, v_col)
    if hand == 0:
        return size
    uv_row, uv_col, vw_row, vw_col = v_row - u_row, v_col - u_col, w_row - v_row, w_col - v_col

    # A corner at v whose blocked cell lies inside the bend, as seen along both segments, holds the
    # string there.
    rows, cols = marks.shape
    if v_row == math.floor(v_row) and v_col == math.floor(v_col):
        if 0 < v_row < rows and 0 < v_col < cols:
            kind = int(marks[int(v_row), int(v_col)]) & (FREE - 1)
            if kind < _KINDS:
                if _faces(uv_row, uv_col, kind) == -hand and _faces(vw_row, vw_col, kind) == -hand:
                    return 0
    # The triangle's points from the lowest row to the highest.
    l_row, l_col, m_row, m_col, h_row, h_col = u_row, u_col, v_row, v_col, w_row, w_col
    if l_row > m_row:
        l_row, l_col, m_row, m_col = m_row, m_col, l_row, l_col
    if m_row > h_row:
        m_row, m_col, h_row, h_col = h_row, h_col, m_row, m_col
        if l_row > m_row:
            l_row, l_col, m_row, m_col = m_row, m_col, l_row, l_col

    # A row meets the triangle between the long edge and the low one, or the high one from m on. A
    # level edge needs no slope: no row reads it, or only at m, where it has no effect.
    long_slope = (h_col - l_col) / (h_row - l_row)
    low_slope = (m_col - l_col) / (m_row - l_row) if m_row > l_row else 0.0
    high_slope = (h_col - m_col) / (h_row - m_row) if h_row > m_row else 0.0
    for row in range(max(math.ceil(l_row), 1), min(math.floor(h_row), rows - 1) + 1):
        left = l_col + (row - l_row) * long_slope
        right = m_col + (row - m_row) * (low_slope if row < m_row else high_slope)
        if left > right:
            left, right = right, left
        # A margin for the rounding of both: the test whether a corner is inside is exact.
        col = max(math.ceil(left - 1e-6), 1)
        last = min(math.floor(right + 1e-6), cols - 1)
        while col <= last:
            kind = int(marks[row, col]) & (FREE - 1)

            # The mark states how far the next corner that can hold a string is at least.
            if kind >= _KINDS:
                col += kind - (_KINDS - 1)
                continue

            # Strictly on v's side of the line from u to w and between the edges at v. A corner on
            # such an edge touches the string already, and holds it if its blocked cell lies inside.
            if turn_of(u_row, u_col, w_row, w_col, row, col) == hand:
                turn = turn_of(u_row, u_col, v_row, v_col, row, col)
                if turn == 0:
                    turn = _faces(uv_row, uv_col, kind)
                if turn == -hand:
                    turn = turn_of(v_row, v_col, w_row, w_col, row, col)
                    if turn == 0:
                        turn = _faces(vw_row, vw_col, kind)
                    if turn == -hand:
                        if size == chain.shape[0]:
                            return -1
                        size = _insert(chain, size, hand, v_row, v_col, float(row), float(col))
            col += 1
    return size


@njit(cache=True, nogil=True)
def tighten(marks, string, n):
    """Pull a legal string of n points taut; return it and its number of points.

    A point is (row, col, whether it may give way). Bends are released in rounds, every other one of
    a run, so that the triangles of a round have together no more rows than the string is long.
    """
    out = np.empty_like(string)
    chain = np.empty((16, 2))

    # A round that releases no bend leaves none that may give way: the string is taut.
    loose = True
    while loose:
        loose = False
        size, i = 1, 1
        out[0] = string[0]
        while i < n:
            if size + 1 > out.shape[0]:
                out = grown(out, size + 1)

            # The last point stays, and so does a bend that held and whose neighbours did not move
            # since.
            if i == n - 1 or string[i, 2] == 0.0:
                out[size] = string[i]
                size += 1
                i += 1
                continue
            held = _relax(
                marks,
                chain,
                out[size - 1, 0],
                out[size - 1, 1],
                string[i, 0],
                string[i, 1],
                string[i + 1, 0],
                string[i + 1, 1],
            )

            # Too little room for the chain: the same bend is tried again with more.
            if held < 0:
                chain = grown(chain, chain.shape[0] + 1)
                continue

            # A corner holds the bend: it is not tried again until a neighbour gives way.
            if held == 0:
                out[size, 0], out[size, 1], out[size, 2] = string[i, 0], string[i, 1], 0.0
                size += 1
                i += 1
                continue

            # The chain replaces the bend. Both neighbours turn by other angles then, so they may
            # give way.
            loose = True
            out[size - 1, 2] = 1.0
            if size + held > out.shape[0]:
                out = grown(out, size + held)
            for k in range(1, held):
                out[size, 0], out[size, 1], out[size, 2] = chain[k, 0], chain[k, 1], 1.0
                size += 1

            # The chain ends with the next bend, which waits for the next round: no two neighbours
            # are released in one.
            i += 2
        string, out, n = out, string, size
    return string, n
