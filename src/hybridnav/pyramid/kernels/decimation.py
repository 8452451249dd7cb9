"""Kernels of the decimation: stars of a maximal independent edge set, the leaves that they may
keep, the next vertices.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import njit
from hybridnav.pyramid.kernels.hulls import far_corner, field_within, near_enough

FIRST_MAY_SURVIVE = 1
SECOND_MAY_SURVIVE = 2
EITHER_MAY_SURVIVE = 3

SURVIVOR, RADIUS, DIAMETER = 0, 1, 2
"""Linkages: the distance that stays below the limit."""

UNDECIDED = -1
"""Returned instead of a count when bounding boxes cannot decide an edge and hulls are needed."""

_NO_KEY = np.uint64(0xFFFFFFFFFFFFFFFF)
# A key holds the attribute (13 bits), a seeded hash (21 bits) and the position (30 bits).
ATTRIBUTE_MAX = 8191
_POSITION = np.uint64(0x3FFFFFFF)
_LOW_HALF = np.uint64(0xFFFFFFFF)


class Vertices(NamedTuple):
    """The vertices of one level, in the order of their surviving cells."""

    cells: np.ndarray
    """int32 (n, 2), row and column of the surviving cell."""
    boxes: np.ndarray
    """int32 (n, 4), the field's least row and column and greatest row and column."""
    classes: np.ndarray
    """uint8, uint16 or int32 (n,), the kind of each vertex: only equal ones merge (see
    `start.kinds_of`)."""
    whole_at: np.ndarray
    """uint8 (n,), the level from which the vertex is whole: below it, its block is in pieces."""


class Hulls(NamedTuple):
    """Convex hulls of fields as cells: those of vertex v are points[start[v]:start[v + 1]].

    `start` is (n + 1,), `points` (m, 2), rows and columns.
    """

    start: np.ndarray
    points: np.ndarray


class Order(NamedTuple):
    """What orders edges of equal attribute: a seed, and their numbers on the map of a window."""

    seed: np.uint64
    """Below 2^32."""
    first: np.uint64
    """The number on the map of the window's first edge."""
    row: np.uint64
    """Edges of a row of the window."""
    more: np.uint64
    """How many more a row of the map has."""


@njit(cache=True, nogil=True, _nrt=False)
def make_key(attribute, base_edge, order, position):
    """Return the key of an edge: attribute, then a seeded hash (MurmurHash3's finaliser)."""
    edge = np.uint64(base_edge)
    if order.more > 0:
        edge += edge // order.row * order.more
    h = edge + order.first ^ order.seed  # below 2^32, so no product overflows
    h ^= h >> np.uint64(16)
    h = h * np.uint64(0x85EBCA6B) & _LOW_HALF
    h ^= h >> np.uint64(13)
    h = h * np.uint64(0xC2B2AE35) & _LOW_HALF
    h ^= h >> np.uint64(16)
    high = np.uint64(min(attribute, ATTRIBUTE_MAX)) << np.uint64(51)
    return high | h >> np.uint64(11) << np.uint64(30) | np.uint64(position)


@njit(cache=True, nogil=True, _nrt=False)
def possible_survivors(u, v, cells, boxes, hull_start, hull_points, linkage, limit):
    """Return which of two vertices may survive their merging, or UNDECIDED.

    The caller has found that the common box of the fields is too large to decide.

    `u`, `v`: the vertices; `cells`, `boxes`: see `Vertices`; `hull_start`, `hull_points`: fields of
    `Hulls`, both empty before hulls are built; `linkage`: `SURVIVOR`, `RADIUS` or `DIAMETER`;
    `limit`: the merge distance squared, in squared cells.
    """
    rows = np.int64(cells[u, 0] - cells[v, 0])
    cols = np.int64(cells[u, 1] - cells[v, 1])
    if rows * rows + cols * cols >= limit:
        return 0
    if linkage == SURVIVOR:
        return EITHER_MAY_SURVIVE
    if linkage == DIAMETER:
        if hull_start.size == 0:
            return UNDECIDED
        near = near_enough(u, v, hull_start, hull_points, limit)
        return EITHER_MAY_SURVIVE if near else 0
    survivors = 0
    if far_corner(cells, u, boxes, v) < limit:
        survivors |= FIRST_MAY_SURVIVE
    elif hull_start.size == 0:
        return UNDECIDED
    elif field_within(cells, u, hull_start, hull_points, v, limit):
        survivors |= FIRST_MAY_SURVIVE
    if far_corner(cells, v, boxes, u) < limit:
        survivors |= SECOND_MAY_SURVIVE
    elif hull_start.size == 0:
        return UNDECIDED
    elif field_within(cells, v, hull_start, hull_points, u, limit):
        survivors |= SECOND_MAY_SURVIVE
    return survivors


