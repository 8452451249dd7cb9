"""Kernels of the base: from the cells of a grid to the darts round its blocks (see `blocks`).

They find also the levels at which its cells join as they do elsewhere, or survive.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.pyramid.kernels.darts import protect_faces
from hybridnav.pyramid.kernels.decimation import FIRST_MAY_SURVIVE, SECOND_MAY_SURVIVE

_SURVIVES = 255
_POWERS = 4
"""Powers of blocks, 0 for single cells."""
_HIGH = np.uint64(0x8080808080808080)


@njit(cache=True, nogil=True)
def uniform_squares(classes):
    """Return the class of every aligned square of 2x2 equal entries, 0 for other squares."""
    rows, cols = classes.shape[0] // 2, classes.shape[1] // 2
    squares = np.empty((rows, cols), classes.dtype)
    for row in range(rows):
        for col in range(cols):
            one = classes[2 * row, 2 * col]
            equal = (
                one == classes[2 * row, 2 * col + 1]
                and one == classes[2 * row + 1, 2 * col]
                and one == classes[2 * row + 1, 2 * col + 1]
            )
            squares[row, col] = one if equal else 0
    return squares


@njit(cache=True, nogil=True)
def raise_powers(power, halves, p):
    """Put the cells of squares of power p that are amid their class into blocks of that power.

    The 4x4 squares of half the side round one are all of its class. `halves`: `uniform_squares` of
    the power below.
    """
    rows, cols = halves.shape
    width = 1 << (p - 1)
    alike = np.zeros((rows, cols >> 1), np.bool_)  # four side by side
    for row in range(rows):
        of_row, marks = halves[row], alike[row]
        for col in range(1, cols - 1 >> 1):
            one = of_row[2 * col]
            beside = (of_row[2 * col - 1] == one) & (of_row[2 * col + 1] == one)
            marks[col] = (one != 0) & beside & (of_row[2 * col + 2] == one)
    for row in range(1, rows - 1 >> 1):
        for col in range(1, cols - 1 >> 1):
            one = halves[2 * row, 2 * col]
            is_amid = True
            for i in range(2 * row - 1, 2 * row + 3):
                is_amid &= alike[i, col] & (halves[i, 2 * col] == one)
            if is_amid:
                for i in range(row * width, (row + 1) * width):
                    for j in range(col * width, (col + 1) * width):
                        power[i, j] = p


class Merging(NamedTuple):
    """When rows, or columns, of cells merge along the quadtree, by their number.

    Arrays are uint8 (n,) but for `step`. "Twos" of a number is how often two divides it, at most 4;
    4 for 0.
    """

    twos: np.ndarray
    """Twos of the number."""
    after: np.ndarray
    """Twos of the next one: less than the power of a block that holds both."""
    death: np.ndarray
    """The least power of a block over it whose surviving one is another, 4 for none."""
    step: np.ndarray
    """int32, from there to the surviving one of that block, in flat cells."""


@njit(cache=True, nogil=True)
def mark_base(kinds, power, by_row, by_col, vertex_end, vertex_parent, edge_end):
    """Fill the record for the blocks alone.

    Cells, and edges inside a block, go with halves of the quadtree: two columns, 2^j apart, merge
    at level 2j + 1, two rows at level 2j + 2. The lowest one of parallel edges to the east stays,
    the others go as their rows merge; to the north likewise by columns. There is no branch,
    so that many cells of a row are one instruction.

    `kinds`: (rows, cols), the kinds of cells, 0 for none; `power`: see `start.block_powers`;
    `by_row`, `by_col`: `Merging` of the rows and columns; `vertex_end`, `vertex_parent`,
    `edge_end`: the record, filled in.
    """
    rows, cols = kinds.shape
    # This row and the next one in turn, with a column more.
    filled, powers = np.zeros((2, cols + 1), np.bool_), np.zeros((2, cols + 1), np.uint8)
    spread_row(kinds[0], power[0], filled[0], powers[0])
    for row in range(rows):
        here, above = row & 1, ~row & 1
        if row + 1 < rows:
            spread_row(kinds[row + 1], power[row + 1 >> 1], filled[above], powers[above])
        else:
            filled[above] = False
        begin, end = row * cols, (row + 1) * cols
        ends, edges = vertex_end[begin:end], edge_end[2 * begin : 2 * end]
        mark_vertices(filled[here], powers[here], by_row.death[row], by_col.death, ends)
        set_parents(ends, begin, by_row.step[row], by_col.step, vertex_parent[begin:end])
        of_row = by_row.twos[row], by_row.after[row]
        mark_edges(
            (filled[here], powers[here]), (filled[above], powers[above]), of_row, by_col, edges
        )


@njit(cache=True, nogil=True, _nrt=False)
def spread_row(kinds, power, filled, powers):
    """Fill in which cells of a row are vertices, and the power of the block of each."""
    for col in range(kinds.size):
        filled[col] = kinds[col] != 0
    for i in range(kinds.size >> 1):
        powers[2 * i] = powers[2 * i + 1] = power[i]


@njit(cache=True, nogil=True, _nrt=False)
def mark_vertices(filled, powers, row_death, death, ends):
    """Fill in the ends of the cells of a row."""
    by_row = np.uint8(2 * row_death)
    for col in range(ends.size):
        by_col = np.uint8(2 * death[col] - 1)
        end = by_row if row_death <= powers[col] else np.uint8(_SURVIVES)
        end = by_col if death[col] <= min(powers[col], row_death) else end
        ends[col] = end if filled[col] else np.uint8(0)


@njit(cache=True, nogil=True, _nrt=False)
def set_parents(ends, first, row_step, step, parents):
    """Fill in the parents of the cells of a row, which begins at the flat cell `first`."""
    for col in range(ends.size):
        parent = np.int32(first + col) + (step[col] if ends[col] & 1 else row_step)
        parents[col] = -1 if ends[col] == 0 or ends[col] == _SURVIVES else parent


@njit(cache=True, nogil=True, _nrt=False)
def mark_edges(here, above, of_row, by_col, edges):
    """Fill in the ends of the edges of a row to the east and to the north.

    `here`, `above`: which cells of this row and of the next one are vertices, and the powers of
    their blocks; `of_row`: `twos` and `after` of the row; `by_col`: `Merging` of the columns.
    """
    filled, powers = here
    filled_above, powers_above = above
    row_twos, row_after = of_row
    twos, after = by_col.twos, by_col.after
    all_stay = np.uint8(_SURVIVES)
    for col in range(twos.size):
        power = powers[col]
        inside = after[col] < power
        side = after[col] if inside else min(power, powers[col + 1])
        end = np.uint8(4 * after[col] + 2) if inside else all_stay
        end = np.uint8(4 * row_twos + 5) if row_twos < side else end
        edges[2 * col] = end if filled[col] & filled[col + 1] else np.uint8(0)
        inside = row_after < power
        side = np.uint8(row_after + 1) if inside else min(power, powers_above[col])
        end = np.uint8(4 * row_after + 4) if inside else all_stay
        end = np.uint8(4 * twos[col] + 3) if twos[col] < side else end
        edges[2 * col + 1] = end if filled[col] & filled_above[col] else np.uint8(0)


@guarded
@njit(cache=True, nogil=True)
def surviving(words):
    """Return the places of the bytes that are 255, int32, and how many come before each word.

    `words`: uint64, eight bytes each; those that are not 255 are below 128.
    """
    before = np.empty(words.size, np.int32)
    count = 0
    for i in range(words.size):
        before[i] = count
        count += count_high(words[i])
    places = np.empty(count, np.int32)
    count = 0
    for i in range(words.size):
        left = words[i] & _HIGH
        while left != 0:
            below = left - np.uint64(1)
            places[count] = 8 * i + count_high(below & ~left)  # the bytes below the lowest one
            count += 1
            left &= below
    return places, before


@njit(cache=True, nogil=True, _nrt=False)
def count_high(word):
    """Return the number of bytes of a word that are 128 or more."""
    ones = (word & _HIGH) >> np.uint64(7)  # added up without a product, which numpy warns of
    ones += ones >> np.uint64(32)
    ones += ones >> np.uint64(16)
    return np.int64((ones + (ones >> np.uint64(8))) & np.uint64(15))


@njit(cache=True, nogil=True, _nrt=False)
def number_of(edge, words, before):
    """Return the number of a base edge that survives; see `surviving`."""
    below = (np.uint64(1) << np.uint64(8 * (edge & 7))) - np.uint64(1)
    return before[edge >> 3] + count_high(words[edge >> 3] & below)


@njit(cache=True, nogil=True, _nrt=False)
def filled(kinds, row, col):
    """Return whether a cell lies on the map and is a vertex."""
    rows, cols = kinds.shape
    return 0 <= row < rows and 0 <= col < cols and kinds[row, col] != 0


@guarded
@njit(cache=True, nogil=True)
def block_vertices(kinds, power, survivors):
    """Return the vertices of blocks and single cells, int32 (n,) flat surviving cells."""
    cols = kinds.shape[1]
    cells = np.empty((survivors.size, 2), np.int32)
    boxes = np.empty((survivors.size, 4), np.int32)
    of_kind = np.empty(survivors.size, kinds.dtype)
    whole_at = np.empty(survivors.size, np.uint8)
    row = 0
    for v in range(survivors.size):
        while survivors[v] >= (row + 1) * cols:
            row += 1
        col = survivors[v] - row * cols
        p = np.int64(power[row >> 1, col >> 1])
        cells[v, 0], cells[v, 1] = row, col
        boxes[v, 0], boxes[v, 1] = row >> p << p, col >> p << p
        boxes[v, 2], boxes[v, 3] = row | (1 << p) - 1, col | (1 << p) - 1
        of_kind[v] = kinds[row, col]
        whole_at[v] = 2 * p
    return cells, boxes, of_kind, whole_at


@guarded
@njit(cache=True, nogil=True)
def block_darts(kinds, power, vertices, n_edges, words, before):
    """Return the darts of the map of blocks and single cells, counter-clockwise round each.

    A corner on the way that is not inside four vertices makes the face of the next dart protected.

    `kinds`, `power`: see `mark_base`; `vertices`: from `block_vertices`; `n_edges`: edges between
    them; `words`, `before`: `edge_end` of the record in words, and `surviving` of it.
    """
    cells, boxes, _, whole_at = vertices
    rows, cols = kinds.shape
    flat = kinds.ravel()
    sigma = np.empty(2 * n_edges, np.int32)
    origin = np.empty(2 * n_edges, np.int32)
    sweep = np.zeros(2 * n_edges, np.int32)
    protected = np.zeros(2 * n_edges, np.bool_)
    for v in range(whole_at.size):
        p = np.int64(whole_at[v] >> 1)
        row, col = np.int64(cells[v, 0]), np.int64(cells[v, 1])
        cell = row * cols + col
        if (
            (p == 0 and 0 < row < rows - 1 and 0 < col < cols - 1)
            and (flat[cell + 1] != 0 and flat[cell + cols] != 0)
            and (flat[cell - 1] != 0 and flat[cell - cols] != 0)
        ):
            # As below, for most vertices.
            east = 2 * number_of(2 * cell, words, before)
            west = 2 * number_of(2 * (cell - 1), words, before) + 1
            south = 2 * number_of(2 * (cell - cols) + 1, words, before) + 1
            north = east + 2
            sigma[east], sigma[north], sigma[west], sigma[south] = north, west, south, east
            origin[east] = origin[north] = origin[west] = origin[south] = v
            protected[east] = flat[cell - cols + 1] == 0
            protected[north] = flat[cell + cols + 1] == 0
            protected[west] = flat[cell + cols - 1] == 0
            protected[south] = flat[cell - cols - 1] == 0
            continue
        first = -1
        last = -1
        open_corner = False
        # From the south-east corner on, sides and darts follow each other counter-clockwise.
        row, col = boxes[v, 0], boxes[v, 3]
        for direction in range(4):  # along the sides that look east, north, west, south
            out_row, out_col = (0, 1, 0, -1)[direction], (1, 0, -1, 0)[direction]
            step_row, step_col = out_col, -out_row
            # A corner is amid four vertices if the two cells behind and the one across are filled.
            beside = filled(kinds, row - step_row, col - step_col) and filled(
                kinds, row - step_row + out_row, col - step_col + out_col
            )
            left = 1 << p
            while left > 0:
                across = filled(kinds, row + out_row, col + out_col)
                open_corner |= not (beside and across)
                beside = across
                run = 1
                if across:
                    # Blocks are aligned squares of powers of two: two of them share the side of the
                    # smaller one. The edge at its lowest cell stands for all across that side.
                    run = 1 << min(p, np.int64(power[(row + out_row) >> 1, (col + out_col) >> 1]))
                    low_row = row + min(step_row, 0) * (run - 1)
                    low_col = col + min(step_col, 0) * (run - 1)
                    cell = low_row * cols + low_col
                    edge = 2 * min(cell, cell + out_row * cols + out_col) + (direction & 1)
                    dart = 2 * number_of(edge, words, before) + (direction >> 1)
                    origin[dart] = v
                    # From the surviving cell along its column, then along the row.
                    sweep[dart] = cells[v, 1] * (low_row - cells[v, 0])
                    protected[dart] = open_corner
                    open_corner = False
                    if last >= 0:
                        sigma[last] = dart
                    else:
                        first = dart
                    last = dart
                left -= run
                row, col = row + run * step_row, col + run * step_col
            row, col = row - step_row, col - step_col
        if last >= 0:
            # The circle closes: a corner behind the last dart is one ahead of the first.
            sigma[last] = first
            protected[first] |= open_corner
    protect_faces(sigma, protected)
    return sigma, origin, sweep, protected


@njit(cache=True, nogil=True)
def count_sides(origin, base_edge, whole_at):
    """Count the edges to the east and to the north, int64 (2, 4), by the lesser power of two
    blocks.

    `origin`, `base_edge`: see `Darts`; `whole_at`: see `Vertices`.
    """
    count = np.zeros((2, _POWERS), np.int64)
    for e in range(base_edge.size):
        least = min(whole_at[origin[2 * e]], whole_at[origin[2 * e + 1]])
        count[base_edge[e] & 1, least >> 1] += 1
    return count


_POSITION = np.uint64(0x3FFFFFFF)


@njit(cache=True, nogil=True, _nrt=False)
def let_survive(origin, keys, cells, cols, survivors, survivors_of_edge):
    """Let certain cells survive whatever they merge with.

    `origin`, `keys`, `survivors_of_edge`: see `decimation.contractible`; the last is changed;
    `cells`: int32 (n_vertices, 2), the surviving cells of the level; `cols`: columns of the grid;
    `survivors`: bool by flat cell, the cells that survive; no edge has two of them.
    """
    for i in range(keys.size):
        edge = np.int64(keys[i] & _POSITION)
        u, v = origin[2 * edge], origin[2 * edge + 1]
        if survivors[cells[u, 0] * cols + cells[u, 1]]:
            survivors_of_edge[edge] = FIRST_MAY_SURVIVE
        elif survivors[cells[v, 0] * cols + cells[v, 1]]:
            survivors_of_edge[edge] = SECOND_MAY_SURVIVE
