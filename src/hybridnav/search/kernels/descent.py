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
_ROOT = 0.41421356237309515  # a diagonal is longer than a side by it
FARTHEST = 8
"""Horizons that a straight window looks ahead."""
EAGER = 1.1
"""Factor of the estimate below the top: without it routes of many fields see all that are kept."""
LAST = 1.5
"""Horizons, or parts, within which a window of A* leads to the goal: the end of another one would
bend a short path much."""
PART = 8
"""Fields that a part of a route looks ahead along the route above it."""


class LevelFields(NamedTuple):
    """The fields of the levels that a descent visits, the places first, the smallest ones last."""

    starts: np.ndarray
    """int64 (n_levels + 1,), the fields of level k are starts[k] .. starts[k + 1]."""
    first: np.ndarray
    """int64 (n + 1,), the neighbours of field v are first[v] .. first[v + 1] of the next two."""
    neighbour: np.ndarray
    """int32 (m,), fields of the same level that a route may pass, each once."""
    cost: np.ndarray
    """float32 (m,), the cost of going there, in cells."""
    parent: np.ndarray
    """int32 (n,), the field of the level above that holds it, -1 for places."""
    middle: np.ndarray
    """float32 (n, 2), row and column from which the way to the goal is estimated."""
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
    """int64 (n,), the search that wrote both, negative once the field is expanded."""
    kept: np.ndarray
    """int64 (n,), the descent that kept the field."""
    listed: np.ndarray
    """int32 (n,), fields in the order in which they are kept."""
    told: np.ndarray
    """int64 (6,), status: `NO_WAY`, `FULL`, or how many of the last fields are listed; the number
    of the last search; fields expanded at all levels; cells expanded; cells of the fields that are
    listed; diagonal moves of the path."""
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
    holder: np.ndarray
    """int32 (n_cells,), the surviving cell, flat, of the vertex that holds each cell, -1 for none:
    what a change of the map leaves as it is elsewhere."""
    vertices: np.ndarray
    """int64 (n,), these surviving cells, ascending."""
    field_of: np.ndarray
    """int64 (n,), the field of the last level that is made of each vertex, -1 for none."""
    successors: np.ndarray
    """uint32 (9 * 256,), see `grid_search.move_tables`."""
    limit: int
    """Integer cost that a window's path must stay below; where cells are closed, small."""


@njit(cache=True, nogil=True)
def _search(fields, marks, numbers, start, aim, is_limited):
    """Find the cheapest route from a field to another one of its level, or into a field above (A*).

    The estimate is the straight line at the top, where it is consistent: no arc costs less between
    its middles. Below it is `EAGER` times the octile distance. It is 0 where the route may end. The
    cost of the start is what `marks` has.

    Parameters
    ----------
    fields, marks
        The levels, and what is written.
    numbers
        The number of this descent, and that of this search.
    start, aim
        The field of the start. The field of the goal, or -1; the field above any of whose sons is a
        goal, or -1; and the row and column to which the estimate leads.
    is_limited
        Whether a route may pass only sons of fields that were kept above.

    Returns
    -------
    tuple
        Fields expanded, `NO_WAY` or `FULL` without a route; and the field where it ends.
    """
    number, stamp = numbers
    goal, above, goal_row, goal_col = aim
    heap, size, expanded = marks.heap, 1, 0
    heap[0, 0], heap[0, 1] = 0.0, start
    marks.came[start], marks.seen[start] = -1, stamp
    while size > 0:
        v = np.int64(pop(heap, size))
        size -= 1
        if marks.seen[v] < 0:
            continue  # an entry from before it was improved
        marks.seen[v] = -stamp
        if v == goal or (above >= 0 and fields.parent[v] == above):
            return expanded, v
        expanded += 1
        if size + fields.first[v + 1] - fields.first[v] > heap.shape[0]:
            return FULL, v
        for at in range(fields.first[v], fields.first[v + 1]):
            w = np.int64(fields.neighbour[at])
            seen = marks.seen[w]
            if seen == -stamp:
                continue
            parent = fields.parent[w]
            if is_limited and marks.kept[parent] != number:
                continue
            cost = marks.cost[v] + fields.cost[at]
            if seen == stamp and cost >= marks.cost[w]:
                continue
            marks.cost[w], marks.came[w], marks.seen[w] = cost, v, stamp
            rows = abs(fields.middle[w, 0] - goal_row)
            cols = abs(fields.middle[w, 1] - goal_col)
            left = 0.0
            if is_limited and w != goal and parent != above:
                left = EAGER * (max(rows, cols) + _ROOT * min(rows, cols))
            elif w != goal and not is_limited:
                left = math.sqrt(rows * rows + cols * cols)
            push(heap, size, cost + left, float(w))
            size += 1
    return NO_WAY, start


