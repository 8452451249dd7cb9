"""Kernels of a descent through the levels of a pyramid: fields, what is kept of them, and cells."""

import math
from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import pop, push
from hybridnav._base.kernels.moves import BUCKET_FULL, trace
from hybridnav.search.kernels.grid_search import astar

NO_WAY = -1
"""Status of a descent that found no route at a level, or no path in its fields."""
FULL = BUCKET_FULL
"""Status of a descent whose open list has too little room."""
_UNLIMITED = 1 << 62
_ROOT = 0.41421356237309515  # a diagonal is longer than a side by it


class LevelFields(NamedTuple):
    """The fields of the levels that a descent visits, the places first, the smallest ones last."""

    starts: np.ndarray
    """int64 (n_levels + 1,), the fields of level k are starts[k] .. starts[k + 1]."""
    first: np.ndarray
    """int64 (n + 1,), the neighbours of field v are first[v] .. first[v + 1] of the next two."""
    neighbour: np.ndarray
    """int32 (m,), fields of the same level, each once."""
    cost: np.ndarray
    """float32 (m,), the cost of going there, in cells."""
    parent: np.ndarray
    """int32 (n,), the field of the level above that holds it, -1 for places."""
    middle: np.ndarray
    """float32 (n, 2), row and column from which the way to the goal is estimated."""
    open: np.ndarray
    """bool (n,), whether a route may pass the field."""
    survivor: np.ndarray
    """int64 (fields of the last level,), the surviving cell of each, flat."""
    areas: np.ndarray
    """int64 (fields of the last level,), the cells of each."""


class Marks(NamedTuple):
    """What a descent writes. Its number stamps it, so that nothing is cleared between two."""

    cost: np.ndarray
    """float64 (n,), cost of the best route to each field, in cells."""
    came: np.ndarray
    """int32 (n,), the field before it on that route, -1 for the first."""
    seen: np.ndarray
    """int64 (n,), the descent that wrote both, negative once the field is expanded."""
    kept: np.ndarray
    """int64 (n,), the descent that kept the field."""
    listed: np.ndarray
    """int32 (n + 1,), fields in the order in which they are kept; last, how many are inside."""
    inside: np.ndarray
    """bool (fields of the last level,), the corridor of this descent, and of no other one."""
    told: np.ndarray
    """int64 (5,), status: `NO_WAY`, `FULL`, or the fields of the corridor; the number of the last
    window; fields expanded at all levels; cells expanded; cells of the corridor."""
    heap: np.ndarray
    """float64 (room, 2), open list of fields: estimates, and the fields."""
    records: np.ndarray
    """int64 (n_cells,), what A* records of cells."""
    waiting: np.ndarray
    """int32 (room,), its open list."""


class MapCells(NamedTuple):
    """The cells of the map, as A* takes them."""

    moves: np.ndarray
    """uint8 (n_cells,), legal moves."""
    cols: int
    """Columns of the map."""
    field_of: np.ndarray
    """int32 (n_cells,), the field of the last level that holds each cell, -1 for none."""
    successors: np.ndarray
    """uint32 (9 * 256,), see `grid_search.move_tables`."""
    detours: np.ndarray
    """uint32 (9 * 256,), the other table."""


