"""Kernels of HPA*: regions of clusters, transitions, distances in clusters, search, smoothing.

A cluster is a square of `cluster_cells` x `cluster_cells` cells of the grid, cut off at its upper
and right rim. Moves are legal on the whole grid; inside a cluster both cells of a move lie in it.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, pop, push
from hybridnav._base.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT, octile_cost
from hybridnav._base.typing import IntArray, LongArray

LONG_RUN = 6
"""Facing pairs from which an entrance has a transition at either end, not one in the middle."""

_NONE = np.iinfo(np.int64).max


class AbstractGraph(NamedTuple):
    """The abstract graph; nodes are ordered by cluster, edges by the node they lead out of."""

    cells: LongArray
    """int64 (n_nodes,), flat cell of each node."""
    cluster_first: LongArray
    """int64 (n_clusters + 1,), first node of each cluster."""
    first: LongArray
    """int64 (n_nodes + 1,), first edge out of each node."""
    endpoints: IntArray
    """int32 (n_edges,), node that each edge leads to."""
    costs: LongArray
    """int64 (n_edges,), integer cost of each edge."""


@njit(cache=True, nogil=True)
def cluster_at(cols, cluster_cells, cell):
    """Return the index of the cluster of a flat cell."""
    return (
        cell // cols // cluster_cells * ((cols + cluster_cells - 1) // cluster_cells)
        + cell % cols // cluster_cells
    )


@njit(cache=True, nogil=True)
def label_regions(enterable, moves, cluster_cells):
    """Return the region of each cell, a connected component of a cluster; -1 for cells not to
    enter."""
    rows, cols = moves.shape
    region_of = np.full((rows, cols), np.int32(-1), np.int32)
    stack = np.empty(cluster_cells * cluster_cells, np.int64)
    n_regions = 0
    for row0 in range(0, rows, cluster_cells):
        for col0 in range(0, cols, cluster_cells):
            row1, col1 = min(row0 + cluster_cells, rows), min(col0 + cluster_cells, cols)
            for seed_row in range(row0, row1):
                for seed_col in range(col0, col1):
                    if not enterable[seed_row, seed_col] or region_of[seed_row, seed_col] >= 0:
                        continue
                    region_of[seed_row, seed_col] = n_regions
                    stack[0] = seed_row * cols + seed_col
                    size = 1
                    while size > 0:
                        size -= 1
                        row, col = stack[size] // cols, stack[size] % cols
                        for k in range(8):
                            if not moves[row, col] >> k & 1:
                                continue
                            to_row, to_col = row + ROW_STEP[k], col + COL_STEP[k]
                            if not (row0 <= to_row < row1 and col0 <= to_col < col1):
                                continue
                            if region_of[to_row, to_col] < 0:
                                region_of[to_row, to_col] = n_regions
                                stack[size] = to_row * cols + to_col
                                size += 1
                    n_regions += 1
    return region_of


@njit(cache=True, nogil=True)
def transitions(enterable, cluster_cells):
    """Return the flat cell pairs (n, 2) of the transitions between clusters that share a side.

    An entrance is a maximal run of facing pairs of cells that may be entered, along one side of
    one cluster.
    """
    rows, cols = enterable.shape
    pairs = np.empty(
        (2 * rows * (cols // cluster_cells) + 2 * cols * (rows // cluster_cells) + 1, 2), np.int64
    )
    n_pairs = 0
    for upright in range(2):
        # `along` counts cells along the line between two rows of clusters, `across` across it.
        n_across, n_along = (cols, rows) if upright else (rows, cols)
        step_across, step_along = (1, cols) if upright else (cols, 1)
        for across in range(cluster_cells - 1, n_across - 1, cluster_cells):
            run = 0
            for along in range(n_along):
                cell = across * step_across + along * step_along
                facing = cell + step_across
                if (
                    enterable[cell // cols, cell % cols]
                    and enterable[facing // cols, facing % cols]
                ):
                    run += 1
                    ends_here = along + 1 == n_along or (along + 1) % cluster_cells == 0
                    beyond = cell + step_along
                    if not ends_here:
                        facing = beyond + step_across
                        ends_here = not (
                            enterable[beyond // cols, beyond % cols]
                            and enterable[facing // cols, facing % cols]
                        )
                    if not ends_here:
                        continue
                    last = cell
                    if run < LONG_RUN:
                        last -= run // 2 * step_along
                    else:
                        other = cell - (run - 1) * step_along
                        pairs[n_pairs, 0], pairs[n_pairs, 1] = other, other + step_across
                        n_pairs += 1
                    pairs[n_pairs, 0], pairs[n_pairs, 1] = last, last + step_across
                    n_pairs += 1
                run = 0
    return pairs[:n_pairs]


@njit(cache=True, nogil=True)
def flood(moves, cluster_cells, cell, distance, waiting):
    """Fill `distance` with the costs of paths from a cell inside its cluster; return the cells
    reached.

    `distance` is (side, side), -1 where no path stays in the cluster; the result counts cells.

    Buckets as wide as a straight step make the search label-setting (Dinic 1978). A cell is
    improved at most once by each neighbour, so `waiting` needs 8 entries a cell.
    """
    rows, cols = moves.shape

    # Cells are numbered inside the cluster: the work arrays need its size, not that of the map.
    row0, col0 = (
        cell // cols // cluster_cells * cluster_cells,
        cell % cols // cluster_cells * cluster_cells,
    )
    height, width = min(cluster_cells, rows - row0), min(cluster_cells, cols - col0)
    distance[:] = -1
    count = np.zeros(3, np.int64)
    local = (cell // cols - row0) * cluster_cells + cell % cols - col0
    distance[local // cluster_cells, local % cluster_cells] = 0
    waiting[0, 0] = local
    count[0] = 1
    turn = 0
    reached = 1

    # A move costs one width or more, less than two: it leads into one of the next two buckets.
    while count[0] + count[1] + count[2] > 0:
        slot = turn % 3
        while count[slot] > 0:
            count[slot] -= 1
            local = np.int64(waiting[slot, count[slot]])
            row, col = local // cluster_cells, local % cluster_cells
            cost = distance[row, col]
            # A better cost put this cell into an earlier bucket, which expanded it.
            if cost // STRAIGHT != turn:
                continue
            mask = moves[row0 + row, col0 + col]
            for k in range(8):
                if not mask >> k & 1:
                    continue
                to_row, to_col = row + ROW_STEP[k], col + COL_STEP[k]
                # Legal moves may lead out of the cluster, which the rim of the map cuts off.
                if not (0 <= to_row < height and 0 <= to_col < width):
                    continue
                new_cost = cost + (DIAGONAL if k & 1 else STRAIGHT)
                old_cost = distance[to_row, to_col]
                if 0 <= old_cost <= new_cost:
                    continue
                # A cell may be improved later: it counts when it is first reached.
                if old_cost < 0:
                    reached += 1
                distance[to_row, to_col] = new_cost
                into = new_cost // STRAIGHT % 3
                waiting[into, count[into]] = to_row * cluster_cells + to_col
                count[into] += 1
        turn += 1
    return reached


@njit(cache=True, nogil=True)
def distance_in_cluster(distance, cols, cluster_cells, cell):
    """Return the result of the last flood for a flat cell of the same cluster."""
    return distance[cell // cols % cluster_cells, cell % cols % cluster_cells]


@guarded
@njit(cache=True, nogil=True)
def intra_edges(moves, cluster_cells, cells, cluster_first):
    """Return tails, heads and costs of the edges between nodes joined by a path in their
    cluster."""
    cols = moves.shape[1]
    counts = cluster_first[1:] - cluster_first[:-1]
    room = np.sum(counts * (counts - 1))
    tails, heads = np.empty(room, np.int32), np.empty(room, np.int32)
    costs = np.empty(room, np.int64)
    distance = np.empty((cluster_cells, cluster_cells), np.int64)
    waiting = np.empty((3, 8 * cluster_cells * cluster_cells), np.int32)
    n_edges = 0
    for cluster in range(counts.size):
        low, high = cluster_first[cluster], cluster_first[cluster + 1]
        for tail in range(low, high):
            flood(moves, cluster_cells, cells[tail], distance, waiting)
            for head in range(low, high):
                cost = distance_in_cluster(distance, cols, cluster_cells, cells[head])
                if head != tail and cost >= 0:
                    tails[n_edges], heads[n_edges], costs[n_edges] = tail, head, cost
                    n_edges += 1
    return tails[:n_edges], heads[:n_edges], costs[:n_edges]


@guarded
@njit(cache=True, nogil=True)
def abstract_search(moves, cluster_cells, graph, start, goal, cost_of, previous, mark, generation):
    """Return the flat cells of the cheapest abstract path, and the nodes and cells expanded.

    The path includes start and goal, and is empty if there is none; cells are expanded to join
    start and goal to the graph: to the nodes of their clusters, and to each other if a path inside
    one cluster does so.

    `moves`: uint8 (rows, cols), the legal moves of each cell; `cluster_cells`: side of a cluster,
    in cells; `graph`: `AbstractGraph`; `start`, `goal`: flat cells; `cost_of`, `previous`: work
    arrays, one entry a node: integer cost and previous node; `mark`, `generation`: as in
    `weighted.dijkstra`, by node.
    """
    cols = moves.shape[1]
    is_open, is_closed = 2 * generation, 2 * generation + 1
    distance = np.empty((cluster_cells, cluster_cells), np.int64)
    waiting = np.empty((3, 8 * cluster_cells * cluster_cells), np.int32)
    start_cluster, goal_cluster = (
        cluster_at(cols, cluster_cells, start),
        cluster_at(cols, cluster_cells, goal),
    )

    # Start and goal are not inserted into the graph, which queries leave as it is: floods of their
    # clusters join them. Moves are legal both ways, so one from the goal finds the costs to it.
    goal_row, goal_col = goal // cols, goal % cols
    goal_low, goal_high = graph.cluster_first[goal_cluster], graph.cluster_first[goal_cluster + 1]
    to_goal = np.empty(goal_high - goal_low, np.int64)
    n_cells = flood(moves, cluster_cells, goal, distance, waiting)
    for node in range(goal_low, goal_high):
        to_goal[node - goal_low] = distance_in_cluster(
            distance, cols, cluster_cells, graph.cells[node]
        )

    # A path inside one cluster passes no node: `last` is -1 until another one is cheaper.
    least, last = _NONE, np.int64(-1)
    if start_cluster == goal_cluster:
        direct = distance_in_cluster(distance, cols, cluster_cells, start)
        if direct >= 0:
            least = direct

    # This flood overwrites the distances to the goal, which `to_goal` keeps.
    n_cells += flood(moves, cluster_cells, start, distance, waiting)
    heap = np.empty((256, 2), np.int64)
    size = expanded = 0
    for node in range(graph.cluster_first[start_cluster], graph.cluster_first[start_cluster + 1]):
        cell = graph.cells[node]
        cost = distance_in_cluster(distance, cols, cluster_cells, cell)
        if cost < 0:
            continue
        cost_of[node], previous[node], mark[node] = cost, -1, is_open
        if size == len(heap):
            heap = np.concatenate((heap, heap))
        rest = octile_cost(cell // cols - goal_row, cell % cols - goal_col)
        push(heap, size, cost + rest, node)
        size += 1

    # Octile costs never exceed those of paths: a key is a bound, and none from `least` on wins.
    while size > 0 and heap[0, 0] < least:
        node = pop(heap, size)
        size -= 1
        # An improved node waits more than once; the first entry to come is the cheapest.
        if mark[node] == is_closed:
            continue
        mark[node] = is_closed
        expanded += 1
        # The goal is no node: a path ends at a node of its cluster, plus the way inside that.
        if goal_low <= node < goal_high and to_goal[node - goal_low] >= 0:
            cost = cost_of[node] + to_goal[node - goal_low]
            if cost < least:
                least, last = cost, node
        for i in range(graph.first[node], graph.first[node + 1]):
            to, cost = graph.endpoints[i], cost_of[node] + graph.costs[i]
            # Marks of earlier searches are smaller: their costs do not count, nor need clearing.
            if mark[to] >= is_open and cost_of[to] <= cost:
                continue
            cell = graph.cells[to]
            key = cost + octile_cost(cell // cols - goal_row, cell % cols - goal_col)
            # The node cannot lead to a cheaper path than the one known, so it need not wait.
            if key >= least:
                continue
            cost_of[to], previous[to], mark[to] = cost, node, is_open
            if size == len(heap):
                heap = np.concatenate((heap, heap))
            push(heap, size, key, to)
            size += 1
    if least == _NONE:
        return np.empty(0, np.int64), expanded, n_cells

    # Start and goal are no nodes: the path has two cells more.
    count = 2
    node = last
    while node >= 0:
        count += 1
        node = previous[node]
    passed = np.empty(count, np.int64)
    passed[0], passed[count - 1] = start, goal
    node = last
    for i in range(count - 2, 0, -1):
        passed[i] = graph.cells[node]
        node = previous[node]
    return passed, expanded, n_cells


@guarded
@njit(cache=True, nogil=True)
def refine(moves, cluster_cells, passed):
    """Return the flat cells of the path that refines an abstract one, and the cells expanded.

    Two cells in a row lie in one cluster, or face each other across the side of two.
    """
    cols = moves.shape[1]
    distance = np.empty((cluster_cells, cluster_cells), np.int64)
    waiting = np.empty((3, 8 * cluster_cells * cluster_cells), np.int32)
    path = np.empty(max(1024, cluster_cells * cluster_cells), np.int64)
    path[0] = passed[0]
    size = 1
    expanded = 0
    for i in range(passed.size - 1):
        cell, end = passed[i], passed[i + 1]
        while size + cluster_cells * cluster_cells > path.size:
            path = grow(path)
        if cluster_at(cols, cluster_cells, cell) != cluster_at(cols, cluster_cells, end):
            path[size] = end
            size += 1
            continue
        expanded += flood(moves, cluster_cells, end, distance, waiting)
        row0, col0 = (
            cell // cols // cluster_cells * cluster_cells,
            cell % cols // cluster_cells * cluster_cells,
        )
        row, col = cell // cols - row0, cell % cols - col0
        while distance[row, col] > 0:
            for k in range(8):
                to_row, to_col = row + ROW_STEP[k], col + COL_STEP[k]
                if not (moves[row0 + row, col0 + col] >> k & 1):
                    continue
                if not (0 <= to_row < cluster_cells and 0 <= to_col < cluster_cells):
                    continue
                step = DIAGONAL if k & 1 else STRAIGHT
                if distance[to_row, to_col] == distance[row, col] - step:
                    row, col = to_row, to_col
                    break
            path[size] = (row0 + row) * cols + col0 + col
            size += 1
    return path[:size], expanded


@njit(cache=True, nogil=True)
def smooth(moves, path, reach, position):
    """Return a path shortened by straight lines, by the method of the authors of HPA*.

    From a cell of the path, lines of at most `reach` legal moves run in the eight directions, each
    up to the first cell of the path that it meets. The line that saves most replaces the path
    between its endpoints, and its far end is next; if none saves, the next cell of the path is.
    `position` (one entry a cell) is -1 throughout before and after. A straight line has the fewest
    moves of all paths between its endpoints, so the path gets no more cells.
    """
    cols = moves.shape[1]
    n = path.size
    cost_to = np.zeros(n, np.int64)
    position[path[0]] = 0
    for i in range(1, n):
        same_row = path[i] // cols == path[i - 1] // cols
        same_col = path[i] % cols == path[i - 1] % cols
        cost_to[i] = cost_to[i - 1] + (STRAIGHT if same_row or same_col else DIAGONAL)
        position[path[i]] = i
    smoothed = np.empty(n, np.int64)
    smoothed[0] = path[0]
    size = 1
    # A path that returns to a cell is cut short: the last visit counts.
    at = np.int64(position[path[0]])
    while at < n - 1:
        cell = path[at]
        joins, heading, length, saved = at + 1, -1, 0, 0
        for k in range(8):
            row, col, steps = cell // cols, cell % cols, 0
            meets = np.int64(-1)
            while meets < 0 and steps < reach and moves[row, col] >> k & 1:
                row, col, steps = row + ROW_STEP[k], col + COL_STEP[k], steps + 1
                meets = np.int64(position[row * cols + col])
            if meets > at:
                step = DIAGONAL if k & 1 else STRAIGHT
                saving = cost_to[meets] - cost_to[at] - steps * step
                if saving > saved:
                    joins, heading, length, saved = meets, k, steps, saving
        for _ in range(length - 1):
            cell += ROW_STEP[heading] * cols + COL_STEP[heading]
            smoothed[size] = cell
            size += 1
        smoothed[size] = path[joins]
        size += 1
        at = np.int64(position[path[joins]])
    for i in range(n):
        position[path[i]] = -1
    return smoothed[:size]
