"""Kernels of the base: from the cells of a grid to the darts round its blocks (see `blocks`).

They find also the levels at which its cells join as they do elsewhere, or survive.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.pyramid.kernels.decimation import FIRST_MAY_SURVIVE, SECOND_MAY_SURVIVE

_SURVIVES = 255


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


@njit(cache=True, nogil=True, _nrt=False)
def amid_its_class(halves, row, col):
    """Return whether the 4x4 squares of half the side round a square are all of one class."""
    if row == 0 or col == 0 or 2 * row + 2 >= halves.shape[0] or 2 * col + 2 >= halves.shape[1]:
        return False
    of_class = halves[2 * row, 2 * col]
    for i in range(2 * row - 1, 2 * row + 3):
        for j in range(2 * col - 1, 2 * col + 3):
            if halves[i, j] != of_class:
                return False
    return of_class != 0


@njit(cache=True, nogil=True, _nrt=False)
def raise_powers(power, squares, halves, p):
    """Put the cells of squares of power p that are amid their class into blocks of that power.

    `squares` and `halves` are `uniform_squares` of this power and of the one below.
    """
    width = 1 << (p - 1)
    for row in range(squares.shape[0]):
        for col in range(squares.shape[1]):
            if squares[row, col] != 0 and (p == 1 or amid_its_class(halves, row, col)):
                for i in range(row * width, (row + 1) * width):
                    for j in range(col * width, (col + 1) * width):
                        power[i, j] = p


class BaseTemplates(NamedTuple):
    """`Templates` on one map."""

    vertex_end: np.ndarray
    """The level at which a cell joins its parent, by its place in its block."""
    parent: np.ndarray
    """int64, `steps_to_parents`."""
    inside_east: np.ndarray
    """The end of the edge to the east inside a block."""
    inside_north: np.ndarray
    """To the north."""
    across_east: np.ndarray
    """The end of the edge to the next block in the east."""
    across_north: np.ndarray
    """In the north."""


@guarded
@njit(cache=True, nogil=True, _nrt=False)
def mark_base(classes, power, templates, vertex_end, vertex_parent, edge_end, new_edge):
    """Fill the record for the blocks alone; return the counts of their vertices and edges.

    `classes`: (rows, cols), the kinds of cells, 0 for none; `power`: the powers of blocks, see
    `block_powers`; `templates`: `BaseTemplates`; `vertex_end`, `vertex_parent`: by flat cell, the
    record of vertices, filled in; `edge_end`: by base edge, the record of edges, filled in;
    `new_edge`: int32 by base edge, receives the new numbers of the edges that stay.
    """
    ends, parent = templates.vertex_end, templates.parent
    inside_east, inside_north = templates.inside_east, templates.inside_north
    across_east, across_north = templates.across_east, templates.across_north
    rows, cols = classes.shape
    n_vertices = 0
    n_edges = 0
    for row in range(rows):
        for col in range(cols):
            cell = row * cols + col
            if classes[row, col] == 0:
                vertex_end[cell] = edge_end[2 * cell] = edge_end[2 * cell + 1] = 0
                vertex_parent[cell] = -1
                continue
            p = power[row >> 1, col >> 1]
            end = ends[p, row & 15, col & 15]
            vertex_end[cell] = end
            if end == _SURVIVES:
                vertex_parent[cell] = -1
                n_vertices += 1
            else:
                vertex_parent[cell] = cell + parent[p, row & 15, col & 15]
            end = inside_east[p, row & 7, col & 7]
            if end == 0 and col + 1 < cols and classes[row, col + 1] != 0:
                end = across_east[min(p, power[row >> 1, (col + 1) >> 1]), row & 7]
                if end == _SURVIVES:
                    new_edge[2 * cell] = n_edges
                    n_edges += 1
            edge_end[2 * cell] = end
            end = inside_north[p, row & 7, col & 7]
            if end == 0 and row + 1 < rows and classes[row + 1, col] != 0:
                end = across_north[min(p, power[(row + 1) >> 1, col >> 1]), col & 7]
                if end == _SURVIVES:
                    new_edge[2 * cell + 1] = n_edges
                    n_edges += 1
            edge_end[2 * cell + 1] = end
    return n_vertices, n_edges


@njit(cache=True, nogil=True, _nrt=False)
def filled(classes, row, col):
    """Return whether a cell lies on the map and is a vertex."""
    rows, cols = classes.shape
    return 0 <= row < rows and 0 <= col < cols and classes[row, col] != 0


@guarded
@njit(cache=True, nogil=True)
def block_vertices(classes, power, vertex_end, n_vertices):
    """Return the vertices of blocks and single cells, in the order of surviving cells."""
    cols = classes.shape[1]
    cells = np.empty((n_vertices, 2), np.int32)
    boxes = np.empty((n_vertices, 4), np.int32)
    of_class = np.empty(n_vertices, classes.dtype)
    whole_at = np.empty(n_vertices, np.uint8)
    v = 0
    for cell in range(vertex_end.size):
        if vertex_end[cell] != _SURVIVES:
            continue
        row, col = cell // cols, cell % cols
        p = np.int64(power[row >> 1, col >> 1])
        cells[v, 0], cells[v, 1] = row, col
        boxes[v, 0], boxes[v, 1] = row >> p << p, col >> p << p
        boxes[v, 2], boxes[v, 3] = row | (1 << p) - 1, col | (1 << p) - 1
        of_class[v] = classes[row, col]
        whole_at[v] = 2 * p
        v += 1
    return cells, boxes, of_class, whole_at


@guarded
@njit(cache=True, nogil=True)
def block_darts(classes, power, vertices, new_edge, n_edges):
    """Return the darts of the map of blocks and single cells, counter-clockwise round each.

    A corner on the way that is not inside four vertices makes the face of the next dart protected.
    """
    cells, boxes, _, whole_at = vertices
    cols = classes.shape[1]
    sigma = np.empty(2 * n_edges, np.int32)
    origin = np.empty(2 * n_edges, np.int32)
    sweep = np.empty(2 * n_edges, np.int32)
    protected = np.zeros(2 * n_edges, np.bool_)
    base_edge = np.empty(n_edges, np.int32)
    for v in range(whole_at.size):
        p = np.int64(whole_at[v] >> 1)
        first = -1
        last = -1
        open_corner = False
        # From the south-east corner on, sides and darts follow each other counter-clockwise.
        row, col = boxes[v, 0], boxes[v, 3]
        for direction in range(4):  # along the sides that look east, north, west, south
            out_row, out_col = (0, 1, 0, -1)[direction], (1, 0, -1, 0)[direction]
            step_row, step_col = out_col, -out_row
            # A corner is amid four vertices if the two cells behind and the one across are filled.
            beside = filled(classes, row - step_row, col - step_col) and filled(
                classes, row - step_row + out_row, col - step_col + out_col
            )
            left = 1 << p
            while left > 0:
                across = filled(classes, row + out_row, col + out_col)
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
                    dart = 2 * new_edge[edge] + (direction >> 1)
                    base_edge[dart >> 1] = edge
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
    return (sigma, origin, sweep), (protected, base_edge)


@njit(cache=True, nogil=True, _nrt=False)
def protect_faces(sigma, protected):
    """Protect all darts of every face that has a protected dart."""
    for d in range(sigma.size):
        if protected[d]:
            follow = sigma[d ^ 1]
            while not protected[follow]:
                protected[follow] = True
                follow = sigma[follow ^ 1]


@njit(cache=True, nogil=True)
def count_sides(origin, base_edge, whole_at):
    """Count the edges to the east and to the north, int64 (2, 128), by the lesser power of two
    blocks.

    `origin`, `base_edge`: see `Darts`; `whole_at`: see `Vertices`.
    """
    count = np.zeros((2, 128), np.int64)
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
