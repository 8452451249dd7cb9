"""Kernels of route graphs: their edges, and the middles of free space."""

import heapq
import math

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.trig import hypot
from hybridnav.maps.geometry import passed_cells

# Shortest routes between many pairs.


@guarded
@njit(cache=True, nogil=True)
def routes(graph, starts, goals, passed):
    """Find the shortest route of each of many pairs.

    Parameters
    ----------
    graph
        int64 (n + 1,) first edge of each node, int64 (m,) head and float64 (m,) cost of each edge.
    starts, goals
        For each end int64 (p + 1,) offsets, int64 (k,) the nodes that it is joined to and float64
        (k,) the costs to join them.
    passed
        int64 (w,), filled with the nodes of each route, from the last to the first.

    Returns
    -------
    tuple
        float64 (p,) costs, infinite for none; int64 (p + 1,) offsets of the routes in `passed`, -1
        in the last place if these are too short for all; int64 (p,) number of expanded nodes.
    """
    first, head, cost_of = graph
    n, n_pairs = len(first) - 1, len(starts[0]) - 1
    costs, before = np.full(n, np.inf), np.full(n, -1, np.int64)
    finish = np.full(n, np.inf)
    found, offsets = np.full(n_pairs, np.inf), np.zeros(n_pairs + 1, np.int64)
    expanded = np.zeros(n_pairs, np.int64)
    used = 0

    # The arrays serve all pairs: each search resets only the nodes that it reached.
    for pair in range(n_pairs):
        reached = [np.int64(0) for _ in range(0)]
        # Elsewhere `finish` stays infinite, so that every node can be tested as the last one.
        for k in range(goals[0][pair], goals[0][pair + 1]):
            finish[goals[1][k]] = goals[2][k]
        # This entry is never taken out: the heap is never empty, and a search without a path ends.
        heap = [(np.inf, np.int64(-1))]
        for k in range(starts[0][pair], starts[0][pair + 1]):
            node = starts[1][k]
            costs[node] = starts[2][k]
            reached.append(node)
            heapq.heappush(heap, (costs[node], node))
        best, last = np.inf, np.int64(-1)
        # No cost is negative: a node that costs `best` or more cannot be on a cheaper route.
        while heap[0][0] < best:
            cost, here = heapq.heappop(heap)
            if cost > costs[here]:
                continue
            expanded[pair] += 1
            if cost + finish[here] < best:
                best, last = cost + finish[here], here
            for edge in range(first[here], first[here + 1]):
                other, through = head[edge], cost + cost_of[edge]
                if through < costs[other]:
                    if costs[other] == np.inf:
                        reached.append(other)
                    costs[other], before[other] = through, here
                    heapq.heappush(heap, (through, other))
        found[pair] = best
        # The caller calls again with more room if the nodes do not fit.
        node = last
        while node >= 0:
            if used == len(passed):
                offsets[n_pairs] = -1
                return found, offsets, expanded
            passed[used] = node
            used += 1
            node = before[node]
        offsets[pair + 1] = used
        # The next search must find these arrays as this one did.
        for node in reached:
            costs[node], before[node] = np.inf, -1
        for k in range(goals[0][pair], goals[0][pair + 1]):
            finish[goals[1][k]] = np.inf
    return found, offsets, expanded


# Free distances to the left and right along edges, and clearance.

_STEP_CELLS = 0.5
"""Distance between the points of an edge at which its width is measured."""


