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

NO_LEVEL = 255
_BITS = (0, 1, 2, 2, 3, 3, 3, 3)
"""Bits of the numbers of rows and columns in a block, at most 8 a side."""


class Darts(NamedTuple):
    """The darts of one level, indexed by dart but for `base_edge` and `waits`.

    Kernels take numbers without a sign: an index with one costs a look whether it is negative.
    """

    sigma: np.ndarray
    """uint32, next dart counter-clockwise round the vertex."""
    origin: np.ndarray
    """uint32, vertex at which the dart starts."""
    sweep: np.ndarray
    """int32, integral of x dy along contracted edges from the surviving cell of the vertex to the
    cell where the dart's base edge starts, modulo 2^32. The area inside a self-loop follows from
    it."""
    protected: np.ndarray
    """bool, whether the face on the right of the dart is protected."""
    base_edge: np.ndarray
    """int32, id of the edge in the base."""
    waits: np.ndarray
    """uint8 by edge, the level at which a redundant edge on a face of it can go, `NO_LEVEL` for
    none that waits; see `first_together`."""


@njit(cache=True, nogil=True, _nrt=False)
def step_integral(dart, base_edge, cols):
    """Return the integral of x dy along the base step of a dart: zero for steps east and west."""
    base = base_edge[dart >> 1]
    if base & 1 == 0:
        return 0
    col = (base >> 1) % cols
    return col if dart & 1 == 0 else -col


@njit(cache=True, nogil=True, _nrt=False)
def loop_area(dart, sweep, base_edge, cols):
    """Return the signed area in cells inside a self-loop, positive for a counter-clockwise dart."""
    step = step_integral(dart, base_edge, cols)
    return np.int32(sweep[dart] + step - sweep[dart ^ 1])


@guarded
@njit(cache=True, nogil=True, _nrt=False)
def contract(darts, merged_into, kernel_dart, state, inverse, shift, touched, cols):
    """Contract the stars of a kernel, in place.

    Return how many entries of `touched` are filled, and whether there is a self-loop.

    The darts of a contracted edge are skipped along phi: after dart x of the kernel comes the dart
    after alpha(x). Every dart of the kernel is stepped over once, so the pass is linear.

    `darts`: `Darts` of the level, changed; `merged_into`: uint32 (n_vertices,), the vertex of the
    next level that each vertex goes into; `kernel_dart`: int32 (n_vertices,), the dart that starts
    at the parent of v and ends at v, -1 if v survives; `state`: uint8 (n_edges,), receives `ALIVE`
    or `CONTRACTED`; `inverse`: uint32 (n_darts,), receives the inverse of sigma; `shift`: int32
    (n_vertices,), scratch; `touched`: uint32, receives one dart of every ordinary face that lost a
    dart: apart from faces with a self-loop, no other face can have become redundant; `cols`:
    columns of the grid.
    """
    sigma, origin, sweep = darts.sigma, darts.origin, darts.sweep
    protected, base_edge = darts.protected, darts.base_edge
    for e in range(base_edge.size):
        state[e] = ALIVE
    for v in range(kernel_dart.size):
        shift[v] = 0
        dart = kernel_dart[v]
        if dart >= 0:
            state[dart >> 1] = CONTRACTED
            shift[v] = loop_area(dart, sweep, base_edge, cols)
    count = 0
    any_loop = False
    for e in range(base_edge.size):
        if state[e] != ALIVE:
            continue
        for d in (2 * e, 2 * e + 1):
            following = sigma[d]
            if state[following >> 1] == CONTRACTED:
                while state[following >> 1] == CONTRACTED:
                    following = sigma[following ^ 1]
                sigma[d] = following
                if not protected[d ^ 1]:
                    touched[count] = d ^ 1
                    count += 1
            inverse[following] = d
            v = origin[d]
            origin[d] = merged_into[v]
            sweep[d] += shift[v]
        if origin[2 * e] == origin[2 * e + 1]:
            any_loop = True
    return count, any_loop


@njit(cache=True, nogil=True, _nrt=False)
def unlink(dart, sigma, inverse):
    """Take one dart out of its vertex's rotation."""
    before = inverse[dart]
    after = sigma[dart]
    sigma[before] = after
    inverse[after] = before


@njit(cache=True, nogil=True, _nrt=False)
def redundant_beside_loops(start, sigma, origin, sweep, base_edge, cols):
    """Return a dart of a redundant edge on the ordinary face of `start`, and a dart beside it.

    The second dart belongs to the edge that runs beside the redundant one; -1 if there is none.

    Rules three and four: exactly two distinct edges between the same two vertices and else
    self-loops; nothing but self-loops of one vertex (the one that encloses the others goes).
    """
    crossings = 0
    last = first = enclosing = np.int64(-1)
    dart = np.int64(start)
    while True:
        if origin[dart] != origin[dart ^ 1]:
            crossings += 1
            if crossings > 2:
                return np.int64(-1), np.int64(-1)
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
    return np.int64(-1), np.int64(-1)


@njit(cache=True, nogil=True, _nrt=False)
def start_cell(dart, base_edge, cols):
    """Return the row and column of the cell where the base edge of a dart starts."""
    base = base_edge[dart >> 1]
    cell = base >> 1
    if dart & 1:
        cell += cols if base & 1 else 1
    return cell // cols, cell % cols


