"""Kernels that lay a lattice over free cells: nodes in blocks of cells, and edges between them.

A block is a square of `side` x `side` cells. Its free cells fall into *parts*, which are connected
inside it, and each part has one node: its cheapest cell. An edge joins two nodes of blocks near
each other. Most are straight segments. Where two parts meet that do not see each other, the edge
runs inside the two, from cell to cell, so that the lattice is connected just as the cells are.

Positions are (row, col) in grid units; the centre of a cell is at half units.
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, grow_rows, pop, push, total
from hybridnav.maps.costs.integral import legal_cost

NO_PART = 255
"""Part of a cell that is not free."""

# Blocks that edges lead to, nearest first: the 4 at a side, the 4 at a corner, and the 8 a knight's
# move away.
_DOWN = np.array([0, 0, -1, 1, -1, -1, 1, 1, -1, -1, 1, 1, -2, -2, 2, 2], np.int64)
_ACROSS = np.array([-1, 1, 0, 0, -1, 1, -1, 1, -2, 2, -2, 2, -1, 1, -1, 1], np.int64)
_AT_A_side = 4
_MOST_MORE = 2.0**-12
"""Most by which an edge counts as dearer than it is, as a part of its cost."""
REACH = 2
"""Blocks from a node's block to the farthest that its edges lead to."""


@guarded
@njit(cache=True, nogil=True)
def lay_nodes(free, factors, side, blocks, nodes_of, parts, cells, n):
    """Lay the nodes of some blocks; return the cells of all nodes, with more room if need be, and
    their number.

    Parameters
    ----------
    free
        uint8 (rows, cols), 1 where a cell may be entered.
    factors
        float32 (rows, cols), >= 1.
    side
        Cells on a side of a block.
    blocks
        int64 (b,), numbers of blocks.
    nodes_of
        int32 (blocks, 2), changed: the first node of each block, and how many it has.
    parts
        uint8 (rows, cols), changed: the part of each free cell in its block, else `NO_PART`.
    cells
        int32, flat cells of the nodes.
    n
        Number of nodes that exist.
    """
    rows, cols = free.shape
    across = (cols + side - 1) // side
    waiting = np.empty(side * side, np.int64)
    for block in blocks:
        top, left = block // across * side, block % across * side
        bottom, right = min(top + side, rows), min(left + side, cols)
        parts[top:bottom, left:right] = NO_PART
        nodes_of[block, 0], part = n, 0
        for row in range(top, bottom):
            for col in range(left, right):
                if free[row, col] == 0 or parts[row, col] != NO_PART:
                    continue
                # Flood the part. Of its cheapest cells, the one nearest to the middle of the block
                # becomes the node.
                waiting[0], size = row * cols + col, 1
                parts[row, col] = part
                best, least, nearest = -1, np.inf, 1 << 30
                while size > 0:
                    size -= 1
                    at = waiting[size]
                    at_row, at_col = at // cols, at % cols
                    factor = factors[at_row, at_col]
                    down, over = 2 * (at_row - top) + 1 - side, 2 * (at_col - left) + 1 - side
                    away = down * down + over * over
                    is_nearer = away < nearest or (away == nearest and at < best)
                    if factor < least or (factor == least and is_nearer):
                        best, least, nearest = at, factor, away
                    for k in range(_AT_A_side):
                        to_row, to_col = at_row + _DOWN[k], at_col + _ACROSS[k]
                        is_inside = top <= to_row < bottom and left <= to_col < right
                        if is_inside and free[to_row, to_col] and parts[to_row, to_col] == NO_PART:
                            parts[to_row, to_col] = part
                            waiting[size] = to_row * cols + to_col
                            size += 1
                if n == cells.size:
                    cells = grow(cells)
                cells[n] = best
                n, part = n + 1, part + 1
        nodes_of[block, 1] = part
    return cells, n


@njit(cache=True, nogil=True)
def _meet(parts, side, a, b, a_part, b_part):
    """Return whether two parts of blocks with a common side, or of one block, touch each other.

    `parts`, `side`: see `lay_nodes`; `a`, `b`: top left cells (row, col) of the blocks; b lies
    right of a, or below it, or is a.
    """
    if a == b:
        return a_part == b_part
    rows, cols = parts.shape
    down, over = int(b[0] > a[0]), int(b[1] > a[1])
    for k in range(side):
        row, col = a[0] + (side - 1 if down else k), a[1] + (side - 1 if over else k)
        if row + down >= rows or col + over >= cols:
            continue
        if parts[row, col] == a_part and parts[row + down, col + over] == b_part:
            return True
    return False