@njit(cache=True, nogil=True)
def _free_distance(occupied, row, col, down, across, reach):
    """Return how far a ray runs before it enters an occupied cell, at most `reach`, in cells."""
    rows, cols = occupied.shape
    here_row, here_col = math.floor(row), math.floor(col)
    step_row, step_col = (1 if down > 0 else -1), (1 if across > 0 else -1)
    to_row = (here_row + (step_row > 0) - row) / down if down != 0.0 else math.inf
    to_col = (here_col + (step_col > 0) - col) / across if across != 0.0 else math.inf
    along = 0.0
    while along < reach:
        if not (0 <= here_row < rows and 0 <= here_col < cols):
            return reach
        if occupied[here_row, here_col]:
            return along
        if to_row < to_col:
            along = to_row
            to_row += 1.0 / abs(down)
            here_row += step_row
        else:
            along = to_col
            to_col += 1.0 / abs(across)
            here_col += step_col
    return reach


@njit(cache=True, nogil=True)
def least_widths(occupied, tails, heads, reach):
    """Return the least free distance to the left and right of edges, and the least width.

    Parameters
    ----------
    occupied
        bool (rows, cols).
    tails, heads
        float64 (m, 2), (row, col) in grid units.
    reach
        Distance up to which is measured, in cells.

    Returns
    -------
    array
        float64 (m, 3), left, right, and the least sum of both, in cells.
    """
    found = np.full((len(tails), 3), np.inf)
    for edge in range(len(tails)):
        row, col = tails[edge, 0], tails[edge, 1]
        down, across = heads[edge, 0] - row, heads[edge, 1] - col
        length = hypot(down, across)
        count = max(1, math.ceil(length / _STEP_CELLS))
        for k in range(count + 1):
            at_row, at_col = row + k / count * down, col + k / count * across
            # Rows run upwards: the left of (down, across) is (across, -down).
            unit_row, unit_col = across / length, -down / length
            left = _free_distance(occupied, at_row, at_col, unit_row, unit_col, reach)
            right = _free_distance(occupied, at_row, at_col, -unit_row, -unit_col, reach)
            found[edge, 0] = min(found[edge, 0], left)
            found[edge, 1] = min(found[edge, 1], right)
            found[edge, 2] = min(found[edge, 2], left + right)
    return found