@njit(cache=True, nogil=True, _nrt=False)
def contractible(
    origin, base_edge, vertices, hulls, level, linkage, limit, order, keys, survivors_of_edge, best
):
    """Fill `keys` with the contractible edges; return their number, or UNDECIDED without hulls.

    The attribute by which edges are matched is the longer side of the box round both fields: small
    merged fields first keeps fields compact (measured 2 to 5 % fewer places on real maps than the
    distance between the surviving cells or the merged radius).

    `origin`, `base_edge`: see `Darts`; `vertices`, `hulls`: `Vertices` and `Hulls` of the level;
    `level`: number of the level; `linkage`, `limit`: see `possible_survivors`; `order`: `Order`, of
    equal attributes; `keys`: uint64 (n_edges,), filled in; `survivors_of_edge`: uint8 (n_edges,),
    receives which end of an edge may survive; `best`: uint64 (n_vertices,), receives the least key
    of each vertex.
    """
    cells, boxes, classes, whole_at = vertices
    hull_start, hull_points = hulls
    for v in range(classes.size):
        best[v] = _NO_KEY
    count = 0
    # Two leaves of a star can lie twice as far apart as a leaf and its centre: fields of half the
    # diameter already need hulls.
    spread = 4 if linkage == DIAMETER and hull_start.size == 0 else 1
    for e in range(base_edge.size):
        u = origin[2 * e]
        v = origin[2 * e + 1]
        if u == v or classes[u] != classes[v] or max(whole_at[u], whole_at[v]) > level:
            continue
        height = np.int64(max(boxes[u, 2], boxes[v, 2]) - min(boxes[u, 0], boxes[v, 0]))
        width = np.int64(max(boxes[u, 3], boxes[v, 3]) - min(boxes[u, 1], boxes[v, 1]))
        survivors = EITHER_MAY_SURVIVE
        if spread * (height * height + width * width) >= limit:
            survivors = possible_survivors(
                u, v, cells, boxes, hull_start, hull_points, linkage, limit
            )
            if survivors == UNDECIDED:
                return UNDECIDED
            if survivors == 0:
                continue
        key = make_key(max(height, width), base_edge[e], order, e)
        keys[count] = key
        survivors_of_edge[e] = survivors
        best[u] = min(best[u], key)
        best[v] = min(best[v], key)
        count += 1
    return count


@njit(cache=True, nogil=True, _nrt=False)
def open_candidates(origin, base_edge, arcs, ranks, order, keys, survivors_of_edge, best):
    """Fill `keys` with the keys of some arcs by their ranks; let either endpoint of each survive.

    `origin`, `base_edge`: see `Darts`; `arcs`, `ranks`: int64 (n,), edges that may be contracted,
    and their attributes, at most `ATTRIBUTE_MAX`: the least first; `order`: `Order`, of equal
    ranks; `keys`: uint64 (n,), filled in; `survivors_of_edge`: uint8 (n_edges,), receives that
    either endpoint of these arcs may survive; `best`: as from `contractible`.
    """
    for v in range(best.size):
        best[v] = _NO_KEY
    for i in range(arcs.size):
        edge = arcs[i]
        key = make_key(ranks[i], base_edge[edge], order, edge)
        keys[i] = key
        survivors_of_edge[edge] = EITHER_MAY_SURVIVE
        for dart in (2 * edge, 2 * edge + 1):
            end = origin[dart]
            best[end] = min(best[end], key)


