"""Kernels on darts: the base map of a grid, contraction along phi, removal along sigma.

Conventions: edge e has the darts 2e and 2e + 1, so alpha(d) = d ^ 1. A *base edge* has the id
2 * cell for the step east of a flat cell and 2 * cell + 1 for the step north. The even dart of an
edge starts at its lower cell. Compact arrays hold the edges of one level in the order of base ids.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit

ALIVE = 0
CONTRACTED = 1
REMOVED = 2

EAST, NORTH, WEST, SOUTH = 0, 1, 2, 3


class Darts(NamedTuple):
    """The darts of one level, indexed by dart but for `base_edge`, which is indexed by edge."""

    sigma: np.ndarray
    """int32, next dart counter-clockwise round the vertex."""
    origin: np.ndarray
    """int32, vertex at which the dart starts."""
    sweep: np.ndarray
    """int32, integral of x dy along contracted edges from the surviving cell of the vertex to the
    cell where the dart's base edge starts, modulo 2^32. The area inside a self-loop follows from
    it."""
    protected: np.ndarray
    """bool, whether the face on the right of the dart is protected."""
    base_edge: np.ndarray
    """int32, id of the edge in the base."""


@njit(cache=True, nogil=True)
def step_integral(dart, base_edge, cols):
    """Return the integral of x dy along the base step of a dart: zero for steps east and west."""
    base = base_edge[dart >> 1]
    if base & 1 == 0:
        return 0
    col = (base >> 1) % cols
    return col if dart & 1 == 0 else -col


@njit(cache=True, nogil=True)
def loop_area(dart, sweep, base_edge, cols):
    """Return the signed area in cells inside a self-loop, positive for a counter-clockwise dart."""
    step = step_integral(dart, base_edge, cols)
    return np.int32(sweep[dart] + step - sweep[dart ^ 1])


@guarded
@njit(cache=True, nogil=True)
def contract(darts, parent, new_vertex, kernel_dart, state, inverse, shift, touched, cols):
    """Contract the stars of a kernel, in place.

    Return how many entries of `touched` are filled, and whether there is a self-loop.

    The darts of a contracted edge are skipped along phi: after dart x of the kernel comes the dart
    after alpha(x). Every dart of the kernel is stepped over once, so the pass is linear.

    Parameters
    ----------
    darts
        `Darts` of the level; changed.
    parent
        int32 (n_vertices,), the vertex that each vertex goes into; itself if it survives.
    new_vertex
        int32 (n_vertices,), the number of a survivor on the next level.
    kernel_dart
        int32 (n_vertices,), the dart that starts at the parent of v and ends at v.
    state
        uint8 (n_edges,), receives `ALIVE` or `CONTRACTED`.
    inverse
        int32 (n_darts,), receives the inverse of sigma.
    shift
        int32 (n_vertices,), scratch.
    touched
        int32, receives one dart of every ordinary face that lost a dart: apart from faces with a
        self-loop, no other face can have become redundant.
    cols
        Columns of the grid.
    """
    sigma, origin, sweep = darts.sigma, darts.origin, darts.sweep
    protected, base_edge = darts.protected, darts.base_edge
    one = np.uint32(1)
    for e in range(base_edge.size):
        state[e] = ALIVE
    for v in range(parent.size):
        shift[v] = 0
        if parent[v] != v:
            dart = kernel_dart[v]
            state[dart >> 1] = CONTRACTED
            shift[v] = loop_area(dart, sweep, base_edge, cols)
    count = 0
    any_loop = False
    for e in range(base_edge.size):
        if state[e] != ALIVE:
            continue
        for d in (2 * e, 2 * e + 1):
            following = np.uint32(sigma[d])
            if state[following >> one] == CONTRACTED:
                while state[following >> one] == CONTRACTED:
                    following = np.uint32(sigma[following ^ one])
                sigma[d] = following
                if not protected[d ^ 1]:
                    touched[count] = d ^ 1
                    count += 1
            inverse[following] = d
            v = np.uint32(origin[d])
            origin[d] = new_vertex[np.uint32(parent[v])]
            sweep[d] += shift[v]
        if origin[2 * e] == origin[2 * e + 1]:
            any_loop = True
    return count, any_loop


@njit(cache=True, nogil=True)
def unlink(dart, sigma, inverse):
    """Take one dart out of its vertex's rotation."""
    before = inverse[dart]
    after = sigma[dart]
    sigma[before] = after
    inverse[after] = before