@njit(cache=True, nogil=True)
def path_inside(free, factors, side, parts, a, b, path):
    """Find the cheapest path of cells between two cells inside their parts, by Dijkstra's
    algorithm on at most two blocks.

    Return its cost, infinite for no path, and the number of its cells, which are written to `path`
    from b to a.

    Parameters
    ----------
    free, factors, side, parts
        See `lay_nodes`.
    a, b
        Flat cells, of one block or of two with a common side.
    path
        int64, with room for the cells of two blocks.
    """
    rows, cols = free.shape
    a_row, a_col, b_row, b_col = a // cols, a % cols, b // cols, b % cols
    # The rectangle of the one or two blocks.
    top, left = min(a_row, b_row) // side * side, min(a_col, b_col) // side * side
    bottom = min(max(a_row, b_row) // side * side + side, rows)
    right = min(max(a_col, b_col) // side * side + side, cols)
    width = right - left
    n = (bottom - top) * width
    cost, before, is_done = np.full(n, np.inf), np.full(n, -1, np.int64), np.zeros(n, np.bool_)
    cost[(a_row - top) * width + a_col - left] = 0.0
    goal = (b_row - top) * width + b_col - left
    while True:
        # Take the cheapest open cell: there are so few that a queue would not pay.
        at, least = -1, np.inf
        for k in range(n):
            if not is_done[k] and cost[k] < least:
                at, least = k, cost[k]
        if at < 0:
            return np.inf, 0
        if at == goal:
            break
        is_done[at] = True
        row, col = top + at // width, left + at % width
        # Move to its neighbours in the same two parts.
        for down in range(-1, 2):
            for over in range(-1, 2):
                to_row, to_col = row + down, col + over
                if not (top <= to_row < bottom and left <= to_col < right):
                    continue
                is_of_a = to_row // side == a_row // side and to_col // side == a_col // side
                # In each block one part alone is entered.
                part = parts[a_row, a_col] if is_of_a else parts[b_row, b_col]
                if free[to_row, to_col] == 0 or parts[to_row, to_col] != part:
                    continue
                if free[row, to_col] == 0 or free[to_row, col] == 0:  # no corner cutting
                    continue
                step = 0.5 * (factors[row, col] + factors[to_row, to_col])
                whole = least + step * math.sqrt(float(down * down + over * over))
                to = (to_row - top) * width + to_col - left
                if whole < cost[to]:
                    cost[to], before[to] = whole, at
    # Walk back from b.
    size = 0
    while at >= 0:
        path[size] = (top + at // width) * cols + left + at % width
        at, size = before[at], size + 1
    return least, size


@njit(cache=True, nogil=True)
def _more(a, b):
    """Return the factor, a little above 1, by which the edge between two cells counts as dearer.

    It is a hash of the cells. Without it, lines in the open often cost the same, and which one is
    found depends on the order in which nodes are expanded: on what is known of the whole map.
    """
    mixed = (a * 0x9E3779B1 + b * 0x85EBCA6B) & 0xFFFFFFFF
    mixed = ((mixed ^ (mixed >> 15)) * 0x2C1B3C6D) & 0xFFFFFFFF
    return 1 + _MOST_MORE * ((mixed ^ (mixed >> 12)) & 0xFFFFF) / 0x100000


@njit(cache=True, nogil=True)
def _edge_cost(free, factors, side, parts, a, b, room):
    """Return the cost of the edge between two nodes: below 0 for one inside their parts, infinite
    for none.

    Parameters
    ----------
    free, factors, side, parts
        See `lay_nodes`.
    a, b
        Flat cells of the nodes.
    room
        int64, with room for the cells of two blocks.
    """
    cols = free.shape[1]
    if a > b:  # so that both directions cost the same, bit for bit
        a, b = b, a
    a_row, a_col, b_row, b_col = a // cols, a % cols, b // cols, b % cols
    straight = legal_cost(free, factors, a_row + 0.5, a_col + 0.5, b_row + 0.5, b_col + 0.5, np.inf)
    if straight < np.inf:
        return straight * _more(a, b)
    first = a_row // side * side, a_col // side * side
    second = b_row // side * side, b_col // side * side
    if abs(first[0] - second[0]) + abs(first[1] - second[1]) > side:
        return np.inf
    a_part, b_part = parts[a_row, a_col], parts[b_row, b_col]
    is_first = first[0] <= second[0] and first[1] <= second[1]
    if not is_first:
        first, second, a_part, b_part = second, first, b_part, a_part
    if not _meet(parts, side, first, second, a_part, b_part):
        return np.inf
    return -path_inside(free, factors, side, parts, a, b, room)[0] * _more(a, b)


@guarded
@njit(cache=True, nogil=True)
def lay_edges(free, factors, side, blocks, nodes_of, parts, cells, edges_of, to, costs, n):
    """Lay the edges of the nodes of some blocks behind those that exist; return the ends and costs
    of all edges, with more room if need be, and their number.

    Each edge is listed at both of its nodes. An edge whose segment would pass a blocked cell is
    none; see `_edge_cost`.

    Parameters
    ----------
    free, factors, side, blocks, nodes_of, parts, cells
        See `lay_nodes`.
    edges_of
        int64 (nodes, 2), changed: the first edge of each node, and how many it has.
    to, costs
        int32 and float32, the node at the other end of each edge, and its cost in cells; below 0
        for an edge inside two parts.
    n
        Number of edges that exist.
    """
    rows, cols = free.shape
    down, across = (rows + side - 1) // side, (cols + side - 1) // side
    room = np.empty(2 * side * side, np.int64)
    for block in blocks:
        row, col = block // across, block % across
        for k in range(nodes_of[block, 1]):
            node = nodes_of[block, 0] + k
            edges_of[node, 0] = n
            for move in range(_DOWN.size):
                to_row, to_col = row + _DOWN[move], col + _ACROSS[move]
                if not (0 <= to_row < down and 0 <= to_col < across):
                    continue
                first, count = nodes_of[to_row * across + to_col]
                for other in range(first, first + count):
                    a, b = np.int64(cells[node]), np.int64(cells[other])
                    cost = _edge_cost(free, factors, side, parts, a, b, room)
                    if cost == np.inf:
                        continue
                    if n == to.size:
                        to, costs = grow(to), grow(costs)
                    to[n], costs[n] = other, cost
                    n += 1
            edges_of[node, 1] = n - edges_of[node, 0]
    return to, costs, n


# Kernels of landmarks: nodes from which the cost of reaching every other node is known.
#
# By the triangle inequality, the costs from a landmark to two nodes differ by at most the cost from
# one node to the other: a lower bound that a search reads from a table.


_UNITS = 2.0**16
"""Units of a cell in keys of the open list."""


@guarded
@njit(cache=True, nogil=True)
def costs_from(edges_of, to, costs, source):
    """Find the least cost from a node to each other one, by Dijkstra's algorithm; float32 (nodes,),
    infinite where there is no path.

    `edges_of`, `to`, `costs`: see `build.lay_edges`.
    """
    reached = np.full(edges_of.shape[0], np.inf)
    reached[source] = 0.0
    heap, size = np.empty((max(to.size, 1), 2), np.int64), 1
    heap[0, 0], heap[0, 1] = 0, source
    while size > 0:
        key = heap[0, 0]
        node = pop(heap, size)
        size -= 1
        here = reached[node]
        if key > np.int64(here * _UNITS):  # reached more cheaply since
            continue
        first, count = edges_of[node]
        for edge in range(first, first + count):
            whole = here + abs(costs[edge])
            if whole < reached[to[edge]]:
                reached[to[edge]] = whole
                if size == heap.shape[0]:
                    heap = grow_rows(heap)
                push(heap, size, np.int64(whole * _UNITS), to[edge])
                size += 1
    return reached.astype(np.float32)


@njit(cache=True, nogil=True)
def _largest_part(edges_of, to, order):
    """Return the nodes of the largest connected part; of equal ones, that of the first node."""
    is_seen = np.zeros(edges_of.shape[0], np.bool_)
    reached, size, best, first_of_best = np.empty(order.size, np.int64), 0, 0, 0
    for node in order:
        if is_seen[node]:
            continue
        begin, at = size, size
        is_seen[node], reached[size] = True, node
        size += 1
        while at < size:
            first, count = edges_of[reached[at]]
            at += 1
            for edge in range(first, first + count):
                if not is_seen[to[edge]]:
                    is_seen[to[edge]], reached[size] = True, to[edge]
                    size += 1
        if size - begin > best:
            best, first_of_best = size - begin, begin
    return reached[first_of_best : first_of_best + best]


@guarded
@njit(cache=True, nogil=True)
def choose_landmarks(edges_of, to, cells, cols, order, n):
    """Choose nodes far from each other, int64 (k,), k <= n: as the crow flies, so that each is
    chosen without a search.

    They lie in the largest connected part of the map. The first one is the farthest from the middle
    of its nodes, each next one the farthest from those chosen.

    `edges_of`, `to`: see `build.lay_edges`; `cells`: int32 (nodes,), flat cells; `cols`: columns of
    the map; `order`: int64 (m,), the nodes that blocks have, in the order of their cells; `n`: most
    landmarks.
    """
    part = _largest_part(edges_of, to, order)
    n = min(n, part.size)
    row, col = cells[part] // cols + 0.0, cells[part] % cols + 0.0
    nodes = max(part.size, 1)
    from_row, from_col = total(row) / nodes, total(col) / nodes
    nearest = np.full(part.size, np.inf)
    chosen = np.empty(n, np.int64)
    for k in range(n):
        most, farthest = -1.0, 0
        for i in range(part.size):
            away = (row[i] - from_row) ** 2 + (col[i] - from_col) ** 2
            nearest[i] = away if k < 2 else min(nearest[i], away)
            if nearest[i] > most:
                most, farthest = nearest[i], i
        chosen[k] = part[farthest]
        from_row, from_col = row[farthest], col[farthest]
    return chosen