@njit(cache=True, nogil=True, _nrt=False)
def match(origin, keys, best, matched, rest):
    """Fill `matched` with the greedy maximal matching in the order of keys (Preis 1999).

    `best` is the least key of each vertex; `matched` becomes the matched edge of each vertex, or
    -1. `rest` is scratch, as long as `keys`.
    """
    for v in range(matched.size):
        matched[v] = -1
    active = keys
    count = keys.size
    while count > 0:
        for i in range(count):
            key = active[i]
            dart = (key & _POSITION) << np.uint64(1)
            u = origin[dart]
            v = origin[dart + np.uint64(1)]
            if best[u] == key and best[v] == key:
                matched[u] = matched[v] = np.int32(key & _POSITION)
        kept = 0
        for i in range(count):
            key = active[i]
            dart = (key & _POSITION) << np.uint64(1)
            u = origin[dart]
            v = origin[dart + np.uint64(1)]
            if matched[u] < 0 and matched[v] < 0:
                best[u] = best[v] = _NO_KEY
                rest[kept] = key
                kept += 1
        active = rest
        count = kept
        for i in range(count):
            key = active[i]
            dart = (key & _POSITION) << np.uint64(1)
            u = origin[dart]
            v = origin[dart + np.uint64(1)]
            best[u] = min(best[u], key)
            best[v] = min(best[v], key)


@njit(cache=True, nogil=True, _nrt=False)
def join_leaves(origin, keys, survivors_of_edge, matched, best, parent, kernel_dart):
    """Let every vertex without a partner join the best matched neighbour that may survive it.

    `origin`, `keys`, `survivors_of_edge`: see `contractible`; `matched`: int32 (n_vertices,), from
    `match`; `best`: uint64 (n_vertices,), scratch; `parent`, `kernel_dart`: int32 (n_vertices,),
    changed.
    """
    for v in range(matched.size):
        best[v] = _NO_KEY
    for i in range(keys.size):
        key = keys[i]
        edge = key & _POSITION
        dart = edge << np.uint64(1)
        u = origin[dart]
        v = origin[dart + np.uint64(1)]
        if matched[v] >= 0 and matched[u] >= 0:
            continue
        if matched[v] < 0 and survivors_of_edge[edge] & FIRST_MAY_SURVIVE and key < best[v]:
            best[v] = key
            parent[v] = u
            kernel_dart[v] = dart
        elif matched[u] < 0 and survivors_of_edge[edge] & SECOND_MAY_SURVIVE and key < best[u]:
            best[u] = key
            parent[u] = v
            kernel_dart[u] = dart + np.uint64(1)


@njit(cache=True, nogil=True)
def refuse_leaves(parent, kernel_dart, matched, hulls, limit):
    """Undo the joins that would make a star's field wider than the limit (linkage "diameter").

    Fields that fit in pairs need not fit together: each leaf is checked against the leaves that its
    star already has, matched ones first, then in the order of vertices. The first leaf of a star
    always stays.
    """
    hull_start, hull_points = hulls
    last_leaf = np.full(parent.size, np.int32(-1), np.int32)
    leaf_before = np.full(parent.size, np.int32(-1), np.int32)
    for matched_ones in (True, False):
        for v in range(parent.size):
            p = parent[v]
            if p == v or (matched[v] >= 0) != matched_ones:
                continue
            leaf = last_leaf[p]
            while leaf >= 0 and near_enough(v, leaf, hull_start, hull_points, limit):
                leaf = leaf_before[leaf]
            if leaf >= 0:
                parent[v] = v
                kernel_dart[v] = -1
            else:
                leaf_before[v] = last_leaf[p]
                last_leaf[p] = v