@njit(cache=True, nogil=True)
def _search_below(fields, marks, numbers, ends, goal_at, n_above):
    """Find a route among the sons of what is kept, part by part along the route above it.

    A part leads into the field of the route above that is `PART` fields ahead, or to the goal. Four
    fifths of it are taken, and the next one begins there, so that effort grows with the route: a
    search of all of it at once expands most of what is kept where the route is long.

    Parameters
    ----------
    fields, marks, numbers
        As in `_search`; the second number is that of the first part.
    ends, goal_at
        The fields of start and goal; the row and column of the goal.
    n_above
        How many fields the route above has; they are listed first.

    Returns
    -------
    tuple
        Fields expanded, `NO_WAY` or `FULL` without a route; and the number of the last part.
    """
    number, stamp = numbers
    v, goal = ends
    listed, last, size, expanded = marks.listed, marks.listed.size - 1, 1, 0
    listed[last], marks.kept[v], marks.cost[v] = v, -number, 0.0  # the route, backwards at the end
    at = n_above - 1
    while v != goal:
        # Where this part leads: into a field above, or to the goal.
        to = at - PART if at > PART * LAST else 0
        above = np.int64(listed[to])
        aim = (goal, np.int64(-1), float(goal_at[0]), float(goal_at[1]))
        if to > 0:
            row, col = float(fields.middle[above, 0]), float(fields.middle[above, 1])
            aim = (np.int64(-1), above, row, col)
        stamp += 1
        effort, w = _search(fields, marks, (number, stamp), v, aim, True)
        if effort < 0:
            return effort, stamp
        expanded += effort
        # Turn its links round, so that they lead from v on.
        n_part, following = 0, -1
        while w != v:
            before = np.int64(marks.came[w])
            marks.came[w], following, w = following, w, before
            n_part += 1
        marks.came[v], u = following, v
        # List four fifths of it, the whole of the last one.
        for _ in range(n_part if to == 0 else max(n_part * 4 // 5, min(n_part, 1))):
            u = np.int64(marks.came[u])
            if marks.kept[u] != -number:
                listed[last - size], marks.kept[u] = u, -number
                size += 1
            while listed[last - size + 1] != u:  # where it meets itself, a loop is left out
                size -= 1
                marks.kept[listed[last - size]] = 0
        v = u
        at -= max((at - to) * 4 // 5, 1)
    # Links and costs along the whole route, as one search would leave them.
    came, cost = np.int64(-1), 0.0
    for i in range(last, last - size, -1):
        v = np.int64(listed[i])
        if came >= 0:
            arc = fields.first[came]
            while fields.neighbour[arc] != v:
                arc += 1
            cost += fields.cost[arc]
        marks.came[v], marks.cost[v], came = came, cost, v
    return expanded, stamp


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
                if marks.kept[w] != number:
                    marks.kept[w], marks.listed[n_listed] = number, w
                    n_listed += 1
        low = high
    return n_listed, n_route


@njit(cache=True, nogil=True)
def _with_room(path, n_path, n_more):
    """Return a path with room for more cells."""
    if n_path + n_more <= path.size:
        return path
    longer = np.empty(2 * (n_path + n_more), np.int32)
    longer[:n_path] = path[:n_path]
    return longer


@njit(cache=True, nogil=True)
def _straight(ground, cell, target, path, at):
    """Write the cells that lead straight on to the target into a path, without the first one.

    Diagonal moves are taken as soon as they are legal, the others where they are not: no path is
    shorter. Return how many there are, 0 where neither is legal.
    """
    cols = ground.cols
    rows, columns = target // cols - cell // cols, target % cols - cell % cols
    k_row, row_step = (2, cols) if rows > 0 else (6, -cols)
    k_col, col_step = (0, 1) if columns > 0 else (4, -1)
    k_both = (3 if k_col else 1) if rows > 0 else (5 if k_col else 7)
    rows, columns = abs(rows), abs(columns)
    k_side, side_step = (k_row, row_step) if rows > columns else (k_col, col_step)
    n_both, n_side = min(rows, columns), abs(rows - columns)
    n = 0
    while n_both + n_side > 0:
        moves = np.int64(ground.moves[np.uint64(cell)])
        if n_both > 0 and moves >> k_both & 1:
            n_both -= 1
            cell += row_step + col_step
        elif n_side > 0 and moves >> k_side & 1:
            n_side -= 1
            cell += side_step
        else:
            return 0
        path[at + n] = cell
        n += 1
    return n


@njit(cache=True, nogil=True)
def _walk(fields, marks, ground, window, ends, n_route, horizon):
    """Find a path along the route of the last fields, window by window.

    A window leads from where the path ends to the surviving cell of the first field of the route
    that is so many cells ahead, or to the goal: straight on, of windows of `FARTHEST` times the
    horizon and less the first for which that is legal; else by A*, `horizon` cells ahead, or to a
    goal not much farther. Four fifths of its shortest path are taken, so that no window's end bends
    the path much, and the next window begins there. In so short a window A* expands little more
    than the path.

    Parameters
    ----------
    fields, marks, ground
        As in `descend`.
    window
        The number before that of the first window.
    ends
        Flat cells of start and goal.
    n_route
        How many fields the route has; they are listed first.
    horizon
        Cells that a window of A* looks ahead, > 0.

    Returns
    -------
    tuple
        The cells, int64 (k, 2), the number of the last window, the cells expanded, and the diagonal
        moves. Without a path, no cells, and a status in place of the diagonal moves.
    """
    start, goal = ends
    cols, waits = ground.cols, (marks.records, marks.waiting)
    path, n_path, expanded = np.empty(1024, np.int32), 1, 0
    path[0] = start
    base = fields.starts[fields.starts.size - 2]
    cell, at = np.int64(start), n_route - 1
    while cell != goal:
        # The route is listed backwards.
        reached, ahead, to = marks.cost[marks.listed[at]], FARTHEST * horizon, at
        while to > 0 and marks.cost[marks.listed[to]] < reached + ahead:
            to -= 1
        # Straight on to the farthest field for which that is legal.
        while True:
            while to > 0 and ground.moves[fields.survivor[marks.listed[to] - base]] == 0:
                to -= 1  # a closed cell, to which nothing leads
            target = fields.survivor[marks.listed[to] - base] if to > 0 else goal
            most = max(abs(target // cols - cell // cols), abs(target % cols - cell % cols))
            path = _with_room(path, n_path, most)
            size = _straight(ground, cell, target, path, n_path)
            if size > 0 or ahead <= horizon:
                break
            ahead /= 2
            while to < at - 1 and marks.cost[marks.listed[to + 1]] >= reached + ahead:
                to += 1
        expanded += size
        if size == 0:
            # Else by A* to the field a horizon ahead.
            if marks.cost[marks.listed[0]] < reached + LAST * horizon:
                target, to = goal, 0
            window += 1
            cost, effort = astar(
                ground.moves, cols, (cell, target), ground.limit, None,
                ground.successors, ground.successors, None, None, waits[0], window, waits[1],
            )  # fmt: skip
            expanded += effort
            if cost < 0:
                status = FULL if cost == BUCKET_FULL else NO_WAY
                return np.empty((0, 2), np.int64), window, expanded, status
            part = trace(marks.records, cols, cell, target)
            size = part.size - 1
            path = _with_room(path, n_path, size)
            path[n_path : n_path + size] = part[1:]
        # None where closed cells led the choice back to the cell in hand.
        n_path += size if target == goal else min(max(size * 4 // 5, 1), size)
        cell = np.int64(path[n_path - 1])
        # The route's field that lies as far on; one at least, so that windows end.
        at -= 1
        while at > to and marks.cost[marks.listed[at]] < reached + 0.8 * ahead:
            at -= 1
        at = max(at, 0)
    cells, diagonals = np.empty((n_path, 2), np.int64), 0
    for i in range(n_path):
        cells[i, 0] = path[i] // cols
        cells[i, 1] = path[i] - cells[i, 0] * cols
        diagonals += i > 0 and cells[i, 0] != cells[i - 1, 0] and cells[i, 1] != cells[i - 1, 1]
    return cells, window, expanded, diagonals


@njit(cache=True, nogil=True)
def _index(cells, cell):
    """Return where a cell stands among ascending ones."""
    low, high = 0, cells.size
    while low < high:
        middle = low + high >> 1
        if cells[middle] < cell:
            low = middle + 1
        else:
            high = middle
    return low


@guarded
@njit(cache=True, nogil=True)
def descend(fields, marks, ground, number, ends, rings, horizon, named):
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
    named
        The level whose route is returned; -1 for none.

    Returns
    -------
    tuple
        int32 (n,), the named fields of the route, from goal to start, counted from 0 in their
        level; int64 (k, 2), the cells of the path, none without one. `marks.told` has the rest.
    """
    starts, cols = fields.starts, ground.cols
    last = starts.size - 2
    goal_at = (ends[1] // cols, ends[1] % cols)
    route, path, told = np.empty(0, np.int32), np.empty((0, 2), np.int64), marks.told
    told[:] = NO_WAY, number, 0, 0, 0, 0

    chain = np.empty((last + 1, 2), np.int64)
    for side in range(2):
        vertex = _index(ground.vertices, ground.holder[ends[side]])
        chain[last, side] = starts[last] + ground.field_of[vertex]
        for k in range(last, 0, -1):
            chain[k - 1, side] = fields.parent[chain[k, side]]

    n_listed = n_route = np.int64(0)
    for k in range(last + 1):
        at_level = (chain[k, 0], chain[k, 1])
        if k == 0:
            aim = (at_level[1], np.int64(-1), float(goal_at[0]), float(goal_at[1]))
            marks.cost[at_level[0]] = 0.0
            effort, _ = _search(fields, marks, (number, number), at_level[0], aim, False)
        else:
            effort, told[1] = _search_below(
                fields, marks, (number, told[1]), at_level, goal_at, n_route
            )
        if effort < 0:
            told[0] = effort
            return route, path
        told[2] += effort
        ring = rings[k] if k < last or horizon <= 0 else 0
        n_listed, n_route = _keep(fields, marks, number, chain[k, 1], ring)
        if k == named:
            route = marks.listed[:n_route] - np.int32(starts[k])
    told[0] = n_listed
    for i in range(n_listed):
        told[4] += fields.areas[marks.listed[i] - starts[last]]
    if horizon > 0:
        path, told[1], told[3], told[5] = _walk(
            fields, marks, ground, told[1], ends, n_route, horizon
        )
        if path.shape[0] == 0:
            told[0], told[5] = told[5], 0
    return route, path
