"""Kernels of the cells between border cells of the finest fields, step by stored step."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._cost_kernels import BLOCK_BITS, move_cost, slot_of
from hybridnav.overlay._lane_kernels import LANES, NO_PATH, STEP_BITS
from hybridnav.overlay._path_kernels import append
from hybridnav.search.moves import COL_STEP, ROW_STEP


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