@njit(cache=True, nogil=True, _nrt=False)
def select_stars(
    darts_origin, base_edge, keys, survivors_of_edge, matched, best, vertices, order, stars
):
    """Fill in the stars of a maximal matching (MIES): the parent of each vertex and the dart to it.

    A matched edge whose endpoints both gained leaves is dropped, so that no tree has diameter
    three. In a pair without leaves of which either may survive, the one survives from which the
    corners of the box round both fields lie less far; the hash breaks ties.

    `darts_origin`, `base_edge`, `keys`, `survivors_of_edge`, `vertices`, `order`: see
    `contractible`; `matched`, `best`: see `join_leaves`; `stars`: `parent`, `kernel_dart` and
    `has_leaf` by vertex, filled in; `kernel_dart[v]` starts at the parent of v and ends at v.
    """
    cells, boxes, _, _ = vertices
    parent, kernel_dart, has_leaf = stars
    for v in range(matched.size):
        parent[v] = v
        kernel_dart[v] = -1
        has_leaf[v] = False
    join_leaves(darts_origin, keys, survivors_of_edge, matched, best, parent, kernel_dart)
    for v in range(matched.size):
        if parent[v] != v:
            has_leaf[parent[v]] = True
    for end in range(matched.size):
        if matched[end] < 0:
            continue
        edge = np.uint32(matched[end])
        u, v = darts_origin[2 * edge], darts_origin[2 * edge + 1]
        if u != end:
            continue
        survivors = survivors_of_edge[edge]
        if has_leaf[u] and has_leaf[v]:
            continue
        if has_leaf[u]:
            survivors &= FIRST_MAY_SURVIVE
        elif has_leaf[v]:
            survivors &= SECOND_MAY_SURVIVE
        elif survivors == EITHER_MAY_SURVIVE:
            reach_u = max(far_corner(cells, u, boxes, v), far_corner(cells, u, boxes, u))
            reach_v = max(far_corner(cells, v, boxes, u), far_corner(cells, v, boxes, v))
            coin = make_key(0, base_edge[edge], order, 0) >> np.uint64(30) & np.uint64(1)
            if reach_u < reach_v or (reach_u == reach_v and coin):
                survivors = FIRST_MAY_SURVIVE
            else:
                survivors = SECOND_MAY_SURVIVE
        if survivors == FIRST_MAY_SURVIVE:
            parent[v] = u
            kernel_dart[v] = 2 * edge
        elif survivors == SECOND_MAY_SURVIVE:
            parent[u] = v
            kernel_dart[u] = 2 * edge + 1


@njit(cache=True, nogil=True, _nrt=False)
def compact_vertices(vertices, parent, merged_into, cols, level, vertex_end, vertex_parent):
    """Merge boxes into survivors and close the gaps, in place; return the number of survivors.

    `vertices`: `Vertices` of the level, changed; `parent`, `merged_into`: uint32 (n_vertices,), the
    second receives the vertex of the next level that each one goes into; `cols`: columns of the
    grid; `level`: number of the level; `vertex_end`, `vertex_parent`: by flat cell: receive the
    level at which a surviving cell goes, and the cell it goes into.
    """
    cells, boxes, classes, whole_at = vertices
    count = 0
    for v in range(parent.size):
        p = parent[v]
        if p == v:
            merged_into[v] = count
            count += 1
        else:
            boxes[p, 0] = min(boxes[p, 0], boxes[v, 0])
            boxes[p, 1] = min(boxes[p, 1], boxes[v, 1])
            boxes[p, 2] = max(boxes[p, 2], boxes[v, 2])
            boxes[p, 3] = max(boxes[p, 3], boxes[v, 3])
            cell = cells[v, 0] * cols + cells[v, 1]
            vertex_end[cell] = level
            vertex_parent[cell] = cells[p, 0] * cols + cells[p, 1]
    for v in range(parent.size):
        if parent[v] == v:
            w = merged_into[v]
            cells[w, 0], cells[w, 1] = cells[v, 0], cells[v, 1]
            for i in range(4):
                boxes[w, i] = boxes[v, i]
            classes[w] = classes[v]
            whole_at[w] = whole_at[v]
        else:
            merged_into[v] = merged_into[parent[v]]
    return count


@njit(cache=True, nogil=True)
def refuse_large_leaves(leaves, parent, kernel_dart, areas, most_cells):
    """Keep a leaf only if the star as merged so far has room for it.

    `leaves` are in the order of falling rating; `areas`, int64 (n_vertices,), in cells. The first
    leaf of a star always stays: its arc was a candidate.
    """
    area = areas.copy()
    for v in leaves:
        p = parent[v]
        if area[v] + area[p] > most_cells:
            parent[v] = v
            kernel_dart[v] = -1
        else:
            area[p] += area[v]
