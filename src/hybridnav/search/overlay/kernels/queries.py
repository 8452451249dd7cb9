"""Kernel of a query on a multilevel overlay: up the levels, across, and down."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.moves import COL_STEP, ROW_STEP
from hybridnav.search.overlay.kernels.costs import BLOCK_BITS, move_cost, slot_of, sums_along
from hybridnav.search.overlay.kernels.exits import descend
from hybridnav.search.overlay.kernels.fields import forget, path_inside, search_near, spread
from hybridnav.search.overlay.kernels.gates import join
from hybridnav.search.overlay.kernels.guides import aim
from hybridnav.search.overlay.kernels.lanes import FAR, LANES, NO_PATH, STEP_BITS
from hybridnav.search.overlay.kernels.nodes import climb, least_reach, over_cliques
from hybridnav.search.overlay.kernels.paths import append, back_over_cliques, join_ends, to_finest

TORN = -1
"""Cost of a path whose parts do not meet."""


@njit(cache=True, nogil=True)
def _fields(levels, field, n_levels):
    """Return the fields around a cell, one of each level."""
    around = np.empty(n_levels, np.int64)
    for level in range(n_levels):
        around[level] = field
        field = levels.parent[field]
    return around


@njit(cache=True, nogil=True)
def _highest(levels, around):
    """Return the highest level on which the table of the field around a cell is not stale."""
    level = 0
    while level + 1 < len(around) and not levels.is_stale[around[level + 1]]:
        level += 1
    return level


@njit(cache=True, nogil=True)
def _across(levels, top, ground, around, reaches, goal, best, epsilon, work):
    """Find the least distance over nodes of any level.

    Parameters
    ----------
    levels, top, ground
        See `find_path`.
    around
        Two int64 (levels,), the fields of start and goal on each level.
    reaches
        Two int64 (levels, n), see `climb`.
    goal
        Flat cell of the goal.
    best
        Only less is looked for.
    epsilon
        See `over_cliques`.
    work
        See `NodeWork`.

    Returns
    -------
    tuple
        The distance and a lower bound on it; the highest level of the nodes, -1 if no distance is
        less; int64 (n,) nodes; the number of nodes expanded.
    """
    last = len(around[0]) - 1
    nodes, level_of, expanded = np.empty(0, np.int64), -1, 0
    bound = np.int64(NO_PATH)
    highest = (_highest(levels, around[0]), _highest(levels, around[1]))
    if top.is_current:
        fields = (around[0][last], around[1][last])
        total, over = join(levels, top, fields, (reaches[0][last], reaches[1][last]), best)
        if total < best:
            best, level_of, nodes = total, last, over
    to_goal = least_reach(levels, ground, goal, reaches[1]), reaches[1][last]
    target = aim(levels, ground, top, goal, around[1][last], to_goal)
    for level in range(min(highest[0], highest[1])):
        if around[0][level + 1] != around[1][level + 1]:
            continue
        inner = levels.inner_at[around[0][level + 1]], levels.inner_at[around[0][level + 1] + 1]
        span = (np.int64(levels.node_at[inner[0]]), np.int64(levels.node_at[inner[1]]))
        fields = (around[0][level], around[1][level])
        both = (reaches[0][level], reaches[1][level])
        total, proved, end, count = over_cliques(
            levels, ground, top, span, fields, both, target, best, epsilon, work
        )
        expanded += count
        bound = min(bound, proved)
        if total < best:
            best, level_of = total, level
            nodes = back_over_cliques(work.before, end)
    if not top.is_current:
        span = (np.int64(0), np.int64(-1))
        fields = (around[0][highest[0]], around[1][highest[1]])
        both = (reaches[0][highest[0]], reaches[1][highest[1]])
        total, proved, end, count = over_cliques(
            levels, ground, top, span, fields, both, target, best, epsilon, work
        )
        expanded += count
        bound = min(bound, proved)
        if total < best:
            best, level_of = total, last
            nodes = back_over_cliques(work.before, end)
    return best, min(bound, best), level_of, nodes, expanded


@njit(cache=True, nogil=True)
def _inside(ground, endpoints, distance):
    """Return the distance between two cells of a field inside it, NO_PATH for none, the flat cells
    of the path, and the number of cells expanded; see `find_path`."""
    touched, n, expanded = spread(
        ground, endpoints[0], endpoints[1], distance, np.empty(256, np.int64)
    )
    least, cells = np.int64(NO_PATH), np.empty(0, np.int64)
    if distance[endpoints[1]] < FAR:
        least = np.int64(distance[endpoints[1]])
        cells = path_inside(ground, distance, endpoints[1])
    forget(distance, touched, n)
    return least, cells, expanded


@njit(cache=True, nogil=True)
def _find_flat(ground, levels, top, endpoints, epsilon, near_cells, cell_work, node_work):
    """Find a path of least cost between two cells that may be entered.

    Parameters
    ----------
    ground, levels, top, endpoints, epsilon, near_cells, cell_work, node_work
        See `find_path`.

    Returns
    -------
    tuple
        The cost, and a lower bound on it; int64 (n,) flat cells of the path; the numbers of cells
        and of nodes expanded.
    """
    start, goal = endpoints
    inside, cells, is_proved, expanded = search_near(ground, start, goal, near_cells, cell_work)
    if is_proved:
        return inside, inside, cells, expanded, 0
    n_levels = len(levels.level_at) - 1
    around = (
        _fields(levels, ground.field_of[slot_of(ground, start)], n_levels),
        _fields(levels, ground.field_of[slot_of(ground, goal)], n_levels),
    )
    most = 1
    for level in range(n_levels):
        for every in around:
            most = max(most, levels.node_at[every[level] + 1] - levels.node_at[every[level]])
    reaches = (np.empty((n_levels, most), np.int64), np.empty((n_levels, most), np.int64))
    reach_nodes(levels, ground, endpoints[0], reaches[0][0])
    reach_nodes(levels, ground, endpoints[1], reaches[1][0])
    rows = climb(levels, around[0][0], reaches[0]), climb(levels, around[1][0], reaches[1])
    if around[0][0] == around[1][0]:
        least, passed, count = _inside(ground, endpoints, cell_work)
        expanded += count
        if least < inside:
            inside, cells = least, passed
    cost, bound, level, nodes, n_expanded = _across(
        levels, top, ground, around, reaches, endpoints[1], inside, epsilon, node_work
    )
    if level < 0:
        return cost, bound, cells, expanded, n_expanded
    while level > 1 and nodes.size > 0:
        children = (around[0][level - 1], around[1][level - 1])
        both = (reaches[0][level - 1], reaches[1][level - 1])
        nodes = descend(levels, level, nodes, children, both)
        level -= 1
    if nodes.size > 0:
        nodes = join_ends(
            levels, nodes, (around[0][0], around[1][0]), (reaches[0][0], reaches[1][0]), rows
        )
    nodes = to_finest(levels, ground, nodes)
    # Without nodes the costs contradict each other.
    cells = cells_of_path(levels, ground, endpoints, nodes) if nodes.size > 0 else nodes
    return cost, bound, cells, expanded, n_expanded


@guarded
@njit(cache=True, nogil=True)
def find_path(ground, levels, top, endpoints, epsilon, near_cells, cell_work, node_work):
    """Find a path of least cost between two cells.

    Parameters
    ----------
    ground, levels, top
        See `CellCosts`, `Levels` and `Top`.
    endpoints
        Two flat cells; there is no path from or to a closed one.
    epsilon
        The search ends once no path can be cheaper by more than this part.
    near_cells
        Cells that the search among cells, which comes first, expands at most.
    cell_work
        int32 (rows * cols,), FAR before and after.
    node_work
        See `NodeWork`.

    Returns
    -------
    tuple
        The cost, NO_PATH for no path, `TORN` if stored costs and steps contradict each other, and a
        lower bound on it; int64 (n, 2), (row, col) of the cells of the path, and the sums of
        `sums_along`; the numbers of cells and of nodes expanded.
    """
    for end in endpoints:
        slot = slot_of(ground, end)
        if ground.field_of[slot] < 0 or ground.units[slot] <= 0:
            return np.int64(NO_PATH), np.int64(NO_PATH), np.empty((0, 2), np.int64), (0, 0), 0, 0
    cost, bound, flat, expanded, n_expanded = _find_flat(
        ground, levels, top, endpoints, epsilon, near_cells, cell_work, node_work
    )
    cells, gap = np.empty((flat.size, 2), np.int64), np.int64(0)
    row_before, col_before = endpoints[0] // ground.cols, endpoints[0] % ground.cols
    for i in range(flat.size):
        row = np.int64(np.uint32(flat[i]) // np.uint32(ground.cols))
        col = flat[i] - row * ground.cols
        cells[i, 0], cells[i, 1] = row, col
        gap = max(gap, abs(row - row_before), abs(col - col_before))
        row_before, col_before = row, col
    if cost < NO_PATH and (flat.size == 0 or gap > 1 or flat[-1] != endpoints[1]):
        cost = np.int64(TORN)
        return cost, cost, cells, (cost, cost), expanded, n_expanded
    return cost, bound, cells, sums_along(ground, cells), expanded, n_expanded


# Kernels of the cells between border cells of the finest fields, step by stored step.


@njit(cache=True, nogil=True)
def _steps_to(levels, field, i):
    """Return where the steps to the i-th node of a field of the finest level begin, its bit, and
    the number of cells with steps, which no path exceeds."""
    blocks = (levels.node_at[field + 1] - levels.node_at[field] + LANES - 1) // LANES
    size = (levels.steps_at[field + 1] - levels.steps_at[field]) // blocks
    return levels.steps_at[field] + i // LANES * size, i % LANES, size // STEP_BITS


@njit(cache=True, nogil=True)
def _step(levels, slot, lane):
    """Return the direction of the step from the cell in a slot; see `_steps_to`."""
    steps, bit = levels.steps, lane[1]
    at = min(lane[0] + STEP_BITS * np.int64(levels.place_of[slot]), steps.size - STEP_BITS)
    low, middle, high = steps[at] >> bit & 1, steps[at + 1] >> bit & 1, steps[at + 2] >> bit & 1
    return np.int64(low | middle << 1 | high << 2)


@njit(cache=True, nogil=True)
def reach_nodes(levels, ground, cell, reach):
    """Compute the distances from a cell to the nodes of its field of the finest level, inside it.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    cell
        Flat cell.
    reach
        int64 (n,), n >= the number of nodes, changed.
    """
    units, cols = ground.units, ground.cols
    field = np.int64(ground.field_of[slot_of(ground, cell)])
    first = levels.node_at[field]
    for i in range(levels.node_at[field + 1] - first):
        goal, here, total = np.int64(levels.cell_of[first + i]), np.int64(cell), np.int64(0)
        lane, slot = _steps_to(levels, field, i), slot_of(ground, here)
        for _ in range(lane[2]):
            if here == goal:
                break
            k = _step(levels, slot, lane)
            other = here + ROW_STEP[k] * cols + COL_STEP[k]
            # Without a path the steps end at the border, or at a wall.
            if not ground.moves[slot] >> k & 1:
                break
            next_slot = slot_of(ground, other)
            if ground.field_of[next_slot] != field:
                break
            total += move_cost(units[slot] + units[next_slot], k)
            here, slot = other, next_slot
        reach[i] = total if here == goal else np.int64(NO_PATH)


@njit(cache=True, nogil=True)
def append_steps(levels, ground, cell, node, cells, n):
    """Append the cells of a shortest path inside a field from a cell to a node, without its first.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    cell, node
        A flat cell, and a node of its field of the finest level that it reaches inside.
    cells, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `cells`, in a new array if there was no room, and the number filled: without the node's cell
        if the steps do not lead there.
    """
    field, cell = np.int64(levels.field_of[node]), np.int64(cell)
    lane = _steps_to(levels, field, node - levels.node_at[field])
    goal, most = np.int64(levels.cell_of[node]), ground.block_at.size << BLOCK_BITS
    for _ in range(lane[2]):
        if cell == goal or not 0 <= cell < most:
            break
        k = _step(levels, slot_of(ground, cell), lane)
        cell += ROW_STEP[k] * ground.cols + COL_STEP[k]
        cells = append(cells, n, cell)
        n += 1
    return cells, n


@njit(cache=True, nogil=True)
def cells_of_path(levels, ground, endpoints, nodes):
    """Return the flat cells of a path from a cell over nodes of the finest level to another cell.

    Parameters
    ----------
    levels, ground
        See `Levels` and `CellCosts`.
    endpoints
        The two flat cells.
    nodes
        int64 (m,), m >= 1; some follow each other on the same cell.
    """
    cells = np.empty(512, np.int64)
    cells[0] = endpoints[0]
    cells, n = append_steps(levels, ground, endpoints[0], nodes[0], cells, 1)
    for i in range(1, nodes.size):
        before, node = nodes[i - 1], nodes[i]
        if levels.field_of[before] == levels.field_of[node]:
            cells, n = append_steps(levels, ground, levels.cell_of[before], node, cells, n)
        else:
            cells = append(cells, n, levels.cell_of[node])
            n += 1
    tail = np.empty(64, np.int64)
    tail[0] = endpoints[1]
    tail, m = append_steps(levels, ground, endpoints[1], nodes[-1], tail, 1)
    for i in range(m - 2, -1, -1):
        cells = append(cells, n, tail[i])
        n += 1
    return cells[:n]