@njit(cache=True, nogil=True)
def redundant_beside_loops(start, sigma, origin, sweep, base_edge, cols):
    """Return a dart of a redundant edge on the ordinary face of `start`, and a dart beside it.

    The second dart belongs to the edge that runs beside the redundant one; -1 if there is none.

    Rules three and four: exactly two distinct edges between the same two vertices and else
    self-loops; nothing but self-loops of one vertex (the one that encloses the others goes).
    """
    crossings = 0
    last = first = enclosing = np.int32(-1)
    dart = start
    while True:
        if origin[dart] != origin[dart ^ 1]:
            crossings += 1
            if crossings > 2:
                return np.int32(-1), np.int32(-1)
            first = last
            last = dart
        elif loop_area(dart, sweep, base_edge, cols) < 0:
            enclosing = dart  # the face, on the right of the dart, is inside a clockwise loop
        dart = sigma[dart ^ 1]
        if dart == start:
            break
    if crossings == 0:
        dart = enclosing if enclosing >= 0 else start
        return dart, dart
    if crossings == 2 and first != last ^ 1:
        return max(first, last), min(first, last)
    return np.int32(-1), np.int32(-1)


@njit(cache=True, nogil=True)
def start_cell(dart, base_edge, cols):
    """Return the row and column of the cell where the base edge of a dart starts."""
    base = base_edge[dart >> 1]
    cell = base >> 1
    if dart & 1:
        cell += cols if base & 1 else 1
    return cell // cols, cell % cols


@njit(cache=True, nogil=True)
def start_together(dart, partner, darts, whole_at, level, cols):
    """Return whether two edges between the same vertices start in the same fields.

    They do not if one of them ends at a block in pieces: its cells merge along a quadtree, columns
    of side 2^j at level 2j - 1 and rows at level 2j.
    """
    for d in (np.int64(dart), np.int64(dart) ^ 1):
        v = darts.origin[d]
        if whole_at[v] <= level:
            continue
        beside = partner if darts.origin[partner] == v else partner ^ 1
        row, col = start_cell(d, darts.base_edge, cols)
        other_row, other_col = start_cell(beside, darts.base_edge, cols)
        by_row, by_col = level >> 1, (level + 1) >> 1
        if row >> by_row != other_row >> by_row or col >> by_col != other_col >> by_col:
            return False
    return True


