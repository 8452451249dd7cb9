"""Kernels of the first step: from the cells of a grid straight to level 1.

The base has a closed form, and its edges are all one cell long: nothing but the seeded hash orders
them. Level 1 comes out as the general kernels would make it, without the darts of the base ever
being stored, which halves time and memory of a build.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hybridnav.combinatorial._kernels import Darts
from hybridnav.pyramid._field_kernels import edge_ends
from hybridnav.pyramid._kernels import Vertices, make_key

_NO_KEY = np.uint64(0xFFFFFFFFFFFFFFFF)
_SURVIVES = 255
_CONTRACTED = 2
_REMOVED = 3


@njit(cache=True)
def edge_key(base_edge, seed):
    """Order of a base edge: seeded hash, then id."""
    return make_key(0, base_edge, seed, 0) << np.uint64(2) | np.uint64(base_edge)


@njit(cache=True)
def mark_base(classes, vertex_end, edge_end):
    """Fill the record of the base; gives the numbers of vertices and edges."""
    rows, cols = classes.shape
    n_vertices = 0
    n_edges = 0
    for row in range(rows):
        for col in range(cols):
            cell = row * cols + col
            here = classes[row, col] != 0
            east = here and col + 1 < cols and classes[row, col + 1] != 0
            north = here and row + 1 < rows and classes[row + 1, col] != 0
            vertex_end[cell] = _SURVIVES if here else 0
            edge_end[2 * cell] = _SURVIVES if east else 0
            edge_end[2 * cell + 1] = _SURVIVES if north else 0
            n_vertices += here
            n_edges += np.int64(east) + np.int64(north)
    return n_vertices, n_edges


@njit(cache=True)
def best_edges(classes, seed, best):
    """Least edge to a cell of the same class, for each cell: -1 where there is none."""
    rows, cols = classes.shape
    above = np.full(cols, _NO_KEY, np.uint64)
    for row in range(rows):
        west = _NO_KEY
        for col in range(cols):
            cell = row * cols + col
            of_class = classes[row, col]
            least = min(west, above[col])
            west = _NO_KEY
            above[col] = _NO_KEY
            if of_class != 0:
                if col + 1 < cols and classes[row, col + 1] == of_class:
                    west = edge_key(2 * cell, seed)
                if row + 1 < rows and classes[row + 1, col] == of_class:
                    above[col] = edge_key(2 * cell + 1, seed)
                least = min(least, west, above[col])
            best[cell] = np.int32(least & np.uint64(0xFFFFFFFF)) if least != _NO_KEY else -1


@njit(cache=True)
def open_edges(classes, matched, seed):
    """Keys of the edges within a class whose ends are both unmatched."""
    rows, cols = classes.shape
    keys = np.empty(1024, np.uint64)
    count = 0
    for row in range(rows):
        for col in range(cols):
            cell = row * cols + col
            of_class = classes[row, col]
            if of_class == 0 or matched[cell] >= 0:
                continue
            if count + 2 > keys.size:
                larger = np.empty(2 * keys.size, np.uint64)
                larger[:count] = keys[:count]
                keys = larger
            if col + 1 < cols and classes[row, col + 1] == of_class and matched[cell + 1] < 0:
                keys[count] = edge_key(2 * cell, seed)
                count += 1
            if row + 1 < rows and classes[row + 1, col] == of_class and matched[cell + cols] < 0:
                keys[count] = edge_key(2 * cell + 1, seed)
                count += 1
    return keys[:count]


@njit(cache=True)
def match_cells(classes, seed, matched):
    """Greedy maximal matching of the cells in the order of keys: the matched edge of each, or -1.

    Rounds of locally best edges, as in `_kernels.match`; the first needs no list of edges.
    """
    cols = classes.shape[1]
    best = np.empty(matched.size, np.int32)
    for cell in range(matched.size):
        matched[cell] = -1
    best_edges(classes, seed, best)
    for cell in range(matched.size):
        edge = best[cell]
        if edge >= 0 and edge >> 1 == cell:
            other = cell + (cols if edge & 1 else 1)
            if best[other] == edge:
                matched[cell] = matched[other] = edge
    keys = open_edges(classes, matched, seed)
    least = np.full(matched.size if keys.size > 0 else 0, _NO_KEY, np.uint64)
    count = keys.size
    while count > 0:
        for i in range(count):
            first, second = edge_ends(np.int64(keys[i] & np.uint64(0xFFFFFFFF)), cols)
            least[first] = min(least[first], keys[i])
            least[second] = min(least[second], keys[i])
        for i in range(count):
            edge = np.int64(keys[i] & np.uint64(0xFFFFFFFF))
            first, second = edge_ends(edge, cols)
            if least[first] == keys[i] and least[second] == keys[i]:
                matched[first] = matched[second] = edge
        kept = 0
        for i in range(count):
            first, second = edge_ends(np.int64(keys[i] & np.uint64(0xFFFFFFFF)), cols)
            if matched[first] < 0 and matched[second] < 0:
                least[first] = least[second] = _NO_KEY
                keys[kept] = keys[i]
                kept += 1
        count = kept


@njit(cache=True)
def star_cells(classes, seed, matched, vertex_end, vertex_parent, edge_end):
    """Contract the stars that a matching of the cells makes, in the record (level 1).

    As `_kernels.select_stars`: cells without a partner join their best neighbour, a matched edge
    whose ends both gained leaves is dropped, and of a pair without leaves the hash decides.
    """
    rows, cols = classes.shape
    has_leaf = np.zeros(matched.size, np.bool_)
    for row in range(rows):
        for col in range(cols):
            cell = row * cols + col
            of_class = classes[row, col]
            if of_class == 0 or matched[cell] >= 0:
                continue
            least = _NO_KEY
            if col + 1 < cols and classes[row, col + 1] == of_class:
                least = min(least, edge_key(2 * cell, seed))
            if row + 1 < rows and classes[row + 1, col] == of_class:
                least = min(least, edge_key(2 * cell + 1, seed))
            if col > 0 and classes[row, col - 1] == of_class:
                least = min(least, edge_key(2 * (cell - 1), seed))
            if row > 0 and classes[row - 1, col] == of_class:
                least = min(least, edge_key(2 * (cell - cols) + 1, seed))
            if least == _NO_KEY:
                continue
            edge = np.int64(least & np.uint64(0xFFFFFFFF))
            first, second = edge_ends(edge, cols)
            centre = first + second - cell
            has_leaf[centre] = True
            vertex_end[cell] = 1
            vertex_parent[cell] = centre
            edge_end[edge] = _CONTRACTED
    for cell in range(matched.size):
        edge = matched[cell]
        if edge < 0 or edge >> 1 != cell:
            continue
        first, second = edge_ends(edge, cols)
        if has_leaf[first] and has_leaf[second]:
            continue
        coin = make_key(0, edge, seed, 0) >> np.uint64(30) & np.uint64(1)
        if has_leaf[first] or (coin and not has_leaf[second]):
            gone, centre = second, first
        else:
            gone, centre = first, second
        vertex_end[gone] = 1
        vertex_parent[gone] = centre
        edge_end[edge] = _CONTRACTED


@njit(cache=True)
def remove_parallel(edge_end, vertex_end, rows, cols, link, full):
    """Remove what the first contraction makes redundant, in the record (level 1).

    Stars of cells make no self-loops, so the only redundant edges are those of full 2x2 blocks
    with two contracted edges: of the two others the one with the smaller id stays, along chains
    of such blocks too. `link` leads from a removed edge to the one that it ran beside; `full`
    becomes the map of full blocks, by their lower-left cell.
    """
    for cell in range(rows * cols):
        full[cell] = False
        if (
            (cell + 1) % cols == 0
            or cell + cols >= rows * cols
            or vertex_end[cell] == 0
            or vertex_end[cell + 1] == 0
            or vertex_end[cell + cols] == 0
            or vertex_end[cell + cols + 1] == 0
        ):
            continue
        full[cell] = True
        contracted = 0
        one = -1
        other = -1
        for edge in (2 * cell, 2 * cell + 1, 2 * (cell + 1) + 1, 2 * (cell + cols)):
            if edge_end[edge] == _CONTRACTED:
                contracted += 1
            else:
                one, other = other, edge
        if contracted < 2:
            continue
        while edge_end[one] == _REMOVED:
            one = link[one]
        while edge_end[other] == _REMOVED:
            other = link[other]
        if one != other:
            edge_end[max(one, other)] = _REMOVED
            link[max(one, other)] = min(one, other)


@njit(cache=True)
def first_darts(edge_end, vertex_end, new_vertex, new_edge, full, cols, n_edges):
    """Darts of level 1: counter-clockwise round the centre of each star, and round each leaf in
    the place of the edge that was contracted.

    Corners passed on the way that are no full blocks make the face of the next dart protected.
    """
    sigma = np.empty(2 * n_edges, np.int32)
    origin = np.empty(2 * n_edges, np.int32)
    sweep = np.empty(2 * n_edges, np.int32)
    protected = np.zeros(2 * n_edges, np.bool_)
    base_edge = np.empty(n_edges, np.int32)
    # By direction: base edge of a step, its side, and the block on the clockwise side of the step,
    # all relative to a cell.
    edge_of = np.array([0, 1, -2, 1 - 2 * cols])
    side_of = np.array([0, 0, 1, 1])
    block_of = np.array([-cols, 0, -1, -cols - 1])
    step_of = np.array([1, cols, -1, -cols])
    for root in range(vertex_end.size):
        if vertex_end[root] != _SURVIVES:
            continue
        v = new_vertex[root]
        first = -1
        last = -1
        open_corner = False
        for direction in range(4):
            block = root + block_of[direction]
            open_corner |= block < 0 or not full[block]
            edge = 2 * root + edge_of[direction]
            end = edge_end[edge] if edge >= 0 else 0
            cell = root
            turns = 1
            if end == _CONTRACTED:
                cell = root + step_of[direction]
                turns = 3
            for turn in range(turns):
                towards = direction
                if turns == 3:
                    towards = (direction + 3 + turn) & 3
                    block = cell + block_of[towards]
                    open_corner |= block < 0 or not full[block]
                    edge = 2 * cell + edge_of[towards]
                    end = edge_end[edge] if edge >= 0 else 0
                if end != _SURVIVES:
                    continue
                dart = 2 * new_edge[edge] + side_of[towards]
                base_edge[dart >> 1] = edge
                origin[dart] = v
                rise = 0
                if cell != root and direction & 1:
                    rise = cell % cols if direction == 1 else -(cell % cols)
                sweep[dart] = rise
                protected[dart] = open_corner
                open_corner = False
                if last >= 0:
                    sigma[last] = dart
                else:
                    first = dart
                last = dart
            if turns == 3:
                # Back at the centre, the corner on the other side of the contracted edge.
                block = cell + block_of[(direction + 2) & 3]
                open_corner |= block < 0 or not full[block]
        if last >= 0:
            sigma[last] = first
            protected[first] |= open_corner
    for d in range(2 * n_edges):
        follow = sigma[d ^ 1]
        while protected[d] and not protected[follow]:
            protected[follow] = True
            follow = sigma[follow ^ 1]
    return Darts(sigma, origin, sweep, protected, base_edge)


@njit(cache=True)
def first_vertices(classes, vertex_end, vertex_parent, new_vertex, n_vertices):
    """Vertices of level 1."""
    cols = classes.shape[1]
    cells = np.empty((n_vertices, 2), np.int32)
    boxes = np.empty((n_vertices, 4), np.int32)
    of_class = np.empty(n_vertices, np.uint8)
    for cell in range(vertex_end.size):
        if vertex_end[cell] == _SURVIVES:
            row, col = cell // cols, cell % cols
            v = new_vertex[cell]
            cells[v, 0] = boxes[v, 0] = boxes[v, 2] = row
            cells[v, 1] = boxes[v, 1] = boxes[v, 3] = col
            of_class[v] = classes[row, col]
    for cell in range(vertex_end.size):
        if vertex_end[cell] == 1:
            row, col = cell // cols, cell % cols
            v = new_vertex[vertex_parent[cell]]
            boxes[v, 0] = min(boxes[v, 0], row)
            boxes[v, 1] = min(boxes[v, 1], col)
            boxes[v, 2] = max(boxes[v, 2], row)
            boxes[v, 3] = max(boxes[v, 3], col)
    return Vertices(cells, boxes, of_class)


@njit(cache=True)
def first_level(classes, seed, vertex_end, vertex_parent, edge_end):
    """Darts and vertices of level 1, and the record of the step to it."""
    rows, cols = classes.shape
    number = np.empty(classes.size, np.int32)  # the matching first, then the new vertices
    match_cells(classes, seed, number)
    star_cells(classes, seed, number, vertex_end, vertex_parent, edge_end)
    new_edge = np.empty(edge_end.size, np.int32)  # links of removed edges first, then new edges
    full = np.empty(classes.size, np.bool_)
    remove_parallel(edge_end, vertex_end, rows, cols, new_edge, full)
    n_vertices = 0
    for cell in range(vertex_end.size):
        if vertex_end[cell] == _SURVIVES:
            number[cell] = n_vertices
            n_vertices += 1
    n_edges = 0
    for edge in range(edge_end.size):
        if edge_end[edge] == _SURVIVES:
            new_edge[edge] = n_edges
            n_edges += 1
    darts = first_darts(edge_end, vertex_end, number, new_edge, full, cols, n_edges)
    return darts, first_vertices(classes, vertex_end, vertex_parent, number, n_vertices)