@njit(cache=True, nogil=True, _nrt=False)
def first_together(dart, partner, darts, whole_at, level, cols):
    """Return the first level at which two edges between the same vertices start in the same fields.

    It is later than `level` only where one of them ends at a block in pieces: its cells merge along
    a quadtree, columns of side 2^j at level 2j - 1 and rows at level 2j.
    """
    first = 0
    for d in (np.int64(dart), np.int64(dart) ^ 1):
        v = darts.origin[d]
        if whole_at[v] > level:
            beside = partner if darts.origin[partner] == v else partner ^ 1
            row, col = start_cell(d, darts.base_edge, cols)
            other_row, other_col = start_cell(beside, darts.base_edge, cols)
            first = max(first, 2 * _BITS[row ^ other_row], 2 * _BITS[col ^ other_col] - 1)
    return first


@njit(cache=True, nogil=True, _nrt=False)
def simplify(darts, touched, any_loop, state, inverse, cols, whole_at, level, all_whole):
    """Remove redundant edges through ordinary faces until none is left, in place.

    Rules one and two: a face of degree one, a face of degree two. Rules three and four need a
    self-loop, and the lower levels have none.

    `darts`, `state`, `inverse`, `cols`: see `contract`, removed edges become `REMOVED`; `touched`,
    `any_loop`: results of `contract`; `whole_at`: uint8 (n_vertices,), the level from which a block
    is whole: an edge at a vertex in pieces waits for the pieces to merge; `level`: the level to
    make; `all_whole`: whether no vertex is in pieces at this level.
    """
    for start in touched:
        reduce_face(start, darts, any_loop, state, inverse, cols, whole_at, level)
    if all_whole and not any_loop:
        return
    origin, waits = darts.origin, darts.waits
    for e in range(waits.size):
        if waits[e] == level or (any_loop and origin[2 * e] == origin[2 * e + 1]):
            waits[e] = NO_LEVEL
            for d in (np.uint32(2 * e), np.uint32(2 * e + 1)):
                reduce_face(d, darts, any_loop, state, inverse, cols, whole_at, level)


@njit(cache=True, nogil=True, _nrt=False)
def reduce_face(start, darts, any_loop, state, inverse, cols, whole_at, level):
    """Remove redundant edges through the face of a dart until none is left or one has to wait.

    A removal can make only the merged face redundant, so it is followed. `start`: the dart;
    `darts`, `any_loop`, `state`, `inverse`, `cols`, `whole_at`, `level`: see `simplify`.
    """
    sigma, origin, sweep = darts.sigma, darts.origin, darts.sweep
    protected, base_edge = darts.protected, darts.base_edge
    if state[start >> 1] != ALIVE:
        return
    while not protected[start]:
        second = sigma[start ^ 1]
        if second == start:
            dart = partner = np.int64(start)
        elif sigma[second ^ 1] == start and origin[start] != origin[start ^ 1]:
            if second == start ^ 1:
                return
            dart, partner = np.int64(max(start, second)), np.int64(min(start, second))
        elif any_loop:
            dart, partner = redundant_beside_loops(start, sigma, origin, sweep, base_edge, cols)
            if dart < 0:
                return
        else:
            return
        first = first_together(dart, partner, darts, whole_at, level, cols)
        if first > level:
            darts.waits[start >> 1] = min(darts.waits[start >> 1], first)
            return
        other = dart ^ 1
        # A dart that stays in the merged face: from this side, else from the other.
        start = sigma[other]
        is_last = start == dart and sigma[dart] == other
        if start == dart:
            start = sigma[dart]
        if protected[other]:
            follow = sigma[other]
            while follow != dart:
                protected[follow] = True
                follow = sigma[follow ^ 1]
        unlink(dart, sigma, inverse)
        unlink(other, sigma, inverse)
        state[dart >> 1] = REMOVED
        if is_last:
            return


@njit(cache=True, nogil=True, _nrt=False)
def compact_darts(darts, state, new_edge, level, edge_end):
    """Close the gaps that gone edges left, in place, and return the number of edges that stay.

    The level of each gone edge is written to `edge_end`, by base edge: 2 * level for a contracted
    edge, 2 * level + 1 for a removed one.
    """
    sigma, origin, sweep = darts.sigma, darts.origin, darts.sweep
    protected, base_edge, waits = darts.protected, darts.base_edge, darts.waits
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
        base_edge[f >> 1], waits[f >> 1] = base_edge[e], waits[e]
        for half in range(2):
            d = 2 * e + half
            following = sigma[d]
            sigma[f + half] = new_edge[following >> 1] + (following & 1)
            origin[f + half] = origin[d]
            sweep[f + half] = sweep[d]
            protected[f + half] = protected[d]
    return n_edges


@njit(cache=True, nogil=True, _nrt=False)
def protect_faces(sigma, protected):
    """Protect all darts of every face that has a protected dart."""
    for d in range(sigma.size):
        if protected[d]:
            follow = sigma[d ^ 1]
            while not protected[follow]:
                protected[follow] = True
                follow = sigma[follow ^ 1]


# Kernels on the base of a level: walks round its vertices and faces by the ends of edges.
#
# A level is rebuilt from these ends (`edge_end`: 0: no edge, 255: alive at the apex, else twice
# the level at which the edge goes, plus one where it is removed and not contracted).


@njit(cache=True, nogil=True, _nrt=False)
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


@njit(cache=True, nogil=True, _nrt=False)
def base_sigma(dart, edge_end, cols):
    """Return the next dart counter-clockwise in the base."""
    edge = dart >> 1
    cell = edge >> 1
    direction = edge & 1  # 0 east, 1 north of the lower cell
    if dart & 1:
        cell += cols if direction else 1
        direction += 2
    return next_at_cell(cell, direction, edge_end, cols)
