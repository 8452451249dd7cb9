"""Kernels that repair a jump-point graph in place where cells changed.

Distances are read along rows, columns and diagonals, so a change is followed backwards along these
lines, as far as a distance differs. What joins a corner cell to others reads these distances: the
corner cells that read one which differs are joined again.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.moves import octile_cost
from hybridnav.search.contraction import HEAD_SHIFT, pack
from hybridnav.search.octile.kernels.legs import (
    COLUMN_BITS,
    KIND_BITS,
    class_of,
    join,
    limit_of,
    reverse,
    row_col_kind,
    step_of,
)
from hybridnav.search.octile.kernels.tables import is_corner, n_bits, number_of

_LOST, _GAINED, _JOINED = 1, 2, 3
WORD = 64
"""Cells of a word of the index, and rows of distances that one with a freed cell gets."""


@njit(cache=True, nogil=True, _nrt=False)
def _is_open(index, cell):
    """Return whether a cell is free."""
    return index[cell >> 6, 0] >> (cell & 63) & 1 == 1


@njit(cache=True, nogil=True, _nrt=False)
def _kind(index, width, cell):
    """Return the corners of a cell that are blocked while both cells beside them are free; 0 for a
    blocked cell."""
    kind = 0
    if _is_open(index, cell):
        for k in range(1, 8, 2):
            one, two = cell + step_of(k - 1, width), cell + step_of(k + 1 & 7, width)
            if _is_open(index, one) and _is_open(index, two):
                kind |= (0 if _is_open(index, cell + step_of(k, width)) else 1) << k // 2
    return kind


@guarded
@njit(cache=True, nogil=True)
def move_rows(index, ahead, fill, cells, is_free):
    """Set which of some cells are free, and move the rows of distances of their words.

    `index`: see `number_cells`; `ahead`: int16 or int32 (room, 8), see `look_ahead`; `fill`: int64
    (2,), the rows of `ahead` that were there at first, and those that are used; all three are
    changed. `cells`: int64 (m,), flat cells of the framed grid, in their order; `is_free`: bool
    (m,). Returns the cells that differ, int64; None, and nothing has changed, if `ahead` has no
    room: a word that a cell becomes free in gets a row for each of its cells, once.
    """
    # Room for all is wanted before the first is moved.
    wanted = fill[1]
    last = np.int64(-1)
    for i in range(len(cells)):
        word = cells[i] >> 6
        if is_free[i] and word != last and index[word, 2] >> 32 < fill[0]:
            wanted += WORD
            last = word
    if wanted > len(ahead):
        return None
    differ, n = np.empty(len(cells), np.int64), 0
    rows = np.zeros((WORD + 1, 8), ahead.dtype)  # the last one is of freed cells
    i = 0
    while i < len(cells):
        word, now = cells[i] >> 6, index[cells[i] >> 6, 0]
        while i < len(cells) and cells[i] >> 6 == word:
            bit = np.int64(1) << (cells[i] & 63)
            if (now & bit != 0) != is_free[i]:
                now ^= bit
                differ[n] = cells[i]
                n += 1
            i += 1
        was = index[word, 0]
        if now == was:
            continue
        begin, corners = index[word, 2] >> 32, index[word, 2] & 0xFFFFFFFF
        size = n_bits(was)
        rows[:size] = ahead[begin : begin + size]
        # Behind those of the beginning, each word has rows for all its cells.
        if begin < fill[0] and now & ~was != 0:
            begin = fill[1]
            fill[1] += WORD
        at_was = at_now = 0
        for k in range(WORD):
            if now >> k & 1:
                ahead[begin + at_now] = rows[at_was if was >> k & 1 else WORD]
                at_now += 1
            at_was += was >> k & 1
        index[word, 0], index[word, 2] = now, begin << 32 | corners
    return differ[:n]


@njit(cache=True, nogil=True)
def _flip_corners(index, width, differ):
    """Set which cells at changed ones are corner cells; return those that differ."""
    flips, n = np.empty(9 * len(differ), np.int64), 0
    for cell in differ:
        for row in range(-1, 2):
            for col in range(-1, 2):
                at = cell + row * width + col
                if (_kind(index, width, at) != 0) != is_corner(index, at):
                    index[at >> 6, 1] ^= np.int64(1) << (at & 63)
                    flips[n] = at
                    n += 1
    return flips[:n]


@njit(cache=True, nogil=True)
def _follow(tables, zone, span, k, noted, n):
    """Set the distances in a direction of the cells of a zone, and of those behind it, as far as
    they differ.

    `tables`: index, distances, width; `zone`: int64 (words,), a bit for each cell; `span`: the
    first word with one, and the last; `noted`: int64 (room, 2), receives each cell from n on, with
    the direction, 8 more where it was above zero, or is, and 16 more if not both. Return it, and n.
    """
    index, ahead, width = tables
    step, left, right = step_of(k, width), k + 7 & 7, k + 1 & 7
    steps = step_of(left, width), step_of(right, width)
    # First the cells that others look at: those farther on.
    for i in range(span[0], span[1] + 1):
        word = i if step < 0 else span[0] + span[1] - i
        if zone[word] == 0:
            continue
        rest = zone[word] & index[word, 0]
        for j in range(64):
            bit = j if step < 0 else 63 - j
            if rest >> bit & 1 == 0:
                continue
            cell, is_next = word * 64 + bit, True
            while is_next:
                # As in `look_ahead`.
                now = 0
                if _is_open(index, cell + step) and (
                    k & 1 == 0
                    or (_is_open(index, cell + steps[0]) and _is_open(index, cell + steps[1]))
                ):
                    at = number_of(index, cell + step)
                    stops = is_corner(index, cell + step)
                    if k & 1 and not stops:
                        stops = ahead[at, left] > 0 or ahead[at, right] > 0
                    seen = np.int64(ahead[at, k])
                    now = 1 if stops else seen + 1 if seen > 0 else seen - 1
                here = number_of(index, cell)
                was = np.int64(ahead[here, k])
                if now == was:
                    break
                ahead[here, k] = now
                if n == len(noted):
                    noted = np.concatenate((noted, noted))
                sign = (8 if was > 0 or now > 0 else 0) + (16 if (was > 0) != (now > 0) else 0)
                noted[n, 0], noted[n, 1] = cell, k + sign
                n += 1
                cell -= step
                is_next = _is_open(index, cell) and not _is_in(zone, cell)
    return noted, n


@njit(cache=True, nogil=True, _nrt=False)
def _is_in(zone, cell):
    """Return whether a cell is marked."""
    return zone[cell >> 6] >> (cell & 63) & 1 == 1


@guarded
@njit(cache=True, nogil=True)
def follow_cells(index, ahead, width, differ):
    """Repair the distances after some cells have changed, and mark whose joins read one of them.

    `index`, `ahead`: see `number_cells` and `look_ahead`; changed; `width`: columns of the framed
    grid; `differ`: int64 (m,), flat cells that `move_rows` has set. Returns int64 (words,), a bit
    for each corner cell that is to be joined again; the number of corner cells.
    """
    tables = index, ahead, width
    flips = _flip_corners(index, width, differ)
    noted, n, n_sides = np.empty((1 << 12, 2), np.int64), 0, 0
    # A distance depends on the next cell, on a diagonal also on those beside the move: what lies
    # behind a change is computed again, and what lies behind that while the result differs.
    zone, span = np.zeros(len(index), np.int64), np.empty(2, np.int64)
    for i in range(8):
        k = 2 * i + i // 4 & 7  # the sides come first
        span[0], span[1] = len(index), -1
        for cell in differ:
            _put(zone, span, cell)
            for turn in range(7, 10):
                if turn == 8 or k & 1:
                    _put(zone, span, cell - step_of(k + turn & 7, width))
        for cell in flips:
            _put(zone, span, cell - step_of(k, width))
        # A diagonal stops where a side sees a corner cell.
        for at in range(n_sides if k & 1 else 0):
            if noted[at, 1] & 16 and (noted[at, 1] - k & 7) % 6 == 1:
                _put(zone, span, noted[at, 0] - step_of(k, width))
        noted, n = _follow(tables, zone, span, k, noted, n)
        n_sides = n_sides if k & 1 else n
        zone[span[0] : span[1] + 1] = 0
    # A join reads distances at its corner cell, and where its diagonals stop. Back from such a cell
    # the ray is the same before and after: it leads to the corner cell to join again.
    size = 64 * len(index)
    rays, marked = np.zeros(4 * len(index), np.int64), np.zeros(len(index), np.int64)
    for cell in flips:
        if is_corner(index, cell):
            _mark(marked, cell)
        for k in range(4):
            _mark(rays, k * size + cell)
    for i in range(n):
        cell, k = noted[i, 0], noted[i, 1] & 7
        here = number_of(index, cell)
        if is_corner(index, cell):
            _mark(marked, cell)
        # Sides are read where a diagonal stops: where one beside it sees a corner cell.
        for turn in range(0 if k & 1 else -1, 2, 2):
            along = k + turn & 7
            is_read = noted[i, 1] & 8 if turn else ahead[here, k - 1] > 0
            if is_read or ahead[here, along + (turn or 1) & 7] > 0:
                _mark(rays, along // 2 * size + cell)
    for k in range(1, 8, 2):
        _mark_behind(tables, rays[k // 2 * len(index) :], k, marked)
    n_corners = np.int64(0)
    for word in range(len(index)):
        if len(flips):
            index[word, 2] = index[word, 2] >> 32 << 32 | n_corners
        n_corners += n_bits(index[word, 1])
    return marked, n_corners


@njit(cache=True, nogil=True, _nrt=False)
def _put(zone, span, cell):
    """Mark a cell, and keep the first word with a mark, and the last."""
    _mark(zone, cell)
    span[0], span[1] = min(span[0], cell >> 6), max(span[1], cell >> 6)


@njit(cache=True, nogil=True, _nrt=False)
def _mark(marked, cell):
    """Mark a cell."""
    marked[cell >> 6] |= np.int64(1) << (cell & 63)


@njit(cache=True, nogil=True, _nrt=False)
def _mark_behind(tables, rays, k, marked):
    """Mark the corner cells from which rays along a diagonal reach some cells.

    `tables`: index, distances, width; `rays`: int64 (words,), a bit for each cell; `marked`: the
    same of the corner cells, changed.
    """
    index, ahead, width = tables
    back = k + 4 & 7
    step = step_of(back, width)
    for word in range(len(index)):
        rest = rays[word] & index[word, 0]
        while rest != 0:
            cell = word * 64 + n_bits((rest & -rest) - 1)
            rest &= rest - 1
            # Rays to the next cell behind pass this one too, unless they begin there.
            if _is_in(rays, cell + step):
                if is_corner(index, cell + step):
                    _mark(marked, cell + step)
                continue
            seen = np.int64(ahead[number_of(index, cell), back])
            while seen > 0:
                cell += seen * step
                if is_corner(index, cell):
                    _mark(marked, cell)
                    break
                seen = np.int64(ahead[number_of(index, cell), back])


@njit(cache=True, nogil=True)
def _corners_now(index, width, places):
    """Return the places of the corner cells, int64 (n,), and the number of each among those
    before, -1 for none; and of each before among them."""
    last = len(index) - 1
    n = (index[last, 2] & 0xFFFFFFFF) + n_bits(index[last, 1])
    now, before = np.empty(n, np.int64), np.full(n, -1, np.int64)
    after = np.full(len(places), -1, np.int64)
    n, at = 0, 0
    for word in range(len(index)):
        left = index[word, 1]
        while left != 0:
            low = left & -left
            left ^= low
            cell = word * 64 + n_bits(low - 1)
            row, col = cell // width, cell % width
            now[n] = (row << COLUMN_BITS | col) << KIND_BITS | _kind(index, width, cell)
            while at < len(places) and places[at] >> KIND_BITS < now[n] >> KIND_BITS:
                at += 1
            if at < len(places) and places[at] >> KIND_BITS == now[n] >> KIND_BITS:
                before[n], after[at] = at, n
            n += 1
    return now, before, after


@njit(cache=True, nogil=True, _nrt=False)
def _holds(values, low, high, value):
    """Return whether a part of an array holds a value."""
    for at in range(low, high):  # noqa: SIM110 - a kernel
        if values[at] == value:
            return True
    return False


@njit(cache=True, nogil=True, _nrt=False)
def _finds(tables, cell, goal):
    """Return whether `join` finds a corner cell from another one."""
    index, ahead, _, width = tables
    rows, cols = goal // width - cell // width, goal % width - cell % width
    diagonal = min(abs(rows), abs(cols))
    straight = max(abs(rows), abs(cols)) - diagonal
    side = (2 if rows > 0 else 6) if abs(rows) > abs(cols) else (0 if cols > 0 else 4)
    k = (1 if cols > 0 else 3) if rows > 0 else (7 if cols > 0 else 5)
    if diagonal == 0:
        return ahead[number_of(index, cell), side] == straight
    limit, at = limit_of(np.int64(ahead[number_of(index, cell), side])), number_of(index, cell)
    while True:
        seen = np.int64(ahead[at, k])
        diagonal -= seen
        cell += seen * step_of(k, width)
        if seen <= 0 or diagonal < 0 or is_corner(index, cell):
            return seen > 0 and diagonal == 0 and straight == 0
        at = number_of(index, cell)
        beside = np.int64(ahead[at, side])
        if diagonal == 0:
            return straight > 0 and beside == straight and beside < limit
        limit = min(limit, limit_of(beside))


@njit(cache=True, nogil=True, _nrt=False)
def _cell_of(place, width):
    """Return the flat cell of a corner cell by its place."""
    row, col, _ = row_col_kind(place)
    return row * width + col


@guarded
@njit(cache=True, nogil=True)
def link_again(tables, places, first, arcs, marked):
    """Join marked corner cells again, and keep the arcs between all others.

    `tables`: see `join`, of the cells now; `places`, `first`, `arcs`: those of the graph before,
    see `JumpGraph`; `marked`: result of `follow_cells`. Returns the same three now, as `arcs_of`
    makes them: an arc that only one end finds passes another corner cell.
    """
    index, _, _, width = tables
    now, before, after = _corners_now(index, width, places)
    n = len(now)
    # What is joined again, in lists; what has lost arcs to these; what has got some.
    state, begin, end = np.zeros(n, np.int8), np.zeros(n, np.int64), np.zeros(n, np.int64)
    heads, kept = np.empty(1 << 12, np.int32), np.empty(1 << 12, np.bool_)
    found, n_heads = np.empty(n, np.int32), 0
    for node in range(n):
        cell = _cell_of(now[node], width)
        if before[node] >= 0 and not _is_in(marked, cell):
            continue
        n_found = join(tables, cell, found, False)
        while n_heads + n_found > heads.size:
            heads, kept = np.concatenate((heads, heads)), np.concatenate((kept, kept))
        state[node], begin[node], end[node] = _JOINED, n_heads, n_heads + n_found
        heads[n_heads : n_heads + n_found] = found[:n_found]
        n_heads += n_found
    # An arc is kept where both ends find each other. What is not joined again finds what it found;
    # some of that was one-sided, so an arc that is new needs a look from there.
    for node in range(n):
        for at in range(begin[node], end[node]):
            other = heads[at]
            if state[other] == _JOINED:
                kept[at] = _holds(heads, begin[other], end[other], node)
                continue
            kept[at] = _had(first, arcs, after, before[node], other)
            if not kept[at] and before[node] >= 0:
                cells = _cell_of(now[other], width), _cell_of(now[node], width)
                kept[at] = _finds(tables, cells[0], cells[1])
                state[other] = _GAINED if kept[at] else state[other]
    # What had an arc to one that is gone, or joined again, may have lost it.
    for old in range(len(after)):
        if after[old] < 0 or state[after[old]] == _JOINED:
            for arc in range(first[old], first[old + 1]):
                other = after[arcs[arc, 1] >> HEAD_SHIFT]
                if other >= 0 and state[other] == 0:
                    state[other] = _LOST
    # All arcs that there may be, those of each corner cell in the order of `join`.
    made, m = np.empty((len(arcs) + 2 * n_heads, 2), np.int64), 0
    count = np.zeros(n + 1, np.int32)
    for node in range(n):
        old = before[node]
        if state[node] == 0 or state[node] == _LOST:
            # The order of the others stays as it is.
            for arc in range(first[old], first[old + 1]):
                packed = arcs[arc, 1]
                other = after[packed >> HEAD_SHIFT]
                is_joined = other >= 0 and state[other] == _JOINED
                if other < 0 or (is_joined and not _holds(heads, begin[other], end[other], node)):
                    continue
                made[m, 0], made[m, 1] = arcs[arc, 0], other << HEAD_SHIFT | packed & 0xFFF
                m += 1
        else:
            # A new arc has its place among the others.
            n_found = end[node] - begin[node]
            found[:n_found] = heads[begin[node] : end[node]]
            if state[node] == _GAINED:
                n_found = join(tables, _cell_of(now[node], width), found, False)
            row, col, _ = row_col_kind(now[node])
            for i in range(n_found):
                other = found[i]
                if state[node] == _JOINED:
                    is_kept = kept[begin[node] + i]
                elif state[other] == _JOINED:
                    is_kept = _holds(heads, begin[other], end[other], node)
                else:
                    is_kept = _had(first, arcs, after, old, other)
                # As in `arcs_of`.
                if is_kept:
                    to_row, to_col, _ = row_col_kind(now[other])
                    leg = class_of(to_row - row, to_col - col)
                    made[m, 0] = octile_cost(to_row - row, to_col - col)
                    made[m, 1] = pack(np.int64(other), leg, reverse(leg))
                    m += 1
        count[node + 1] = m
    return now, count, made[:m]


@njit(cache=True, nogil=True, _nrt=False)
def _had(first, arcs, after, old, other):
    """Return whether there was an arc between corner cells, by the number of the one before, and
    that of the other now."""
    for arc in range(first[old], first[old + 1] if old >= 0 else 0):
        if after[arcs[arc, 1] >> HEAD_SHIFT] == other:
            return True
    return False