@guarded
@njit(cache=True, nogil=True)
def least_along(free, values, positions, edges):
    """Return the least value of the cells that each edge passes, and the cell in its middle.

    `free`, `values`: bool and float (rows, cols); `positions`: float64 (n, 2), the nodes, (row,
    col) in grid units; `edges`: int64 (m, 2), tail and head of each. Returns float64 (m,), and
    int64 (m, 2), (row, col).
    """
    least, middles = np.full(len(edges), np.inf), np.empty((len(edges), 2), np.int64)
    line = np.empty((2, 2))
    for edge in range(len(edges)):
        line[0], line[1] = positions[edges[edge, 0]], positions[edges[edge, 1]]
        cells = passed_cells(free, line)
        for k in range(len(cells)):
            least[edge] = min(least[edge], values[cells[k, 0], cells[k, 1]])
        middles[edge] = cells[len(cells) // 2]
    return least, middles


@njit(cache=True, nogil=True)
def bends(points, weights, sway, least, asked, bend, reach):
    """Return the point before each point of a chain on the edges of least cost, int64 (n,).

    `points`, `weights`, `sway`, `asked`: float64 (n, 2) and (n,), the chain, what its points count,
    how far off they may be at little cost, and the clearance to be kept; `least`: float64, the
    clearance of the edges to each point from those before, in order; `bend`: cost of an edge; the
    rest is how far points lie off, squared; `reach`: most points back.
    """
    best, before = np.full(len(points), np.inf), np.zeros(len(points), np.int64)
    best[0], behind = 0.0, 0
    for at in range(1, len(points)):
        behind += min(at, reach)
        low = asked[at]
        for k in range(at - 1, max(0, at - reach) - 1, -1):
            low = min(low, asked[k])
            if k < at - 1 and least[behind - at + k] < low:
                continue
            down, across = points[at, 0] - points[k, 0], points[at, 1] - points[k, 1]
            cost = 0.0
            for i in range(k, at + 1):
                off = (points[i, 1] - points[k, 1]) * down - (points[i, 0] - points[k, 0]) * across
                cost += (off / sway[i]) ** 2 * weights[i]
            cost = best[k] + bend + cost / max(down * down + across * across, 1e-18)
            if cost <= best[at]:
                best[at], before[at] = cost, k
    return before


# Kernels of skeletons: thinning in the order of clearance, and distances from lines.


_DOWN = (0, -1, -1, -1, 0, 1, 1, 1)
_ACROSS = (1, 1, 0, -1, -1, -1, 0, 1)
"""The eight neighbours of a cell, counter-clockwise; those at even places share a side with it."""


@njit(cache=True, nogil=True)
def _is_simple(inside, row, col):
    """Return whether a cell can go without parting or joining anything: its 4-connectivity number
    is 1 (S. Yokoi, J. Toriwaki, T. Fukumura, 1975)."""
    number = 0
    for k in range(0, 8, 2):
        if inside[row + _DOWN[k], col + _ACROSS[k]]:
            one = inside[row + _DOWN[k + 1], col + _ACROSS[k + 1]]
            other = inside[row + _DOWN[(k + 2) % 8], col + _ACROSS[(k + 2) % 8]]
            number += 0 if one and other else 1
    return number == 1


@guarded
@njit(cache=True, nogil=True)
def thinned(inside, clearance, order, anchors):
    """Thin a set of cells to 4-connected lines, the cells nearest to obstacles first (C. Pudney:
    Distance-ordered homotopic thinning, 1998).

    A cell that had to stay is tried again as soon as a neighbour goes: so ends without an anchor
    shrink away. `inside`: bool (rows, cols), changed in place; false along its rim; `clearance`:
    float64 (rows, cols); `order`: int64 (k,), the flat cells of the set by clearance; `anchors`:
    bool (rows, cols), cells that stay.
    """
    cols = inside.shape[1]
    waiting = np.empty(8 * len(order) + 8, np.int64)
    for k in range(len(order)):
        level = clearance[order[k] // cols, order[k] % cols]
        waiting[0], first, last = order[k], 0, 1
        while first < last:
            row, col = waiting[first] // cols, waiting[first] % cols
            first += 1
            if not inside[row, col] or anchors[row, col] or not _is_simple(inside, row, col):
                continue
            inside[row, col] = False
            if first == last:
                first, last = 0, 0
            for side in range(8):
                other_row, other_col = row + _DOWN[side], col + _ACROSS[side]
                if inside[other_row, other_col] and clearance[other_row, other_col] <= level:
                    waiting[last] = other_row * cols + other_col
                    last += 1


@guarded
@njit(cache=True, nogil=True)
def spread(free, sources):
    """Return how many steps each cell lies from the nearest of some cells, int32, -1 out of reach.

    Steps go to 4 and 8 neighbours in turn, so that the cells within a distance make an octagon: it
    is Euclidean within a tenth, where steps are scaled by 1.2. `free`: bool (rows, cols), false
    along its rim; `sources`: int64 (k,), flat cells.
    """
    cols = free.shape[1]
    steps = np.full(free.shape, -1, np.int32)
    queue = np.empty(free.size, np.int64)
    last = 0
    for k in range(len(sources)):
        row, col = sources[k] // cols, sources[k] % cols
        if steps[row, col] < 0:
            steps[row, col] = 0
            queue[last] = sources[k]
            last += 1
    first = 0
    while first < last:
        row, col = queue[first] // cols, queue[first] % cols
        first += 1
        here = steps[row, col]
        for side in range(0, 8, 1 + (here % 2 == 0)):
            other_row, other_col = row + _DOWN[side], col + _ACROSS[side]
            if not free[other_row, other_col] or steps[other_row, other_col] >= 0:
                continue
            if side % 2 and not (free[row, other_col] and free[other_row, col]):
                continue
            steps[other_row, other_col] = here + 1
            queue[last] = other_row * cols + other_col
            last += 1
    return steps
