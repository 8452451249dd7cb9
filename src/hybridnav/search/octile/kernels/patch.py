"""Kernels of a patched jump-point graph: cells that changed, read beside the tables of before.

Cells of *dirty* tiles, squares of `SIDE` cells of the framed grid, have codes of their own, and
distances that end with the tile; the tables hold for all others. A ray hops from tile to tile.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.search.octile.kernels.legs import COLUMN_BITS, KIND_BITS, limit_of, step_of
from hybridnav.search.octile.kernels.tables import corner_at, is_corner, number_of

LEAVES = 64
"""Added to the moves along a side after which a ray is at the last cell of its tile."""
SHIFT = 5
SIDE = 1 << SHIFT
"""Rows and columns of a tile."""
BLOCKED, FREE = -1, -2
"""Codes of cells that are not corner cells; these have their number as their code."""


@guarded
@njit(cache=True, nogil=True)
def codes_of_tiles(tiles, free, origin, shape, n_before):
    """Compute the codes of the cells of tiles, and number the corner cells in them.

    Parameters
    ----------
    tiles
        int64 (t, 2), row and column of each tile.
    free
        bool (rows, cols), the free cells of the map now.
    origin, shape
        Row and column of the first cell of the framed grid, and its rows and columns.
    n_before
        Number of the first corner cell.

    Returns
    -------
    tuple
        int32 (t, SIDE * SIDE) codes; int64 (n,) places of the corner cells, see `row_col_kind`.
    """
    codes = np.full((len(tiles), SIDE * SIDE), BLOCKED, np.int32)
    places = np.empty(len(tiles) * SIDE * SIDE, np.int64)
    n = 0
    for tile in range(len(tiles)):
        for at in range(SIDE * SIDE):
            row, col = tiles[tile, 0] * SIDE + (at >> SHIFT), tiles[tile, 1] * SIDE + at % SIDE
            if not (0 < row < shape[0] - 1 and 0 < col < shape[1] - 1):
                continue
            r, c = row + origin[0], col + origin[1]
            if not free[r, c]:
                continue
            kind = 0
            for k in range(4):
                up, right = r + (1 if k < 2 else -1), c + (1 if k in (0, 3) else -1)
                if _is_free(free, up, c) and _is_free(free, r, right):
                    kind |= (0 if _is_free(free, up, right) else 1) << k
            codes[tile, at] = FREE
            if kind:
                codes[tile, at] = n_before + n
                places[n] = (row << COLUMN_BITS | col) << KIND_BITS | kind
                n += 1
    return codes, places[:n].copy()


@guarded
@njit(cache=True, nogil=True)
def hops_of_tiles(codes):
    """Compute how far a ray along each side leads in its tile, int8 (t, SIDE * SIDE, 4).

    The distance to a corner cell; 0 or less, minus the free cells before a blocked one; or
    `LEAVES` and the moves to the last cell of the tile.
    """
    hops = np.zeros((len(codes), SIDE * SIDE, 4), np.int8)
    for tile in range(len(codes)):
        for at in range(SIDE * SIDE):
            for k in range(4):
                # West and south of a cell come before it, east and north from the end.
                here = at if k >= 2 else SIDE * SIDE - 1 - at
                row, col = here >> SHIFT, here & SIDE - 1
                along = row if k & 1 else col
                if along == (0 if k >= 2 else SIDE - 1):
                    hops[tile, here, k] = LEAVES
                    continue
                step = SIDE if k & 1 else 1
                there = here - step if k >= 2 else here + step
                code, beyond = codes[tile, there], hops[tile, there, k]
                if code >= 0:
                    hops[tile, here, k] = 1
                elif code == BLOCKED:
                    hops[tile, here, k] = 0
                else:
                    hops[tile, here, k] = beyond + 1 if beyond > 0 else beyond - 1
    return hops


@njit(cache=True, nogil=True)
def _is_free(free, row, col):
    """Return whether a cell is on the map and free."""
    return 0 <= row < free.shape[0] and 0 <= col < free.shape[1] and free[row, col]


@njit(cache=True, nogil=True)
def code_of(tables, patch, cell):
    """Return the code of a cell.

    Parameters
    ----------
    tables
        See `join`; corner cells are numbered in the order of rows.
    patch
        int32, the number of each tile among the dirty ones, -1 for none; int32, their codes; int8,
        see `hops_of_tiles`.
    cell
        Flat cell.
    """
    index, _, _, width = tables
    tile_of, codes, _ = patch
    row, col = cell // width, cell % width
    tile = tile_of[row >> SHIFT, col >> SHIFT]
    if tile >= 0:
        return np.int64(codes[tile, (row & SIDE - 1) << SHIFT | (col & SIDE - 1)])
    if index[cell >> 6, 0] >> (cell & 63) & 1 == 0:
        return np.int64(BLOCKED)
    return np.int64(corner_at(index, cell)) if is_corner(index, cell) else np.int64(FREE)


@njit(cache=True, nogil=True)
def _clean_for(tables, patch, cell, k, most):
    """Return the moves along a side, at most `most`, that lead from a clean tile to no dirty
    one."""
    width = tables[3]
    tile_of = patch[0]
    row, col = cell // width, cell % width
    down = 0 if k in (0, 4) else 1 if k == 2 else -1
    across = 0 if k in (2, 6) else 1 if k == 0 else -1
    i, j = row >> SHIFT, col >> SHIFT
    at = (row if down else col) & SIDE - 1
    moves = SIDE - 1 - at if down + across > 0 else at
    while moves < most:
        i, j = i + down, j + across
        if tile_of[i, j] >= 0:
            return moves
        moves += SIDE
    return most


@njit(cache=True, nogil=True)
def look(tables, patch, cell, k):
    """Return the distance along a side to the next corner cell, or 0 or less, minus the free cells
    before a blocked one."""
    index, ahead, _, width = tables
    step = step_of(k, width)
    total = np.int64(0)
    while True:
        row, col = cell // width, cell % width
        tile = patch[0][row >> SHIFT, col >> SHIFT]
        if tile < 0:
            seen = np.int64(ahead[number_of(index, cell), k])
            most = seen if seen > 0 else 1 - seen
            moves = _clean_for(tables, patch, cell, k, most)
            if moves == most:
                return total + seen if seen > 0 else seen - total
        else:
            moves = np.int64(patch[2][tile, (row & SIDE - 1) << SHIFT | (col & SIDE - 1), k >> 1])
            if moves < LEAVES:
                return total + moves if moves > 0 else moves - total
            moves -= LEAVES
        total += moves + 1
        cell += (moves + 1) * step
        code = code_of(tables, patch, cell)
        if code >= 0:
            return total
        if code == BLOCKED:
            return 1 - total


@njit(cache=True, nogil=True)
def is_legal(tables, patch, cell, k):
    """Return whether a move along a diagonal is legal."""
    width = tables[3]
    return (
        code_of(tables, patch, cell + step_of(k, width)) != BLOCKED
        and code_of(tables, patch, cell + step_of(k - 1, width)) != BLOCKED
        and code_of(tables, patch, cell + step_of(k + 1 & 7, width)) != BLOCKED
    )


@njit(cache=True, nogil=True)
def join_patched(tables, patch, cell, found):
    """Find the corner cells that are reached from a cell along a diagonal and then a side.

    As `join` does on tables alone, with the same parameters beside `patch` (see `code_of`).
    """
    width = tables[3]
    n_found = 0
    beside = np.empty(8, np.int64)
    for k in range(0, 8, 2):
        beside[k] = look(tables, patch, cell, k)
        if beside[k] > 0:
            found[n_found] = code_of(tables, patch, cell + beside[k] * step_of(k, width))
            n_found += 1
    for k in range(1, 8, 2):
        at = cell
        left, right = limit_of(beside[k - 1]), limit_of(beside[k + 1 & 7])
        while is_legal(tables, patch, at, k):
            at += step_of(k, width)
            code = code_of(tables, patch, at)
            if code >= 0:
                found[n_found] = code
                n_found += 1
                break
            for i in range(2):
                along = k - 1 + 2 * i & 7
                seen = look(tables, patch, at, along)
                if 0 < seen < (right if i else left):
                    straight = at + seen * step_of(along, width)
                    found[n_found] = code_of(tables, patch, straight)
                    n_found += 1
                if i:
                    right = min(right, limit_of(seen))
                else:
                    left = min(left, limit_of(seen))
    return n_found


@njit(cache=True, nogil=True)
def is_direct_patched(tables, patch, cell, goal):
    """Return whether the leg from a cell to another one, diagonal first, is free."""
    width = tables[3]
    rows, cols = goal // width - cell // width, goal % width - cell % width
    diagonal = min(abs(rows), abs(cols))
    at = cell
    if diagonal > 0:
        k = (1 if cols > 0 else 3) if rows > 0 else (7 if cols > 0 else 5)
        for _ in range(diagonal):
            if not is_legal(tables, patch, at, k):
                return False
            at += step_of(k, width)
    step = 0
    if abs(rows) > abs(cols):
        step = width if rows > 0 else -width
    elif abs(cols) > abs(rows):
        step = 1 if cols > 0 else -1
    while at != goal:
        at += step
        if code_of(tables, patch, at) == BLOCKED:
            return False
    return True


@guarded
@njit(cache=True, nogil=True)
def stale_corners(tables, tile_of, tiles, shape, is_stale):
    """Mark the corner cells whose joins (see `join`) read a cell of dirty tiles.

    The joins are followed backwards on the tables alone: from the cells at the rim of each tile,
    along a side and then a diagonal.

    Parameters
    ----------
    tables
        See `join`.
    tile_of
        See `code_of`.
    tiles
        int64 (t, 2), row and column of the tiles.
    shape
        Rows and columns of the framed grid.
    is_stale
        bool (n,), by corner cell; filled in.
    """
    index, ahead, _, width = tables
    for tile in range(len(tiles)):
        for at in range(SIDE * SIDE):
            r, c = at >> SHIFT, at & SIDE - 1
            if 0 < r < SIDE - 1 and 0 < c < SIDE - 1:
                continue
            row, col = tiles[tile, 0] * SIDE + r, tiles[tile, 1] * SIDE + c
            if row >= shape[0] or col >= shape[1]:
                continue
            cell = row * width + col
            if index[cell >> 6, 0] >> (cell & 63) & 1 == 0:
                continue
            for k in range(1, 8, 2):
                _mark_along(tables, cell, k, is_stale)
            for k in range(0, 8, 2):
                step = step_of(k, width)
                x = cell
                while ahead[number_of(index, x), k] != 0:
                    x += step
                    if tile_of[x // width >> SHIFT, x % width >> SHIFT] >= 0:
                        break
                    if is_corner(index, x):
                        is_stale[corner_at(index, x)] = True
                        break
                    # Who looks back to the tile from here came along a diagonal towards it.
                    _mark_along(tables, x, k + 1, is_stale)
                    _mark_along(tables, x, k + 7 & 7, is_stale)


@njit(cache=True, nogil=True)
def _mark_along(tables, cell, k, is_stale):
    """Mark the first corner cell along a diagonal."""
    index, ahead, _, width = tables
    while True:
        seen = np.int64(ahead[number_of(index, cell), k])
        if seen <= 0:
            return
        cell += seen * step_of(k, width)
        if is_corner(index, cell):
            is_stale[corner_at(index, cell)] = True
            return
