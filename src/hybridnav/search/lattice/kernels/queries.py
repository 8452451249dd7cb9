"""The kernel of queries on a lattice: A* over its nodes, and the line through those on the path.

Positions are (row, col) in grid units. See `build` for nodes, edges and parts.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push
from hybridnav._base.trig import hypot
from hybridnav.maps.costs.integral import legal_cost
from hybridnav.search.lattice.kernels.build import path_inside

_NEAR = 12
"""Cells up to which the straight line between both ends is tried."""
_UNITS = 2.0**20
"""Units of a cell in keys of the open list."""
_MOST = 2.0**62
"""Largest key, in units: costs above it are searched in any order."""
_ROUNDING = 2.0**-23
"""Relative slack of lower bounds, which are read from float32."""
_MOST_NODES = 8
"""Most parts of a block of 16 cells."""
FULL = -1
"""Number of expanded nodes that says that the open list had no room."""


class LatticeNet(NamedTuple):
    """A lattice; see `Lattice` for its fields."""

    free: np.ndarray
    """Cells that may be entered."""
    factors: np.ndarray
    """What a metre costs in each."""
    nodes_of: np.ndarray
    """Offsets of the nodes of each cell."""
    parts: np.ndarray
    """The places of nodes on the sides of their cells."""
    cells: np.ndarray
    """The cells of nodes."""
    edges_of: np.ndarray
    """Offsets of the edges of each node."""
    to: np.ndarray
    """The heads of edges."""
    costs: np.ndarray
    """What edges cost, in cells."""
    landmarks: np.ndarray
    """Distances from landmarks to nodes."""
    side: int
    """Nodes on a side of a cell."""


class Work(NamedTuple):
    """Work arrays of one query."""

    cost: np.ndarray
    """float64 (nodes,)."""
    before: np.ndarray
    """int32 (nodes,), the nodes before."""
    mark: np.ndarray
    """int64 (nodes,)."""
    rest: np.ndarray
    """float64 (nodes,), infinite."""
    left: np.ndarray
    """float64 (nodes,), what is left at least to pay from nodes that were reached."""
    heap: np.ndarray
    """int64 (entries, 2), the open list."""
    generation: int
    """A number above those of earlier queries with these arrays, > 0."""


@njit(cache=True, nogil=True)
def _nodes_near(lattice, at, cell, nodes, costs):
    """Find the nodes in and round the block of a position that it sees, and what it costs to reach
    each. The node of its own part is among them in any case.

    Return how many there are, and whether the only one is not seen.

    `lattice`: a `LatticeNet`; `at`: float64 (2,), position; `cell`: int64 (2,), (row, col) of the
    free cell that holds it: on a side, which one; `nodes`, `costs`: int64 and float64, with room
    for the nodes of nine blocks.
    """
    free, factors, parts, cells = lattice.free, lattice.factors, lattice.parts, lattice.cells
    nodes_of, side = lattice.nodes_of, lattice.side
    rows, cols = free.shape
    down, across = (rows + side - 1) // side, (cols + side - 1) // side
    row, col = cell
    n = 0
    for block_row in range(max(row // side - 1, 0), min(row // side + 2, down)):
        for block_col in range(max(col // side - 1, 0), min(col // side + 2, across)):
            first, count = nodes_of[block_row * across + block_col]
            for node in range(first, first + count):
                to_row, to_col = cells[node] // cols + 0.5, cells[node] % cols + 0.5
                cost = legal_cost(free, factors, at[0], at[1], to_row, to_col, np.inf)
                if cost < np.inf:
                    nodes[n], costs[n] = node, cost
                    n += 1
    if n > 0:
        return n, False
    node = nodes_of[row // side * across + col // side, 0] + parts[row, col]
    room = np.empty(2 * side * side, np.int64)
    cost, _ = path_inside(
        free, factors, side, parts, np.int64(row * cols + col), np.int64(cells[node]), room
    )
    nodes[0] = node
    costs[0] = cost + factors[row, col] * hypot(at[0] - row - 0.5, at[1] - col - 0.5)
    return 1, True


@njit(cache=True, nogil=True)
def _costs_towards(landmarks, starts):
    """Return between what costs from each landmark a node must lie to be near the start.

    These are the lower and the upper end, by the nodes from which it is reached, float64 (2, k), of
    the landmarks that have a path to it, int64 (k,).
    """
    reaching = np.empty(landmarks.shape[1], np.int64)
    towards = np.empty((2, reaching.size))
    k = 0
    for j in range(reaching.size):
        low, high = np.inf, -np.inf
        for i in range(len(starts[0])):
            at = landmarks[starts[0][i], j]
            low, high = min(low, at + starts[1][i]), max(high, at - starts[1][i])
        if low < np.inf:
            towards[0, k], towards[1, k] = low - _ROUNDING * low, high + _ROUNDING * high
            reaching[k], k = j, k + 1
    return towards[:, :k], reaching[:k]


@njit(cache=True, nogil=True, _nrt=False)
def _cost_left(landmarks, reaching, towards, node, apart):
    """Return a lower bound on the cost from a node to the start, which lies so far from it."""
    least = apart * (1 - _ROUNDING)
    for j in range(reaching.size):
        at = landmarks[node, reaching[j]]
        least = max(least, at - towards[1, j], towards[0, j] - at)
    return least


@njit(cache=True, nogil=True)
def _search(lattice, start, starts, goals, most, work):
    """Search from the goal to the start by A*; return the last node, the number of expanded ones,
    and whether the open list was full.

    The last node is -1 if there is no path that costs less than `most`. The distance to the start
    bounds what is left, because no factor is below 1. Bounds differ from each other by roundings,
    so a node may be expanded again.

    `lattice`, `work`: see `find_line`; `start`: float64 (2,), the position to reach; `starts`,
    `goals`: nodes from which the start is reached, and those from which the search begins, with
    their costs; `most`: cost of a path that is known, infinite for none.
    """
    cells, to, landmarks, cols = lattice.cells, lattice.to, lattice.landmarks, lattice.free.shape[1]
    edges_of, edge_costs = lattice.edges_of, lattice.costs
    cost, before, mark = work.cost, work.before, work.mark
    rest, left, heap = work.rest, work.left, work.heap
    opened, closed = 2 * work.generation, 2 * work.generation + 1
    size, expanded, last, is_full = 0, 0, -1, False
    towards, reaching = _costs_towards(landmarks, starts)
    # What is left to pay from the nodes round the start.
    for k in range(len(starts[0])):
        rest[starts[0][k]] = starts[1][k]
    # Begin at the nodes round the goal.
    for k in range(len(goals[0])):
        node, first = goals[0][k], goals[1][k]
        cost[node], before[node], mark[node] = first, -1, opened
        row, col = cells[node] // cols + 0.5, cells[node] % cols + 0.5
        apart = hypot(row - start[0], col - start[1])
        left[node] = _cost_left(landmarks, reaching, towards, node, apart)
        key = np.int64(min((first + left[node]) * _UNITS, _MOST))
        push(heap, size, key, node)
        size += 1
    while size > 0:
        key = heap[0, 0]
        node = pop(heap, size)
        size -= 1
        if key > min(most * _UNITS, _MOST):  # nothing that is left is cheaper
            break
        if mark[node] == closed:
            continue
        mark[node] = closed
        expanded += 1
        # Is a path over this node the cheapest so far?
        here = cost[node]
        if here + rest[node] < most:
            most, last = here + rest[node], node
        first, count = edges_of[node]
        if size + count > heap.shape[0]:
            is_full = True
            break
        # Relax its edges; what cannot be part of a cheaper path is left out.
        for edge in range(first, first + count):
            other = to[edge]
            whole = here + abs(edge_costs[edge])
            is_new = mark[other] < opened
            if is_new or whole < cost[other]:
                if is_new:
                    row, col = cells[other] // cols + 0.5, cells[other] % cols + 0.5
                    apart = hypot(row - start[0], col - start[1])
                    left[other] = _cost_left(landmarks, reaching, towards, other, apart)
                least = whole + left[other]
                if least < most:
                    cost[other], before[other], mark[other] = whole, node, opened
                    key = np.int64(min(least * _UNITS, _MOST))
                    push(heap, size, key, other)
                    size += 1
    # Leave the work arrays as they were.
    for k in range(len(starts[0])):
        rest[starts[0][k]] = np.inf
    return last, expanded, is_full


@njit(cache=True, nogil=True)
def _put(line, size, row, col):
    """Put a position at the end of a line, unless it is there; return the size of the line."""
    if size == 0 or line[size - 1, 0] != row or line[size - 1, 1] != col:
        line[size, 0], line[size, 1] = row, col
        size += 1
    return size


@njit(cache=True, nogil=True)
def _put_inside(lattice, line, size, a, b):
    """Put the centres of the cells on the path inside the parts of two cells to a line."""
    free, factors, parts, side = lattice.free, lattice.factors, lattice.parts, lattice.side
    cols = free.shape[1]
    room = np.empty(2 * side * side, np.int64)
    # The path is listed from its second cell.
    _, count = path_inside(free, factors, side, parts, b, a, room)
    for k in range(count):
        size = _put(line, size, room[k] // cols + 0.5, room[k] % cols + 0.5)
    return size


@njit(cache=True, nogil=True)
def _line_from(lattice, ends, ends_in, last, is_inside, before):
    """Return the line through the nodes of a path."""
    cols, side, cells = lattice.free.shape[1], lattice.side, lattice.cells
    n, node = 0, last
    while node >= 0:
        n, node = n + 1, before[node]
    line = np.empty((2 * side * side * (n + 2), 2))
    size = _put(line, 0, ends[0, 0], ends[0, 1])
    own = np.empty(2, np.int64)
    for k in range(2):
        own[k] = ends_in[k, 0] * cols + ends_in[k, 1]
    if is_inside[0]:
        size = _put_inside(lattice, line, size, own[0], np.int64(cells[last]))
    node = last
    while True:
        size = _put(line, size, cells[node] // cols + 0.5, cells[node] % cols + 0.5)
        following = before[node]
        if following < 0:
            break
        first, count = lattice.edges_of[node]
        for edge in range(first, first + count):
            if lattice.to[edge] == following and lattice.costs[edge] < 0:
                a, b = np.int64(cells[node]), np.int64(cells[following])
                size = _put_inside(lattice, line, size, a, b)
        node = following
    if is_inside[1]:
        size = _put_inside(lattice, line, size, np.int64(cells[node]), own[1])
    size = _put(line, size, ends[1, 0], ends[1, 1])
    return line[:size].copy()


@guarded
@njit(cache=True, nogil=True)
def find_line(lattice, ends, ends_in, work):
    """Find a line of little cost between two positions; return it, and the nodes expanded.

    The line has no positions if there is no path. `FULL` in place of the number of nodes asks for
    more room in the open list.

    `lattice`: `LatticeNet`; `ends`: float64 (2, 2), start and goal; `ends_in`: int64 (2, 2), (row,
    col) of the free cells that hold them; `work`: a `Work`.
    """
    free, factors = lattice.free, lattice.factors
    nodes, costs = np.empty((2, 9 * _MOST_NODES), np.int64), np.empty((2, 9 * _MOST_NODES))
    n, n_inside = _nodes_near(lattice, ends[0], ends_in[0], nodes[0], costs[0])
    m, m_inside = _nodes_near(lattice, ends[1], ends_in[1], nodes[1], costs[1])
    straight = np.inf
    if hypot(ends[0, 0] - ends[1, 0], ends[0, 1] - ends[1, 1]) <= _NEAR:
        straight = legal_cost(free, factors, ends[0, 0], ends[0, 1], ends[1, 0], ends[1, 1], np.inf)
    starts, goals = (nodes[0, :n], costs[0, :n]), (nodes[1, :m], costs[1, :m])
    last, expanded, is_full = _search(lattice, ends[0], starts, goals, straight, work)
    if is_full:
        return np.empty((0, 2)), FULL
    if last >= 0:
        line = _line_from(lattice, ends, ends_in, last, (n_inside, m_inside), work.before)
        return line, expanded
    if straight < np.inf:
        return ends.copy(), expanded
    return np.empty((0, 2)), expanded