@njit(cache=True, nogil=True)
def _search(fields, marks, number, ends, goal_at, is_limited):
    """Find the cheapest route between two fields of a level (A*).

    The estimate is the straight line at the top, where arcs cost their max-distance, and the octile
    distance below it. Both are consistent: no arc costs less between its middles. It is 0 at the
    goal's field, and measured to the goal's cell elsewhere.

    Parameters
    ----------
    fields, marks, number
        The levels, what is written, and the number of this descent.
    ends, goal_at
        The fields of start and goal; the row and column of the goal.
    is_limited
        Whether a route may pass only sons of fields that were kept above.

    Returns
    -------
    int
        LevelFields expanded; `NO_WAY` or `FULL` without a route.
    """
    start, goal = ends
    heap, size, expanded = marks.heap, 1, 0
    heap[0, 0], heap[0, 1] = 0.0, start
    marks.cost[start], marks.came[start], marks.seen[start] = 0.0, -1, number
    while size > 0:
        v = np.int64(pop(heap, size))
        size -= 1
        if marks.seen[v] < 0:
            continue  # an entry from before it was improved
        marks.seen[v] = -number
        if v == goal:
            return expanded
        expanded += 1
        if size + fields.first[v + 1] - fields.first[v] > heap.shape[0]:
            return FULL
        for at in range(fields.first[v], fields.first[v + 1]):
            w = np.int64(fields.neighbour[at])
            seen = marks.seen[w]
            if seen == -number or not fields.open[w]:
                continue
            if is_limited and marks.kept[fields.parent[w]] != number:
                continue
            cost = marks.cost[v] + fields.cost[at]
            if seen == number and cost >= marks.cost[w]:
                continue
            marks.cost[w], marks.came[w], marks.seen[w] = cost, v, number
            rows = abs(fields.middle[w, 0] - goal_at[0])
            cols = abs(fields.middle[w, 1] - goal_at[1])
            left = 0.0
            if w != goal and is_limited:
                left = max(rows, cols) + _ROOT * min(rows, cols)
            elif w != goal:
                left = math.sqrt(rows * rows + cols * cols)
            push(heap, size, cost + left, float(w))
            size += 1
    return NO_WAY


@njit(cache=True, nogil=True)
def _keep(fields, marks, number, goal, ring):
    """Keep the fields of the route to the goal, and so many rings of fields round them.

    Return how many fields are listed, those of the route first, from the goal to the start, and
    how many these are.
    """
    n_listed = 0
    v = np.int64(goal)
    while v >= 0:
        marks.kept[v], marks.listed[n_listed] = number, v
        n_listed += 1
        v = np.int64(marks.came[v])
    n_route, low = n_listed, 0
    for _ in range(ring):
        high = n_listed
        for i in range(low, high):
            v = np.int64(marks.listed[i])
            for at in range(fields.first[v], fields.first[v + 1]):
                w = np.int64(fields.neighbour[at])
                if fields.open[w] and marks.kept[w] != number:
                    marks.kept[w], marks.listed[n_listed] = number, w
                    n_listed += 1
        low = high
    return n_listed, n_route