@njit(cache=True, nogil=True)
def simplify(darts, touched, any_loop, state, inverse, cols, whole_at, level, all_whole):
    """Remove redundant edges through ordinary faces until none is left, in place.

    Rules one and two: a face of degree one, a face of degree two. Rules three and four need a
    self-loop, and the lower levels have none. A removal can make only the merged face redundant, so
    every face is followed until it is not.

    Parameters
    ----------
    darts, state, inverse, cols
        See `contract`; removed edges become `REMOVED`.
    touched, any_loop
        Results of `contract`.
    whole_at
        uint8 (n_vertices,), the level from which a block is whole. An edge that ends at a vertex
        in pieces waits for the pieces to merge, so all of those are looked at again.
    level
        The level to make.
    all_whole
        Whether no vertex is in pieces at this level.
    """
    sigma, origin, sweep = darts.sigma, darts.origin, darts.sweep
    protected, base_edge = darts.protected, darts.base_edge
    n_darts = 2 * base_edge.size if any_loop or not all_whole else 0
    for i in range(touched.size + n_darts):
        start = touched[i] if i < touched.size else np.int32(i - touched.size)
        if state[start >> 1] != ALIVE:
            continue
        if i >= touched.size:
            v = origin[start]
            if v != origin[start ^ 1] and (all_whole or whole_at[v] < level):
                continue
        while start >= 0 and not protected[start]:
            second = sigma[start ^ 1]
            dart = partner = np.int32(-1)
            if second == start:
                dart = partner = start
            elif sigma[second ^ 1] == start and origin[start] != origin[start ^ 1]:
                if second != start ^ 1:
                    dart, partner = max(start, second), min(start, second)
            elif any_loop:
                dart, partner = redundant_beside_loops(start, sigma, origin, sweep, base_edge, cols)
            if dart < 0:
                break
            if not all_whole and not start_together(dart, partner, darts, whole_at, level, cols):
                break
            other = dart ^ 1
            # A dart that stays in the merged face: from this side, else from the other.
            start = sigma[other]
            if start == dart:
                start = sigma[dart]
                if start == other:
                    start = np.int32(-1)
            if protected[other]:
                follow = sigma[other]
                while follow != dart:
                    protected[follow] = True
                    follow = sigma[follow ^ 1]
            unlink(dart, sigma, inverse)
            unlink(other, sigma, inverse)
            state[dart >> 1] = REMOVED


@njit(cache=True, nogil=True)
def compact_darts(darts, state, new_edge, level, edge_end):
    """Close the gaps that gone edges left, in place, and return the number of edges that stay.

    The level of each gone edge is written to `edge_end`, by base edge: 2 * level for a contracted
    edge, 2 * level + 1 for a removed one.
    """
    sigma, origin, sweep = darts.sigma, darts.origin, darts.sweep
    protected, base_edge = darts.protected, darts.base_edge
    one = np.uint32(1)
    n_edges = 0
    for e in range(base_edge.size):
        if state[e] == ALIVE:
            new_edge[e] = 2 * n_edges
            n_edges += 1
        else:
            edge_end[base_edge[e]] = 2 * level + state[e] - CONTRACTED
    for e in range(base_edge.size):
        if state[e] != ALIVE:
            continue
        f = new_edge[e]
        base_edge[f >> 1] = base_edge[e]
        for half in range(2):
            d = 2 * e + half
            following = np.uint32(sigma[d])
            sigma[f + half] = new_edge[following >> one] + np.int32(following & one)
            origin[f + half] = origin[d]
            sweep[f + half] = sweep[d]
            protected[f + half] = protected[d]
    return n_edges


# Kernels on the base of a level: walks round its vertices and faces by the ends of edges.
#
# A level is rebuilt from these ends (`edge_end`: 0: no edge, 255: alive at the apex, else twice
# the level at which the edge goes, plus one where it is removed and not contracted).


@njit(cache=True, nogil=True)
def next_at_cell(cell, direction, edge_end, cols):
    """Return the first dart of a base cell counter-clockwise after a direction, else -1.

    Directions are 0 east to 3 south. Darts of the base are 2 * base edge + half; the full turn ends
    with the direction itself.
    """
    for i in range(1, 5):
        turned = (direction + i) & 3
        if turned == 0:
            dart = 4 * cell
        elif turned == 1:
            dart = 4 * cell + 2
        elif turned == 2:
            dart = 4 * (cell - 1) + 1
        else:
            dart = 4 * (cell - cols) + 3
        if dart >= 0 and edge_end[dart >> 1] != 0:
            return dart
    return -1


@njit(cache=True, nogil=True)
def base_sigma(dart, edge_end, cols):
    """Return the next dart counter-clockwise in the base."""
    edge = dart >> 1
    cell = edge >> 1
    direction = edge & 1  # 0 east, 1 north of the lower cell
    if dart & 1:
        cell += cols if direction else 1
        direction += 2
    return next_at_cell(cell, direction, edge_end, cols)