@njit(cache=True, nogil=True)
def _walk(fields, marks, ground, number, ends, listed, horizon):
    """Find a path in the corridor, window by window.

    A window leads from where the path ends to the surviving cell of the first field of the route
    that is `horizon` cells ahead, or to the goal. Four fifths of its shortest path are taken, so
    that no window's end bends the path much, and the next window begins there. In so short a window
    A* expands little more than the path.

    Parameters
    ----------
    fields, marks, ground, number
        As in `descend`.
    ends
        Flat cells of start and goal.
    listed
        How many fields are listed, and how many of these, the first ones, are the route.
    horizon
        Cells that a window looks ahead, > 0.

    Returns
    -------
    tuple
        The cells, int64 (k, 2); the number of the last window; the cells expanded. Without a path,
        no cells, and a status in place of the window.
    """
    start, goal = ends
    n_route = listed[1]
    path, n_path, expanded = np.empty(1024, np.int32), 1, 0
    path[0] = start
    base = fields.starts[fields.starts.size - 2]
    cell, at, window = np.int64(start), n_route - 1, np.int64(number)
    while cell != goal:
        # The route is listed backwards.
        reached, to = marks.cost[marks.listed[at]], at
        while to > 0 and marks.cost[marks.listed[to]] < reached + horizon:
            to -= 1
        target = fields.survivor[marks.listed[to] - base] if to > 0 else goal
        window += 1
        cost, effort = astar(
            ground.moves, ground.cols, (cell, target), _UNLIMITED,
            ground.successors, ground.detours, ground.field_of, marks.inside,
            marks.records, window, marks.waiting,
        )  # fmt: skip
        expanded += effort
        if cost < 0:
            return np.empty((0, 2), np.int64), (FULL if cost == BUCKET_FULL else NO_WAY), expanded
        part = trace(marks.records, ground.cols, cell, target)
        taken = part.size if target == goal else max(part.size * 4 // 5, min(part.size, 2))
        if n_path + taken > path.size:
            longer = np.empty(2 * (n_path + taken), np.int32)
            longer[:n_path] = path[:n_path]
            path = longer
        path[n_path : n_path + taken - 1] = part[1:taken]
        n_path += taken - 1
        cell = part[taken - 1]
        # The route's field that lies as far on; one at least, so that windows end.
        on = at - 1
        while on > to and marks.cost[marks.listed[on]] < reached + 0.8 * horizon:
            on -= 1
        at = max(on, 0)
    cells = np.empty((n_path, 2), np.int64)
    for i in range(n_path):
        cells[i, 0] = path[i] // ground.cols
        cells[i, 1] = path[i] - cells[i, 0] * ground.cols
    return cells, window, expanded


@guarded
@njit(cache=True, nogil=True)
def descend(fields, marks, ground, number, ends, rings, horizon):
    """Plan on the places, then on the sons of what is kept, down to cells.

    Parameters
    ----------
    fields, marks, ground
        The levels, what is written, and the cells.
    number
        The number of this descent; the next one begins at the number that is returned, plus 1.
    ends
        Flat cells of start and goal.
    rings, horizon
        int64 (n_levels,), rings of fields that each level keeps beside its route; cells that a
        window looks ahead, 0 to find the corridor alone.

    Returns
    -------
    tuple
        int32 (n,), the fields of the route at the top, from goal to start; int64 (k, 2), the cells
        of the path, none without one. `marks.told` has the rest.
    """
    starts, cols = fields.starts, ground.cols
    last = starts.size - 2
    goal_at = (ends[1] // cols, ends[1] % cols)
    # The corridor of the descent before gives way.
    for i in range(marks.listed[marks.listed.size - 1]):
        marks.inside[marks.listed[i] - starts[last]] = False
    marks.listed[marks.listed.size - 1] = 0
    route, path, told = np.empty(0, np.int32), np.empty((0, 2), np.int64), marks.told
    told[:] = NO_WAY, number, 0, 0, 0

    chain = np.empty((last + 1, 2), np.int64)
    for side in range(2):
        chain[last, side] = starts[last] + ground.field_of[ends[side]]
        for k in range(last, 0, -1):
            chain[k - 1, side] = fields.parent[chain[k, side]]

    n_listed = n_route = 0
    for k in range(last + 1):
        at_level = (chain[k, 0], chain[k, 1])
        effort = _search(fields, marks, number, at_level, goal_at, k > 0)
        if effort < 0:
            told[0] = effort
            return route, path
        told[2] += effort
        n_listed, n_route = _keep(fields, marks, number, chain[k, 1], rings[k])
        if k == 0:
            route = marks.listed[:n_route].copy()
    for i in range(n_listed):
        field = marks.listed[i] - starts[last]
        marks.inside[field] = True
        told[4] += fields.areas[field]
    told[0] = marks.listed[marks.listed.size - 1] = n_listed
    if horizon > 0:
        path, told[1], told[3] = _walk(
            fields, marks, ground, number, ends, (n_listed, n_route), horizon
        )
        if path.shape[0] == 0:
            told[0] = told[1]
    return route, path


@njit(cache=True, nogil=True)
def field_sums(field_of, cols, units, n_fields):
    """Return the cells of each field, and the sums of their rows, columns and units, float64
    (n_fields, 4).

    `units`: int32 (n_cells,), factors of cells; None for none, whose sums are 0.
    """
    sums = np.zeros((n_fields, 4))
    for row in range(field_of.size // cols):
        for col in range(cols):
            v = field_of[row * cols + col]
            if v >= 0:
                sums[v, 0] += 1
                sums[v, 1] += row
                sums[v, 2] += col
                if units is not None:
                    sums[v, 3] += units[row * cols + col]
    return sums
